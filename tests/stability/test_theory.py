"""The atlas' theory against closed forms, and the failures of solvers at small size."""

import dataclasses
import pickle
from fractions import Fraction

import numpy as np
import pytest

from analysis.percussions.dense_reference import dense_percussions
from analysis.studies.stability.atlas import attempt, boundary, choose
from analysis.studies.stability.case import Axis, Boundary, Case, Cell, Map, Outcome
from analysis.studies.stability.cases.penalty import PERCUSSIONS, PRODUCT
from analysis.studies.stability.cases.percussions import (
    chain,
    contraction,
    exact_energy,
    exact_line,
    pressed_corner,
)
from analysis.studies.stability.crowds import (
    PERIOD_S,
    critical_time_step,
    pressed_line,
    pressed_rhombus,
)
from analysis.studies.stability.page import LOOKS, draw_map, words_of
from tests.stability.cells import cell_of, theory


@pytest.mark.parametrize("n", [1, 2, 10])
def test_critical_step_of_a_line_is_the_closed_form(n):
    assert critical_time_step(pressed_line(n, 1.0)) / PERIOD_S == pytest.approx(
        1 / np.cos(np.pi / (2 * n + 2)), rel=1e-9
    )


def test_critical_step_of_packings_falls_to_that_of_the_lattice():
    steps = [critical_time_step(pressed_rhombus(n, 1.0)) / PERIOD_S for n in (3, 6, 14)]
    assert steps[0] > steps[1] > steps[2] > 2 / np.sqrt(6)
    assert steps[2] == pytest.approx(2 / np.sqrt(6), rel=0.01)


def test_critical_step_with_damping_is_where_the_map_has_the_eigenvalue_minus_one():
    # one disk, both contacts with walls: ω² = 2k/m, 2ζω = 2c/m
    scene = pressed_line(1, 0.3)
    from analysis.engines.penalty import penalty_of

    step, penalty, mass = critical_time_step(scene), penalty_of(scene), 75.0
    for factor, stable in ((0.999, True), (1.001, False)):
        dt = factor * step
        drag, pull = dt * 2 * penalty.wall_damping / mass, dt**2 * 2 * penalty.stiffness / mass
        # x_(n+1), x_n from x_n, x_(n-1)
        roots = np.linalg.eigvals([[2 - drag - pull, drag - 1], [1, 0]])
        assert (np.abs(roots).max() <= 1) == stable


def test_contraction_of_gauss_seidel_is_the_spectral_radius_of_its_iteration():
    n = 12
    _, contacts = chain(n)
    closing = contacts.normal_matrix(n).toarray()
    delassus = closing @ closing.T
    lower = np.tril(delassus)
    radius = np.abs(np.linalg.eigvals(np.eye(n) - np.linalg.solve(lower, delassus))).max()
    assert radius == pytest.approx(np.cos(np.pi / (2 * n)) ** 2, rel=1e-9)
    assert 1 - contraction(n) == pytest.approx(1 - radius, rel=0.02)


EDGE = theory("long_chains", "gauss_seidel")
# case, column, row, what is found
TRIED = [
    ("long_chains", round(0.97 * EDGE), "gauss_seidel", Outcome.STABLE),
    ("long_chains", round(1.03 * EDGE), "gauss_seidel", Outcome.NOT_CONVERGED),
    ("long_chains", round(1.03 * EDGE), "auto", Outcome.STABLE),
    ("mass_ratio_solvers", 1e6, "gauss_seidel", Outcome.NOT_CONVERGED),
    ("mass_ratio_solvers", 1e6, "interior_point", Outcome.STABLE),
    # the order of contacts decides reactions of which any is taken, and no others
    ("contact_order", 4.0, "gauss_seidel, any λ", Outcome.INACCURATE),
    ("contact_order", 4.0, "auto", Outcome.STABLE),
    # a restitution near one loses its digits
    ("restitution", 1e-4, "auto", Outcome.STABLE),
    ("restitution", 1e-15, "auto", Outcome.NOT_CONVERGED),
    # percussions have no smallest speed
    *(("small_speeds", speed, "auto", Outcome.STABLE) for speed in (1e-14, 1e-100, 0.0)),
    # an overlap is refused by a run and left by percussions
    ("initial_overlap", 0.03, PRODUCT, Outcome.REFUSED),
    ("initial_overlap", 0.03, PERCUSSIONS, Outcome.STABLE),
    ("initial_overlap", 2.0, PERCUSSIONS, Outcome.REFUSED),
    ("opening_contacts", 0.4, 1.0, Outcome.STABLE),
    # friction has several answers only above μ = cot(D/2)
    ("several_answers", 0.9, 90.0, Outcome.STABLE),
    ("several_answers", 2.0, 150.0, Outcome.INACCURATE),
    ("unsolved_step", 1.0, "1e-06, accelerated gradient", Outcome.STABLE),
    ("left_overlap", 1e-2, 1.0, Outcome.INACCURATE),
]


