"""Figure 2: a push in a corridor; percussions act at a distance at once, soft contacts pass a wave
on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Claim, Picture, Section, Verdict
from analysis.paper.corridor_tables import ELASTIC, INELASTIC, differences, gap_table, soft_tables
from analysis.paper.discrete.fig2_corridor.charts import decay, impulses, network, wave
from analysis.paper.discrete.fig2_corridor.columns import gaps_of, local_contacts, soft_flux
from analysis.paper.discrete.fig2_corridor.push import (
    FRONT_FROM,
    REACHED,
    Push,
    exponent,
    first_arrivals,
    long_wave_speed,
    push_scene,
    run_push,
)
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import read_scene
from analysis.support.progress import Progress
from nscd.arrays import Flags

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


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Figure 2 remade: the network of percussions, how far the push goes, and the wave that soft
    contacts make of it.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning.
    """
    scene = read_scene("corridor")
    snapshot = scene.snapshot
    found = percussions_of(scene, snapshot, tolerance=1e-10)
    contacts, answer = found.contacts, found.answer
    warnings = (
        [] if answer.status == "solved" else [f"percussions: {answer.status}: {answer.reason}"]
    )
    local = local_contacts(scene, contacts)
    gaps = gaps_of(scene, contacts, answer)
    pushes = _pushes(runs, warnings, progress)
    inelastic = [p for p in pushes if p.restitution == INELASTIC]
    waves = [p for p in pushes if p.restitution in (INELASTIC, ELASTIC)]
    damped = sorted(
        (
            p
            for p in pushes
            if p.engine == "lammps" and p.stiffness == DAMPED_STIFFNESS and p.restitution < 1
        ),
        key=lambda p: -p.restitution,
    )
    size = np.hypot(*answer.impulse.T)
    carries = size > CARRIES * size.max()
    far = size[~local].sum() / size.sum()
    distance = snapshot.position[:, 0] - snapshot.position[:, 0].min()
    reach = float(distance[contacts.first[carries]].max())
    resting = np.hypot(*snapshot.velocity.T) == 0
    moved = resting & (np.hypot(*answer.right_velocity.T) > 1e-6)
    words = [
        f"{int((~resting).sum())} people push {int(resting.sum())} at rest; {len(contacts)} contacts, "
        f"{int(contacts.is_wall.sum())} of them with the walls. {int((carries & local).sum())} local contacts (a pushing disk "
        f"takes part) and {int((carries & ~local).sum())} non-local ones carry a percussion; the non-local ones have "
        f"{100 * far:.0f} % of the sum of magnitudes.",
        f"The push reaches the end: the furthest disk with a percussion stands {reach:.2f} m away, in the last column at "
        f"{distance.max():.2f} m. {int(moved.sum())} of the {int(resting.sum())} move afterwards. Momentum along x falls from "
        f"{gaps.flux[0]:.0f} N·s behind the pushing column to {gaps.flux[-1]:.1f} N·s before the last one, nearly linearly "
        f"(correlation with the distance {np.corrcoef(gaps.distance, gaps.flux)[0, 1]:.4f}); (5), (6) for columns that move as "
        f"one give {gaps.columns[0]:.0f} to {gaps.columns[-1]:.1f} N·s, less since the pushing column rebounds from them.",
        *_wave_words(waves),
        *_limit_words(inelastic, damped),
    ]
    pictures = [
        Picture(
            name="fig_2_network",
            caption="The corridor before (pushing disks hatched), the percussions at its contacts, and the velocities after.",
            figure=network(scene, contacts, answer, local),
        ),
        Picture(
            name="fig_2_decay",
            caption="How the push decays with distance: momentum passed from column to column, and the largest percussion.",
            figure=decay(
                gaps.distance,
                gaps.flux,
                gaps.columns,
                gaps.largest,
                [
                    (f"LAMMPS, ζ = {p.comparison.record.damping_ratio:.2g}", soft_flux(p))
                    for p in damped[1::2]
                ],
            ),
        ),
    ]
    if waves:
        closed = [
            long_wave_speed(scene.with_contact(stiffness_N_per_m=k), contacts)
            for k in sorted({p.stiffness for p in waves})
        ]
        pictures.append(
            Picture(
                name="fig_2_wave",
                caption=f"The push as a wave of soft contacts: when a disk of each column first has {100 * REACHED:g} % of the "
                f"pushing speed, and the speed of that front beyond column {FRONT_FROM}.",
                figure=wave(waves, np.array(closed)),
            )
        )
    if inelastic and damped:
        pictures.append(
            Picture(
                name="fig_2_impulses",
                caption="Impulses of soft contacts against percussions: contact by contact, with rising stiffness at one "
                "restitution, and with rising damping at one stiffness.",
                figure=impulses(
                    inelastic, damped, [differences(inelastic, "k"), differences(damped, "ζ")]
                ),
            )
        )
    return Section(
        number="2",
        title="Push in a corridor",
        words=words,
        pictures=pictures,
        tables=[gap_table(gaps), *soft_tables(pushes, waves, scene, contacts)],
        differs=[
            "The paper gives no positions and no numbers for Fig. 2: the arrangement of its 56 disks is ours.",
            "The percussions of a rigid crowd have no wave: all arrive at the instant of the impact. Soft contacts have one.",
            "Fig. 2c draws the interactions; here they have numbers.",
        ],
        claims=_claims(
            int((carries & ~local).sum()), reach, float(distance.max()), moved, resting, waves
        ),
        warnings=warnings,
    )


