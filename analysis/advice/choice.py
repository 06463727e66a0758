"""The choice: of all settings whose promised error is within what is asked, the cheapest."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from analysis.advice.candidates import Candidate, Known, window_of
from analysis.advice.error_curves import Curves
from analysis.advice.library import Entry, Library
from analysis.advice.likeness import Likeness, likeness_of
from analysis.advice.question import Question
from analysis.scene.scene import Scene
from analysis.work_precision.point import WORTH, Point

# So little more is paid for a smaller error: less than the cost of a run varies from one to the
# next.
MARGIN = 0.1
# The next better choice is one with an error smaller by this factor.
BETTER = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Advice:
    """What was asked and what is advised.

    choice: None where nothing reaches the asked error.
    better: the cheapest with half the choice's error or less; None where there is none.
    best: the smallest error promised, whatever it costs; None where nothing is known.
    found: all candidates.
    curve: the candidates that no cheaper one beats, from cheap to accurate.
    by_method: the cheapest of each method that reaches the asked error.
    read: which scenes it was read from, with their weights.
    own: whether it was read from a chart of this very scene.
    tried: whether the errors of engines are those of the scene itself, stepped through here."""

    scene: Scene
    likeness: Likeness
    question: Question
    choice: Candidate | None
    better: Candidate | None
    best: Candidate | None
    found: tuple[Candidate, ...]
    curve: tuple[Candidate, ...]
    by_method: tuple[Candidate, ...]
    read: tuple[tuple[str, float], ...]
    own: bool
    tried: bool


def advise(
    scene: Scene, question: Question, *, library: Library, chart: Sequence[Point] | None = None
) -> Advice:
    """Choose the cheapest method that promises what is asked of a scene's window.

    The errors of engines in an impact are found by stepping through it (see `Pilot`), those of the
    rest are read from the library; a chart of the scene is read instead of both, without safety
    factors. Raises ValueError as `likeness_of`, for a quantity that is unknown or that the scene
    cannot have, one that nothing like the scene has, and a chart of another scene."""
    question.check(scene)
    likeness = likeness_of(scene)
    entries: Sequence[Entry] = library.entries
    if chart is not None:
        entries = [entry_of_chart(scene, likeness, chart)]
    curves = Curves(likeness=likeness, load=question.load, entries=entries)
    rates = None if chart is not None else library.rates
    known = Known(scene=scene, question=question, curves=curves, rates=rates, entries=entries)
    found = list(known.candidates())
    within = [c for c in found if c.promised_error <= question.error]
    choice, better = _cheapest(within), None
    if choice is not None:
        least = BETTER * choice.promised_error
        better = _cheapest(c for c in found if c.promised_error <= least)
    by_method = (_cheapest(c for c in within if c.method == m) for m in question.methods)
    return Advice(
        scene=scene,
        likeness=likeness,
        question=question,
        choice=choice,
        better=better,
        best=min(found, key=lambda c: (c.promised_error, c.cpu_seconds), default=None),
        found=tuple(found),
        curve=tuple(_front(found)),
        by_method=tuple(best for best in by_method if best is not None),
        read=tuple((entry.name, weight) for entry, weight in curves.read),
        own=chart is not None,
        tried=known.pilot is not None and any(c.law for c in found),
    )


def entry_of_chart(scene: Scene, likeness: Likeness, points: Sequence[Point]) -> Entry:
    """Make an entry of the points of a chart of the scene. Raises ValueError where they are of
    another scene."""
    ours = tuple(p for p in points if p.scene == scene.name)
    base = scene.contact.stiffness_N_per_m
    if not any(p.stiffness_N_per_m == base for p in ours):
        others = ", ".join(sorted({p.scene for p in points}))
        raise ValueError(
            f"chart: no points of scene {scene.name} with its stiffness of {base:g} N/m; "
            f"it is of: {others}"
        )
    return Entry(
        name=scene.name,
        likeness=likeness,
        stiffness_N_per_m=base,
        window_s=window_of(scene),
        points=ours,
    )


def _cheapest(candidates: Iterable[Candidate]) -> Candidate | None:
    """The cheapest, or one that costs at most MARGIN more and promises a smaller error."""
    known = list(candidates)
    if not known:
        return None
    least = min(c.cpu_seconds for c in known)
    return min(
        (c for c in known if c.cpu_seconds <= (1 + MARGIN) * least),
        key=lambda c: (c.promised_error, c.cpu_seconds),
    )


def _front(candidates: Iterable[Candidate]) -> Iterator[Candidate]:
    least = float("inf")
    for candidate in sorted(candidates, key=lambda c: (c.cpu_seconds, c.promised_error)):
        if candidate.promised_error < (1 - WORTH) * least:
            least = candidate.promised_error
            yield candidate
