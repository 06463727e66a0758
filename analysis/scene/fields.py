"""What fields of a scene file are made of: numbers in their ranges, points, names of files, tables."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any

import pydantic

# Engines do not read numbers whose squares or quotients underflow.
SMALLEST = 1e-100


# strict: neither `true` nor "1.0" is a number; beyond its ends squares and distances leave double
# precision
Number = Annotated[float, pydantic.Strict(), pydantic.Field(allow_inf_nan=False, ge=-1e30, le=1e30)]
Positive = Annotated[Number, pydantic.Field(gt=0)]
Count = Annotated[int, pydantic.Strict(), pydantic.Field(ge=1)]
Point = tuple[Number, Number]


def _rising(ends: Point) -> Point:
    if not ends[0] < ends[1]:
        raise ValueError(f"from {ends[0]:g} to {ends[1]:g} m. The first must be less")
    return ends


# What a JSON schema says of a field that a function checks: its name.
RISING, FILE_NAME, IN_ORDER = (
    pydantic.Field(json_schema_extra={"check": name})
    for name in ("_rising", "_file_name", "_in_order")
)
Period = Annotated[Point, pydantic.AfterValidator(_rising), RISING]


def _file_name(name: str) -> str:
    if not re.fullmatch(r"[^./\\\x00-\x1f][^/\\\x00-\x1f]{0,99}", name):
        raise ValueError(f"{name!r} is not the name of a file in one folder")
    return name


# It becomes a part of paths, and must not lead out of their folder.
FileName = Annotated[str, pydantic.AfterValidator(_file_name), FILE_NAME]
# Mean radius (m) and mean mass (kg) of the disks of a file.
Means = tuple[float, float]


def means_of(info: pydantic.ValidationInfo) -> Means | None:
    """The means of the disks of the file that is read, where there are any."""
    ask: Callable[[], Means | None] = (info.context or {}).get("means", lambda: None)
    return ask()


def _with_checks(schema: dict[str, Any], model: type[pydantic.BaseModel]) -> None:
    """Put the names of a model's validators into its JSON schema, in the order in which they run."""
    found = model.__pydantic_decorators__.model_validators
    by = {
        mode: [key for key in found if found[key].info.mode == mode] for mode in ("before", "after")
    }
    schema |= {"before": by["before"][::-1], "after": by["after"]}


class Schema(pydantic.BaseModel):
    """A table of a scene file: no key that is not known, numbers that are numbers."""

    model_config = pydantic.ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, json_schema_extra=_with_checks
    )

    @pydantic.field_validator("*")
    @classmethod
    def _underflows_nowhere(cls, value: Any) -> Any:
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, float) and 0 < abs(part) < SMALLEST:
                raise ValueError(f"{part:g} is nearer to 0 than {SMALLEST:g}. Write 0")
        return value
