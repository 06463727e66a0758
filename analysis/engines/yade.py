"""YADE as an engine: yade_scripts/crowd.py on a scene, in a process of its own, without network
ports."""

from __future__ import annotations

import functools
import re
import shutil
import subprocess
from pathlib import Path

from analysis.engines.dump_checks import check_bodies, check_contacts
from analysis.engines.process import SCENE_FILE, Progress, digest_of, run_process, stage, staged
from analysis.engines.record import EngineError, RunRecord
from analysis.scene.scene import Scene
from analysis.support.shipped import shipped

NAME = "yade"
INSTALL = "YADE (the command yade) is not found; install it from the system's packages: apt-get install yade"


def find() -> Path | None:
    """The `yade` on the PATH, or None."""
    found = shutil.which("yade")
    return Path(found) if found else None


def version() -> str | None:
    """YADE's version, such as `2023.02a`; None where it is missing or does not start."""
    command = find()
    if command is None:
        return None
    try:
        said = subprocess.run(
            [command, "--version"], capture_output=True, text=True, timeout=60, check=False
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return None
    match = re.search(r"Yade version: (\S+)", said)
    return match[1] if match else None


def scripts_folder() -> Path:
    """Where the scripts are: `yade_scripts/` of a checkout, or the installed package data."""
    return shipped("yade_scripts")


@functools.cache
def deck_digest() -> str:
    """Of the scripts: a run made with others is made anew."""
    return digest_of(scripts_folder().glob("*.py"))


def prepare(scene: Scene, folder: Path) -> None:
    """Prepare a run of the scene whose results will be in `folder`; what is there stays until the
    run is whole.

    Raises EngineError if YADE is missing or cannot run the scene's contact law (it runs hooke only
    here)."""
    command, known = find(), version()
    if command is None or known is None:
        raise EngineError(
            INSTALL
            if command is None
            else f"{command} does not start; reinstall it: apt-get install yade"
        )
    if scene.contact.law != "hooke":
        raise EngineError(
            f"{scene.name}: contact.law: {scene.contact.law}; YADE runs hooke only here, LAMMPS runs both"
        )
    stage(scene, folder, NAME, known, deck_digest())


def run(folder: Path, *, progress: Progress | None = None) -> RunRecord:
    """Run what was prepared; then `folder` holds scene.toml, scene.data, bodies.dump,
    contacts.dump, a log and run.json.

    `progress` is called with the finished share. Raises EngineError (an engine that dies, lost
    disks, an explosion); then, and when interrupted, `folder` stays as it was."""
    with staged(folder, NAME) as (staging, record, scene):
        command = find()
        if command is None:
            raise EngineError(INSTALL)
        scripts = scripts_folder()
        # the virtual environment's Python path is not for YADE, which brings its own Python
        environment = {
            "PYTHONPATH": str(scripts),
            "PYTHONDONTWRITEBYTECODE": "1",
            "OMP_NUM_THREADS": "1",
        }
        words = [
            str(command),
            "-L",
            "noserver",
            "-j1",
            "-n",
            "-x",
            str(scripts / "crowd.py"),
            SCENE_FILE,
            "out=.",
            f"dt={record.time_step_s!r}",
        ]
        record = run_process(words, staging, record, progress, environment)
        kinetic = check_bodies(staging / "bodies.dump", record, scene)
        check_contacts(staging / "contacts.dump", kinetic, record, scene)
        record.write(staging)
    return record
