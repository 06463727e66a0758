"""LAMMPS' forces at rest among the percussions that the mechanics allows: the stiff limit, and what
history leaves."""

import numpy as np

from analysis.scene.scene import Wall
from analysis.scene.shipped_scenes import make, room_with_a_door
from nscd import find_contacts, solve
from nscd.indeterminacy.determinacy import admissible_determinacy, determinacy
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.intervals import Intervals, IntervalStatus, weights_of_disk, weights_of_wall
from nscd.indeterminacy.nearest import least_energy
from tests.crowds import disks_at, drive_to, scene_at

TAU = 0.5


def driven(name, snapshot, walls, drive, stiffness, duration):
    contact = {"stiffness_N_per_m": stiffness, "restitution": 0.05}
    run = {"duration_s": duration, "frames": 2}
    scene = scene_at(snapshot, contact=contact, run=run, name=name, drive=drive)
    return scene.model_copy(update={"walls": tuple(walls)})


def end_of(simulation, scene):
    """The disks of the last frame."""
    names = ("x", "y"), ("vx", "vy")
    position, velocity = (np.column_stack([simulation[k][-1] for k in two]) for two in names)
    return disks_at(position, velocity, simulation["radius"][-1], scene.snapshot.mass)


def percussions_of(simulation, contacts):
    """τ f of LAMMPS' last normal forces f at the given contacts (N·s)."""
    last = simulation.contacts[-1]
    along = (last.force * last.normal).sum(1)
    keys = zip(last.first - 1, last.second - 1, last.is_wall, strict=True)
    force = dict(zip(keys, along, strict=True))
    wanted = zip(contacts.first, contacts.second, contacts.is_wall, strict=True)
    found = TAU * np.array([force.pop(key, 0.0) for key in wanted])
    assert not force
    return found


def channel(stiffness):
    """Ten touching disks of unequal mass in four rows, pressed straight to the end of a channel
    that they just fill."""
    r, half = 0.25, 0.75
    position = [
        (-r - row * r * np.sqrt(3), (j - (2 - row % 2) / 2) * 2 * r)
        for row in range(4)
        for j in range(3 - row % 2)
    ]
    mass = np.random.default_rng(3).integers(50, 101, 10).astype(float)
    walls = (
        Wall(name="front", start_m=(0.0, -half), end_m=(0.0, half)),
        Wall(name="upper", start_m=(0.0, half), end_m=(-8.0, half)),
        Wall(name="lower", start_m=(-8.0, -half), end_m=(0.0, -half)),
    )
    drive = drive_to((0.0, -half), (0.0, half))
    # 400 periods √(m/k) are enough for its slowest motion to die out
    duration = 400 * np.sqrt(75.0 / stiffness)
    people = disks_at(position, radius=r, mass=mass)
    return driven("channel", people, walls, drive, stiffness, duration)


def test_stiff_forces_of_a_packing_loaded_from_rest_tend_to_the_least_energy(simulate):
    """Observed order 1 in 1/k over three decades."""
    scene = channel(1e5)
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-9)
    solution = solve(
        scene.snapshot,
        contacts,
        left_velocity=scene.drive.desired_velocity(scene.snapshot.position),
        tolerance=1e-10,
    )
    known = admissible_determinacy(contacts, solution)
    assert (len(contacts), known.redundant, known.determined.any()) == (25, 5, False)
    chosen = least_energy(contacts, solution)
    errors = []
    for stiffness in (1e5, 1e6, 1e7, 1e8):
        simulation = simulate("lammps", channel(stiffness))
        assert np.hypot(simulation["vx"][-1], simulation["vy"][-1]).max() < 1e-9
        difference = percussions_of(simulation, contacts) - chosen
        errors.append(np.linalg.norm(difference) / np.linalg.norm(chosen))
    np.testing.assert_allclose(np.log10(np.divide(errors[:-1], errors[1:])), 1.0, atol=0.06)
    assert errors[-1] < 3e-5


