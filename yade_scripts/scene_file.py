"""A scene as the scripts need it: its TOML file, its LAMMPS data file and what was given on the
command line."""

import ctypes
import json
import math
import os
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NUMBERS = {
    "stiffness": ("contact", "stiffness_N_per_m"),
    "wall_stiffness": ("contact", "wall_stiffness_N_per_m"),
    "restitution": ("contact", "restitution"),
    "friction": ("contact", "friction"),
    "tangential_ratio": ("contact", "tangential_ratio"),
    "duration": ("run", "duration_s"),
    "frames": ("run", "frames"),
    "dt": ("run", "time_step_s"),
    "drive_interval": ("run", "drive_interval_steps"),
}
# of one chest compressed by D: 5490 D + 108000 D^2 (N and m); two disks are two in series, D =
# overlap/2 each, and a wall meets one; of two of mean radius, body_hertz: 18500 overlap^1.5; and
# the nominal stiffnesses of both laws, secants at an overlap of 0.1 m
CHEST, CHEST_SQUARE = 5490.0, 108000.0
BODY_HERTZ, BODY_STIFFNESS, BODY_AT_WALLS = 18500.0, 5445.0, 16290.0
GRAVITY = 9.80665  # m/s2
LARGEST_DAMPING_RATIO = 10.0
STEP_FRACTION = 0.1
CROSSING_FRACTION = 0.05  # of the smallest radius, in a step, at the fastest speed asked for


class SceneFileError(ValueError):
    """A scene that cannot be run; the message names the file, line or field."""


@dataclass(frozen=True)
class Bodies:
    """What moves, alone or as rigid bodies of several disks: ids (b,), mass (b,) kg, centre (b,2) m,
    inertia (b,) kg m2, velocity (b,2) m/s, spin (b,) rad/s; of (n,): the body of each disk."""

    ids: np.ndarray
    mass: np.ndarray
    centre: np.ndarray
    inertia: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    of: np.ndarray


@dataclass(frozen=True)
class Disks:
    """ids (n,), radius (n,) m, mass (n,) kg, position and velocity (n,2) m, m/s, spin (n,) rad/s,
    box: its three lines, bodies: what moves, joined: whether disks are in the file of bodies."""

    ids: np.ndarray
    radius: np.ndarray
    mass: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    box: tuple
    bodies: Bodies
    joined: bool

    def masses_met(self):
        """The smallest and largest mass (kg) that a contact without friction can meet: at a lever l
        M/(1 + M l^2/I) of a body, and M."""
        body = self.bodies
        square = ((self.position - body.centre[body.of]) ** 2).sum(1)
        met = body.mass[body.of] / (1 + (body.mass / body.inertia)[body.of] * square)
        return met.min(), body.mass.max()


def read_scene(path, arguments):
    """The scene file's tables, with the numbers in `arguments` (name → text) in their place."""
    try:
        scene = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneFileError(f"{path}: {error.strerror}") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneFileError(f"{path}: {error}") from None
    for name, text in arguments.items():
        if name not in NUMBERS:
            raise SceneFileError(
                f"{name}={text}: unknown. There are: {', '.join([*NUMBERS, 'out'])}"
            )
        table, key = NUMBERS[name]
        try:
            scene[table][key] = type(scene[table].get(key, 0.0))(float(text))
        except ValueError:
            raise SceneFileError(f"{name}={text}: not a number") from None
    for way in (drive := scene.get("drive", {}), *drive.get("goals", [])):
        if way and "door_start_m" not in way:  # a door far ahead, at which nobody arrives
            x, y = way["outward"]
            for key, s in (("door_start_m", 0.5), ("door_end_m", -0.5)):
                way[key] = [1e29 * (x - s * y), 1e29 * (y + s * x)]
    contact = scene["contact"]
    if contact["law"] not in LAWS:
        raise SceneFileError(f"{path}: contact.law: {contact['law']}. There are {', '.join(LAWS)}")
    if "period_x_m" in scene:
        raise SceneFileError(f"{path}: period_x_m: YADE has none here: use lammps or rigid")
    if "bodies" in scene["disks"] and "arm_reach_m" in contact:
        raise SceneFileError(f"{path}: contact.arm_reach_m: only for people of one disk each")
    if contact["law"] != "hooke" and contact.get("friction", 0.0):
        raise SceneFileError(
            f"{path}: contact.friction: {contact['friction']:g}. YADE runs {contact['law']} without "
            "friction here" + ("" if contact["law"] == "body" else ", LAMMPS runs both")
        )
    if contact["law"] in ("body", "body_hertz"):
        contact |= {"stiffness_N_per_m": BODY_STIFFNESS, "wall_stiffness_N_per_m": BODY_AT_WALLS}
    if "time_gap_s" in scene.get("drive", {}):
        scene["drive"]["distance"] = Distance(path)
    if "clearance_m" in scene.get("drive", {}):
        scene["drive"]["way"] = read_way(Path(path).with_suffix(".way"), scene)
    return scene


