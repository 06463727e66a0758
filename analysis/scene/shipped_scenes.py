"""The scenes in `scenes/`, made, and other crowds that the same words describe: by seed where a scene
is made, by jitter where it is given."""

import dataclasses
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
import shapely

from analysis.scene.anthropometry import Varied, apart, bodies_of
from analysis.scene.drive import Stop
from analysis.scene.floors import walled
from analysis.scene.rooms import Crowd, Inside, from_geometry
from analysis.scene.scene import (
    Analysis,
    ContactModel,
    Drive,
    Run,
    Scene,
    SceneError,
    Wall,
    read_scene,
)
from analysis.scene.schema import BodyForce
from analysis.scene.waiting import Doorway
from nscd import Snapshot, Walls

PAPER = "Jebrane, Argoul, Hakim, El Rhabi, Applied Mathematical Modelling 74 (2019) 409-421"
MASS_KG = 75.0
# The restitution that stands for the inelastic limit; penalty models cannot reach e = 0 (see
# docs/conventions.md).
INELASTIC = 0.01
# Dense enough to integrate a contact whose force decays within 0.3 ms, long enough for it to let go
# again.
IMPACT = Run(duration_s=0.3, frames=10000, time_step_s=2e-6)


def _read(name: str, disks: int, seed: int) -> Scene:
    return read_scene(name)


def _chain(name: str, disks: int, seed: int, *, wall: bool = False, unequal: bool = False) -> Scene:
    n = disks or 10
    mass = np.full(n, MASS_KG)
    if unequal:
        mass = np.random.default_rng(seed).integers(50, 101, n).astype(float)
    speed = np.full(n, 2.0) if wall else 2.0 * (1 - np.arange(n) / max(n - 1, 1))
    masses = "unequal masses (50-100 kg)" if unequal else "masses of 75 kg"
    place = "against a wall" if wall else "free"
    if wall:
        notes = f"""{n} aligned touching disks, {masses}, move at 2 m/s into a wall and stop.
Percussion between i and i+1 = sum of m_j u_j over j ≤ i. (The paper's "constrained" formulas
hold for the free chain.)"""
    else:
        notes = f"""{n} aligned touching disks, {masses}, free. Left velocities fall from 2 to 0
m/s along the chain, so that every contact closes. Closed form (5), (6): common velocity U = Σ m
u / Σ m, percussions λ(i,i+1) = λ(i-1,i) - m_i (U - u_i)."""
    end = 0.5 * (n - 1) + 0.25
    walls = (Wall(name="wall", start_m=(end, -1.0), end_m=(end, 1.0)),) if wall else ()
    return Scene(
        name=name,
        title=f"Chain of {n}, {place}, {masses}",
        source=f"{PAPER}, Fig. 3",
        notes=notes,
        snapshot=Snapshot(
            position=np.column_stack([0.5 * np.arange(n), np.zeros(n)]),
            velocity=np.column_stack([speed, np.zeros(n)]),
            radius=np.full(n, 0.25),
            mass=mass,
        ),
        walls=walls,
        contact=ContactModel(stiffness_N_per_m=1e6, restitution=INELASTIC),
        run=IMPACT,
        analysis=Analysis(kind="impact"),
    )


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
    return Snapshot(
        position=position.round(9),
        velocity=np.zeros((n, 2)),
        radius=radius.round(9),
        mass=np.full(n, MASS_KG),
    )


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


def _driven(
    name: str, title: str, source: str, notes: str, snapshot: Snapshot, duration: float
) -> Scene:
    """A crowd in the room of its size, compared at the end of its run."""
    reach = float(np.hypot(*snapshot.position.T).max()) + float(snapshot.radius.max())
    walls, drive = room_with_a_door(reach)
    return Scene(
        name=name,
        title=title,
        source=source,
        notes=notes,
        snapshot=snapshot,
        walls=walls,
        drive=drive,
        contact=ContactModel(stiffness_N_per_m=1e6, restitution=0.1),
        run=Run(duration_s=duration, frames=40),
        analysis=Analysis(kind="driven", time_s=duration),
    )


