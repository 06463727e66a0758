"""The choice among candidates, impacts being tried; what the model leaves out of a scene; advice in
words, and a scene as advised."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.engines import PENALTY, EngineError
from analysis.engines import engine as find_engine
from analysis.engines.penalty import penalty_of
from analysis.pages.names import engine_name
from analysis.pages.numbers import percent, seconds, significant
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from analysis.studies.advice.candidates import (
    LOADS,
    TRIED,
    AdviceContext,
    Candidate,
    Question,
    Safety,
    asked_error,
    safety_of,
    timing_of,
)
from analysis.studies.advice.library import (
    Curves,
    Entry,
    Library,
    Similarity,
    similarity_of,
    stored_library,
)
from analysis.studies.work_precision import soft
from analysis.studies.work_precision import window as windows
from analysis.studies.work_precision.point import Method, Point, PointStatus, front
from analysis.studies.work_precision.rigid_solves import solve_rigid
from nscd import ContactLaw
from nscd.contacts import connected
from nscd.percussions import Status
from nscd.stepping import Arms

# An impulse below this share of the largest is none.
NOTHING = 1e-9


def left_out(scene: Scene, folder: Path) -> Iterator[str]:
    """Yield what is left out, a line each: friction, spin, the restitution of a pressed crowd,
    islands that nothing presses, disks that carry nothing.

    A crowd that is still to be pressed together is pressed first, by an engine, and kept in the
    folder; without an engine a line says that its contacts are not known. The scene is one without
    friction (`similarity_of` refuses others)."""
    n, driven, restitution = len(scene.snapshot), scene.drive is not None, scene.contact.restitution
    unknown = "islands, disks that carry nothing: not known, "
    yield "friction cone: μ = 0, one unknown per contact instead of two"
    yield f"spin: no tangential forces, {2 * n} unknown velocities instead of {3 * n}"
    yield "slope, walls that give, stops, period: none of them is in this scene"
    yield _arms(scene)
    yield SHOULDERS
    if driven and restitution:
        yield (
            f"restitution e = {significant(restitution)}: "
            "forces of a crowd that is pressed and rests do not depend on it"
        )
    elif restitution == 1:
        yield f"{unknown}the rigid model has no e = 1"
        return
    if driven:
        hidden = f"{scene.hidden} of {n} people have a wall before the door"
        without = "not needed, 15-26 % of a run saved"
        wanted = "needed, drive.clearance_m" if scene.hidden else without
        yield f"way round walls: {hidden}: {wanted}"
    if driven and scene.reconciliation is None and not soft.soft_engines():
        yield f"{unknown}no engine is there to press the crowd together"
        return
    folder.mkdir(parents=True, exist_ok=True)
    window = soft.prepare_window(scene, folder)
    if gone := n - len(window.scene.snapshot):
        yield f"people who have passed the door: {gone} of {n}"
    yield from _islands(window)
    yield from _idle(window)


# What arms of this reach (m) and 200 N change, and cost (docs/results/arms.md).
ARMS = Arms(0.2, 200.0)
ARMS_CHANGE = (
    "Before a door they lower wall loads by 5 to 13 % and cost 1.13 times the time (rigid) or 10 "
    "times (lammps)"
)


def _arms(scene: Scene) -> str:
    """Say whether anybody could reach anybody, or a wall, without a touch."""
    crowd, walls = scene.snapshot, connected(scene.wall_segments())
    neighbours, _ = ARMS.reached(crowd.position, crowd.radius, walls)
    detached = int((neighbours.gap > scene.analysis.contact_tolerance_m).sum())
    if not detached and scene.drive is None:
        return f"arms: who does not touch is farther than {ARMS.reach:g} m, nobody is to be reached"
    return f"arms: {detached} pairs that do not touch are within {ARMS.reach:g} m. {ARMS_CHANGE}"


# What bodies of three disks change (docs/results/shoulders.md).
SHOULDERS = (
    "shoulders: before a door wall load, largest force and flow differ without them no more than "
    "crowds do. Elsewhere this was not measured"
)


def _islands(window: windows.Window) -> Iterator[str]:
    snapshot, contacts = window.scene.snapshot, window.contacts
    label = contacts.islands(len(snapshot))
    disks, home = np.bincount(label), label[contacts.first]
    closing = home[contacts.approach_velocity(window.left_velocity) > 0]
    touched, pressed = (np.bincount(some, minlength=len(disks)) > 0 for some in (home, closing))
    idle = touched & ~pressed
    if alone := int((~touched).sum()):
        yield f"disks that touch nothing: {alone} of {len(snapshot)}"
    if idle.any():
        yield f"islands that nothing presses: {int(idle.sum())} with {disks[idle].sum()} disks"


def _idle(window: windows.Window) -> Iterator[str]:
    snapshot, contacts = window.scene.snapshot, window.contacts
    solution = percussions_of(window.setting, snapshot, window.law, canonical=False).solution
    if solution.status != Status.SOLVED:
        why = f"the solution is {solution.status}: {solution.reason}"
        yield f"disks that carry nothing: not known, {why}"
        return
    impulse = np.hypot(*solution.impulse.T)
    loaded, pairs = impulse > NOTHING * impulse.max(initial=0.0), ~contacts.is_wall
    carries, in_contact = np.zeros(len(snapshot), dtype=bool), np.zeros(len(snapshot), dtype=bool)
    for disks, chosen in ((carries, loaded), (in_contact, np.ones_like(loaded))):
        disks[contacts.first[chosen]] = True
        disks[contacts.second[chosen & pairs]] = True
    if idle := int((in_contact & ~carries).sum()):
        yield f"disks that touch others and carry nothing: {idle} of {len(snapshot)}"
    if unloaded := int((~loaded).sum()):
        yield f"contacts that carry nothing: {unloaded} of {len(contacts)}"


# Shares of the safe time step that are stepped through.
STEP_FRACTIONS = (1 / 16, 1 / 4, 1.0, 4.0)
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
    engines at STEP_FRACTIONS of the safe time step with the scene's stiffness, their CPU seconds left out.

    Error bars are added to the errors. Raises ValueError as `Window.check`. Nothing is found for an
    impact too large to try, and of engines nothing where they have too many steps, or no
    reference."""
    snapshot, window = scene.snapshot, windows.impact_window(scene)
    if len(snapshot) > MOST_DISKS:
        return []
    window.check()
    # errors are shares of the rigid model's percussions: of e = 1, which it has not, of e → 1
    elastic = question.against == "model" and scene.contact.restitution == 1
    bouncing = ContactLaw(restitution=NEARLY_ELASTIC) if elastic else window.law
    rigid = windows.rigid_reference(snapshot, window.contacts, window.left_velocity, bouncing)
    judge = windows.Judge(window=window, name=scene.name, rigid=rigid)
    found: list[Point] = []
    if "rigid" in question.methods and question.against == "rigid":
        found += [point for solution in solve_rigid(window) for point in judge.points(solution)]
    for law in soft.LAWS["lammps"]:
        if engines := [m for m in question.methods if law in question.laws(m, scene)]:
            found += _stepped(judge, law, engines)
    return [_with_bars(point) for point in found]


