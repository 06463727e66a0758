"""Fig. 2: a push in a corridor, by percussions, which act at a distance at once, and by soft contacts."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure

from analysis.compare import comparison
from analysis.dumps import open_bodies
from analysis.engines.run import EngineRun
from analysis.pages import drawing, numbers
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    COLOURS,
    LINES,
    MARKERS,
    ORANGE,
    label,
    line_style,
    panels,
)
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.percussions.snapshot import SnapshotPercussions, percussions_of
from analysis.scene.scene import Scene, read_scene
from analysis.studies.paper.discrete.engine_runs import each, end_of
from analysis.studies.paper.discrete.line_of_disks import impact_time
from analysis.studies.paper.solutions import grouped, unsolved
from analysis.support.parallel import Progress
from nscd import ContactLaw, Contacts, Percussions, Snapshot, find_contacts
from nscd.arrays import Floats, Mask
from nscd.show import contact_lines
from nscd.stepping import Motion

# Disks whose x differ by less stand in one column.
SAME_M = 1e-6
# A disk is reached once it is this share of the push as fast.
REACHED = 0.01
# Columns before this one (counted from the pushing one) still feel how the push began.
FRONT_FROM = 5
# s: the push has gone through the corridor several times
TIME_S = 1.0
STEP_S = 1e-3
STIFFNESS, RESTITUTION = 1e6, 0.01  # N/m and –, of the soft disks
# Who is displaced less has not moved.
MOVED_M = 1e-3
INELASTIC, ELASTIC = 0.05, 1.0
# With e = 1 the push overlaps disks by two thirds of a radius at 1e4 N/m, which is no model of a
# body any more.
STIFFNESSES = (1e5, 1e6, 1e8)  # N/m
# Restitutions of damping ratios 1, 2, 5 and 10, at one stiffness: the inelastic limit. So many
# frames that the impulses close the balance of momentum to a few per cent.
FRAMES = {0.1353: 300, INELASTIC: 300, 0.01: 1000, 0.0024: 2000}
DAMPED_STIFFNESS = 1e6  # N/m
# A percussion below this share of the largest is none.
CARRIES = 1e-6


def at_rest(scene: Scene) -> Mask:
    """Tell who is at rest before the push, (n,)."""
    return np.asarray(np.hypot(*scene.snapshot.velocity.T) == 0)


def local_contacts(scene: Scene, contacts: Contacts) -> Mask:
    """Tell in which contacts (k,) a pushing disk takes part."""
    pushing = ~at_rest(scene)
    second = np.where(contacts.is_wall, contacts.first, contacts.second)
    return np.asarray(pushing[contacts.first] | pushing[second])


class Columns:
    """The c columns in which n disks stand along x, and the c − 1 gaps between them.

    place: (c,) m, rising; within: (n,c), who stands in which; middle: (c−1,) m, of the gaps"""

    def __init__(self, snapshot: Snapshot) -> None:
        self.x = snapshot.position[:, 0]
        self.place = np.unique(np.round(self.x, 6))
        self.within = np.abs(self.x[:, None] - self.place) < SAME_M
        self.middle = 0.5 * (self.place[1:] + self.place[:-1])

    def crossed(self, pairs: Contacts) -> Mask:
        """Tell which gap each contact of two disks crosses, (k,c−1)."""
        low, high = np.sort([self.x[pairs.first], self.x[pairs.second]], axis=0)
        return np.asarray((low[:, None] < self.middle) & (high[:, None] > self.middle))

    def flux(self, contacts: Contacts, impulse: Floats) -> Floats:
        """Sum the impulses (k,2) N·s of contacts along x through each gap, (c−1,) N·s."""
        chosen = ~contacts.is_wall
        pairs = contacts.select(chosen)
        along = impulse[chosen, 0] * np.sign(self.x[pairs.second] - self.x[pairs.first])
        return np.asarray(along @ self.crossed(pairs))

    def first(self, arrival: Floats) -> Floats:
        """Find the earliest arrival (n,) s in each column, (c,) s, NaN where it was not reached."""
        first = np.where(self.within, arrival[:, None], np.inf).min(0)
        return np.where(np.isfinite(first), first, np.nan)


class Gaps(NamedTuple):
    """The m gaps between neighbouring columns."""

    distance: Floats  # (m,) m from the first column
    flux: Floats  # (m,) N·s, the momentum along x that percussions pass through
    gained: Floats  # (m,) N·s, what the disks beyond gain of it
    columns: Floats  # (m,) N·s, the flux that (5), (6) give for columns that move as one
    largest: Floats  # (m,) N·s, the largest percussion


def gaps_of(scene: Scene, contacts: Contacts, solution: Percussions) -> Gaps:
    """Follow the push from column to column."""
    snapshot, columns = scene.snapshot, Columns(scene.snapshot)
    left = snapshot.velocity[:, 0]
    change = snapshot.mass * (solution.right_velocity[:, 0] - left)
    mass, momentum = (some @ columns.within for some in (snapshot.mass, snapshot.mass * left))
    pairs = ~contacts.is_wall
    size = np.hypot(*solution.impulse[pairs].T)
    return Gaps(
        distance=columns.middle - columns.place[0],
        flux=columns.flux(contacts, solution.impulse),
        gained=np.array([change[columns.x > middle].sum() for middle in columns.middle]),
        columns=np.cumsum(momentum - mass * momentum.sum() / mass.sum())[:-1],
        largest=(size[:, None] * columns.crossed(contacts.select(pairs))).max(0),
    )


def long_wave_speed(scene: Scene, contacts: Contacts) -> float:
    """Compute c = d √(K/m̄) (m/s) of long waves along columns, a chain of rigid columns on springs.

    d: the spacing of the columns; K = k Σ nₓ² over the contacts between two neighbours; m̄: the mean
    mass of a column (inner columns)."""
    columns, pairs = Columns(scene.snapshot), contacts.select(~contacts.is_wall)
    springs = (pairs.normal[:, 0] ** 2) @ columns.crossed(pairs)
    stiffness = scene.contact.stiffness_N_per_m * springs.mean()
    masses = scene.snapshot.mass @ columns.within
    # two neighbours share each kind of column, so that the mean is taken over whole pairs
    mass = masses[: 2 * (len(masses) // 2)].mean()
    return float(np.diff(columns.place).mean() * np.sqrt(stiffness / mass))


def front_speed(x: Floats, first: Floats) -> float:
    """Take the slope (m/s) of distance (m) against the first arrival (s) in each column; NaN for
    fewer than 3."""
    finite = np.isfinite(first)
    finite[:FRONT_FROM] = False
    return float(1 / np.polyfit(x[finite], first[finite], 1)[0]) if finite.sum() >= 3 else np.nan


def push_scene(
    scene: Scene, stiffness: float, restitution: float, periods: float, frames: int
) -> Scene:
    """Make the scene with another stiffness (N/m) and restitution, run for `periods` times
    √(m/k)."""
    variant = scene.model_copy(update={"name": f"{scene.name}_e{restitution:g}"})
    variant = variant.with_contact(stiffness_N_per_m=stiffness, restitution=restitution)
    seconds = periods * impact_time(variant)
    return variant.with_run(duration_s=seconds, frames=frames, time_step_s=None)


class Push:
    """One engine's run of a push: its contacts' k (N/m), e and damping ratio ζ, and what it shows.

    comparison, numbers: its impulses against the percussions
    difference: rms(∫f dt − p) / rms(∫f dt)
    first: (c,) s, the earliest arrival in each column
    speed, long_waves: m/s, of the front, and of long waves in the same springs

    Raises EngineError for an engine that is missing or fails."""

    def __init__(self, run: EngineRun, progress: Progress | None = None) -> None:
        scene, record = run.scene, run.record(progress)
        self.engine, self.stiffness = run.engine, scene.contact.stiffness_N_per_m
        self.restitution, self.damping = scene.contact.restitution, record.damping_ratio
        trajectory = open_bodies(run.folder / "bodies.dump", record.time_step_s).trajectory
        frames = [(f.time, np.hypot(f.data["vx"], f.data["vy"])) for f in trajectory]
        times, speeds = map(np.array, zip(*frames, strict=True))
        pushing = float(np.hypot(*scene.snapshot.velocity.T).max())
        columns = Columns(scene.snapshot)
        self.first = columns.first(comparison.first_above(times, speeds, REACHED * pushing))
        self.speed = front_speed(columns.place, self.first)
        tolerance = scene.analysis.contact_tolerance_m
        contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=tolerance)
        self.long_waves = long_wave_speed(scene, contacts)
        # the paper's percussions are inelastic, whatever the soft contacts are
        self.comparison = comparison.compare_run(run.folder, law=ContactLaw())
        self.numbers = comparison.statistics(self.comparison)
        self.difference = self.numbers["contact_relative_difference"]


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


def push_runs(runs: Path) -> list[EngineRun]:
    """List the push as soft contacts: elastic and inelastic at each stiffness by both engines, and
    with more damping."""
    both = INELASTIC, ELASTIC
    cases = [(e, k, r) for e in ("lammps", "yade") for r in both for k in STIFFNESSES]
    cases += [("lammps", DAMPED_STIFFNESS, r) for r in FRAMES if r != INELASTIC]
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


class Rigid:
    """The percussions of the push, k contacts: who carries it, and how far it goes.

    local: (k,), whether a pushing disk takes part; size: (k,) N·s, |p|; carries: (k,), whether
    there is any; distance: (n,) m from the first disk; moved: (n,), who is at rest before and moves
    after"""

    def __init__(self, scene: Scene, found: SnapshotPercussions) -> None:
        self.scene, self.found = scene, found
        self.local = local_contacts(scene, found.contacts)
        self.size = np.hypot(*found.solution.impulse.T)
        self.carries = self.size > CARRIES * self.size.max()
        self.gaps = gaps_of(scene, found.contacts, found.solution)
        self.resting, x = at_rest(scene), scene.snapshot.position[:, 0]
        self.pushing = int((~self.resting).sum())
        self.near = int((self.carries & self.local).sum())
        self.far = int((self.carries & ~self.local).sum())
        self.far_share = float(self.size[~self.local].sum() / self.size.sum())
        self.distance = x - x.min()
        self.reach = float(self.distance[found.contacts.first[self.carries]].max())
        self.moved = self.resting & (np.hypot(*found.solution.right_velocity.T) > 1e-6)


def damped(pushes: Sequence[Push]) -> list[Push]:
    """Choose the pushes at one stiffness, with rising damping."""
    chosen = [p for p in pushes if (p.engine, p.stiffness) == ("lammps", DAMPED_STIFFNESS)]
    return sorted((p for p in chosen if p.restitution < ELASTIC), key=lambda p: -p.restitution)


def waves(pushes: Sequence[Push]) -> dict[tuple[str, float], list[Push]]:
    """Choose the pushes at rising stiffness, by engine and restitution."""
    chosen = [push for push in pushes if push.restitution in (INELASTIC, ELASTIC)]
    return grouped(chosen, attrgetter("engine", "restitution"))


def front_powers(pushes: Sequence[Push]) -> list[float]:
    """Find the a of speed ∝ kᵃ of the front of soft contacts, by engine and restitution."""
    lines = (np.array([(p.stiffness, p.speed) for p in of]).T for of in waves(pushes).values())
    powers = [comparison.exponent(*line) for line in lines]
    return [power for power in powers if np.isfinite(power)]


KINDS: Sequence[tuple[str, str, Any]] = (
    ("non-local", BLUE, "-"),
    ("local (a pushing disk takes part)", BLACK, (0, (2, 1))),
)
RESTING, PUSHING = drawing.PALER_BLUE, drawing.PALE_ORANGE
DISTANCE, OVER_K = "distance from the pushing column (m)", "stiffness k (N/m)"
DIFFERENCE = "rms(∫f dt − p) / rms(∫f dt) (–)"


def draw_network(rigid: Rigid) -> Figure:
    """Draw who pushes above; percussions, width ∝ |p|, local dashed; right velocities below."""
    figure, (before, middle, after) = panels(8.5, 8.6, 3, 1, sharex=True)
    snapshot, size = rigid.scene.snapshot, rigid.size
    for axes in (before, middle, after):
        _draw_people(axes, rigid.scene, snapshot)
        axes.set_xlim(-0.6, snapshot.position[:, 0].max() + 0.6)
    label(before, title="left velocities")
    _arrows(before, snapshot.position, snapshot.velocity, 0.2)
    lines = contact_lines(snapshot, rigid.found.contacts)
    for chosen, (words, colour, style) in zip((~rigid.local, rigid.local), KINDS, strict=True):
        shown = rigid.carries & chosen
        drawn: dict[str, Any] = {"colors": colour, "linestyles": [style], "capstyle": "butt"}
        drawn["linewidths"] = list(7 * size[shown] / size.max())
        middle.add_collection(LineCollection(list(lines[shown]), **drawn))
        middle.plot([], [], color=colour, ls=style, lw=3, label=words)
    label(middle, title=f"percussions, the widest is {size.max():.0f} N·s")
    drawing.legend_below(figure, middle, 3)
    label(after, "x (m)", title="right velocities (arrows four times as long as above)")
    _arrows(after, snapshot.position, rigid.found.solution.right_velocity, 0.8)
    return figure


def draw_finals(finals: Sequence[Final], scene: Scene) -> Figure:
    """Draw where everybody is at the end, a panel for each model; outlines: where they began."""
    figure, every = panels(8.5, 2.7 * len(finals), len(finals), sharex=True)
    before = drawing.circles(scene.snapshot)
    for axes, one in zip(every, finals, strict=True):
        _draw_people(axes, scene, replace(scene.snapshot, position=one.position))
        outline = PatchCollection(before, facecolor="none", edgecolor=BLUE, lw=0.6, ls=":")
        axes.add_collection(outline)
        x = one.position[:, 0]
        label(axes, title=one.model, xlim=(x.min() - 0.6, x.max() + 0.6))
    label(every[-1], "x (m)")
    return figure


def _draw_people(axes: Axes, scene: Scene, now: Snapshot) -> None:
    """Those who rested and those who pushed, and the walls."""
    style: dict[str, Any] = {"edgecolor": drawing.DARK_GREY, "linewidth": 0.5}
    resting = at_rest(scene)
    for chosen, colour, hatch in ((resting, RESTING, ""), (~resting, PUSHING, "////")):
        disks = drawing.circles(now, chosen)
        axes.add_collection(PatchCollection(disks, facecolor=colour, hatch=hatch, **style))
    drawing.draw_walls(axes, [(wall.start_m, wall.end_m) for wall in scene.walls])
    axes.set(ylim=(-1.25, 1.25), aspect="equal", ylabel="y (m)")


def _arrows(axes: Axes, position: Floats, velocity: Floats, metres_per_speed: float) -> None:
    moving = np.hypot(*velocity.T) > 1e-6
    shown = metres_per_speed * velocity[moving]
    drawing.draw_vectors(axes, position[moving], shown, color=BLACK, width=0.003)


def draw_decay(gaps: Gaps, pushes: Sequence[Push]) -> Figure:
    """Draw the momentum along x that goes through each gap between columns (percussions, the closed
    form of columns that move as one, soft contacts), and the largest percussion in it."""
    figure, (left, right) = panels(9.5, 4.0, 1, 2, grid="major")
    left.plot(gaps.distance, gaps.flux, MARKERS[0], color=BLACK, label="percussions")
    words = "(5), (6) for whole columns"
    left.plot(gaps.distance, gaps.columns, "-", color=BLACK, lw=1, label=words)
    top = max(gaps.flux.max(), gaps.columns.max())
    for number, push in enumerate(damped(pushes)[1::2]):
        snapshot, match = push.comparison.snapshot, push.comparison.match
        values = Columns(snapshot).flux(match.contacts, match.penalty)
        top = max(top, values.max())
        style = line_style(number + 1, hollow=True) | {"color": COLOURS[number], "ms": 5}
        left.plot(gaps.distance, values, label=f"LAMMPS, ζ = {push.damping:.2g}", **style)
    label(left, DISTANCE, "impulse along x (N·s)", legend="best", ylim=(0, 1.3 * top))
    right.plot(gaps.distance, gaps.largest, MARKERS[0], ls="-", color=BLUE)
    label(right, DISTANCE, "largest percussion in the gap (N·s)", ylim=(0, None))
    return figure


def draw_wave(pushes: Sequence[Push], position: Floats) -> Figure:
    """Draw the first arrival in each column, at its place (c,) m, against the distance, and the
    front's speed against the stiffness, with the long-wave speed of the springs."""
    figure, (left, right) = panels(10.0, 4.4, 1, 2, grid="both")
    kinds = waves(pushes)
    engine, _ = next(iter(kinds))
    _arrivals(left, [p for (name, _), of in kinds.items() for p in of if name == engine], position)
    for number, ((name, restitution), chosen) in enumerate(kinds.items()):
        style: dict[str, Any] = {"ms": 10 - 2 * number, "mfc": "none", "color": COLOURS[number]}
        style["label"] = f"{ENGINE_NAMES[name]}, e = {restitution:g}"
        x, y = [p.stiffness for p in chosen], [p.speed for p in chosen]
        right.plot(x, y, MARKERS[number], **style)
    closed = sorted({(p.stiffness, p.long_waves) for of in kinds.values() for p in of})
    right.plot(*np.transpose(closed), "-", color=BLACK, lw=1, label="long waves, d √(K/m), ∝ √k")
    label(right, OVER_K, "speed of the front (m/s)", log="xy", legend="best")
    return figure


