"""Fig. 8: contact forces of the crowd turbulence (15)–(19) and of the collision (11): every reading
of the "error of the order of 10⁻²", errors against k_v, and how the rival depends on δt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache, cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from skfem import MeshTri1

from analysis.pages import drawing
from analysis.pages.fields import draw_map, rounded
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.studies.paper.continuum.exit_room import BODY, EXIT, MESH, SIDE, map_of, mean_over
from analysis.studies.paper.solutions import unsolved, with_progress
from analysis.support.parallel import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import collide
from nscd.continuum.left_velocity import Field, random_speeds, toward_exit
from nscd.continuum.medium import DENSITY, PERSON, TABLE_1, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import BodyFields, body_fields, percussion_density, pressure
from nscd.continuum.rivals import turbulence
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.density_laws import TurbulencePressure
from nscd.continuum.room import Room, square_room
from nscd.continuum.space import Space

CHECKED = (4.0, 9.0, 25.0, 100.0)  # k_v ≥ 4, of which the paper speaks
FINER = 9.0  # the k_v that is tried on half the mesh too
LARGEST_OF_ORDER = 10**-1.5  # 10⁻² to the nearest power of ten
SETTLED = 0.2  # an error that changes by more on a mesh of half the side is the mesh's
DEPENDS = 1.1  # forces that differ by this factor depend on δt
PRESSURE, LARGEST = "‖p − δt p_t‖ / ‖δt p_t‖", "largest pressure over a body"
MEAN, RAW = "mean difference of |F|", "largest pressure in any triangle"
CELL = f"{MEAN} over the largest |F_t| in any triangle"
VOLUMES = (1.0, 2.0, 4.0, 9.0, 16.0, 25.0, 50.0, 100.0, 200.0)  # k_v
CURVE_STEPS = (0.001, 0.01, 0.1)  # s
STEPS = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3)  # s


class Case(StrEnum):
    """The left velocities of Fig. 8: (a) random, 1.7 ± 0.5 m/s; (b) 1.23 m/s; toward the exit."""

    RANDOM = "a"
    UNIFORM = "b"


NAMES = {Case.RANDOM: "(a) random, 1.7 ± 0.5 m/s", Case.UNIFORM: "(b) uniform, 1.23 m/s"}


class Pressing(StrEnum):
    """Where the pressure of the crowd turbulence comes from.

    (16) with Table 1, with a c₂ that makes it continuous, with p = 0 on the exit; or congestion
    above the yield density."""

    LAW = "(16)"
    CONTINUOUS = "(16), c₂ = 32.91"
    OPEN = "(16), 0 on the exit"
    CONGESTION = "congestion"


class Wall(StrEnum):
    """Where k_s acts: where the crowd presses the wall, everywhere as printed, nowhere; or as a
    fixed share of k_v."""

    PRESSED = "pressed"
    EVERYWHERE = "everywhere"
    NOWHERE = "nowhere"
    SHARE = "k_s = k_v/9"


@dataclass(frozen=True, slots=True, kw_only=True)
class StepSetting:
    """What is computed for Fig. 8.

    side, mesh: m, of the room and of the triangles.
    friction, pressing: β of the crowd turbulence and the source of its pressure.
    mixed_units: whether k_v and k_s count kilograms where ρ counts people in kilograms."""

    side: float = SIDE
    mesh: float = MESH
    order: int = 1  # of the elements
    seed: int = 1  # of the random speeds
    time_step: float = TABLE_1.time_step  # s, δt of the crowd turbulence
    friction: float = TABLE_1.friction
    pressing: Pressing = Pressing.LAW
    wall: Wall = Wall.PRESSED  # where k_s acts
    mixed_units: bool = False
    person: float = PERSON  # kg


def left_velocity(case: Case, room: Room, seed: int) -> Field:
    """Make u⁻ of a case; the random speeds are drawn for each person's place."""
    if case is Case.UNIFORM:
        return toward_exit(room, 1.23)
    direction = toward_exit(room, 1.0)
    return random_speeds(room, direction, mean=1.7, deviation=0.5, seed=seed, cell=DENSITY**-0.5)


@cache
def _mesh(side: float, size: float) -> tuple[Room, MeshTri1]:
    room = square_room(side, EXIT)
    return room, mesh_of(room, size)


