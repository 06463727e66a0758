"""People whose forces are known, in files that say the same in other ways, or say something else.

They stand one behind the other before a wall and press on it, and creep along it at a known speed; so
force k from behind is that of the k masses behind it times v/τ."""

# fmt: off
import copy
import io
import json
import math
import re
import tempfile
import tomllib
from pathlib import Path

import tomli_w

from tests.walkers import archive, base_of

ROOT = Path(__file__).resolve().parents[2]

RATE, SPEED, CREEP, TAU, RADIUS, MASS = 10.0, 1.0, 0.4, 0.5, 0.2, 75.0
CORNERS = [(0.0, -4.0), (0.0, 4.0), (-9.0, 4.0), (-9.0, -4.0)]
ROOM = tomli_w.dumps({
    "title": "a room", "source": "own",
    "walls": [{"name": f"wall_{k}", "start_m": list(CORNERS[k]), "end_m": list(CORNERS[(k + 1) % 4])}
              for k in range(4)],
    "drive": {"speed_m_per_s": SPEED, "relaxation_time_s": TAU, "outward": [1.0, 0.0]},
    "contact": {"stiffness_N_per_m": 1e6, "restitution": 0.1},
    "run": {"duration_s": 0.1, "frames": 2}, "analysis": {"kind": "driven"},
}).encode()  # fmt: skip
SPELLED = {"id": ("id", "ID", "ped", "PersID", "pedestrian_id", "Agent ID", "track_id"),
           "frame": ("frame", "FR", "Frame", "frame_no"), "time": ("time", "t", "timestamp"),
           "x": ("x", "X", "pos_x", "posX"), "y": ("y", "Y", "pos_y", "posY")}  # fmt: skip
SCALE = {"m": 1.0, "cm": 100.0, "mm": 1000.0}


def _rows(random):
    """How many people, and id, number of instant, time, x, y of each row."""
    n, ids = random.choice((2, 3, 4)), random.sample(range(1, 90), 4)
    frames = range(0, 8 * (step := random.choice((1, 1, 2))), step)
    rows = [(ids[k], f, f / RATE, -RADIUS - 0.37 * k, 0.1 + CREEP * f / RATE) for k in range(n) for f in frames]
    return n, random.choice((rows, sorted(rows, key=lambda row: row[1]), random.sample(rows, len(rows))))


def _text(random, rows, name, broken):
    """A table of text, or csv, in some spelling."""
    unit, timed = random.choice(tuple(SCALE)), random.random() < 0.4
    message, when = (random.choice(("name", "option" if unit != "mm" else "name")), "time" if timed else "frame")
    sep = random.choice((",", ";", "\t") if name.endswith("csv") else (" ", "\t", ";", "  "))
    stated = "m" if broken == "unit" and unit == "cm" else "cm" if broken == "unit" else unit
    if broken == "unit":
        unit, message = ("m", "option") if stated == "cm" else ("cm", "option")
    form = random.choice(("{}/{}", "{}[{}]", "{}_{}", "{}({})")) if message == "name" else "{}"
    ms, start = timed and random.random() < 0.3, random.choice((0, 1, 37))
    names = {role: random.choice(SPELLED[role]).replace(" ", "_" if " " in sep else " ") for role in ("id", when, "x", "y")}
    names |= {axis: form.format(names[axis], unit) for axis in "xy"}
    order = random.sample((*names, "angle"), 5)
    comma = sep == ";" and random.random() < 0.3
    lines = []
    for who, f, t, x, y in rows:
        cell = {"id": f"{who}", "frame": f"{f + start}", "time": f"{1000 * t:.0f}" if ms else f"{t + start:.2f}",
                "x": f"{x * SCALE[unit]:.6g}", "y": f"{y * SCALE[unit]:.6g}", "angle": "7.5"}  # fmt: skip
        lines.append(sep.join(cell[one].replace(".", "," if comma else ".") for one in order))
    if broken == "place":
        cells = lines[1].split(sep)
        cells[order.index("x")] = f"{-5 * SCALE[unit]:.1f}".replace(".", "," if comma else ".")
        lines.append(sep.join(cells))
    if broken == "cell":
        lines[2] = lines[2].rpartition(sep)[0]
    again = [lines[0]] if random.random() < 0.1 else []
    head = "" if name.endswith("csv") else random.choice(("", "# "))
    words = ["--unit", stated] if message == "option" else []
    words += ["--time-unit", "ms"] if ms else [] if timed else ["--frame-rate", "10"]
    text = [head + sep.join({**names, "angle": "angle"}[one] for one in order), *lines, *again]
    return random.choice(("\n", "\n", "\r\n")).join((*text, "")).encode(), words


