"""The scenes in `scenes/`, made, and other crowds that the same words describe: by seed where a scene
is made, by jitter where it is given."""

import dataclasses
import re
from collections.abc import Callable
from functools import partial

import numpy as np
import shapely

from analysis.scene.anthropometry import Varied, bodies_of, separated
from analysis.scene.drive import Stop
from analysis.scene.fields import Point
from analysis.scene.floor_files import walled
from analysis.scene.new_scene import Crowd, Inside, from_geometry
from analysis.scene.scene import Drive, Room, Scene, SceneError, Wall, read_room, read_scene
from analysis.scene.waiting import Doorway
from nscd import Snapshot
from nscd.arrays import normal
from nscd.segments import lengths

MASS_KG = 75.0


def _again(name: str, n: int, crowd: Snapshot, **changes: object) -> Scene:
    """The shipped scene of that name with a crowd of n people, whom its words count, and other
    changes."""
    room, notes = read_room(name)
    count, _ = MAKERS[name]
    title, notes = (re.sub(rf"\b{count}\b", str(n), words) for words in (room.title, notes))
    changed = room.model_copy(update={"title": title, **changes})
    return Scene.of(changed, name=name, notes=notes, snapshot=crowd)


def _chain(name: str, n: int, seed: int) -> Scene:
    mass = np.full(n, MASS_KG)
    if "masses" in name:
        mass = np.random.default_rng(seed).integers(50, 101, n).astype(float)
    speed = np.full(n, 2.0) if "wall" in name else 2.0 * (1 - np.arange(n) / max(n - 1, 1))
    crowd = Snapshot(
        position=np.column_stack([0.5 * np.arange(n), np.zeros(n)]),
        velocity=np.column_stack([speed, np.zeros(n)]),
        radius=np.full(n, 0.25),
        mass=mass,
    )
    end = 0.5 * (n - 1) + 0.25
    wall = Wall(name="wall", start_m=(end, -1.0), end_m=(end, 1.0))
    return _again(name, n, crowd, walls=(wall,) if "wall" in name else ())


def crowd_before_a_door(n: int, seed: int, mean_radius: float) -> Snapshot:
    """Place n disks at rest before a 1 m door at the origin, at x < 0.

    Radii are mean ± 10 % (uniform), places the sites of a jittered hexagonal lattice that are
    nearest to the door. Neighbours are at least 0.2 r apart before the
    jitter, so that none overlap."""
    rng = np.random.default_rng(seed)
    widest = 1.1 * mean_radius
    spacing, jitter = 2.2 * widest, 0.1 * widest * 0.7
    rows = int(np.ceil(2.0 * np.sqrt(n))) + 4
    i, j = np.meshgrid(np.arange(rows), np.arange(-rows, rows + 1), indexing="ij")
    x = -(widest + jitter) - i.ravel() * spacing * 0.8660254037844386
    y = (j.ravel() + 0.5 * (i.ravel() % 2)) * spacing
    beside = np.maximum(np.abs(y) - 0.5, 0.0)
    nearest = np.argsort(x * x + beside * beside, kind="stable")[:n]
    position = np.column_stack([x, y])[nearest] + jitter * rng.uniform(-1, 1, (n, 2))
    radius = mean_radius * rng.uniform(0.9, 1.1, n)
    return Snapshot(position=position.round(9), radius=radius.round(9), mass=np.full(n, MASS_KG))


def room_with_a_door(reach: float) -> tuple[tuple[Wall, ...], Drive]:
    """Make a square room at x < 0 with a 1 m door in the middle of the side x = 0, and the drive
    through it; reach: m, from the door to the farthest rim of its crowd."""
    half = float(np.ceil(1.15 * reach))
    door = Doorway(ends=((0.0, -0.5), (0.0, 0.5)))
    names = ("front_lower", "front_upper", "upper", "back", "lower")
    walls, _, _ = walled(shapely.box(-2 * half, -half, 0.0, half), [door], names=names)
    drive = Drive(
        speed_m_per_s=2.0,
        relaxation_time_s=0.5,
        door_start_m=(0.0, -0.5),
        door_end_m=(0.0, 0.5),
        outward=(1.0, 0.0),
    )
    return walls, drive


