"""Fig. 8: contact forces of the crowd turbulence (15)–(19) and of the collision (11): every reading
of the "error of the order of 10⁻²", errors against k_v, and how the rival depends on δt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from skfem import MeshTri1

from analysis.pages import drawing
from analysis.pages.fields import draw_map, rounded
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import Answer, unsolved
from analysis.paper.continuum.exit_room import BODY, EXIT, MESH, SIDE, map_of
from analysis.support.parallel import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, random_speeds, toward_exit
from nscd.continuum.medium import DENSITY, PERSON, TABLE_1, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import BodyFields, body_fields, percussion_density, pressure
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.density_laws import TurbulencePressure
from nscd.continuum.rivals.turbulence import (
    Congestion,
    StepDependence,
    TurbulenceLaw,
    TurbulenceStep,
    time_step_dependence,
    turbulence_step,
)
from nscd.continuum.room import Room, square_room
from nscd.continuum.space import Space
from nscd.stress import smear

CHECKED = (4.0, 9.0, 25.0, 100.0)  # k_v ≥ 4, of which the paper speaks
FINER = 9.0  # the k_v that is tried on half the mesh too
LARGEST_OF_ORDER = 10**-1.5  # 10⁻² to the nearest power of ten
SETTLED = 0.2  # an error that changes by more on a mesh of half the side is the mesh's
DEPENDS = 1.1  # forces that differ by this factor depend on δt
PRESSURE, LARGEST = "‖p − δt p_t‖ / ‖δt p_t‖", "largest pressure over a body"
MEAN = "mean difference of |F|"
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
class Setting:
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
def _step(case: Case, setting: Setting) -> TurbulenceStep:
    room, mesh = _mesh(setting.side, setting.mesh)
    law = TurbulencePressure()
    at_rest = np.where(Cells(mesh).open, 0.0, setting.person * law.pressure(DENSITY))
    given = (law, law.continuous(), at_rest, Congestion())
    pressures = dict(zip(Pressing, given, strict=True))
    person, friction = setting.person, setting.friction
    pressing: Any = pressures[setting.pressing]
    model = TurbulenceLaw(pressure=pressing, friction=friction, mass_per_person=person)
    left = left_velocity(case, room, setting.seed)
    return turbulence_step(mesh, DENSITY, left, model, time_step=setting.time_step)


class Forces:
    """One case in one setting: the crowd turbulence, which knows nothing of (11), and (11) for each
    k_v that is asked for.

    map: where body means are taken
    area, theirs: (m,) m² and N·s/m², of the cells and of |−δt∇·σ| of the crowd turbulence there
    their_pressure: N·s/m, δt p_t from (16)"""

    def __init__(self, case: Case, setting: Setting) -> None:
        self.case, self.setting = case, setting
        self.pairs: dict[float, Pair] = {}
        self.room = _mesh(setting.side, setting.mesh)[0]
        self.space = _space(setting.side, setting.mesh, setting.order)
        self.map, self.area = map_of(self.room), Cells(self.space.mesh).measure
        alone = replace(setting, wall=Wall.PRESSED, order=1, mixed_units=False)
        self.turbulence = _step(case, alone)
        self.theirs = np.hypot(*self.turbulence.percussion_density.T)
        p = setting.person * float(TurbulencePressure().pressure(DENSITY))
        self.their_pressure = setting.time_step * p

    @cached_property
    def theirs_on_bodies(self) -> Floats:
        """(n,) N·s/m², the modulus of its mean over a body."""
        middle = np.ascontiguousarray(self.space.mesh.p[:, self.space.mesh.t].mean(1).T)
        density = np.hstack([np.ones((len(middle), 1)), self.turbulence.percussion_density])
        sums, _ = smear(middle, self.area[:, None] * density, BODY, self.map.points)
        return np.asarray(np.hypot(*(sums[:, 1:] / sums[:, :1]).T))

    def pair(self, volume: float) -> Pair:
        """Solve (11) with this k_v, and set it beside the crowd turbulence."""
        if volume not in self.pairs:
            setting, k_s = self.setting, TABLE_1.surface_dissipation
            surface = {Wall.NOWHERE: 0.0, Wall.SHARE: volume * k_s / TABLE_1.volume_dissipation}
            k_s = surface.get(setting.wall, k_s)
            crowd = table_1_medium(volume=volume, surface=k_s, person=setting.person)
            if setting.mixed_units:
                crowd = replace(crowd, density=DENSITY * setting.person, mass_per_person=None)
            left = left_velocity(self.case, self.room, setting.seed)
            everywhere = setting.wall is Wall.EVERYWHERE
            answer = collide(self.space, crowd, left, surface_everywhere=everywhere)
            self.pairs[volume] = Pair(self, answer)
        return self.pairs[volume]

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers so far, named."""
        where = f"case {self.case}, {self.setting}"
        pairs = [(f"(11), k_v = {k:g}, {where}", pair.answer) for k, pair in self.pairs.items()]
        return [(f"crowd turbulence, {where}", self.turbulence), *pairs]


