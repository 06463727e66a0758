"""Fig. 2: a push in a corridor, by percussions, which act at a distance at once, and by soft contacts."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure

from analysis.compare.comparison import Comparison, compare_run
from analysis.compare.statistics import exponent, penalty_difference, statistics
from analysis.dumps import open_bodies
from analysis.engines.run import EngineRun
from analysis.pages import drawing, numbers
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.discrete.engine_runs import each, end_of
from analysis.paper.discrete.line_of_disks import impact_time
from analysis.percussions.snapshot import SnapshotPercussions, percussions_of
from analysis.scene.scene import Scene, read_scene
from analysis.support.parallel import Progress
from nscd import ContactLaw, Contacts, Percussions, Snapshot
from nscd.arrays import Flags, Floats
from nscd.stepping import Motion

# Disks whose x differ by less stand in one column.
SAME_M = 1e-6


class Gaps(NamedTuple):
    """The m gaps between neighbouring columns."""

    distance: Floats  # (m,) m from the first column
    flux: Floats  # (m,) N·s, the momentum along x that percussions pass through
    gained: Floats  # (m,) N·s, what the disks beyond gain of it
    columns: Floats  # (m,) N·s, the flux that (5), (6) give for columns that move as one
    largest: Floats  # (m,) N·s, the largest percussion


def at_rest(scene: Scene) -> Flags:
    """Tell who is at rest before the push, (n,)."""
    return np.asarray(np.hypot(*scene.snapshot.velocity.T) == 0)


def local_contacts(scene: Scene, contacts: Contacts) -> Flags:
    """Tell in which contacts (k,) a pushing disk takes part."""
    pushing = ~at_rest(scene)
    second = np.where(contacts.is_wall, contacts.first, contacts.second)
    return np.asarray(pushing[contacts.first] | pushing[second])


def columns(x: Floats) -> Floats:
    """Find the distinct x (m) of disks that stand in columns, rising."""
    return np.asarray(np.unique(np.round(x, 6)))


def in_columns(x: Floats) -> Flags:
    """Tell which column (c,) each disk stands in, (n,c)."""
    return np.asarray(np.abs(x[:, None] - columns(x)) < SAME_M)


def _middles(x: Floats) -> Floats:
    """The x (m,) of the gaps' middles (m)."""
    return np.asarray(0.5 * (columns(x)[1:] + columns(x)[:-1]))


def _crosses(x: Floats, pairs: Contacts) -> Flags:
    """Which gap (m,) each contact of two disks crosses, (k,m)."""
    a, b = x[pairs.first], x[pairs.second]
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.asarray((low[:, None] < _middles(x)) & (high[:, None] > _middles(x)))


def flux(x: Floats, contacts: Contacts, impulse: Floats) -> Floats:
    """Sum the impulses (k,2) N·s of contacts along x through each gap, (m,) N·s."""
    chosen = ~contacts.is_wall
    pairs = contacts.select(chosen)
    along = impulse[chosen, 0] * np.sign(x[pairs.second] - x[pairs.first])
    return np.asarray(along @ _crosses(x, pairs))


def gaps_of(scene: Scene, contacts: Contacts, answer: Percussions) -> Gaps:
    """Follow the push from column to column."""
    snapshot, middles = scene.snapshot, _middles(scene.snapshot.position[:, 0])
    x, left = snapshot.position[:, 0], snapshot.velocity[:, 0]
    change = snapshot.mass * (answer.right_velocity[:, 0] - left)
    mass, momentum = snapshot.mass @ in_columns(x), (snapshot.mass * left) @ in_columns(x)
    pairs = ~contacts.is_wall
    size = np.hypot(*answer.impulse[pairs].T)
    return Gaps(
        distance=middles - columns(x)[0],
        flux=flux(x, contacts, answer.impulse),
        gained=np.array([change[x > middle].sum() for middle in middles]),
        columns=np.cumsum(momentum - mass * momentum.sum() / mass.sum())[:-1],
        largest=(size[:, None] * _crosses(x, contacts.select(pairs))).max(0),
    )


def first_arrivals(x: Floats, arrival: Floats) -> tuple[Floats, Floats]:
    """Find each column's x (m) and the earliest arrival in it (s), NaN where it was not reached."""
    times = np.where(in_columns(x) & np.isfinite(arrival)[:, None], arrival[:, None], np.inf)
    first = times.min(0)
    return columns(x), np.where(np.isfinite(first), first, np.nan)


