"""The stress of an engine's contact forces balances what its disks gain."""

import numpy as np
import pytest

from analysis.compare.comparison import compare_run
from analysis.compare.statistics import stresses
from analysis.dumps import index_dump
from analysis.engines.run import simulate
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from nscd.stress import Kernel, smear
from tests.engines.at_hand import require

KERNEL = Kernel(width=0.4, cutoff=9.0)


def compared(name, scene, folder):
    require(name)
    simulate(scene, name, folder)
    return folder


@pytest.mark.parametrize("name", ["lammps", "yade"])
def test_a_driven_crowd(name, tmp_path):
    """Σ(ma − F_drive)φ = div Σ + t with the engine's own forces, in N/m²; without the walls'
    traction it fails."""
    scene = make("arch", 60).with_run(duration_s=1.0, frames=2)
    folder = compared(name, scene, tmp_path / name)
    found = compare_run(folder, time=1.0)
    assert found.unit == "N"
    index = index_dump(folder / "bodies.dump")
    column = dict(zip(index.columns, index.table(len(index.steps) - 1).T, strict=True))
    order = np.argsort(column["id"])
    gained = np.column_stack([column["fx"] - column["drive_x"], column["fy"] - column["drive_y"]])[
        order
    ]
    position = found.snapshot.position
    at = position[::3] + 0.1
    penalty, _ = stresses(found, KERNEL, at)
    expected, _ = smear(position, gained, KERNEL, at)
    size = np.abs(expected).max()
    assert size > 10
    np.testing.assert_allclose(penalty.divergence + penalty.traction, expected, atol=1e-6 * size)
    assert np.abs(penalty.divergence - expected).max() > 0.05 * size


def test_an_impact_has_stress_of_the_same_unit(tmp_path):
    """Four disks in line, strongly damped: ∫f dt and p, both N·s/m, carry nearly the same; the
    whole is −Σ p ⊗ ℓ."""
    scene = read_scene("four_disks").with_contact(stiffness_N_per_m=1e6, restitution=0.0)
    scene = scene.with_run(frames=2500)
    found = compare_run(compared("lammps", scene, tmp_path / "lammps"))
    assert found.unit == "N·s"
    axis = np.arange(-6, 8, 0.2)
    at = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2) + found.snapshot.position.mean(0)
    penalty, rigid = stresses(found, KERNEL, at)
    spacing = np.diff(np.sort(found.snapshot.position[:, 0]))[0]
    whole = -spacing * found.match.rigid[:, 0].sum()
    assert rigid.stress.sum(0)[0, 0] * 0.2**2 == pytest.approx(whole, rel=1e-6)
    assert np.linalg.norm(penalty.stress - rigid.stress) < 0.05 * np.linalg.norm(rigid.stress)