class Pair:
    """The answer of (11) beside the crowd turbulence, and ways to measure their difference.

    vectors, ours: (m,2) and (m,) N·s/m², div σ of (11) in the cells and its modulus"""

    def __init__(self, forces: Forces, answer: CollisionAnswer) -> None:
        self.forces, self.answer = forces, answer
        weight = answer.space.basis.dx
        self.vectors = ((percussion_density(answer) * weight).sum(2) / weight.sum(1)).T
        self.ours = np.hypot(*self.vectors.T)

    @cached_property
    def fields(self) -> BodyFields:
        """Means over a body at the points of the map."""
        return body_fields(self.answer, BODY, self.forces.map.points)

    @property
    def ours_on_bodies(self) -> Floats:
        """(n,) N·s/m², the modulus of the mean over a body."""
        return np.asarray(np.hypot(*self.fields.percussion_density.T))

    def of_moduli(self) -> float:
        """‖|F| − |F_t|‖/‖F_t‖ over the cells, in L²."""
        return _share(self.ours - self.forces.theirs, self.forces.theirs, self.forces.area)

    def of_vectors(self) -> float:
        """‖F − F_t‖/‖F_t‖ over the cells, in L²."""
        difference = self.vectors - self.forces.turbulence.percussion_density
        return _share(np.hypot(*difference.T), self.forces.theirs, self.forces.area)

    def on_bodies(self) -> float:
        """‖|F| − |F_t|‖/‖F_t‖ of the means over a body, in L²."""
        theirs = self.forces.theirs_on_bodies
        return _share(self.ours_on_bodies - theirs, theirs, self.forces.map.area)

    def of_mean(self) -> float:
        """Mean over the room of ||F| − |F_t||, over the mean of |F_t|."""
        area, theirs = self.forces.area, self.forces.theirs
        return float(area @ np.abs(self.ours - theirs) / (area @ theirs))

    def of_largest_cell(self) -> float:
        """The same mean over the largest |F_t| in any cell, which is the mesh's."""
        area, theirs = self.forces.area, self.forces.theirs
        return float(area @ np.abs(self.ours - theirs) / area.sum() / theirs.max())

    def of_largest_body(self) -> float:
        """The same of the means over a body, over the largest of |F_t| among them."""
        area, theirs = self.forces.map.area, self.forces.theirs_on_bodies
        return float(area @ np.abs(self.ours_on_bodies - theirs) / area.sum() / theirs.max())

    def of_pressures(self) -> float:
        """‖p − δt p_t‖/‖δt p_t‖ in L², p = −½ tr σ over a body, p_t from (16)."""
        p, theirs = self.fields.pressure, self.forces.their_pressure
        return _share(p - theirs, np.full(len(p), theirs), self.forces.map.area)

    def of_largest_pressures(self) -> float:
        """|max p − δt p_t|/δt p_t with the largest p over a body."""
        return abs(float(self.fields.pressure.max()) / self.forces.their_pressure - 1)

    def of_raw_pressures(self) -> float:
        """The same with the largest p in any triangle, which is the mesh's."""
        return abs(float(pressure(self.answer).max()) / self.forces.their_pressure - 1)


def _share(difference: Floats, of: Floats, area: Floats) -> float:
    """‖difference‖/‖of‖ in L²."""
    return float(np.sqrt(area @ difference**2 / (area @ of**2)))


class Reading(NamedTuple):
    """One way to read the error: in words, how it is measured, and the setting."""

    words: str
    measure: Callable[[Pair], float]
    setting: Setting


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
    def reached_somewhere(self) -> bool:
        """The same for one k_v and both cases."""
        return bool(self.errors.max(0).min() <= LARGEST_OF_ORDER)

    @property
    def at_finer(self) -> Floats:
        """(2,) at FINER on the mesh itself."""
        return self.errors[:, CHECKED.index(FINER)]

    @property
    def settled(self) -> bool:
        """Whether half the mesh leaves the error as it is."""
        return bool((np.abs(self.finer / self.at_finer - 1) < SETTLED).all())


