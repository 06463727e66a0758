"""Figure 1: four aligned disks, by the percussions, Newton's law of impact and soft contacts."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from scipy.optimize import bisect

from analysis.engines.run import EngineRun
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    MARKERS,
    ORANGE,
    label,
    legend_below,
    panels,
)
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.scene.scene import read_scene
from analysis.studies.paper.discrete.engine_runs import each, end_of
from analysis.studies.paper.discrete.line_of_disks import aligned, cradle_scene, newton_impact
from analysis.studies.paper.solutions import unsolved
from analysis.support.parallel import Progress
from nscd import ContactLaw, Percussions, find_contacts, solve
from nscd.arrays import Floats

TOLERANCE = 1e-10
MASS, PRINTED_K, LIGHT = 75.0, 10.0, 1.0  # kg
# k of the limit k → ∞, over m: large, yet not beyond what double precision resolves.
LARGE = 1e6
BOTH = ("lammps", "yade")
RESTITUTIONS = (0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99)
UNEQUAL = (50.0, 90.0, 60.0, 75.0)  # kg
# m/s: every contact closes
CLOSING = (2.0, 1.2, 0.5, 0.0)
# m/s: the second disk leaves the third while the first pushes from behind, so that a contact opens
# and is pressed
OPENING = (2.0, 0.0, 1.0, -1.0)


class Impact(NamedTuple):
    """One law's answer for a line."""

    law: str
    mass: Floats  # (n,) kg
    before: Floats  # (n,) m/s
    after: Floats  # (n,) m/s
    solution: Percussions | None = None  # the percussions of a law that has any

    @property
    def energies(self) -> tuple[float, float]:
        """Kinetic energy before and after (J)."""
        before, after = (float(0.5 * self.mass @ u**2) for u in (self.before, self.after))
        return before, after

    @property
    def returned(self) -> float:
        """Share of the energy lost by the inelastic impact that this one gives back."""
        inelastic = 0.5 * float(self.mass @ self.before) ** 2 / float(self.mass.sum())
        before, after = self.energies
        return (after - inelastic) / (before - inelastic)

    def row(self) -> list[Cell]:
        """Law, mass, u⁺ of each disk, p¹² (from the momentum of the first), λ¹², energies, status."""
        solution, mass = self.solution, float(self.mass[0])
        impulse = mass * float(self.before[0] - self.after[0])
        reaction: Cell = "–" if solution is None else float(solution.reaction[0])
        speeds, status = map(float, self.after), "–" if solution is None else _status(solution)
        return [self.law, mass, *speeds, impulse, reaction, *self.energies, status]


def _status(solution: Percussions) -> str:
    return ", ".join([str(solution.status), *solution.warnings])


def percussions(mass: ArrayLike, left: ArrayLike, law: ContactLaw) -> Percussions:
    """Solve touching disks in a line with masses (n,) kg and left velocities (n,) m/s."""
    snapshot = aligned(mass, left)
    return solve(snapshot, find_contacts(snapshot, tolerance=1e-9), law=law, tolerance=TOLERANCE)


def first_only(disks: int, speed: float = 2.0) -> Floats:
    """Left velocities (n,) m/s where the first disk moves and the others are at rest."""
    return np.concatenate([[speed], np.zeros(disks - 1)])


def opening_threshold(mass: ArrayLike) -> float:
    """Find the k (kg) beyond which the first contact of a line at rest, hit by its first disk,
    opens; by bisection.

    The sign is that of λ¹²/m − (u²⁺ − u¹⁺): the contact carries a reaction below the threshold and
    opens above."""
    masses = np.asarray(mass, dtype=np.float64)
    left = first_only(len(masses))

    def pressed(k: float) -> float:
        solution = percussions(masses, left, ContactLaw(dissipation=k))
        right = solution.right_velocity[:, 0]
        return float(solution.reaction[0] / masses[0] + right[0] - right[1])

    ends = 1e-3 * masses.min(), 1e3 * masses.max()
    return float(bisect(pressed, *ends, xtol=1e-10 * masses.min()))


