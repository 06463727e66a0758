"""The stored library: driven crowds that were measured, each with its likeness and its points,
machine and date."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Self

from analysis.advice.likeness import Likeness, likeness_of
from analysis.scene.scene import Scene
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.window import Window

FORMAT = 2
FILE = "library.json"
# What the points of one run have in common, in this order, then the errors of each quantity.
RUN = (
    "method", "law", "solver", "time_step_s", "time_step_share", "stiffness_N_per_m", "tolerance",
    "cpu_seconds",
)  # fmt: skip
ERRORS = ("numerical_error", "model_error", "total_error", "status")
# Digits that are kept: a timing has no more.
DIGITS = 3
# (load, what) → rate
Rates = dict[tuple[str, str], float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Entry:
    """A measured scene: its name, what it is like, its own stiffness, how long its window is at
    that stiffness, and its points."""

    name: str
    likeness: Likeness
    stiffness_N_per_m: float  # noqa: N815  (the unit is newton)
    window_s: float
    points: tuple[Point, ...]

    @classmethod
    def of(cls, scene: Scene, points: Iterable[Point]) -> Self:
        """Make the entry of a scene from what of these points is of it. Raises as `likeness_of`."""
        stiffness = scene.contact.stiffness_N_per_m
        return cls(
            name=scene.name,
            likeness=likeness_of(scene),
            stiffness_N_per_m=stiffness,
            window_s=Window(scene=scene).duration(stiffness),
            points=tuple(point for point in points if point.scene == scene.name),
        )

    def hardness(self, point: Point) -> float:
        """Compute the hardness (see `Likeness`) of a point's contacts."""
        assert point.stiffness_N_per_m is not None
        return self.likeness.hardness * float(
            (point.stiffness_N_per_m / self.stiffness_N_per_m) ** 0.5
        )

    def particle_steps(self, point: Point) -> float:
        """Count disks times steps of a point's run over the window, which for an impact shortens as
        √k grows."""
        assert point.time_step_s is not None
        assert point.stiffness_N_per_m is not None
        window = self.window_s
        if not self.likeness.driven:
            window *= float((self.stiffness_N_per_m / point.stiffness_N_per_m) ** 0.5)
        return point.disks * window / point.time_step_s


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Library:
    """Measured scenes, and the rates of the safety factors that they were found to need (see
    `safety.rates_of`)."""

    entries: tuple[Entry, ...]
    rates: Rates


def library_text(library: Library) -> str:
    """Write the library as JSON, one line per run: what its points have in common (`RUN`), then
    `ERRORS` of each quantity."""
    scenes = []
    for entry in library.entries:
        first = entry.points[0]
        quantities = dict.fromkeys((point.quantity, point.unit) for point in entry.points)
        runs: dict[str, dict[str, list[object]]] = {}
        for point in entry.points:
            run = json.dumps([_short(getattr(point, name)) for name in RUN])
            errors = [_short(getattr(point, name)) for name in ERRORS]
            runs.setdefault(run, {})[point.quantity] = errors
        head = {
            "name": entry.name,
            "likeness": [_short(value) for value in entry.likeness.to_json()],
            "stiffness_N_per_m": entry.stiffness_N_per_m,
            "window_s": entry.window_s,
            "machine": first.machine,
            "date": max(point.date for point in entry.points),
            "quantities": list(quantities),
        }
        rows = [
            f"{run[:-1]}, {json.dumps([found.get(quantity) for quantity, _ in quantities])}]"
            for run, found in runs.items()
        ]
        scenes.append(
            json.dumps(head, ensure_ascii=False)[:-1] + ', "runs": [\n' + ",\n".join(rows) + "\n]}"
        )
    rates = [[*key, _short(rate)] for key, rate in sorted(library.rates.items())]
    top = json.dumps({"format": FORMAT, "rates": rates, "run": RUN, "errors": ERRORS})
    return top[:-1] + ', "scenes": [\n' + ",\n".join(scenes) + "\n]}\n"


def library_of(text: str) -> Library:
    """Read the library that `library_text` wrote. Raises ValueError for another format."""
    content = json.loads(text)
    if (
        content.get("format") != FORMAT
        or tuple(content["run"]) != RUN
        or tuple(content["errors"]) != ERRORS
    ):
        raise ValueError(f"{FILE}: format {content.get('format')}; {FORMAT} is needed")
    return Library(
        entries=tuple(_entry(scene) for scene in content["scenes"]),
        rates={(load, what): rate for load, what, rate in content["rates"]},
    )


@functools.cache
def stored_library() -> Library:
    """Read the library that the product brings along."""
    return library_of((files("analysis.advice") / FILE).read_text(encoding="utf-8"))


def _entry(scene: dict[str, Any]) -> Entry:
    driven, disks, *others = scene["likeness"]
    likeness = Likeness(
        **dict(zip(Likeness.__dataclass_fields__, (bool(driven), int(disks), *others), strict=True))
    )
    return Entry(
        name=scene["name"],
        likeness=likeness,
        stiffness_N_per_m=scene["stiffness_N_per_m"],
        window_s=scene["window_s"],
        points=tuple(_points(scene, likeness.disks)),
    )


def _points(scene: dict[str, Any], disks: int) -> Iterator[Point]:
    for *run, errors in scene["runs"]:
        common = dict(zip(RUN, run, strict=True))
        for (quantity, unit), found in zip(scene["quantities"], errors, strict=True):
            if found is None:
                continue
            numerical, model, total, status = found
            yield Point(
                scene=scene["name"],
                disks=disks,
                quantity=quantity,
                unit=unit,
                numerical_error=numerical,
                numerical_bar=None,
                model_error=model,
                model_bar=None,
                total_error=total,
                status=PointStatus(status),
                reason="",
                machine=scene["machine"],
                date=scene["date"],
                **common,
            )


def _short(value: object) -> object:
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
