"""Errata of eqs. (9) and (10), the force models that section 2 compares with."""

import numpy as np

from nscd import Walls, find_contacts
from nscd.rivals import LoehnerReading, loehner_force, social_force
from tests.crowds import disks_at
from tests.errata.dimension import FORCE, KG, SPEED, M, S


def row(gaps, radii):
    """Disks along x with the given gaps between them, at rest."""
    radii = np.asarray(radii, dtype=float)
    x = np.concatenate([[0.0], np.cumsum(radii[:-1] + radii[1:] + gaps)])
    n = len(radii)
    return disks_at(np.column_stack([x, np.zeros(n)]), radius=radii)


def test_sliding_term_has_no_comma():
    """(9): ς g(r−d) Δv is a force; split at the printed comma, neither ς nor g(r−d) Δv is."""
    coefficient = KG / (M * S)
    assert coefficient * M * SPEED == FORCE
    assert coefficient != FORCE
    assert M * SPEED != FORCE
    assert KG / S**2 * M == FORCE  # the body force beside it


def test_social_force_without_overlap_is_not_constant():
    """After (9): people who stand in a row against a wall and do not overlap carry 225 to 1,575 N,
    not A = 2,000 N each."""
    drive = np.full(7, 75 * 1.5 / 0.5)  # m u_d/τ
    gaps = -0.08 * np.log(np.cumsum(drive) / 2000.0)
    assert gaps.min() > 0
    crowd = row(gaps[:-1], [0.25] * 7)
    end = crowd.position[-1, 0] + 0.25 + gaps[-1]
    neighbours = find_contacts(crowd, Walls(start=[[end, -1]], end=[[end, 1]]), tolerance=0.3)
    assert len(neighbours) == 7
    forces = social_force(crowd, neighbours)
    np.testing.assert_allclose(forces.resultant()[:, 0], -drive, rtol=1e-9)  # everybody is at rest
    assert forces.normal.max() < 2000
    assert forces.normal.max() / forces.normal.min() > 6.9  # the printed text says 1
    # A is what people at touch exchange, the greatest without overlap
    pair = row([0.0], [0.25, 0.25])
    np.testing.assert_allclose(social_force(pair, find_contacts(pair, tolerance=1e-9)).normal, 2000)


def loehner(gap, reading, radii=(0.25, 0.25)):
    """Resultants (2,2) N of a pair with the given gap, f_max = 100 N."""
    pair = row([gap], radii)
    return loehner_force(
        pair, find_contacts(pair, tolerance=2.0), 100.0, reading, tolerance=1e-12
    ).resultant()


def test_loehner_force_doubles_as_touch_is_lost():
    """(10): as printed the force doubles when a contact opens; with the cases swapped it halves,
    and never grows."""
    gaps = np.concatenate([np.linspace(-0.2, 0.0, 51), [1e-9], np.linspace(0.01, 1.0, 100)])
    sizes = {r: np.array([loehner(gap, r)[1, 0] for gap in gaps]) for r in LoehnerReading}
    printed, swapped = sizes[LoehnerReading.PRINTED], sizes[LoehnerReading.TEXT]
    np.testing.assert_allclose(
        [printed[50], swapped[50]], [20, 40], rtol=1e-9
    )  # f_max/(1 + 2²), and twice that
    np.testing.assert_allclose(
        [printed[51] / printed[50], swapped[51] / swapped[50]], [2, 0.5], rtol=1e-6
    )
    assert (np.diff(swapped) < 0).all()
    assert (np.diff(printed) > 0).sum() == 1
    assert printed[gaps > 0.09][0] > 1.4 * printed[50]  # 10 cm apart stronger than in contact


def test_loehner_force_needs_a_direction():
    """(10): as printed both of a pair get −f; along n_ij two equal disks balance (unequal ones
    still do not)."""
    equal = loehner(0.0, LoehnerReading.TEXT)
    printed = -np.hypot(*equal.T)
    assert printed.sum() == -80
    np.testing.assert_allclose(equal.sum(0), 0, atol=1e-12)
    assert np.hypot(*loehner(0.0, LoehnerReading.TEXT, (0.2, 0.3)).sum(0)) > 20
