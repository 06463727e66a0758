"""The choice: of all settings whose promised error is within what is asked, the cheapest."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from analysis.advice.error_curves import Curves, Errors
from analysis.advice.library import Entry, Library, Rates
from analysis.advice.likeness import Likeness, likeness_of
from analysis.advice.price import lasts, price_of, safe_step
from analysis.advice.safety import factor
from analysis.scene.scene import Scene
from analysis.work_precision.point import WORTH, Point
from analysis.work_precision.soft_runs import STIFFER
from analysis.work_precision.window import DRIVEN_SHARE
from nscd import find_contacts

Against = Literal["rigid", "model"]
LOADS = {
    "disk-load": "what each disk receives from its contacts",
    "contact-load": "what each contact carries",
    "wall-load": "what all walls together carry",
    "displacement": "where each disk goes",
}
# So little more is paid for a smaller error: less than the cost of a run varies from one to the
# next.
MARGIN = 0.1
# Longer steps, as shares of the safe one, can survive the window and heat the crowd unnoticed in a
# longer run.
LONGEST = 4.0
# The next better choice is one with an error smaller by this factor.
BETTER = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A method with a setting on the scene: its expected numerical and model error, their sum with
    safety factors (promised), and what it should cost. time_step_share of the safe step; None or ""
    for what a method does not have."""

    method: str
    law: str
    solver: str
    time_step_s: float | None
    time_step_share: float | None
    stiffness_N_per_m: float | None  # noqa: N815  (the unit is newton)
    tolerance: float | None
    numerical_error: float
    model_error: float
    promised_error: float
    cpu_seconds: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Advice:
    """What was asked and what is advised.

    choice: None where nothing reaches the asked error. better: the cheapest with half the choice's
    error or less, None where there is none. best: the smallest error promised, whatever it costs;
    None where nothing is known. curve: the candidates that no cheaper one beats, from cheap to
    accurate. by_method: the cheapest of each method that reaches. read: which scenes it was read
    from, with their weights. own: from a chart of this very scene."""

    scene: Scene
    likeness: Likeness
    asked: float
    quantity: str
    against: Against
    choice: Candidate | None
    better: Candidate | None
    best: Candidate | None
    curve: tuple[Candidate, ...]
    by_method: tuple[Candidate, ...]
    read: tuple[tuple[str, float], ...]
    own: bool


def advise(
    scene: Scene,
    asked: float,
    *,
    quantity: str = "disk-load",
    against: Against = "rigid",
    methods: Sequence[str] = ("rigid", "lammps", "yade"),
    whole_run: bool = False,
    library: Library,
    chart: Sequence[Point] | None = None,
) -> Advice:
    """The cheapest of the methods that promises an error ≤ asked (a share, e.g. 0.05) in the
    quantity, see `LOADS`.

    Errors are rms over all components relative to the rms of the rigid model's, of the window of
    the scene. Against `rigid` numerical and model error count, and law and stiffness are free;
    against `model` the numerical error alone, with the scene's own law and stiffness, and the rigid
    model is no candidate. A chart of the scene is read instead of the library, without safety
    factors. Prices are of the window, or of the whole run. Raises ValueError as `likeness_of`, for
    an unknown quantity, one that nothing like the scene has, and a chart of another scene."""
    _check_quantity(scene, quantity)
    likeness = likeness_of(scene)
    load = quantity.split("-")[0]
    entries: Sequence[Entry] = library.entries
    if chart is not None:
        entries = [entry_of_chart(scene, likeness, chart)]
    curves = Curves(likeness=likeness, load=load, entries=entries)
    rates = None if chart is not None else library.rates
    found = [
        candidate
        for method in methods
        for candidate in (
            _rigid(curves, rates, against)
            if method == "rigid"
            else _soft(scene, method, curves, rates, against, whole_run, entries)
        )
    ]
    within = [c for c in found if c.promised_error <= asked]
    choice = _cheapest(within)
    return Advice(
        scene=scene,
        likeness=likeness,
        asked=asked,
        quantity=quantity,
        against=against,
        choice=choice,
        better=_cheapest(
            c
            for c in found
            if choice is not None and c.promised_error <= BETTER * choice.promised_error
        ),
        best=min(found, key=lambda c: (c.promised_error, c.cpu_seconds), default=None),
        curve=tuple(_front(found)),
        by_method=tuple(
            best
            for method in methods
            if (best := _cheapest(c for c in within if c.method == method)) is not None
        ),
        read=tuple((entry.name, weight) for entry, weight in curves.read),
        own=chart is not None,
    )


