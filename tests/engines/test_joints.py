"""Friction at the joints of walls is said where a disk can slide over one. The number that says how
soft a crowd is, and what is said before a run of it."""

import logging
import re
from pathlib import Path

import numpy as np
import pytest

from analysis.compare.comparison import compare_run
from analysis.compare.study import remarks
from analysis.dumps import read_contacts
from analysis.engines.penalty import friction_at_joints
from analysis.engines.run import simulate
from analysis.engines.softness import known_bodies, rigid_over_soft, softness, softness_of

from analysis.engines.softness import softness_warning  # isort: skip
from analysis.scene.law import LAWS
from analysis.scene.scene import read_scene
from analysis.scene.schema import Analysis
from analysis.scene.shipped_scenes import make
from tests.crowds import disks_at, scene_at

INSIDE = (1.0, 1.0)
SQUARE = [((0, 0), (2, 0)), ((2, 0), (2, 2)), ((2, 2), (0, 2)), ((0, 2), (0, 0))]


def scene_of(walls, position, friction):
    contact = {"stiffness_N_per_m": 1e6, "restitution": 0.1, "friction": friction}
    run = {"duration_s": 0.1, "frames": 2}
    return scene_at(disks_at([position], radius=0.2), walls, contact=contact, run=run)


@pytest.mark.parametrize(
    ("walls", "position", "joints"),
    [
        (SQUARE, INSIDE, 0),  # corners that a disk sits in
        (SQUARE, (4.0, 1.0), 2),  # the two corners that point at it
        ([((0, 0), (1, 0)), ((1, 0), (3, 0))], INSIDE, 1),  # in line
        ([((0, 0), (3, 0)), ((1, 0), (1, -2))], INSIDE, 0),  # an end within a wall
        ([((0, 0), (3, 0))], INSIDE, 0),
    ],
)
def test_joints_that_a_disk_slides_over_are_counted(walls, position, joints):
    message = friction_at_joints(scene_of(walls, position, 0.5))
    assert bool(message) == bool(joints)
    assert not joints or message.startswith(f"friction at {joints} joints of walls")
    assert not friction_at_joints(scene_of(walls, position, 0.0))


def test_the_length_is_that_of_the_spring():
    """μF/k_t with k_t = 2/7 k or what the scene says."""
    scene = scene_of([((0, 0), (1, 0)), ((1, 0), (3, 0))], INSIDE, 0.5)
    length = 0.5 * 1000 / (scene.contact.tangential_ratio * 1e6)
    assert f"over the next {length:.2g} m (at 1000 N" in friction_at_joints(scene)
    assert np.isfinite(length)


ROOT = Path(__file__).resolve().parents[2]


def test_it_is_the_total_push_over_stiffness_times_radius():
    arch = read_scene("arch")
    radius = arch.snapshot.radius.mean()
    assert softness(arch) == pytest.approx(594 * 300 / (1e6 * radius))
    assert softness(arch, 1e4) == pytest.approx(100 * softness(arch))
    assert softness(read_scene("pair")) == 0


def test_the_ladder_of_people_is_read_softest_first():
    bodies = known_bodies()
    assert list(bodies) == ["chest", "social_force", "lemons"]
    ends = [k for one in bodies.values() for k in (one.low_N_per_m, one.high_N_per_m)]
    assert ends == sorted(ends)
    # the law of a chest, two in series, has such secants at overlaps up to 0.08 m
    overlap = np.array([0.001, 0.08])
    springs = LAWS["body"].springs(0.0, 0.0, 0.2)
    secant = springs.force(overlap, np.full(2, 0.1), np.zeros(2, bool)) / overlap
    assert ends[0] < secant[0] < secant[1] < ends[1]


def test_what_rigid_disks_overstate_is_the_table_of_the_page():
    """docs/results/rigid_or_soft.md, whose shares are of the soft over the rigid."""
    page = (ROOT / "docs/results/rigid_or_soft.md").read_text()
    table = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    head = next(row for row in table if row[:2] == ["s", "wall load per person inside"])
    rows = table[table.index(head) + 2 :][:5]
    for s, *cells in rows:
        found = rigid_over_soft(float(s), float(s))
        assert [one.words for one in found.values()] == head[1:-1]
        for one, cell in zip(found.values(), cells[:-1], strict=True):
            soft = re.findall(r"[-+−]?[\d.]+(?= %)", cell.replace("−", "-"))
            hard = [1 / (1 + float(word) / 100) - 1 for word in soft]
            assert (one.mean, one.high, one.low) == pytest.approx(hard)
    between = rigid_over_soft(9.0, 3.0)["contact_95"]
    assert between.low == rigid_over_soft(3.0, 3.0)["contact_95"].low
    assert between.high == rigid_over_soft(9.0, 9.0)["contact_95"].high
    assert rigid_over_soft(18.0, 1.0) is None
    assert rigid_over_soft(1e-9, 1e-12) == rigid_over_soft(0.35, 0.35)
    arch = read_scene("arch")
    wanted = 594 * 300 / (1.2e5 * arch.snapshot.radius.mean())
    assert softness_of(arch, known_bodies()["social_force"])[0] == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("stiffness", "message"),
    [(1e6, None), (1.2e5, "ones do. Above 17 do not use forces"), (4e4, "not valid for forces: people will be deep"),
     (1e4, "not a crowd")],
)  # fmt: skip
def test_a_soft_crowd_is_named_before_it_runs(stiffness, message):
    found = softness_warning(read_scene("arch").with_contact(stiffness_N_per_m=stiffness))
    assert found is None if message is None else message in found


def test_a_run_says_it(tmp_path, caplog, monkeypatch):
    scene = make("arch", disks=40).with_contact(stiffness_N_per_m=5e3)
    monkeypatch.setattr(logging.getLogger("analysis"), "propagate", True)
    with caplog.at_level(logging.WARNING, logger="analysis"):
        simulate(scene.with_run(duration_s=0.02, frames=2), "lammps", tmp_path / "run")
    assert "s = 14 times stiffness times radius" in caplog.text


@pytest.mark.parametrize(("stiffness", "marked"), [(3e4, True), (1e6, False)])
def test_a_soft_snapshot_is_marked_as_not_comparable(tmp_path, stiffness, marked):
    """Where one overlap in twenty is deeper than 0.03 r, by the engine's own dump."""
    scene = make("arch", disks=40).with_contact(stiffness_N_per_m=stiffness)
    scene = scene.with_run(duration_s=0.6, frames=2)
    scene = scene.model_copy(update={"analysis": Analysis(kind="driven", time_s=0.6)})
    simulate(scene, "lammps", tmp_path / "run")
    found = compare_run(tmp_path / "run")
    *_, last = read_contacts(tmp_path / "run" / "contacts.dump")
    overlap = last.overlap[last.overlap > 0] / scene.snapshot.radius.mean()
    assert (np.quantile(overlap, 0.95) > 0.03) == marked
    assert any("too soft to compare" in words for words in remarks(found)) == marked