def _arrivals(axes: Axes, pushes: Sequence[Push], position: Floats) -> None:
    stiffnesses = sorted({push.stiffness for push in pushes})
    restitutions = sorted({push.restitution for push in pushes})
    for push in pushes:
        number, kind = stiffnesses.index(push.stiffness), restitutions.index(push.restitution)
        later = push.first > 0
        style = line_style(number, hollow=kind > 0) | {"ls": LINES[kind], "ms": 4}
        words = f"k = {numbers.number(push.stiffness)} N/m, e = {push.restitution:g}"
        axes.plot(position[later] - position[0], push.first[later], label=words, **style)
    title = f"{ENGINE_NAMES[pushes[0].engine]}, percussions arrive at once"
    label(axes, DISTANCE, "first arrival (s)", title, log="y", legend="lower right", size=7)


def draw_impulses(inelastic: Sequence[Push], rising: Sequence[Push]) -> Figure:
    """Draw ∫f dt against p contact by contact for the least and the most damping, and their
    difference against k and ζ; rising: at one stiffness with rising damping."""
    figure, (cloud, by_stiffness, by_damping) = panels(11.0, 3.9, 1, 3, grid="both")
    _cloud(cloud, (rising[0], rising[-1]))
    for number, (engine, mine) in enumerate(grouped(inelastic, attrgetter("engine")).items()):
        style = line_style(number, hollow=True) | {"ms": 9 - 4 * number}
        words = f"{ENGINE_NAMES[engine]}, e = {mine[0].restitution:g}"
        x, y = [push.stiffness for push in mine], [push.difference for push in mine]
        by_stiffness.plot(x, y, label=words, **style)
    legend: dict[str, Any] = {"legend": "best", "size": 7}
    top = max(push.difference for push in inelastic)
    label(by_stiffness, OVER_K, DIFFERENCE, log="x", ylim=(0, 1.15 * top), **legend)
    words = f"{ENGINE_NAMES[rising[0].engine]}, k = {numbers.number(rising[0].stiffness)} N/m"
    values = [[push.damping for push in rising], [push.difference for push in rising]]
    by_damping.plot(*values, MARKERS[0], ls="-", color=BLUE, label=words)
    label(by_damping, "damping ratio ζ (–)", DIFFERENCE, log="xy", **legend)
    return figure


