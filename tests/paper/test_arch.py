"""Figs. 4 and 5: forces on people against closed forms, verdicts against made-up crowds, sections
from small ones."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.engines import PENALTY, EngineError
from analysis.engines import run as engine_runs
from analysis.pages.section import Verdict
from analysis.pages.words import Words
from analysis.scene.scene import Wall
from analysis.scene.shipped_scenes import make
from analysis.studies.paper.discrete import fig4_arch, fig5_masses, pressed_crowd
from analysis.studies.paper.discrete.pressed_crowd import Arch, grown
from tests.crowds import disks_at
from tests.pages.browser import says_little

WORDS = Words("analysis.studies.paper.discrete.fig4_arch")
FORCE = 75.0 * 2.0 / 0.5  # N, the drive of one person


def queue(n=6, mass=75.0):
    """n touching disks in a line, who press each other and the first the closed exit."""
    scene = make("arch", n)
    position = np.column_stack([-0.25 - 0.5 * np.arange(n), np.zeros(n)])
    snapshot = disks_at(position, mass=mass)
    closed = Wall(name="closed", start_m=(0.0, -9.0), end_m=(0.0, 9.0))
    return Arch.of(scene.model_copy(update={"walls": (closed,)}), snapshot)


def free_chain(n=5):
    """Touching disks before an open exit, none of whom is in the way of another."""
    return Arch.of(make("arch", n).model_copy(update={"walls": ()}), queue(n).snapshot)


def sample(**changes):
    """A made-up arch; only what a test is about differs."""
    known = {
        "people": 594, "seed": 1, "solved": True, "contacts": 1100, "opening": 50, "redundant": 3,
        "overlap_share": 0.03, "reach_m": 6.4, "mean_N": 6e3, "largest_N": 3e4,
        "lower_N": 3e4, "upper_N": 3e4, "distance_m": 1.0, "angle_degrees": 0.0,
        "largest_contact_N": 1e4, "contact_distance_m": 1.0, "largest_resultant_N": 500.0,
        "resultant_distance_m": 1.0, "profile": (2.0, 1.0, 0.5),
    }  # fmt: skip
    return known | changes


@pytest.mark.parametrize("mass", [75.0, np.array([50.0, 93, 61, 75, 88, 52])])
def test_a_queue_carries_what_is_behind_each(mass):
    """Chain against a wall: contact i carries Σ m u/τ of all behind it; the vector sum is a
    person's own drive."""
    arch = queue(mass=mass)
    drive = np.broadcast_to(mass, (6,)) * 2.0 / 0.5
    front = np.cumsum(drive[::-1])[::-1]
    behind = front - drive
    np.testing.assert_allclose(arch.carried(), front + behind, rtol=1e-10)
    np.testing.assert_allclose(arch.resultants(), drive, rtol=1e-10)
    assert arch.person_of_most(arch.carried()) == 0
    np.testing.assert_allclose(arch.distance(), 0.25 + 0.5 * np.arange(6))
    np.testing.assert_allclose(arch.angle_degrees(), 0, atol=1e-12)
    np.testing.assert_array_equal(arch.rings(), [0, 0, 1, 1, 2, 2])


def test_a_queue_in_numbers():
    """Its maximum 11 · 300 N is determined and lies at the exit."""
    found = fig4_arch.sample_of(queue(), 7)
    assert found["largest_N"] == pytest.approx(11 * FORCE, rel=1e-10)
    assert (found["lower_N"], found["upper_N"]) == pytest.approx((11 * FORCE, 11 * FORCE), rel=1e-7)
    assert found["mean_N"] == pytest.approx(6 * FORCE, rel=1e-10)
    assert found["largest_contact_N"] == pytest.approx(6 * FORCE, rel=1e-10)
    assert found["contact_distance_m"] == pytest.approx(0.0, abs=1e-12)
    assert (found["redundant"], found["overlap_share"], found["solved"]) == (0, 0.0, True)
    np.testing.assert_allclose(found["profile"], np.array([10, 6, 2]) / 6, rtol=1e-10)


