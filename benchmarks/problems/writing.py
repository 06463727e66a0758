"""The problems of the library, and their files."""

import dataclasses
import hashlib
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from analysis.percussions import Setting, SnapshotPercussions, percussions_of
from analysis.percussions.contact_rows import Indeterminacy
from analysis.studies.exchange.fclib import write_problem
from analysis.studies.exchange.problem import ExchangeError
from analysis.support.extras import load
from analysis.support.files import shipped, write_json
from analysis.support.parallel import Progress, Task, do_all
from analysis.support.reading import read_text
from benchmarks.problems.families import FAMILIES
from benchmarks.problems.judge import THRESHOLDS, judge
from nscd import ContactLaw, solve
from nscd.percussions import Status

# Asked of the answers that are kept; the file holds what was reached.
TOLERANCE = 1e-12
# Intervals of forces are proven by two linear programs a contact: up to so many disks without
# friction, and with friction, where each is a hundred times dearer.
INTERVALS, INTERVALS_WITH_FRICTION = 200, 60
# Frames of the shipped excerpt of a real crowd, and the radius of a person (m).
FRAMES, RADIUS_M = (400, 405, 410), 0.18
Family = Literal["heap", "jammed", "hexagonal", "masses", "chain", "gate", "push", "real"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Say which problem it is."""

    family: Family  # of `benchmarks.problems.families`, or real: a frame of the shipped excerpt
    size: int  # how many disks are asked for; the frame of a real crowd
    friction: float = 0.0  # μ at all contacts
    seed: int = 1  # of the random numbers

    @property
    def name(self) -> str:
        """Name it: family, size, seed where it is not 1, friction in hundredths."""
        parts = [self.family, str(self.size)]
        parts += [f"seed{self.seed}"] if self.seed != 1 else []
        parts += [f"mu{round(100 * self.friction):03}"] if self.friction else []
        return "_".join(parts)

    def solve(self) -> SnapshotPercussions:
        """Make the problem and solve it as exactly as it goes."""
        if self.family == "real":
            return self._of_frame()
        case = FAMILIES[self.family](self.size, self.seed)
        law, left = ContactLaw(friction=self.friction), case.left_velocity
        inputs = case.snapshot, case.contacts
        solution = solve(*inputs, left_velocity=left, law=law, tolerance=TOLERANCE)
        names = tuple(str(number + 1) for number in range(len(case.walls)))
        inputs = {"friction": self.friction, "left_velocity": "dump"}
        setting = Setting(walls=case.walls, wall_names=names, **inputs)
        found = {"snapshot": case.snapshot, "contacts": case.contacts, "left_velocity": left}
        return SnapshotPercussions(setting=setting, **found, window=None, solution=solution)

    def _of_frame(self) -> SnapshotPercussions:
        """A frame of the shipped excerpt before its gate."""
        load("pedpy")
        from analysis.scene.real.import_crowd import import_crowd
        from analysis.scene.real.trajectory import read_heads

        scenes = shipped("scenes")
        tracked = read_heads(scenes / "gate_excerpt.txt", self.size)
        crowd = import_crowd(tracked, radius=RADIUS_M, room=scenes / "rooms" / "gate.toml")
        setting = dataclasses.replace(Setting.of(crowd.scene), friction=self.friction)
        return percussions_of(setting, crowd.scene.snapshot, tolerance=TOLERANCE)

    def indeterminacy(self, disks: int) -> Indeterminacy:
        """Choose what is said of forces that balance may leave open."""
        maximum = INTERVALS_WITH_FRICTION if self.friction else INTERVALS
        return "ranges" if disks <= maximum else "determined"


def _listed() -> tuple[Problem, ...]:
    """List all problems, small ones of a family first."""
    found = []
    grown: tuple[Family, ...] = ("heap", "jammed", "hexagonal", "masses", "chain")
    for family in grown:
        found += [Problem(family=family, size=size) for size in (40, 150, 594, 2000, 5000)]
        # 2,000 unequal masses with friction are beyond every solver here
        friction_work = (40, 150, 594) if family == "masses" else (40, 150, 594, 2000)
        found += [Problem(family=family, size=size, friction=0.3) for size in friction_work]
    slides: tuple[Family, ...] = ("heap", "jammed", "hexagonal", "masses")
    found += [Problem(family=family, size=594, friction=0.1) for family in slides]
    for mu in (0.0, 0.3):
        found += [Problem(family="push", size=size, friction=mu) for size in (5, 20, 80)]
        found += [Problem(family="real", size=frame, friction=mu) for frame in FRAMES]
    return tuple(found)


PROBLEMS = _listed()


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
    whose kept answer is not right, MissingExtraError without h5py or what reads real crowds."""
    load("h5py")
    sizes = [(one, float(one.size)) for one in problems]
    tasks = [Task(call=write_one, arguments=(folder, one), work=work) for one, work in sizes]
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
    path, solved = folder / f"{problem.name}.hdf5", found.solution.status == Status.SOLVED
    indeterminacy = problem.indeterminacy(len(found.snapshot))
    about = {"library": problem.name, "made_by": repr(problem)}
    write_problem(path, found, about, indeterminacy=indeterminacy)
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
        entry["velocity_error_m_per_s"] = found.solution.velocity_error
        entry["forces"] = "intervals" if indeterminacy == "ranges" else "which are determined"
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
        location = ".".join(map(str, first["loc"]))
        why = f"{location}: {first['msg']}" if location else first["msg"]
        raise ExchangeError(f"{manifest}: no manifest of a library: {why}") from None
    if content.version != VERSION:
        raise ExchangeError(f"{manifest}: version {content.version}. Version {VERSION} is read")
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
