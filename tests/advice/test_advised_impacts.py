"""What advice promises of engines in impacts that its library knows nothing like, against runs."""

import pytest

from analysis.scene.shipped_scenes import make
from analysis.studies.advice.candidates import Question
from analysis.studies.advice.choice import advise, headline
from analysis.studies.advice.library import stored_library
from analysis.studies.work_precision.chart import measure
from analysis.studies.work_precision.point import Method
from analysis.studies.work_precision.window import impact_window
from analysis.support.parallel import workers
from benchmarks.advice_cases import IMPACTS
from tests.engines.at_hand import require

pytestmark = pytest.mark.long

SHARES = (0.25, 1.0, 4.0)


@pytest.fixture(scope="module")
def pool():
    with workers(1) as executor:
        yield executor


@pytest.mark.parametrize(
    ("name", "engine"),
    [
        ("pair_hertz", "lammps"), ("chain_12_e0.5", "lammps"), ("crowd_10", "lammps"),
        ("corridor_e0.6", "lammps"), ("crowd_10", "yade"), ],
)
def test_a_promise_is_kept_and_not_ten_times_what_is_measured(name, engine, pool, tmp_path):
    require(engine)
    scene = IMPACTS[name]()
    fractions = SHARES if engine == "lammps" else SHARES[1:2]
    window, stiffness = impact_window(scene), scene.contact.stiffness_N_per_m
    settings = [
        Method(
            method=engine, law=scene.contact.law, stiffness_N_per_m=stiffness, time_step_share=ratio
        )
        for ratio in fractions
    ]
    points = measure(window, name, settings, tmp_path, pool).points
    measured = {
        p.time_step_share: p.numerical_error
        for p in points
        if p.method == engine and p.quantity.startswith("disk")
    }
    question = Question(error=0.9, against="model", methods=(engine,))
    advice = advise(scene, question, library=stored_library())
    promised = {c.time_step_share: c.promised_error for c in advice.found}
    for fraction in fractions:
        assert 1 <= promised[fraction] / measured[fraction] <= 3, fraction


@pytest.mark.parametrize("name", ["chain_8_hertz", "chain_masses_15_e0.7", "corridor_e0.3"])
def test_two_per_cent_of_an_engines_own_model_is_not_refused(name):
    advice = advise(
        IMPACTS[name](),
        Question(error=0.02, against="model", methods=("lammps",)),
        library=stored_library(),
    )
    assert advice.tried
    assert advice.choice is not None
    assert advice.choice.promised_error <= 0.02


@pytest.mark.parametrize("name", ["four_disks_e0.9", "crowd_40_e0.8", "chain_masses_15_e0.7"])
def test_the_rigid_model_has_no_error_of_restitution(name):
    """Against itself with the scene's e the rigid model has a numerical error alone; an engine has
    more, since contacts that are loaded at once are no succession of collisions."""
    scene = IMPACTS[name]()
    advice = advise(scene, Question(error=1e-4), library=stored_library())
    assert advice.choice.method == "rigid"
    assert advice.choice.model_error == 0
    assert min(c.promised_error for c in advice.found if c.method == "rigid") < 1e-6
    assert min(c.model_error for c in advice.found if c.law) > 0.05


def test_a_crowd_that_is_too_large_to_try_is_promised_nothing():
    question = Question(error=0.5, against="model", methods=("lammps",))
    advice = advise(make("chain", 700), question, library=stored_library())
    assert advice.choice is None
    assert not advice.tried
    assert "more than 600 disks" in headline(advice)