@cache
def _space(side: float, size: float, order: int) -> Space:
    return Space(_mesh(side, size)[1], order)


@cache
def _step(case: Case, setting: StepSetting) -> turbulence.TurbulenceStep:
    room, mesh = _mesh(setting.side, setting.mesh)
    law = TurbulencePressure()
    at_rest = np.where(Cells(mesh).open, 0.0, setting.person * law.pressure(DENSITY))
    inputs = (law, law.continuous(), at_rest, turbulence.Congestion())
    pressures = dict(zip(Pressing, inputs, strict=True))
    person, friction = setting.person, setting.friction
    pressing: Any = pressures[setting.pressing]
    model = turbulence.TurbulenceLaw(pressure=pressing, friction=friction, mass_per_person=person)
    left = left_velocity(case, room, setting.seed)
    return turbulence.turbulence_step(mesh, DENSITY, left, model, time_step=setting.time_step)


@cache
def _on_bodies(case: Case, alone: StepSetting) -> Floats:
    """|F_t| (n,) N·s/m² of the mean over a body at the room's map."""
    room, mesh = _mesh(alone.side, alone.mesh)
    middle = np.ascontiguousarray(mesh.p[:, mesh.t].mean(1).T)
    density, area = _step(case, alone).percussion_density, Cells(mesh).measure
    return np.asarray(np.hypot(*mean_over(BODY, middle, area, density, map_of(room).points).T))


class Difference(NamedTuple):
    """A difference (m,) from what the rival has (m,), over areas (m,) m², as one number."""

    size: Floats
    theirs: Floats
    area: Floats

    def in_l2(self) -> float:
        """‖difference‖/‖theirs‖ in L²."""
        return float(np.sqrt(self.area @ self.size**2 / (self.area @ self.theirs**2)))

    def over_mean(self) -> float:
        """Mean of |difference| over the mean of theirs."""
        return float(self.area @ np.abs(self.size) / (self.area @ self.theirs))

    def over_largest(self) -> float:
        """Mean of |difference| over the largest of theirs."""
        return float(self.area @ np.abs(self.size) / self.area.sum() / self.theirs.max())


class Pair:
    """(11) with k_v beside the crowd turbulence, which knows nothing of (11), and their difference.

    map: where body means are taken
    theirs_on_bodies: (n,) N·s/m², the modulus of the rival's mean there
    their_pressure: N·s/m, δt p_t from (16)"""

    def __init__(self, case: Case, setting: StepSetting, volume: float) -> None:
        self.room, k_s = _mesh(setting.side, setting.mesh)[0], TABLE_1.surface_dissipation
        surface = {Wall.NOWHERE: 0.0, Wall.SHARE: volume * k_s / TABLE_1.volume_dissipation}
        k_s = surface.get(setting.wall, k_s)
        crowd = table_1_medium(volume=volume, surface=k_s, person=setting.person)
        if setting.mixed_units:
            crowd = replace(crowd, density=DENSITY * setting.person, mass_per_person=None)
        left = left_velocity(case, self.room, setting.seed)
        space = _space(setting.side, setting.mesh, setting.order)
        everywhere = setting.wall is Wall.EVERYWHERE
        self.solution = collide(space, crowd, left, surface_everywhere=everywhere)
        alone = replace(setting, wall=Wall.PRESSED, order=1, mixed_units=False)
        self.turbulence, self.theirs_on_bodies = _step(case, alone), _on_bodies(case, alone)
        self.map = map_of(self.room)
        p = setting.person * float(TurbulencePressure().pressure(DENSITY))
        self.their_pressure = setting.time_step * p
        where = f"case {case}, {setting}"
        rival, own = f"crowd turbulence, {where}", f"(11), k_v = {volume:g}, {where}"
        self.warnings = unsolved([(rival, self.turbulence), (own, self.solution)])

    @cached_property
    def fields(self) -> BodyFields:
        """Means over a body at the points of the map."""
        return body_fields(self.solution, BODY, self.map.points)

    @property
    def on_bodies(self) -> Floats:
        """(n,) N·s/m², the modulus of the mean over a body."""
        return np.asarray(np.hypot(*self.fields.percussion_density.T))

    def cells(self, *, vectors: bool = False) -> Difference:
        """|F| − |F_t|, or |F − F_t|, in the cells."""
        weight = self.solution.space.basis.dx
        ours = ((percussion_density(self.solution) * weight).sum(2) / weight.sum(1)).T
        rival = self.turbulence.percussion_density
        theirs = np.hypot(*rival.T)
        size = np.hypot(*(ours - rival).T) if vectors else np.hypot(*ours.T) - theirs
        return Difference(size, theirs, Cells(self.solution.space.mesh).measure)

    def bodies(self) -> Difference:
        """|F| − |F_t| of the means over a body."""
        theirs = self.theirs_on_bodies
        return Difference(self.on_bodies - theirs, theirs, self.map.area)

    def pressures(self) -> Difference:
        """p − δt p_t over a body."""
        p, theirs = self.fields.pressure, self.their_pressure
        return Difference(p - theirs, np.full(len(p), theirs), self.map.area)

    def largest(self, p: Floats) -> float:
        """|max p − δt p_t|/δt p_t of a pressure (N·s/m)."""
        return abs(float(p.max()) / self.their_pressure - 1)