def line_restitution(disks: int, restitution: float) -> float:
    """(u²⁺ − u¹⁺)/U of equal disks hit by their first one, with k of the pair's `restitution`."""
    left, law = first_only(disks), ContactLaw(restitution=restitution)
    right = percussions(np.full(disks, MASS), left, law).right_velocity[:, 0]
    return float((right[1] - right[0]) / left[0])


def four_disk_restitution(e: float) -> float:
    """(u²⁺ − u¹⁺)/U of four equal disks with k of a pair's e: max(0, (5e−1)/(5−e)), from (k −
    ¾m)/(k + ¾m)."""
    return max(0.0, (5 * e - 1) / (5 - e))


def influence(mass: ArrayLike, left: ArrayLike) -> Floats:
    """∂λ¹²/∂u_j⁻ (n,) kg of the inelastic impact, by central differences of 1e-3 m/s."""
    base, step = np.asarray(left, dtype=np.float64), 1e-3
    changes = [
        percussions(mass, base + shift, ContactLaw()).reaction[0]
        - percussions(mass, base - shift, ContactLaw()).reaction[0]
        for shift in step * np.eye(len(base))
    ]
    return np.array(changes) / (2 * step)


def cradle_runs(disks: int, runs: Path) -> list[EngineRun]:
    """List the line as soft disks: elastic, strongly damped, by both engines, with Hertz' law."""
    scene = read_scene("four_disks")
    cases = [(engine, "hooke", e, t) for e, t in ((1.0, 12), (0.01, 100)) for engine in BOTH]
    cases.insert(2, ("lammps", "hertz", 1.0, 48))
    return [
        EngineRun.of(cradle_scene(scene, disks, law=law, restitution=e, periods=t), engine, runs)
        for engine, law, e, t in cases
    ]


def impacts_of(
    disks: int, runs: Path, warnings: list[str], progress: Progress | None
) -> list[Impact]:
    """Compute the impact of a line by every law; the first four: k = 0, the printed k with both
    masses, k → ∞."""
    mass, left = np.full(disks, MASS), first_only(disks)
    printed = ContactLaw(dissipation=PRINTED_K)
    cases = [
        ("k = 0", mass, ContactLaw()),
        (f"k = {PRINTED_K:g} kg", mass, printed),
        (f"k = {PRINTED_K:g} kg, m = {LIGHT:g} kg", mass / MASS * LIGHT, printed),
        ("k = 10⁶ m (k → ∞)", mass, ContactLaw(dissipation=LARGE * MASS)),
        ("pair's e = 0.5", mass, ContactLaw(restitution=0.5)),
    ]
    impacts = []
    for name, masses, law in cases:
        solution = percussions(masses, left, law)
        after = solution.right_velocity[:, 0]
        impacts.append(Impact(f"percussions, {name}", masses, left, after, solution))
    for e in (0.5, 1.0):
        impacts.append(Impact(f"Newton, e = {e:g}", mass, left, newton_impact(mass, left, e)))

    def soft(run: EngineRun) -> Impact:
        contact, end = run.scene.contact, end_of(run, progress)
        label = f"{ENGINE_NAMES[run.engine]}, e = {contact.restitution:g}, {contact.law}"
        return Impact(label, mass, left, end.velocity[:, 0])

    return impacts + each(cradle_runs(disks, runs), soft, warnings)


def against_ratio(disks: int, ratios: Floats) -> Floats:
    """Find u⁺/U (s,n) of equal disks hit by their first one, for each k/m (s,)."""
    mass, left = np.full(disks, MASS), first_only(disks, 1.0)
    laws = (ContactLaw(dissipation=ratio * MASS) for ratio in ratios)
    return np.array([percussions(mass, left, law).right_velocity[:, 0] for law in laws])


def thresholds() -> list[tuple[int, str, float, float, float]]:
    """Tabulate disks, masses, k at which the first contact opens by bisection and in closed form
    m¹M/(m¹+M), M the mass of all others (kg), relative difference."""
    rows = []
    for mass in ([MASS] * 2, [MASS] * 3, [MASS] * 4, UNEQUAL):
        found, rest = opening_threshold(mass), sum(mass[1:])
        closed = mass[0] * rest / (mass[0] + rest)
        words = ", ".join(f"{m:g}" for m in mass)
        rows.append((len(mass), words, found, closed, abs(found / closed - 1)))
    return rows


