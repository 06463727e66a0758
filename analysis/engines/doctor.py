"""What is installed: the engines and the libraries, their versions, and what to do about a missing
one."""

from __future__ import annotations

import importlib
import importlib.metadata
import platform
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from analysis.engines import Engine, lammps, why_not, yade
from analysis.engines.process import version_said

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
    findings = [
        _python(),
        _engine(
            lammps,
            "missing",
            f"make install (or: {lammps.INSTALL})",
        ),
        _engine(
            yade, "optional", f"runs are made with LAMMPS only; on Debian: sudo {yade.INSTALL}"
        ),
    ]
    findings += [_library(name) for name in LIBRARIES]
    return [*findings, _browser()]


def _python() -> Finding:
    return Finding(
        name="Python", version=platform.python_version(), path=Path(sys.executable), state="ok"
    )


def _engine(known: Engine, missing: Literal["missing", "optional"], advice: str) -> Finding:
    path, version = known.find(), known.version()
    if path is not None and version is not None:
        return Finding(name=known.TITLE, version=version, path=path, state="ok")
    if path is not None:
        advice = f"{why_not(known)}; {advice}"
    return Finding(name=known.TITLE, version=None, path=path, state=missing, advice=advice)


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
    version = version_said(found, "--version", r"^\S+ (.+)")
    if found is not None and version is None:
        advice = f"{found} does not start; {advice}"
    return Finding(
        name="Chromium",
        version=version,
        path=Path(found) if found else None,
        state="ok" if version else "optional",
        advice="" if version else advice,
    )
