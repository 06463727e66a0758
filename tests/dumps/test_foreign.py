"""What a command cannot show of dumps that no engine here wrote: digits of text, Python, binary."""

import struct

import numpy as np
import pytest
from MDAnalysis.transformations import translate

from analysis.dumps import DumpError, open_bodies
from analysis.dumps.last_digits import LastDigit
from analysis.percussions import PercussionAnalysis
from tests.crowds import frame

STACK = [
    [1, 2, 0, 0, 0.25, 75, 0, 0],
    [2, 1, 0, 0.5, 0.25, 75, 0, 0],
    [3, 1, 0, 1, 0.25, 75, 0, -1],
]
COLUMNS = "id type x y radius mass vx vy"


@pytest.mark.parametrize("write", ["%g", "%.4e", "%.5f", "%.3f", "%.8g"])
@pytest.mark.parametrize("far", [0.05, 3.0, 70.0, 4000.0])
def test_a_last_digit_is_no_finer_than_the_text_and_at_most_ten_times_coarser(write, far):
    exact = far * np.random.default_rng(1).uniform(-1, 1, 200)
    words = [write % x for x in exact]
    wrong = np.abs(np.array(words, dtype=float) - exact).max()
    step = LastDigit.of(words).step(far)
    assert 2 * wrong * (1 - 1e-6) <= step <= 20 * wrong


@pytest.mark.parametrize(
    "words",
    [["0", "0.5", "1"], ["-0.75", "-0.25", "0.25", "0.75"], ["0.125", "1.625"], ["nan"], []],
)
def test_few_short_numbers_are_exact(words):
    assert LastDigit.of(words) is None


def test_python_takes_fixed_types_trajectories_and_no_transformations(tmp_path):
    path = tmp_path / "hit.dump"
    path.write_text(frame(0, STACK, COLUMNS))
    universe = open_bodies(path, fixed_type=[2])
    for inputs in (universe, universe.trajectory):
        results = PercussionAnalysis(inputs).run().results
        assert results.percussions[0].reaction == pytest.approx([75, 75])
        assert results.ids[0].tolist() == [2, 3]
    with pytest.raises(ValueError, match=r"AtomGroup\. A Universe of all disks is needed"):
        PercussionAnalysis(universe.atoms)
    universe.trajectory.add_transformations(translate([1, 0, 0]))
    with pytest.raises(ValueError, match="universe: it has transformations"):
        PercussionAnalysis(universe)
    with pytest.raises(DumpError, match=r"mol: 'loose'\. There are: rigid, single"):
        open_bodies(path, mol="loose")


def test_a_binary_dump_is_exact_and_says_its_units(tmp_path):
    path, names = tmp_path / "pair.bin", b"id x y radius mass vx vy"
    rows = [1, 12.123456, 0, 25, 75000, 100, 0, 2, 62.123457, 0, 25, 75000, 0, 0]
    head = struct.pack("<q10siiqqi6i6di", -10, b"DUMPCUSTOM", 1, 2, 0, 2, 0, *[1] * 6,
                       *[-99, 99] * 3, 7)  # fmt: skip
    parts = [head, struct.pack("<i", 3), b"cgs", b"\0", struct.pack("<i", len(names)), names]
    path.write_bytes(b"".join([*parts, struct.pack("<ii", 1, 14), struct.pack("<14d", *rows)]))
    analysis = PercussionAnalysis(open_bodies(path), contact_tolerance=1e-7).run()
    assert analysis.results.percussions[0].reaction == pytest.approx([37.5])  # N·s, by momentum
    assert analysis.setting.digits is None
