"""The page's section on the rivals: its numbers against closed forms, and verdicts that follow the
numbers."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.pages.words import Words
from analysis.studies.paper.discrete import fig6_rivals as rivals
from analysis.studies.paper.discrete import pressed_crowd, rival_forces
from analysis.studies.paper.discrete.rival_forces import PRINTED, TEXT, Congestion, chain_forces

from analysis.studies.paper.discrete.rival_forces import gap_that_carries  # isort: skip
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from nscd.rivals import SocialForceLaw
from tests.pages.browser import says_little
from tests.paper.test_arch import queue

TAU = 0.5
WORDS = Words("analysis.studies.paper.discrete.fig6_rivals")


@pytest.fixture(scope="module")
def chains():
    found = [chain_forces(read_scene(name), TAU) for name in ("chain_wall", "chain_wall_masses")]
    assert not any(warnings for _, warnings in found)
    return [chain for chain, _ in found]


def test_chain_against_closed_forms(chains):
    """p/τ = Σ_{j≤i} m_j u/τ; (4) sees i people; A at touch; Löhner f_max/5 between equals and
    f_max/2 at the wall."""
    for chain in chains:
        load = np.cumsum(chain["mass"]) * 2.0 / TAU
        np.testing.assert_allclose(chain["percussion"], load, rtol=1e-10)
        people = chain["mass"].mean() * np.arange(1, 11)
        np.testing.assert_allclose(chain["first_order"], people * 2.0 / TAU, rtol=1e-10)
        np.testing.assert_allclose(chain["social"], 2000.0, rtol=1e-12)
        # gaps at rest: what neighbours do not carry, pairs further apart do
        assert (chain["social_at_rest"] < load).all()
        np.testing.assert_allclose(chain["social_at_rest"], load, rtol=0.005)
        np.testing.assert_allclose(chain["loehner_text"], 2 * chain["loehner_printed"], rtol=1e-12)
    np.testing.assert_allclose(chains[0]["loehner_printed"], [60.0] * 9 + [150.0], rtol=1e-12)


def test_a_gap_that_carries():
    law = SocialForceLaw()
    assert gap_that_carries(2000.0, law) == pytest.approx(0.0, abs=1e-12)
    assert gap_that_carries(2000.0 / np.e, law) == pytest.approx(0.08)
    assert gap_that_carries(2000 * np.exp(0.125) + 1200, law) == pytest.approx(-0.01)


def test_verdicts_follow_the_numbers(chains):
    equal, unequal = chains
    assert rivals.special_case(WORDS, equal).verdict == "holds"
    assert rivals.constant_in_a_chain(WORDS, equal, unequal).verdict == "holds in part"
    assert rivals.restrictive_mass(WORDS, unequal, []).verdict == "holds in part"
    assert rivals.restrictive_mass(WORDS, equal, []).verdict == "does not hold"
    far_off = unequal | {"first_order": 2 * unequal["first_order"]}
    assert rivals.restrictive_mass(WORDS, far_off, []).verdict == "holds"
    assert rivals.special_case(WORDS, far_off).verdict == "does not hold"
    varying = equal | {"social": equal["percussion"]}
    assert rivals.constant_in_a_chain(WORDS, varying, unequal).verdict == "does not hold"
    resting = equal | {"social_at_rest": equal["social"]}
    assert rivals.constant_in_a_chain(WORDS, resting, unequal).verdict == "holds"
    assert rivals.surface(WORDS, 0.01, (0.2, 0.3), 1.2).verdict == "holds in part"
    silent = dict.fromkeys((PRINTED, TEXT), 0.0)
    assert rivals.non_zero_apart(WORDS, silent).verdict == "does not hold"


def test_congestion_is_judged_by_both_its_parts():
    found = partial(Congestion, seed=1, stiffness=1e6, equal=0.0)
    for first_order, unequal, verdict in (
        (1e-9, (0.1, 0.2), "holds"),
        (1e-9, (1e-9, 1e-9, 0.2), "holds in part"),
        (0.5, (1e-9, 1e-9), "does not hold"),
    ):
        made_up = found(first_order=first_order, unequal=unequal)
        claim = rivals.complete_congestion(WORDS, [made_up])
        assert claim.verdict == verdict


def test_a_queue_before_a_closed_exit_stays_whatever_the_masses():
    """A chain against a wall: all at rest by the first-order model and by any masses."""
    found = rival_forces.congestion_of(SimpleNamespace(arch=queue(), seed=1, stiffness=1e6))
    assert found.congests
    assert found.equal < 1e-9
    assert found.released == 0
    assert len(set(found.unequal)) > 1


@pytest.fixture
def few(monkeypatch):
    """One evacuation of few people, two crowds that may block their exit, two small arches."""
    shipped = rivals.read_scene

    def small(name):
        return make(name, disks=150) if name in rivals.CROWDS else shipped(name)

    monkeypatch.setattr(rivals, "read_scene", small)
    short = partial(rival_forces.evacuate, people=40, until=11.0)
    monkeypatch.setattr(rival_forces, "evacuate", short)
    monkeypatch.setattr(rival_forces, "SPEEDS", (2.0,))
    monkeypatch.setattr(rival_forces, "SEEDS", (1,))
    monkeypatch.setattr(pressed_crowd, "BLOCKED_SEEDS", (1, 2))
    monkeypatch.setattr(pressed_crowd, "STIFFNESSES", (1e6,))


@pytest.mark.long
def test_the_whole_section_and_its_second_build(few, tmp_path):
    """Equal masses: the first-order model is the percussions. Unequal: it is not. Engine runs are
    taken again."""
    cells = []
    section = rivals.build(tmp_path, lambda label, fraction: cells.append(label))
    assert section.warnings == []
    assert any("hooke_k1e+06" in label for label in cells)
    misjudged = {row[0]: row[1:] for row in section.tables[-1].rows}
    assert misjudged["arch"][0] < 1e-8 < 0.01 < misjudged["arch_masses"][0]
    assert misjudged["arch_masses"][3] > 0.05
    laws = {(row[0], row[1]): row[2:] for row in section.tables[3].rows}
    assert laws["arch", "social force"][1] > 2000  # overlaps: every contact gives more than A
    assert len(section.pictures) == 4
    assert len(section.claims) == 9
    says_little(section, tmp_path)
    cells.clear()
    again = rivals.build(tmp_path, lambda label, fraction: cells.append(label))
    assert not any("hooke_k1e+06" in label for label in cells)
    assert [claim.verdict for claim in again.claims] == [claim.verdict for claim in section.claims]


def test_without_an_engine_the_chains_remain(few, monkeypatch, tmp_path):
    monkeypatch.setattr(rivals, "PENALTY", ())
    section = rivals.build(tmp_path)
    assert any("no engine" in warning for warning in section.warnings)
    names = [picture.name for picture in section.pictures]
    assert names == ["fig_6_laws", "fig_6_chain", "fig_6_evacuation"]
    assert len(section.claims) == 5
    assert all(len(row) == len(table.head) for table in section.tables for row in table.rows)
