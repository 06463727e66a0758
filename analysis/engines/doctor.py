"""What is installed: the engines and the libraries, their versions, and what to do about a missing
one."""

from __future__ import annotations

import importlib
import importlib.metadata
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from analysis.engines import lammps, yade

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
LIBRARIES = ("MDAnalysis", "numba", "numpy", "scipy", "PedPy")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that was looked for. state: `ok`; `missing`: nothing works without it; `optional`:
    not there, and the advice says what is lost and how to get it. version and path are None where
    it was not found."""

    name: str
    version: str | None
    path: Path | None
    state: Literal["ok", "missing", "optional"]
    advice: str = ""


def examine() -> list[Finding]:
    """Look for Python, LAMMPS, YADE, the libraries and a browser, by starting each or importing
    it."""
    findings = [_python(), _lammps(), _yade()]
    findings += [_library(name) for name in LIBRARIES]
    return [*findings, _browser()]


def _python() -> Finding:
    return Finding(
        name="Python", version=platform.python_version(), path=Path(sys.executable), state="ok"
    )


def _lammps() -> Finding:
    path, version = lammps.find(), lammps.version()
    if path is not None and version is not None:
        return Finding(name="LAMMPS", version=version, path=path, state="ok")
    advice = "make install (or: pip install lammps mpich)"
    if path is not None:
        advice = f"{path} does not start, perhaps for want of MPICH's libmpi.so.12: {advice}"
    return Finding(name="LAMMPS", version=None, path=path, state="missing", advice=advice)


def _yade() -> Finding:
    path, version = yade.find(), yade.version()
    if path is not None and version is not None:
        return Finding(name="YADE", version=version, path=path, state="ok")
    advice = "runs are made with LAMMPS only; on Debian: sudo apt-get install --no-install-recommends yade"
    if path is not None:
        advice = f"{path} does not start; {advice}"
    return Finding(name="YADE", version=None, path=path, state="optional", advice=advice)


def _library(name: str) -> Finding:
    try:
        module = importlib.import_module(name.lower() if name == "PedPy" else name)
        version = importlib.metadata.version(name)
    except (ImportError, OSError) as error:
        advice = f"{str(error) or type(error).__name__}: make install"
        return Finding(name=name, version=None, path=None, state="missing", advice=advice)
    path = Path(module.__file__).parent if module.__file__ else None
    return Finding(name=name, version=version, path=path, state="ok")


def _browser() -> Finding:
    advice = (
        "only a test needs it; on Debian: sudo apt-get install --no-install-recommends chromium"
    )
    found = next((path for path in map(shutil.which, BROWSERS) if path), None)
    if found is None:
        return Finding(name="Chromium", version=None, path=None, state="optional", advice=advice)
    try:
        answer = subprocess.run(
            [found, "--version"], capture_output=True, text=True, timeout=30, check=True
        ).stdout
    except (OSError, subprocess.SubprocessError):
        advice = f"{found} does not start; {advice}"
        return Finding(
            name="Chromium", version=None, path=Path(found), state="optional", advice=advice
        )
    return Finding(
        name="Chromium", version=answer.split(maxsplit=1)[-1].strip(), path=Path(found), state="ok"
    )
