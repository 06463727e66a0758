"""One point of a work–precision chart: a method with its settings, what it cost, and its two
errors."""

import dataclasses
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import ClassVar, TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError

from analysis.scene.scene import first_problem
from analysis.support.columns import Columns
from analysis.support.files import write_json, write_rows

# Columns that come first: where it was measured.
FIRST = ("scene", "disks")
# A dearer point of a front has to be better by this share: less is lost in the noise of CPU time.
WORTH = 0.05


class PointStatus(StrEnum):
    """ok: the run ended and its answer is one; inaccurate: it ended, but missed its tolerance, or
    is wrong by more than 100 %; failed: there is no answer (stopped, died, not finite). The reason
    says more."""

    OK = "ok"
    INACCURATE = "inaccurate"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """A method with one setting; None or "" for what it does not have.

    law: contact law of a soft method (hooke, hertz), model of the continuum (deformable,
    first_order).
    time_step_s, stiffness_N_per_m: s, N/m, of a soft method."""

    method: str  # `lammps`, `yade`, `rigid`, `continuum`, or a rival's name
    law: str = ""
    solver: str = ""  # of the rigid model
    time_step_s: float | None = None
    time_step_share: float | None = None  # of the safe time step
    stiffness_N_per_m: float | None = None  # noqa: N815  (the unit is newton)
    tolerance: float | None = None  # of the rigid model
    mesh_side_m: float | None = None  # m, of the continuum's triangles


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """A point that is kept in a file: the edition of that file, and what it calls its points."""

    EDITION: ClassVar[int]
    WORDS: ClassVar[str]
    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


POINTS = Columns("points")
P = TypeVar("P", bound=Kept)
Rated = TypeVar("Rated")


@dataclass(frozen=True, slots=True, kw_only=True)
class Point(Method, Kept):
    """One method with one setting on one scene, for one quantity: what POINTS says of each.

    Errors are rms over all components, relative to the rms of the rigid reference; for the
    quantities see `Window.quantities`."""

    EDITION: ClassVar[int] = 2
    WORDS: ClassVar[str] = "points"

    scene: str
    disks: int
    cpu_seconds: float | None
    quantity: str
    unit: str
    numerical_error: float | None
    numerical_bar: float | None
    model_error: float | None
    model_bar: float | None
    total_error: float | None  # at most the sum of numerical and model error
    status: PointStatus
    reason: str
    machine: str
    date: str

    @property
    def load(self) -> str:
        """What carries the quantity: contact, disk or wall; or `displacement`."""
        return self.quantity.split("_")[0]

    @property
    def key(self) -> str:
        """Method, law (or model) and solver in one word: what belongs on one curve but for the
        stiffness."""
        return "_".join(part for part in (self.method, self.law, self.solver) if part)

    @property
    def error_sum(self) -> float | None:
        """Numerical plus model error, as far as the method has them: what the total error cannot
        exceed. The total itself can be smaller by luck, where the two happen to cancel. None where
        neither is known, or a run's own is not."""
        if self.stiffness_N_per_m is not None and (
            self.numerical_error is None or self.model_error is None
        ):
            return None
        finite = [error for error in (self.numerical_error, self.model_error) if error is not None]
        return sum(finite) if finite else None


def columns_of(kind: type[Kept]) -> tuple[str, ...]:
    """Name the columns of a kind of points: where it was measured comes first."""
    names = [field.name for field in dataclasses.fields(kind)]
    return tuple(sorted(names, key=lambda name: name not in FIRST))


def content_of(points: Sequence[Kept], kind: type[Kept]) -> dict[str, object]:
    """Give what the JSON file of the points holds: units in the names."""
    names = columns_of(kind)
    rows = [{name: getattr(point, name) for name in names} for point in points]
    return {"format": kind.EDITION, "points": rows}


def write_points(
    folder: Path, points: Sequence[Kept], name: str = "points", kind: type[Kept] = Point
) -> None:
    """Write <name>.json and <name>.csv (one row per point), each whole or not at all."""
    names = columns_of(kind)
    write_json(folder / f"{name}.json", content_of(points, kind))
    rows = ([getattr(point, name) for name in names] for point in points)
    write_rows(folder / f"{name}.csv", names, rows)


def read_points(path: Path, kind: type[P] = Point) -> list[P]:  # type: ignore[assignment]
    """Read the points of a file of JSON. Raises ValueError naming the file for one that is missing, broken
    or of another format, and the key that is missing, unknown or has a wrong value."""
    if not path.exists():
        raise ValueError(f"{path}: no such file. Make it with: percussions chart SCENE")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != kind.EDITION:
            raise ValueError(f"format: {content['format']} where {kind.EDITION} is needed")
        return TypeAdapter(list[kind]).validate_python(content["points"])  # type: ignore[valid-type]
    except (KeyError, TypeError, ValueError) as error:
        reason = first_problem(error) if isinstance(error, ValidationError) else error
        raise ValueError(f"{path}: not the {kind.WORDS} of a chart: {reason}") from None


def pareto_front(points: Iterable[Point]) -> list[Point]:
    """Choose, of points of one quantity that are `ok`, the `front` of numerical plus model error
    against CPU seconds, so that no point wins by errors that cancel."""
    valid = (point for point in points if point.status == PointStatus.OK)
    return front(valid, lambda point: point.cpu_seconds, lambda point: point.error_sum)


def front(
    rated: Iterable[Rated],
    cost: Callable[[Rated], float | None],
    error: Callable[[Rated], float | None],
) -> list[Rated]:
    """Choose what no cheaper one equals in its error (to WORTH), from cheap to accurate; what has no
    cost or no error is none of them."""
    rows = [(cost(one), error(one), one) for one in rated]
    best, minimum = [], float("inf")
    for _, now, one in sorted(
        (row for row in rows if None not in row[:2]), key=lambda row: row[:2]
    ):
        if now is not None and now < (1 - WORTH) * minimum:
            minimum = now
            best.append(one)
    return best
