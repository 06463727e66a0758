"""The paper's 2.3 and Fig. 6: percussions against the first-order model, the social force and
Löhner's law."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.compare.statistics import relative_difference
from analysis.dumps import DumpError
from analysis.engines import ENGINES, EngineError
from analysis.engines.run import EngineRun
from analysis.pages.section import Cell, Claim, Picture, Section, Table
from analysis.paper.discrete.fig6_rivals.claims import (
    arch_claims,
    chain_claims,
    correlation_claim,
    loehner_claims,
    mass_claim,
    surface_claim,
)
from analysis.paper.discrete.fig6_rivals.of_a_pair import (
    MASS_KG,
    RADIUS_M,
    jump_at_touch,
    laws_picture,
    laws_table,
    ratio_of_sizes,
)
from analysis.paper.discrete.fig6_rivals.on_chains import (
    ChainForces,
    chain_forces,
    chain_picture,
    chain_table,
)
from analysis.paper.discrete.fig6_rivals.on_crowds import (
    FIRST_ORDER,
    PERCUSSIONS,
    ArchForces,
    WithoutOverlap,
    arch_forces,
    arch_picture,
    arch_table,
    loehner_beyond_touch,
    without_overlap,
)
from analysis.scene.real.separate import OverlapError
from analysis.scene.scene import Scene, read_scene
from analysis.support.progress import Progress

LOEHNER_REACH_M = 2.0
CROWDS = ("arch", "arch_masses")
OVERLAP_M, RADII_M = 0.01, (0.18, 0.3)


def engine_runs(runs: Path) -> list[EngineRun]:
    """The crowds of equal and of unequal masses by the first engine that is there."""
    engine = next((known.NAME for known in ENGINES if known.find() is not None), None)
    return [EngineRun.of(read_scene(name), engine, runs) for name in CROWDS] if engine else []


def build(runs: Path, progress: Progress | None = None) -> Section:
    """The laws side by side on chains pressed to a wall and on the crowds of `arch` and
    `arch_masses`, and the verdicts.

    The crowds are the first engine's that is there; its runs are taken from `runs` where they are
    unchanged. Without an engine the section has the chains only, and a warning."""
    tell: Progress = progress or (lambda label, share: None)
    tell("rivals", 0.0)
    scene, unequal_crowd = (read_scene(name) for name in CROWDS)
    drive = scene.drive
    assert drive is not None
    time = drive.relaxation_time_s
    equal = chain_forces(read_scene("chain_wall"), time)
    unequal = chain_forces(read_scene("chain_wall_masses"), time)
    warnings = [*equal.warnings, *unequal.warnings]
    limit = MASS_KG * drive.speed_m_per_s / time
    pictures = [
        Picture(
            name="fig_6_laws",
            caption=f"Force of one pair against its gap: two disks of {RADIUS_M:g} m, f_max = m u_d/τ = {limit:g} N. "
            "A percussion "
            "is not a function of the gap: at touch it is whatever balance needs, beyond it is none.",
            figure=laws_picture(limit),
        ),
        Picture(
            name="fig_6_chain",
            caption="Normal force along a chain that walks into a wall; the first-order multiplier scaled by m̄/τ "
            "for its shape. "
            "Löhner's force is larger at the wall because that is taken as a neighbour without radius.",
            figure=chain_picture(equal, unequal),
        ),
    ]
    tables = [laws_table(limit), chain_table(equal), chain_table(unequal)]
    claims = [
        *chain_claims(equal, unequal),
        surface_claim(OVERLAP_M, RADII_M, ratio_of_sizes(OVERLAP_M, RADII_M)),
    ]
    arches = _arches((scene, unequal_crowd), runs, tell, warnings)
    claims.insert(1, mass_claim(unequal, arches))
    if len(arches) == 2:
        pictures.append(
            Picture(
                name="fig_6_arch",
                caption="The pressed crowds: distribution of the normal force, its mean against the distance from "
                "the door, and "
                "the social force (equal masses) and the first-order model (unequal masses) against the percussions.",
                figure=arch_picture(*arches),
            )
        )
        tables.append(arch_table(arches))
        tell("rivals", 0.7)
        claims += _crowd_claims(arches, _apart(arches[0], warnings), limit)
    tables.append(_misjudged(equal, unequal, arches))
    tell("rivals", 1.0)
    return Section(
        number="6",
        title="The rivals: first-order model, social force, Löhner",
        words=[
            "Each law is evaluated on the same configuration. People are driven by m u_d/τ with u_d = "
            f"{drive.speed_m_per_s:g} m/s and τ = {time:g} s; percussions of the desired velocity become forces by "
            "p/τ (N). The social force (9) has A = 2000 N, "
            "B = 0.08 m, ϱ = 1.2e5 kg/s², ς = 2.4e5 kg/(m s); Löhner's (10) has f_max = m u_d/τ of who receives, since the "
            "paper gives only its order of magnitude.",
            "The multiplier of the first-order model (4) is a velocity, not a force. It is multiplied by m̄/τ, with "
            "the mean mass m̄, to "
            "compare shapes; for equal masses this is exactly p/τ.",
            "A law of the gap alone cannot know how many people push from behind: the touching chain shows it, "
            "since its gaps are "
            "all 0 while its load grows from contact to contact. The social force knows it through overlaps and "
            "gaps, once these "
            "have settled.",
            "On the crowds, p/τ takes everybody as wanting u_d and blocked, while the engine's crowd still moves: "
            "its own contact "
            "forces, in the table for orientation, differ from p/τ for that reason too.",
        ],
        pictures=pictures,
        tables=tables,
        differs=[
            "(4) and (8) are printed as equalities; here λ ≥ 0 with complementarity, since contacts cannot pull.",
            "(9) prints a comma in “ς, g”, and Δv_ij without saying whose velocity is subtracted; here friction opposes "
            "sliding, as in the original (v_j − v_i). “No overlap” means a force of A exp((r − d)/B) ≤ A, not a "
            "constant one.",
            f"(10) lacks a direction, which the normal supplies, and jumps at touch by a factor {jump_at_touch(limit):.3f} "
            "as printed. "
            "Both readings are shown. At touch it gives f_max/5 or 2 f_max/5 for equal radii, never f_max.",
            "The paper's Fig. 6 is a picture from the social force model's authors; here all laws are applied to "
            "one crowd.",
        ],
        claims=claims,
        warnings=warnings,
    )


def _arches(
    scenes: tuple[Scene, ...], runs: Path, tell: Progress, warnings: list[str]
) -> list[ArchForces]:
    for engine in ENGINES:
        found = []
        try:
            for number, scene in enumerate(scenes):
                tell("rivals", 0.1 + 0.3 * number)
                run = EngineRun.of(scene, engine.NAME, runs)
                run.record(tell)
                found.append(arch_forces(scene, run.folder))
        except (EngineError, DumpError) as error:
            warnings.append(f"{engine.NAME}: {error}")
            continue
        warnings += [words for arch in found for words in arch.warnings]
        return found
    warnings.append("no engine made a pressed crowd: the laws are compared on chains only")
    return []


def _apart(arch: ArchForces, warnings: list[str]) -> WithoutOverlap | None:
    try:
        return without_overlap(arch)
    except OverlapError as error:
        warnings.append(f"{arch.scene.name} without overlaps: {error}")
        return None


def _crowd_claims(
    arches: list[ArchForces], apart: WithoutOverlap | None, limit: float
) -> list[Claim]:
    claims = arch_claims(arches[0], apart) if apart is not None else []
    beyond = loehner_beyond_touch(arches[1], LOEHNER_REACH_M)
    return [
        *claims,
        correlation_claim(arches[0]),
        *loehner_claims(beyond, LOEHNER_REACH_M, jump_at_touch(limit)),
    ]


def _misjudged(equal: ChainForces, unequal: ChainForces, arches: list[ArchForces]) -> Table:
    """What the first-order model makes of unequal masses."""
    rows: list[tuple[Cell, ...]] = []
    for name, chain in (("chain_wall", equal), ("chain_wall_masses", unequal)):
        a, b = (np.concatenate([[0.0], force]) for force in (chain.percussion, chain.first_order))
        rows.append(
            (
                name,
                relative_difference(a[1:], b[1:]),
                float(np.abs(b - a).max()),
                relative_difference(a[1:] + a[:-1], b[1:] + b[:-1]),
                relative_difference(np.diff(a), np.diff(b)),
                "all at rest",
                0,
            )
        )
    for arch in arches:
        law, model = arch.by_law[PERCUSSIONS], arch.by_law[FIRST_ORDER]
        rows.append(
            (
                arch.scene.name,
                relative_difference(law.contact, model.contact),
                float(np.abs(model.contact - law.contact).max()),
                relative_difference(law.carried, model.carried),
                relative_difference(law.resultant.ravel(), model.resultant.ravel()),
                arch.speed_difference,
                arch.undetermined,
            )
        )
    return Table(
        caption="First-order model (λ m̄/τ) against percussions: rms of the difference over rms of the percussions. "
        "Forces that "
        "the mechanics leaves undetermined are those of least Σλ² in both models; vector sums and velocities are unique.",
        head=(
            "scene",
            "per contact",
            "largest, per contact (N)",
            "sum of magnitudes at a disk",
            "vector sum at a disk",
            "rms of u⁺ over u_d",
            "undetermined contacts",
        ),
        rows=rows,
    )
