"""Contact problems as FCLIB files: the problem of a snapshot out, any problem in the plane in, and its
answer as CSV. What FCLIB's form leaves out of a crowd stands beside it: bodies, contacts, walls and time,
with their units, and what is known of the answer."""

import dataclasses
import math
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from analysis.percussions import Setting, SnapshotPercussions
from analysis.percussions.contact_rows import Column, Indeterminacy, rows_of, table_file
from analysis.percussions.snapshot import bounds_of, states_of
from analysis.studies.exchange.problem import (
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
from analysis.support.columns import Columns
from nscd import Contacts, Snapshot, Walls, solve
from nscd.arrays import Floats, Indices
from nscd.friction.planar import solve_planar
from nscd.indeterminacy import determinacy
from nscd.percussions import Status

# Of this form of /crowd; a reader refuses others.
VERSION = 1
# The units of what /crowd holds, by array.
BODIES = {
    "position": "m", "velocity": "m/s", "radius": "m", "mass": "kg", "spin": "rad/s",
    "left_velocity": "m/s",
}  # fmt: skip
ONE_EACH = ("radius", "mass", "spin")
# Of the radii: normals and gaps are those of the positions up to it.
SAME_PLACE = 1e-6
CONTACTS = {"normal": "1", "gap": "m", "point": "m"}


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrowdProblem:
    """Hold a problem that this program wrote: a crowd at one instant."""

    setting: Setting  # walls and their names, friction
    snapshot: Snapshot
    contacts: Contacts
    left_velocity: Floats  # (n,2) m/s, u⁻
    window: float | None  # s, the time that turns percussions into forces; None for an impact

    def matrices(self, friction: Floats) -> GlobalProblem:
        """State it as matrices, with μ (k,)."""
        return GlobalProblem.of(self.snapshot, self.contacts, self.left_velocity, friction)

    def solve(self, tolerance: float = 1e-8) -> SnapshotPercussions:
        """Solve it as `nscd.solve` does."""
        parts = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        solution = solve(
            self.snapshot,
            self.contacts,
            left_velocity=self.left_velocity,
            law=self.setting.law,
            tolerance=tolerance,
        )
        return SnapshotPercussions(**parts, solution=solution)


def put_crowd(group: Any, found: SnapshotPercussions, origin: Mapping[str, str]) -> None:
    """Write /crowd; each array has its unit as an attribute."""
    snapshot, setting = found.solution.snapshot, found.setting
    group.attrs["version"] = VERSION
    group.attrs["program"] = f"crowd-percussions {version('crowd-percussions')}"
    group.attrs["of_v"] = "x, y (m/s), spin (rad/s) of each body"
    group.attrs["of_r"] = "normal, tangent (N s) of each contact, what its first body gives"
    group.attrs["tangent"] = "(-ny, nx) of the normal, which points from the first body away"
    group.attrs["left_velocity"] = setting.kind
    for key, value in origin.items():
        group.attrs[key] = value
    put_numbers(group, "time", [snapshot.time], "s")
    if found.window is not None:
        put_numbers(group, "dt", [found.window], "s")
    bodies = group.create_group("bodies")
    bodies.create_dataset("id", data=snapshot.ids)
    for name, unit in BODIES.items():
        values = found.left_velocity if name == "left_velocity" else getattr(snapshot, name)
        put_numbers(bodies, name, values, unit)
    contacts = group.create_group("contacts")
    for name in ("first", "second", "is_wall"):
        contacts.create_dataset(name, data=getattr(found.contacts, name).astype(np.int32))
    for name, unit in CONTACTS.items():
        put_numbers(contacts, name, getattr(found.contacts, name), unit)
    walls = group.create_group("walls")
    ends = setting.walls or Walls(start=np.empty((0, 2)), end=np.empty((0, 2)))
    put_numbers(walls, "start", ends.start, "m")
    put_numbers(walls, "end", ends.end, "m")
    put_words(walls, "names", "\n".join(setting.wall_names))


def put_truth(group: Any, found: SnapshotPercussions, indeterminacy: Indeterminacy) -> None:
    """Write /truth: what balance, and reactions that only push, leave open of a solved problem."""
    solution = found.solution
    group.attrs["given"] = "v of /solution, and contacts that only push"
    group.attrs["solver"] = solution.solver
    group.attrs["residual"] = solution.residual
    group.attrs["velocity_error_m_per_s"] = solution.velocity_error
    balance = determinacy(found.contacts, len(found.snapshot), found.snapshot)
    put_whole(group, "rank", balance.rank)
    group["rank"].attrs["meaning"] = "of the normal columns of H"
    left_open = bounds_of(found, indeterminacy == "ranges")
    group.create_dataset("determined", data=left_open.determined.astype(np.int32))
    group["determined"].attrs["meaning"] = "1: the same in every answer, 0: not, -1: not known"
    if indeterminacy == "ensemble" and (both := states_of(found)) is not None:
        group.attrs["sampling"] = both[0].status
        put_numbers(group, "mean", both[0].mean(), "N s")
        put_numbers(group, "sd", both[0].sd(), "N s")
    if indeterminacy != "ranges":
        return
    ends = ("lower", "upper", "friction_lower", "friction_upper")
    for name in ends[: 2 if solution.friction is None else 4]:
        put_numbers(group, name, getattr(left_open, name), "N s")
        group[name].attrs["meaning"] = "nan: no end, or none is known"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """Hold what is known of the reactions along the normal of a problem with k contacts.

    lower, upper: (k,) N·s, least and largest; nan where there is no end, or none is known"""

    determined: Indices  # (k,) 1: the same in every answer, 0: not, −1: not known
    lower: Floats
    upper: Floats


def read_crowd(group: Group, friction: Floats) -> CrowdProblem:
    """Read /crowd; friction: μ (k,) of the problem beside it. Raises ExchangeError naming what is
    missing or wrong."""
    stated = group.content.attributes.get("version")
    if stated != VERSION:
        raise group.refuse("version", f"{stated}. Version {VERSION} is read")
    bodies, in_contact = group.group("bodies"), group.group("contacts")
    n, k = bodies.length("id"), len(friction)
    arrays: dict[str, Any] = {
        name: bodies.numbers(name, (n,) if name in ONE_EACH else (n, 2), unit)
        for name, unit in BODIES.items()
    }
    left = arrays.pop("left_velocity")
    ends = {name: in_contact.wholes(name, (k,)) for name in ("first", "second", "is_wall")}
    frame: dict[str, Any] = {
        name: in_contact.numbers(name, (k,) if name == "gap" else (k, 2), unit)
        for name, unit in CONTACTS.items()
    }
    ids, time = bodies.wholes("id", (n,)), float(group.numbers("time", (1,), "s")[0])
    window = float(group.numbers("dt", (1,), "s")[0]) if "dt" in group else None
    if window is not None and not window > 0:
        raise group.refuse("dt", f"{window:g} s. A time above 0 is needed")
    walls = group.group("walls")
    w = walls.length("start")
    starts, stops = (walls.numbers(name, (w, 2), "m") for name in ("start", "end"))
    names = tuple(walls.words("names").split("\n")) if w else ()
    try:
        snapshot = Snapshot(**arrays, ids=ids, time=time)
        contacts = Contacts(**ends, **frame)
        contacts.check_disks(n)
        at_walls = Walls(start=starts, end=stops) if w else None
    except ValueError as error:
        raise group.refuse("", str(error)) from None
    if len(names) != w or contacts.second[contacts.is_wall].max(initial=-1) >= w:
        raise group.refuse("walls", f"{w} walls, {len(names)} names, and contacts with others")
    _check_positions(group, snapshot, contacts, at_walls)
    return CrowdProblem(
        setting=Setting(
            walls=at_walls,
            wall_names=names,
            left_velocity="dump" if window is None else "free",
            window=window,
            **_coefficients(group, contacts, friction),
        ),
        snapshot=snapshot,
        contacts=contacts,
        left_velocity=left,
        window=window,
    )


def _check_positions(
    group: Group, snapshot: Snapshot, contacts: Contacts, walls: Walls | None
) -> None:
    """Refuse contacts whose normals and gaps are not those of the disks and walls."""
    at_wall, first, second = contacts.is_wall, contacts.first, contacts.second
    other = snapshot.position[np.where(at_wall, 0, second)]
    between = snapshot.radius[first] + np.where(at_wall, 0.0, snapshot.radius[second * ~at_wall])
    if walls is not None:
        other[at_wall] = walls.nearest_point(snapshot.position[first[at_wall]], second[at_wall])
    distance = other - snapshot.position[first]
    length = np.hypot(*distance.T)
    wrong = np.abs(contacts.gap - (length - between)) > SAME_PLACE * between
    turned = np.hypot(*(contacts.normal * length[:, None] - distance).T)
    wrong |= turned > SAME_PLACE * between
    if wrong.any():
        row = int(np.argmax(wrong))
        raise group.refuse(
            "contacts",
            f"number {row + 1}: its normal and gap are not those of disk "
            f"{snapshot.ids[first[row]]} and what it touches, at the positions in bodies",
        )


def _coefficients(group: Group, contacts: Contacts, friction: Floats) -> dict[str, Any]:
    """One μ of people with each other, and one with walls."""
    found: dict[str, Any] = {}
    for name, kind in (("friction", False), ("wall_friction", True)):
        values = np.unique(friction[contacts.is_wall == kind])
        if len(values) > 1:
            raise group.refuse("contacts", "several μ. One with people and one with walls is read")
        if len(values):
            found[name] = float(values[0])
    return found


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
    indeterminacy: Indeterminacy = "ranges",
) -> None:
    """Write the problem of a snapshot, and its answer where it is solved.

    origin: where it comes from, as words by their names
    local: whether FCLIB's local form is written too
    indeterminacy: what /truth says of reactions that the mechanics may leave open

    /fclib_global, /fclib_local and /solution are FCLIB's; /crowd has bodies, contacts, walls, time
    and origin, /truth rank, determined, intervals. Raises ValueError without any contact and for an
    answer whose contacts dissipate, MissingExtraError without h5py."""
    k = len(found.contacts)
    if not k:
        raise ValueError(f"{path}: no contact. FCLIB has no problem without one")
    reaction, along = found.solution.reaction, (found.solution.impulse * found.contacts.normal).sum(1)
    if np.abs(along - reaction).max() > SAME * np.abs(along).max():
        raise ValueError(f"{path}: contacts with restitution. FCLIB has inelastic ones")
    friction = found.solution.friction
    problem = GlobalProblem.of(
        found.solution.snapshot,
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
        vectors = {"f": problem.momentum, "w": problem.offset, "mu": problem.friction}
        matrices = {"M": problem.mass, "H": problem.transfer}
        _write_matrices(file.create_group("fclib_global"), matrices, vectors, info)
        if local:
            other = problem.local()
            vectors = {"q": other.free, "mu": other.friction}
            _write_matrices(file.create_group("fclib_local"), {"W": other.delassus}, vectors, info)
        if found.solution.status == Status.SOLVED:
            _put_solution(file.create_group("solution"), problem, found)
            if indeterminacy != "none":
                put_truth(file.create_group("truth"), found, indeterminacy)
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
    if (space := group.integer("spacedim")) != SPACE:
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


def read_truth(path: Path, contacts: int) -> Truth | None:
    """Read what is known of the reactions of a problem with so many contacts; None where the file
    says nothing. Raises ExchangeError naming what is missing or wrong."""
    file = opened(path)
    if "truth" not in file:
        return None
    group = file.group("truth")
    ends = {
        name: group.numbers(name, (contacts,), "N s", gaps=True)
        if name in group
        else np.full(contacts, math.nan)
        for name in ("lower", "upper")
    }
    return Truth(determined=group.wholes("determined", (contacts,)), **ends)


def read_answer(path: Path, contacts: int) -> tuple[Floats, float | None]:
    """Read r (2k,) of the solution in a file, whatever else it holds, and the seconds that it took
    (an attribute of /solution; None where nothing is said).

    Raises ExchangeError for another number of contacts. What is not finite is read as nan."""
    file = opened(path)
    group = file.group("solution")
    reaction = group.numbers("r", (SPACE * contacts,), gaps=True)
    if "seconds" not in group.content.attributes:
        return reaction, None
    stated = group.content.attributes["seconds"]
    if type(stated) not in (int, float) or not 0 < stated < math.inf:
        raise ExchangeError(f"{path}: /solution, seconds: {stated!r}. A number above 0 s is needed")
    return reaction, float(stated)


def write_answer(path: Path, reaction: Floats, seconds: float) -> None:
    """Write r (2k,) N·s of an answer, and how long it took (CPU seconds)."""
    with new_file(path) as file:
        group = file.create_group("solution")
        put_numbers(group, "r", reaction)
        group.attrs["seconds"] = seconds


def _write_matrices(
    group: Any,
    matrices: Mapping[str, csc_array],
    vectors: Mapping[str, Floats],
    info: Mapping[str, str],
) -> None:
    put_whole(group, "spacedim", SPACE)
    for name, matrix in matrices.items():
        put_matrix(group, name, matrix)
    subgroup = group.create_group("vectors")
    for name, values in vectors.items():
        put_numbers(subgroup, name, values)
    subgroup = group.create_group("info")
    for name, text in info.items():
        put_words(subgroup, name, text)


def _put_solution(group: Any, problem: GlobalProblem, found: SnapshotPercussions) -> None:
    """v = u⁺, u = Hᵀ v + w and r of the answer."""
    solution = found.solution
    velocity = np.column_stack([solution.right_velocity, solution.right_spin]).ravel()
    across = solution.friction.tangential if solution.friction else np.zeros(len(found.contacts))
    put_numbers(group, "v", velocity)
    put_numbers(group, "u", problem.transfer.T @ velocity + problem.offset)
    put_numbers(group, "r", np.column_stack([solution.reaction, across]).ravel())


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
        position = name if name in "MH" else f"vectors/{name}"
        if one.shape != two.shape:
            raise group.refuse(position, f"shape {one.shape} where /crowd gives {two.shape}")
        if abs(one - two).max() > SAME * abs(two).max():
            raise group.refuse(position, "not what /crowd gives. Delete /crowd to solve it as it is")


# Of a problem whose bodies are not known, in the units of its file.
BARE = Columns("fclib")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class SolvedFile:
    """Say what a problem's answer is worth.

    difference: largest difference of u from the solution in the file, in the file's unit; None
        where it has none"""

    contacts: int
    residual: float  # dimensionless, see `nscd.solve` and `nscd.friction.planar.solve_planar`
    difference: float | None
    why: str  # of what is not solved, empty where it is


def solve_file(path: Path, out: Path, tolerance: float, indeterminacy: Indeterminacy) -> SolvedFile:
    """Solve the problem of an FCLIB file and write `out`, one row per contact: the columns of
    `percussions solve` where the file says whose contacts they are.

    indeterminacy: what is said of reactions that the mechanics may leave open, where bodies are known

    Raises ExchangeError as `read_problem` does."""
    problem, recorded = read_problem(path), read_velocities(path)
    cells: Mapping[str, Column]
    why = ""
    if isinstance(problem, CrowdProblem):
        found = problem.solve(tolerance)
        solution, cells = found.solution, found.columns(indeterminacy, time=found.snapshot.time)
        moved = np.column_stack([solution.right_velocity, solution.right_spin]).ravel()
        matrices = problem.matrices(np.zeros(len(problem.contacts)))
        velocity, residual = (matrices.transfer.T @ moved).reshape(-1, 2), solution.residual
        if solution.status != Status.SOLVED:
            why = f"{solution.status}: {solution.reason}"
    else:
        mu = problem.friction
        local = solve_planar(problem.delassus, problem.free, mu, tolerance)
        velocity, residual = local.velocity, local.residual
        status = Status.SOLVED if residual <= tolerance else Status.INACCURATE
        if status != Status.SOLVED:
            why = f"{status}: residual {residual:.1e}, tolerance {tolerance:.1e}"
        columns: list[Any] = [range(1, len(mu) + 1), mu, *local.reaction.T, *velocity.T]
        cells = dict(
            zip(BARE, [*columns, [str(status)] * len(mu), [residual] * len(mu)], strict=True)
        )
    difference = None
    if recorded is not None:
        if velocity.shape != recorded.shape:
            raise ExchangeError(
                f"{path}: /solution/u: {recorded.size} numbers where {velocity.size} are needed"
            )
        difference = float(np.abs(velocity - recorded).max())
    with table_file(out) as add:
        add(cells, rows_of(cells))
    return SolvedFile(contacts=len(velocity), residual=residual, difference=difference, why=why)
