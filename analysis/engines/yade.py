"""YADE as an engine: yade_scripts/crowd.py on a scene, without network ports."""

import functools
import shutil
from pathlib import Path

from analysis.engines.penalty import penalty_of, penalty_setting
from analysis.engines.process import Command, digest_of, version_said
from analysis.engines.record import EngineError
from analysis.scene.scene import Scene
from analysis.support.files import shipped

NAME, TITLE, COMMAND, ASK = "yade", "YADE", "yade", "--version"
INSTALL = "apt-get install --no-install-recommends yade"
RESUMES = False
timing, setting = penalty_of, penalty_setting


def find() -> Path | None:
    """Return the `yade` on the PATH, or None."""
    found = shutil.which(COMMAND)
    return Path(found) if found else None


def version() -> str | None:
    """Ask for the version, such as `2023.02a`; None where YADE is missing or does not start."""
    return version_said(find(), ASK, r"Yade version: (\S+)")


def scripts_folder() -> Path:
    """Return where the scripts are: `yade_scripts/` of a checkout, or the installed package
    data."""
    return shipped("yade_scripts")


@functools.cache
def deck_digest() -> str:
    """Return the digest of the scripts; a run with others is not taken for one with these."""
    return digest_of(scripts_folder().glob("*.py"))


def check(scene: Scene) -> None:
    """Raise EngineError for hertz with friction, YADE's tangential spring being another there."""
    if scene.contact.friction and NAME not in scene.contact.kind.friction:
        raise EngineError(
            f"{scene.name}: contact.friction: {scene.contact.friction:g}; YADE runs {scene.contact.law} without "
            "friction here, LAMMPS runs both"
        )


def write_input(scene: Scene, decks: Path) -> None:
    """Write copies of the scripts."""
    decks.mkdir()
    for script in scripts_folder().glob("*.py"):
        shutil.copyfile(script, decks / script.name)


def command(
    folder: Path, time_step_s: float, *, decks: str, out: str = ".", guard: bool = True
) -> Command:
    """Return the command that runs what `write_input` wrote."""
    words = (str(find()), "-L", "noserver", "-j1", "-n", "-x", f"{decks}/crowd.py", "scene.toml")
    given = (f"out={out}", f"dt={time_step_s!r}", *(() if guard else ("guard=no",)))
    # the virtual environment's Python path is not for YADE, which brings its own Python
    environment = {
        "PYTHONPATH": str((folder / decks).absolute()),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
    }
    return Command(words=(*words, *given), environment=environment)


def collect(scene: Scene, folder: Path) -> None:
    """YADE writes the form of all engines itself."""
