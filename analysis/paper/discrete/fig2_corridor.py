"""Fig. 2: a push in a corridor, by percussions, which act at a distance at once, and by soft contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure

from analysis.compare.comparison import Comparison, compare_run
from analysis.compare.statistics import correlation, exponent, penalty_difference, statistics
from analysis.dumps import open_bodies
from analysis.engines.run import EngineRun
from analysis.pages import numbers
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    COLOURS,
    DARK_GREY,
    LINES,
    MARKERS,
    ORANGE,
    PALE_ORANGE,
    PALER_BLUE,
    circles,
    contact_lines,
    draw_vectors,
    draw_walls,
    look,
    panels,
)
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell, Claim, Section, Table, Verdict
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gaps:
    """The m gaps between neighbouring columns."""

    distance: Floats  # (m,) m from the first column
    flux: Floats  # (m,) N·s, the momentum along x that percussions pass through
    gained: Floats  # (m,) N·s, what the disks beyond gain of it
    columns: Floats  # (m,) N·s, the flux that (5), (6) give for columns that move as one
    largest: Floats  # (m,) N·s, the largest percussion

    @property
    def linearity(self) -> float:
        """Correlation of the flux with the distance."""
        return correlation(self.distance, self.flux)


def local_contacts(scene: Scene, contacts: Contacts) -> Flags:
    """Tell in which contacts (k,) a pushing disk takes part."""
    pushing = np.hypot(*scene.snapshot.velocity.T) > 0
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Push:
    """One engine's run of a push."""

    comparison: Comparison  # its impulses against the percussions
    arrival: Floats  # (n,) s at each disk; 0 for those that push, NaN where it never arrives

    @property
    def engine(self) -> str:
        """The engine's name."""
        return self.comparison.record.engine

    @property
    def stiffness(self) -> float:
        """k of its contacts (N/m)."""
        return self.comparison.scene.contact.stiffness_N_per_m

    @property
    def restitution(self) -> float:
        """e asked of its contacts."""
        return self.comparison.scene.contact.restitution

    @property
    def damping(self) -> float:
        """Damping ratio ζ of its contacts."""
        return self.comparison.record.damping_ratio

    @cached_property
    def numbers(self) -> dict[str, float | int]:
        """Its impulses against the percussions, in numbers."""
        return statistics(self.comparison)

    @property
    def difference(self) -> float:
        """rms(∫f dt − p) / rms(∫f dt)."""
        return float(self.numbers["contact_relative_difference"])

    @property
    def first_arrivals(self) -> tuple[Floats, Floats]:
        """Each column's x (m) and the earliest arrival in it (s)."""
        return first_arrivals(self.comparison.snapshot.position[:, 0], self.arrival)

    @property
    def speed(self) -> float:
        """Speed of the front (m/s): slope of distance against the first arrival in each column; NaN
        for fewer than 3."""
        x, first = self.first_arrivals
        known = np.isfinite(first)
        known[:FRONT_FROM] = False
        if known.sum() < 3:
            return float("nan")
        return float(1 / np.polyfit(x[known], first[known], 1)[0])


def push_scene(
    scene: Scene, stiffness: float, restitution: float, periods: float, frames: int
) -> Scene:
    """Make the scene with another stiffness (N/m) and restitution, run for `periods` times
    √(m/k)."""
    variant = scene.model_copy(update={"name": f"{scene.name}_e{restitution:g}"})
    variant = variant.with_contact(stiffness_N_per_m=stiffness, restitution=restitution)
    return variant.with_run(
        duration_s=periods * impact_time(variant), frames=frames, time_step_s=None
    )


def run_push(run: EngineRun, progress: Progress | None = None) -> Push:
    """Read what an engine's run of the push shows. Raises EngineError for an engine that is missing
    or fails."""
    scene, record = run.scene, run.record(progress)
    trajectory = open_bodies(run.folder / "bodies.dump", record.time_step_s).trajectory
    times, speeds = [], []
    for frame in trajectory:
        times.append(float(frame.time))
        speeds.append(np.hypot(frame.data["vx"], frame.data["vy"]))
    pushing = float(np.hypot(*scene.snapshot.velocity.T).max())
    arrival = crossing_times(np.array(times), np.array(speeds), REACHED * pushing)
    # the paper's percussions are inelastic, whatever the soft contacts are
    return Push(comparison=compare_run(run.folder, law=ContactLaw()), arrival=arrival)


