"""What is installed: the engines and the libraries of each extra, their versions, and what to do
about a missing one."""

import importlib
import importlib.metadata
import platform
import shutil
import sys
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from analysis.engines import LAMMPS, PENALTY, YADE, Engine, why_not
from analysis.engines.process import version_of
from analysis.support.extras import BASE, EXTRAS, Extra, install

# Asked for by a page: what its numbers were made with.
MADE_WITH = ("numpy", "scipy", "MDAnalysis")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that was looked for. extra: the extra that brings it, empty for what everything needs.
    state: `ok`; `missing`: nothing works without it; `optional`: not there, and the advice says
    what is lost and how to get it. version and path are None where it was not found."""

    name: str
    extra: str = ""
    version: str | None
    path: Path | None
    state: Literal["ok", "missing", "optional"]
    advice: str = ""


def examine() -> list[Finding]:
    """Look for Python, LAMMPS, YADE, the libraries of every extra and a browser, by starting each or
    importing it."""
    libraries = [
        _library(extra, library)
        for extra in (BASE, *EXTRAS)
        for library, name in extra.libraries.items()
        if name != LAMMPS.NAME
    ]
    return [_python(), *_engines(), *libraries, _browser()]


def made_with(engines: Collection[str] = ()) -> list[Finding]:
    """Look for what the numbers of a page come from: Python, those engines, what computes. A name with
    neither springs nor a version of its own is passed over."""
    used = [_engine(one, "") for one in PENALTY if one.NAME in engines]
    return [_python(), *used, *(_library(BASE, name) for name in MADE_WITH)]


def _engines() -> list[Finding]:
    without = f"Runs are made with LAMMPS only. On Debian: sudo {YADE.INSTALL}"
    return [
        _engine(LAMMPS, f"Its soft runs need it: {LAMMPS.INSTALL}", "engines"),
        _engine(YADE, without),
    ]


def _finding(
    name: str, version: str | None, path: Path | None, *, advice: str = "", extra: str = ""
) -> Finding:
    """What was found, with what to do where it has no version."""
    state: Literal["ok", "optional"] = "ok" if version else "optional"
    advice = "" if version else advice
    return Finding(name=name, extra=extra, version=version, path=path, state=state, advice=advice)


def _python() -> Finding:
    return _finding("Python", platform.python_version(), Path(sys.executable))


def _engine(engine: Engine, advice: str, extra: str = "") -> Finding:
    path, version = engine.find(), engine.version()
    if path is not None and version is None:
        advice = f"{why_not(engine)}. {advice}"
    return _finding(engine.TITLE, version, path, advice=advice, extra=extra)


def _library(extra: Extra, library: str) -> Finding:
    name = extra.libraries[library]
    try:
        module = importlib.import_module(library)
        version = importlib.metadata.version(name)
    except (ImportError, OSError) as error:
        advice = f"{extra.what} need it: {install(extra.extra)}"
        if not extra.extra or not isinstance(error, ModuleNotFoundError):
            why = str(error) or type(error).__name__
            advice = f"{why}: pip install --force-reinstall {name}"
        missed = _finding(name, None, None, advice=advice, extra=extra.extra)
        return missed if extra.extra else replace(missed, state="missing")
    path = Path(module.__file__).parent if module.__file__ else None
    return _finding(name, version, path, extra=extra.extra)


def _browser() -> Finding:
    advice = (
        "Only a test needs it. On Debian: sudo apt-get install --no-install-recommends chromium"
    )
    found = next((path for path in map(shutil.which, BROWSERS) if path), None)
    version = version_of(found, "--version", r"^\S+ (.+)")
    if found is not None:
        advice = f"{found} does not start. {advice}"
    return _finding("Chromium", version, Path(found) if found else None, advice=advice)