def restitutions() -> list[tuple[float, ...]]:
    """Tabulate e asked, its k (kg), the restitution of a pair, of four disks, in closed form, by
    Newton's law, and how far four disks are short of e."""
    rows: list[tuple[float, ...]] = []
    for e in RESTITUTIONS:
        k = float(ContactLaw(restitution=e).coefficients(np.array([2 / MASS]))[0][0])
        right = newton_impact(np.full(4, MASS), first_only(4), e)
        four, obtained = line_restitution(4, e), float((right[1] - right[0]) / 2.0)
        closed = four_disk_restitution(e)
        rows.append((e, k, line_restitution(2, e), four, closed, obtained, e - four))
    return rows


def formula() -> tuple[float, Floats, Floats]:
    """How far (3) is from λ¹² of unequal disks, all contacts closing, as a share; and ∂λ¹²/∂u⁻
    (4,) kg, by the solver and of (3)."""
    mass, left = np.array(UNEQUAL), np.array(CLOSING)
    printed = float(mass[0] * (mass[1:] @ (left[0] - left[1:])) / mass.sum())
    solved = float(percussions(mass, left, ContactLaw()).reaction[0])
    closed = np.concatenate([[mass[0] * mass[1:].sum()], -mass[0] * mass[1:]]) / mass.sum()
    return abs(solved / printed - 1), influence(mass, CLOSING), closed


def opening_rows() -> list[tuple[Cell, ...]]:
    """Tabulate k (kg), λ²³ (N·s), energy before and after (J), energy error and status where a
    contact opens while it is pressed."""
    rows: list[tuple[Cell, ...]] = []
    for k in (0.0, 10.0, 100.0, 1000.0):
        solution = percussions(np.full(4, MASS), OPENING, ContactLaw(dissipation=k))
        before = 0.5 * MASS * float(np.square(OPENING).sum())
        after = 0.5 * MASS * float((solution.right_velocity**2).sum())
        reaction = float(solution.reaction[1])
        rows.append((k, reaction, before, after, solution.energy_error, _status(solution)))
    return rows


HATCHES = ("", "///", "...", "xxx")


def after_impact(impacts: list[Impact]) -> Figure:
    """Draw bars of u⁺/U of each disk, a group for each law."""
    figure, (axes,) = panels(8.0, 0.45 * len(impacts) + 1.4)
    disks = len(impacts[0].mass)
    height = 0.8 / disks
    rows = np.arange(len(impacts), dtype=float)
    for disk in range(disks):
        speeds = [impact.after[disk] / impact.before[0] for impact in impacts]
        style: dict[str, Any] = {"color": COLOURS[disk], "hatch": HATCHES[disk]}
        style |= {"edgecolor": BLACK, "linewidth": 0.5, "label": f"disk {disk + 1}"}
        axes.barh(rows + (disk - 0.5 * (disks - 1)) * height, speeds, height, **style)
    axes.axvline(0, color=BLACK, lw=0.8)
    axes.set_yticks(rows, [impact.law for impact in impacts], fontsize=8)
    x = "velocity after the impact / velocity of disk 1 before it (–)"
    label(axes, x, ylim=(len(impacts) - 0.4, -0.6))
    axes.grid(axis="x", alpha=0.3)
    legend_below(figure, axes, disks, anchor="outside upper center")
    return figure


def against_dissipation(
    ratios: Floats, four: Floats, pair: Floats, obtained: Sequence[Sequence[float]]
) -> Figure:
    """Draw u⁺/U of four disks (s,4) and of a pair (s,2) against k/m (s,), with both readings of the
    printed k, and the restitution obtained: rows of `restitutions`."""
    figure, (left, right) = panels(10.0, 4.2, 1, 2, grid="major")
    _velocities(left, ratios, four, pair)
    e, _, pairs, fours, _, newton, _ = np.array(obtained).T
    line = np.linspace(0, 1, 201)
    closed = [four_disk_restitution(float(x)) for x in line]
    right.plot(line, line, "-", color=GREY, label="e asked")
    right.plot(line, closed, "--", color=BLACK, label="(5e−1)/(5−e), or 0")
    right.plot(e, pairs, MARKERS[0], color=BLUE, label="percussions, pair")
    right.plot(e, fours, MARKERS[1], color=ORANGE, label="percussions, four disks")
    right.plot(e, newton, "x", color=BLACK, label="Newton's law, four disks")
    x, y = "restitution e that k stands for in a pair (–)", "(u²⁺ − u¹⁺) / U (–)"
    label(right, x, y, legend="best")
    return figure