def _programs(random, rows, name):
    """The table of a program, and what is to be said of it."""
    start = random.choice((0, 5))
    if name == "a.xml":
        made = {f"{t:.2f}": "".join(f'<person id="p{r[0]}" x="{r[3]:.3f}" y="{r[4]:.3f}" speed="1"/>' for r in rows if r[2] == t)
                for t in sorted({row[2] for row in rows})}  # fmt: skip
        steps = "".join(f'<timestep time="{t}">{people}</timestep>\n' for t, people in made.items())
        return f'<?xml version="1.0"?>\n<fcd-export>\n{steps}</fcd-export>\n'.encode(), []
    if name == "a.json":
        made = {str(who): {} for who, *_ in rows}
        for who, _, t, x, y in rows:
            made[str(who)][str(t)] = {"position": {"x": x, "y": y, "z": 0.0}}
        return json.dumps(made).encode(), []
    full = [(who, f + start, x, y) for who, f, _, x, y in rows]
    if name == "a.sqlite":
        with tempfile.TemporaryDirectory() as folder:
            return base_of(Path(folder) / "one", full).read_bytes(), []
    if name == "a.h5":
        return archive(io.BytesIO(), full).getvalue(), []
    head, row = {
        "obsmat.txt": ("", "{f:.7e} {i:.7e} {x:.7e} 0 {y:.7e} 0 0 0.4"),
        "a.traj": ("pedestrianId simTime endTime-PID1 startX-PID1 startY-PID1 endX-PID1 endY-PID1\n",
                   "{i} {t} {e} {x:.4f} {y:.4f} {x:.4f} {z:.4f}"),
        "a.fzp": ("$VISION\n* comment\n$PEDESTRIAN:NO;SIMSEC;COORDCENTX;COORDCENTY\n", "{i};{t};{x:.4f};{y:.4f}"),
        "crowdit.csv": ("pedID,time,posX,posY\n", "{i},{t},{x:.4f},{y:.4f}"),
        "pathfinder.csv": ("id,t,x,y\n", "{i},{t},{x:.4f},{y:.4f}"),
    }[name]  # fmt: skip
    difference = sorted({f for _, f, *_ in rows})[1] / RATE
    made = [row.format(i=i, f=f + start, t=round(t, 3), e=round(t + difference, 3), x=x, y=y, z=y + CREEP * difference)
            for i, f, t, x, y in rows]  # fmt: skip
    return (head + "\n".join(made) + "\n").encode(), ["--frame-rate", "10"] if name == "a.traj" else []


TEXTS = ("a.txt", "a.csv")
PROGRAMS = ("a.xml", "a.json", "a.sqlite", "a.h5", "obsmat.txt", "a.traj", "a.fzp", "crowdit.csv", "pathfinder.csv")


def trajectory(random):
    """Files, words, and the right values: of which file, column and rows; None: must be refused."""
    n, rows = _rows(random)
    name, broken = random.choice((*TEXTS * 3, *PROGRAMS)), ""
    if name in TEXTS:
        broken = random.choice(("", "", "", "unit", "place", "cell"))
        content, words = _text(random, rows, name, broken)
    else:
        content, words = _programs(random, rows, name)
    words = [name, "--room", "room.toml", "--radius", str(RADIUS), "--mass", str(MASS), "--out", "out", *words]
    load = [n * MASS * SPEED / TAU]
    verb, right = random.choice((
        ("exposure", ("out/exposure_walls.csv", "load_N", {"wall": "wall_0"}, load)),
        ("film", ("out/film.csv", "walls_N", {}, load)),
        ("compare", (f"out/{Path(name).stem}_frames.csv", "second_walls_N", {}, load)),
    ))  # fmt: skip
    if verb == "compare":
        words = [name, *words]
    return {name: content, "room.toml": ROOM}, (verb, *words), None if broken else right


def pressed(random):
    """The columns of disks before the wall: id, x, y, radius, mass; and the force of each contact."""
    n, r = random.randrange(2, 6), [round(random.uniform(0.2, 0.25), 4) for _ in range(5)]
    ids, mass = random.sample(range(1, 200), n), [random.randrange(50, 100) for _ in range(n)]
    index = [-2 * sum(r[:k]) - r[k] for k in range(n)]
    y = round(random.uniform(-1, 1), 3)
    force = [SPEED / TAU * sum(mass[k:]) for k in range(n)]
    return [(ids[k], index[k], y, r[k], mass[k]) for k in range(n)], force