def _cloud(axes: Axes, pushes: Sequence[Push]) -> None:
    top = 0.0
    for number, push in enumerate(pushes):
        soft, rigid = push.comparison.match.normal_parts()
        top = max(top, float(rigid.max()), float(soft.max()))
        face, edge = (BLUE, BLUE) if number else ("none", ORANGE)
        words = f"e = {push.restitution:g} (ζ = {push.damping:.2g})"
        axes.plot(rigid, soft, MARKERS[number], ms=4, mfc=face, mec=edge, label=words)
    axes.plot([0, top], [0, top], "-", color=BLACK, lw=0.8, label="equal")
    label(axes, "percussion p (N·s)", "∫f dt (N·s)", legend="best", size=7, aspect="equal")


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the pushes, and the longer runs to the final positions."""
    return push_runs(runs) + final_runs(runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 2: the network of percussions, how far the push goes, and the wave that soft
    contacts make of it.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning."""

    def soft_final(run: EngineRun) -> Final:
        return final_of(ENGINE_NAMES[run.engine], run.scene, end_of(run, progress).position)

    scene = read_scene("corridor")
    found = percussions_of(scene, scene.snapshot, tolerance=1e-10)
    warnings, rigid = unsolved([("percussions", found.solution)]), Rigid(scene, found)
    pushes = each(push_runs(runs), partial(Push, progress=progress), warnings)
    finals = [rigid_final(scene), *each(final_runs(runs), soft_final, warnings)]
    words = Words(__name__, corridor=rigid, finals=finals)
    pictures = {
        "fig_2_network": draw_network(rigid),
        "fig_2_final": draw_finals(finals, scene),
        "fig_2_decay": draw_decay(rigid.gaps, pushes),
    }
    inelastic, rising = [p for p in pushes if p.restitution == INELASTIC], damped(pushes)
    if waves(pushes):
        pictures["fig_2_wave"] = draw_wave(pushes, Columns(scene.snapshot).place)
    if inelastic and rising:
        pictures["fig_2_impulses"] = draw_impulses(inelastic, rising)
    to_the_end, final = rigid.reach >= rigid.distance.max() - 1e-9, finals[0]
    claims = [
        words.claim("non_local", Verdict.of(rigid.far > 0 and to_the_end)),
        words.claim(
            "displacement", Verdict.of(final.moved == len(final.displaced), final.moved > 0)
        ),
    ]
    if powers := front_powers(pushes):
        # the interaction at a distance is there without a wave: what is right of it is the wave
        verdict = Verdict.PARTLY if min(powers) > 0.1 else Verdict.HOLDS
        claims.append(words.claim("shock_wave", verdict, powers=powers))
    tables: dict[str, list[list[Cell]]] = {
        "table_gaps": np.column_stack(rigid.gaps).tolist(),
        "table_front": [_front(push) for of in waves(pushes).values() for push in of],
        "table_impulses": [_impulse_fraction(p, pushes) for p in pushes if p.restitution != ELASTIC],
        "table_final": [_final(model, finals[0]) for model in finals],
    }
    return words.section("2", pictures=pictures, tables=tables, claims=claims, warnings=warnings)


def _front(push: Push) -> list[Cell]:
    law = ENGINE_NAMES[push.engine], push.restitution, push.stiffness
    speeds = push.speed, push.long_waves, push.speed / push.long_waves - 1
    return [*law, float(push.first[-1]), *speeds]


def _impulse_fraction(push: Push, pushes: Sequence[Push]) -> list[Cell]:
    law = ENGINE_NAMES[push.engine], push.restitution, push.damping, push.stiffness
    alike = (push.numbers[f"contact{name}"] for name in ("_correlation", "s_only_penalty"))
    same = [p for p in pushes if (p.stiffness, p.restitution) == (push.stiffness, push.restitution)]
    others = [p.comparison for p in same if p.engine != push.engine]
    other = comparison.penalty_difference(push.comparison, others[0]) if others else numbers.NONE
    return [*law, push.difference, *alike, push.comparison.balance.closure_error, other]


def _final(model: Final, first: Final) -> list[Cell]:
    moved = [float(f(model.displaced)) for f in (np.mean, np.median, np.max)]
    away = ((model.position - first.position) ** 2).sum(1).mean()
    return [model.model, model.moved, *moved, float(np.sqrt(away))]
