"""What an engine wrote is checked whatever its exit status says."""

import dataclasses
import re

import numpy as np
import pytest

from analysis.engines import EngineError
from analysis.engines.check_run import check_bodies, check_contacts
from analysis.engines.guard import energy_besides
from analysis.engines.run import run_engine
from analysis.scene.scene import read_scene
from tests.engines.at_hand import require
from tests.engines.test_guard import disks, timing


@pytest.fixture(scope="module")
def pair_run(tmp_path_factory):
    """A sound run of two disks, for dumps to damage."""
    require("lammps")
    folder = tmp_path_factory.mktemp("pair") / "run"
    scene = timing(read_scene("pair"), 1e-4, 0.1, 20)
    return folder, run_engine(scene, "lammps", folder), scene


def test_dumps_are_read_whatever_the_status(tmp_path, pair_run):
    """Frames that are cut off, a contact too deep, energy that comes back after it was lost: each
    is found."""
    folder, record, scene = pair_run
    energies = check_bodies(folder / "bodies.dump", record, scene)
    assert energies[0, 0] == pytest.approx(0.5 * 75 * 2**2)
    check_contacts(folder / "contacts.dump", energies, record, scene)
    text = (folder / "bodies.dump").read_text()
    cut = tmp_path / "bodies.dump"
    cut.write_text(text[: text.rindex("ITEM: TIMESTEP")])
    with pytest.raises(EngineError, match="20 frames where 21 are due"):
        check_bodies(cut, record, scene)
    again = energies.copy()
    again[:, -1] = energies[:, 0]
    with pytest.raises(EngineError, match=r"t = 0\.1 s .*energy .* 150 J where at most 7[56]"):
        check_contacts(folder / "contacts.dump", again, record, scene)
    small = disks(scene, radius=np.full(2, 3e-4))
    with pytest.raises(EngineError, match=r"overlap: two centres are .* m apart"):
        check_contacts(folder / "contacts.dump", energies, record, small)
    with pytest.raises(EngineError, match="1 of 3 disks are lost"):
        check_bodies(folder / "bodies.dump", dataclasses.replace(record, disks=3), scene)


@pytest.mark.parametrize(
    ("name", "column", "value", "says"),
    [
        ("bodies", "id", "7", "id: not those of the scene's disks"),
        ("bodies", "radius", "0.3", "radius: not those"),
        ("bodies", "mass", "80", "mass: not those"),
        ("bodies", "x", "9", r"t = 0 s \(step 0\).* x: not those"),
        ("contacts", "first", "7", "a contact of a disk that is not there"),
        ("contacts", "second", "-7", "a contact of a disk that is not there"),
    ],
)
def test_dumps_of_other_disks_are_refused(tmp_path, pair_run, name, column, value, says):
    folder, record, scene = pair_run
    lines = (folder / f"{name}.dump").read_text().splitlines()
    positions = [at for at, line in enumerate(lines[:-1]) if re.match("ITEM: (ATOMS|ENTR)", line)]
    at = next(at for at in positions if not lines[at + 1].startswith("ITEM"))
    row = lines[at + 1].split()
    row[lines[at].split()[2:].index(column)] = value
    lines[at + 1] = " ".join(row)
    (tmp_path / f"{name}.dump").write_text("\n".join(lines) + "\n")
    energies = check_bodies(folder / "bodies.dump", record, scene)
    inputs = (record, scene) if name == "bodies" else (energies, record, scene)
    check = check_bodies if name == "bodies" else check_contacts
    with pytest.raises(EngineError, match=says):
        check(tmp_path / f"{name}.dump", *inputs)


def test_missing_columns_of_a_dump_are_named(tmp_path, pair_run):
    folder, record, scene = pair_run
    text = (folder / "bodies.dump").read_text().replace(" vx ", " other ")
    (tmp_path / "bodies.dump").write_text(text)
    with pytest.raises(EngineError, match=r"bodies\.dump: missing columns: vx"):
        check_bodies(tmp_path / "bodies.dump", record, scene)


def test_energy_besides_the_motion_is_that_of_overlaps_and_spins():
    """½ k δ² of one pair; ⅖ K √R δ^2.5 by integrating the force; ½ (½ m r²) ω² a spin."""
    scene = disks(read_scene("pair"), position=np.array([[0.0, 0.0], [0.4, 0.0]]))
    assert energy_besides(scene) == pytest.approx(0.5 * 1e6 * 0.1**2)
    difference = np.array([[0.0, 0.0], [9.0, 0.0]])
    spinning = disks(read_scene("pair"), position=difference, spin=np.array([3.0, 0.0]))
    assert energy_besides(spinning) == pytest.approx(0.25 * 75 * 0.25**2 * 9)
    # tangent stiffness 1e6 at an overlap of 1 % of the mean radius, R_eff = r/2
    overlap = np.linspace(0.0, 0.1, 20001)
    force = 1e6 / 1.5 / np.sqrt(0.01 * 0.25) * overlap**1.5
    expected = float(((force[1:] + force[:-1]) / 2 * np.diff(overlap)).sum())
    assert energy_besides(scene.with_contact(law="hertz")) == pytest.approx(expected, rel=1e-5)
