"""A comparison of two runs by windows as files: windows.csv, window_contacts.csv, windows.json."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from analysis.motion.pairwise import WindowComparison
from analysis.motion.series import MEASURES
from analysis.support.files import write_json, write_rows

CONTACTS_HEAD = [
    "start_s", "end_s", "first", "second", "is_wall", "in_first_run", "in_second_run",
    "first_run_x_Ns", "first_run_y_Ns", "second_run_x_Ns", "second_run_y_Ns",
]  # fmt: skip
UNITS = {"N": "N", "N/m": "N_per_m", "m/s": "m_per_s", "1/m²": "per_m2", "1/s": "per_s"}


def write_windows(folder: Path, compared: WindowComparison, runs: tuple[Path, Path]) -> list[Path]:
    """Write a comparison into a folder, and return the files: measures and agreement window by
    window, impulses contact by contact, and all of it over the windows; runs: the two folders."""
    paths = [folder / name for name in ("windows.csv", "window_contacts.csv", "windows.json")]
    measures = list(compared.windows[0].values[0])
    columns = [
        f"{run}_{key}_{UNITS[MEASURES[key].unit]}"
        for key in measures
        for run in ("first", "second")
    ]
    agreement = list(compared.windows[0].agreement())
    rows: list[list[object]] = []
    for window in compared.windows:
        values = [run[key] for key in measures for run in window.values]
        rows.append([window.start, window.end, *values, *window.agreement().values()])
    write_rows(paths[0], ["start_s", "end_s", *columns, *agreement], rows)
    write_rows(paths[1], CONTACTS_HEAD, _contacts(compared))
    write_json(paths[2], _content(compared, runs))
    return paths


def _contacts(compared: WindowComparison) -> Iterator[list[object]]:
    for window in compared.windows:
        for row, key in enumerate(window.keys.tolist()):
            has = window.has[:, row].astype(int).tolist()
            yield [window.start, window.end, *key, *has, *window.impulses[:, row].ravel().tolist()]


def _content(compared: WindowComparison, runs: tuple[Path, Path]) -> dict[str, Any]:
    windows = compared.windows
    measures = {
        key: {
            "unit": MEASURES[key].unit,
            "first": found.first,
            "second": found.second,
            # a share, or in the unit where the first is next to zero
            "second_above_first" if found.relative else "second_minus_first": found.more,
            "autocorrelation": found.autocorrelation,
            "independent_windows": found.independent,
        }
        for key, found in compared.paired().items()
    }
    return {
        "first": str(runs[0]),
        "second": str(runs[1]),
        "window_s": windows[0].end - windows[0].start,
        "windows": len(windows),
        "from_s": windows[0].start,
        "to_s": windows[-1].end,
        "measures": measures,
    }
