"""Damaged dumps, scenes, run folders, trajectories and command lines.

More of them by hand: `python -m tests.fuzz --cases 10000`."""

import pytest

from tests.fuzz.law import sweep
from tests.fuzz.material import Workshop

CASES, LONGEST_S = 160, 40.0


@pytest.mark.long
def test_damaged_input(tmp_path):
    workshop = Workshop(tmp_path / "runs")
    ends, faults = sweep(workshop, 1, range(CASES), tmp_path / "case", LONGEST_S)
    assert not faults, "\n".join(f"{n}: {case.as_typed}: {words}" for n, case, words in faults)
    # neither all refused nor all taken
    assert {end.split()[1] for end in ends} == {"accepted", "refused"}