def _stepped(judge: windows.Judge, law: str, engines: Iterable[str]) -> Iterator[Point]:
    window = judge.window
    scene = window.scene.with_contact(law=law)
    steps = scene.run.duration_s / penalty_of(scene).safe_time_step
    if len(scene.snapshot) * steps > MOST_WORK:
        return
    stiffness = scene.contact.stiffness_N_per_m
    try:
        reference = soft.soft_reference(window.variant(law, stiffness))
    except soft.ReferenceError:
        return
    own, looser = (window.quantities(motion, stiffness) for motion in reference)
    model = windows.Converged(own=own, looser=looser, wrong="the time step is too long: wrong")
    for fraction in STEP_FRACTIONS:
        near: list[list[Point]] = []
        for times in NEARBY:
            tried = Method(
                method="", law=law, stiffness_N_per_m=stiffness, time_step_share=times * fraction
            )
            message: dict[str, Any] = {"law": law, "stiffness_N_per_m": stiffness, "time_step_share": fraction}
            with np.errstate(all="ignore"):
                values = window.quantities(soft.leapfrog(soft.scene_of(window, tried)), stiffness)
                solutions = (
                    windows.MethodResult(method=one, **message, cpu_seconds=None, values=values, model=model)
                    for one in engines
                )
                near.append([point for solution in solutions for point in judge.points(solution)])
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

    better: the cheapest with half the choice's error or less; None where there is none.
    best: the smallest error promised, whatever it costs; None where nothing is known.
    measured: machine and date of what was read, and of what prices were fitted to."""

    scene: Scene
    likeness: Similarity
    question: Question
    choice: Candidate | None  # None where nothing reaches the asked error
    better: Candidate | None
    best: Candidate | None
    found: tuple[Candidate, ...]  # all candidates
    curve: tuple[Candidate, ...]  # the candidates that no cheaper one beats, from cheap to accurate
    by_method: tuple[Candidate, ...]  # the cheapest of each method that reaches the asked error
    read: tuple[tuple[str, float], ...]  # which scenes it was read from, with their weights
    own: bool  # whether it was read from a chart of this very scene
    tried: bool  # whether this very scene was tried here: an impact (see `tried`)
    measured: tuple[str, ...]

    def content(self) -> dict[str, Any]:
        """Give it as advice.json has it."""
        return {
            "scene": self.scene.name,
            "quantity": self.question.quantity,
            "against": self.question.against,
            "asked_error": self.question.error,
            "likeness": self.likeness,
            "choice": self.choice,
            "next_better": self.better,
            "best": self.best,
            "by_method": self.by_method,
            "curve": self.curve,
            "read": [{"scene": name, "weight": weight} for name, weight in self.read],
            "from_own_chart": self.own,
            "tried": self.tried,
            "measured": self.measured,
        }


def advise(
    scene: Scene, question: Question, *, library: Library, chart: Sequence[Point] | None = None
) -> Advice:
    """Choose the cheapest method that promises what is asked of a scene's window.

    An impact is tried here (see `tried`), of a driven crowd the library is read; a chart of the
    scene is read instead of both, without safety factors. Raises ValueError as `similarity_of`, for a
    quantity that is unknown or that the scene cannot have, and a chart of another scene."""
    scene.check_plain("advice is")  # nothing was measured with them
    question.check(scene)
    evidence = _evidence_of(scene, question, library, chart)
    found = list(evidence.candidates())
    read = {entry.name: weight for entry, weight in evidence.curves.read}
    sources = [entry for entry, _ in evidence.curves.read]
    if any(c.law for c in found):
        sources += evidence.priced
    within = [c for c in found if c.promised_error <= question.error]
    choice, better = _cheapest(within), None
    if choice is not None:
        minimum = BETTER * choice.promised_error
        better = _cheapest(c for c in found if c.promised_error <= minimum)
    by_method = (_cheapest(c for c in within if c.method == m) for m in question.methods)
    return Advice(
        scene=scene,
        likeness=evidence.curves.likeness,
        question=question,
        choice=choice,
        better=better,
        best=min(found, key=lambda c: (c.promised_error, c.cpu_seconds), default=None),
        found=tuple(found),
        curve=tuple(front(found, lambda c: c.cpu_seconds, lambda c: c.promised_error)),
        by_method=tuple(best for best in by_method if best is not None),
        read=tuple(read.items()),
        own=chart is not None,
        tried=chart is None and scene.drive is None and bool(read),
        measured=tuple(sorted({f"{p.machine}, {p.date}" for e in sources for p in e.points})),
    )


def _evidence_of(
    scene: Scene, question: Question, library: Library, chart: Sequence[Point] | None
) -> AdviceContext:
    """What a chart of the scene says, what is found by trying it, or what the library does."""
    priced, safety, entries = library.entries, Safety(), library.entries
    if chart is not None:
        _check_points(scene, chart)
        priced = entries = (Entry.of(scene, chart),)
    elif scene.drive is None:
        entries, safety = (Entry.of(scene, tried(scene, question)),), TRIED
    curves = Curves(likeness=similarity_of(scene), load=question.load, entries=entries)
    if entries is library.entries:
        safety = safety_of(library.rates, curves)
    return AdviceContext(scene=scene, question=question, curves=curves, safety=safety, priced=priced)


def _check_points(scene: Scene, points: Sequence[Point]) -> None:
    base = scene.contact.stiffness_N_per_m
    if not any(p.scene == scene.name and p.stiffness_N_per_m == base for p in points):
        others = ", ".join(sorted({p.scene for p in points}))
        raise ValueError(
            f"chart: no points of scene {scene.name} with its stiffness of {base:g} N/m. "
            f"It is of: {others}"
        )


def _cheapest(candidates: Iterable[Candidate]) -> Candidate | None:
    """The cheapest, or one that costs at most MARGIN more and promises a smaller error."""
    ordered = list(candidates)
    if not ordered:
        return None
    minimum = min(c.cpu_seconds for c in ordered)
    return min(
        (c for c in ordered if c.cpu_seconds <= (1 + MARGIN) * minimum),
        key=lambda c: (c.promised_error, c.cpu_seconds),
    )


def setting(candidate: Candidate) -> str:
    """Write a method with its setting."""
    name = engine_name(candidate.method)
    if candidate.time_step_s is None:
        return f"{name}, solver {candidate.solver}, tolerance {candidate.tolerance:g}"
    return (
        f"{name}, {candidate.law}, k = {candidate.stiffness_N_per_m:.3g} N/m, "
        f"Δt = {candidate.time_step_s:.3g} s ({candidate.time_step_share:g} × safe)"
    )


def headline(advice: Advice) -> str:
    """Write the choice in one line; or that there is none, and the best that is reached."""
    quantity, best = advice.question.quantity, advice.best
    if advice.choice is not None:
        return _choice_words(advice.choice, advice.question)
    if best is None:
        return f"nothing is known of {quantity} in {advice.scene.name}: {_nothing_like(advice)}"
    return (
        f"nothing reaches {percent(advice.question.error, 2)} in {quantity}. The best, "
        f"{setting(best)}, promises {percent(best.promised_error, 2)}"
    )


def _choice_words(choice: Candidate, question: Question) -> str:
    return f"{setting(choice)}: error of {question.quantity} {_candidate_words(choice)}"


def _nothing_like(advice: Advice) -> str:
    if advice.likeness.driven:
        return "no measured scene is enough like it"
    if advice.likeness.disks > MOST_DISKS:
        return f"an impact of more than {MOST_DISKS} disks is not tried"
    return "the mechanics does not determine it, or no method asked about could be tried"


def _candidate_words(candidate: Candidate) -> str:
    promise = percent(candidate.promised_error, 2)
    return f"at most {promise}, {seconds(candidate.cpu_seconds)} CPU"


def report(advice: Advice, left: Sequence[str]) -> list[str]:
    """Write all lines: the question, the choice, the next better one, each method, the curve, where
    it was read, what was left out."""
    lines = [*_question(advice), "", *_choice(advice), "", *_curve(advice)]
    lines += [f"measured on {where}" for where in advice.measured]
    lines += ["", "left out of the model:", *(f"  {line}" for line in left)]
    return lines


def _question(advice: Advice) -> Iterator[str]:
    scene, question = advice.scene, advice.question
    disks, quantity = len(scene.snapshot), question.quantity
    yield f"{scene.name}: {disks} disks, {quantity} ({LOADS[quantity]})"
    against = "the rigid model (numerical and model error)"
    if question.against == "model":
        law = scene.contact.law
        against = f"{law} contacts of the scene's stiffness, exactly solved (numerical error)"
    yield f"within {percent(question.error, 2)} of {against}"


def _choice(advice: Advice) -> Iterator[str]:
    choice, better = advice.choice, advice.better
    if choice is None:
        yield headline(advice)
        return
    yield "advised: " + headline(advice)
    if better is None:
        yield "next better: nothing promises half that error"
    else:
        times = better.cpu_seconds / choice.cpu_seconds
        yield f"next better: {setting(better)}: {_candidate_words(better)} ({times:.2g} times the price)"
    for other in advice.by_method:
        if other != choice:
            yield f"or with {setting(other)}: {_candidate_words(other)}"


def _curve(advice: Advice) -> Iterator[str]:
    yield "the curve, from cheap to accurate:"
    yield f"  {'':<70}{'numerical':>12}{'model':>12}{'promised':>12}{'CPU':>10}"
    for c in advice.curve:
        errors = (c.numerical_error, c.model_error, c.promised_error)
        shown = "".join(f"{percent(error, 2):>12}" for error in errors)
        mark = "→" if c == advice.choice else " "
        yield f"{mark} {setting(c):<70}{shown}{seconds(c.cpu_seconds):>10}"
    scenes = ", ".join(f"{name} ({percent(weight, 2)})" for name, weight in advice.read)
    if advice.tried:
        yield "errors found on this very impact: solved here, and stepped through as engines do"
    elif advice.own:
        yield "read from the chart of this scene"
    else:
        yield f"read from the scenes most like it: {scenes}" if scenes else _nothing_like(advice)


RIGID = "rigid"


def methods_here(requested: Sequence[str] | None = None) -> tuple[str, ...]:
    """Give the methods asked for; all that are installed by default. Raises ValueError for an
    unknown one."""
    if not requested:
        return RIGID, *soft.soft_engines()
    methods = (RIGID, *soft.LAWS)
    for name in requested:
        if name not in methods:
            raise ValueError(f"method: unknown {name!r}. There are: {', '.join(methods)}")
    return tuple(dict.fromkeys(requested))


def scene_within(
    scene: Scene, error: str, engine_name: str | None = None
) -> tuple[Scene, str, str]:
    """Give the scene to run, the engine (the cheapest that is installed by default) and the choice
    in words, for an error such as `5%` of what each disk receives, against the rigid model.

    Raises ValueError for an engine without soft contacts, and naming the best where nothing reaches
    it; EngineError where there is no engine."""
    if engine_name is not None:
        find_engine(engine_name)
        if engine_name not in soft.LAWS:
            raise ValueError(
                f"error: it is for {' and '.join(soft.LAWS)}, and {engine_name} has no stiffness"
            )
    engines = [engine_name] if engine_name else [one.NAME for one in PENALTY if one.find()]
    if not engines:
        raise EngineError("no engine: nothing can run the scene. See: percussions doctor")
    question = Question(error=asked_error(error), methods=tuple(engines), whole_run=True)
    evidence = _evidence_of(scene, question, stored_library(), None)
    choice = _cheapest(c for c in evidence.candidates() if c.promised_error <= question.error)
    if choice is None:
        raise ValueError(f"error: {headline(advise(scene, question, library=stored_library()))}")
    words = _choice_words(choice, question)
    if scene.drive is not None:
        window = windows.Window(scene=scene).duration(scene.contact.stiffness_N_per_m)
        # in a run people collide: the force at an instant is no mean over a window
        words += (
            f". The error is that of mean forces over {window:g} s of a crowd pressed "
            "together, not of an instant"
        )
    return advised_scene(scene, choice), choice.method, words


def advised_scene(scene: Scene, candidate: Candidate) -> Scene:
    """Give the scene with the law, stiffness and time step of an engine's candidate (of a whole
    run); an impact lasts as many √(m/k) as in the scene."""
    assert candidate.stiffness_N_per_m is not None
    assert candidate.time_step_s is not None
    stiffness = candidate.stiffness_N_per_m
    timing = timing_of(scene, stiffness, candidate.time_step_s, whole_run=True)
    return scene.with_contact(law=candidate.law, stiffness_N_per_m=stiffness).with_run(
        duration_s=timing.duration_s, frames=timing.frames, time_step_s=timing.step_s
    )