def crossing_times(times: Floats, values: Floats, level: float) -> Floats:
    """Find when each column of values (frames, n) first reaches the level (s), linear between
    frames; NaN where never."""
    above = values >= level
    crossing = np.full(values.shape[1], np.nan)
    for column in np.flatnonzero(above.any(0)):
        frame = int(np.argmax(above[:, column]))
        if frame == 0:
            crossing[column] = times[0]
            continue
        before, after = values[frame - 1 : frame + 1, column]
        share = (level - before) / (after - before)
        crossing[column] = times[frame - 1] + share * (times[frame] - times[frame - 1])
    return crossing


# s: the push has gone through the corridor several times
TIME_S = 1.0
STEP_S = 1e-3
STIFFNESS, RESTITUTION = 1e6, 0.01  # N/m and –, of the soft disks
# Who is displaced less has not moved.
MOVED_M = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Final:
    """Positions (n,2) m at the end, and who was at rest before the push (n,)."""

    model: str
    start: Floats
    position: Floats
    resting: Flags

    @property
    def displaced(self) -> Floats:
        """How far each of those who were at rest is displaced (m)."""
        return np.asarray(np.hypot(*(self.position - self.start)[self.resting].T))

    @property
    def moved(self) -> int:
        """How many of those who were at rest are displaced."""
        return int((self.displaced > MOVED_M).sum())


def rigid_final(scene: Scene) -> Final:
    """Step the push with rigid, inelastic disks."""
    motion = Motion(scene.snapshot, scene.wall_segments(), step=STEP_S)
    for _ in range(round(TIME_S / STEP_S)):
        motion.advance()
    return _final("rigid disks, k = 0", scene, motion.position)


def final_run(scene: Scene, engine: str, runs: Path) -> EngineRun:
    """Name the run of the push with soft, strongly damped disks."""
    variant = scene.model_copy(update={"name": f"{scene.name}_final"})
    variant = variant.with_contact(stiffness_N_per_m=STIFFNESS, restitution=RESTITUTION)
    variant = variant.with_run(duration_s=TIME_S, frames=1, time_step_s=None)
    return EngineRun.of(variant, engine, runs)


def soft_final(run: EngineRun, progress: Progress | None) -> Final:
    """Read where an engine's run ends. Raises EngineError, DumpError."""
    return _final(ENGINE_NAMES[run.engine], run.scene, end_of(run, progress).position)


def _final(model: str, scene: Scene, position: Floats) -> Final:
    resting = np.hypot(*scene.snapshot.velocity.T) == 0
    return Final(model=model, start=scene.snapshot.position, position=position, resting=resting)


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
    """List the longer run of each engine, to the final positions."""
    scene = read_scene("corridor")
    return [final_run(scene, engine, runs) for engine in ENGINE_NAMES if engine != "rigid"]


@dataclass(frozen=True, slots=True, eq=False)
class Front:
    """The front of the push in one engine at one restitution, at two stiffnesses or more."""

    engine: str
    restitution: float
    pushes: list[Push]
    power: float  # a of speed ∝ kᵃ


