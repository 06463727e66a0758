"""A scene's runs, each compared with its percussions, and what a reader should be told."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from analysis.compare.comparison import Comparison, at_rest, begun_anew, compare_run, folder_of
from analysis.dumps import DumpError, NoContactError
from analysis.dumps.contacts import FRAMES_NEEDED_FROM
from analysis.engines.guard import RunStoppedError
from analysis.engines.record import EngineError
from analysis.engines.rigid import NAME as RIGID
from analysis.engines.run import run_engine, run_folder
from analysis.scene.scene import Scene
from analysis.support.parallel import Progress
from nscd import ContactLaw

# Overlap over mean radius that a twentieth of the contacts may exceed: at 0.03 the loads of people
# in a snapshot of `arch` already differ by a third from its percussions.
DEEP = 0.03
# Restitutions that differ by less are the same to a reader.
ALIKE = 0.01


def remarks(comparison: Comparison) -> Iterator[str]:
    """Say where the two models are not alike, and which numbers are not sharp."""
    record, law, determined = comparison.record, comparison.law, comparison.match.determined
    contact, impact = comparison.scene.contact, comparison.percussions.window is None
    deep, error = deep_overlap(comparison), comparison.balance.closure_error
    rigid, requested = law.restitution or 0.0, contact.restitution
    minimum, maximum = record.restitution_least, record.restitution_most
    if record.engine == RIGID:
        yield (
            "a rigid contact has no force at an instant: the engine's forces are means since the "
            "frame before, not like with like. Compare two runs by windows"
        )
    if contact.friction != law.friction:
        yield (
            f"the engine's contacts have friction {contact.friction:g}, the percussions "
            f"{law.friction:g}: the difference of the laws is in every number"
        )
    elif law.frictional:
        yield (
            f"both models have friction {law.friction:g}: the balance leaves forces open where "
            f"contacts stick, {int(determined.sum())} of {len(determined)} are determined"
        )
    if not impact and deep > DEEP:
        yield (
            "this snapshot is too soft to compare contact by contact: one overlap in twenty is "
            f"above {deep:.2g} of the mean radius (at most {DEEP:g}). Windows stay usable: "
            "percussions compare RUN RIGID_RUN --window 0.1"
        )
    if impact and abs(requested - rigid) > ALIKE:
        yield (
            f"the engine's contacts have restitution {requested:g}, the percussions "
            f"{rigid:g}: the difference of the laws is in every number"
        )
    if impact and max(abs(requested - minimum), abs(requested - maximum)) > ALIKE:
        yield (
            f"restitution {requested:g} was asked. The engine's contacts have "
            f"{minimum:.3g} to {maximum:.3g}, since one dashpot serves all masses"
        )
    if impact and math.isfinite(error) and error > FRAMES_NEEDED_FROM:
        yield (
            f"the impulses ∫f dt miss the momentum that disks gain by up to {error:.1%}. About "
            f"{comparison.balance.frames_needed} frames (run.frames) would make it "
            f"{FRAMES_NEEDED_FROM:.0%}"
        )


def deep_overlap(comparison: Comparison) -> float:
    """Return the overlap, over the mean radius, that one in twenty of the engine's contacts
    exceeds."""
    overlap = -comparison.match.contacts.gap[comparison.match.in_penalty]
    pressed = overlap[overlap > 0]
    radius = float(comparison.snapshot.radius.mean())
    return float(np.quantile(pressed, 0.95)) / radius if len(pressed) else 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """The comparisons of one scene, in order of engine and stiffness; the runs that their guard
    stopped or that failed; and what else a reader should know.

    anew: engines whose stiffer runs began where the softest one had come to rest, and came to rest
        again"""

    scene: Scene
    comparisons: list[Comparison]
    failures: list[str]
    warnings: list[str]
    anew: frozenset[str] = frozenset()


def study(
    scene: Scene,
    engines: Sequence[str] | Mapping[str, Scene],
    stiffnesses: Sequence[float],
    out: Path,
    progress: Progress | None = None,
    law: ContactLaw | None = None,
) -> Study:
    """Run and compare. A run that is stopped or fails, or whose dumps are damaged, becomes a
    failure, a missing engine a warning; the rest goes on.

    With four stiffnesses or more a trend is asked for. Then, where the softest run of an engine
    comes to rest, the stiffer ones begin from its last snapshot, so that all have one
    configuration.

    engines: their names, or the scene that each runs
    law: of the rigid contacts; the scene's where left out

    Raises EngineError if no run was even tried."""
    comparisons: list[Comparison] = []
    failures: list[str] = []
    empty: list[str] = []
    warnings = scene.check(scene.name)
    begin: dict[str, Scene] = {}
    for name, stiffness in product(engines, sorted(stiffnesses)):
        own = engines[name] if isinstance(engines, Mapping) else scene
        variant = begin.get(name, own).with_contact(stiffness_N_per_m=stiffness)
        folder = run_folder(out, variant, name)
        if name in begin:
            folder = folder_of(folder)
        try:
            run_engine(variant, name, folder, progress)
            comparisons.append(compare_run(folder, law=law))
        except EngineError as error:
            words = f"{name}, k = {stiffness:.3g} N/m: {error}"
            (failures if isinstance(error, RunStoppedError) else warnings).append(words)
            continue
        except DumpError as error:
            words = f"{name}, k = {stiffness:.3g} N/m: {error}. "
            if isinstance(error, NoContactError):
                empty.append(f"{words}Nothing to compare")
            else:
                failures.append(f"{words}Remove {folder} to run it again")
            continue
        softest = stiffness == min(stiffnesses)
        if softest and (anew := begun_anew(own, comparisons[-1], len(stiffnesses))):
            begin[name] = anew
    if not (comparisons or failures or empty):
        raise EngineError(f"scene {scene.name}: no engine ran: " + "; ".join(warnings))
    return Study(
        scene=scene,
        comparisons=comparisons,
        failures=failures,
        warnings=list(dict.fromkeys([*warnings, *empty, *_said_of(comparisons)])),
        anew=frozenset(begin) - {c.record.engine for c in comparisons if not at_rest(c)},
    )


def _said_of(comparisons: Sequence[Comparison]) -> Iterator[str]:
    """What a reader should know of each run and its percussions."""
    for comparison in comparisons:
        engine, solution = comparison.record.engine, comparison.solution
        if solution.status != "solved":
            yield f"percussions of {engine}'s snapshot: {solution.status}: {solution.reason}"
        for words in (*remarks(comparison), *solution.warnings):
            yield f"{engine}: {words}"
