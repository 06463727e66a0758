"""Contact problems as FCLIB files: the problem of a snapshot out, any problem in the plane in, and its
answer as CSV."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from analysis.exchange.crowd import (
    CrowdProblem,
    Truth,
    put_crowd,
    put_truth,
    read_crowd,
    read_truth,
)
from analysis.exchange.problem import (
    ExchangeError,
    GlobalProblem,
    Group,
    LocalProblem,
    new_file,
    opened,
    put_matrix,
    put_numbers,
    put_whole,
    put_words,
)
from analysis.percussions import SnapshotPercussions
from analysis.percussions.table import Column, Openness, csv_lines, table_file
from analysis.support.columns import Columns
from nscd.arrays import Floats
from nscd.friction.planar import solve_planar
from nscd.percussions import Status

# Contacts of lines and disks; FCLIB has 3 too.
SPACE = 2
MATH = "W is positive semi-definite. /truth says which reactions are determined"
# The matrices of a file are symmetric, and those that its crowd gives, up to rounding.
SAME = 1e-9


def write_problem(
    path: Path,
    found: SnapshotPercussions,
    origin: Mapping[str, str],
    *,
    local: bool = False,
    openness: Openness = "ranges",
) -> None:
    """Write the problem of a snapshot, and its answer where it is solved.

    origin: where it comes from, as words by their names
    local: whether FCLIB's local form is written too
    openness: what /truth says of reactions that the mechanics may leave open

    /fclib_global, /fclib_local and /solution are FCLIB's; /crowd has bodies, contacts, walls, time
    and origin, /truth rank, determined, intervals. Raises ValueError without any contact and for an
    answer whose contacts dissipate, MissingExtraError without h5py."""
    k = len(found.contacts)
    if not k:
        raise ValueError(f"{path}: no contact. FCLIB has no problem without one")
    reaction, along = found.answer.reaction, (found.answer.impulse * found.contacts.normal).sum(1)
    if np.abs(along - reaction).max() > SAME * np.abs(along).max():
        raise ValueError(f"{path}: contacts with restitution. FCLIB has inelastic ones")
    friction = found.answer.friction
    problem = GlobalProblem.of(
        found.answer.snapshot,
        found.contacts,
        found.left_velocity,
        friction.coefficient if friction else np.zeros(k),
    )
    info = {
        "title": f"Percussions of {len(found.snapshot)} people at {k} contacts",
        "description": "; ".join(f"{key}: {value}" for key, value in origin.items()),
        "math_info": MATH,
    }
    with new_file(path) as file:
        _put_global(file.create_group("fclib_global"), problem, info)
        if local:
            _put_local(file.create_group("fclib_local"), problem.local(), info)
        if found.answer.status == Status.SOLVED:
            _put_solution(file.create_group("solution"), problem, found)
            if openness != "none":
                put_truth(file.create_group("truth"), found, openness)
        put_crowd(file.create_group("crowd"), found, origin)


def read_problem(path: Path) -> CrowdProblem | LocalProblem:
    """Read a problem: the crowd of one that this program wrote, else the local form.

    Raises ExchangeError naming the file and the group or dataset: a problem in space, equality
    constraints, what is missing, of the wrong shape or unit or not finite, and a /crowd that does
    not give the problem beside it."""
    file = opened(path)
    kind = next((name for name in ("fclib_global", "fclib_local") if name in file), None)
    if kind is None:
        raise file.refuse("fclib_global", "missing, and /fclib_local too: no FCLIB problem")
    group = file.group(kind)
    if (space := group.whole("spacedim")) != SPACE:
        raise group.refuse("spacedim", f"{space}. Problems in the plane (2) are solved here")
    for name in ("G", "V", "R"):
        if name in group:
            raise group.refuse(name, "equality constraints are not solved here")
    if kind == "fclib_local":
        return _local(group)
    problem = _global(group)
    if "crowd" not in file:
        try:
            return problem.local()
        except ValueError as error:
            raise group.refuse("M", str(error)) from None
    crowd = read_crowd(file.group("crowd"), problem.friction)
    _check_same(group, problem, crowd)
    return crowd


def read_velocities(path: Path) -> Floats | None:
    """Read u (k,2) of the solution in a file; None where there is none."""
    file = opened(path)
    if "solution" not in file:
        return None
    group = file.group("solution")
    found = group.numbers("u", (group.length("u"),))
    if len(found) % SPACE:
        raise group.refuse("u", f"{len(found)} numbers, not two for each contact")
    return found.reshape(-1, SPACE)


def read_truth_of(path: Path, contacts: int) -> Truth | None:
    """Read what is known of the reactions of a problem with so many contacts; None where the file
    says nothing."""
    file = opened(path)
    return read_truth(file.group("truth"), contacts) if "truth" in file else None


def read_answer(path: Path, contacts: int) -> tuple[Floats, float | None]:
    """Read r (2k,) of the solution in a file, whatever else it holds, and the seconds that it took
    (an attribute of /solution; None where nothing is said).

    Raises ExchangeError for another number of contacts. What is not finite is read as nan."""
    file = opened(path)
    group = file.group("solution")
    reaction = group.numbers("r", (SPACE * contacts,), gaps=True)
    if "seconds" not in group.content.attributes:
        return reaction, None
    said = group.content.attributes["seconds"]
    if type(said) not in (int, float) or not 0 < said < math.inf:
        raise ExchangeError(f"{path}: /solution, seconds: {said!r}. A number above 0 s is needed")
    return reaction, float(said)


def write_answer(path: Path, reaction: Floats, seconds: float) -> None:
    """Write r (2k,) N·s of an answer, and how long it took (CPU seconds)."""
    with new_file(path) as file:
        group = file.create_group("solution")
        put_numbers(group, "r", reaction)
        group.attrs["seconds"] = seconds


def _put_global(group: Any, problem: GlobalProblem, info: Mapping[str, str]) -> None:
    put_whole(group, "spacedim", SPACE)
    put_matrix(group, "M", problem.mass)
    put_matrix(group, "H", problem.transfer)
    vectors = {"f": problem.momentum, "w": problem.offset, "mu": problem.friction}
    _put_vectors(group, vectors, info)


def _put_local(group: Any, problem: LocalProblem, info: Mapping[str, str]) -> None:
    put_whole(group, "spacedim", SPACE)
    put_matrix(group, "W", problem.delassus)
    _put_vectors(group, {"q": problem.free, "mu": problem.friction}, info)


def _put_vectors(group: Any, vectors: Mapping[str, Floats], info: Mapping[str, str]) -> None:
    place = group.create_group("vectors")
    for name, values in vectors.items():
        put_numbers(place, name, values)
    place = group.create_group("info")
    for name, text in info.items():
        put_words(place, name, text)


def _put_solution(group: Any, problem: GlobalProblem, found: SnapshotPercussions) -> None:
    """v = u⁺, u = Hᵀ v + w and r of the answer."""
    answer = found.answer
    velocity = np.column_stack([answer.right_velocity, answer.right_spin]).ravel()
    across = answer.friction.tangential if answer.friction else np.zeros(len(found.contacts))
    put_numbers(group, "v", velocity)
    put_numbers(group, "u", problem.transfer.T @ velocity + problem.offset)
    put_numbers(group, "r", np.column_stack([answer.reaction, across]).ravel())


def _global(group: Group) -> GlobalProblem:
    mass = group.matrix("M")
    _check_square(group, "M", mass)
    size = mass.shape[0]
    transfer = group.matrix("H", rows=size)
    columns = transfer.shape[1]
    if columns % SPACE or not columns:
        raise group.refuse("H/n", f"{columns}. Two columns for each contact are needed")
    vectors = group.group("vectors")
    return GlobalProblem(
        mass=mass,
        transfer=transfer,
        momentum=vectors.numbers("f", (size,)),
        offset=vectors.numbers("w", (columns,)),
        friction=_friction(vectors, columns // SPACE),
    )


def _local(group: Group) -> LocalProblem:
    delassus = group.matrix("W")
    _check_square(group, "W", delassus)
    rows = delassus.shape[0]
    if rows % SPACE or not rows:
        raise group.refuse("W/m", f"{rows}. Two rows for each contact are needed")
    vectors = group.group("vectors")
    free = vectors.numbers("q", (rows,))
    return LocalProblem(delassus=delassus, free=free, friction=_friction(vectors, rows // SPACE))


def _check_square(group: Group, name: str, matrix: Any) -> None:
    rows, columns = matrix.shape
    if rows != columns:
        raise group.refuse(f"{name}/n", f"{columns} columns where it has {rows} rows")
    if matrix.nnz and abs(matrix - matrix.T).max() > SAME * abs(matrix).max():
        raise group.refuse(name, "not symmetric")


def _friction(vectors: Group, contacts: int) -> Floats:
    friction = vectors.numbers("mu", (contacts,))
    if friction.min() < 0:
        raise vectors.refuse("mu", f"{friction.min():g}. Coefficients of at least 0 are needed")
    return friction


def _check_same(group: Group, problem: GlobalProblem, crowd: CrowdProblem) -> None:
    """Refuse a /crowd that does not give the problem beside it."""
    other = crowd.matrices(problem.friction)
    for name, key in {"M": "mass", "H": "transfer", "f": "momentum", "w": "offset"}.items():
        one, two = getattr(problem, key), getattr(other, key)
        place = name if name in "MH" else f"vectors/{name}"
        if one.shape != two.shape:
            raise group.refuse(place, f"shape {one.shape} where /crowd gives {two.shape}")
        if abs(one - two).max() > SAME * abs(two).max():
            raise group.refuse(place, "not what /crowd gives. Delete /crowd to solve it as it is")


# Of a problem whose bodies are not known, in the units of its file.
BARE = Columns("""
contact | | its number in the file, from 1
mu | | coefficient of friction
r_n, r_t | | reaction along the normal and across
u_n, u_t | | velocity along the normal, positive where it opens, and across
status, residual | | as above
""")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class SolvedFile:
    """Say what a problem's answer is worth.

    difference: largest difference of u from the solution in the file, in the file's unit; None
        where it has none"""

    contacts: int
    residual: float  # dimensionless, see `nscd.solve` and `nscd.friction.planar.solve_planar`
    difference: float | None
    why: str  # of what is not solved, empty where it is


def solve_file(path: Path, out: Path, tolerance: float, openness: Openness) -> SolvedFile:
    """Solve the problem of an FCLIB file and write `out`, one row per contact: the columns of
    `percussions solve` where the file says whose contacts they are.

    openness: what is said of reactions that the mechanics may leave open, where bodies are known

    Raises ExchangeError as `read_problem` does."""
    problem, known = read_problem(path), read_velocities(path)
    if isinstance(problem, CrowdProblem):
        cells, velocity, residual, why = _of_crowd(problem, tolerance, openness)
    else:
        cells, velocity, residual, why = _of_local(problem, tolerance)
    difference = None
    if known is not None:
        if velocity.shape != known.shape:
            raise ExchangeError(
                f"{path}: /solution/u: {known.size} numbers where {velocity.size} are needed"
            )
        difference = float(np.abs(velocity - known).max())
    with table_file(out) as add:
        add(cells, csv_lines(cells.values()))
    return SolvedFile(contacts=len(velocity), residual=residual, difference=difference, why=why)


def _of_crowd(
    problem: CrowdProblem, tolerance: float, openness: Openness
) -> tuple[dict[str, Column], Floats, float, str]:
    found = problem.solve(tolerance)
    answer, cells = found.answer, found.columns(openness, time=found.snapshot.time)
    moved = np.column_stack([answer.right_velocity, answer.right_spin]).ravel()
    matrices = problem.matrices(np.zeros(len(problem.contacts)))
    velocity = (matrices.transfer.T @ moved).reshape(-1, 2)
    why = "" if answer.status == Status.SOLVED else f"{answer.status}: {answer.reason}"
    return cells, velocity, answer.residual, why


def _of_local(
    problem: LocalProblem, tolerance: float
) -> tuple[dict[str, Column], Floats, float, str]:
    found = solve_planar(problem.delassus, problem.free, problem.friction, tolerance)
    k, solved = len(problem.friction), found.residual <= tolerance
    status = Status.SOLVED if solved else Status.INACCURATE
    columns: list[Any] = [range(1, k + 1), problem.friction, *found.reaction.T, *found.velocity.T]
    columns += [[str(status)] * k, [found.residual] * k]
    cells = dict(zip(BARE, columns, strict=True))
    why = "" if solved else f"{status}: residual {found.residual:.1e}, tolerance {tolerance:.1e}"
    return cells, found.velocity, found.residual, why