def engine_runs(runs: Path) -> list[EngineRun]:
    """The push as soft contacts: elastic and inelastic at each stiffness by both engines, and with
    more damping."""
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


def _pushes(runs: Path, warnings: list[str], progress: Progress | None) -> list[Push]:
    pushes = []
    for run in engine_runs(runs):
        try:
            pushes.append(run_push(run, progress))
        except EngineError as error:
            warnings.append(f"{run.scene.name}, {run.engine}: {error}")
    return pushes


def _wave_words(waves: list[Push]) -> list[str]:
    words = []
    for restitution in (INELASTIC, ELASTIC):
        mine = [p for p in waves if p.restitution == restitution]
        chosen = [p for p in mine if p.engine == mine[0].engine]
        if len(chosen) < 2:
            continue
        power = exponent(
            np.array([p.stiffness for p in chosen]), np.array([p.speed for p in chosen])
        )
        last = [
            first_arrivals(p.comparison.snapshot.position[:, 0], p.arrival)[1][-1] for p in chosen
        ]
        words.append(
            f"Soft contacts with e = {restitution:g} and k = {', '.join(f'{p.stiffness:.0e}' for p in chosen)} N/m "
            f"({ENGINE_NAMES[chosen[0].engine]}) pass the push on as a wave: its front runs at "
            f"{', '.join(f'{p.speed:.4g}' for p in chosen)} m/s, in proportion to k^{power:.3f}, and reaches the last column "
            f"after {', '.join(f'{1e3 * t:.4g}' for t in last)} ms. The rigid answer reaches it at once."
        )
    apart = [
        abs(a.speed / b.speed - 1)
        for a in waves
        for b in waves
        if a.engine < b.engine and (a.stiffness, a.restitution) == (b.stiffness, b.restitution)
    ]
    if apart:
        words.append(
            f"The speeds of the two engines differ by {max(apart):.0e} of themselves at most."
        )
    return words


def _limit_words(inelastic: list[Push], damped: list[Push]) -> list[str]:
    """What stiffness and damping make of the difference between ∫f dt and p."""
    words = []
    for pushes, against, unit in ((inelastic, "k", " N/m"), (damped, "ζ", "")):
        chosen = [p for p in pushes if p.engine == pushes[0].engine]
        if len(chosen) < 2:
            continue
        steps = [
            f"{100 * share:.1f} % at {against} = {value:.3g}{unit}"
            for value, share in differences(chosen, against)
        ]
        fixed = (
            f"e = {chosen[0].restitution:g}"
            if against == "k"
            else f"k = {chosen[0].stiffness:.0e} N/m"
        )
        words.append(
            f"With rising {'stiffness' if against == 'k' else 'damping'} ({ENGINE_NAMES[chosen[0].engine]}, {fixed}) the "
            f"impulses ∫f dt differ from the percussions by (rms) {', '.join(steps)}."
        )
    if (
        len(words) == 2
        and differences(damped, "ζ")[-1, 1] < 0.5 * differences(inelastic, "k")[-1, 1]
    ):
        words.append(
            "The percussions with k = 0 are the limit of strong damping rather than of great stiffness."
        )
    return words


def _claims(
    non_local: int,
    reach: float,
    length: float,
    moved: Flags,
    resting: Flags,
    waves: list[Push],
) -> list[Claim]:
    claims = [
        Claim(
            where="2.1, Fig. 2c",
            statement="it takes into account the corresponding local and non-local (at a distance) interactions",
            verdict=Verdict.HOLDS if non_local > 0 and reach >= length - 1e-9 else Verdict.FAILS,
            reason=f"{non_local} contacts without a pushing disk carry a percussion, as far as {reach:.2f} m of {length:.2f} m",
        ),
        Claim(
            where="Fig. 2",
            statement="the displacement of 53 pedestrians after being pushed by three",
            verdict=Verdict.HOLDS
            if moved[resting].all()
            else Verdict.PARTLY
            if moved.any()
            else Verdict.FAILS,
            reason=f"{int(moved.sum())} of {int(resting.sum())} have a right velocity in our arrangement",
        ),
    ]
    powers = [
        exponent(np.array([p.stiffness for p in chosen]), np.array([p.speed for p in chosen]))
        for kind in sorted({(p.engine, p.restitution) for p in waves})
        for chosen in [[p for p in waves if (p.engine, p.restitution) == kind]]
    ]
    known = [power for power in powers if np.isfinite(power)]
    if known:
        wave_grows = min(known) > 0.1
        claims.append(
            Claim(
                where="2.2",
                statement="the effect of the shock wave is responsible for the non-local interaction",
                verdict=Verdict.PARTLY if wave_grows else Verdict.HOLDS,
                reason="a rigid crowd interacts at a distance without any wave, at one instant; in soft crowds a wave does it, "
                f"whose speed grows like k^{min(known):.3f} to k^{max(known):.3f}; the instant is its limit",
            )
        )
    return claims
