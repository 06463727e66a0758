"""The scenes that the advice is made from, and others, unseen by it, on which it is tested."""

import dataclasses
from collections.abc import Callable

import numpy as np

from analysis.scene.packing import heap
from analysis.scene.scene import Scene, read_scene
from analysis.scene.shipped_scenes import make
from nscd import Snapshot

Makers = dict[str, Callable[[], Scene]]


def _with(scene: Scene, *, restitution: float | None = None, **disks: object) -> Scene:
    """The scene with other masses (n,) kg, left velocities (n,2) m/s, or another restitution."""
    snapshot = dataclasses.replace(scene.snapshot, **disks)
    changed = scene.model_copy(update={"snapshot": snapshot})
    return changed if restitution is None else changed.with_contact(restitution=restitution)


def _masses(n: int, seed: int) -> object:
    return np.random.default_rng(seed).integers(50, 101, n).astype(float)


def _corridor(masses: int, pushed: tuple[float, float], restitution: float) -> Scene:
    """The corridor with masses of that seed, and its three people on the left pushing with another
    velocity (m/s)."""
    scene = make("corridor")
    velocity, mass = np.zeros((len(scene.snapshot), 2)), _masses(len(scene.snapshot), masses)
    velocity[:3] = pushed
    return _with(scene, mass=mass, velocity=velocity, restitution=restitution)


def _crowd(n: int, seed: int, **contact: object) -> Scene:
    """A random crowd of touching people, each with a random velocity of about 1 m/s."""
    position, radius = heap(n, seed, 0.215, 0.5)
    random = np.random.default_rng(seed)
    velocity, mass = random.normal(size=(n, 2)), random.uniform(50.0, 100.0, n)
    snapshot = Snapshot(position=position, velocity=velocity, radius=radius, mass=mass)
    base = make("pair").with_contact(**contact)
    return base.model_copy(update={"snapshot": snapshot, "name": f"crowd_{n}"})


LIBRARY: Makers = {
    "arch_75": lambda: make("arch", 75),
    "arch_150": lambda: make("arch", 150),
    "arch_300": lambda: make("arch", 300),
    "arch_594": lambda: make("arch"),
    "arch_150_seed_2": lambda: make("arch", 150, 2),
    "arch_masses_150": lambda: make("arch_masses", 150),
    "arch_masses_300": lambda: make("arch_masses", 300),
    "jam_75": lambda: make("jam", 75),
    "jam_150": lambda: make("jam", 150),
    "gate": lambda: read_scene("gate"),
    "arch_110": lambda: make("arch", 110, 15),
    "arch_220": lambda: make("arch", 220, 16),
    "arch_420": lambda: make("arch", 420, 17),
    "arch_masses_90": lambda: make("arch_masses", 90, 18),
    "arch_masses_220": lambda: make("arch_masses", 220, 19),
    "jam_110": lambda: make("jam", 110, 20),
}
UNSEEN: Makers = {
    "pair_unequal": lambda: _with(make("pair"), mass=[60.0, 85.0]),
    "four_other_masses": lambda: _with(make("four_disks"), mass=[80.0, 55.0, 95.0, 70.0]),
    "chain_17": lambda: make("chain", 17),
    "chain_masses_13": lambda: make("chain_masses", 13, 31),
    "chain_wall_12": lambda: make("chain_wall", 12),
    "chain_wall_masses_16": lambda: make("chain_wall_masses", 16, 32),
    "corridor_pushed_back": lambda: _corridor(33, (2.5, -1.5), 0.05),
    "corridor_damped": lambda: _corridor(34, (1.5, 1.0), 0.03),
    "arch_130": lambda: make("arch", 130, 35),
    "arch_260": lambda: make("arch", 260, 36),
    "arch_350": lambda: make("arch", 350, 37),
    "arch_masses_120": lambda: make("arch_masses", 120, 38),
    "arch_masses_180": lambda: make("arch_masses", 180, 39),
    "jam_95": lambda: make("jam", 95, 40),
}
# Impacts unlike any of the library: other restitutions, Hertz contacts, random crowds.
IMPACTS: Makers = {
    "pair_e0.5": lambda: _with(make("pair"), restitution=0.5),
    "pair_oblique_e0.8": lambda: _with(make("pair_oblique"), restitution=0.8),
    "pair_hertz": lambda: make("pair").with_contact(law="hertz", restitution=0.3),
    "four_disks_e0.3": lambda: _with(make("four_disks"), restitution=0.3),
    "four_disks_e0.9": lambda: _with(make("four_disks"), restitution=0.9),
    "four_disks_hertz": lambda: make("four_disks").with_contact(law="hertz"),
    "chain_12_e0.5": lambda: _with(make("chain", 12), restitution=0.5),
    "chain_30_e0.2": lambda: _with(make("chain", 30), restitution=0.2),
    "chain_masses_15_e0.7": lambda: _with(make("chain_masses", 15, 41), restitution=0.7),
    "chain_wall_9_e0.4": lambda: _with(make("chain_wall", 9), restitution=0.4),
    "chain_wall_masses_11_e0.1": lambda: _with(make("chain_wall_masses", 11, 42), restitution=0.1),
    "chain_8_hertz": lambda: make("chain", 8).with_contact(law="hertz", restitution=0.2),
    "corridor_e0.3": lambda: _corridor(43, (2.0, 1.0), 0.3),
    "corridor_e0.6": lambda: _corridor(44, (1.0, -2.0), 0.6),
    "corridor_slow": lambda: _corridor(45, (0.3, 0.1), 0.05),
    "corridor_hertz": lambda: _corridor(46, (2.0, -1.0), 0.1).with_contact(law="hertz"),
    "crowd_10": lambda: _crowd(10, 47, restitution=0.05),
    "crowd_25_e0.4": lambda: _crowd(25, 48, restitution=0.4),
    "crowd_60": lambda: _crowd(60, 49, restitution=0.1),
    "crowd_40_e0.8": lambda: _crowd(40, 50, restitution=0.8),
}
