"""What the report says of two engines and of rising stiffness: nothing twice, no more than the runs
allow."""

import numpy as np
import pytest

from analysis.pages.words import Words
from analysis.scene import Crowd, room
from analysis.scene.waiting import opposing
from analysis.studies.report.contacts import _trends, fit_power


def run(engine, stiffness, difference):
    kinds = ("contact", "disk_sum", "disk_vector")
    found = {f"{kind}_relative_difference": difference for kind in kinds}
    about = {"engine": engine.lower(), "engine_name": engine}
    return about | {"stiffness": stiffness, "statistics": found}


def trends(*runs, moved=0.0, anew=()):
    far = {run["engine"]: moved for run in runs}
    return _trends(Words("analysis.studies.report.contacts", kind="force"), runs, far, frozenset(anew))


def test_engines_that_agree_share_a_sentence():
    runs = (run(e, k, d) for e in ("LAMMPS", "YADE") for k, d in ((1e7, 0.02), (1e6, 0.2)))
    (message,) = trends(*runs)
    assert message.startswith("LAMMPS and YADE: at k = 10⁶, 10⁷ N/m the relative difference is")
    assert "20 %, 2 % per contact" in message


def test_two_stiffnesses_or_other_positions_allow_no_conclusion():
    (message,) = trends(run("LAMMPS", 1e6, 0.2), run("LAMMPS", 1e7, 0.02))
    assert "fewer than 4 stiffnesses" in message
    assert "not concluded" in message
    runs = [run("LAMMPS", k, 1e5 / k) for k in (1e6, 1e7, 1e8, 1e9)]
    (message,) = trends(*runs, moved=0.031)
    assert "up to 0.031 m elsewhere" in message
    assert "cannot be concluded" in message
    assert "power" not in message


def test_runs_begun_anew_from_one_configuration_allow_a_conclusion():
    runs = [run("LAMMPS", k, 1e5 / k) for k in (1e6, 1e7, 1e8, 1e9)]
    (message,) = trends(*runs, moved=0.031, anew=["lammps"])
    assert "settled up to 0.031 m elsewhere" in message
    assert message.count("**approach each other**") == 3
    assert "same positions" not in message


def test_four_stiffnesses_on_the_same_positions_say_with_which_power():
    (message,) = trends(*(run("LAMMPS", k, 1e5 / k) for k in (1e6, 1e7, 1e8, 1e9)))
    assert "−1.00 (−1.00 to −1.00) per contact, so the models **approach each other**" in message
    assert message.count("approach each other") == 3
    (message,) = trends(*(run("LAMMPS", k, 0.3) for k in (1e6, 1e7, 1e8, 1e9)))
    assert "do not approach each other measurably" in message


def test_the_power_has_the_interval_of_its_scatter():
    """Nine in ten fits of noisy 1/k hold −1."""
    random, k = np.random.default_rng(0), np.geomspace(1e6, 1e9, 6)
    constrained = 0
    for _ in range(400):
        fit = fit_power(k, 1e5 / k * np.exp(random.normal(0, 0.5, len(k))))
        constrained += fit.low <= -1 <= fit.high
    assert constrained / 400 == pytest.approx(0.9, abs=0.04)
    assert fit_power(k[:3], 1 / k[:3]) is None
    assert fit_power(k[:4], [0.1, np.nan, 0.01, 0.001]) is None


def test_no_trend_of_one_stiffness_or_of_no_number():
    for further in ((), (np.nan,), (np.inf,)):
        runs = (run("LAMMPS", 1e7, one) for one in further)
        assert trends(run("LAMMPS", 1e6, 0.2), *runs) == []


@pytest.mark.parametrize(
    ("doors", "message"),
    [(0.8, "towards the door"), (list(opposing(6, 3)), "towards their own of 2 doors")],
)
def test_who_pushes_where(doors, message):
    drive = room("hall", 6, 3, doors, Crowd(people=6)).drive
    of_film = Words("analysis.studies.film").text("push", push=(100.0, 100.0), drive=drive)
    assert f"Everybody pushes {message} with" in of_film
