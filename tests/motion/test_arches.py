"""Arches that somebody drew: who is in them, and how long they live."""

import numpy as np
import pytest

from analysis.dumps.windows import Window
from analysis.motion.study import arch_in, arches_of, share_of
from analysis.scene.scene import read_scene
from tests.crowds import disks_at


@pytest.fixture(scope="module")
def door():
    """A wall along y with a door from (0, -0.5) to (0, 0.5); people come from x < 0."""
    return read_scene("arch")


# Five people on a half circle before the door, the first and the last at the walls; a sixth behind.
PLACES = [(-0.2, -0.8), (-0.6, -0.55), (-0.8, 0.0), (-0.6, 0.55), (-0.2, 0.8), (-1.2, 0.0)]
# The walls beside the door, as the scene numbers them.
LOWER, UPPER = 1, 2
RING = [(1, 2, 0), (2, 3, 0), (3, 4, 0), (4, 5, 0), (1, LOWER, 1), (5, UPPER, 1)]


def window(contacts, start=0.0, newtons=100.0, places=PLACES):
    """A window of 0.1 s in which these contacts press with so many newtons."""
    keys = np.array(sorted(contacts), dtype=np.int64).reshape(-1, 3)
    now = disks_at(places, radius=0.2)
    impulse = np.column_stack([np.full(len(keys), 0.1 * newtons), np.zeros(len(keys))])
    return Window(start=start, end=start + 0.1, now=now, keys=keys, impulse=impulse)


def test_a_ring_from_wall_to_wall_is_an_arch(door):
    assert arch_in(door, window(RING)) == {1, 2, 3, 4, 5}
    behind = [(2, 6, 0), (4, 6, 0)]
    assert arch_in(door, window([*RING, *behind])) == {1, 2, 3, 4, 5}
    without_keystone = [c for c in RING if c not in ((2, 3, 0), (3, 4, 0))]
    assert arch_in(door, window([*without_keystone, *behind])) == {1, 2, 4, 5, 6}


@pytest.mark.parametrize("missing", RING)
def test_a_gap_anywhere_opens_it(door, missing):
    assert not arch_in(door, window([c for c in RING if c != missing]))


def test_who_hardly_presses_has_passed_or_is_far_is_no_part_of_it(door):
    assert not arch_in(door, window(RING, newtons=9.0))
    beyond = [*PLACES[:2], (0.1, 0.0), *PLACES[3:]]
    assert not arch_in(door, window(RING, places=beyond))
    far = [*PLACES[:2], (-1.9, 0.0), *PLACES[3:]]
    assert not arch_in(door, window(RING, places=far))


def test_an_arch_lives_as_long_as_the_same_people_form_it(door):
    other = [*[c for c in RING if c not in ((2, 3, 0), (3, 4, 0))], (2, 6, 0), (4, 6, 0)]
    shown = [RING, RING, other, [], RING, RING, RING]
    found = arches_of(door, [window(c, start=0.1 * n) for n, c in enumerate(shown)])
    assert [arch.lifetime for arch in found] == pytest.approx([0.2, 0.1, 0.3])
    assert [arch.start for arch in found] == pytest.approx([0.0, 0.2, 0.4])
    whole = window([], start=0.0)
    assert share_of(whole, found) == pytest.approx(1.0)
    assert share_of(window([], start=0.3), found) == pytest.approx(0.0)