@dataclass(frozen=True, kw_only=True, eq=False)
class Corridor:
    """All that figure 2 shows: n disks, k contacts."""

    scene: Scene
    found: SnapshotPercussions  # the percussions
    pushes: list[Push]  # the push by each engine, stiffness and damping
    finals: list[Final]  # where everybody is a second later, by rigid disks first
    warnings: list[str]

    @classmethod
    def of(cls, runs: Path, progress: Progress | None) -> Corridor:
        """Compute it; `runs` keeps the engine runs, and one that fails is a warning."""
        scene = read_scene("corridor")
        found = percussions_of(scene, scene.snapshot, tolerance=1e-10)
        warnings = unsolved([("percussions", found.answer)])
        pushes = each(push_runs(runs), partial(run_push, progress=progress), warnings)
        soft = each(final_runs(runs), partial(soft_final, progress=progress), warnings)
        finals = [rigid_final(scene), *soft]
        return cls(scene=scene, found=found, pushes=pushes, finals=finals, warnings=warnings)

    @cached_property
    def local(self) -> Flags:
        """Whether a pushing disk takes part in a contact, (k,)."""
        return local_contacts(self.scene, self.found.contacts)

    @cached_property
    def size(self) -> Floats:
        """|p| of each contact, (k,) N·s."""
        return np.asarray(np.hypot(*self.found.answer.impulse.T))

    @cached_property
    def carries(self) -> Flags:
        """Whether a contact carries a percussion, (k,)."""
        return np.asarray(self.size > CARRIES * self.size.max())

    @property
    def near(self) -> int:
        """How many contacts of a pushing disk carry a percussion."""
        return int((self.carries & self.local).sum())

    @property
    def far(self) -> int:
        """How many contacts without a pushing disk carry a percussion."""
        return int((self.carries & ~self.local).sum())

    @property
    def far_share(self) -> float:
        """Share of the sum of magnitudes that contacts without a pushing disk have."""
        return float(self.size[~self.local].sum() / self.size.sum())

    @cached_property
    def gaps(self) -> Gaps:
        """How the push goes from column to column."""
        return gaps_of(self.scene, self.found.contacts, self.found.answer)

    @property
    def distance(self) -> Floats:
        """From the pushing column, (n,) m."""
        x = self.scene.snapshot.position[:, 0]
        return np.asarray(x - x.min())

    @property
    def reach(self) -> float:
        """Distance (m) of the furthest disk with a percussion."""
        return float(self.distance[self.found.contacts.first[self.carries]].max())

    @property
    def resting(self) -> Flags:
        """Who is at rest before, (n,)."""
        return np.asarray(np.hypot(*self.scene.snapshot.velocity.T) == 0)

    @property
    def pushing(self) -> int:
        """How many push."""
        return int((~self.resting).sum())

    @property
    def moved(self) -> Flags:
        """Who is at rest before and moves after, (n,)."""
        return np.asarray(self.resting & (np.hypot(*self.found.answer.right_velocity.T) > 1e-6))

    @property
    def inelastic(self) -> list[Push]:
        """The pushes of one restitution at rising stiffness."""
        return [push for push in self.pushes if push.restitution == INELASTIC]

    @property
    def waves(self) -> list[Push]:
        """The pushes whose front is followed."""
        return [push for push in self.pushes if push.restitution in (INELASTIC, ELASTIC)]

    @property
    def stiffened(self) -> list[Push]:
        """Those of the first engine."""
        return [push for push in self.inelastic if push.engine == self.inelastic[0].engine]

    @property
    def damped(self) -> list[Push]:
        """The pushes at one stiffness with rising damping."""
        kind = "lammps", DAMPED_STIFFNESS
        chosen = [push for push in self.pushes if (push.engine, push.stiffness) == kind]
        damped = (push for push in chosen if push.restitution < ELASTIC)
        return sorted(damped, key=lambda push: -push.restitution)

    @property
    def damping_is_the_limit(self) -> bool:
        """Whether damping brings ∫f dt to the percussions and stiffness does not."""
        if len(self.stiffened) < 2 or len(self.damped) < 2:
            return False
        return self.damped[-1].difference < 0.5 * self.inelastic[-1].difference

    @cached_property
    def fronts(self) -> list[Front]:
        """The fronts, inelastic ones first, of each engine."""
        found = []
        for restitution in (INELASTIC, ELASTIC):
            for engine in dict.fromkeys(push.engine for push in self.waves):
                mine = [p for p in self.waves if (p.engine, p.restitution) == (engine, restitution)]
                speeds = np.array([p.speed for p in mine])
                power = exponent(np.array([p.stiffness for p in mine]), speeds)
                if np.isfinite(power):
                    found.append(Front(ENGINE_NAMES[engine], restitution, mine, power))
        return found

    @cached_property
    def apart(self) -> float | None:
        """By how much of themselves the engines' speeds differ at most; None for one engine."""
        pairs = [(a, b) for a in self.waves for b in self.waves if a.engine < b.engine]
        apart = (
            abs(a.speed / b.speed - 1)
            for a, b in pairs
            if (a.stiffness, a.restitution) == (b.stiffness, b.restitution)
        )
        return max(apart, default=None)

    def long_wave(self, stiffness: float) -> float:
        """Speed (m/s) of long waves in springs of that stiffness (N/m)."""
        scene = self.scene.with_contact(stiffness_N_per_m=stiffness)
        return long_wave_speed(scene, self.found.contacts)