def readings(mesh: float = MESH) -> list[Reading]:
    """List all that are tried, the plain one first; `mesh` is the side of the triangles (m)."""
    plain = Setting(mesh=mesh)
    opened = replace(plain, pressing=Pressing.OPEN)
    measured = [
        Reading("‖|F| − |F_t|‖ / ‖F_t‖, L² over the room", Pair.of_moduli, plain),
        Reading("‖F − F_t‖ / ‖F_t‖, of the vectors", Pair.of_vectors, plain),
        Reading("the same of |F|, as means over a body", Pair.on_bodies, plain),
        Reading(f"{MEAN} over the mean of |F_t|", Pair.of_mean, plain),
        Reading(f"{MEAN} over the largest |F_t| over a body", Pair.of_largest_body, plain),
        Reading(CELL, Pair.of_largest_cell, plain),
        Reading(f"{CELL}, half the mesh", Pair.of_largest_cell, _halved(plain)),
        Reading(f"{CELL}, p_t = 0 on the exit", Pair.of_largest_cell, opened),
        Reading(f"pressure: {PRESSURE} over a body, p_t of (16)", Pair.of_pressures, plain),
        Reading(f"{LARGEST}: |p − δt p_t| / δt p_t", Pair.of_largest_pressures, plain),
        Reading("largest pressure in any triangle: the same", Pair.of_raw_pressures, plain),
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
    return measured + [Reading(f"L² of |F|: {w}", Pair.of_moduli, s) for w, s in varied]


class Compared:
    """Forces of both cases in each setting, solved when first asked for.

    The plain setting and that on half the mesh serve many readings and are kept.
    warnings: of what was not solved."""

    def __init__(self, plain: Setting) -> None:
        self.plain = plain
        self.warnings: dict[str, None] = {}
        self.known = {(case, s): Forces(case, s) for case in Case for s in (plain, _halved(plain))}

    def errors(self, reading: Reading, volumes: Sequence[float], *, half: bool = False) -> Floats:
        """Measure both cases for each k_v, (2, k_v), if asked for on half the mesh."""
        setting = _halved(reading.setting) if half else reading.setting
        rows = []
        for case in Case:
            forces = self.known.get((case, setting)) or Forces(case, setting)
            rows.append([reading.measure(forces.pair(volume)) for volume in volumes])
            self.warnings |= dict.fromkeys(unsolved(forces.answers))
        return np.array(rows)

    def tried(self, reading: Reading) -> Tried:
        """Try a reading, on half the mesh too where it is of the plain setting or reaches 10⁻²."""
        errors, finer = self.errors(reading, CHECKED), np.full(2, np.nan)
        if reading.setting == self.plain or errors.max() <= LARGEST_OF_ORDER:
            finer = self.errors(reading, [FINER], half=True)[:, 0]
        return Tried(reading, errors, finer)


def _halved(setting: Setting) -> Setting:
    return replace(setting, mesh=0.5 * setting.mesh)


class Curve(NamedTuple):
    """An error against k_v, per person: that of cases a and b in the rows of (2,k)."""

    name: str
    volumes: Sequence[float]
    errors: Floats


def curves(compared: Compared) -> list[Curve]:
    """Measure errors against k_v: in L² for three δt, and over the largest in any triangle on two
    meshes."""
    plain, found = compared.plain, []
    for step in CURVE_STEPS:
        name, setting = f"L², δt = {step:g} s", replace(plain, time_step=step)
        errors = compared.errors(Reading(name, Pair.of_moduli, setting), VOLUMES)
        found.append(Curve(name, VOLUMES, errors))
    cell = Reading("mean over the largest in any triangle", Pair.of_largest_cell, plain)
    for half, volumes in ((False, VOLUMES), (True, VOLUMES[::2])):
        name = f"{cell.words} ({plain.mesh / (1 + half):g} m)"
        found.append(Curve(name, volumes, compared.errors(cell, volumes, half=half)))
    return found


def steps(size: float) -> list[StepDependence]:
    """Take one step of the crowd turbulence for several δt, case (b), triangles of a size (m)."""
    room = square_room(SIDE, EXIT)
    left = left_velocity(Case.UNIFORM, room, 1)
    return time_step_dependence(mesh_of(room, size), DENSITY, left, TurbulenceLaw(), STEPS)


def error_curves(curves: Sequence[Curve]) -> Figure:
    """Draw errors against k_v for both cases, with the paper's 10⁻² and its k_v ≥ 4."""
    figure, every = drawing.panels(10.0, 4.8, 1, 2, sharey=True)
    for axes, case in zip(every, Case, strict=True):
        for number, curve in enumerate(curves):
            style: dict[str, Any] = {
                "marker": drawing.MARKERS[number],
                "ls": drawing.LINES[number % len(drawing.LINES)],
            }
            style |= {
                "color": (*drawing.COLOURS, drawing.BLACK)[number],
                "mfc": "none" if number > 2 else None,
            }
            errors = curve.errors[list(Case).index(case)]
            axes.plot(curve.volumes, errors, label=curve.name, **style)
        axes.axhspan(
            10**-2.5, 10**-1.5, color=drawing.GREY, alpha=0.45, lw=0, label="order of 10⁻²"
        )
        axes.axvline(4.0, color=drawing.BLACK, lw=0.8, ls=":")
        place = ("data", "axes fraction")
        axes.annotate("$k_v = 4$", (4.2, 0.98), xycoords=place, fontsize=8, va="top")
        axes.set(xscale="log", yscale="log", title=NAMES[case])
        axes.set(xlabel="volume dissipation $k_v$ (per person)")
        axes.grid(alpha=0.3)
    every[0].set_ylabel("difference from the crowd turbulence (–)")
    drawing.legend_below(figure, every[0], 2)
    return figure


def force_maps(pairs: dict[Case, Pair]) -> Figure:
    """Draw |F| of the crowd turbulence, of (11), and their difference, over a body, on one scale
    per row."""
    figure, every = drawing.panels(10.5, 7.0, 2, 3, sharex=True, sharey=True)
    for row, (case, pair) in zip((every[:3], every[3:]), pairs.items(), strict=True):
        theirs, ours = pair.forces.theirs_on_bodies, pair.ours_on_bodies
        top = rounded(float(np.quantile(np.concatenate([theirs, ours]), 0.99)))
        names = ("crowd turbulence", "proposed, (11)", "difference")
        fields = (theirs, ours, np.abs(ours - theirs))
        for axes, name, values in zip(row, names, fields, strict=True):
            title = f"{NAMES[case][:3]} {name}"
            drawn = draw_map(axes, pair.forces.room, pair.forces.map.mesh, values, top, title)
        figure.colorbar(drawn, ax=row, label="|F| (N·s/m²)", shrink=0.8)
    drawing.label_outer(every)
    return figure


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 8: both forces in one room, every reading of the error, the rival's δt."""
    every = readings(mesh)
    compared = Compared(every[0].setting)
    lines, tried = curves(compared), list[Tried]()
    for number, reading in enumerate(every):
        if progress:
            progress("readings of Fig. 8", number / len(every))
        tried.append(compared.tried(reading))
    taken = steps(2 * mesh)
    forces = [step.force for step in taken]
    # largest mean force over the least; that of the shortest step over the next: 1 at a limit
    grown, settled = max(forces) / min(forces), forces[0] / forces[1]
    volume = TABLE_1.volume_dissipation
    pairs = {case: compared.known[case, compared.plain].pair(volume) for case in Case}
    words = Words(
        __name__,
        **{"tried": tried, "plain": tried[0], "cases": list(Case), "checked": CHECKED},
        **{"side": SIDE, "exit": EXIT, "density": DENSITY},
        **{"steps": taken, "grown": grown, "settled": settled},
        best=min((t for t in tried if t.settled), key=lambda t: float(t.errors.min())),
        sound=[t for t in tried if t.reached and t.settled],
    )
    named = [(f"crowd turbulence, δt = {step.time_step:g} s", step) for step in taken]
    return words.section(
        "8",
        pictures={"fig_8_error": error_curves(lines), "fig_8_forces": force_maps(pairs)},
        tables={
            "readings": [_row(one) for one in tried],
            "steps": [[*step[:-2], str(step.status)] for step in taken],
        },
        claims={
            "error": error_verdict(tried),
            "friction": Verdict.of(grown > DEPENDS),
            "smooth": Verdict.of(grown > DEPENDS, settled > DEPENDS),
        },
        warnings=[*compared.warnings, *unsolved(named)],
    )


def error_verdict(tried: Sequence[Tried]) -> Verdict:
    """Judge whether a reading gives 10⁻² for k_v ≥ 4, and keeps it on a finer mesh."""
    sound = [t for t in tried if t.settled]
    return Verdict.of(any(t.reached for t in sound), any(t.reached_somewhere for t in sound))


def _row(tried: Tried) -> list[Cell]:
    finer: list[Cell] = ["–", "–"] if np.isnan(tried.finer[0]) else tried.finer.tolist()
    return [tried.reading.words, *tried.errors.ravel().tolist(), *finer]
