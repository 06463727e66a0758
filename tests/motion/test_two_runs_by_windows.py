"""Two runs of one crowd by impulses over windows: known differences, counted people, refusals."""

import dataclasses
import shutil

import numpy as np
import pytest

from analysis import engines
from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows
from analysis.engines.record import RunRecord
from analysis.engines.run import simulate
from analysis.motion.pairwise import _paired, check_same_crowd, compare_windows
from analysis.scene.shipped_scenes import make


@pytest.fixture(scope="module")
def scene():
    """30 people before a door; five windows of two frames each."""
    return make("arch", disks=30).with_run(duration_s=1.0, frames=20)


@pytest.fixture(scope="module")
def rigid(scene, tmp_path_factory):
    """A rigid run of the scene."""
    folder = tmp_path_factory.mktemp("runs") / "rigid"
    simulate(scene, "rigid", folder)
    return folder


def changed(folder, to, name, change):
    """A copy of a run whose dump has other lines, sealed again."""
    shutil.copytree(folder, to)
    path = to / name
    path.write_text("".join(map(change, path.read_text().splitlines(keepends=True))))
    RunRecord.read(to).finished(to).write(to)
    return to


def grown(line):
    """A row of impulses with a tenth more in it."""
    words = line.split()
    if len(words) != 5 or not words[0].isdigit():
        return line
    return " ".join([*words[:3], *(repr(1.1 * float(word)) for word in words[3:])]) + "\n"


def test_impulses_that_are_a_tenth_larger_are_found_so(rigid, tmp_path):
    other = changed(rigid, tmp_path / "grown", "impulses.dump", grown)
    compared = compare_windows(rigid, other)
    assert [round(w.end - w.start, 9) for w in compared.windows] == [0.1] * 10
    found = compared.paired()
    for name in ("contact_largest", "contact_95", "contact_mean", "person_largest", "walls"):
        assert found[name].more == pytest.approx(0.1, abs=0.003), name
    assert found["flow"].more == found["speed_door"].more == 0.0
    busy = [w.agreement() for w in compared.windows if len(w.keys) > 10]
    assert busy
    for said in busy:
        assert said["contact_relative_difference"] == pytest.approx(0.1)
        assert said["person_relative_difference"] == pytest.approx(0.1)
        assert said["contact_correlation"] == pytest.approx(1.0)
        assert said["sum_difference"] == pytest.approx(0.1)
        assert said["contacts_only_first"] == said["contacts_only_second"] == 0


def test_one_pair_of_runs_has_numbers_and_their_autocorrelation():
    """Of which the definition is written out here; no verdict, whatever they are."""
    random = np.random.default_rng(4)
    first, apart = random.uniform(5, 6, 50), np.cumsum(random.normal(size=50))
    found = _paired(first, first + apart)
    about = apart - apart.mean()
    assert found.autocorrelation == pytest.approx(
        sum(about[n] * about[n + 1] for n in range(49)) / sum(about**2)
    )
    assert found.independent < 10
    assert found.more == pytest.approx(apart.mean() / first.mean())
    assert not hasattr(found, "verdict")
    constant = _paired(first, first * (1 + 1e-14))
    assert (constant.more, constant.relative) == (0.0, True)
    assert np.isnan(constant.autocorrelation)
    still = _paired(np.zeros(4), np.ones(4))
    assert (still.more, still.relative) == (1.0, False)


def test_flow_is_the_count_of_those_who_passed(rigid, scene):
    compared = compare_windows(rigid, rigid, 0.5)
    frames = RunWindows(rigid, RunRecord.read(rigid).time_step_s)
    out = [int((frames.at(number).position[:, 0] >= 0).sum()) for number in (0, 10, 20)]
    flows = [window.values[0]["flow"] for window in compared.windows]
    assert flows == pytest.approx(np.diff(out) / 0.5)
    late = compare_windows(rigid, rigid, last_s=0.3)
    assert [w.start for w in late.windows] == pytest.approx([0.7, 0.8, 0.9])


def test_an_engine_with_springs_and_the_rigid_one_pass_on_the_same_impulse(scene, rigid, tmp_path):
    """All of it within 0.5 s from rest, before chaos: the stiffer, the nearer."""
    if engines.engine("lammps").find() is None:
        pytest.skip("LAMMPS is not installed")
    differences = []
    for stiffness in (1e5, 1e7):
        folder = tmp_path / f"{stiffness:g}"
        short = scene.with_run(duration_s=0.5, frames=5, impulses=True)
        simulate(short.with_contact(stiffness_N_per_m=stiffness), "lammps", folder)
        sums = np.zeros(2)
        for window in compare_windows(rigid, folder).windows:
            sums += np.hypot(*np.moveaxis(window.impulses, 2, 0)).sum(1)
        differences.append(abs(sums[1] / sums[0] - 1))
    assert differences[1] < 0.1
    assert differences[1] < 0.5 * differences[0]


def test_what_is_not_alike_is_not_compared(scene, rigid, tmp_path):
    heavier = scene.snapshot.mass.copy()
    heavier[6] = 80.0
    for other, said in (
        (dataclasses.replace(scene.snapshot, mass=heavier), r"mass \(kg\) of disk 7: 80.0, not 75.0"),
        (make("arch", disks=20).snapshot, "20 people, not 30"),
    ):  # fmt: skip
        with pytest.raises(DumpError, match=said):
            check_same_crowd(
                (rigid, scene), (tmp_path, scene.model_copy(update={"snapshot": other}))
            )
    walls = scene.model_copy(update={"walls": scene.walls[:-1]})
    with pytest.raises(DumpError, match="other walls"):
        check_same_crowd((rigid, scene), (tmp_path, walls))
    check_same_crowd((rigid, scene), (tmp_path, scene.with_contact(stiffness_N_per_m=1e7)))
    with pytest.raises(DumpError, match=r"window: 0\.05 s; below 0\.1 s"):
        compare_windows(rigid, rigid, 0.05)
    later = shutil.copytree(rigid, tmp_path / "later")
    record = RunRecord.read(later)
    dataclasses.replace(record, time_step_s=1.37 * record.time_step_s).finished(later).write(later)
    with pytest.raises(DumpError, match="no two frames at instants of"):
        compare_windows(rigid, later)
