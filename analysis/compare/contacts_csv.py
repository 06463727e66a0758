"""The contacts of a comparison as a table."""

from pathlib import Path

import numpy as np

from analysis.compare.comparison import FORCE, Comparison
from analysis.support.files import write_rows


def write_contacts(path: Path, comparison: Comparison) -> None:
    """Write one row per contact, both models side by side, as CSV with the unit in the names."""
    match, unit = comparison.match, "N" if comparison.unit == FORCE else "Ns"
    forces = [f"{model}_{axis}_{unit}" for model in ("penalty", "rigid") for axis in "xy"]
    head = ["first", "second", "is_wall", "nx", "ny", "gap_m", *forces]
    columns = [match.ids, match.is_wall, match.contacts.normal, match.contacts.gap]
    columns += [match.penalty, match.rigid, match.in_penalty, match.in_rigid, match.determined]
    cells = [column * 1 for whole in columns for column in np.atleast_2d(whole.T)]
    head += ["in_penalty", "in_rigid", "determined"]
    write_rows(path, head, zip(*(column.tolist() for column in cells), strict=True))