def long_wave_speed(scene: Scene, contacts: Contacts) -> float:
    """Compute c = d √(K/m̄) (m/s) of long waves along columns, a chain of rigid columns on springs.

    d: the spacing of the columns; K = k Σ nₓ² over the contacts between two neighbours; m̄: the mean
    mass of a column (inner columns)."""
    x = scene.snapshot.position[:, 0]
    pairs = contacts.select(~contacts.is_wall)
    springs = (pairs.normal[:, 0] ** 2) @ _crosses(x, pairs)
    stiffness = scene.contact.stiffness_N_per_m * springs.mean()
    masses = scene.snapshot.mass @ in_columns(x)
    # two neighbours share each kind of column, so that the mean is taken over whole pairs
    mass = masses[: 2 * (len(masses) // 2)].mean()
    return float(np.diff(columns(x)).mean() * np.sqrt(stiffness / mass))


# A disk is reached once it is this share of the push as fast.
REACHED = 0.01
# Columns before this one (counted from the pushing one) still feel how the push began.
FRONT_FROM = 5


class Push(NamedTuple):
    """One engine's run of a push."""

    engine: str
    stiffness: float  # N/m, k of its contacts
    restitution: float  # e asked of them
    damping: float  # ζ, their damping ratio
    comparison: Comparison  # its impulses against the percussions
    numbers: dict[str, float | int]  # the same in numbers
    difference: float  # rms(∫f dt − p) / rms(∫f dt)
    first_arrivals: tuple[Floats, Floats]  # each column's x (m), and the earliest arrival there (s)
    speed: float  # m/s, of the front


def front_speed(x: Floats, first: Floats) -> float:
    """Take the slope (m/s) of distance (m) against the first arrival (s) in each column; NaN for
    fewer than 3."""
    known = np.isfinite(first)
    known[:FRONT_FROM] = False
    return float(1 / np.polyfit(x[known], first[known], 1)[0]) if known.sum() >= 3 else np.nan


def push_scene(
    scene: Scene, stiffness: float, restitution: float, periods: float, frames: int
) -> Scene:
    """Make the scene with another stiffness (N/m) and restitution, run for `periods` times
    √(m/k)."""
    variant = scene.model_copy(update={"name": f"{scene.name}_e{restitution:g}"})
    variant = variant.with_contact(stiffness_N_per_m=stiffness, restitution=restitution)
    seconds = periods * impact_time(variant)
    return variant.with_run(duration_s=seconds, frames=frames, time_step_s=None)


def run_push(run: EngineRun, progress: Progress | None = None) -> Push:
    """Read what an engine's run of the push shows. Raises EngineError for an engine that is missing
    or fails."""
    scene, record = run.scene, run.record(progress)
    trajectory = open_bodies(run.folder / "bodies.dump", record.time_step_s).trajectory
    frames = [(f.time, np.hypot(f.data["vx"], f.data["vy"])) for f in trajectory]
    times, speeds = map(np.array, zip(*frames, strict=True))
    pushing = float(np.hypot(*scene.snapshot.velocity.T).max())
    arrival = crossing_times(times, speeds, REACHED * pushing)
    first = first_arrivals(scene.snapshot.position[:, 0], arrival)
    # the paper's percussions are inelastic, whatever the soft contacts are
    comparison = compare_run(run.folder, law=ContactLaw())
    found, contact = statistics(comparison), scene.contact
    return Push(
        engine=run.engine,
        stiffness=contact.stiffness_N_per_m,
        restitution=contact.restitution,
        damping=record.damping_ratio,
        comparison=comparison,
        numbers=found,
        difference=found["contact_relative_difference"],
        first_arrivals=first,
        speed=front_speed(*first),
    )


def crossing_times(times: Floats, values: Floats, level: float) -> Floats:
    """Find when each column of values (frames, n) first reaches the level (s), linear between
    frames; NaN where never."""
    above, each_column = values >= level, np.arange(values.shape[1])
    frame = above.argmax(0)
    before = np.maximum(frame - 1, 0)
    start, end = values[before, each_column], values[frame, each_column]
    share = np.divide(level - start, end - start, out=np.zeros_like(start), where=frame > 0)
    crossing = times[before] + share * (times[frame] - times[before])
    return np.where(above.any(0), crossing, np.nan)


# s: the push has gone through the corridor several times
TIME_S = 1.0
STEP_S = 1e-3
STIFFNESS, RESTITUTION = 1e6, 0.01  # N/m and –, of the soft disks
# Who is displaced less has not moved.
MOVED_M = 1e-3


class Final(NamedTuple):
    """Where everybody is a second after the push, (n,2) m, and how far each of those who were at
    rest before is displaced (m)."""

    model: str
    position: Floats
    displaced: Floats

    @property
    def moved(self) -> int:
        """How many of those who were at rest are displaced."""
        return int((self.displaced > MOVED_M).sum())


def final_of(model: str, scene: Scene, position: Floats) -> Final:
    """Measure how far those who were at rest are displaced."""
    away = (position - scene.snapshot.position)[at_rest(scene)]
    return Final(model, position, np.hypot(*away.T))


def rigid_final(scene: Scene) -> Final:
    """Step the push with rigid, inelastic disks."""
    motion = Motion(scene.snapshot, scene.wall_segments(), step=STEP_S)
    for _ in range(round(TIME_S / STEP_S)):
        motion.advance()
    return final_of("rigid disks, k = 0", scene, motion.position)


INELASTIC, ELASTIC = 0.05, 1.0
# With e = 1 the push overlaps disks by two thirds of a radius at 1e4 N/m, which is no model of a
# body any more.
STIFFNESSES = (1e5, 1e6, 1e8)  # N/m
# Restitutions of damping ratios 1, 2, 5 and 10, at one stiffness: the inelastic limit.
DAMPED = (0.1353, INELASTIC, 0.01, 0.0024)
# Frames by restitution, so many that the impulses close the balance of momentum to a few per cent.
FRAMES = {0.1353: 300, INELASTIC: 300, 0.01: 1000, 0.0024: 2000}
DAMPED_STIFFNESS = 1e6  # N/m
# A percussion below this share of the largest is none.
CARRIES = 1e-6


def push_runs(runs: Path) -> list[EngineRun]:
    """List the push as soft contacts: elastic and inelastic at each stiffness by both engines, and
    with more damping."""
    cases = [
        (e, k, r) for e in ("lammps", "yade") for r in (INELASTIC, ELASTIC) for k in STIFFNESSES
    ]
    cases += [("lammps", DAMPED_STIFFNESS, r) for r in DAMPED if r != INELASTIC]
    scene, found = read_scene("corridor"), []
    for engine, k, restitution in cases:
        # the front needs 12 √(m/k) to the end; damped contacts let go later and jump at the start,
        # the more damped the faster
        periods, frames = (14, 140) if restitution == ELASTIC else (24, FRAMES[restitution])
        found.append(EngineRun.of(push_scene(scene, k, restitution, periods, frames), engine, runs))
    return found


def final_runs(runs: Path) -> list[EngineRun]:
    """List the longer run of each engine, with strongly damped disks, to the final positions."""
    scene = read_scene("corridor")
    variant = scene.model_copy(update={"name": f"{scene.name}_final"})
    variant = variant.with_contact(stiffness_N_per_m=STIFFNESS, restitution=RESTITUTION)
    variant = variant.with_run(duration_s=TIME_S, frames=1, time_step_s=None)
    return [EngineRun.of(variant, name, runs) for name in ENGINE_NAMES if name != "rigid"]


class Corridor(NamedTuple):
    """What the pictures of figure 2 show: n disks, k contacts."""

    scene: Scene
    found: SnapshotPercussions  # the percussions
    local: Flags  # (k,), whether a pushing disk takes part in a contact
    size: Floats  # (k,) N·s, |p| of each contact
    carries: Flags  # (k,), whether a contact carries a percussion
    gaps: Gaps  # how the push goes from column to column
    pushes: list[Push]  # the push by each engine, stiffness and damping
    finals: list[Final]  # where everybody is a second later, by rigid disks first

    def pushed(self, *restitutions: float) -> list[Push]:
        """The pushes of these restitutions, at rising stiffness."""
        return [push for push in self.pushes if push.restitution in restitutions]

    @property
    def damped(self) -> list[Push]:
        """The pushes at one stiffness with rising damping."""
        kind = "lammps", DAMPED_STIFFNESS
        chosen = [push for push in self.pushes if (push.engine, push.stiffness) == kind]
        damped = (push for push in chosen if push.restitution < ELASTIC)
        return sorted(damped, key=lambda push: -push.restitution)

    def long_wave(self, stiffness: float) -> float:
        """Speed (m/s) of long waves in springs of that stiffness (N/m)."""
        scene = self.scene.with_contact(stiffness_N_per_m=stiffness)
        return long_wave_speed(scene, self.found.contacts)


def corridor_of(runs: Path, warnings: list[str], progress: Progress | None) -> Corridor:
    """Compute figure 2; `runs` keeps the engine runs, and one that fails is a warning."""
    scene = read_scene("corridor")
    found = percussions_of(scene, scene.snapshot, tolerance=1e-10)
    warnings += unsolved([("percussions", found.answer)])

    def soft_final(run: EngineRun) -> Final:
        return final_of(ENGINE_NAMES[run.engine], run.scene, end_of(run, progress).position)

    size = np.hypot(*found.answer.impulse.T)
    return Corridor(
        scene=scene,
        found=found,
        local=local_contacts(scene, found.contacts),
        size=size,
        carries=size > CARRIES * size.max(),
        gaps=gaps_of(scene, found.contacts, found.answer),
        pushes=each(push_runs(runs), partial(run_push, progress=progress), warnings),
        finals=[rigid_final(scene), *each(final_runs(runs), soft_final, warnings)],
    )


def rigid_numbers(corridor: Corridor) -> dict[str, Any]:
    """Say who carries the push, and how far it goes."""
    scene, found, local, size, carries, *_ = corridor
    resting, x = at_rest(scene), scene.snapshot.position[:, 0]
    distance = x - x.min()
    return {
        "finals": corridor.finals,
        "resting": resting,
        "pushing": int((~resting).sum()),
        "near": int((carries & local).sum()),
        "far": int((carries & ~local).sum()),
        "far_share": float(size[~local].sum() / size.sum()),
        "distance": distance,
        "reach": float(distance[found.contacts.first[carries]].max()),
        # who is at rest before and moves after
        "moved": resting & (np.hypot(*found.answer.right_velocity.T) > 1e-6),
    }


def front_powers(corridor: Corridor) -> list[float]:
    """Find the a of speed ∝ kᵃ of the front of soft contacts, by engine and restitution."""
    waves, powers = corridor.pushed(INELASTIC, ELASTIC), []
    for kind in sorted({(push.engine, push.restitution) for push in waves}):
        mine = [push for push in waves if (push.engine, push.restitution) == kind]
        power = exponent(
            *(np.array([getattr(p, of) for p in mine]) for of in ("stiffness", "speed"))
        )
        if np.isfinite(power):
            powers.append(power)
    return powers


def soft_flux(push: Push) -> Floats:
    """Sum the impulses along x (m,) N·s that soft contacts passed through each gap."""
    match = push.comparison.match
    return flux(push.comparison.snapshot.position[:, 0], match.contacts, match.penalty)


KINDS: Sequence[tuple[str, str, Any]] = (
    ("non-local", drawing.BLUE, "-"),
    ("local (a pushing disk takes part)", drawing.BLACK, (0, (2, 1))),
)
RESTING, PUSHING = drawing.PALER_BLUE, drawing.PALE_ORANGE
DIFFERENCE = "rms(∫f dt − p) / rms(∫f dt) (–)"


def draw_network(corridor: Corridor) -> Figure:
    """Draw who pushes above; percussions, width ∝ |p|, local dashed; right velocities below."""
    figure, (before, middle, after) = drawing.panels(8.5, 8.6, 3, 1, sharex=True)
    snapshot, answer, size = corridor.scene.snapshot, corridor.found.answer, corridor.size
    for axes in (before, middle, after):
        _draw_corridor(axes, corridor)
    after.set_xlabel("x (m)")
    before.set_title("left velocities", fontsize=10)
    _arrows(before, snapshot.position, snapshot.velocity, 0.2)
    lines = drawing.contact_lines(snapshot, corridor.found.contacts)
    for chosen, (_, colour, style) in zip((~corridor.local, corridor.local), KINDS, strict=True):
        shown = corridor.carries & chosen
        drawn: dict[str, Any] = {"colors": colour, "linestyles": [style], "capstyle": "butt"}
        drawn["linewidths"] = list(7 * size[shown] / size.max())
        middle.add_collection(LineCollection(list(lines[shown]), **drawn))
    handles = [middle.plot([], [], color=c, ls=s, lw=3, label=words)[0] for words, c, s in KINDS]
    middle.set_title(f"percussions, the widest is {size.max():.0f} N·s", fontsize=10)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8)
    after.set_title("right velocities (arrows four times as long as above)", fontsize=10)
    _arrows(after, snapshot.position, answer.right_velocity, 0.8)
    return figure


def draw_finals(finals: Sequence[Final], scene: Scene) -> Figure:
    """Draw where everybody is at the end, a panel for each model; outlines: where they began."""
    figure, every = drawing.panels(8.5, 2.7 * len(finals), len(finals), sharex=True)
    before = drawing.circles(scene.snapshot)
    for axes, one in zip(every, finals, strict=True):
        _draw_people(axes, scene, replace(scene.snapshot, position=one.position))
        outline = PatchCollection(before, facecolor="none", edgecolor=drawing.BLUE, lw=0.6, ls=":")
        axes.add_collection(outline)
        low, high = one.position[:, 0].min() - 0.6, one.position[:, 0].max() + 0.6
        axes.set(xlim=(low, high), ylim=(-1.25, 1.25), aspect="equal", ylabel="y (m)")
        axes.set_title(one.model, fontsize=10)
    every[-1].set_xlabel("x (m)")
    return figure


def _draw_corridor(axes: Axes, corridor: Corridor) -> None:
    snapshot = corridor.scene.snapshot
    _draw_people(axes, corridor.scene, snapshot)
    end = snapshot.position[:, 0].max() + 0.6
    axes.set(xlim=(-0.6, end), ylim=(-1.25, 1.25), aspect="equal", ylabel="y (m)")


def _draw_people(axes: Axes, scene: Scene, now: Snapshot) -> None:
    """Those who rested and those who pushed, and the walls."""
    style: dict[str, Any] = {"edgecolor": drawing.DARK_GREY, "linewidth": 0.5}
    resting = at_rest(scene)
    for chosen, colour, hatch in ((resting, RESTING, ""), (~resting, PUSHING, "////")):
        disks = PatchCollection(
            drawing.circles(now, chosen), facecolor=colour, hatch=hatch, **style
        )
        axes.add_collection(disks)
    drawing.draw_walls(axes, [(wall.start_m, wall.end_m) for wall in scene.walls])


def _arrows(axes: Axes, position: Floats, velocity: Floats, metres_per_speed: float) -> None:
    moving = np.hypot(*velocity.T) > 1e-6
    shown = metres_per_speed * velocity[moving]
    drawing.draw_vectors(axes, position[moving], shown, color=drawing.BLACK, width=0.003)


def draw_decay(corridor: Corridor) -> Figure:
    """Draw the momentum along x that goes through each gap between columns (percussions, the closed
    form of columns that move as one, soft contacts), and the largest percussion in it."""
    figure, (left, right) = drawing.panels(9.5, 4.0, 1, 2)
    gaps = corridor.gaps
    left.plot(
        gaps.distance, gaps.flux, drawing.MARKERS[0], color=drawing.BLACK, label="percussions"
    )
    words = "(5), (6) for whole columns"
    left.plot(gaps.distance, gaps.columns, "-", color=drawing.BLACK, lw=1, label=words)
    top = max(gaps.flux.max(), gaps.columns.max())
    for number, push in enumerate(corridor.damped[1::2]):
        values = soft_flux(push)
        top = max(top, values.max())
        style = {
            "ls": drawing.LINES[number + 1],
            "color": drawing.COLOURS[number],
            "mfc": "none",
            "ms": 5,
        }
        label = f"LAMMPS, ζ = {push.damping:.2g}"
        left.plot(gaps.distance, values, drawing.MARKERS[number + 1], label=label, **style)
    left.set(ylabel="impulse along x (N·s)", ylim=(0, 1.3 * top))
    left.legend(fontsize=8)
    right.plot(gaps.distance, gaps.largest, drawing.MARKERS[0], ls="-", color=drawing.BLUE)
    right.set_ylabel("largest percussion in the gap (N·s)")
    right.set_ylim(bottom=0)
    for axes in (left, right):
        axes.set_xlabel("distance from the pushing column (m)")
        axes.grid(alpha=0.3)
    return figure


def draw_wave(corridor: Corridor) -> Figure:
    """Draw the first arrival in each column against the distance, and the front's speed against the
    stiffness, with the long-wave speed of the springs."""
    figure, (left, right) = drawing.panels(10.0, 4.4, 1, 2)
    waves = corridor.pushed(INELASTIC, ELASTIC)
    stiffnesses = sorted({push.stiffness for push in waves})
    _arrivals(left, [p for p in waves if p.engine == waves[0].engine])
    kinds = sorted({(push.engine, push.restitution) for push in waves})
    for number, (engine, restitution) in enumerate(kinds):
        chosen = [p for p in waves if (p.engine, p.restitution) == (engine, restitution)]
        style = {"ms": 10 - 2 * number, "mfc": "none", "color": drawing.COLOURS[number]}
        label, marker = f"{ENGINE_NAMES[engine]}, e = {restitution:g}", drawing.MARKERS[number]
        x, y = [p.stiffness for p in chosen], [p.speed for p in chosen]
        right.plot(x, y, marker, label=label, **style)
    closed = [corridor.long_wave(stiffness) for stiffness in stiffnesses]
    right.plot(
        stiffnesses, closed, "-", color=drawing.BLACK, lw=1, label="long waves, d √(K/m), ∝ √k"
    )
    right.set(xscale="log", yscale="log", xlabel="stiffness k (N/m)")
    right.set_ylabel("speed of the front (m/s)")
    right.legend(fontsize=8)
    for axes in (left, right):
        axes.grid(alpha=0.3, which="both")
    return figure


def _arrivals(axes: Axes, pushes: Sequence[Push]) -> None:
    stiffnesses = sorted({push.stiffness for push in pushes})
    restitutions = sorted({push.restitution for push in pushes})
    for push in pushes:
        x, first = push.first_arrivals
        number, kind = stiffnesses.index(push.stiffness), restitutions.index(push.restitution)
        later = first > 0
        style = drawing.look(number, hollow=kind > 0) | {"ls": drawing.LINES[kind], "ms": 4}
        label = f"k = {numbers.number(push.stiffness)} N/m, e = {push.restitution:g}"
        axes.plot(x[later] - x[0], first[later], label=label, **style)
    axes.set(yscale="log", xlabel="distance from the pushing column (m)")
    axes.set_ylabel("first arrival (s)")
    axes.legend(fontsize=7, loc="lower right")
    axes.set_title(f"{ENGINE_NAMES[pushes[0].engine]}, percussions arrive at once", fontsize=10)


def draw_impulses(corridor: Corridor) -> Figure:
    """Draw ∫f dt against p contact by contact for the least and the most damping, and their
    difference against k and ζ."""
    figure, (cloud, by_stiffness, by_damping) = drawing.panels(11.0, 3.9, 1, 3)
    inelastic, damped = corridor.pushed(INELASTIC), corridor.damped
    _cloud(cloud, (damped[0], damped[-1]))
    for number, engine in enumerate(sorted({push.engine for push in inelastic})):
        mine = [push for push in inelastic if push.engine == engine]
        style = drawing.look(number, hollow=True) | {"ms": 9 - 4 * number}
        label = f"{ENGINE_NAMES[engine]}, e = {mine[0].restitution:g}"
        x, y = [push.stiffness for push in mine], [push.difference for push in mine]
        by_stiffness.plot(x, y, label=label, **style)
    top = max(push.difference for push in inelastic)
    by_stiffness.set(xscale="log", xlabel="stiffness k (N/m)", ylim=(0, 1.15 * top))
    label = f"{ENGINE_NAMES[damped[0].engine]}, k = {numbers.number(damped[0].stiffness)} N/m"
    values = [[push.damping for push in damped], [push.difference for push in damped]]
    by_damping.plot(*values, drawing.MARKERS[0], ls="-", color=drawing.BLUE, label=label)
    by_damping.set(xscale="log", yscale="log", xlabel="damping ratio ζ (–)")
    for axes in (by_stiffness, by_damping):
        axes.set_ylabel(DIFFERENCE)
    for axes in (cloud, by_stiffness, by_damping):
        axes.grid(alpha=0.3, which="both")
        axes.legend(fontsize=7)
    return figure


def _cloud(axes: Axes, pushes: Sequence[Push]) -> None:
    top = 0.0
    for number, push in enumerate(pushes):
        soft, rigid = push.comparison.match.normal_parts()
        top = max(top, float(rigid.max()), float(soft.max()))
        face, edge = (drawing.BLUE, drawing.BLUE) if number else ("none", drawing.ORANGE)
        label = f"e = {push.restitution:g} (ζ = {push.damping:.2g})"
        axes.plot(rigid, soft, drawing.MARKERS[number], ms=4, mfc=face, mec=edge, label=label)
    axes.plot([0, top], [0, top], "-", color=drawing.BLACK, lw=0.8, label="equal")
    axes.set(xlabel="percussion p (N·s)", ylabel="∫f dt (N·s)", aspect="equal")


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the pushes, and the longer runs to the final positions."""
    return push_runs(runs) + final_runs(runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 2: the network of percussions, how far the push goes, and the wave that soft
    contacts make of it.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning."""
    warnings: list[str] = []
    corridor = corridor_of(runs, warnings, progress)
    rigid = rigid_numbers(corridor)
    words = Words(__name__, corridor=rigid)
    pictures = {
        "fig_2_network": draw_network(corridor),
        "fig_2_final": draw_finals(corridor.finals, corridor.scene),
        "fig_2_decay": draw_decay(corridor),
    }
    if corridor.pushed(INELASTIC, ELASTIC):
        pictures["fig_2_wave"] = draw_wave(corridor)
    if corridor.pushed(INELASTIC) and corridor.damped:
        pictures["fig_2_impulses"] = draw_impulses(corridor)
    to_the_end = rigid["reach"] >= rigid["distance"].max() - 1e-9
    final = corridor.finals[0]
    claims = [
        words.claim("non_local", Verdict.of(rigid["far"] > 0 and to_the_end)),
        words.claim(
            "displacement", Verdict.of(final.moved == len(final.displaced), final.moved > 0)
        ),
    ]
    if powers := front_powers(corridor):
        # the interaction at a distance is there without a wave: what is right of it is the wave
        verdict = Verdict.PARTLY if min(powers) > 0.1 else Verdict.HOLDS
        claims.append(words.claim("shock_wave", verdict, powers=powers))
    tables = _tables(corridor)
    return words.section("2", pictures=pictures, tables=tables, claims=claims, warnings=warnings)


def _tables(corridor: Corridor) -> dict[str, list[list[Cell]]]:
    speeds: list[list[Cell]] = []
    for one in corridor.pushed(INELASTIC, ELASTIC):
        closed, last = corridor.long_wave(one.stiffness), float(one.first_arrivals[1][-1])
        name, ratio = ENGINE_NAMES[one.engine], one.speed / closed - 1
        speeds.append([name, one.restitution, one.stiffness, last, one.speed, closed, ratio])
    shares: list[list[Cell]] = []
    for one in (push for push in corridor.pushes if push.restitution != ELASTIC):
        law = ENGINE_NAMES[one.engine], one.restitution, one.damping, one.stiffness
        alike = (one.numbers[f"contact{name}"] for name in ("_correlation", "s_only_penalty"))
        closure = one.comparison.balance.closure_error
        other = _between_engines(one, corridor.pushes)
        shares.append([*law, one.difference, *alike, closure, other])
    finals: list[list[Cell]] = []
    for model in corridor.finals:
        moved = [float(f(model.displaced)) for f in (np.mean, np.median, np.max)]
        away = ((model.position - corridor.finals[0].position) ** 2).sum(1).mean()
        finals.append([model.model, model.moved, *moved, float(np.sqrt(away))])
    gaps: list[list[Cell]] = np.column_stack(corridor.gaps).tolist()
    shown = {"table_gaps": gaps, "table_front": speeds}
    return shown | {"table_impulses": shares, "table_final": finals}


def _between_engines(one: Push, pushes: list[Push]) -> Cell:
    for other in pushes:
        same = (other.stiffness, other.restitution) == (one.stiffness, one.restitution)
        if same and other.engine != one.engine:
            return penalty_difference(one.comparison, other.comparison)
    return "–"
