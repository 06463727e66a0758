"""A comparison of two runs by windows as files: windows.csv, window_contacts.csv, windows.json."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

from analysis.motion.pairwise import WindowComparison
from analysis.motion.series import MEASURES
from analysis.pages.html import jsonable
from analysis.support.files import whole_file, write_text

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
    with whole_file(paths[0]) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["start_s", "end_s", *columns, *agreement])
        for window in compared.windows:
            values = [run[key] for key in measures for run in window.values]
            table.writerow([window.start, window.end, *values, *window.agreement().values()])
    with whole_file(paths[1]) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(CONTACTS_HEAD)
        for window in compared.windows:
            for row, key in enumerate(window.keys.tolist()):
                has = window.has[:, row].astype(int).tolist()
                impulse = window.impulses[:, row].ravel().tolist()
                table.writerow([window.start, window.end, *key, *has, *impulse])
    write_text(paths[2], json.dumps(_content(compared, runs), indent=1, ensure_ascii=False) + "\n")
    return paths


def _content(compared: WindowComparison, runs: tuple[Path, Path]) -> Any:
    windows = compared.windows
    measures = {
        key: {
            "unit": MEASURES[key].unit,
            "first": found.first,
            "second": found.second,
            "second_above_first": found.share,
            "interval_90": [found.low, found.high],
            "independent_windows": found.independent,
            "verdict": found.verdict,
        }
        for key, found in compared.paired().items()
    }
    return jsonable(
        {
            "first": str(runs[0]),
            "second": str(runs[1]),
            "window_s": windows[0].end - windows[0].start,
            "windows": len(windows),
            "from_s": windows[0].start,
            "to_s": windows[-1].end,
            "measures": measures,
        }
    )