def complete_drive(drive, mass):
    """Put speed and relaxation time (0.5 s where neither is said) in the place of push_N, the push m
    U/tau of a person of mean mass."""
    if "push_N" in drive:
        mean, push = float(mass.mean()), drive.pop("push_N")
        if "speed_m_per_s" in drive:
            drive["relaxation_time_s"] = mean * drive["speed_m_per_s"] / push
        tau = drive.setdefault("relaxation_time_s", 0.5)
        drive.setdefault("speed_m_per_s", push * tau / mean)


def limit_drive(scene, time_step):
    """Have the drive evaluated at the latest after a twentieth of its relaxation time."""
    drive = scene["drive"]
    tau = drive["relaxation_time_s"]
    maximum = max(1, int(0.05 * (min(tau, 1.0) if "distance" in drive else tau) / time_step + 1e-9))
    every = scene["run"].get("drive_interval_steps", maximum)
    scene["run"]["drive_interval_steps"] = min(every, maximum)


def fastest(drive):
    """The fastest speed that anybody wants (m/s): with jostling, of 5 standard deviations."""
    return drive["speed_m_per_s"] + 5.0 * drive.get("jostling_m_per_s", 0.0)


def acceleration(scene):
    """What the body force gives to everybody, (2,) m/s2."""
    force = scene.get("body_force", {"acceleration_m_per_s2": (0.0, 0.0)})
    if "slope_deg" in force:
        # 12 digits, which are those of every processor
        sine = float(f"{math.sin(math.radians(force['slope_deg'])):.12g}")
        return GRAVITY * sine * np.array(force["downhill"])
    return np.array(force["acceleration_m_per_s2"], float)


def speed_most(scene, disks):
    """The fastest speed asked for (m/s): at the start, or of the drive, and what a body force
    adds."""
    drive = scene.get("drive")
    speed = max(float(np.hypot(*disks.velocity.T).max()), fastest(drive) if drive else 0.0)
    lasts = drive["relaxation_time_s"] if drive else scene["run"]["duration_s"]
    return speed + float(np.hypot(*acceleration(scene))) * lasts


def read_disks(path, bodies=None):
    """The disks of a LAMMPS data file (atom_style sphere). The density column is that of a
    sphere. bodies: the file of fix rigid/small, where Molecules says whose each disk is."""
    section, rows, bounds = "", {"Atoms": [], "Velocities": [], "Molecules": []}, {}
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise SceneFileError(f"{path}: {error.strerror}") from None
    for number, line in enumerate(lines[1:], start=2):
        words = line.split("#")[0].split()
        try:
            if words and words[0] in rows:
                section = words[0]
            elif words and section:
                rows[section].append([float(word) for word in words[:7]])
            elif len(words) == 4 and words[3][1:] == "hi":
                bounds[words[2]] = tuple(map(float, words[:2]))
        except ValueError:
            raise SceneFileError(
                f"{path}, line {number}: not a row of numbers: {line.strip()!r}"
            ) from None
    atoms, motion = (np.array(sorted(rows[name])) for name in ("Atoms", "Velocities"))
    if (
        atoms.ndim != 2
        or atoms.shape[1] != 7
        or motion.shape != atoms.shape
        or (motion[:, 0] != atoms[:, 0]).any()
    ):
        raise SceneFileError(f"{path}: not as many complete Velocities as Atoms")
    radius = 0.5 * atoms[:, 2]
    # products, since processors round a power differently
    volume = 4.0 * np.pi / 3.0 * (radius * radius * radius)
    mass = np.array([float(f"{m:.13g}") for m in atoms[:, 3] * volume])
    ids, position, velocity, spin = (
        atoms[:, 0].astype(int),
        atoms[:, 4:6],
        motion[:, 1:3],
        motion[:, 6],
    )
    alone = Bodies(ids, mass, position, 0.5 * mass * radius**2, velocity, spin, np.arange(len(ids)))
    return Disks(
        ids=ids,
        radius=radius,
        mass=mass,
        position=position,
        velocity=velocity,
        spin=spin,
        bodies=read_bodies(path.parent / bodies, ids, rows["Molecules"]) if bodies else alone,
        joined=bool(bodies),
        box=tuple("{:.16e} {:.16e}\n".format(*bounds[axis]) for axis in ("xlo", "ylo", "zlo")),
    )


