"""What parts of the product cost, side by side in CPU seconds.

    nice -n 19 python benchmarks/parts.py [--what ways runs drives bodies guard factors dumps]
        [--repeats 5] [--people 594] [--steps 100] [--friction 0] [--frames 1000] [--folder DIR]

ways: those of a floor of 200 walls (54 rooms with a doorway in each wall) for 1,000 people to one door,
and one look at where all go next. runs: 1 s of `arch` with a way or with arms and without, the least of
several turns. drives: who keep their distance: the share of their looks, one every 50 ms, in rigid
steps of a queue before the door of `arch`, medians; and 60 s of 100 people who push with 0.1 over the
same by the plain drive. bodies: a step and a solution of as many bodies of five disks as disks that press into a
corner; a body is 0.51 m broad and 0.25 m deep (ANSUR II), the disk has its area. guard: the same run
with and without it, medians of several turns. factors: the factorisation of Â + CᵀΘC alone, beside
CHOLMOD's; the last column of times is one solution by 15 factorisations and 35 solves. dumps: that of a
crowd that flows and of one that comes to rest read, its contacts found and solved, and written as CSV
and as Parquet; LAMMPS runs once a folder."""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import partial
from itertools import count, pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sparse

from analysis.engines.programs.rigid import RENEWED_S, motion_of
from analysis.engines.run import simulate
from analysis.percussions.contact_rows import is_parquet
from analysis.percussions.setting import setting_beside
from analysis.percussions.solve_dump import DumpToSolve, solve_dump
from analysis.scene.drive import Drive
from analysis.scene.new_scene import Crowd, room
from analysis.scene.scene import Scene, read_scene
from analysis.scene.shipped_scenes import make
from benchmarks.machine import describe, in_process, in_turn, options, shortest_time, table, timed
from benchmarks.problems.families import FAMILIES
from nscd import ContactLaw, Snapshot, Walls, _core, find_contacts, solve
from nscd.arrays import Floats
from nscd.stepping import Motion, Push

ROOM_M, ACROSS, UP, DOORWAY_M = 4.0, 9, 6, 1.0
# Places across (m) and radii (m) of the disks of a body.
PLACES_M = np.array([-0.165, -0.09, 0.0, 0.09, 0.165])
RADII_M = np.array([0.09, 0.115, 0.125, 0.115, 0.09])
DISK_M = 0.18
MEETING_S, STEP_S, SOLUTIONS = 4.0, 5e-3, 20
CORNER = Walls(start=[[0, 0], [0, 0]], end=[[99, 0], [0, 99]])
ROOT = Path(__file__).resolve().parents[1]
GUARDED = ("arch", "jam", "corridor", "four_disks")
# Θ of contacts that press and of such that open, kg per kg of a disk.
DECADES = 4.0
# From this many disks on the product factorises by fronts: see nscd/core/factor.hpp.
MANY = 1500
# People who keep their distance; s that they take to stand in a queue; how many look, and how often.
DISTANCE: dict[str, Any] = {
    "speed_m_per_s": 1.34, "time_gap_s": 0.8, "heading_sd_rad": 0.2, "jostling_m_per_s": 0.06,
    "push_share": 0.1, "seed": 1,
}  # fmt: skip
QUEUED_S, MANY_LOOK, LOOKS = 4.0, 20_000, 20
# Residual of the solutions of dumps, and how far disks that rest on each other may be apart in them (m).
TOLERANCE, TOUCH = 1e-10, 1e-6


def floor(seed: int) -> tuple[Walls, Drive]:
    """Make the floor, its doorways at random places, and the drive to its door."""
    random = np.random.default_rng(seed)
    lines: list[Floats] = []
    for axis, (walls, rooms) in enumerate(((ACROSS, UP), (UP, ACROSS))):
        for wall in range(1, walls):
            for number in range(rooms):
                gap = random.uniform(0.5, ROOM_M - DOORWAY_M - 0.5)
                along = ROOM_M * number + np.array([[0, gap], [gap + DOORWAY_M, ROOM_M]])
                across = np.full((2, 2), ROOM_M * wall)
                pair = (across, along) if axis == 0 else (along, across)
                lines.extend(np.stack(pair, axis=-1))
    x, y = ROOM_M * ACROSS, ROOM_M * UP
    outer = [(x, 0), (0, 0), (0, y), (x, y), (x, 2.0)]
    lines += [np.array(pair, dtype=float) for pair in pairwise(outer)]
    for _ in range(200 - len(lines)):
        position = random.uniform(1.0, [x - 1.0, y - 1.0])
        lines.append(np.stack([position, position + np.array([0.4, 0.3])]))
    ends = np.array(lines)
    drive = Drive(
        speed_m_per_s=1.3, relaxation_time_s=0.5, door_start_m=(x, 0.0), door_end_m=(x, 2.0),
        outward=(1.0, 0.0), clearance_m=0.15,
    )  # fmt: skip
    return Walls(start=ends[:, 0], end=ends[:, 1]), drive


