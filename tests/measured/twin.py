"""A synthetic twin of a photoelastic packing: disks in a box, true forces, the noise of two sides,
written as the experiment's files are."""

from dataclasses import replace

import numpy as np

from analysis.scene.packing import heap
from analysis.studies.measured.models import INNER, equilibrium, open_by
from analysis.studies.measured.packing import ErrorBar, Packing, contacts_listed, disks_at
from nscd.indeterminacy.ensemble import ensemble

RADIUS = 25.0
SHORT = 0.8  # radii are read so many px too small
MU, SCALE_N = 0.3, 0.03
ALPHA, BETA_N, LEAST_N = 0.085, 0.0046, 0.011
PREFIX = "DSC{}_solved_Tracke_"


def disks(n, seed):
    """Positions and radii (px) of about n disks, a square cut out of a heap of disks that touch."""
    position, radius = heap(int(2.6 * n), seed, RADIUS, RADIUS)
    side = 0.8 * RADIUS * np.sqrt(2 * 2.6 * n / 0.8)
    inside = (position[:, 0] > -side) & (np.abs(position[:, 1]) < side / 2)
    return position[inside] + side, radius[inside] - SHORT


def bare(position, radius):
    """The packing without forces."""
    none, disks = np.zeros(0, int), disks_at(position, radius)
    contacts, _ = contacts_listed(disks, none, none)
    force = np.zeros(len(contacts))
    return Packing(
        name="twin", snapshot=disks, contacts=contacts, force=force, sides=force.astype(int),
        error=ErrorBar(ALPHA, BETA_N), least=LEAST_N,
    )


def thinned(packing, fraction, seed=0):
    """The packing in which only a share of the near pairs touch: those that nobody can tell apart."""
    among = packing.contacts.select(
        np.random.default_rng(seed).random(len(packing.contacts)) < fraction
    )
    none = np.zeros(len(among))
    return replace(packing, contacts=among, force=none, sides=none.astype(int))


def truth(packing, friction=MU, scale=SCALE_N, seed=0):
    """One draw (k,) of normal forces of the ensemble with no load given: that is free at the boundary.
    With it the load (n,2) N that each boundary disk then needs, friction forces included."""
    balance_of = equilibrium(packing, friction)
    inner = open_by(packing, INNER * scale, np.inf)
    some = ensemble(balance_of, scale, inner, seed=seed, chains=1, draws=2, most_sweeps=3000)
    k = len(packing.contacts)
    force, across = some.draws[0, -1, :k], some.draws[0, -1, k:]
    load = -balance_of.net(force, across)[:, :2]
    load[~packing.boundary] = 0.0
    return force, load


def write_disks(folder, step, position, radius):
    rows = [[i + 1, *x, r, 0] for i, (x, r) in enumerate(zip(position, radius, strict=True))]
    _write(folder / f"{PREFIX.format(step)}ParticleData.dlm", rows)


def observed(force, random):
    """Both sides (k,) of true forces (k,) N: with noise, and nothing below the least that is
    detected. σ of their mean is √((αF)² + β²)."""
    noise = np.sqrt(2) * np.hypot(ALPHA * force, BETA_N) * random.normal(size=(2, len(force)))
    sides = np.maximum(force + noise, 0)
    sides[:, force < LEAST_N] = 0
    sides[sides < LEAST_N / 2] = 0
    return sides


def write_forces(folder, step, n, first, second, sides):
    seen_from = np.zeros((n, n))
    seen_from[first, second], seen_from[second, first] = sides
    _write(folder / f"{PREFIX.format(step)}NormWeightedAdjacencyMatrix.dlm", seen_from)


def _write(path, rows):
    path.write_text("".join(",".join(f"{x:.8g}" for x in row) + "\n" for row in rows))


def write_twin(folder, steps=2, n=150, seed=1, fraction=1.0):
    """Write steps of a twin, each a packing of its own; return their true forces."""
    true = []
    for step in range(steps):
        name, packing = f"{5384 + 2 * step:05d}", thinned(bare(*disks(n, seed + step)), fraction)
        force, _ = truth(packing, seed=seed + step)
        contacts = packing.contacts
        sides = observed(force, np.random.default_rng([seed, step]))
        write_disks(folder, name, packing.snapshot.position, packing.snapshot.radius)
        write_forces(folder, name, len(packing.snapshot), contacts.first, contacts.second, sides)
        true.append(force)
    return true