def _in_room(name: str, n: int, crowd: Snapshot) -> Scene:
    """A crowd in the room of its size."""
    reach = float(lengths(crowd.position).max()) + float(crowd.radius.max())
    return _again(name, n, crowd, walls=room_with_a_door(reach)[0])


def _before_a_door(name: str, n: int, seed: int, radius: float = 0.17) -> Scene:
    crowd = crowd_before_a_door(n, seed, radius)
    if "masses" in name:
        mass = np.random.default_rng([seed, 1]).integers(50, 101, n).astype(float)
        crowd = dataclasses.replace(crowd, mass=mass)
    return _in_room(name, n, crowd)


def _faint(name: str, n: int, seed: int) -> Scene:
    stops = (Stop(people=(1, max(1, n // 3)), time_s=8.0),)
    return _before_a_door(name, n, seed, 0.30).with_drive(stops=stops)


# Of a lane as broad as the barrier of `terrace` and `rail`: people beside each other, and by how much
# broader than those of ANSUR II they are.
LANE_M, ACROSS, SHOULDERS = 4.0, 7, 1.38


def _leaning(name: str, n: int, seed: int) -> Scene:
    rows, pitch = -(-n // ACROSS), LANE_M / ACROSS
    radius, mass = bodies_of("ANSUR II", n, seed)
    grid = np.stack(np.divmod(np.arange(n), ACROSS), axis=1) * [-pitch, pitch]
    anchor = grid + np.array([-0.4, 0.5 * pitch])
    anchor += np.random.default_rng([seed, 5]).uniform(-0.02, 0.02, (n, 2))
    crowd = Snapshot(position=anchor, radius=(SHOULDERS * radius).round(6), mass=mass)
    # rail's people stand as those of the terrace do
    lane, own = (_as_long(read_room(one)[0], -pitch * (rows + 1)) for one in ("terrace", name))
    position = separated(crowd, lane.wall_segments()).position.round(9)
    return _again(name, n, dataclasses.replace(crowd, position=position), walls=own.walls)


def _as_long(room: Room, back: float) -> Room:
    """A lane whose walls begin at x = back (m)."""

    def moved(point: Point) -> Point:
        return (back, point[1]) if point[0] < 0 else point

    walls = [
        wall.model_copy(update={"start_m": moved(wall.start_m), "end_m": moved(wall.end_m)})
        for wall in room.walls
    ]
    return room.model_copy(update={"walls": tuple(walls)})


def _ell(name: str, n: int, seed: int) -> Scene:
    corridor = shapely.Polygon([(0, -6), (2.5, -6), (2.5, 2.5), (-6, 2.5), (-6, 0), (0, 0)])
    doors = [
        Doorway(ends=((0.0, -6.0), (2.5, -6.0)), start=shapely.box(-6, 0, 0, 2.5)),
        Doorway(ends=((-6.0, 0.0), (-6.0, 2.5)), start=shapely.box(0, -6, 2.5, 0)),
    ]
    pillar = Inside(blocks=[(0.9, 0.9, 1.4, 1.4)])
    crowd = Crowd(people=n, speed=1.3, varied=Varied(radius_share=0.1, seed=seed))
    made = from_geometry(name, corridor, doors, crowd, 12.0, pillar)
    return _soft(made, f"two opposing streams of {n} people round a corner with a pillar")


def _turns(name: str, n: int, seed: int) -> Scene:
    sides = [(0, 0), (7.5, 0), (7.5, 6), (5, 6), (5, 2.5), (2.5, 2.5), (2.5, 6), (0, 6)]
    doors = [Doorway(ends=((5.0, 6.0), (7.5, 6.0)), start=shapely.box(0, 0, 2.5, 6))]
    crowd = Crowd(people=n, speed=1.3, varied=Varied(radius_share=0.1, seed=seed))
    made = from_geometry(name, shapely.Polygon(sides), doors, crowd, 20.0)
    return _soft(made, f"{n} people turn two corners to a 2.5 m door")


def _soft(scene: Scene, title: str) -> Scene:
    """A scene of `percussions new` that ships, with bodies that LAMMPS steps quickly."""
    made = {"title": title, "source": "made for the way"}
    return scene.with_contact(stiffness_N_per_m=1e5).model_copy(update=made)


# m: of the corridor of `two_way`, and between its rows and columns of people.
LONG_M, BROAD_M, APART_M = 8.0, 2.0, 0.5


def _two_way(name: str, n: int, seed: int) -> Scene:
    rng = np.random.default_rng([seed, 7])
    columns, rows = int(LONG_M / APART_M), int(BROAD_M / APART_M)
    if n > columns * rows:
        raise SceneError(f"--disks {n}: two_way has room for {columns * rows}")
    index = rng.permutation(np.stack(np.divmod(np.arange(columns * rows), rows), axis=1))[:n]
    index = APART_M * (index + 0.5) + rng.uniform(-0.03, 0.03, (n, 2))
    radius = (0.2 * rng.uniform(0.9, 1.1, n)).round(9)
    crowd = Snapshot(position=index.round(9), radius=radius, mass=np.full(n, MASS_KG))
    made = _again(name, n, crowd)
    assert made.drive is not None
    (back,) = made.drive.goals
    return made.with_drive(goals=(back.model_copy(update={"people": (n // 2 + 1, n)}),))


# Radii and places of the disks of a body, as shares of half its breadth (ANSUR II: 0.48–0.51 m).
BODY = ((0.42, -0.58), (0.5, 0.0), (0.42, 0.58))


def _shoulders(name: str, n: int, seed: int) -> Scene:
    people = crowd_before_a_door(n, seed, 0.24)
    # nanometres are those of every processor
    away = np.arctan2(*(people.position.T[::-1])) + np.pi / 2
    facing = away + np.random.default_rng([seed, 8]).uniform(-0.5, 0.5, n)
    fraction, position = np.array(BODY).T
    across = np.column_stack([np.cos(facing), np.sin(facing)])
    off = people.radius[:, None, None] * position[:, None] * across[:, None]
    crowd = Snapshot(
        position=(people.position[:, None] + off).reshape(-1, 2).round(9),
        radius=np.outer(people.radius, fraction).ravel().round(9),
        mass=np.outer(people.mass, fraction * fraction / (fraction * fraction).sum()).ravel().round(9),
    ).joined(np.repeat(np.arange(1, n + 1), 3))
    return _in_room(name, n, crowd)


# All of these are data, in scenes/. The crowds of others can be made again: how many people the
# shipped one has, and what makes a scene of another number and another seed.
OF_FIXED_SIZE = ("pair", "pair_oblique", "four_disks", "corridor")
Maker = Callable[[str, int, int], Scene]
CHAINS: dict[str, tuple[int, Maker]] = dict.fromkeys(
    ("chain", "chain_masses", "chain_wall", "chain_wall_masses"), (10, _chain)
)
# Their disks are random.
SEEDED: dict[str, tuple[int, Maker]] = {
    "arch": (594, _before_a_door),
    "arch_masses": (594, _before_a_door),
    "jam": (300, partial(_before_a_door, radius=0.30)),
    "terrace": (23, _leaning),
    "arms": (120, _before_a_door),
    "ell": (60, _ell),
    "turns": (60, _turns),
    "rail": (23, _leaning),
    "two_way": (40, _two_way),
    "faint": (60, _faint),
    "shoulders": (40, _shoulders),
}
MAKERS = CHAINS | SEEDED
# About 2 kB of memory for each.
MOST_DISKS = 1_000_000


def make(name: str, disks: int | None = None, seed: int = 1) -> Scene:
    """Make the scene `name`, the same bit by bit each time.

    disks: number; the scene's own where left out
    seed: of what is random in it

    Raises SceneError for an unknown name, a number of disks that the
    scene cannot have, or a negative seed."""
    if name not in (choices := (*OF_FIXED_SIZE, *MAKERS)):
        raise SceneError(f"unknown scene {name!r} to make. There are: {', '.join(choices)}")
    if disks is not None and (name in OF_FIXED_SIZE or disks < 2):
        raise SceneError(
            f"--disks {disks}: {name} "
            + ("has a fixed number of disks" if name in OF_FIXED_SIZE else "needs at least 2")
        )
    if disks is not None and disks > MOST_DISKS:
        raise SceneError(f"--disks {disks}: at most {MOST_DISKS}")
    if seed < 0:
        raise SceneError(f"--seed {seed}: a number ≥ 0 is needed")
    if name in OF_FIXED_SIZE:
        return read_scene(name)
    count, maker = MAKERS[name]
    return maker(name, disks or count, seed)


# How well the place (m) and the radius (share) of a person in a given scene are taken to be known.
PLACE_M, RADIUS_SHARE = 0.02, 0.02
# A crowd in which somebody has come through the door or a wall is drawn again, so often at most.
DRAWS = 50


def variant(scene: Scene, number: int) -> Scene:
    """Return crowd `number` of a scene; 0 is the scene itself.

    A shipped scene of random disks is made with another seed. Any other has its places moved at
    random, by 2 cm in the mean square along each axis, and its radii multiplied by 1 ± 2 %; where
    other frames of a film came with it, they take turns with its own, and are varied so too. Disks
    that then overlap are pushed apart as little as possible. Where somebody is then outside the
    walls, as who stood in the door may be, all are drawn again.

    Raises StepError where they cannot be pushed apart, SceneError where somebody stays outside."""
    if number == 0:
        return scene
    if scene.name in SEEDED and _is_shipped(scene):
        crowd = make(scene.name, seed=1 + number).snapshot
        return scene.model_copy(update={"snapshot": crowd})
    random = np.random.default_rng([2, number])
    frames = (scene.snapshot, *scene.other_crowds)
    inputs = frames[number % len(frames)]
    of = inputs.bodies
    who = np.arange(len(inputs)) if of is None else of.number.astype(np.int64)
    centre = inputs.position if of is None else of.centre[who]
    count = int(who.max(initial=-1)) + 1
    for _ in range(DRAWS):
        shift = PLACE_M * normal(random, (count, 2))[who]
        size = random.uniform(1 - RADIUS_SHARE, 1 + RADIUS_SHARE, count)
        position = centre + size[who, None] * (inputs.position - centre) + shift
        moved = dataclasses.replace(inputs, position=position, radius=inputs.radius * size[who])
        if of is not None:
            moved = moved.joined(of.ids[who], inertia=of.inertia * (size * size))
        try:
            return _instead(scene, moved, f"{scene.name}, crowd {number}")
        except SceneError as error:
            outside = error
    raise outside


def _instead(scene: Scene, crowd: Snapshot, origin: str) -> Scene:
    """The scene with another crowd, pushed apart."""
    rest = {"reconciliation": None, "other_frames": None, "other_crowds": ()}
    crowd = separated(crowd, scene.wall_segments())
    made = scene.model_copy(update=rest | {"snapshot": crowd}).rerouted()
    made.check(origin)
    return made


def with_push(scene: Scene, push: float) -> Scene:
    """Return a driven scene whose people push with `push` (N) in the mean: with the same speed and
    a longer or shorter relaxation time."""
    assert scene.drive is not None
    longer = scene.drive.relaxation_time_s * scene.mean_push / push
    return scene.with_drive(relaxation_time_s=longer)


def with_radius(scene: Scene, more: float) -> Scene:
    """Return a scene whose radii are larger by `more` (m), its disks pushed apart where they then
    overlap. Raises StepError where they cannot be, SceneError where somebody is then outside."""
    larger = dataclasses.replace(scene.snapshot, radius=scene.snapshot.radius + more)
    return _instead(scene, larger, scene.name)


def how_varied(scene: Scene, crowds: int) -> str:
    """Say in words what so many crowds of a scene differ in."""
    if scene.name in SEEDED and _is_shipped(scene):
        return "the seed of their places and radii"
    stated = (
        f"places (σ = {100 * PLACE_M:g} cm along each axis) and radii (± {100 * RADIUS_SHARE:g} %)"
    )
    others = scene.other_frames
    if not others or not others.frames[: crowds - 1]:
        return stated
    after = others.after_s[: crowds - 1]
    return (
        f"the frame of the film ({1 + len(after)} frames, from {max(0.0, -min(after)):.2g} s before "
        f"to {max(0.0, *after):.2g} s after that of the first crowd), {stated}"
    )


def _is_shipped(scene: Scene) -> bool:
    """Whether its crowd is the one that its name makes."""
    shipped = make(scene.name).snapshot
    return len(shipped) == len(scene.snapshot) and bool(
        np.array_equal(shipped.radius, scene.snapshot.radius)
    )