def frames(kind, columns, tables, box="-20 20", periodic="ff", head=""):
    """The text of a dump of ATOMS or ENTRIES."""
    text = [
        f"{head}ITEM: TIMESTEP\n{100 * k}\nITEM: NUMBER OF {'ATOMS' if kind == 'ATOMS' else 'ENTRIES'}\n{len(rows)}\n"
        f"ITEM: BOX BOUNDS {periodic} ff pp\n{box}\n{box}\n-0.5 0.5\nITEM: {kind} {columns}\n"
        + "".join(" ".join(row) + "\n" for row in rows)
        for k, rows in enumerate(tables)
    ]  # fmt: skip
    return "".join(text).encode()


def dump(random):
    """As `trajectory`, of a dump of LAMMPS."""
    disks, force = pressed(random)
    unit, digits = random.choice(("m", "m", "cm", "mm")), random.choice((5, 6, 6, 7, 9, 12, 17))
    per, position = SCALE[unit], random.choice(("x y", "xu yu", "xs ys", "xsu ysu", "x y z"))
    size, weight = random.choice(("radius", "diameter")), random.choice(("mass", "mass", "density"))
    more = random.sample(("type", "mol", "c_stress[1]"), random.randrange(4))
    columns = random.sample(["id", *position.split(), size, weight, *more], 4 + len(position.split()) - 1 + len(more))

    def row(k, disk):
        who, x, y, r, mass = disk
        values = {"radius": per * r, "diameter": 2 * per * r, "mass": mass, "z": 0.0, "c_stress[1]": 1.5,
                  "density": mass / (math.pi / 6 * (2 * r) ** 3)}  # fmt: skip
        for axis, value in zip("xy", (x, y), strict=True):
            fraction = (value + 20) / 40
            values |= {axis: per * value, f"{axis}u": per * value, f"{axis}s": fraction, f"{axis}su": fraction}
        full = {"id": str(who), "type": "1", "mol": str(k + 1)}
        return [full.get(one) or f"{values[one]:.{digits}g}" for one in columns]

    rows = [row(k, disk) for k, disk in enumerate(disks)]
    tables = [random.sample(rows, len(rows)) for _ in range(random.choice((1, 1, 2)))]
    content = frames("ATOMS", " ".join(columns), tables, box=f"{-20 * per:g} {20 * per:g}")
    words = ["solve", "a.dump", "--room", "room.toml", "--left-velocity", "desired", "--out", "out.csv"]
    words += ["--unit", unit] if unit != "m" else []
    words += ["--mass-unit", "kg"] if weight == "density" and unit == "cm" else []
    right = ("out.csv", "force_N", {}, sorted(force * len(tables)))
    if random.random() < 0.2:  # broken
        which, right = random.choice(("twice", "unit", "cell")), None
        lines = content.split(b"\n")
        if which == "twice":
            lines[9] = lines[10]
        elif which == "unit":
            words = [one for one in words if one not in ("--unit", unit)]
            words += ["--unit", "ft"] if unit == "m" else []
        else:
            lines[9] = lines[9].rpartition(b" ")[0]
        content = b"\n".join(lines)
    return {"a.dump": content, "room.toml": ROOM}, tuple(words), right


def contacts(random):
    """As `trajectory`, of a dump with contacts of its own."""
    disks, force = pressed(random)
    bodies = [[str(i), repr(x), repr(y), repr(r), repr(m)] for i, x, y, r, m in disks]
    rows = []
    for k, f in enumerate(force):  # each pushes the one before, and the first the wall
        who, other = disks[k][0], disks[k - 1][0] if k else 1
        low, high, way = (who, other, 1) if not k or who < other else (other, who, -1)
        rows.append([low, high, int(not k), way, 0, 0.0, way * f, 0])
    columns, words = "first second is_wall nx ny overlap fx fy", []
    pairs = random.random() < 0.4  # as LAMMPS' dump local: the force on the first
    if pairs:
        turned = [
            (low, high, -fx) if random.random() < 0.5 else (high, low, fx)
            for low, high, wall, _, _, _, fx, _ in rows
            if not wall
        ]
        rows, columns = [[a, b, fx, 0] for a, b, fx in turned], "c_ids[1] c_ids[2] c_p[1] c_p[2]"
        words = ["--contacts-columns", "first=c_ids[1] second=c_ids[2] fx=c_p[1] fy=c_p[2]"]
    elif random.random() < 0.3:
        columns = columns.replace("fx", "c_f[1]")
        words = ["--contacts-columns", "fx=c_f[1]"]
    broken = random.choice(("", "", "turned", "apart", "unknown", "twice", "sign"))
    number = random.randrange(len(rows))
    fx = 2 if pairs else 6
    if broken == "turned" and len(rows) > 1 + pairs:
        rows[number][fx] *= -1
    elif broken == "apart" and len(disks) > 2:
        rows[number][:2] = sorted((disks[0][0], disks[-1][0]))
        rows[number][2] = 0 if not pairs else rows[number][2]
    elif broken == "unknown":
        rows[number][1] = 999
    elif broken == "twice":
        rows.append(rows[number])
    elif broken == "sign" and not pairs:
        rows = [[*row[:6], -row[6], row[7]] for row in rows]
    else:
        broken = ""
    random.shuffle(rows)
    files = {"a.dump": frames("ATOMS", "id x y radius mass", [bodies] * 2), "room.toml": ROOM,
             "own.dump": frames("ENTRIES", columns, [[[*map(str, row)] for row in rows]] * 2)}  # fmt: skip
    words = ["compare", "a.dump", "--contacts", "own.dump", "--room", "room.toml", "--time-step", "1e-4", "--out", "out", *words]
    found = force[1:] if pairs else force
    right = ("out/a_own_frame_contacts.csv", "first_run_x_N", {"in_first_run": "1"}, sorted(found * 2))
    return files, tuple(words), None if broken else right


