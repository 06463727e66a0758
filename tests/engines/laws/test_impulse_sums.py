"""Impulses of contacts summed in Python and by the compiled table: the same numbers."""

import io

import numpy as np

from analysis.lammps_process.impulse_sums import ImpulseSums


def summed(few):
    file, draw = io.StringIO(), np.random.default_rng(3)
    sums = ImpulseSums(file, few)
    for step in range(12):
        ids = draw.integers(1, 40, (60, 2)).astype(float)
        forces = draw.normal(size=(60, 4)) * (draw.random((60, 1)) < 0.7)
        sums.add_pairs(ids, forces, -0.5e-3)
        rows = np.column_stack([draw.random(39) < 0.3, draw.normal(size=(39, 2))])
        sums.add_wall(2, np.arange(1, 40, dtype=np.int32), rows, 1e-3)
        if step % 5 == 4:
            sums.write(step)
    sums.write(12)
    return file.getvalue()


def test_both_ways_write_the_same_to_the_last_digit():
    python = summed(10**9)
    assert python.count("ITEM: TIMESTEP") == 3
    assert len(python.splitlines()) > 500
    for few in (0, 300, 500):  # from the start, in the first window, on its end
        assert summed(few) == python


def test_a_pair_and_a_wall_by_hand():
    file = io.StringIO()
    sums = ImpulseSums(file)
    sums.add_pairs(np.array([[5.0, 2.0]]), np.array([[1.0, 2.0, 3.0, 4.0]]), 0.5)
    sums.add_wall(1, np.array([7]), np.array([[1.0, 8.0, -2.0]]), 0.25)
    sums.write(0)
    assert file.getvalue().splitlines()[-2:] == ["2 5 0 -2 -3", "7 1 1 2 -0.5"]
