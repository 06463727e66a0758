"""Impulses of contacts, summed over the steps of an engine: as a dictionary sums them."""

import io

import numpy as np

from analysis.lammps_process.impulse_sums import ImpulseSums


class Plain:
    """The same in plain Python."""

    def __init__(self, file):
        self.file, self.sums = file, {}

    def add(self, key, x, y):
        had = self.sums.get(key, (0.0, 0.0))
        self.sums[key] = had[0] + x, had[1] + y

    def add_pairs(self, ids, forces, times):
        for (one, other), (x, y, more_x, more_y) in zip(ids.tolist(), forces.tolist(), strict=True):
            x, y = x + more_x, y + more_y
            if x or y:
                sign = times if one <= other else -times
                self.add((0, *sorted((int(one), int(other)))), sign * x, sign * y)

    def add_wall(self, wall, ids, rows, times):
        for one, (touches, x, y) in zip(ids.tolist(), rows.tolist(), strict=True):
            if touches:
                self.add((1, one, wall), times * x, times * y)

    def write(self, step):
        del step
        for (is_wall, first, second), (x, y) in sorted(self.sums.items()):
            self.file.write(f"{first} {second} {is_wall} {x!r} {y!r}\n")
        self.sums = {}


def summed(kind):
    file, draw = io.StringIO(), np.random.default_rng(3)
    sums = kind(file)
    for step in range(12):
        ids = draw.integers(1, 90, (1500, 2)).astype(float)
        forces = draw.normal(size=(1500, 4)) * (draw.random((1500, 1)) < 0.7)
        sums.add_pairs(ids, forces, -0.5e-3)
        rows = np.column_stack([draw.random(39) < 0.3, draw.normal(size=(39, 2))])
        sums.add_wall(2, np.arange(1, 40, dtype=np.int32), rows, 1e-3)
        if step % 5 == 4:
            sums.write(step)
    sums.write(12)
    return file.getvalue()


def test_the_same_sums_as_a_dictionary_has():
    """To the last digit, of more pairs than the table has room for at first."""
    lines = [line.split() for line in summed(ImpulseSums).splitlines()]
    frames = sum(line == ["ITEM:", "TIMESTEP"] for line in lines)
    rows = [[float(word) for word in line] for line in lines if len(line) == 5]
    plain = [[float(word) for word in line.split()] for line in summed(Plain).splitlines()]
    assert frames == 3
    assert len(rows) > 7000
    assert rows == plain


def test_a_pair_and_a_wall_by_hand():
    file = io.StringIO()
    sums = ImpulseSums(file)
    sums.add_pairs(np.array([[5.0, 2.0]]), np.array([[1.0, 2.0, 3.0, 4.0]]), 0.5)
    sums.add_wall(1, np.array([7], np.int32), np.array([[1.0, 8.0, -2.0]]), 0.25)
    sums.write(0)
    assert file.getvalue().splitlines()[-2:] == ["2 5 0 -2 -3", "7 1 1 2 -0.5"]