NUMBER = re.compile(rb"(?<![\w.])-?\d+(\.\d+)?(e[+-]?\d+)?(?![\w.])")
ROOM_KEYS = tomllib.loads((ROOT / "tests/data/room_keys.toml").read_text())
EXTREMES = (0, -1, 1e-9, 1e-3, 1e3, 1e9, 1e30, 1e300, 1e-300, True, "", [], [0.0, 0.0], [1e6, 1e6], [1.0, -1.0])


def _other(random, content, position=None):
    """One number of a text is another."""
    found = random.choice(position or [*NUMBER.finditer(content)])
    value = float(found[0])
    new = random.choice((value * 1.5, value + 1, -value, value * 1.001, 0.0))
    word = f"{new:.0f}" if found[0].lstrip(b"-").isdigit() else repr(new)
    return content[: found.start()] + word.encode() + content[found.end() :]


def bodies(random):
    """The scene of people with shoulders, a number of its bodies another."""
    files = {f"shoulders.{end}": (ROOT / f"scenes/shoulders.{end}").read_bytes() for end in ("toml", "data", "bodies")}
    damaged = files | {"shoulders.bodies": _other(random, files["shoulders.bodies"])}
    return damaged, ("export", "shoulders.toml", "--fclib", "out.hdf5"), (files, "out.hdf5")


def links(random, run):
    """A folder of a run in which a number that stands twice is another in one of the places."""
    files = {f"run/{name}": run[name] for name in ("run.json", "scene.toml", "scene.data", "bodies.dump", "contacts.dump")}
    words, out = random.choice((
        (("solve", "run/bodies.dump", "--out", "out.csv"), "out.csv"),
        (("film", "run", "--frames", "0:1", "--out", "out"), "out/film.csv"),
        (("exposure", "run", "--out", "out"), "out/exposure_people.csv"),
        (("export", "run", "--fclib", "out.hdf5"), "out.hdf5"),
    ))  # fmt: skip
    name = random.choice(tuple(files))
    content, position = files[name], None
    if name == "run/bodies.dump":  # what else it has, nobody else says
        columns = content.split(b"ITEM: ATOMS ")[1].split(b"\n")[0].split()
        skipped = columns.index(random.choice((b"radius", b"mass")))
        row = rb"(?m)^\d+ (?:\S+ ){%d}(?=\S)" % (skipped - 1)
        ends = [one.end() for one in re.finditer(row, content)]
        position = [re.compile(rb"\S+").match(content, end) for end in ends]
    return files | {name: _other(random, content, position)}, words, (files, out)


def rooms(random):
    """A room with an extreme value of a key of the schema."""
    files, words, _ = dump(random)
    room, row = copy.deepcopy(ROOM_KEYS["room"]), random.choice(ROOM_KEYS["row"])
    for path, value in (*row.get("beside", {}).items(), (row["key"], random.choice(EXTREMES))):
        table, (*way, last) = room, path.split(".")
        for part in way:
            table = table[int(part)] if part.isdigit() else table.setdefault(part, {})
            table = table[0] if isinstance(table, list) and not way[-1].isdigit() and table else table
        if isinstance(table, dict):
            table[last] = value
    return files | {"room.toml": tomli_w.dumps(room).encode()}, words, ({}, "out.csv")


KINDS = {"trajectory": trajectory, "lammps": dump, "contacts": contacts, "bodies": bodies, "links": links, "rooms": rooms}
