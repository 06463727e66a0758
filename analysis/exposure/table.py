"""The exposure of a run as CSV files and as a table for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from analysis.exposure.exposure import Exposure
from analysis.exposure.limits import QUANTITIES, Limit
from analysis.pages.numbers import NONE, significant, with_unit
from analysis.support.files import write_rows

HEAD = ["limit", "value", "quantity", "ever above", "longest time above", "largest", "source"]


def write_exposure(exposure: Exposure, limits: Sequence[Limit], folder: Path) -> list[Path]:
    """Write exposure_people.csv, exposure_walls.csv, exposure_crowd.csv (a row per window and
    person, wall or crowd) and exposure_limits.csv (a row per limit and person, wall or crowd);
    return them.

    Columns: docs/columns.md."""
    written = []
    for of, rows in (
        ("people", _people(exposure)),
        ("walls", _walls(exposure)),
        ("crowd", _crowd(exposure)),
        ("limits", _limits(exposure, limits)),
    ):
        head, *below = rows
        write_rows(folder / f"exposure_{of}.csv", [*map(str, head)], below)
        written.append(folder / f"exposure_{of}.csv")
    return written


def _columns(of: str) -> dict[str, str]:
    return {key: one.column for key, one in QUANTITIES.items() if one.of == of}


def _people(exposure: Exposure) -> Iterable[list[object]]:
    columns = _columns("person")
    yield ["time_s", "window_s", "id", *columns.values()]
    for loads in exposure.windows:
        for row in zip(exposure.ids.tolist(), *(loads.person[key] for key in columns), strict=True):
            yield [loads.time, loads.duration, *row]


def _walls(exposure: Exposure) -> Iterable[list[object]]:
    columns, names = _columns("wall"), [wall.name for wall in exposure.scene.walls]
    yield ["time_s", "window_s", "wall", *columns.values()]
    for loads in exposure.windows:
        for row in zip(names, *(loads.wall[key] for key in columns), strict=True):
            yield [loads.time, loads.duration, *row]


def _crowd(exposure: Exposure) -> Iterable[list[object]]:
    columns = _columns("crowd")
    yield ["time_s", "window_s", *columns.values()]
    for loads in exposure.windows:
        if loads.crowd:
            yield [loads.time, loads.duration, *(loads.crowd[key] for key in columns)]


def _limits(exposure: Exposure, limits: Sequence[Limit]) -> Iterable[list[object]]:
    yield [
        "limit", "number", "unit", "quantity", "of", "id", "time_above_s", "longest_s", "lasting_s",
        "population", "source", "read",
    ]  # fmt: skip
    for limit in limits:
        of = QUANTITIES[limit.quantity].of
        said = [limit.duration_s or "", limit.population, limit.cited, limit.read]
        names = {
            "person": exposure.ids.tolist(),
            "wall": [wall.name for wall in exposure.scene.walls],
            "crowd": [""],
        }
        for name, total, longest in zip(names[of], *exposure.time_above(limit), strict=False):
            head = [limit.name, limit.number, limit.unit, limit.quantity, of, name]
            yield [*head, total, longest, *said]


def exposure_rows(exposure: Exposure, limits: Sequence[Limit]) -> list[list[str]]:
    """Give a row per limit, HEAD above it: who is above it at any time, the longest stretch of
    anybody and, where the limit has a duration, that beside it."""
    rows = []
    for limit in limits:
        quantity = QUANTITIES[limit.quantity]
        total, longest = exposure.time_above(limit)
        above, most = int((total > 0).sum()), float(longest.max(initial=0.0))
        names = {"person": "people", "wall": "walls", "crowd": ""}
        who = f"{above} of {len(total)} {names[quantity.of]}".strip()
        if quantity.of == "crowd":
            who = ("the crowd" if above else "no") if len(total) else NONE
        lasts = f" of {significant(limit.duration_s)} s" if limit.duration_s else " s"
        rows.append(
            [
                limit.name,
                with_unit(significant(limit.number, 4), limit.unit),
                quantity.title,
                who,
                significant(most, 2) + lasts,
                with_unit(significant(exposure.largest(limit), 2), limit.unit),
                limit.cited,
            ]
        )
    return rows