def test_people_beyond_the_exit_are_left_out():
    arch = queue(4)
    moved = replace(arch.snapshot, position=arch.snapshot.position + np.array([1.0, 0.0]))
    gone = replace(arch, snapshot=moved)
    np.testing.assert_array_equal(gone.inside(), [False, False, True, True])
    assert gone.person_of_most(np.array([9.0, 8.0, 1.0, 2.0])) == 3
    np.testing.assert_array_equal(gone.rings(), [-1, -1, 0, 0])


def test_maintained_contacts_push_where_all_close_and_pull_where_they_would_open():
    """Two disks of 75 kg, only one driven away from the other: 75 N·s would be needed to keep them
    together: 150 N."""
    assert (fig4_arch.maintained_forces(queue()) > 0).all()
    arch = free_chain(2)
    arch = replace(arch, left_velocity=np.array([[2.0, 0.0], [0.0, 0.0]]))
    assert fig4_arch.maintained_forces(arch) == pytest.approx([-75.0 / 0.5], rel=1e-10)


def test_dissipation_of_a_pair():
    """Head-on along the axis: p = m_eff (1+e) U, e = max(0, (k − m_eff)/(k + m_eff)); energy −(1 −
    e²) m_eff U²/2."""
    arch = replace(free_chain(2), left_velocity=np.array([[0.0, 0.0], [2.0, 0.0]]))
    for trial in fig4_arch.dissipation_trials(arch, [0.0, 10.0, 37.5, 75.0, 375.0]):
        e = max(0.0, (trial.dissipation - 37.5) / (trial.dissipation + 37.5))
        assert trial.forces[0] == pytest.approx(75.0 * (1 + e) / 0.5, rel=1e-8)
        assert trial.energy_share == pytest.approx(-0.5 * (1 - e * e), abs=1e-8)
        assert trial.reactions[0] <= trial.forces[0] + 1e-6


@pytest.mark.parametrize(
    ("distances", "verdict"),
    [((0.5, 1.4, 1.5), "HOLDS"), ((0.5, 1.4, 1.6), "PARTLY"), ((0.5, 1.6, 5.0), "FAILS")],
)
def test_where_the_maximum_lies(distances, verdict):
    samples = [sample(distance_m=d) for d in distances]
    claim = fig4_arch.position_claim(WORDS, {"made up": samples}, "distance_m", "the sum")
    assert claim.verdict.name == verdict
    assert f"the median {np.median(distances):.2f} m" in claim.reason


def test_a_reading_that_holds_in_one_kind_of_crowd_holds_in_part():
    near, far = [sample(distance_m=1.0)] * 2, [sample(distance_m=5.0)] * 2
    claim = fig4_arch.position_claim(WORDS, {"heaps": near, "flowing": far}, "distance_m", "the sum")
    assert claim.verdict == Verdict.PARTLY
    assert "2 heaps: holds. " in claim.reason
    assert "2 flowing: does not hold. " in claim.reason
    for samples, verdict in ((near, Verdict.HOLDS), (far, Verdict.FAILS)):
        both = {"heaps": samples, "flowing": samples}
        assert fig4_arch.position_claim(WORDS, both, "distance_m", "the sum").verdict == verdict


@pytest.mark.parametrize(
    ("fixed", "every", "verdict"),
    [(1e-5, 0.05, Verdict.HOLDS), (1e-5, 0.3, Verdict.PARTLY), (0.4, 0.05, Verdict.FAILS)],
)
def test_percussions_as_contact_forces(monkeypatch, fixed, every, verdict):
    """The softer contacts (first) may differ where mechanics fixes nothing, the stiffest not."""

    def statistics(contact):
        kinds = {"determined": fixed, "contact": contact, "disk_vector": fixed}
        fractions = {f"{kind}_relative_difference": fraction for kind, fraction in kinds.items()}
        return {"determined_contacts": 2, "rigid_contacts": 9, **fractions}

    def run(contact):
        return SimpleNamespace(balance=SimpleNamespace(unbalanced=1e-5), contact=contact)

    monkeypatch.setattr(fig4_arch, "statistics", lambda run: statistics(run.contact))
    claim = fig4_arch.contact_forces(WORDS, "made up", {1e7: [run(every)], 1e6: [run(0.5)] * 2})
    assert claim.verdict == verdict
    assert "at the 4 of 18 contacts" in claim.reason


