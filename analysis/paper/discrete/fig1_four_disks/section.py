"""Figure 1: four aligned disks, by the percussions, by Newton's law of impact and by soft
contacts."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.engines.run import EngineRun
from analysis.pages.section import Cell, Claim, Picture, Section, Table, Verdict
from analysis.paper.discrete.fig1_four_disks.charts import (
    after_impact,
    against_dissipation,
    four_disk_restitution,
)
from analysis.paper.discrete.fig1_four_disks.study import (
    LARGE,
    LIGHT,
    MASS,
    PRINTED_K,
    Impact,
    cradle_runs,
    first_only,
    impacts_of,
    influence,
    line_restitution,
    opening_threshold,
    percussions,
)
from analysis.paper.discrete.line_of_disks import aligned, newton_impact
from analysis.support.progress import Progress
from nscd import ContactLaw, find_contacts
from nscd.arrays import Floats

RESTITUTIONS = (0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99)
# The second disk leaves the third while the first pushes from behind: a contact that opens and is
# pressed.
OPENING = (2.0, 0.0, 1.0, -1.0)


def engine_runs(runs: Path) -> list[EngineRun]:
    """Four and three disks by the engines."""
    return cradle_runs(4, runs) + cradle_runs(3, runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Figure 1 remade: every law's velocities, energies and percussions; the threshold; what
    restitution becomes.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning.
    """
    warnings: list[str] = []
    fours = impacts_of(4, runs, warnings, progress)
    threes = impacts_of(3, runs, warnings, progress)
    rigid, printed, light, limit = fours[:4]
    assert rigid.answer is not None
    assert printed.answer is not None
    assert light.answer is not None
    thresholds = _thresholds()
    restitution = _restitutions()
    sweep = _sweep()
    together = float(np.ptp(sweep[1][:, 1:], axis=1).max())
    newton = next(impact for impact in fours if impact.law == "Newton, e = 1")
    cradles = [impact for impact in fours if "e = 1," in impact.law]
    words = [
        f"Four aligned disks of {MASS:g} kg touch; the first moves at {rigid.before[0]:g} m/s. Inelastic percussions "
        f"(k = 0) give all of them {rigid.after[0]:.4g} m/s, with λ = "
        f"{', '.join(f'{x:.5g}' for x in rigid.answer.reaction)} N·s: each feels disks that it does not touch.",
        f"The printed k = {PRINTED_K:g} kg changes the reaction, λ¹² = {printed.answer.reaction[0]:.5g} N·s, but neither the "
        f"whole percussion, p¹² = {printed.answer.impulse[0, 0]:.5g} N·s, nor the velocities: with m = {MASS:g} kg it is still "
        f"fully inelastic. With m = {LIGHT:g} kg the same k gives {_list(light.after)} m/s, nearly elastic "
        f"({100 * light.energies[1] / light.energies[0]:.1f} % of the energy stays).",
        f"The first contact opens beyond k = {thresholds[2][2]:.8g} kg = ¾ m, since the three behind it act as one body "
        f"of 3m; for a pair it opens beyond {thresholds[0][2]:.8g} kg = ½ m.",
        f"As k → ∞ energy is conserved (k = {LARGE:.0e} m loses {1 - limit.energies[1] / limit.energies[0]:.1e} of it) and the "
        f"velocities become {_list(limit.after)} m/s; Newton's law with e = 1 gives {_list(newton.after)} m/s. "
        + " ".join(f"{c.law}: {_list(c.after)} m/s." for c in cradles)
        + " Laws that conserve momentum and energy alike disagree on who leaves: simultaneous impacts need a choice of law.",
    ]
    pictures = [
        Picture(
            name="fig_1_velocities",
            caption=f"Velocities of four disks after the impact, over that of the first before it, by law. m = {MASS:g} kg "
            f"unless stated.",
            figure=after_impact(
                [(i.law, i.after / i.before[0]) for i in fours],
            ),
        ),
        Picture(
            name="fig_1_dissipation",
            caption="Left: velocities after the impact against k/m, four disks and a pair; both readings of the printed "
            "k = 10 kg. Right: restitution of the first contact against the e that k stands for in a pair.",
            figure=against_dissipation(sweep, PRINTED_K / MASS, PRINTED_K / LIGHT, restitution),
        ),
    ]
    heads = ["u¹⁺ (m/s)", "u²⁺ (m/s)", "u³⁺ (m/s)", "u⁴⁺ (m/s)"]
    ends = ["p¹² (N·s)", "λ¹² (N·s)", "energy before (J)", "after (J)", "status"]
    tables = [
        Table(
            caption="Four disks by law. Reactions λ and whole percussions p apart; p is what soft contacts compare with.",
            head=["law", "m (kg)", *heads, *ends],
            rows=[impact.row() for impact in fours],
        ),
        Table(
            caption="The same with three disks: Newton's law with e = 1 gives 2/n − 1 of the speed to the first of n, "
            "2/n to the others.",
            head=["law", "m (kg)", *heads[:3], *ends],
            rows=[impact.row() for impact in threes],
        ),
        Table(
            caption="Threshold of k beyond which the first contact opens, by bisection on the solver, and m¹M/(m¹+M) with M the "
            "mass of all others.",
            head=[
                "disks",
                "masses (kg)",
                "k by bisection (kg)",
                "closed form (kg)",
                "relative difference",
            ],
            rows=thresholds,
        ),
        Table(
            caption="Restitution: k = m_eff(1+e)/(1−e) gives e for a pair; for four disks max(0, (5e−1)/(5−e)), and "
            "Newton's law e.",
            head=[
                "e asked",
                "k (kg)",
                "pair",
                "four disks",
                "closed form",
                "Newton, four disks",
                "short of e by",
            ],
            rows=restitution,
        ),
        _energy_table(),
        _influence_table(),
    ]
    return Section(
        number="1",
        title="Four aligned disks",
        words=words,
        pictures=pictures,
        tables=tables,
        differs=[
            f"Fig. 1c calls k = {PRINTED_K:g} elastic with m = {MASS:g} kg; it is fully inelastic there, and near elastic with "
            f"m = {LIGHT:g} kg.",
            f"The first of four contacts opens for k > ¾ m = {thresholds[2][3]:g} kg, later than a pair's ½ m = "
            f"{thresholds[0][3]:g} kg.",
            "Equation (3) is the reaction of the inelastic impact with all contacts closing; with k > 0 the impulse is p, not λ.",
            f"No k gives Newton's cradle: disks 2 to 4 leave together at every one (to {together:.1e} of the speed over "
            f"{sweep[0][0]:.2g} ≤ k/m ≤ {sweep[0][-1]:.3g})"
            + "".join(
                f"; {c.law}: disk 4 leaves {(c.after[3] - c.after[1]) / c.before[0]:.3f} of the speed faster than disk 2"
                for c in cradles
            )
            + ".",
        ],
        claims=_claims(rigid, printed, light, restitution),
        warnings=warnings
        + [
            f"{i.law}, m = {i.mass[0]:g} kg: {i.answer.status}: {i.answer.reason}"
            for i in fours + threes
            if i.answer is not None and i.answer.status != "solved"
        ],
    )