def _arch(disks: int, seed: int) -> Scene:
    n = disks or 594
    notes = f"""{n} pedestrians of 75 kg in a square room. Desired speed 2 m/s toward the
nearest point of a 1 m exit, relaxation time 0.5 s. Frictionless, as in the paper. Disks of
radius 0.17 m ± 10 % (dense packing: 9 per m²) flow out through 1 m and can stop for seconds
(docs/results/rigid.md). Analysed at the instant when the crowd is pressed to the exit."""
    snapshot, title = crowd_before_a_door(n, seed, 0.17), f"{n} people pressed to a 1 m exit"
    return _driven("arch", title, f"{PAPER}, Fig. 4", notes, snapshot, 2.0)


def _arch_masses(disks: int, seed: int) -> Scene:
    n = disks or 594
    notes = f"""The crowd of `arch` with unequal masses: whole kilograms, uniform between 50 and
100 kg, independent of radius and place ({n} pedestrians)."""
    mass = np.random.default_rng([seed, 1]).integers(50, 101, n).astype(float)
    snapshot = dataclasses.replace(crowd_before_a_door(n, seed, 0.17), mass=mass)
    title = f"{n} people of unequal mass pressed to a 1 m exit"
    return _driven("arch_masses", title, f"{PAPER}, Fig. 5", notes, snapshot, 2.0)


def _jam(disks: int, seed: int) -> Scene:
    n = disks or 300
    notes = f"""{n} frictionless disks too large to pass a 1 m door (radius 0.30 m ± 10 %): they
jam and come to rest. At rest nothing but contact forces balances the drive, so penalty and
rigid forces can be compared strictly. Not a crowd: a test."""
    snapshot, title = crowd_before_a_door(n, seed, 0.30), f"{n} large disks jammed at a 1 m door"
    return _driven("jam", title, "made for the comparison at rest", notes, snapshot, 12.0)


# The least deep crowd of the Green Guide's Table 11.2 on its steepest slope: 1.2 m for 2.0 kN/m.
TERRACE_DEG, LANE_M, ACROSS, SHOULDERS = 25.0, 4.0, 7, 1.38