def hexagonal(spread):
    """Thirty disks, too large for the door, that touch in a triangular lattice before it. `spread`:
    half the range of their radii, relative; they then start a little apart."""
    r = 0.6
    i, j = (a.ravel() for a in np.meshgrid(np.arange(8), np.arange(-8, 9), indexing="ij"))
    sites = np.column_stack([-r - i * r * np.sqrt(3), (j + 0.5 * ((i + 1) % 2)) * 2 * r])
    sites = sites[np.argsort(np.hypot(*sites.T).round(9), kind="stable")[:30]]
    walls, drive = room_with_a_door(float(np.hypot(*sites.T).max()) + r)
    radius = r * (1 + spread * np.random.default_rng(5).uniform(-1, 1, 30))
    snapshot = disks_at((1 + 2 * spread) * sites, radius=radius)
    return driven("hexagonal", snapshot, walls, drive, 1e6, 10.0)


def check_inside(simulation, scene):
    """Assert that LAMMPS' last forces lie in the proven intervals of its own last frame, contact by
    contact, disk by disk and wall by wall. The impulses on the disks differ by Δ, what still
    accelerates them; the certificates say how far that moves each end. Returns contacts, forces,
    percussions of least energy, Intervals of the contacts."""
    snapshot = end_of(simulation, scene)
    contacts = find_contacts(snapshot, scene.wall_segments(), tolerance=0.0)
    left = scene.drive.desired_velocity(snapshot.position)
    solution = solve(snapshot, contacts, left_velocity=left, tolerance=1e-10)
    assert solution.status == "solved"
    observed = percussions_of(simulation, contacts)
    assert len(contacts) == len(simulation.contacts[-1])
    admissible = Equilibrium.of(contacts, solution)
    assert not observed[~admissible.closed].any()
    change = (contacts.normal_matrix(len(snapshot)).T @ (observed - admissible.reaction)).reshape(-1, 2)
    assert np.abs(change).max() < 1e-7
    intervals = Intervals(admissible)
    rows = [*np.eye(len(contacts))]
    rows += [weights_of_disk(contacts, disk) for disk in range(0, len(snapshot), 5)]
    rows += [weights_of_wall(contacts, wall) for wall in range(2)]
    every = []
    for weights in rows:
        found = intervals.of(weights)
        assert found.status is IntervalStatus.PROVEN
        below, above = (found.lower_velocity * change).sum(), (found.upper_velocity * change).sum()
        assert max(abs(below), abs(above)) < 1e-9 * observed.max()
        rounding = 1e-12 * observed.sum()
        assert found.lower + below - rounding <= weights @ observed <= found.upper + above + rounding
        every.append(found)
    return contacts, observed, least_energy(contacts, solution), every[: len(contacts)]


def difference(observed, chosen):
    return np.linalg.norm(observed - chosen) / np.linalg.norm(chosen)


def test_forces_of_a_jammed_hexagonal_packing_lie_in_the_intervals(simulate):
    """Equal disks, pressed from exact touch: the forces are those of least energy."""
    scene = hexagonal(0.0)
    simulation = simulate("lammps", scene)
    assert np.hypot(simulation["vx"][-1], simulation["vy"][-1]).max() < 1e-10
    contacts, observed, chosen, intervals = check_inside(simulation, scene)
    known = determinacy(contacts, 30)
    assert (len(contacts), known.rank, known.determined.sum()) == (73, 59, 8)
    assert np.median([one.width for one in intervals]) > 0.5 * observed.max()
    assert difference(observed, chosen) < 2e-5


def test_radii_that_nobody_can_measure_change_the_forces_within_the_intervals(simulate):
    """Radii of 0.6 m ± 0.6 mm: a third of the forces is another, all are admissible."""
    scene = hexagonal(1e-3)
    contacts, observed, chosen, _ = check_inside(simulate("lammps", scene), scene)
    assert determinacy(contacts, 30).redundant == 10
    assert 0.2 < difference(observed, chosen) < 0.5


def test_history_moves_the_forces_away_from_the_least_energy_but_not_out(simulate):
    """Unequal disks that walk up to the door from afar come to rest otherwise."""
    scene = make("jam", 40).with_contact(stiffness_N_per_m=1e5).with_run(duration_s=40.0, frames=2)
    start = scene.snapshot
    snapshot = disks_at(start.position * [1.5, 1.0], start.velocity, start.radius, start.mass)
    scene = scene.model_copy(update={"snapshot": snapshot})
    contacts, observed, chosen, intervals = check_inside(simulate("lammps", scene), scene)
    assert determinacy(contacts, 40).redundant >= 3
    assert np.median([one.width for one in intervals]) > 0.03 * observed.max()
    assert 0.05 < difference(observed, chosen) < 0.3