def ways(args: argparse.Namespace) -> str:
    """Time floors."""
    rows = []
    for seed in range(args.repeats):
        walls, drive = floor(seed)
        anchor = np.random.default_rng(seed).uniform(0.3, [35.7, 23.7], (1000, 2))
        seconds, routed = timed(partial(drive.routed, walls, 0.25))
        drive_time, _ = timed(partial(routed.desired_velocity, anchor))
        lost = int((routed.way.at(anchor, 0, routed.way.next) < 0).sum())
        rows.append([len(walls), len(anchor), f"{seconds:.2f}", f"{drive_time:.2g}", lost])
    return table(["walls", "people", "ways (CPU s)", "look (CPU s)", "people without a way"], rows)


def runs(args: argparse.Namespace) -> str:
    """Time 1 s of `arch`, where everybody sees the door and nobody has arms, with either."""
    plain = read_scene("arch").with_run(duration_s=1.0, frames=4)
    scenes = {
        "plain": plain,
        "with a way": plain.with_drive(clearance_m=0.15),
        "with arms": plain.with_contact(arm_reach_m=0.15, arm_force_N=200.0),
    }
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        number = count()

        def spent(scene: Scene, engine: str) -> float:
            return simulate(scene, engine, Path(folder) / str(next(number))).cpu_seconds

        for engine in ("lammps", "rigid"):
            calls = {name: partial(spent, scene, engine) for name, scene in scenes.items()}
            minimum = {name: min(found) for name, found in in_turn(calls, args.repeats).items()}
            over = (f"{seconds:.3g} ({seconds / minimum['plain']:.2f})" for seconds in minimum.values())
            rows.append([engine, *over])
    return table(["engine", *(f"{name} (CPU s, over plain)" for name in scenes)], rows)


def looking(people: int) -> list[str]:
    """Time steps of a queue that keeps its distance, without its looks, and the looks."""
    scene = make("arch", people).with_drive(**DISTANCE)
    motion, drive, who = motion_of(scene, scene.snapshot), scene.drive, scene.snapshot
    assert drive is not None
    motion.separate()
    every = int(RENEWED_S / motion.step + 1e-9)
    quiet: list[float] = []
    times: list[float] = []
    while motion.time < QUEUED_S or len(times) < LOOKS:
        spent = [timed(motion.advance)[0] for _ in range(every)]
        if motion.time < QUEUED_S:
            continue
        quiet += spent[1:]  # the first one looks
        position, requested = motion.position.copy(), (who.ids, motion.time, who.radius)
        times.append(timed(partial(drive.desired_velocity, position, *requested))[0])
    contacts = sum(motion.advance().reaction > 0)
    step, drive_time = 1e3 * statistics.median(quiet), 1e3 * statistics.median(times)
    fraction = drive_time / every / (step + drive_time / every)
    cells = f"{1e3 * motion.step:.2g}", f"{step:.2g}", f"{drive_time:.2g}", f"{100 * fraction:.0f} %"
    return [str(people), *cells, str(contacts)]


def leaving(**law: Any) -> float:
    """Time a step (ms) of 60 s of 100 people who leave by a door of 1.2 m."""
    scene = room("a", 7.0, 6.0, 1.2, Crowd(people=100, speed=1.34, relaxation=0.5), 60.0)
    motion = motion_of(scene := scene.with_drive(**law), scene.snapshot)
    motion.separate()
    steps = round(60.0 / motion.step)
    return 1e3 * timed(lambda: [motion.advance() for _ in range(steps)])[0] / steps


def drives(args: argparse.Namespace) -> str:
    """Time the drive of who keep their distance."""
    names = ("people", "step (ms)", "CPU of it (ms)", "of a look (ms)", "share", "contacts")
    rows = [in_process(looking, people) for people in (args.people, MANY_LOOK)]
    spent = in_turn({"plain": leaving, "at 0.1": partial(leaving, **DISTANCE)}, args.repeats)
    plain, distant = (min(spent[name]) for name in ("plain", "at 0.1"))
    words = f"100 people: {plain:.3g} ms a step, {distant:.3g} at p 0.1: {distant / plain:.2f}"
    return f"{table(names, rows)}\n\n{words}"


