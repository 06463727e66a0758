"""What the report says of two engines: nothing twice, everything of both."""

import numpy as np
import pytest

from analysis.pages.report_section import _trends
from analysis.pages.words import Words


def run(engine, stiffness, difference):
    statistics = {
        "contact_relative_difference": difference,
        "disk_sum_relative_difference": difference / 2,
    }
    return {
        "engine": engine.lower(),
        "engine_name": engine,
        "stiffness": stiffness,
        "statistics": statistics,
    }


def trends(*runs):
    return _trends(Words("analysis.pages", kind="force"), runs)


def test_engines_that_agree_share_a_sentence():
    (said,) = trends(
        *(run(e, k, d) for e in ("LAMMPS", "YADE") for k, d in ((1e7, 0.02), (1e6, 0.2)))
    )
    assert said.startswith("LAMMPS and YADE: from k = 10⁶ to 10⁷ N/m")
    assert "20.0 % to 2.0 % (per disk: 10.0 % to 1.0 %)" in said
    assert said.endswith("forces approach each other.")


def test_engines_that_differ_have_a_sentence_each():
    said = trends(
        run("LAMMPS", 1e6, 0.2), run("LAMMPS", 1e7, 0.02),
        run("YADE", 1e6, 0.2), run("YADE", 1e7, 0.21),
    )  # fmt: skip
    assert [words.split(":")[0] for words in said] == ["LAMMPS", "YADE"]
    assert said[1].endswith("do not approach each other.")


@pytest.mark.parametrize("difference", [np.nan, np.inf])
def test_no_trend_of_one_stiffness_or_of_no_number(difference):
    assert trends(run("LAMMPS", 1e6, 0.2)) == []
    assert trends(run("LAMMPS", 1e6, 0.2), run("LAMMPS", 1e7, difference)) == []
