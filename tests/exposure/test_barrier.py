"""The study of barrier loads: its crowd stands as deep as it says, and what is steady is no shock."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.crowds.barrier import Case, depth_of, loads, measured


@pytest.mark.parametrize("depth", [2.0, 5.0])
def test_the_depth_of_an_even_crowd(depth):
    place = np.stack([-(np.arange(1000) + 0.5) / 1000 * depth, np.zeros(1000)], axis=1)
    window = SimpleNamespace(now=SimpleNamespace(position=place))
    assert depth_of(window) == pytest.approx(depth, rel=1e-3)


def test_a_pressed_crowd_passes_its_push_on_and_arrives_with_a_shock(tmp_path):
    """Equilibrium: pressed, the whole wall carries people times push."""
    case = Case(depth=2.0, people=73, push=1000 * 8 / 73, model="rigid")
    run = case.run(1, tmp_path)
    depth, whole, worst, _, arrival, shock = measured(case, run)
    assert depth == pytest.approx(2.0, rel=0.15)
    assert whole == pytest.approx(1.0, abs=0.02)
    assert 1.0 < worst < shock
    assert arrival > 1.1
    end, load, _ = loads(run)
    assert end[-1] == pytest.approx(case.press_s + 4.0)
    assert load[end < 0.5].mean() < 0.5 * 2000.0