def crowd(people: int, compound: bool) -> Snapshot:
    """Make people on a square grid 0.55 m apart, turned at random."""
    rng = np.random.default_rng(1)
    side = int(np.ceil(np.sqrt(people)))
    index = 0.35 + 0.55 * np.column_stack(np.divmod(np.arange(people), side))
    index += rng.uniform(-0.02, 0.02, index.shape)
    if not compound:
        radius, mass = np.full(people, DISK_M), np.full(people, 75.0)
        return Snapshot(position=index, radius=radius, mass=mass)
    angle = rng.uniform(-0.5, 0.5, people)
    way = np.column_stack([np.sin(angle), np.cos(angle)])
    disks = (index[:, None] + PLACES_M[:, None] * way[:, None]).reshape(-1, 2)
    radius = np.tile(RADII_M, people)
    mass = 75.0 * radius**2 / (RADII_M**2).sum()
    one = Snapshot(position=disks, radius=radius, mass=mass)
    return one.joined(np.repeat(np.arange(people), len(RADII_M)))


def into_the_corner(position: Floats) -> Floats:
    """Walk to the corner at 1.5 m/s."""
    distance = np.hypot(*position.T)[:, None]
    return np.ascontiguousarray(-1.5 * position / np.maximum(distance, 0.1))


def pressed(people: int, compound: bool, steps: int, friction: float) -> list[float]:
    """Measure ms a step of a crowd that has met and ms a solution of its end, and count contacts."""
    push = Push(desired=into_the_corner, relaxation_time=0.5)
    start = crowd(people, compound)
    motion = Motion(start, CORNER, step=STEP_S, push=push, friction=friction)
    motion.separate()
    for _ in range(round(MEETING_S / STEP_S)):
        motion.advance()
    stepping, _ = timed(lambda: [motion.advance() for _ in range(steps)])
    end = motion.snapshot()
    contacts = find_contacts(end, CORNER, tolerance=1e-4)
    left, law = into_the_corner(end.position), ContactLaw(friction=friction)
    solution = partial(solve, end, contacts, left_velocity=left, law=law)
    assert solution().status == "solved"
    solving, _ = timed(lambda: [solution() for _ in range(SOLUTIONS)])
    return [1e3 * stepping / steps, 1e3 * solving / SOLUTIONS, len(contacts)]


def bodies(args: argparse.Namespace) -> str:
    """Time disks and bodies of five, and their ratio."""
    requested = args.steps, args.friction
    rows = [pressed(args.people, compound, *requested) for compound in (False, True)]
    ratio = [two / one for one, two in zip(*rows, strict=True)]
    named = zip(("disks", "bodies of five", "ratio"), [*rows, ratio], strict=True)
    cells = [(name, *(f"{value:.3g}" for value in row)) for name, row in named]
    return table(("people", "ms a step", "ms a solution", "contacts"), cells)


def cpu_seconds(engine: str, scene: str, guard: str, out: str) -> float:
    """User CPU time of one plain run, its start included."""
    words = ["yade", "-L", "noserver", "-j1", "-n", "-x", "yade_scripts/crowd.py"]
    words += [scene, f"guard={guard}", f"out={out}"]
    if engine == "lammps":
        words = ["lmp", "-in", "lammps_inputs/crowd.in", "-log", "none"]
        words += ["-var", "scene", scene, "-var", "guard", guard, "-var", "out", out]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1"}
    environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), environment["PATH"]])
    environment["PYTHONPATH"] = "yade_scripts"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def guard(args: argparse.Namespace) -> str:
    """Time runs with and without the guard."""
    rows = []
    for engine, scene in product(("lammps", "yade"), GUARDED):
        with tempfile.TemporaryDirectory() as out:
            calls = {word: partial(cpu_seconds, engine, scene, word, out) for word in ("no", "yes")}
            spent = map(statistics.median, in_turn(calls, args.repeats).values())
        without, guarded = spent
        fraction = f"{100 * (guarded / without - 1):+.1f} %"
        rows.append([engine, scene, f"{without:.3f}", f"{guarded:.3f}", fraction])
    return table(["engine", "scene", "without (CPU s)", "with", "more"], rows)