def _terrace(disks: int, seed: int) -> Scene:
    n = disks or 23
    notes = f"""{n} people on a slope of {TERRACE_DEG:g} degrees who lean on those before them with
their whole weight, in a lane of {LANE_M:g} m. Disks as wide as shoulders: 1.38 times those of
ANSUR II. Closed form: at rest the barrier carries the sum of m g sin(slope)."""
    rows, pitch = -(-n // ACROSS), LANE_M / ACROSS
    radius, mass = bodies_of("ANSUR II", n, seed)
    place = np.stack(np.divmod(np.arange(n), ACROSS), axis=1) * [-pitch, pitch] + [
        -0.4,
        0.5 * pitch,
    ]
    place += np.random.default_rng([seed, 5]).uniform(-0.02, 0.02, (n, 2))
    ends = [(-pitch * (rows + 1), 0.0), (0.0, 0.0), (0.0, LANE_M), (-pitch * (rows + 1), LANE_M)]
    names = ("lower", "barrier", "upper")
    walls = tuple(
        Wall(name=name, start_m=start, end_m=end)
        for name, (start, end) in zip(names, pairwise(ends), strict=True)
    )
    crowd = Snapshot(
        position=place,
        velocity=np.zeros((n, 2)),
        radius=(SHOULDERS * radius).round(6),
        mass=mass,
    )
    segments = Walls(start=np.array(ends[:-1]), end=np.array(ends[1:]))
    return Scene(
        name="terrace",
        title=f"{n} people lean on a barrier below a slope of {TERRACE_DEG:g}°",
        source="Green Guide, Table 11.2, quoted by the Sports Grounds Safety Authority",
        notes=notes,
        snapshot=dataclasses.replace(crowd, position=apart(crowd, segments).position.round(9)),
        walls=walls,
        body_force=BodyForce(slope_deg=TERRACE_DEG, downhill=(1.0, 0.0)),
        contact=ContactModel(stiffness_N_per_m=1e6, restitution=0.1),
        run=Run(duration_s=4.0, frames=40, impulses=True),
        analysis=Analysis(kind="driven", time_s=4.0),
    )


def _arms(disks: int, seed: int) -> Scene:
    n = disks or 120
    notes = f"""{n} people before a 1 m door, who walk at 1 m/s and push with 150 N each. Each
holds the next off from 0.15 m on, with up to 200 N. That is between the push of LEMONS' people
(100 N) and that of a man who stands (about 250 N)."""
    snapshot, title = crowd_before_a_door(n, seed, 0.17), f"{n} people with arms before a 1 m door"
    made = _driven("arms", title, "made for this product", notes, snapshot, 6.0)
    assert made.drive is not None
    slow = made.drive.model_copy(update={"speed_m_per_s": 1.0})
    return made.with_contact(arm_reach_m=0.15, arm_force_N=200.0).model_copy(update={"drive": slow})


def _ell(disks: int, seed: int) -> Scene:
    n = disks or 60
    corridor = shapely.Polygon([(0, -6), (2.5, -6), (2.5, 2.5), (-6, 2.5), (-6, 0), (0, 0)])
    doors = [
        Doorway(ends=((0.0, -6.0), (2.5, -6.0)), start=shapely.box(-6, 0, 0, 2.5)),
        Doorway(ends=((-6.0, 0.0), (-6.0, 2.5)), start=shapely.box(0, -6, 2.5, 0)),
    ]
    pillar = Inside(blocks=[(0.9, 0.9, 1.4, 1.4)])
    crowd = Crowd(people=n, speed=1.3, varied=Varied(radius_share=0.1, seed=seed))
    made = from_geometry("ell", corridor, doors, crowd, 12.0, pillar)
    title = f"two opposing streams of {n} people round a corner with a pillar"
    return _soft(made, title)


def _turns(disks: int, seed: int) -> Scene:
    n = disks or 60
    sides = [(0, 0), (7.5, 0), (7.5, 6), (5, 6), (5, 2.5), (2.5, 2.5), (2.5, 6), (0, 6)]
    doors = [Doorway(ends=((5.0, 6.0), (7.5, 6.0)), start=shapely.box(0, 0, 2.5, 6))]
    crowd = Crowd(people=n, speed=1.3, varied=Varied(radius_share=0.1, seed=seed))
    made = from_geometry("turns", shapely.Polygon(sides), doors, crowd, 20.0)
    return _soft(made, f"{n} people turn two corners to a 2.5 m door")


def _soft(scene: Scene, title: str) -> Scene:
    """A scene of `percussions new` that ships, with bodies that LAMMPS steps quickly."""
    made = {"title": title, "source": "made for the way"}
    return scene.with_contact(stiffness_N_per_m=1e5).model_copy(update=made)


def _rail(disks: int, seed: int) -> Scene:
    scene = _terrace(disks, seed)
    lower, _, upper = scene.walls
    rail = Wall(
        name="rail", start_m=(0.0, 0.001), end_m=(0.0, LANE_M - 0.001), mass_kg=100.0,
        stiffness_N_per_m=2e5, damping_N_s_per_m=4000.0,
    )  # fmt: skip
    sides = (
        lower.model_copy(update={"end_m": (1.0, 0.0)}),
        upper.model_copy(update={"start_m": (1.0, LANE_M)}),
    )
    notes = """The crowd of `terrace` before a barrier that gives: 100 kg on a spring of 2·10⁵ N/m with a
damper of 4,000 N·s/m (an example). Closed form: at rest it has given by the sum of m g
sin(slope) over the stiffness."""
    changes = {
        "name": "rail",
        "title": f"{len(scene.snapshot)} people lean on a barrier that gives",
    }
    run = Run(duration_s=4.0, frames=80, impulses=True)
    return scene.model_copy(
        update={"walls": (sides[0], rail, sides[1]), "notes": notes, "run": run, **changes}
    )


# m: of the corridor of `two_way`, and between its rows and columns of people.
LONG_M, BROAD_M, APART_M = 8.0, 2.0, 0.5


def _two_way(disks: int, seed: int) -> Scene:
    n = disks or 40
    notes = f"""{n} people in a corridor, {LONG_M:g} m long and {BROAD_M:g} m broad, that begins again where it
ends. The first half of them walks to the right, the others to the left. Closed form: walls without
friction and contacts give nothing along it, so that its momentum is what the drive gives."""
    rng = np.random.default_rng([seed, 7])
    columns, rows = int(LONG_M / APART_M), int(BROAD_M / APART_M)
    if n > columns * rows:
        raise SceneError(f"--disks {n}: two_way has room for {columns * rows}")
    place = rng.permutation(np.stack(np.divmod(np.arange(columns * rows), rows), axis=1))[:n]
    place = APART_M * (place + 0.5) + rng.uniform(-0.03, 0.03, (n, 2))
    goal = {"people": (n // 2 + 1, n), "outward": (-1.0, 0.0)}
    drive = {"speed_m_per_s": 1.0, "relaxation_time_s": 0.5, "outward": (1.0, 0.0), "goals": [goal]}
    return Scene(
        name="two_way",
        title=f"{n} people walk both ways in a corridor without end",
        source="made for this product",
        notes=notes,
        period_x_m=(0.0, LONG_M),
        snapshot=Snapshot(
            position=place.round(9),
            velocity=np.zeros((n, 2)),
            radius=(0.2 * rng.uniform(0.9, 1.1, n)).round(9),
            mass=np.full(n, MASS_KG),
        ),
        walls=tuple(
            Wall(name=name, start_m=(0.0, y), end_m=(LONG_M, y))
            for name, y in (("lower", 0.0), ("upper", BROAD_M))
        ),
        drive=Drive.model_validate(drive),
        contact=ContactModel(stiffness_N_per_m=1e5, restitution=0.1),
        run=Run(duration_s=6.0, frames=60),
        analysis=Analysis(kind="driven", time_s=6.0),
    )


def _faint(disks: int, seed: int) -> Scene:
    n = disks or 60
    notes = f"""{n} frictionless disks too large for a 1 m door, jammed and at rest. From 8 s on the
third of them nearest to the door wants to go nowhere. Closed form: at rest the walls carry what the
drive gives, before and after."""
    snapshot, title = crowd_before_a_door(n, seed, 0.30), f"{n} large disks, of whom a third stops"
    made = _driven("faint", title, "made for this product", notes, snapshot, 16.0)
    assert made.drive is not None
    stops = (Stop(people=(1, max(1, n // 3)), time_s=8.0),)
    return made.model_copy(update={"drive": made.drive.model_copy(update={"stops": stops})})


# Radii and places of the disks of a body, as shares of half its breadth (ANSUR II: 0.48–0.51 m).
BODY = ((0.42, -0.58), (0.5, 0.0), (0.42, 0.58))


def _shoulders(disks: int, seed: int) -> Scene:
    n = disks or 40
    notes = f"""{n} people of three disks each, half as deep as broad ({2 * 0.24:g} m ± 10 %), before a 1 m door. They
face it within 0.5 rad. Each has 75 kg, shared by area, and the moment of inertia of its disks."""
    people = crowd_before_a_door(n, seed, 0.24)
    away = np.arctan2(*(people.position.T[::-1])) + np.pi / 2
    facing = away + np.random.default_rng([seed, 8]).uniform(-0.5, 0.5, n)
    share, place = np.array(BODY).T
    across = np.column_stack([np.cos(facing), np.sin(facing)])
    position = people.position[:, None] + np.einsum("n,b,nx->nbx", people.radius, place, across)
    crowd = Snapshot(
        position=position.reshape(-1, 2).round(9),
        velocity=np.zeros((3 * n, 2)),
        radius=np.outer(people.radius, share).ravel().round(9),
        mass=np.outer(people.mass, share**2 / (share**2).sum()).ravel().round(9),
    ).joined(np.repeat(np.arange(1, n + 1), 3))
    title = f"{n} people with shoulders before a 1 m door"
    return _driven("shoulders", title, "made for this product", notes, crowd, 6.0)


OF_FIXED_SIZE = ("pair", "pair_oblique", "four_disks", "corridor")
MAKERS: dict[str, Callable[[int, int], Scene]] = {
    # these are data, in scenes/
    **{name: partial(_read, name) for name in OF_FIXED_SIZE},
    "chain": partial(_chain, "chain"),
    "chain_masses": partial(_chain, "chain_masses", unequal=True),
    "chain_wall": partial(_chain, "chain_wall", wall=True),
    "chain_wall_masses": partial(_chain, "chain_wall_masses", wall=True, unequal=True),
    "arch": _arch,
    "arch_masses": _arch_masses,
    "jam": _jam,
    "terrace": _terrace,
    "arms": _arms,
    "ell": _ell,
    "turns": _turns,
    "rail": _rail,
    "two_way": _two_way,
    "faint": _faint,
    "shoulders": _shoulders,
}
# About 2 kB of memory for each.
MOST_DISKS = 1_000_000
# Their disks are random.
SEEDED = (
    "arch",
    "arch_masses",
    "jam",
    "terrace",
    "arms",
    "ell",
    "turns",
    "rail",
    "two_way",
    "faint",
    "shoulders",
)


def make(name: str, disks: int | None = None, seed: int = 1) -> Scene:
    """Make the scene `name`, the same bit by bit each time.

    disks: number; the scene's own where left out
    seed: of what is random in it

    Raises SceneError for an unknown name, a number of disks that the
    scene cannot have, or a negative seed."""
    if name not in MAKERS:
        raise SceneError(f"unknown scene {name!r} to make. There are: {', '.join(MAKERS)}")
    if disks is not None and (name in OF_FIXED_SIZE or disks < 2):
        raise SceneError(
            f"--disks {disks}: {name} "
            + ("has a fixed number of disks" if name in OF_FIXED_SIZE else "needs at least 2")
        )
    if disks is not None and disks > MOST_DISKS:
        raise SceneError(f"--disks {disks}: at most {MOST_DISKS}")
    if seed < 0:
        raise SceneError(f"--seed {seed}: a number ≥ 0 is needed")
    return MAKERS[name](disks or 0, seed)


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
    given = frames[number % len(frames)]
    rest = {"reconciliation": None, "other_frames": None, "other_crowds": ()}
    for draws in range(DRAWS):
        moved = dataclasses.replace(
            given,
            position=given.position + random.normal(0.0, PLACE_M, given.position.shape),
            radius=given.radius * random.uniform(1 - RADIUS_SHARE, 1 + RADIUS_SHARE, len(given)),
        )
        crowd = apart(moved, scene.wall_segments())
        made = scene.model_copy(update=rest | {"snapshot": crowd}).rerouted()
        try:
            made.check(f"{scene.name}, crowd {number}")
        except SceneError:
            if draws == DRAWS - 1:
                raise
        else:
            break
    return made


def with_push(scene: Scene, push: float) -> Scene:
    """Return a driven scene whose people push with `push` (N) in the mean: with the same speed and
    a longer or shorter relaxation time."""
    drive = scene.drive
    assert drive is not None
    longer = drive.relaxation_time_s * scene.mean_push / push
    slower = drive.model_copy(update={"relaxation_time_s": longer})
    return scene.model_copy(update={"drive": slower})


def with_radius(scene: Scene, more: float) -> Scene:
    """Return a scene whose radii are larger by `more` (m), its disks pushed apart where they then
    overlap. Raises StepError where they cannot be, SceneError where somebody is then outside."""
    larger = dataclasses.replace(scene.snapshot, radius=scene.snapshot.radius + more)
    crowd = apart(larger, scene.wall_segments())
    rest = {"reconciliation": None, "other_frames": None, "other_crowds": ()}
    made = scene.model_copy(update=rest | {"snapshot": crowd}).rerouted()
    made.check(scene.name)
    return made


def how_varied(scene: Scene, crowds: int) -> str:
    """Say in words what so many crowds of a scene differ in."""
    if scene.name in SEEDED and _is_shipped(scene):
        return "the seed of their places and radii"
    said = (
        f"places (σ = {100 * PLACE_M:g} cm along each axis) and radii (± {100 * RADIUS_SHARE:g} %)"
    )
    others = scene.other_frames
    if not others or not others.frames[: crowds - 1]:
        return said
    after = others.after_s[: crowds - 1]
    return (
        f"the frame of the film ({1 + len(after)} frames, from {max(0.0, -min(after)):.2g} s before "
        f"to {max(0.0, *after):.2g} s after that of the first crowd), {said}"
    )


def _is_shipped(scene: Scene) -> bool:
    """Whether its crowd is the one that its name makes."""
    shipped = make(scene.name).snapshot
    return len(shipped) == len(scene.snapshot) and bool(
        np.array_equal(shipped.radius, scene.snapshot.radius)
    )