def _list(values: Floats) -> str:
    return "(" + ", ".join(f"{x:.4f}" for x in values) + ")"


def _sweep() -> tuple[Floats, Floats, Floats]:
    """k/m (s,), and u⁺/U of four disks (s,4) and of a pair (s,2)."""
    ratios = np.geomspace(0.03, 300, 61)
    velocities = [
        np.array(
            [
                percussions(
                    np.full(n, MASS), first_only(n, 1.0), ContactLaw(dissipation=r * MASS)
                ).right_velocity[:, 0]
                for r in ratios
            ]
        )
        for n in (4, 2)
    ]
    return ratios, velocities[0], velocities[1]


def _thresholds() -> list[tuple[int, str, float, float, float]]:
    rows = []
    for mass in ([MASS] * 2, [MASS] * 3, [MASS] * 4, [50.0, 90.0, 60.0, 75.0]):
        found = opening_threshold(mass)
        rest = sum(mass[1:])
        closed = mass[0] * rest / (mass[0] + rest)
        rows.append(
            (len(mass), ", ".join(f"{m:g}" for m in mass), found, closed, abs(found / closed - 1))
        )
    return rows


def _restitutions() -> list[tuple[float, float, float, float, float, float, float]]:
    rows = []
    snapshot = aligned(np.full(4, MASS), first_only(4))
    contacts = find_contacts(snapshot, tolerance=1e-9)
    for e in RESTITUTIONS:
        k = float(ContactLaw(restitution=e).coefficients(np.array([2 / MASS]))[0][0])
        newton = newton_impact(snapshot, contacts, e)[:, 0]
        four = line_restitution(4, e)
        obtained = float((newton[1] - newton[0]) / 2.0)
        rows.append(
            (e, k, line_restitution(2, e), four, four_disk_restitution(e), obtained, e - four)
        )
    return rows


