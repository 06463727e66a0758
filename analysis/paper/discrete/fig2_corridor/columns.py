"""How a push goes from column to column: the momentum that contacts pass through the gaps between
columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.paper.discrete.fig2_corridor.push import Push, columns
from analysis.scene.scene import Scene
from nscd import Contacts, Percussions
from nscd.arrays import Flags, Floats, Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gaps:
    """The gaps between neighbouring columns: distance (m,) m from the first column; flux (m,) N·s,
    the momentum along x that percussions pass through; gained (m,) N·s, what the disks beyond gain
    of it; columns (m,) N·s: the flux that (5), (6) give for columns that move as one; largest (m,)
    N·s: the largest percussion."""

    distance: Floats
    flux: Floats
    gained: Floats
    columns: Floats
    largest: Floats


def local_contacts(scene: Scene, contacts: Contacts) -> Flags:
    """Which contacts (k,) a pushing disk takes part in."""
    pushing = np.hypot(*scene.snapshot.velocity.T) > 0
    second = np.where(contacts.is_wall, contacts.first, contacts.second)
    touched: Flags = pushing[contacts.first] | pushing[second]
    return touched


def flux(x: Floats, first: Indices, second: Indices, impulse: Floats) -> Floats:
    """Impulse along x (m,) N·s through each gap between columns; first, second (k,) disks, impulse
    (k,2) by first on second."""
    middle = 0.5 * (columns(x)[1:] + columns(x)[:-1])
    a, b = x[first], x[second]
    forward = np.where(b > a, impulse[:, 0], -impulse[:, 0])
    crosses = (np.minimum(a, b)[:, None] < middle) & (np.maximum(a, b)[:, None] > middle)
    through: Floats = forward @ crosses
    return through


def gaps_of(scene: Scene, contacts: Contacts, answer: Percussions) -> Gaps:
    """How the push goes from column to column."""
    snapshot = scene.snapshot
    x = snapshot.position[:, 0]
    places = columns(x)
    middle = 0.5 * (places[1:] + places[:-1])
    pairs = ~contacts.is_wall
    first, second = contacts.first[pairs], contacts.second[pairs]
    change = snapshot.mass * (answer.right_velocity[:, 0] - snapshot.velocity[:, 0])
    mass = np.array([snapshot.mass[np.abs(x - place) < 1e-6].sum() for place in places])
    momentum = np.array(
        [
            (snapshot.mass * snapshot.velocity[:, 0])[np.abs(x - place) < 1e-6].sum()
            for place in places
        ]
    )
    crosses = (np.minimum(x[first], x[second])[:, None] < middle) & (
        np.maximum(x[first], x[second])[:, None] > middle
    )
    return Gaps(
        distance=middle - places[0],
        flux=flux(x, first, second, answer.impulse[pairs]),
        gained=np.array([change[x > m].sum() for m in middle]),
        columns=np.cumsum(momentum - mass * momentum.sum() / mass.sum())[:-1],
        largest=(np.hypot(*answer.impulse[pairs].T)[:, None] * crosses).max(0),
    )


def soft_flux(push: Push) -> Floats:
    """Impulse along x (m,) N·s that soft contacts passed through each gap between columns."""
    c, match = push.comparison, push.comparison.match
    pairs, contacts = ~match.is_wall, match.contacts
    a, b = contacts.first[pairs], contacts.second[pairs]
    return flux(c.snapshot.position[:, 0], a, b, match.penalty[pairs])