def soft_flux(push: Push) -> Floats:
    """Sum the impulses along x (m,) N·s that soft contacts passed through each gap."""
    match = push.comparison.match
    return flux(push.comparison.snapshot.position[:, 0], match.contacts, match.penalty)


KINDS: Sequence[tuple[str, str, Any]] = (
    ("non-local", BLUE, "-"),
    ("local (a pushing disk takes part)", BLACK, (0, (2, 1))),
)
RESTING, PUSHING = PALER_BLUE, PALE_ORANGE
DIFFERENCE = "rms(∫f dt − p) / rms(∫f dt) (–)"


def draw_network(corridor: Corridor) -> Figure:
    """Draw who pushes above; percussions, width ∝ |p|, local dashed; right velocities below."""
    figure, (before, middle, after) = panels(8.5, 8.6, 3, 1, sharex=True)
    snapshot, answer, size = corridor.scene.snapshot, corridor.found.answer, corridor.size
    for axes in (before, middle, after):
        _draw_corridor(axes, corridor)
    after.set_xlabel("x (m)")
    before.set_title("left velocities", fontsize=10)
    _arrows(before, snapshot.position, snapshot.velocity, 0.2)
    lines = contact_lines(snapshot, corridor.found.contacts)
    for chosen, (_, colour, style) in zip((~corridor.local, corridor.local), KINDS, strict=True):
        shown = corridor.carries & chosen
        drawn: dict[str, Any] = {"colors": colour, "linestyles": [style], "capstyle": "butt"}
        drawn["linewidths"] = list(7 * size[shown] / size.max())
        middle.add_collection(LineCollection(list(lines[shown]), **drawn))
    handles = [middle.plot([], [], color=c, ls=s, lw=3, label=words)[0] for words, c, s in KINDS]
    middle.set_title(f"percussions; the widest is {size.max():.0f} N·s", fontsize=10)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8)
    after.set_title("right velocities (arrows four times as long as above)", fontsize=10)
    _arrows(after, snapshot.position, answer.right_velocity, 0.8)
    return figure


def draw_finals(finals: Sequence[Final], scene: Scene) -> Figure:
    """Draw where everybody is at the end, a panel for each model; outlines: where they began."""
    figure, every = panels(8.5, 2.7 * len(finals), len(finals), sharex=True)
    before = circles(scene.snapshot)
    for axes, one in zip(every, finals, strict=True):
        _draw_people(axes, scene, replace(scene.snapshot, position=one.position), one.resting)
        outline = PatchCollection(before, facecolor="none", edgecolor=BLUE, lw=0.6, ls=":")
        axes.add_collection(outline)
        low, high = one.position[:, 0].min() - 0.6, one.position[:, 0].max() + 0.6
        axes.set(xlim=(low, high), ylim=(-1.25, 1.25), aspect="equal", ylabel="y (m)")
        axes.set_title(one.model, fontsize=10)
    every[-1].set_xlabel("x (m)")
    return figure


def _draw_corridor(axes: Axes, corridor: Corridor) -> None:
    snapshot = corridor.scene.snapshot
    _draw_people(axes, corridor.scene, snapshot, corridor.resting)
    end = snapshot.position[:, 0].max() + 0.6
    axes.set(xlim=(-0.6, end), ylim=(-1.25, 1.25), aspect="equal", ylabel="y (m)")