def test_heaps_touch_without_overlap_and_open():
    """Just rigid: two contacts per disk, walls and the shut exit counted; the exit's are gone."""
    for seed in (1, 2):
        arch = grown(200, seed)
        assert arch.solution.status == "solved"
        assert arch.overlap_share() < 1e-9
        assert 1.9 < len(arch.contacts) / 200 < 2.0
        assert arch.opening() > 0
        assert arch.inside().all()


@pytest.mark.parametrize(
    ("peaks", "verdict"),
    [((0, 0, 0), Verdict.HOLDS), ((0, 1, 2), Verdict.PARTLY), ((2, 2, 0), Verdict.FAILS)],
)
def test_where_the_mean_is_largest(peaks, verdict):
    samples = [sample(profile=tuple(np.eye(3)[peak] + 1.0)) for peak in peaks]
    claim = fig4_arch.rings(WORDS, {"made up": samples})
    assert claim.verdict == verdict


def test_uniformity():
    """The same for all: uniform. Falling by three quarters: not. By a fifth, without scatter: in
    part."""
    arch = queue(40)
    distance = arch.distance()
    near = replace(arch.snapshot, position=arch.snapshot.position * 0.3)
    rings = replace(arch, snapshot=near)
    for values, verdict in (
        (np.full(40, 2.0), Verdict.FAILS),
        (np.random.default_rng(0).uniform(1, 2, 40), Verdict.FAILS),
        (4.0 - 3.0 * distance / distance.max(), Verdict.HOLDS),
        (1.0 - 0.2 * distance / distance.max(), Verdict.PARTLY),
    ):
        assert fig5_masses.uniformity(rings, values).verdict == verdict


def test_unsolved_and_unproven_arches_are_named():
    bad = sample(seed=4, solved=False), sample(seed=9, lower_N=np.nan)
    first, second = fig4_arch.warnings_of([sample(), *bad])
    assert "seed 4" in first
    assert "seed 9" in second
    assert fig4_arch.warnings_of([sample()]) == []


@pytest.fixture
def small(monkeypatch):
    """Everything with 60 people."""
    monkeypatch.setattr(fig4_arch, "PEOPLE", 60)
    monkeypatch.setattr(fig4_arch, "SEEDS", range(1, 3))
    monkeypatch.setattr(fig4_arch, "SIZES", {30: 2})
    monkeypatch.setattr(pressed_crowd, "BLOCKED_SEEDS", ())
    brief = lambda name: make(name, 60).with_run(duration_s=1.0, frames=2)  # noqa: E731
    for module in (fig4_arch, fig5_masses):
        monkeypatch.setattr(module, "read_scene", brief)


def build(runs, progress=None):
    return [fig4_arch.build(runs, progress), fig5_masses.build(runs)]


@pytest.mark.long
def test_sections_from_a_small_crowd(small, tmp_path):
    """Both sections whole; a second build takes the runs as they are and says the same."""
    if all(engine.find() is None for engine in PENALTY):
        pytest.skip("no engine is installed")
    steps = []
    first = build(tmp_path, lambda label, fraction: steps.append((label, fraction)))
    runs = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("run.json")}
    second = build(tmp_path)
    assert runs == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("run.json")}
    assert [s.number for s in first] == ["4", "5"]
    for one, other in zip(first, second, strict=True):
        assert [c.reason for c in one.claims] == [c.reason for c in other.claims]
        assert list(one.words) == list(other.words)
        for table in one.tables:
            assert table.rows
            assert all(len(row) == len(table.head) for row in table.rows)
    assert steps[-1][1] == pytest.approx(1.0)
    names = [picture.name for section in first for picture in section.pictures]
    assert len(set(names)) == len(names)
    for section in first:
        says_little(section, tmp_path)
        for picture in section.pictures:
            picture.figure.savefig(tmp_path / f"{picture.name}.png", dpi=40)


def test_without_engines_there_are_warnings_instead(small, tmp_path, monkeypatch):
    def missing(*args, **kwargs):
        raise EngineError("engine not found")

    monkeypatch.setattr("analysis.compare.study.run_engine", missing)
    monkeypatch.setattr(engine_runs, "run_engine", missing)
    sections = build(tmp_path)
    assert [s.number for s in sections] == ["4", "5"]
    assert all("engine not found" in s.warnings[0] and not s.claims for s in sections)