# the plain setting and that on half the mesh serve many readings
pair_of = lru_cache(48)(Pair)


def in_l2(pair: Pair) -> float:
    """‖|F| − |F_t|‖/‖F_t‖ over the cells."""
    return pair.cells().in_l2()


def in_any_triangle(pair: Pair) -> float:
    """The mean difference over the largest |F_t| in any cell, which is the mesh's."""
    return pair.cells().over_largest()


class Reading(NamedTuple):
    """One way to read the error: in words, how it is measured, and the setting."""

    words: str
    measure: Callable[[Pair], float]
    setting: StepSetting


def readings(mesh: float = MESH) -> list[Reading]:
    """List all that are tried, the plain one first; `mesh` is the side of the triangles (m)."""
    plain = StepSetting(mesh=mesh)
    opened, over_bodies = replace(plain, pressing=Pressing.OPEN), "over a body, p_t of (16)"
    measured: list[tuple[str, Callable[[Pair], float], StepSetting]] = [
        ("‖|F| − |F_t|‖ / ‖F_t‖, L² over the room", in_l2, plain),
        ("‖F − F_t‖ / ‖F_t‖, of the vectors", lambda p: p.cells(vectors=True).in_l2(), plain),
        ("the same of |F|, as means over a body", lambda p: p.bodies().in_l2(), plain),
        (f"{MEAN} over the mean of |F_t|", lambda p: p.cells().over_mean(), plain),
        (f"{MEAN} over the largest |F_t| over a body", lambda p: p.bodies().over_largest(), plain),
        (CELL, in_any_triangle, plain),
        (f"{CELL}, half the mesh", in_any_triangle, _halved(plain)),
        (f"{CELL}, p_t = 0 on the exit", in_any_triangle, opened),
        (f"pressure: {PRESSURE} {over_bodies}", lambda p: p.pressures().in_l2(), plain),
        (f"{LARGEST}: |p − δt p_t| / δt p_t", lambda p: p.largest(p.fields.pressure), plain),
        (f"{RAW}: the same", lambda p: p.largest(pressure(p.solution)), plain),
    ]
    varied = [
        ("k_s everywhere, as printed", replace(plain, wall=Wall.EVERYWHERE)),
        ("k_s = 0", replace(plain, wall=Wall.NOWHERE)),
        ("k~s~ grows with k~v~ (k~s~ = k~v~/9)", replace(plain, wall=Wall.SHARE)),
        ("ρ in kg/m², k~v~ and k~s~ as they stand", replace(plain, mixed_units=True)),
        ("people instead of kilograms throughout", replace(plain, person=1.0)),
        ("√3 in (18), as printed", replace(plain, friction=plain.friction * 1.5**0.5)),
        ("c₂ that makes (16) continuous", replace(plain, pressing=Pressing.CONTINUOUS)),
        ("p_t = 0 on the exit", opened),
        ("p_t from congestion instead of (16)", replace(plain, pressing=Pressing.CONGESTION)),
        ("P2 elements for (11)", replace(plain, order=2)),
        ("δt = 0.001 s", replace(plain, time_step=0.001)),
        ("δt = 0.1 s", replace(plain, time_step=0.1)),
        ("room of 5 m", replace(plain, side=5.0, mesh=5.0 / SIDE * mesh)),
        ("room of 18 m", replace(plain, side=18.0, mesh=18.0 / SIDE * mesh)),
        ("another draw of the random speeds", replace(plain, seed=2)),
    ]
    found = [Reading(*one) for one in measured]
    return found + [Reading(f"L² of |F|: {w}", in_l2, setting) for w, setting in varied]


