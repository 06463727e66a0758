"""The choice: of all settings whose promised error is within what is asked, the cheapest."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from analysis.advice.candidates import Candidate, Known
from analysis.advice.error_curves import Curves
from analysis.advice.library import Entry, Library
from analysis.advice.likeness import Likeness, check_model, likeness_of
from analysis.advice.pilot import tried
from analysis.advice.question import Question
from analysis.advice.safety import TRIED, Safety, safety_of
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
    tried: whether this very scene was tried here: an impact (see `tried`).
    measured: machine and date of what was read, and of what prices were fitted to."""

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
    measured: tuple[str, ...]


def advise(
    scene: Scene, question: Question, *, library: Library, chart: Sequence[Point] | None = None
) -> Advice:
    """Choose the cheapest method that promises what is asked of a scene's window.

    An impact is tried here (see `tried`), of a driven crowd the library is read; a chart of the
    scene is read instead of both, without safety factors. Raises ValueError as `likeness_of`, for a
    quantity that is unknown or that the scene cannot have, and a chart of another scene."""
    check_model(scene)
    question.check(scene)
    known = _known(scene, question, library, chart)
    found = list(known.candidates())
    read = {entry.name: weight for entry, weight in known.curves.read}
    sources = [entry for entry, _ in known.curves.read]
    if any(c.law for c in found):
        sources += known.priced
    within = [c for c in found if c.promised_error <= question.error]
    choice, better = _cheapest(within), None
    if choice is not None:
        least = BETTER * choice.promised_error
        better = _cheapest(c for c in found if c.promised_error <= least)
    by_method = (_cheapest(c for c in within if c.method == m) for m in question.methods)
    return Advice(
        scene=scene,
        likeness=known.curves.likeness,
        question=question,
        choice=choice,
        better=better,
        best=min(found, key=lambda c: (c.promised_error, c.cpu_seconds), default=None),
        found=tuple(found),
        curve=tuple(_front(found)),
        by_method=tuple(best for best in by_method if best is not None),
        read=tuple(read.items()),
        own=chart is not None,
        tried=chart is None and scene.drive is None and bool(read),
        measured=tuple(sorted({f"{p.machine}, {p.date}" for e in sources for p in e.points})),
    )


def _known(
    scene: Scene, question: Question, library: Library, chart: Sequence[Point] | None
) -> Known:
    """What a chart of the scene says, what is found by trying it, or what the library does."""
    priced, safety, entries = library.entries, Safety(), library.entries
    if chart is not None:
        _check_points(scene, chart)
        priced = entries = (Entry.of(scene, chart),)
    elif scene.drive is None:
        entries, safety = (Entry.of(scene, tried(scene, question)),), TRIED
    curves = Curves(likeness=likeness_of(scene), load=question.load, entries=entries)
    if entries is library.entries:
        safety = safety_of(library.rates, curves)
    return Known(scene=scene, question=question, curves=curves, safety=safety, priced=priced)


def _check_points(scene: Scene, points: Sequence[Point]) -> None:
    base = scene.contact.stiffness_N_per_m
    if not any(p.scene == scene.name and p.stiffness_N_per_m == base for p in points):
        others = ", ".join(sorted({p.scene for p in points}))
        raise ValueError(
            f"chart: no points of scene {scene.name} with its stiffness of {base:g} N/m; "
            f"it is of: {others}"
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