def _draw_people(axes: Axes, scene: Scene, now: Snapshot, resting: Flags) -> None:
    """Those who rested and those who pushed, and the walls."""
    style: dict[str, Any] = {"edgecolor": DARK_GREY, "linewidth": 0.5}
    for chosen, colour, hatch in ((resting, RESTING, ""), (~resting, PUSHING, "////")):
        disks = PatchCollection(circles(now, chosen), facecolor=colour, hatch=hatch, **style)
        axes.add_collection(disks)
    draw_walls(axes, [(wall.start_m, wall.end_m) for wall in scene.walls])


def _arrows(axes: Axes, position: Floats, velocity: Floats, metres_per_speed: float) -> None:
    moving = np.hypot(*velocity.T) > 1e-6
    shown = metres_per_speed * velocity[moving]
    draw_vectors(axes, position[moving], shown, color=BLACK, width=0.003)


def draw_decay(corridor: Corridor) -> Figure:
    """Draw the momentum along x that goes through each gap between columns (percussions, the closed
    form of columns that move as one, soft contacts), and the largest percussion in it."""
    figure, (left, right) = panels(9.5, 4.0, 1, 2)
    gaps = corridor.gaps
    left.plot(gaps.distance, gaps.flux, MARKERS[0], color=BLACK, label="percussions")
    words = "(5), (6) for whole columns"
    left.plot(gaps.distance, gaps.columns, "-", color=BLACK, lw=1, label=words)
    top = max(gaps.flux.max(), gaps.columns.max())
    for number, push in enumerate(corridor.damped[1::2]):
        values = soft_flux(push)
        top = max(top, values.max())
        style = {"ls": LINES[number + 1], "color": COLOURS[number], "mfc": "none", "ms": 5}
        label = f"LAMMPS, ζ = {push.damping:.2g}"
        left.plot(gaps.distance, values, MARKERS[number + 1], label=label, **style)
    left.set(ylabel="impulse along x (N·s)", ylim=(0, 1.3 * top))
    left.legend(fontsize=8)
    right.plot(gaps.distance, gaps.largest, MARKERS[0], ls="-", color=BLUE)
    right.set_ylabel("largest percussion in the gap (N·s)")
    right.set_ylim(bottom=0)
    for axes in (left, right):
        axes.set_xlabel("distance from the pushing column (m)")
        axes.grid(alpha=0.3)
    return figure


def draw_wave(corridor: Corridor) -> Figure:
    """Draw the first arrival in each column against the distance, and the front's speed against the
    stiffness, with the long-wave speed of the springs."""
    figure, (left, right) = panels(10.0, 4.4, 1, 2)
    stiffnesses = sorted({push.stiffness for push in corridor.waves})
    _arrivals(left, [p for p in corridor.waves if p.engine == corridor.waves[0].engine])
    kinds = sorted({(push.engine, push.restitution) for push in corridor.waves})
    for number, (engine, restitution) in enumerate(kinds):
        chosen = [p for p in corridor.waves if (p.engine, p.restitution) == (engine, restitution)]
        style = {"ms": 10 - 2 * number, "mfc": "none", "color": COLOURS[number]}
        label, marker = f"{ENGINE_NAMES[engine]}, e = {restitution:g}", MARKERS[number]
        x, y = [p.stiffness for p in chosen], [p.speed for p in chosen]
        right.plot(x, y, marker, label=label, **style)
    closed = [corridor.long_wave(stiffness) for stiffness in stiffnesses]
    right.plot(stiffnesses, closed, "-", color=BLACK, lw=1, label="long waves, d √(K/m), ∝ √k")
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
        style = look(number, hollow=kind > 0) | {"ls": LINES[kind], "ms": 4}
        label = f"k = {numbers.number(push.stiffness)} N/m, e = {push.restitution:g}"
        axes.plot(x[later] - x[0], first[later], label=label, **style)
    axes.set(yscale="log", xlabel="distance from the pushing column (m)")
    axes.set_ylabel("first arrival (s)")
    axes.legend(fontsize=7, loc="lower right")
    axes.set_title(f"{ENGINE_NAMES[pushes[0].engine]}; percussions arrive at once", fontsize=10)