def _halved(setting: StepSetting) -> StepSetting:
    return replace(setting, mesh=0.5 * setting.mesh)


class Errors:
    """Measure errors; warnings: of what was not solved for them."""

    def __init__(self) -> None:
        self.warnings: dict[str, None] = {}

    def of(self, reading: Reading, volumes: Sequence[float], *, half: bool = False) -> Floats:
        """Measure both cases for each k_v, (2, k_v), if asked for on half the mesh."""
        setting = _halved(reading.setting) if half else reading.setting
        pairs = [[pair_of(case, setting, volume) for volume in volumes] for case in Case]
        self.warnings |= dict.fromkeys(line for row in pairs for p in row for line in p.warnings)
        return np.array([[reading.measure(pair) for pair in row] for row in pairs])


class Tried(NamedTuple):
    """A reading tried."""

    reading: Reading
    errors: Floats  # (2, k_v) of cases a and b at CHECKED
    finer: Floats  # (2,) at FINER on half the mesh, or NaN

    @property
    def reached(self) -> bool:
        """Of the order of 10⁻² or less for every k_v and both cases."""
        return bool(self.errors.max() <= LARGEST_OF_ORDER)

    @property
    def settled(self) -> bool:
        """Whether half the mesh leaves the error as it is."""
        coarse = self.errors[:, CHECKED.index(FINER)]
        return bool((np.abs(self.finer / coarse - 1) < SETTLED).all())


def settings_tried(reading: Reading, plain: StepSetting, errors: Errors) -> Tried:
    """Try a reading, on half the mesh too where it is of the plain setting or reaches 10⁻²."""
    found, finer = errors.of(reading, CHECKED), np.full(2, np.nan)
    if reading.setting == plain or found.max() <= LARGEST_OF_ORDER:
        finer = errors.of(reading, [FINER], half=True)[:, 0]
    return Tried(reading, found, finer)


class Curve(NamedTuple):
    """An error against k_v, per person: that of cases a and b in the rows of (2,k)."""

    name: str
    volumes: Sequence[float]
    errors: Floats


def curves(plain: StepSetting, errors: Errors) -> list[Curve]:
    """Measure errors against k_v: in L² for three δt, and over the largest in any triangle on two
    meshes."""
    found = []
    for step in CURVE_STEPS:
        reading = Reading(f"L², δt = {step:g} s", in_l2, replace(plain, time_step=step))
        found.append(Curve(reading.words, VOLUMES, errors.of(reading, VOLUMES)))
    cell = Reading("mean over the largest in any triangle", in_any_triangle, plain)
    for half, volumes in ((False, VOLUMES), (True, VOLUMES[::2])):
        name = f"{cell.words} ({plain.mesh / (1 + half):g} m)"
        found.append(Curve(name, volumes, errors.of(cell, volumes, half=half)))
    return found


def error_curves(curves: Sequence[Curve]) -> Figure:
    """Draw errors against k_v for both cases, with the paper's 10⁻² and its k_v ≥ 4."""
    figure, every = drawing.panels(10.0, 4.8, 1, 2, sharey=True, grid="major")
    colours = (*drawing.COLOURS, drawing.BLACK)
    for row, (axes, case) in enumerate(zip(every, Case, strict=True)):
        for number, curve in enumerate(curves):
            style: dict[str, Any] = {"ls": drawing.LINES[number % len(drawing.LINES)]}
            style |= {"mfc": "none" if number > 2 else None, "color": colours[number]}
            marker, errors = drawing.MARKERS[number], curve.errors[row]
            axes.plot(curve.volumes, errors, marker=marker, label=curve.name, **style)
        band: dict[str, Any] = {"color": drawing.GREY, "alpha": 0.45, "lw": 0}
        axes.axhspan(10**-2.5, LARGEST_OF_ORDER, label="order of 10⁻²", **band)
        axes.axvline(4.0, color=drawing.BLACK, lw=0.8, ls=":")
        anchor = ("data", "axes fraction")
        axes.annotate("$k_v = 4$", (4.2, 0.98), xycoords=anchor, fontsize=8, va="top")
        drawing.label(axes, "volume dissipation $k_v$ (per person)", title=NAMES[case], log="xy")
    drawing.label(every[0], y="difference from the crowd turbulence (–)")
    drawing.legend_below(figure, every[0], 2)
    return figure