def read_bodies(path, ids, molecules):
    """The rigid bodies of disks with ids (n,), of the file and of rows of a disk and its body: an id,
    mass, centre, inertia xx yy zz xy xz yz, velocity, angular momentum."""
    try:
        table, whose = np.loadtxt(path, skiprows=1, ndmin=2), np.array(sorted(molecules))
        table = table[np.argsort(table[:, 0])]
        of = np.searchsorted(table[:, 0], whose[:, 1])
        if not np.array_equal(whose, np.column_stack([ids, table[of, 0]])):
            raise ValueError("other bodies than in the section Molecules")
        turning, inertia = table[:, 16], table[:, 7]
    except (OSError, ValueError, IndexError) as error:
        raise SceneFileError(f"{path}: not the bodies of this scene: {error}") from None
    return Bodies(
        table[:, 0], table[:, 1], table[:, 2:4], inertia, table[:, 11:13], turning / inertia, of
    )


def restitution_of(ratio):
    """Restitution of two bodies that repel with max(0, k overlap + c approach) at damping ratio
    c/(2 sqrt(k m_eff)).

    Schwager and Poeschel, Granular Matter 9 (2007) 465; 1e-300 gives the limit exp(-2) at critical
    damping."""
    root = math.sqrt(abs(1 - ratio * ratio) + 1e-300)
    below = math.atan2(2 * ratio * root, 2 * ratio * ratio - 1)
    return math.exp(-ratio / root * (below if ratio < 1 else 2 * math.log(ratio + root)))


def damping_ratio_for(restitution):
    """The damping ratio whose restitution is the one asked, by bisection; at most 10 (restitution
    0.0024)."""
    if restitution >= 1:
        return 0.0
    low, high = 0.0, LARGEST_DAMPING_RATIO
    if restitution <= restitution_of(high):
        return high
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
    return 0.5 * (low + high)


@dataclass(frozen=True)
class Penalty:
    """The numbers of the contact law and of the run (SI): dashpots have the damping ratio at the
    heaviest disks; springs, wall_springs: see LAWS; stiffest: what time steps follow."""

    stiffness: float
    wall_stiffness: float
    stiffest: float
    friction: float
    tangential_stiffness: float
    wall_tangential_stiffness: float
    damping_ratio: float
    restitution: tuple
    damping: float
    wall_damping: float
    springs: tuple
    wall_springs: tuple
    safe_time_step: float
    time_step: float
    frame_interval: int
    steps: int


# Each law from the stiffness of disks and of walls and the mean radius (m): k, K and q of k overlap
# + K sqrt(R) overlap^1.5 + q overlap^2, of disks and of walls; and what stiffness time steps follow.
def hooke(k, wall_k, radius):
    return (k, 0.0, 0.0), (wall_k, 0.0, 0.0), max(k, wall_k)


def hertz(k, wall_k, radius):
    disks, walls = (value / (1.5 * math.sqrt(0.5 * 0.01) * radius) for value in (k, wall_k))
    return (0.0, disks, 0.0), (0.0, walls, 0.0), max(k, wall_k)


def body(k, wall_k, radius):
    tangent = CHEST + 2 * CHEST_SQUARE * radius  # at a depth of the radius
    return (CHEST / 2, 0.0, CHEST_SQUARE / 4), (CHEST, 0.0, CHEST_SQUARE), tangent


