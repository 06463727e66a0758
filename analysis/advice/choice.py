"""The choice among candidates, tried by pilot runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.advice.candidates import TRIED, Candidate, Known, Question, Safety, safety_of
from analysis.advice.library import Curves, Entry, Library, Likeness, check_model, likeness_of
from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from analysis.work_precision.point import WORTH, Point, PointStatus
from analysis.work_precision.points_of import Answer, Converged, Judge
from analysis.work_precision.rigid_reference import rigid_reference
from analysis.work_precision.rigid_solves import solve_rigid
from analysis.work_precision.soft_reference import ReferenceError, leapfrog, soft_reference
from analysis.work_precision.soft_runs import LAWS, SoftSetting, scene_of
from analysis.work_precision.window import impact_window
from nscd import ContactLaw

# Shares of the safe time step that are stepped through.
SHARES = (1 / 16, 1 / 4, 1.0, 4.0)
# Each with these lengths, as shares of it: which contacts let go between two steps depends on the
# length, and an engine shortens its steps to meet frames.
NEARBY = (1.0, 0.98, 0.93)
# An error that is promised to be smaller than this would be one of rounding, here or in a dump.
ROUNDING = 1e-9
NEARLY_ELASTIC = 1 - 1e-6
# A larger impact (disks, disks times safe time steps) would take longer to try than advice may.
MOST_DISKS, MOST_WORK = 600, 5e6


def tried(scene: Scene, question: Question) -> list[Point]:
    """Compute the points of an impact for a question's methods: the rigid model by each solver, and
    engines at SHARES of the safe time step with the scene's stiffness, their CPU seconds left out.

    Error bars are added to the errors. Raises ValueError as `Window.check`. Nothing is found for an
    impact too large to try, and of engines nothing where they have too many steps, or no
    reference."""
    snapshot, window = scene.snapshot, impact_window(scene)
    if len(snapshot) > MOST_DISKS:
        return []
    window.check()
    # errors are shares of the rigid model's percussions: of e = 1, which it has not, of e → 1
    elastic = question.against == "model" and scene.contact.restitution == 1
    bouncing = ContactLaw(restitution=NEARLY_ELASTIC) if elastic else window.law
    rigid = rigid_reference(snapshot, window.contacts, window.left_velocity, bouncing)
    judge = Judge(window=window, name=scene.name, rigid=rigid)
    found: list[Point] = []
    if "rigid" in question.methods and question.against == "rigid":
        found += [point for answer in solve_rigid(window) for point in judge.points(answer)]
    for law in LAWS["lammps"]:
        if engines := [m for m in question.methods if law in question.laws(m, scene)]:
            found += _stepped(judge, law, engines)
    return [_with_bars(point) for point in found]


def _stepped(judge: Judge, law: str, engines: Iterable[str]) -> Iterator[Point]:
    window = judge.window
    scene = window.scene.with_contact(law=law)
    steps = scene.run.duration_s / penalty_of(scene).safe_time_step
    if len(scene.snapshot) * steps > MOST_WORK:
        return
    stiffness = scene.contact.stiffness_N_per_m
    try:
        reference = soft_reference(window.variant(law, stiffness))
    except ReferenceError:
        return
    own, looser = (window.quantities(m, stiffness) for m in (reference.motion, reference.looser))
    model = Converged(own=own, looser=looser, wrong="the time step is too long: wrong")
    for share in SHARES:
        near: list[list[Point]] = []
        for times in NEARBY:
            setting = SoftSetting(
                engine="", law=law, stiffness_N_per_m=stiffness, share=times * share
            )
            with np.errstate(all="ignore"):
                values = window.quantities(leapfrog(scene_of(window, setting)), stiffness)
            answers = (
                Answer(
                    method=engine,
                    law=law,
                    time_step_share=share,
                    stiffness_N_per_m=stiffness,
                    cpu_seconds=None,
                    values=values,
                )
                for engine in engines
            )
            with np.errstate(all="ignore"):
                near.append([point for one in answers for point in judge.points(one, model)])
        yield from map(_cautious, *near)


def _cautious(*near: Point) -> Point:
    """One point of those of a setting: one that did not end well, or the one with the largest
    error, whose bar grows by how far the errors are apart."""
    for point in near:
        if point.status != PointStatus.OK or point.numerical_error is None:
            return point
    errors = [point.numerical_error or 0.0 for point in near]
    worst = near[int(np.argmax(errors))]
    spread = max(errors) - min(errors)
    return replace(worst, numerical_bar=(worst.numerical_bar or 0.0) + spread)


def _with_bars(point: Point) -> Point:
    if point.numerical_error is None or point.model_error is None:
        return point
    numerical = point.numerical_error + (point.numerical_bar or 0.0)
    return replace(
        point,
        numerical_error=numerical + ROUNDING if point.law else numerical,
        model_error=point.model_error + (point.model_bar or 0.0),
    )


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
