"""Crowds and scenes that tests begin with."""

import numpy as np

from nscd import ContactLaw, Snapshot, Walls, find_contacts, solve


def disks_at(position, velocity=(0.0, 0.0), radius=0.25, mass=75.0, **others):
    """Disks at (n,2) m; one velocity (m/s), radius (m) or mass (kg) is everybody's."""
    n = len(position)
    return Snapshot(
        position=position,
        velocity=np.broadcast_to(velocity, (n, 2)),
        radius=np.broadcast_to(radius, n),
        mass=np.broadcast_to(mass, n),
        **others,
    )


def line(mass, velocity, radius=0.25):
    """Touching disks along x, of these masses (kg), with velocities along it (m/s)."""
    n = len(mass)
    left = np.column_stack([np.broadcast_to(velocity, n), np.zeros(n)])
    return disks_at(np.column_stack([2 * radius * np.arange(n), np.zeros(n)]), left, radius, mass)


def wall_after(snapshot):
    """The wall that the last of a line touches."""
    end = snapshot.position[-1, 0] + snapshot.radius[-1]
    return Walls(start=[[end, -1]], end=[[end, 1]])


# A floor and a wall that a lattice touches.
WALLS = Walls(start=[[-3, -0.6], [2.6, -3]], end=[[5, -0.6], [2.6, 3]])


def lattice(seed, n=25, decades=0.0, rows=6):
    """Touching disks on a triangular lattice with vacancies, in random motion; masses over some
    decades."""
    rng = np.random.default_rng(seed)
    j, i = (k.ravel() for k in np.meshgrid(np.arange(rows), np.arange(6), indexing="ij"))
    sites = np.column_stack([0.5 * i + 0.25 * (j % 2), -0.35 + 0.5 * np.sqrt(0.75) * j])
    chosen = rng.permutation(len(sites))[:n]
    velocity, mass = rng.normal(size=(n, 2)), 10.0 ** rng.uniform(-decades / 2, decades / 2, n)
    return disks_at(sites[chosen], velocity, mass=mass)


def part_of_a_lattice(seed, n, selected, decades=0.15):
    """Disks on a share of the sites of a triangular lattice: pairs, chains, rings and jams, in random
    motion; masses over so many decades to both sides of 60 kg."""
    rng = np.random.default_rng(seed)
    i, j = (k.ravel() for k in np.indices(2 * [int(np.ceil(np.sqrt(n / selected)))]))
    sites = np.column_stack([0.5 * i + 0.25 * (j % 2), 0.25 * np.sqrt(3) * j])
    chosen, velocity = rng.permutation(len(sites))[:n], rng.normal(size=(n, 2))
    return disks_at(sites[chosen], velocity, mass=60.0 * 10.0 ** rng.uniform(-decades, decades, n))


def turn(angle):
    """The matrix of a rotation."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def turned(snapshot, by, shift=0.0):
    """The crowd turned by a matrix and then moved."""
    position, velocity = snapshot.position @ by.T + shift, snapshot.velocity @ by.T
    return disks_at(position, velocity, snapshot.radius, snapshot.mass)


def solved(snapshot, walls=None, *, left_velocity=None, **law):
    """The contacts of a crowd and their percussions to 1e-10 under a law, which must be found."""
    contacts, law = find_contacts(snapshot, walls, tolerance=1e-9), ContactLaw(**law)
    found = solve(snapshot, contacts, left_velocity=left_velocity, law=law, tolerance=1e-10)
    assert found.status == "solved", found.reason
    return contacts, found


def drive_to(start, end, outward=(1.0, 0.0), speed=2.0, **others):
    """Everybody walks to the door (m) at this speed (m/s) with τ = 0.5 s."""
    from analysis.scene.scene import Drive

    return Drive(
        speed_m_per_s=speed, relaxation_time_s=0.5, door_start_m=start, door_end_m=end,
        outward=outward, **others,
    )  # fmt: skip


def spaced(scene, **more):
    """The scene of people who keep their distance."""
    from analysis.scene.scene import Drive

    drive = scene.drive.model_dump(exclude_none=True) | {"time_gap_s": 0.8, "push_share": 0.2} | more
    return scene.model_copy(update={"drive": Drive.model_validate(drive)}).rerouted()


def scene_at(snapshot, walls=(), *, contact, run, name="made", time=None, **others):
    """A scene of disks; walls as pairs of ends (m), contact and run as their keys; an impact, or a
    driven crowd looked at at a time (s)."""
    from analysis.scene.scene import Scene
    from analysis.scene.schema import Analysis, ContactModel, Run, Wall

    made = tuple(
        Wall(name=f"wall{n}", start_m=tuple(map(float, start)), end_m=tuple(map(float, end)))
        for n, (start, end) in enumerate(walls)
    )
    when = {} if time is None else {"time_s": time}
    looked = Analysis(
        kind="driven" if others.get("drive") or others.get("body_force") else "impact", **when
    )
    return Scene(
        name=name, title=name, source="a test", snapshot=snapshot, walls=made,
        contact=ContactModel(**contact), run=Run(**run), analysis=looked, **others,
    )  # fmt: skip


PEOPLE = "id x y radius mass vx vy"


def frame(step, rows, columns=PEOPLE, kind="ATOMS"):
    """The text of a frame of a dump."""
    body = "".join(" ".join(map(str, row)) + "\n" for row in rows)
    return (
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{len(rows)}\nITEM: BOX BOUNDS ff ff pp\n"
        f"-10 10\n-10 10\n-0.5 0.5\nITEM: {kind} {columns}\n{body}"
    )


def two_people(first=(2, 0), difference=0.5, radius=0.25):
    """A dump of one who goes to another (m, m/s), 75 kg each."""
    rows = [[1, 0, 0, radius, 75, *first], [2, difference, 0, radius, 75, 0, 0]]
    return frame(0, rows)


def room_text(drive="", kind="driven"):
    """The text of a room's file; drive: the ends of its door (m), as TOML."""
    wanted = f"""
[drive]
speed_m_per_s = 1.0
relaxation_time_s = 0.5
{drive}
outward = [0.0, -1.0]
"""
    return f"""title = "A room"
source = "a test"
{wanted if drive else ""}
[contact]
stiffness_N_per_m = 1e6
restitution = 0.1

[run]
duration_s = 0.01
frames = 2

[analysis]
kind = "{kind}"
"""


# A limit of a user.
OWN_LIMIT = """
[[limit]]
name = "mine"
number = 500.0
unit = "N"
quantity = "contact_largest"
what = "my own"
population = "adults"
source = "my report, 2026"
read = "first-hand"
"""