def entry_of_chart(scene: Scene, likeness: Likeness, points: Sequence[Point]) -> Entry:
    """The points of a chart of the scene as an entry. Raises ValueError where they are of another
    scene."""
    ours = tuple(p for p in points if p.scene == scene.name)
    base = scene.contact.stiffness_N_per_m
    if not any(p.stiffness_N_per_m == base for p in ours):
        raise ValueError(
            f"chart: no points of scene {scene.name} with its stiffness of {base:g} N/m; it is of: "
            + ", ".join(sorted({p.scene for p in points}))
        )
    return Entry(
        name=scene.name,
        likeness=likeness,
        stiffness_N_per_m=base,
        window_s=window_of(scene),
        points=ours,
    )


def window_of(scene: Scene) -> float:
    """How long the window is (s) at the scene's own stiffness."""
    return DRIVEN_SHARE * scene.drive.relaxation_time_s if scene.drive else scene.run.duration_s


def _check_quantity(scene: Scene, quantity: str) -> None:
    """Raise ValueError for a quantity that is unknown, or that the scene cannot have."""
    if quantity not in LOADS:
        raise ValueError(f"quantity: unknown {quantity!r}; there are: {', '.join(LOADS)}")
    if quantity == "displacement" and scene.drive is None:
        raise ValueError(
            f"quantity: displacement is for driven crowds; {scene.name} is an impact, which takes no time"
        )
    if quantity == "wall-load":
        to_press = scene.drive is not None and scene.reconciliation is None
        contacts = find_contacts(
            scene.snapshot, scene.wall_segments(), tolerance=scene.analysis.contact_tolerance_m
        )
        if not scene.walls or not (to_press or contacts.is_wall.any()):
            raise ValueError(f"quantity: wall-load: nobody touches a wall in scene {scene.name}")


def _rigid(curves: Curves, rates: Rates | None, against: Against) -> Iterable[Candidate]:
    if against == "model":
        return
    settings = {
        (point.solver, point.tolerance)
        for entry, _ in curves.read
        for point in entry.points
        if point.method == "rigid" and point.tolerance is not None
    }
    for solver, tolerance in sorted(settings):
        assert tolerance is not None
        errors = curves.rigid(solver, tolerance)
        if errors is None:
            continue
        unsure = 1.0 if rates is None else factor(rates, curves, "rigid")
        yield Candidate(
            method="rigid",
            law="",
            solver=solver,
            time_step_s=None,
            time_step_share=None,
            stiffness_N_per_m=None,
            tolerance=tolerance,
            numerical_error=errors.numerical,
            model_error=0.0,
            promised_error=unsure * errors.numerical,
            cpu_seconds=curves.rigid_seconds(solver, tolerance),
        )


def _soft(
    scene: Scene,
    method: str,
    curves: Curves,
    rates: Rates | None,
    against: Against,
    whole_run: bool,
    entries: Sequence[Entry],
) -> Iterable[Candidate]:
    own = scene.contact.stiffness_N_per_m
    settings = {
        (point.law, point.time_step_share)
        for entry, _ in curves.read
        for point in entry.points
        if point.method == method and (point.time_step_share or LONGEST + 1) <= LONGEST
    }
    for law in sorted({law for law, _ in settings}):
        if against == "model" and law != scene.contact.law:
            continue
        price = price_of(method, law, entries)
        for stiffer in (1.0,) if against == "model" else STIFFER:
            stiffness = stiffer * own
            safe = safe_step(scene, law, stiffness)
            span = lasts(scene, stiffness, whole_run, window_of(scene))
            for share in sorted(share for of, share in settings if of == law and share is not None):
                hardness = curves.likeness.hardness * float(stiffer**0.5)
                errors = curves.soft(method, law, share, hardness)
                if errors is None:
                    continue
                yield Candidate(
                    method=method,
                    law=law,
                    solver="",
                    time_step_s=share * safe,
                    time_step_share=share,
                    stiffness_N_per_m=stiffness,
                    tolerance=None,
                    numerical_error=errors.numerical,
                    model_error=errors.model,
                    promised_error=_promise(errors, curves, rates, against),
                    cpu_seconds=price.of(len(scene.snapshot) * span / (share * safe)),
                )


def _promise(errors: Errors, curves: Curves, rates: Rates | None, against: Against) -> float:
    """Numerical plus model error, each with its safety factor; against `model` the numerical error
    alone."""
    numerical, model = (
        (1.0, 1.0)
        if rates is None
        else (factor(rates, curves, "numerical"), factor(rates, curves, "model"))
    )
    return numerical * errors.numerical + (model * errors.model if against == "rigid" else 0.0)


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


def _front(candidates: Iterable[Candidate]) -> Iterable[Candidate]:
    least = float("inf")
    for candidate in sorted(candidates, key=lambda c: (c.cpu_seconds, c.promised_error)):
        if candidate.promised_error < (1 - WORTH) * least:
            least = candidate.promised_error
            yield candidate