def draw_impulses(corridor: Corridor) -> Figure:
    """Draw ∫f dt against p contact by contact for the least and the most damping, and their
    difference against k and ζ."""
    figure, (cloud, by_stiffness, by_damping) = panels(11.0, 3.9, 1, 3)
    _cloud(cloud, (corridor.damped[0], corridor.damped[-1]))
    for number, engine in enumerate(sorted({push.engine for push in corridor.inelastic})):
        mine = [push for push in corridor.inelastic if push.engine == engine]
        style = look(number, hollow=True) | {"ms": 9 - 4 * number}
        label = f"{ENGINE_NAMES[engine]}, e = {mine[0].restitution:g}"
        x, y = [push.stiffness for push in mine], [push.difference for push in mine]
        by_stiffness.plot(x, y, label=label, **style)
    top = max(push.difference for push in corridor.inelastic)
    by_stiffness.set(xscale="log", xlabel="stiffness k (N/m)", ylim=(0, 1.15 * top))
    damped = corridor.damped
    label = f"{ENGINE_NAMES[damped[0].engine]}, k = {numbers.number(damped[0].stiffness)} N/m"
    values = [[push.damping for push in damped], [push.difference for push in damped]]
    by_damping.plot(*values, MARKERS[0], ls="-", color=BLUE, label=label)
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
        face, edge = (BLUE, BLUE) if number else ("none", ORANGE)
        label = f"e = {push.restitution:g} (ζ = {push.damping:.2g})"
        axes.plot(rigid, soft, MARKERS[number], ms=4, mfc=face, mec=edge, label=label)
    axes.plot([0, top], [0, top], "-", color=BLACK, lw=0.8, label="equal")
    axes.set(xlabel="percussion p (N·s)", ylabel="∫f dt (N·s)", aspect="equal")


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the pushes, and the longer runs to the final positions."""
    return push_runs(runs) + final_runs(runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 2: the network of percussions, how far the push goes, and the wave that soft
    contacts make of it.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning."""
    corridor = Corridor.of(runs, progress)
    words = Words(__name__, corridor=corridor, gaps=corridor.gaps, names=ENGINE_NAMES)
    pictures = [
        words.picture("fig_2_network", draw_network(corridor)),
        words.picture("fig_2_final", draw_finals(corridor.finals, corridor.scene)),
        words.picture("fig_2_decay", draw_decay(corridor)),
    ]
    if corridor.waves:
        pictures.append(words.picture("fig_2_wave", draw_wave(corridor)))
    if corridor.inelastic and corridor.damped:
        pictures.append(words.picture("fig_2_impulses", draw_impulses(corridor)))
    return words.section(
        "2",
        pictures=pictures,
        tables=_tables(words, corridor),
        claims=_claims(words, corridor),
        warnings=corridor.warnings,
    )


def _claims(words: Words, corridor: Corridor) -> list[Claim]:
    to_the_end = corridor.reach >= corridor.distance.max() - 1e-9
    rigid = corridor.finals[0]
    displaced = Verdict.of(rigid.moved == len(rigid.displaced), rigid.moved > 0)
    claims = [
        words.claim("non_local", Verdict.of(corridor.far > 0 and to_the_end)),
        words.claim("displacement", displaced),
    ]
    powers = [front.power for front in corridor.fronts]
    if powers:
        # the interaction at a distance is there without a wave: what is right of it is the wave
        wave_grows = min(powers) > 0.1
        verdict = Verdict.PARTLY if wave_grows else Verdict.HOLDS
        claims.append(words.claim("shock_wave", verdict, powers=powers))
    return claims


def _tables(words: Words, corridor: Corridor) -> list[Table]:
    gaps = corridor.gaps
    columns = (gaps.distance, gaps.flux, gaps.gained, gaps.columns, gaps.largest)
    speeds: list[list[Cell]] = []
    for one in corridor.waves:
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
    return [
        words.table("table_gaps", [[float(v) for v in row] for row in zip(*columns, strict=True)]),
        words.table("table_front", speeds),
        words.table("table_impulses", shares),
        words.table("table_final", finals),
    ]


def _between_engines(one: Push, pushes: list[Push]) -> Cell:
    for other in pushes:
        same = (other.stiffness, other.restitution) == (one.stiffness, one.restitution)
        if same and other.engine != one.engine:
            return penalty_difference(one.comparison, other.comparison)
    return "–"