def force_maps(pairs: dict[Case, Pair]) -> Figure:
    """Draw |F| of the crowd turbulence, of (11), and their difference, over a body, on one scale
    per row."""
    figure, every = drawing.panels(10.5, 7.0, 2, 3, sharex=True, sharey=True)
    for row, (case, pair) in zip((every[:3], every[3:]), pairs.items(), strict=True):
        theirs, ours = pair.theirs_on_bodies, pair.on_bodies
        top = rounded(float(np.quantile(np.concatenate([theirs, ours]), 0.99)))
        fields = {"crowd turbulence": theirs, "proposed, (11)": ours}
        fields["difference"] = np.abs(ours - theirs)
        for axes, (name, values) in zip(row, fields.items(), strict=True):
            title = f"{NAMES[case][:3]} {name}"
            drawn = draw_map(axes, pair.room, pair.map.mesh, values, top, title)
        figure.colorbar(drawn, ax=row, label="|F| (N·s/m²)", shrink=0.8)
    drawing.label_outer(every)
    return figure


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 8: both forces in one room, every reading of the error, the rival's δt."""
    every, errors = readings(mesh), Errors()
    plain = every[0].setting
    lines = curves(plain, errors)
    found = [settings_tried(one, plain, errors) for one in with_progress(every, "readings of Fig. 8", progress)]
    room, triangles = _mesh(SIDE, 2 * mesh)
    left = left_velocity(Case.UNIFORM, room, 1)
    law = turbulence.TurbulenceLaw()
    dependence = turbulence.time_step_dependence(triangles, DENSITY, left, law, STEPS)
    forces = [step.force for step in dependence]
    # largest mean force over the least; that of the shortest step over the next: 1 at a limit
    grown, settled = max(forces) / min(forces), forces[0] / forces[1]
    volume = TABLE_1.volume_dissipation
    words = Words(
        __name__,
        **{"tried": found, "plain": found[0], "cases": list(Case)},
        **{"steps": dependence, "grown": grown, "settled": settled},
        best=min((t for t in found if t.settled), key=lambda t: float(t.errors.min())),
        sound=[t for t in found if t.reached and t.settled],
    )
    named = [(f"crowd turbulence, δt = {step.time_step:g} s", step) for step in dependence]
    return words.section(
        "8",
        pictures={
            "fig_8_error": error_curves(lines),
            "fig_8_forces": force_maps({case: pair_of(case, plain, volume) for case in Case}),
        },
        tables={
            "readings": [_row(one) for one in found],
            "steps": [[*step[:-2], str(step.status)] for step in dependence],
        },
        claims={
            "error": error_verdict(found),
            "friction": Verdict.of(grown > DEPENDS),
            "smooth": Verdict.of(grown > DEPENDS, settled > DEPENDS),
        },
        warnings=[*errors.warnings, *unsolved(named)],
    )


def error_verdict(tried: Sequence[Tried]) -> Verdict:
    """Judge whether a reading gives 10⁻² for every k_v ≥ 4, or for one, and keeps it on a finer
    mesh."""
    valid = [t for t in tried if t.settled]
    somewhere = (bool(t.errors.max(0).min() <= LARGEST_OF_ORDER) for t in valid)
    return Verdict.of(any(t.reached for t in valid), any(somewhere))


def _row(tried: Tried) -> list[Cell]:
    finer: list[Cell] = ["–", "–"] if np.isnan(tried.finer[0]) else tried.finer.tolist()
    return [tried.reading.words, *tried.errors.ravel().tolist(), *finer]
