"""The library on disk: one FCLIB file a problem, and a manifest that says what each is."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from concurrent.futures import Executor
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from analysis.exchange.fclib import write_problem
from analysis.exchange.layout import ExchangeError, hdf5
from analysis.library.catalogue import Problem
from analysis.library.judge import THRESHOLDS, judge
from analysis.support.files import write_json
from analysis.support.parallel import Task, do_all
from analysis.support.progress import Progress
from analysis.support.reading import read_text
from nscd.percussions import Status

MANIFEST = "manifest.json"
# Of the manifest's form; a reader refuses others.
VERSION = 1
# The answers that are kept are as exact as rounding allows, which unequal masses magnify.
TRUSTED = 1e-9
UNIQUE, OPEN = "unique", "not known to be unique"


def write_library(
    folder: Path,
    problems: Sequence[Problem],
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write the problems, each solved, and the manifest; return its path.

    executor: the processes that share the work; this one alone where left out

    Each answer is judged from its file alone, as anybody's. Raises ValueError naming the problem
    whose kept answer is not right, MissingPartError without h5py or what reads real crowds."""
    hdf5()
    if executor is None:
        entries = []
        for number, problem in enumerate(problems):
            entries.append(write_one(folder, problem))
            if progress:
                progress("problems", (number + 1) / len(problems))
    else:
        tasks = [
            Task(call=write_one, arguments=(folder, problem), work=float(problem.size))
            for problem in problems
        ]
        entries = do_all(tasks, executor, "problems", progress)
    manifest = folder / MANIFEST
    content = {
        "version": VERSION,
        "program": f"crowd-percussions {version('crowd-percussions')}",
        "judged": THRESHOLDS,
        "problems": entries,
    }
    write_json(manifest, content)
    return manifest


def write_one(folder: Path, problem: Problem) -> dict[str, Any]:
    """Write one problem; return what the manifest says of it."""
    found = problem.solve()
    path, solved = folder / f"{problem.name}.hdf5", found.answer.status == Status.SOLVED
    openness = problem.openness(len(found.snapshot))
    write_problem(
        path, found, {"library": problem.name, "made_by": repr(problem)}, openness=openness
    )
    unique = not problem.friction
    entry: dict[str, Any] = {
        "name": problem.name,
        "file": path.name,
        "sha256": digest(path),
        "bytes": path.stat().st_size,
        "family": problem.family,
        "size": problem.size,
        "seed": problem.seed,
        "friction": problem.friction,
        "disks": len(found.snapshot),
        "contacts": len(found.contacts),
        "velocity": UNIQUE if unique else OPEN,
        "solved": solved,
    }
    if not solved:
        return entry
    own = judge(path, path, unique=unique)
    if not (own.right and own.residual <= TRUSTED):
        why = own.why or f"residual {own.residual:.1e}"
        raise ValueError(f"{problem.name}: its own answer is not exact: {why}")
    entry["residual"] = own.residual
    if unique:
        entry["velocity_error_m_per_s"] = found.answer.velocity_error
        entry["forces"] = "intervals" if openness == "ranges" else "which are determined"
    return entry


def read_manifest(folder: Path) -> list[dict[str, Any]]:
    """Read what the manifest of a library says of each problem.

    Raises ValueError naming the file and the problem for a damaged manifest, another version, and a
    problem whose file is not the one that was written."""
    manifest = folder / MANIFEST
    try:
        content = _Manifest.model_validate_json(read_text(manifest), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        why = f"{place}: {first['msg']}" if place else first["msg"]
        raise ExchangeError(f"{manifest}: no manifest of a library: {why}") from None
    if content.version != VERSION:
        raise ExchangeError(f"{manifest}: version {content.version}; version {VERSION} is read")
    names = [entry.name for entry in content.problems]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ExchangeError(f"{manifest}: two problems are called {twice[0]}")
    for entry in content.problems:
        path = folder / entry.file
        if not path.is_file():
            raise ExchangeError(f"{path}: no such file; {MANIFEST} names it for {entry.name}")
        if digest(path) != entry.sha256:
            raise ExchangeError(f"{path}: not the file that {MANIFEST} names (SHA-256 differs)")
    return [entry.model_dump() for entry in content.problems]


class _Entry(BaseModel, extra="allow"):
    """What the manifest must say of a problem; its file is in the same folder."""

    name: str
    file: Annotated[str, Field(pattern=r"^[^/\\\x00]*[^/\\\x00.][^/\\\x00]*$", max_length=200)]
    sha256: str
    velocity: str
    family: str
    disks: int
    contacts: int
    friction: Annotated[float, Field(ge=0, allow_inf_nan=False)]


class _Manifest(BaseModel):
    version: int
    problems: Annotated[list[_Entry], Field(min_length=1)]


def digest(path: Path) -> str:
    """Compute the SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
