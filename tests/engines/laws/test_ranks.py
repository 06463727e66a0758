"""LAMMPS on several ranks of MPI: the run of one. LAMMPS' raw contact dumps as the one dump of
contacts: the limit of friction, by hand."""

import numpy as np
import pytest

from analysis.dumps import index_dump, open_bodies, read_contacts
from analysis.engines.lammps import merge_contacts
from analysis.engines.penalty import penalty_of
from analysis.engines.record import EngineError
from analysis.engines.run import run_engine
from analysis.scene.shipped_scenes import make
from analysis.support.write_frames import write_frame
from tests.crowds import disks_at, scene_at, spaced


def test_two_ranks_give_the_run_of_one(tmp_path):
    """Pressed before a door: positions, forces and contacts."""
    scene = make("arch", 60).with_run(duration_s=0.4, frames=2)
    for ranks in (1, 2):
        run_engine(scene, "lammps", tmp_path / str(ranks), ranks=ranks)
    log = (tmp_path / "2" / "log.lammps").read_text()
    assert "fix shares all balance" in log
    bodies = [open_bodies(tmp_path / name / "bodies.dump").trajectory for name in "12"]
    for alone, shared in zip(*bodies, strict=True):
        for column, maximum in (("x", 1e-9), ("y", 1e-9), ("fx", 1e-2), ("fy", 1e-2)):
            np.testing.assert_allclose(shared.data[column], alone.data[column], rtol=0, atol=maximum)
    ends = [list(read_contacts(tmp_path / n / "contacts.dump"))[-1] for n in "12"]
    assert len(ends[0]) > 10
    np.testing.assert_array_equal(ends[0].second, ends[1].second)
    np.testing.assert_allclose(ends[0].force, ends[1].force, rtol=0, atol=1e-2)


def test_what_is_not_shared(tmp_path):
    scene = make("arch", 20).with_run(duration_s=0.1, frames=1)
    with pytest.raises(EngineError, match="ranks: 2, but yade runs on one core"):
        run_engine(scene, "yade", tmp_path / "yade", ranks=2)
    with pytest.raises(EngineError, match=r"ranks: run\.impulses: .* on one rank only"):
        run_engine(scene.with_run(impulses=True), "lammps", tmp_path / "run", ranks=2)
    with pytest.raises(EngineError, match=r"ranks: drive\.time_gap_s: .* on one rank only"):
        run_engine(spaced(scene), "lammps", tmp_path / "run", ranks=2)
    assert not list(tmp_path.rglob("run.json"))


FRICTION, OVERLAP = 0.4, 0.01
BODIES = ["id", "type", "x", "y", "z", "radius", "mass", "vx", "vy", "vz", "omegaz", "fx", "fy"]
RAW = [f"c_ids[{number}]" for number in (1, 2)] + [
    f"c_contacts[{number}]" for number in range(1, 8)
]


def pressed(tmp_path, tangential, at_end):
    """What merge_contacts gives of two disks at rest, first left of second, that overlap by 1 cm:
    its row; tangential (2,) N and the normal force at_end (N) are those of LAMMPS on the first."""
    position = np.array([[0.0, 0.0], [0.5 - OVERLAP, 0.0]])
    snapshot = disks_at(position)
    contact = {"stiffness_N_per_m": 1e5, "restitution": 0.5, "friction": FRICTION}
    scene = scene_at(snapshot, contact=contact, run={"duration_s": 0.1, "frames": 1})
    none = np.zeros(2)
    table = [[1, 2], [1, 1], *position.T, none, [0.25, 0.25], [75.0, 75.0], *[none] * 6]
    with (tmp_path / "bodies.dump").open("w") as file:
        write_frame(file, "ATOMS", 0, BODIES, table)
    row = [1, 2, 0.5 - OVERLAP, -at_end, 0.0, *tangential, -(0.5 - OVERLAP), 0.0]
    with (tmp_path / "pairs.dump").open("w") as file:
        write_frame(file, "ENTRIES", 0, RAW, [[value] for value in row])
    merge_contacts(tmp_path, scene)
    return index_dump(tmp_path / "contacts.dump", "ENTRIES").table(0)[0], penalty_of(scene)


@pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-300, 1.0, 1e6, 1e300])
@pytest.mark.parametrize("angle", [0.5, 0.25, 1.5])
def test_a_contact_that_slides_holds_mu_times_its_normal_force_however_little_it_held(
    tmp_path, size, angle
):
    # nothing pressed at the end of the step, by LAMMPS: whatever holds is beyond that limit
    way = np.array([np.cos(np.pi * angle), np.sin(np.pi * angle)])
    tangential = np.where(np.abs(way) > 1e-9, np.sign(way) * size, 0.0)
    row, law = pressed(tmp_path, tangential, at_end=0.0)
    normal = law.stiffness * OVERLAP
    along = np.sign(tangential) / np.hypot(*np.sign(tangential))
    # of what the second exerts on the first the dump has the reverse
    expected = np.array([normal, 0.0]) - FRICTION * normal * along
    np.testing.assert_allclose(row[-2:], expected, rtol=1e-12, atol=1e-9 * normal)


@pytest.mark.parametrize("fraction", [0.0, 5e-324, 1e-12, 0.5])
def test_a_contact_that_sticks_keeps_its_tangential_force(tmp_path, fraction):
    normal = 1e5 * OVERLAP
    tangential = np.array([0.0, fraction * FRICTION * normal])
    row, law = pressed(tmp_path, tangential, at_end=normal)
    assert law.stiffness * OVERLAP == pytest.approx(normal)
    np.testing.assert_allclose(row[-2:], [normal, -tangential[1]], rtol=1e-12, atol=0.0)