@pytest.mark.parametrize(("case", "column", "row", "outcome"), TRIED)
def test_what_a_cell_finds(case, column, row, outcome, tmp_path):
    assert cell_of(case, column, row, tmp_path).outcome is outcome


def test_any_reactions_of_a_redundant_packing_are_one_of_many(tmp_path):
    rows = ("gauss_seidel, any λ", "auto")
    free, chosen = (cell_of("redundant", 4.0, row, tmp_path) for row in rows)
    assert free.outcome is Outcome.INACCURATE
    assert free.silent
    assert chosen.outcome is Outcome.STABLE
    assert chosen.numbers[2] > 0


def test_dense_percussions_agree_with_the_closed_chain_and_satisfy_the_law():
    snapshot, contacts = chain(6)
    reaction, velocity = dense_percussions(snapshot, contacts, snapshot.velocity)
    assert np.abs(velocity).max() < 1e-12
    assert np.sort(reaction) == pytest.approx(75.0 * np.arange(1, 7))
    packing, in_contact = pressed_corner(3)
    minimum, _ = dense_percussions(packing, in_contact, packing.velocity, minimum=True)
    some, _ = dense_percussions(packing, in_contact, packing.velocity)
    assert minimum @ minimum <= some @ some * (1 + 1e-9)


def test_exact_line_has_the_two_disk_restitution_and_the_printed_four_disk_case():
    after, change = exact_line([1, 1], [Fraction(1), Fraction(0)], [Fraction(3, 2)])
    assert after[1] - after[0] == Fraction(1, 2)  # e = (k − m_eff)/(k + m_eff)
    assert change == Fraction(-3, 16)
    four, _ = exact_line([1] * 4, [Fraction(2), *[Fraction(0)] * 3], [Fraction(10)] * 3)
    assert [float(u) for u in four] == pytest.approx([-0.7907, 0.9302, 0.9302, 0.9302], abs=5e-5)


def test_k_on_opening_contacts_adds_energy_and_the_answer_warns(tmp_path):
    cell = cell_of("opening_contacts", 0.4, 20.0, tmp_path)
    assert (cell.outcome, cell.numbers[-1]) == (Outcome.ENERGY_GAIN, 1)
    assert exact_energy(0.4, 20.0)[1] > 0 > exact_energy(0.4, 1.0)[1]


def test_a_rigid_disk_is_held_by_every_door_narrower_than_itself(tmp_path):
    cells = [cell_of("narrow_door", width, PERCUSSIONS, tmp_path) for width in (0.5, 0.97, 1.1)]
    assert [cell.reason for cell in cells] == ["is held", "is held", "walks through"]


def test_door_theory_is_the_largest_force_of_two_springs():
    load = 0.2
    half = theory("narrow_door", f"lammps, F/(k·r) = {load}")
    x = np.linspace(0, np.sqrt(1 - half**2), 200_001)
    distance = np.hypot(half, x)
    assert (2 * (1 - distance) * x / distance).max() == pytest.approx(load, rel=1e-8)


def _step(column, row, folder):
    outcome = Outcome.STABLE if column < 3.0 else Outcome.LOST
    return Cell(outcome=outcome, reason="", said="0", numbers=(1.0,))


