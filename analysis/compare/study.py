"""A study: one scene run by several engines at several stiffnesses, each run compared with its
percussions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.compare.comparison import Comparison, compare_run
from analysis.compare.relaxed import at_rest, begun_anew, folder_of
from analysis.compare.remarks import remarks
from analysis.dumps import DumpError
from analysis.engines.guard import RunStoppedError
from analysis.engines.record import EngineError
from analysis.engines.run import run_engine, run_folder
from analysis.scene.scene import Scene
from analysis.support.progress import Progress
from nscd import ContactLaw


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """The comparisons of one scene, in order of engine and stiffness; the runs that their guard
    stopped or that failed; and what else a reader should know.

    anew: engines whose stiffer runs began where the softest one had come to rest, and came to rest
        again
    """

    scene: Scene
    comparisons: list[Comparison]
    failures: list[str]
    warnings: list[str]
    anew: frozenset[str] = frozenset()


def study(
    scene: Scene,
    engines: Sequence[str],
    stiffnesses: Sequence[float],
    out: Path,
    progress: Progress | None = None,
    law: ContactLaw | None = None,
    *,
    further: Sequence[float] | None = None,
) -> Study:
    """Run and compare. A run that is stopped or fails, or whose dumps are damaged, becomes a
    failure, a missing engine a warning; the rest goes on.

    With four stiffnesses or more a trend is asked for. Then, where the softest run of an engine
    comes to rest, the stiffer ones begin from its last snapshot, so that all have one
    configuration.

    law: of the rigid contacts; the scene's where left out
    further: N/m, stiffnesses of the engines after the first; the same where left out

    Raises EngineError if no run was even tried.
    """
    comparisons: list[Comparison] = []
    failures: list[str] = []
    warnings = scene.check(scene.name)
    begin: dict[str, Scene] = {}
    models = soft_models(engines, stiffnesses, further)
    for name, stiffness in models:
        variant = begin.get(name, scene).with_contact(stiffness_N_per_m=stiffness)
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
            failures.append(
                f"{name}, k = {stiffness:.3g} N/m: {error}; remove {folder} to run it again"
            )
            continue
        mine = [k for engine, k in models if engine == name]
        if stiffness == min(mine) and (anew := begun_anew(scene, comparisons[-1], len(mine))):
            begin[name] = anew
    if not comparisons and not failures:
        raise EngineError(f"scene {scene.name}: no engine ran: " + "; ".join(warnings))
    for sentence in _said_of(comparisons):
        if sentence not in warnings:
            warnings.append(sentence)
    return Study(
        scene=scene,
        comparisons=comparisons,
        failures=failures,
        warnings=warnings,
        anew=frozenset(begin) - {c.record.engine for c in comparisons if not at_rest(c)},
    )


def _said_of(comparisons: Sequence[Comparison]) -> Iterator[str]:
    """What a reader should know of each run and its percussions."""
    for comparison in comparisons:
        engine, answer = comparison.record.engine, comparison.answer
        if answer.status != "solved":
            yield f"percussions of {engine}'s snapshot: {answer.status}: {answer.reason}"
        for words in (*remarks(comparison), *answer.warnings):
            yield f"{engine}: {words}"


def soft_models(
    engines: Sequence[str], stiffnesses: Sequence[float], further: Sequence[float] | None = None
) -> list[tuple[str, float]]:
    """List the engines with the stiffnesses (N/m) that each runs at, softest first."""
    rest = stiffnesses if further is None else further
    return [
        (name, k) for name in engines for k in sorted(stiffnesses if name == engines[0] else rest)
    ]
