"""The study of barrier loads: its crowd stands as deep as it says, and what is steady is no shock."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.crowds.barrier import Case, depth_of, loads, measured


@pytest.mark.parametrize("depth", [2.0, 5.0])
def test_the_depth_of_an_even_crowd(depth):
    index = np.stack([-(np.arange(1000) + 0.5) / 1000 * depth, np.zeros(1000)], axis=1)
    window = SimpleNamespace(now=SimpleNamespace(position=index))
    assert depth_of(window) == pytest.approx(depth, rel=1e-3)


def test_a_pressed_crowd_keeps_its_depth_passes_its_push_on_and_arrives_with_a_shock(tmp_path):
    """Equilibrium: pressed, the whole wall carries people times push. The row's own numbers: a push of
    355 N, of which 316 N are the weight of 76.3 kg along 25 degrees."""
    case = Case(slope=25, load=2000.0, model="rigid", wider=1.336)
    assert case.push == pytest.approx(355, abs=0.5)
    assert case.push - case.walk == pytest.approx(76.3 * 9.80665 * 0.42262, rel=1e-4)
    run = case.run(1, tmp_path)
    depth, full, worst, _, arrival, shock = measured(case, run)
    assert depth == pytest.approx(case.depth, rel=0.1)
    assert full == pytest.approx(23 * case.push / (4 * 2000.0), rel=2e-3)
    assert 1.0 < worst < shock
    assert arrival > 1.1
    end, load, _ = loads(run)
    assert end[-1] == pytest.approx(8.0)
    assert load[end < 0.3].mean() < 0.5 * 2000.0
