"""The paper's 2.3 and Fig. 6: percussions against first-order model, social force and Löhner's
law."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from analysis.compare.statistics import relative_difference
from analysis.dumps import DumpError
from analysis.engines import PENALTY, EngineError
from analysis.engines.run import EngineRun
from analysis.pages.section import Cell, Claim, Section, Table
from analysis.pages.words import Words
from analysis.paper.discrete.engine_runs import installed_engine
from analysis.paper.discrete.fig6_rivals import charts, claims, evacuation
from analysis.paper.discrete.fig6_rivals.chains import ChainForces, chain_forces, chain_rows
from analysis.paper.discrete.fig6_rivals.congestion import Congestion
from analysis.paper.discrete.fig6_rivals.crowds import (
    FIRST_ORDER,
    PERCUSSIONS,
    ArchForces,
    WithoutOverlap,
    arch_forces,
    arch_rows,
    loehner_beyond_touch,
    without_overlap,
)
from analysis.paper.discrete.fig6_rivals.evacuation import Evacuation, evacuations
from analysis.paper.discrete.fig6_rivals.pair import (
    MASS_KG,
    RADIUS_M,
    jump_at_touch,
    pair_rows,
    ratio_of_sizes,
)
from analysis.paper.discrete.pressed_crowd import blocked, blocked_runs
from analysis.scene.real.separate import OverlapError
from analysis.scene.scene import Scene, read_scene
from analysis.support.progress import Progress
from nscd.arrays import Floats

Pair = tuple[Floats, Floats]
LOEHNER_REACH_M = 2.0
CROWDS, CHAINS = ("arch", "arch_masses"), ("chain_wall", "chain_wall_masses")
OVERLAP_M, RADII_M = 0.01, (0.18, 0.3)


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the crowds of equal and of unequal masses by the first engine that is there."""
    engine = installed_engine()
    if engine is None:
        return []
    return [*(EngineRun.of(read_scene(name), engine, runs) for name in CROWDS), *blocked_runs(runs)]


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build the section: the laws side by side on chains pressed to a wall and on the crowds of
    `arch` and `arch_masses`, and the verdicts.

    The crowds are the first engine's that is there; its runs are taken from `runs` where they are
    unchanged. Without an engine the section has the chains only, and a warning."""
    tell: Progress = progress or (lambda label, share: None)
    tell("rivals", 0.0)
    scenes = [read_scene(name) for name in CROWDS]
    drive = scenes[0].drive
    assert drive is not None
    equal, unequal = (chain_forces(read_scene(name), drive.relaxation_time_s) for name in CHAINS)
    warnings = [*equal.warnings, *unequal.warnings]
    limit = MASS_KG * drive.speed_m_per_s / drive.relaxation_time_s
    jump = jump_at_touch(limit)
    words = Words(
        __package__, drive=drive, limit=limit, radius=RADIUS_M, jump=jump, evacuation=evacuation
    )
    arches = _arches(scenes, runs, tell, warnings)
    pictures = [
        words.picture("fig_6_laws", charts.laws(limit)),
        words.picture("fig_6_chain", charts.chains(equal, unequal)),
    ]
    tables = [
        words.table("table_pair", pair_rows(limit)),
        *(words.table("table_chain", chain_rows(chain), chain=chain) for chain in (equal, unequal)),
    ]
    judged = [
        claims.special_case(words, equal, unequal),
        claims.restrictive_mass(words, unequal, arches),
        claims.constant_in_a_chain(words, equal, unequal),
        claims.surface(words, OVERLAP_M, RADII_M, ratio_of_sizes(OVERLAP_M, RADII_M)),
    ]
    if len(arches) == 2:
        pictures.append(words.picture("fig_6_arch", charts.arches(*arches)))
        tables.append(words.table("table_arch", arch_rows(arches)))
        tell("rivals", 0.7)
        crowds = blocked(runs, warnings, tell)
        if stopped := [Congestion.of(crowd) for crowd in crowds if crowd.still]:
            tables.append(words.table("table_congestion", _congestion_rows(stopped)))
            judged.insert(2, claims.complete_congestion(words, stopped))
        judged += _crowd_claims(words, arches, _apart(arches[0], warnings), jump)
    evacuated = evacuations(tell)
    pictures.append(words.picture("fig_6_evacuation", charts.evacuations(evacuated)))
    tables.append(words.table("table_evacuation", _evacuation_rows(evacuated)))
    judged.append(claims.no_overlap(words, evacuated))
    tables.append(_misjudged(words, (equal, unequal), arches))
    tell("rivals", 1.0)
    return words.section("6", pictures=pictures, tables=tables, claims=judged, warnings=warnings)


def _arches(
    scenes: Sequence[Scene], runs: Path, tell: Progress, warnings: list[str]
) -> list[ArchForces]:
    for engine in PENALTY:
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
    words: Words, arches: list[ArchForces], apart: WithoutOverlap | None, jump: float
) -> list[Claim]:
    equal, unequal = arches
    found = []
    if apart is not None:
        found.append(claims.constant_without_overlap(words, equal, apart))
    beyond = loehner_beyond_touch(unequal, LOEHNER_REACH_M)
    return [
        *found,
        claims.unrealistic(words, equal),
        claims.non_zero_apart(words, beyond, LOEHNER_REACH_M, jump),
    ]


def _misjudged(words: Words, chains: Sequence[ChainForces], arches: Sequence[ArchForces]) -> Table:
    """Tabulate what the first-order model makes of unequal masses."""
    rows: list[Sequence[Cell]] = []
    for name, chain in zip(CHAINS, chains, strict=True):
        a, b = (np.concatenate([[0.0], force]) for force in (chain.percussion, chain.first_order))
        contact, carried = (a[1:], b[1:]), (a[1:] + a[:-1], b[1:] + b[:-1])
        rows.append(
            (name, *_differences(contact, carried, (np.diff(a), np.diff(b))), "all at rest", 0)
        )
    for arch in arches:
        law, model = arch.by_law[PERCUSSIONS], arch.by_law[FIRST_ORDER]
        differences = _differences(
            (law.contact, model.contact),
            (law.carried, model.carried),
            (law.resultant.ravel(), model.resultant.ravel()),
        )
        rows.append((arch.scene.name, *differences, arch.speed_difference, arch.undetermined))
    return words.table("table_misjudged", rows)


def _congestion_rows(found: Sequence[Congestion]) -> list[tuple[float, ...]]:
    return [
        (one.seed, one.stiffness, one.first_order, one.equal, max(one.unequal), one.freed)
        for one in found
    ]


def _evacuation_rows(evacuated: Sequence[Evacuation]) -> list[tuple[float, ...]]:
    rows = []
    for one in evacuated:
        deepest, forces = 1e3 * one.deepest, one.forces
        sizes = np.mean(deepest > 0), np.median(deepest), deepest.max()
        force = forces.max() if len(forces) else float("nan")
        contacts = len(forces) / len(one.looks)
        rows.append((one.speed, one.seed, one.left, contacts, *map(float, sizes), float(force)))
    return rows


def _differences(contact: Pair, carried: Pair, resultant: Pair) -> tuple[float, ...]:
    """Relative difference and largest difference per contact, relative differences at the disks."""
    return (
        relative_difference(*contact),
        float(np.abs(contact[1] - contact[0]).max()),
        relative_difference(*carried),
        relative_difference(*resultant),
    )
