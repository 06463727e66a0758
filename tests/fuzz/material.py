"""What works: crowds, rooms, scenes, finished runs and trajectories, each with its command."""

from __future__ import annotations

import gzip
import random as randomness
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from analysis import engines
from analysis.compare.comparison import compare_run, write_contacts
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from tests.crowds import disks_at
from tests.fuzz import known, strangers

ROOT = Path(__file__).resolve().parents[2]
ROOM = """title = "A room"
source = "none"

[[walls]]
name = "left"
start_m = [-3.0, 0.0]
end_m = [-0.5, 0.0]

[[walls]]
name = "right"
start_m = [0.5, 0.0]
end_m = [3.0, 0.0]

[drive]
speed_m_per_s = 1.0
relaxation_time_s = 0.5
door_start_m = [-0.5, 0.0]
door_end_m = [0.5, 0.0]
outward = [0.0, -1.0]

[contact]
stiffness_N_per_m = 1e6
restitution = 0.1

[run]
duration_s = 0.01
frames = 2

[analysis]
kind = "driven"
time_s = 0.01
"""
OF_RUN = ("run.json", "scene.toml", "scene.data", "bodies.dump")
PLACES = ("out", "out/deep/er", "some.dump", "/dev/null", "/dev/full", "/proc/none", "n" * 300)
OPTIONS = {
    "solve": {
        "--time-step": ("1e-3",), "--left-velocity": ("dump", "desired", "free"),
        "--window": ("0.1",), "--contact-tolerance": ("1e-6", "1e-3"), "--largest-overlap": ("0.1",),
        "--tolerance": ("1e-6",), "--openness": ("none", "ranges"), "--workers": ("1",),
        "--restitution": ("0.5", "1"), "--room": ("room.toml",), "--out": ("table.csv", *PLACES),
    },
    "run": {
        "--engine": ("lammps", "rigid"), "--stiffness": ("1e5",), "--restitution": ("0.5", "0"),
        "--law": ("hertz", "hooke"), "--time-step": ("1e-5",), "--duration": ("0.01",),
        "--out": PLACES,
    },
    "compare": {"--time": ("0", "0.01"), "--rigid-law": ("inelastic", "0.5", "scene")},
    "import": {
        "--frame": ("1", "3"), "--room": ("room.toml",), "--radius": ("0.2",), "--mass": ("60",),
        "--name": ("mine", "..", "a/b", "n" * 200), "--unit": ("m", "cm"), "--frame-rate": ("10",),
        "--window": ("0.2",), "--out": PLACES,
    },
    "film": {
        "--frames": ("1:3", "2", "0:9", "::2"), "--room": ("room.toml",), "--radius": ("0.2",),
        "--mass": ("60",), "--unit": ("m", "cm"), "--frame-rate": ("10",),
        "--export": ("vtk", "ovito"), "--out": PLACES,
    },
    "new": {
        "--room": ("6x4", "3x3", "60x0.5"), "--door": ("0.8", "0,1,0,2", "0,-1,0,0:3"),
        "--people": ("5", "80"), "--geometry": ("floor.wkt",), "--stream": ("",),
        "--block": ("-3,-1,-2,1",), "--barrier": ("-3,-1,-3,1",), "--radius": ("0.15",),
        "--people-from": ("ANSUR II", "ANSUR II, women"), "--radius-spread": ("0", "0.3"),
        "--mass": ("60",), "--push": ("80",), "--speed": ("1.5",), "--duration": ("2",),
        "--seed": ("3",), "--out": PLACES,
    },
    "push": {"--wall": ("1.2", "0.1"), "--arms": ("0", "1"), "--out": PLACES},
    "export": {
        "--fclib": ("other.hdf5", *PLACES), "--frame": ("0", "-1", "7"), "--local": ("",),
        "--room": ("room.toml",), "--left-velocity": ("dump", "desired"), "--friction": ("0.3",),
        "--wall-friction": ("0.2",), "--window": ("0.1",), "--time-step": ("1e-3",),
        "--contact-tolerance": ("1e-3",), "--largest-overlap": ("0.1",),
        "--openness": ("none", "ranges"), "--tolerance": ("1e-6",),
    },
    "scenes": {
        "--make": ("arch", "pair", "jam"), "--disks": ("12",), "--seed": ("2",), "--out": PLACES,
    },
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Material:
    """A command that works.

    kind: what the law checks
    files: name → content, in the folder where it runs
    words: of the command line
    target: the file that is to be damaged
    reference: what comes out of the undamaged files
    right: of known people: file, column and rows of numbers, and these; None: none may come out
    """

    kind: str
    files: dict[str, bytes]
    words: tuple[str, ...]
    target: str
    reference: dict[str, bytes] = field(default_factory=dict)
    right: tuple | None = None


def crowd(random):
    """Two to nine disks, some touching, some not, with some velocity."""
    n = random.randrange(2, 10)
    numbers = np.random.default_rng(random.randrange(2**32))
    radius = numbers.choice([0.2, 0.25], n)
    x = np.cumsum(radius) + np.concatenate([[0], np.cumsum(radius)[:-1]])
    x += np.cumsum(numbers.choice([0.0, 0.0, 0.3, -0.001], n))
    position, velocity = np.column_stack([x - x.mean(), radius]), numbers.normal(0, 1, (n, 2))
    mass, ids = numbers.integers(50, 100, n).astype(float), numbers.permutation(n) + 1
    return disks_at(position, velocity.round(3), radius, mass, ids=ids)


def dump_of(random, disks):
    """The text of a dump of one to three frames, in one of the forms that LAMMPS writes."""
    position = random.choice(("x y", "x y", "xu yu", "xs ys", "x y z"))
    size = random.choice(("radius", "radius", "diameter"))
    columns = f"id type {position} {size} mass vx vy".split()
    if random.random() < 0.3:
        columns.append("omegaz")
    lines = []
    for number in range(random.choice((1, 2, 3))):
        keep = range(len(disks)) if random.random() < 0.8 else range(max(1, len(disks) - number))
        lines += ["ITEM: TIMESTEP", str(100 * number), "ITEM: NUMBER OF ATOMS", str(len(keep))]
        lines += ["ITEM: BOX BOUNDS ff ff pp", "-10 10", "-10 10", "-0.5 0.5"]
        lines.append("ITEM: ATOMS " + " ".join(columns))
        for i in keep:
            (x, y), (vx, vy) = disks.position[i].tolist(), disks.velocity[i].tolist()
            values = {
                "id": int(disks.ids[i]), "type": 1, "x": x, "y": y, "z": 0.0, "xu": x, "yu": y,
                "xs": (x + 10) / 20, "ys": (y + 10) / 20, "radius": float(disks.radius[i]),
                "diameter": float(2 * disks.radius[i]), "mass": float(disks.mass[i]), "vx": vx,
                "vy": vy, "omegaz": 0.0,
            }  # fmt: skip
            lines.append(" ".join(repr(values[name]) for name in columns))
    return ("\n".join(lines) + "\n").encode()


class Workshop:
    """Makes the materials; the runs of an engine, and tables and problems made of others, once."""

    def __init__(self, folder: Path, dear: bool = False) -> None:
        """dear: whether there are films and pushed rows too, a second each."""
        self.runs = {}
        self.trajectories, self.floors = strangers.trajectories(), strangers.floors()
        self.dear = ("film", "push", "film_runs") if dear else ()
        files = {"some.dump": dump_of(randomness.Random(3), crowd(randomness.Random(7)))}
        export = ("export", "some.dump", "--contact-tolerance", "0.01", "--fclib", "some.hdf5")
        self.problem = strangers.made_by(export, files, "some.hdf5")
        if engines.engine("lammps").find() is None:
            return
        pair = make("pair").with_contact(restitution=0.5)
        pair = pair.with_run(duration_s=0.02, frames=60, time_step_s=None, impulses=True)
        jam = make("jam", 12).with_run(duration_s=0.2, frames=2)
        for scene in (pair, jam):
            simulate(scene, "lammps", folder / scene.name)
            write_contacts(folder / scene.name / "comparison.csv", compare_run(folder / scene.name))
            self.runs[scene.name] = {
                path.name: path.read_bytes() for path in (folder / scene.name).iterdir()
            }

    @property
    def kinds(self):
        """The kinds of material, those with an engine only where it is there, often the first."""
        with_engine = ("run", "compare", "compare") if self.runs else ()
        dear = self.dear if self.runs else self.dear[:1]
        found = ("dump", "dump", "dump", "room", "import", "import", "new", "export", "problem",
                 "known", "known", "known", "known")  # fmt: skip
        return (*found, *found, *with_engine, *dear)

    def make(self, random):
        """A material of some kind."""
        return getattr(self, f"_{random.choice(self.kinds)}")(random)

    def _known(self, random):
        kind = random.choice([one for one in known.KINDS if self.runs or one != "links"])
        run = (random.choice((*self.runs.values(),)),) if kind == "links" else ()
        files, words, right = known.KINDS[kind](random, *run)
        return Material(kind="known", files=files, words=words, target="", right=right)

    def _dump(self, random):
        content = dump_of(random, crowd(random))
        name = "some.dump"
        if random.random() < 0.05:
            name, content = "some.dump.gz", gzip.compress(content)
        words = ["solve", name, "--left-velocity", "dump", "--out", "table.csv"]
        if random.random() < 0.3:
            words += ["--time-step", "1e-3"]
        return Material(kind="solve", files={name: content}, words=tuple(words), target=name)

    def _room(self, random):
        files = {"some.dump": dump_of(random, crowd(random)), "room.toml": ROOM.encode()}
        words = ("solve", "some.dump", "--room", "room.toml", "--out", "table.csv")
        target = random.choice(("room.toml", "room.toml", "some.dump"))
        return Material(kind="solve", files=files, words=words, target=target)

    def _run(self, random):
        name = random.choice(("pair", "jam"))
        scene = self.runs[name]
        files = {"mine.toml": scene["scene.toml"], "scene.data": scene["scene.data"]}
        target = random.choice(tuple(files))
        return Material(kind="run", files=files, words=("run", "mine.toml"), target=target)

    def _compare(self, random):
        return self._of_run(random, "compare", ("compare", "run"))

    def _of_run(self, random, kind, words):
        """A command on the folder of a run."""
        files = self.runs[random.choice(tuple(self.runs))]
        arguments = {f"run/{name}": files[name] for name in (*OF_RUN, "contacts.dump")}
        target = random.choice(tuple(arguments))
        return Material(kind=kind, files=arguments, words=words, target=target, reference=files)

    def _import(self, random):
        name = random.choice(tuple(strangers.STATED))
        free = (ROOT / "tests/data/rooms/free.toml").read_bytes()
        files = {name: self.trajectories[name], "room.toml": free}
        inputs = strangers.STATED[name]
        words = ("import", name, "--frame", "2", "--room", "room.toml", "--out", "out", *inputs)
        target = random.choice((name, name, name, "room.toml"))
        return Material(kind="import", files=files, words=words, target=target)

    def _film(self, random):
        name = random.choice(tuple(strangers.STATED))
        drive = ROOM[: ROOM.index("[[walls]]")] + ROOM[ROOM.index("[drive]") :]
        files = {name: self.trajectories[name], "room.toml": drive.encode()}
        frames = ("--frames", "2:3", "--radius", "0.2", "--room", "room.toml", "--out", "out")
        words = ("film", name, *frames, *strangers.STATED[name])
        return Material(kind="film", files=files, words=words, target=random.choice(tuple(files)))

    def _film_runs(self, random):
        return self._of_run(random, "film", ("film", "run", "--frames", "0:1", "--out", "out"))

    def _new(self, random):
        name = random.choice(("", *self.floors))
        if not name:
            rooms = ("--room", "6x4", "--door", "0.8"), ("--room", "9x3", "--stream")
            room = random.choice(rooms)
            words = ("new", "mine", *room, "--people", "12", "--out", "out")
            return Material(kind="new", files={}, words=words, target="")
        content, doors = self.floors[name]
        words = ("new", "mine", "--geometry", name, *doors, "--people", "12", "--out", "out")
        return Material(kind="new", files={name: content}, words=words, target=name)

    def _push(self, random):
        files = {"row.csv": strangers.pushed_row(random)}
        words = ("push", "row.csv", "--arms", "0.5", "--out", "out")
        return Material(kind="push", files=files, words=words, target="row.csv")

    def _export(self, random):
        if random.random() < 0.4 and self.runs:
            run = self.runs[random.choice(tuple(self.runs))]
            files, what = {f"run/{name}": run[name] for name in OF_RUN}, "run"
        else:
            files = {"some.dump": dump_of(random, crowd(random)), "room.toml": ROOM.encode()}
            what = "some.dump"
        words = ["export", what, "--fclib", "out.hdf5"]
        if what == "some.dump" and random.random() < 0.5:
            words += ["--room", "room.toml"]
        target = random.choice([name for name in files if name != "room.toml" or "--room" in words])
        return Material(kind="export", files=files, words=tuple(words), target=target)

    def _problem(self, random):
        words = ("solve", "some.hdf5", "--out", "table.csv")
        files = {"some.hdf5": self.problem}
        return Material(kind="problem", files=files, words=words, target="some.hdf5")