def body_hertz(k, wall_k, radius):
    disks = BODY_HERTZ / math.sqrt(0.5 * radius)
    walls = 2 * disks  # one body, where two disks are two in series
    return (0.0, disks, 0.0), (0.0, walls, 0.0), 1.5 * walls * radius


# How each damps: with one dashpot between disks and one at walls, clipped with the spring or apart
# from it, or in proportion to the tangent; and its springs.
LAWS = {
    "hooke": ("clipped", hooke),
    "hertz": ("tangent", hertz),
    "body": ("apart", body),
    "body_hertz": ("tangent", body_hertz),
}


def penalty_of(scene, disks):
    """The numbers of the scene's contact law and run: the rules of the LAMMPS decks."""
    contact, run, (minimum, most_met) = scene["contact"], scene["run"], disks.masses_met()
    k, (damping, springs_of) = contact["stiffness_N_per_m"], LAWS[contact["law"]]
    # a dashpot on approach only: its restitution is the root of that of one that never pulls
    power = 0.5 if damping == "apart" else 1.0
    ratio = damping_ratio_for(contact["restitution"] ** (1 / power))
    wall_k = contact.get("wall_stiffness_N_per_m", k)
    friction = contact.get("friction", 0.0)
    tangential = contact.get("tangential_ratio", 2 / 7) if friction else 0.0
    # the dashpot of hertz grows with the masses: every contact has the same damping ratio
    maximum = ratio if damping == "tangent" else ratio * math.sqrt(most_met / minimum)
    springs, wall_springs, stiffest = springs_of(k, wall_k, float(disks.radius.mean()))
    if "arm_reach_m" in contact:
        stiffest = max(stiffest, contact["arm_force_N"] / contact["arm_reach_m"])
    safe = min(
        STEP_FRACTION * math.sqrt(minimum / stiffest) / max(1.0, 2 * maximum),
        CROSSING_FRACTION * disks.radius.min() / (speed_most(scene, disks) + 1e-300),
    )
    wall_damping = 2 * ratio * math.sqrt(wall_k * most_met)
    for wall in scene.get("walls", []):  # each that gives, pressed by all who have room
        if "mass_kg" in wall:
            room = math.dist(wall["start_m"], wall["end_m"]) // (2 * float(disks.radius.min())) + 1
            count = min(len(disks.mass), room)
            pulls = wall.get("stiffness_N_per_m", 0.0) + count * stiffest
            damps = wall.get("damping_N_s_per_m", 0.0) + count * wall_damping + 1e-300
            fastest = min(math.sqrt(wall["mass_kg"] / pulls), wall["mass_kg"] / damps)
            safe = min(safe, STEP_FRACTION * fastest)
    between = run["duration_s"] / run["frames"]
    if run.get("time_step_s"):
        step, interval = run["time_step_s"], max(1, round(between / run["time_step_s"]))
    else:
        interval = math.ceil(between / safe)
        step = between / interval
    return Penalty(
        stiffness=k,
        wall_stiffness=wall_k,
        stiffest=stiffest,
        friction=friction,
        damping_ratio=ratio,
        tangential_stiffness=tangential * k,
        wall_tangential_stiffness=tangential * wall_k,
        restitution=(restitution_of(maximum) ** power, restitution_of(ratio) ** power),
        damping=2 * ratio * math.sqrt(k * most_met / 2),
        wall_damping=wall_damping,
        springs=springs,
        wall_springs=wall_springs,
        safe_time_step=safe,
        time_step=step,
        frame_interval=interval,
        steps=interval * run["frames"],
    )


def drive_force(drive, disks, position, velocity, time):
    """m(u_d - u)/tau (n,2) N: u_d points to the nearest point of the own door (or its centre), and
    outward beyond the door; to the next corner of the way where there is one; it is 0 from the time
    (s) of a stop on. Who keep their distance ask the core of the product."""
    if "distance" in drive:
        push = drive["distance"].wanted(position, disks.radius, time) - velocity
        return disks.mass[:, None] * push / drive["relaxation_time_s"]
    own = np.zeros(len(position), int)
    for number, goal in enumerate(drive.get("goals", []), start=1):
        first, last = goal["people"]
        own[(disks.ids >= first) & (disks.ids <= last)] = number
    wanted = np.empty_like(position)
    for number, door in enumerate([drive, *drive.get("goals", [])]):
        mine = own == number
        wanted[mine] = direction_to(door, drive.get("aim", "nearest"), position[mine])
    if "way" in drive:
        turning, corner = next_corner(drive["way"], position, own)
        to = (corner - position)[turning]
        wanted[turning] = to / np.hypot(*to.T)[:, None]
    for stop in drive.get("stops", []):
        (first, last), at = stop["people"], stop["time_s"]
        wanted[(disks.ids >= first) & (disks.ids <= last) & (time >= at - 1e-9)] = 0.0
    push = drive["speed_m_per_s"] * wanted - velocity
    return disks.mass[:, None] * push / drive["relaxation_time_s"]