def _energy_table() -> Table:
    rows: list[list[Cell]] = []
    for k in (0.0, 10.0, 100.0, 1000.0):
        answer = percussions(np.full(4, MASS), OPENING, ContactLaw(dissipation=k))
        before = 0.5 * MASS * float(np.square(OPENING).sum())
        after = 0.5 * MASS * float((answer.right_velocity**2).sum())
        remark = ", ".join([str(answer.status), *answer.warnings])
        rows.append([k, float(answer.reaction[1]), before, after, answer.energy_error, remark])
    return Table(
        caption=f"Energy where a contact opens while it is pressed (left velocities {', '.join(f'{u:g}' for u in OPENING)} m/s, "
        f"m = {MASS:g} kg): with k > 0 it can grow, and the answer warns. Energy error: how far the change is from "
        "−½ p·D(u⁺+u⁻), as a share of the energy before.",
        head=["k (kg)", "λ²³ (N·s)", "energy before (J)", "after (J)", "energy error", "status"],
        rows=rows,
    )


def _influence_table() -> Table:
    mass, left = np.array([50.0, 90.0, 60.0, 75.0]), np.array([2.0, 1.2, 0.5, 0.0])
    found = influence(mass, left)
    closed = np.concatenate([[mass[0] * mass[1:].sum()], -mass[0] * mass[1:]]) / mass.sum()
    return Table(
        caption="How λ¹² depends on the left velocity of each disk (masses 50, 90, 60, 75 kg, all contacts closing): central "
        "differences of the solver, and the derivative of (3).",
        head=["disk", "∂λ¹²/∂u⁻ (kg)", "by (3) (kg)"],
        rows=[
            (j + 1, float(a), float(b)) for j, (a, b) in enumerate(zip(found, closed, strict=True))
        ],
    )


def _claims(
    rigid: Impact,
    printed: Impact,
    light: Impact,
    restitution: list[tuple[float, float, float, float, float, float, float]],
) -> list[Claim]:
    mass, left = np.array([50.0, 90.0, 60.0, 75.0]), np.array([2.0, 1.2, 0.5, 0.0])
    far = influence(mass, left)[2:]
    formula = float(mass[0] * (mass[1:] @ (left[0] - left[1:])) / mass.sum())
    answer = percussions(mass, left, ContactLaw())
    error = abs(float(answer.reaction[0]) / formula - 1)
    # what the collision gives back of what an inelastic one loses
    returned = [
        (impact.energies[1] - inelastic) / (impact.energies[0] - inelastic)
        for impact in (printed, light)
        for inelastic in [0.5 * float(impact.mass @ impact.before) ** 2 / float(impact.mass.sum())]
    ]
    pair = max(abs(row[2] - row[0]) for row in restitution)
    four = max(abs(row[3] - row[0]) for row in restitution)
    return [
        Claim(
            where="text after (3)",
            statement="the percussion p_reac^{1,2} involves u^{3,-} and u^{4,-} besides u^{1,-} and u^{2,-}",
            verdict=Verdict.HOLDS if np.abs(far).min() > 1e-3 * mass[0] else Verdict.FAILS,
            reason=f"∂λ¹²/∂u³⁻ = {far[0]:.5g} kg and ∂λ¹²/∂u⁴⁻ = {far[1]:.5g} kg by finite differences",
        ),
        Claim(
            where="(3)",
            statement="the generated contact force between the blue and the neighbored red disks is given by (3)",
            verdict=Verdict.HOLDS if error < 1e-9 else Verdict.FAILS,
            reason=f"(3) gives {formula:.8g} N·s, the solver {answer.reaction[0]:.8g} N·s, with four unequal masses and k = 0 "
            f"(relative difference {error:.1e}); it is a percussion, in N·s",
        ),
        Claim(
            where="Fig. 1c",
            statement="the state after impact for an elastic contact (k = 10)",
            verdict=Verdict.HOLDS if returned[0] > 0.5 else Verdict.FAILS,
            reason=f"with the printed m = {MASS:g} kg the impact returns {100 * returned[0]:.2g} % of the energy that the "
            f"inelastic one loses, and the velocities differ from those of k = 0 by "
            f"{np.abs(printed.after - rigid.after).max():.1e} m/s; with m = {LIGHT:g} kg it returns {100 * returned[1]:.1f} %",
        ),
        Claim(
            where="text after (1)",
            statement="this choice allows one to find the classical results when the coefficient of restitution is used",
            verdict=Verdict.FAILS
            if pair > 1e-6
            else Verdict.HOLDS
            if four < 1e-6
            else Verdict.PARTLY,
            reason=f"for a pair e is met to {pair:.1e}; with four disks the first contact's restitution is short of it by up to "
            f"{four:.3g}",
        ),
    ]
