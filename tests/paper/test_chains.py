"""The paper's chains and lines: the pages' own numbers against linear algebra, closed forms and
finite differences. The evacuation by the social force model: its steps against the model's own
forces, and rest."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.pages.section import Verdict
from analysis.pages.words import Words
from analysis.scene.scene import read_scene
from analysis.studies.paper.discrete import fig2_corridor, fig3_chains, fig6_rivals
from analysis.studies.paper.discrete import rival_forces as forces
from analysis.studies.paper.discrete.fig1_four_disks import (
    influence,
    line_restitution,
    opening_threshold,
)
from analysis.studies.paper.discrete.fig2_corridor import gaps_of, local_contacts, long_wave_speed
from analysis.studies.paper.discrete.fig3_chains import Chain, Trial, chain_of
from analysis.studies.paper.discrete.line_of_disks import newton_impact
from nscd import Walls, find_contacts, solve
from nscd.rivals import SocialForceLaw, social_force
from tests.crowds import disks_at

KINDS = [(wall, equal) for wall in (False, True) for equal in (True, False)]


@pytest.fixture(scope="module")
def section():
    return fig3_chains.build()


def claim(section, words):
    return next(claim for claim in section.claims if words in claim.statement)


@pytest.mark.parametrize(("wall", "equal"), KINDS)
@pytest.mark.parametrize("n", [2, 10, 56])
def test_the_closed_forms_solve_the_delassus_equation(n, wall, equal):
    """W λ = C u⁻ by dense linear algebra, and λ ≥ 0: the closed form is the complementarity
    solution."""
    chain = chain_of(n, wall, equal)
    closing = np.eye(n)[: n if wall else n - 1] - np.eye(n, k=1)[: n if wall else n - 1]
    delassus = closing @ np.diag(1 / chain.mass) @ closing.T
    reaction = np.linalg.solve(delassus, closing @ chain.left)
    closed, common = chain.closed_form()
    np.testing.assert_allclose(closed, reaction, rtol=1e-9)
    assert (closed > 0).all()
    np.testing.assert_allclose(chain.left - closing.T @ closed / chain.mass, common, atol=1e-9)


def test_a_chain_that_opens_is_seen_to_miss_the_closed_form():
    """The comparison can fail: (5) pulls where the left velocities grow along the chain in one
    place."""
    lefts, mass = np.array([[2.0, 0.5, 1.5, 0.0], [2.0, 0, 3, 0]]), np.full(4, 75.0)
    chains = (Chain(mass=mass, left=left, wall=False) for left in lefts)
    closing, opening = (Trial(chain).reaction_error for chain in chains)
    assert closing <= 1e-10 < 0.1 < opening


def test_the_section_on_chains_says_what_held(section):
    assert claim(section, "constrained pedestrian chain").verdict is Verdict.FAILS
    assert claim(section, "read for a free chain").verdict is Verdict.HOLDS
    assert claim(section, "identical and different masses").verdict is Verdict.HOLDS
    assert claim(section, "constant left-velocity").verdict is Verdict.HOLDS
    assert not section.warnings
    assert all(len(row) == len(table.head) for table in section.tables for row in table.rows)


@pytest.mark.parametrize("disks", [2, 3, 4, 7])
@pytest.mark.parametrize("e", [0.0, 0.4, 1.0])
def test_newtons_law_for_a_line(disks, e):
    """u⁺ = (1+e)U/n, and for the first −eU more: −1/3, 2/3, 2/3 for three disks with e = 1."""
    right = newton_impact(np.full(disks, 75.0), [1.0] + [0.0] * (disks - 1), e)
    expected = np.full(disks, (1 + e) / disks)
    expected[0] -= e
    np.testing.assert_allclose(right, expected, atol=1e-12)


@pytest.mark.parametrize("mass", [[75.0] * 2, [75.0] * 4, [1.0] * 4, [50.0, 90.0, 60.0, 75.0]])
def test_the_first_contact_opens_beyond_the_effective_mass_of_the_rest(mass):
    rest = sum(mass[1:])
    assert opening_threshold(mass) == pytest.approx(mass[0] * rest / (mass[0] + rest), rel=1e-8)


@pytest.mark.parametrize("e", [0.1, 0.25, 0.5, 0.9])
def test_restitution_is_exact_for_a_pair_and_short_for_four(e):
    """(k − M)/(k + M) with the effective mass M = ½m of a pair or ¾m of one against three."""
    assert line_restitution(2, e) == pytest.approx(e, abs=1e-9)
    k_over_m = 0.5 * (1 + e) / (1 - e)
    wanted = max(0, (k_over_m - 0.75) / (k_over_m + 0.75))
    assert line_restitution(4, e) == pytest.approx(wanted, abs=1e-9)


def test_the_first_percussion_feels_the_last_disk():
    """(3): ∂p¹²/∂u^j = −m¹m^j/Σm for each j > 1, neighbours or not."""
    mass = np.array([50.0, 90.0, 60.0, 75.0])
    found = influence(mass, [2.0, 1.2, 0.5, 0.0])
    np.testing.assert_allclose(found[1:], -50.0 * mass[1:] / mass.sum(), rtol=1e-7)
    assert found.sum() == pytest.approx(0, abs=1e-6)
    # a contact that opens between them cuts the line
    np.testing.assert_allclose(influence(mass, [2.0, 0.0, 5.0, 0.0])[2:], 0, atol=1e-7)


def test_momentum_through_a_gap_is_what_the_disks_beyond_gain():
    scene = read_scene("corridor")
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-6)
    solution = solve(scene.snapshot, contacts, tolerance=1e-10)
    gaps = gaps_of(scene, contacts, solution)
    np.testing.assert_allclose(gaps.flux, gaps.gained, rtol=1e-8)
    assert (np.diff(gaps.flux) < 0).all()
    # the six contacts of the pushing disks with the first column behind them
    assert local_contacts(scene, contacts).sum() == 6


def test_rigid_disks_in_the_corridor_keep_the_momentum_of_the_push(monkeypatch):
    """Walls give none along x: Σ m Δx = 3 · 75 kg · 2 m/s · t; and nobody overlaps."""
    monkeypatch.setattr(fig2_corridor, "TIME_S", 0.1)
    scene = read_scene("corridor")
    found = fig2_corridor.rigid_final(scene)
    gained = scene.snapshot.mass @ (found.position - scene.snapshot.position)[:, 0]
    assert gained == pytest.approx(450.0 * 0.1, rel=1e-6)
    moved = replace(scene.snapshot, position=found.position)
    contacts = find_contacts(moved, scene.wall_segments(), tolerance=1e-6)
    assert contacts.gap.min() > -1e-9
    assert 0 < found.moved <= len(found.displaced) == 53


def test_long_waves_have_the_slope_of_the_lattices_dispersion():
    """Columns of 3 and 4 disks on six springs each, as a chain of rigid columns: ω(q)/q of its
    dynamical matrix at small q."""
    scene = read_scene("corridor")
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-6)
    spacing, k, m = 0.5 * np.sqrt(1 - 0.55**2), scene.contact.stiffness_N_per_m, 75.0
    spring = 6 * k * (1 - 0.55**2)
    phase = 1e-3
    coupling = -spring / np.sqrt(12) / m * (1 + np.exp(-2j * phase))
    matrix = np.array([[2 * spring / (3 * m), coupling], [np.conj(coupling), 2 * spring / (4 * m)]])
    frequency = np.sqrt(np.linalg.eigvalsh(matrix)[0])
    assert long_wave_speed(scene, contacts) == pytest.approx(frequency * spacing / phase, rel=1e-4)


WORDS = Words("analysis.studies.paper.discrete.fig6_rivals")


def test_a_step_is_that_of_the_models_forces():
    """m Δu/Δt = m (u_d − u)/τ + Σ of the forces that `social_force` gives, overlaps, friction and
    walls included; who is far beyond the exit pushes nobody."""
    walls, drive = forces.room()
    drive = drive.model_copy(update={"speed_m_per_s": 1.5})
    random, mass = np.random.default_rng(0), forces.EVACUATED_KG
    crowd = forces.placed(40, 1)
    moving = random.normal(0, 1, (40, 2))
    inside = replace(crowd, position=crowd.position * 0.35 - [0.02, 0.0], velocity=moving)
    assert find_contacts(inside, tolerance=0.0).gap.min() < -0.05
    gone = [forces.GONE_M + 0.1, 0.0], [1.5, 0.0]
    position, speeds = np.vstack([inside.position, gone[0]]), np.vstack([moving, gone[1]])
    crowd = disks_at(position, speeds, np.append(inside.radius, 0.3), mass)
    moved = forces.advance(crowd, walls, drive, 1)
    near = find_contacts(inside, walls, tolerance=forces.REACH_M)
    wish = (drive.desired_velocity(inside.position) - moving) / forces.TIME_S
    velocity = moving + forces.STEP_S * (wish + social_force(inside, near).resultant() / mass)
    np.testing.assert_allclose(moved.velocity[:-1], velocity, atol=1e-10)
    there = inside.position + forces.STEP_S * velocity
    np.testing.assert_allclose(moved.position[:-1], there, atol=1e-10)
    np.testing.assert_allclose(moved.velocity[-1], [1.5, 0.0], atol=1e-12)


@pytest.mark.parametrize("speed", [1.0, 14.0])
def test_one_person_before_a_closed_door_stands_where_the_forces_balance(speed):
    """A exp(−g/B) + ϱ max(−g, 0) = m u_d/τ: a gap of 0.2 m at 1 m/s, an overlap at 14 m/s."""
    _, drive = forces.room()
    drive = drive.model_copy(update={"speed_m_per_s": speed})
    closed = Walls(start=np.array([[0.0, -9.0]]), end=np.array([[0.0, 9.0]]))
    person = disks_at([[-1.0, 0.0]], radius=0.3, mass=forces.EVACUATED_KG)
    there = forces.advance(person, closed, drive, 25_000)
    gap = forces.gap_that_carries(forces.EVACUATED_KG * speed / forces.TIME_S, SocialForceLaw())
    assert there.position[0, 0] == pytest.approx(-0.3 - gap, abs=1e-6)
    assert np.hypot(*there.velocity[0]) < 1e-6


def test_people_leave_and_are_looked_at():
    found = forces.evacuate(2.0, 1, people=12, until=20.0)
    assert found.left == 12
    assert len(found.samples) == 41
    assert found.forces.size == 0
    np.testing.assert_array_equal(found.deepest, 0.0)


@pytest.mark.parametrize(
    ("slow", "fast", "verdict"),
    [(1e-3, 5e-3, "holds"), (1e-3, 0.05, "holds in part"), (0.02, 0.05, "does not hold")],
)
def test_the_verdict_on_overlaps_depends_on_the_speed(slow, fast, verdict):
    made_up = [
        SimpleNamespace(speed=speed, deepest=np.full(4, deepest), forces=np.array([2500.0]))
        for speed, deepest in ((1.0, slow), (1.0, slow), (4.0, fast))
    ]
    claim = fig6_rivals.no_overlap(WORDS, made_up)
    assert claim.verdict == verdict
    assert f"{1e3 * fast:.1f} mm" in claim.reason