def _three(row):
    return 3.0


STEP = Case(
    name="step",
    columns=Axis(label="x", values=(1.0, 2.0, 4.0)),
    rows=Axis(label="row", values=("a",)), quantities=("q",), attempt=_step,
    fails_as=(Outcome.LOST,), theory=_three,
)


def test_a_boundary_is_halved_down_to_where_the_outcome_changes(tmp_path):
    cells = {(x, "a"): attempt(STEP, x, "a", tmp_path) for x in STEP.columns.values}
    width = boundary(STEP, "a", cells, tmp_path, halvings=0)
    assert (width.low, width.high) == (2.0, 4.0)
    edge = boundary(STEP, "a", cells, tmp_path, halvings=7)
    assert edge.low < 3 <= edge.high
    assert edge.difference == pytest.approx(0, abs=0.01)
    stable = dataclasses.replace(STEP, columns=Axis(label="x", values=(1.0, 2.0)))
    assert boundary(stable, "a", cells, tmp_path, halvings=7) is None


def test_silent_is_a_failure_that_the_method_did_not_admit():
    good, bad = _step(1.0, "a", None), _step(4.0, "a", None)
    assert (good.silent, bad.silent) == (False, True)


def test_a_map_draws_every_outcome_and_its_boundary():
    values = tuple(float(i) for i in range(len(Outcome)))
    cells = {
        (x, "a"): Cell(outcome=o, reason="", said="0", numbers=(0.0,))
        for x, o in zip(values, Outcome, strict=True)
    }
    case = dataclasses.replace(STEP, columns=Axis(label="x", values=values))
    edge = Boundary(row="a", low=1.0, high=2.0, theory=1.5)
    figure = draw_map(Map(case=case, cells=cells, boundaries=(edge,)))
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert {f"{letter}!" for _, letter, _ in LOOKS.values()} - {"S!"} <= texts
    assert "S" in texts
    figure.savefig("/dev/null", format="png")


def test_rows_of_a_case_have_labels_of_their_own():
    for made in choose(None, quick=False):
        pickle.dumps(made)  # other processes try its cells
        labels = [str(row) for row in made.rows.values]
        assert len(set(labels)) == len(labels), made.name
        assert not any("object at" in label or label[:1] == "(" for label in labels)


def test_every_case_has_its_words():
    for quick in (False, True):
        for made in choose(None, quick):
            words = words_of(made)
            assert {"title", "fails", "words"} <= set(words), made.name
            assert ("edge" in words) == (made.theory is not None), made.name


def test_names_of_cases_are_known_or_refused():
    assert [case.name for case in choose(["skin", "drift"], quick=True)] == ["skin", "drift"]
    assert (
        len({case.name for case in choose(None, quick=False)})
        == len(choose(None, quick=True))
        == 22
    )
    with pytest.raises(ValueError, match="nonsense"):
        choose(["nonsense"], quick=True)


def test_a_disk_that_passes_is_held_back_from_the_step_that_theory_names(tmp_path):
    for clearance in (0.001, 0.01):
        edge = theory("long_step", clearance)
        below = cell_of("long_step", 0.98 * edge, clearance, tmp_path)
        above = cell_of("long_step", 1.02 * edge, clearance, tmp_path)
        assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.INACCURATE)
        assert above.silent


def test_what_a_step_does_not_look_for_overlaps(tmp_path):
    edge = theory("missed_contacts", 0.005)
    assert cell_of("missed_contacts", 1.01 * edge, 0.005, tmp_path).outcome is Outcome.STABLE
    missed = cell_of("missed_contacts", 0.99 * edge, 0.005, tmp_path)
    assert missed.outcome is Outcome.INACCURATE
    assert missed.numbers[1] == 1


def test_a_step_without_an_answer_is_named(tmp_path):
    stopped = cell_of("unsolved_step", 1e8, "1e-06, accelerated gradient", tmp_path)
    assert stopped.outcome is Outcome.NOT_CONVERGED
    assert "residual" in stopped.reason
