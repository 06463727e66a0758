"""How a push goes from column to column of disks: momentum through the gaps between them, waves."""

from dataclasses import dataclass

import numpy as np

from analysis.compare.statistics import correlation
from analysis.scene.scene import Scene
from nscd import Contacts, Percussions
from nscd.arrays import Flags, Floats

# Disks whose x differ by less stand in one column.
SAME_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gaps:
    """The m gaps between neighbouring columns.

    distance: (m,) m from the first column
    flux: (m,) N·s, the momentum along x that percussions pass through
    gained: (m,) N·s, what the disks beyond gain of it
    columns: (m,) N·s, the flux that (5), (6) give for columns that move as one
    largest: (m,) N·s, the largest percussion
    """

    distance: Floats
    flux: Floats
    gained: Floats
    columns: Floats
    largest: Floats

    @property
    def linearity(self) -> float:
        """Correlation of the flux with the distance."""
        return correlation(self.distance, self.flux)


def local_contacts(scene: Scene, contacts: Contacts) -> Flags:
    """Tell in which contacts (k,) a pushing disk takes part."""
    pushing = np.hypot(*scene.snapshot.velocity.T) > 0
    second = np.where(contacts.is_wall, contacts.first, contacts.second)
    touched: Flags = pushing[contacts.first] | pushing[second]
    return touched


def columns(x: Floats) -> Floats:
    """Find the distinct x (m) of disks that stand in columns, rising."""
    distinct: Floats = np.unique(np.round(x, 6))
    return distinct


def in_columns(x: Floats) -> Flags:
    """Tell which column (c,) each disk stands in, (n,c)."""
    stands: Flags = np.abs(x[:, None] - columns(x)) < SAME_M
    return stands


def _middles(x: Floats) -> Floats:
    """The x (m,) of the gaps' middles (m)."""
    middles: Floats = 0.5 * (columns(x)[1:] + columns(x)[:-1])
    return middles


def _crosses(x: Floats, pairs: Contacts) -> Flags:
    """Which gap (m,) each contact of two disks crosses, (k,m)."""
    a, b = x[pairs.first], x[pairs.second]
    low, high = np.minimum(a, b), np.maximum(a, b)
    across: Flags = (low[:, None] < _middles(x)) & (high[:, None] > _middles(x))
    return across


def flux(x: Floats, contacts: Contacts, impulse: Floats) -> Floats:
    """Sum the impulses (k,2) N·s of contacts along x through each gap, (m,) N·s."""
    chosen = ~contacts.is_wall
    pairs = contacts.select(chosen)
    along = impulse[chosen, 0] * np.sign(x[pairs.second] - x[pairs.first])
    through: Floats = along @ _crosses(x, pairs)
    return through


def gaps_of(scene: Scene, contacts: Contacts, answer: Percussions) -> Gaps:
    """Follow the push from column to column."""
    snapshot, middles = scene.snapshot, _middles(scene.snapshot.position[:, 0])
    x, left = snapshot.position[:, 0], snapshot.velocity[:, 0]
    change = snapshot.mass * (answer.right_velocity[:, 0] - left)
    mass, momentum = snapshot.mass @ in_columns(x), (snapshot.mass * left) @ in_columns(x)
    pairs = ~contacts.is_wall
    size = np.hypot(*answer.impulse[pairs].T)
    return Gaps(
        distance=middles - columns(x)[0],
        flux=flux(x, contacts, answer.impulse),
        gained=np.array([change[x > middle].sum() for middle in middles]),
        columns=np.cumsum(momentum - mass * momentum.sum() / mass.sum())[:-1],
        largest=(size[:, None] * _crosses(x, contacts.select(pairs))).max(0),
    )


def first_arrivals(x: Floats, arrival: Floats) -> tuple[Floats, Floats]:
    """Find each column's x (m) and the earliest arrival in it (s), NaN where it was not reached."""
    times = np.where(in_columns(x) & np.isfinite(arrival)[:, None], arrival[:, None], np.inf)
    first = times.min(0)
    return columns(x), np.where(np.isfinite(first), first, np.nan)


def long_wave_speed(scene: Scene, contacts: Contacts) -> float:
    """Compute c = d √(K/m̄) (m/s) of long waves along columns, a chain of rigid columns on springs.

    d: the spacing of the columns; K = k Σ nₓ² over the contacts between two neighbours; m̄: the mean
    mass of a column (inner columns)."""
    x = scene.snapshot.position[:, 0]
    pairs = contacts.select(~contacts.is_wall)
    springs = (pairs.normal[:, 0] ** 2) @ _crosses(x, pairs)
    stiffness = scene.contact.stiffness_N_per_m * springs.mean()
    masses = scene.snapshot.mass @ in_columns(x)
    # two neighbours share each kind of column, so that the mean is taken over whole pairs
    mass = masses[: 2 * (len(masses) // 2)].mean()
    return float(np.diff(columns(x)).mean() * np.sqrt(stiffness / mass))