def factorised(family: str, people: int) -> list[list[str]]:
    """Time whole matrices, Θ over several decades, by the core and by CHOLMOD as cvxopt has it."""
    from cvxopt import cholmod, matrix, spmatrix

    case, draw = FAMILIES[family](people), np.random.default_rng(1)
    contacts, crowd, none = case.contacts, case.snapshot, np.zeros(len(case.contacts))
    normals, mass = contacts.normal_matrix(people), np.repeat(crowd.mass, 2)
    theta = 10.0 ** draw.uniform(-DECADES, DECADES, len(contacts)) * mass.mean()
    pressed = normals.T @ sparse.diags_array(theta) @ normals
    full = sparse.csc_array(sparse.diags_array(mass) + pressed)
    lower, right = sparse.coo_array(sparse.tril(full)), draw.normal(size=2 * people)
    second = np.where(contacts.is_wall, -1, contacts.second)
    ends = contacts.first.astype(np.int32), second.astype(np.int32)
    # the core makes the matrix itself, from contacts
    pairs = *ends, contacts.normal, crowd.position, crowd.radius, crowd.mass
    inputs = spmatrix(lower.data, lower.row.tolist(), lower.col.tolist(), lower.shape)

    def solved(plan: object) -> Floats:
        x = matrix(right)
        cholmod.solve(plan, x)
        return np.array(x).ravel()

    rows = []
    for name, analyse, factorise, solve_with in (
        (
            "own",
            partial(_core.Factor, pairs, none, none, False, people >= MANY),
            # a Θ that it has just factorised it would take as it is
            lambda plan: [plan.factorise(times * theta) for times in (2.0, 1.0)],
            lambda plan: plan.solve(right.reshape(-1, 2)).ravel(),
        ),
        (
            "CHOLMOD",
            partial(cholmod.symbolic, inputs),
            lambda plan: [cholmod.numeric(inputs, plan) for _ in range(2)],
            solved,
        ),
    ):
        one, plan = shortest_time(analyse)
        two = 0.5 * shortest_time(partial(factorise, plan))[0]
        three, x = shortest_time(partial(solve_with, plan))
        size = abs(full).sum(axis=1).max() * np.abs(x).max() + np.abs(right).max()
        times = (f"{1e3 * spent:.2g}" for spent in (one, two, three, one + 15 * two + 35 * three))
        missed = f"{np.abs(full @ x - right).max() / size:.0e}"
        rows.append([family, str(people), name, *times, missed])
    return rows


def factors(args: argparse.Namespace) -> str:
    """Time the factorisation on a heap and on a jam, on one thread."""
    rows = [row for name in ("heap", "jammed") for row in in_process(factorised, name, args.people)]
    names = ("crowd", "disks", "by", "analyse (ms)", "factorise", "solve", "in all", "residual")
    return table(names, rows)


def solved_dump(dump: Path, workers: int, frames: int, out: Path) -> list[object]:
    """Time a whole dump to a table."""
    setting = setting_beside(dump, left_velocity="desired", contact_tolerance=TOUCH)
    job = DumpToSolve(path=dump, setting=setting, tolerance=TOLERANCE, indeterminacy="none")
    # kernels are loaded before; of another dump to the cache, so that frames are found once more
    replace(job, time_step=1.0, parquet=is_parquet(out)).solve(range(frames - 3, frames))
    started, used = time.perf_counter(), sum(os.times()[:4])
    found = solve_dump(job, out, workers=workers)
    wall, cpu = time.perf_counter() - started, sum(os.times()[:4]) - used
    spent = f"{wall:.2f}", f"{cpu:.2f}", f"{1e3 * wall / frames:.2f}"
    return [out.suffix[1:], workers, *spent, found.contacts, len(found.unsolved)]


def dumps(args: argparse.Namespace) -> str:
    """Make the dumps unless the folder has them, and time each to both tables."""
    rows: list[list[object]] = []
    with tempfile.TemporaryDirectory() as brief:
        folder = args.folder or Path(brief)
        for name in ("arch", "jam"):
            dump = folder / f"{name}_{args.people}_{args.frames}" / "bodies.dump"
            if not dump.exists():
                scene = make(name, args.people).with_run(frames=args.frames)
                simulate(scene, "lammps", dump.parent)
            for kind, workers in product(("csv", "parquet"), (1, 2)):
                out = folder / f"contacts.{kind}"
                rows.append([name, *solved_dump(dump, workers, args.frames, out)])
    names = ("wall s", "CPU s", "ms per frame", "contacts", "not solved")
    return table(["crowd", "table", "workers", *names], rows)


def main() -> None:
    """Print the tables."""
    parts = {one.__name__: one for one in (ways, runs, drives, bodies, guard, factors, dumps)}
    args = options(
        __doc__, what=parts, repeats=5, people=594, steps=100, friction=0.0, frames=1000,
        folder=Path,
    )  # fmt: skip
    print(describe())
    for name in args.what:
        print("", parts[name](args), sep="\n", flush=True)


if __name__ == "__main__":
    main()