class Distance:
    """What people want who keep their distance: of the product's own core, and of the numbers that
    `percussions run` writes beside this script."""

    def __init__(self, path):
        numbers = Path(__file__).with_name("drive.txt")
        if "NSCD_LIBRARY" not in os.environ or not numbers.exists():
            what = "people who keep their distance run by `percussions run` only"
            raise SceneFileError(f"{path}: drive.time_gap_s: {what}")
        self.core, row = ctypes.CDLL(os.environ["NSCD_LIBRARY"]), np.loadtxt(numbers)
        self.core.nscd_drive_new.restype = ctypes.c_void_p
        self.core.nscd_message.restype = ctypes.c_char_p
        count = ctypes.c_size_t(len(row))
        self.law = ctypes.c_void_p(self.core.nscd_drive_new(self._at(row), count))
        if not self.law:
            raise SceneFileError(f"{path}: drive.time_gap_s: {self.core.nscd_message().decode()}")

    @staticmethod
    def _at(values):
        return ctypes.c_void_p(values.ctypes.data)

    def wanted(self, position, radius, time):
        """Desired velocities (n,2) m/s of people at (n,2) m with radii (n,) m at a time (s)."""
        location, size = np.ascontiguousarray(position), np.ascontiguousarray(radius)
        count, now = ctypes.c_size_t(len(location)), ctypes.c_double(time)
        where = self._at(location), self._at(size), now, self._at(velocity := np.empty_like(location))
        if not self.core.nscd_drive_desired(self.law, count, *where):
            raise RuntimeError(self.core.nscd_message().decode())
        return velocity


def read_way(path, scene):
    """The grid of a way: of each door, row and column the number of the next corner, 0 for the
    door."""
    walls = [[*wall["start_m"], *wall["end_m"]] for wall in scene.get("walls", [])]
    try:
        way = json.loads(Path(path).read_text(encoding="utf-8"))
        runs = [np.array(one).reshape(-1, 2) for one in way["next"]]
        shape = len(runs), *way["rows_columns"]
        if way["walls_m"] != walls:
            raise ValueError("the walls are others, `percussions run` writes it again")
        way["next"] = np.concatenate([np.repeat(*one.T[::-1]) for one in runs]).reshape(shape)
    except (OSError, ValueError, KeyError) as error:
        raise SceneFileError(f"{path}: not the way of this scene: {error}") from None
    return way


def next_corner(way, position, door):
    """Who (n,) goes to a corner first, and where it is (n,2) m, of people at (n,2) m who go to the
    doors (n,)."""
    column, row = np.floor((position - way["origin_m"]) / way["cell_m"]).T
    rows, columns = way["rows_columns"]
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    column, row = (np.where(inside, each, 0).astype(int) for each in (column, row))
    found = np.where(inside, way["next"][door, row, column], 0)
    return found > 0, np.array(way["corners_m"])[found]


def direction_to(door, aim, position):
    """Unit vectors (n,2) to the door, and outward beyond it."""
    start, end = np.array(door["door_start_m"]), np.array(door["door_end_m"])
    outward = np.array(door["outward"])
    gone = (position - start) @ outward >= 0
    if aim == "centre":
        start = end = 0.5 * (start + end)
    along = end - start
    fraction = np.clip((position - start) @ along / max(along @ along, 1e-30), 0.0, 1.0)
    way = start + fraction[:, None] * along - position
    distance = np.hypot(*way.T)
    gone |= distance == 0
    return np.where(gone[:, None], outward, way / np.where(distance > 0, distance, 1.0)[:, None])