def _velocities(axes: Axes, ratio: Floats, four: Floats, pair: Floats) -> None:
    axes.plot(ratio, four[:, 0], "-", color=BLUE, label="four disks: disk 1")
    axes.plot(ratio, four[:, 1:].mean(1), "--", color=ORANGE, label="four disks: disks 2–4")
    axes.plot(ratio, pair[:, 0], ":", color=BLUE, label="pair: disk 1")
    axes.plot(ratio, pair[:, 1], "-.", color=ORANGE, label="pair: disk 2")
    for anchor, words, style, side, shift in (
        (0.75, "k = ¾m", "-", "left", 1.08),
        (0.5, "k = ½m", ":", "right", 0.93),
    ):
        axes.axvline(anchor, color=BLACK, lw=0.8, ls=style)
        axes.text(anchor * shift, -0.72, words, fontsize=8, ha=side)
    for mass, marker in ((MASS, "D"), (LIGHT, "v")):
        anchor = PRINTED_K / mass
        values = [np.interp(np.log(anchor), np.log(ratio), four[:, disk]) for disk in (0, 1)]
        words = f"k = {PRINTED_K:g} kg, m = {mass:g} kg"
        axes.plot([anchor] * 2, values, marker, ls="none", mfc="white", mec=BLACK, ms=7, label=words)
    axes.set(xscale="log", ylim=(-1.05, 1.45), xlabel="k/m (–)", ylabel="u⁺/U (–)")
    axes.legend(fontsize=7, ncols=2, loc="upper left")


def engine_runs(runs: Path) -> list[EngineRun]:
    """List four and three disks by the engines."""
    return cradle_runs(4, runs) + cradle_runs(3, runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 1: every law's velocities, energies and percussions; the threshold; what
    restitution becomes.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning."""
    missing: list[str] = []
    fours, threes = (impacts_of(n, runs, missing, progress) for n in (4, 3))
    solved = [(f"{i.law}, m = {i.mass[0]:g} kg", i.solution) for i in fours + threes]
    ratios = np.geomspace(0.03, 300, 61)
    four, pair = (against_ratio(n, ratios) for n in (4, 2))
    requested, (error, *effect) = restitutions(), formula()
    # how far the restitution of a pair, and of four disks, is from the e asked, at most
    misses = [max(abs(row[i] - row[0]) for row in requested) for i in (2, 3)]
    rigid, printed, light = fours[:3]
    far = effect[0][2:]
    disks = {"apart": float(np.ptp(four[:, 1:], axis=1).max()), "misses": misses}
    words = Words(__name__, disks=disks, rigid=rigid, printed=printed, light=light)
    restitution = Verdict.FAILS if misses[0] > 1e-6 else Verdict.of(True, misses[1] < 1e-6)
    return words.section(
        "1",
        pictures={
            "fig_1_velocities": after_impact(fours),
            "fig_1_dissipation": against_dissipation(ratios, four, pair, requested),
        },
        tables={
            "table_four": [impact.row() for impact in fours],
            "table_three": [impact.row() for impact in threes],
            "table_threshold": thresholds(),
            "table_restitution": requested,
            "table_opening": opening_rows(),
            "table_influence": np.column_stack([range(1, 5), *effect]).tolist(),
        },
        claims=[
            words.claim("non_local", Verdict.of(bool(abs(far).min() > 1e-3 * MASS)), far=far),
            words.claim("formula_3", Verdict.of(error < 1e-9), error=error),
            words.claim("elastic", Verdict.of(printed.returned > 0.5)),
            words.claim("restitution", restitution),
        ],
        warnings=missing + unsolved((words, solution) for words, solution in solved if solution),
    )
