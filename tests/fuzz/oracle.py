"""What may come out of damaged files: readers and checks that share no code with the product."""

from __future__ import annotations

import bz2
import csv
import gzip
import io
import itertools
import json
import math
import re
import tempfile
from functools import lru_cache
from pathlib import Path

import h5py
import numpy as np
from scipy.sparse import csc_array

from tests.forked import as_program, in_fork

PLAIN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Cells that may be empty: what no program proves, and what has no bound.
MAY_BE_EMPTY = {"determined", "lower_Ns", "upper_Ns", "wall", "velocity_error_m_per_s"}
# Answers without a meaning, such as correlations of two numbers and the stiffness of the rigid
# engine, and bounds that do not exist.
MAY_BE_NULL = re.compile(
    r"correlation|stiffness|relative_difference|closure_error|unbalanced|reason|stopped|resumed"
)


class FaultError(AssertionError):
    """The law does not hold."""


def need(good, what):
    if not good:
        raise FaultError(what)


def number(word, what):
    need(PLAIN.fullmatch(word), f"{what}: {word[:40]!r} was taken for a number")
    value = float(word)
    need(math.isfinite(value), f"{what}: {word[:40]!r} is not finite")
    return value


def unpacked(content):
    for head, unpack in ((b"\x1f\x8b", gzip.decompress), (b"BZh", bz2.decompress)):
        if content.startswith(head):
            try:
                return unpack(content)
            except (EOFError, OSError) as error:
                raise FaultError(f"a damaged archive was taken: {error}") from None
    return content


def frames_of(content):
    """Columns and rows, by name, of every frame of a body dump: strictly, one word after the
    other."""
    try:
        text = unpacked(content).decode("ascii")
    except UnicodeDecodeError:
        raise FaultError("a dump that is not ASCII was taken") from None
    lines = iter(text.removesuffix("\n").split("\n"))
    frames = []
    for line in lines:
        need(line.split() == ["ITEM:", "TIMESTEP"], f"a frame began with {line[:40]!r}")
        step, box, count = next(lines).strip(), [], None
        need(step.isdigit(), f"step {step!r}")
        for line in lines:
            words = line.split()
            if words[:2] == ["ITEM:", "NUMBER"]:
                count = next(lines).strip()
                need(count.isdigit(), f"count {count!r}")
            elif words[:2] == ["ITEM:", "BOX"]:
                need("p" not in "".join(words[3:5]), "a periodic box was taken")
                bounds = [next(lines).split() for _ in range(3)]
                need(all(len(pair) == 2 for pair in bounds), "a box of other than two numbers")
                box = [[number(word, "box") for word in pair] for pair in bounds[:2]]
            elif words[:2] == ["ITEM:", "ATOMS"]:
                columns = words[2:]
                break
            else:
                need(words[:1] == ["ITEM:"] and len(words) == 2, f"a head with {line[:40]!r}")
                next(lines)
        need(len(set(columns)) == len(columns), "a column that occurs twice was taken")
        rows = [line.split() for line in itertools.islice(lines, int(count))]
        need(len(rows) == int(count), "fewer rows than counted")
        need(all(len(row) == len(columns) for row in rows), "a ragged row was taken")
        table = np.array([[number(word, "row") for word in row] for row in rows])
        data = dict(zip(columns, table.reshape(len(rows), len(columns)).T, strict=True))
        ids = data["id"]
        need((ids == np.floor(ids)).all() and len(set(ids)) == len(ids), "ids that are none")
        for axis, (low, high) in zip("xy", box, strict=True):
            if axis not in data and f"{axis}u" in data:
                data[axis] = data[f"{axis}u"]
            elif axis not in data:
                data[axis] = low + data[f"{axis}s"] * (high - low)
        data.setdefault("radius", data.get("diameter", np.zeros(0)) / 2)
        frames.append((int(step), data))
    need(len({step for step, _ in frames}) == len(frames), "a step that occurs twice was taken")
    return frames


def table_of(content):
    """The rows of a CSV file, all of whose cells say something."""
    rows = list(csv.DictReader(io.StringIO(content.decode("utf-8"))))
    need(rows, "a table without rows")
    for row in rows:
        for name, cell in row.items():
            need(name is not None and cell is not None, "a ragged table")
            if name == "status":
                need(cell == "solved", f"status {cell} in a table of exit status 0")
            elif name != "wall" and not (cell == "" and name in MAY_BE_EMPTY):
                number(cell, f"column {name}")
    return rows


@lru_cache(maxsize=64)
def _reference(words, files, name):
    with tempfile.TemporaryDirectory() as folder:
        for path, content in files:
            (Path(folder) / path).parent.mkdir(exist_ok=True)
            (Path(folder) / path).write_bytes(content)
        status, _, _ = in_fork(lambda: as_program(words, folder), 600.0)
        return None if status else numbers_in(Path(folder) / name)


def numbers_in(path):
    """All numbers of a table or of a contact problem."""
    if path.suffix == ".hdf5":
        with h5py.File(path) as file:
            problem = _problem(file)
            return np.concatenate([np.ravel(part) for part in (*problem, file["solution/r"][:])])
    cells = (cell for row in csv.reader(path.read_text("utf-8").splitlines()) for cell in row)
    return np.array([float(cell) for cell in cells if PLAIN.fullmatch(cell)])


def check_same(here, words, right):
    """What comes out of files of which one number was changed is what came out before."""
    files, name = right
    found = numbers_in(here / name)
    need(np.isfinite(found).all(), f"{name}: a number that is not finite")
    if files:
        known = _reference(words, tuple(files.items()), name)
        need(known is not None, "the undamaged files are refused")
        same = len(known) == len(found) and np.allclose(known, found, rtol=1e-3, atol=1e-6)
        need(same, f"{name}: other numbers from contradicting files")


def check_known(here, right, message):
    """The numbers of people whose forces are known, whatever their files look like."""
    need(right is not None or "pull each other" in message, "what cannot be so was taken")
    if right is None:
        return
    file, column, where, values = right
    rows = list(csv.DictReader(io.StringIO((here / file).read_text("utf-8"))))
    found = sorted(
        abs(float(row[column])) for row in rows if all(row[a] == b for a, b in where.items())
    )
    need(len(found) % len(values) == 0 and found, f"{len(found)} numbers where {values} are right")
    expected = sorted(values * (len(found) // len(values)))
    need(
        np.allclose(found, expected, rtol=1e-4),
        f"{column}: {found[:6]} where {expected[:6]} are right",
    )


def check_solution(content, table, tolerance=1e-8, reach=1e-6, rounding=0.0, impact=True):
    """The table has the contacts of every frame, and percussions after which nothing approaches.

    content: of the dump; reach: m, the largest gap of a contact, and of what may be
    one where text has few digits, `rounding`; impact: whether the velocities of
    the dump are those before it"""
    rows = table_of(table)
    key = "step" if "step" in rows[0] else "time_s"
    when = sorted({float(row[key]) for row in rows})
    frames = frames_of(content)
    if key == "step":
        need(set(when) <= {float(step) for step, _ in frames}, "a step that the dump has not")
    positions = {step: [row for row in rows if float(row[key]) == step] for step in when}
    with_contacts = 0
    for step, data in frames:
        in_contact = _in_contact(data, max(reach, rounding))
        if not in_contact or (rounding and min(in_contact.values()) > reach):
            continue
        with_contacts += 1
        if key == "time_s":
            need(with_contacts <= len(when), "a frame is missing in the table")
            step = when[with_contacts - 1]
        mine = [row for row in positions.get(step, []) if row["is_wall"] == "0"]
        found = {(int(row["first"]), int(row["second"])) for row in mine}
        need(len(found) == len(mine), "a contact is listed twice")
        sure = {pair for pair, gap in in_contact.items() if gap < reach - 1e-9 * (1 + reach)}
        need(sure <= found, f"contacts are missing: {sorted(sure - found)[:3]}")
        need(found <= set(in_contact), f"contacts that are none: {sorted(found - set(in_contact))[:3]}")
        if impact:
            _check_impact(data, mine, tolerance)


def _in_contact(data, reach):
    """Gap (m) of each pair of ids that touch, or might."""
    in_contact = {}
    n = len(data["id"])
    size = 1e-9 * (1 + reach) + 4e-16 * max(np.abs([data["x"], data["y"]]).max(initial=0), 1)
    for i in range(n):
        for j in range(i + 1, n):
            distance = math.hypot(data["x"][j] - data["x"][i], data["y"][j] - data["y"][i])
            gap = distance - data["radius"][i] - data["radius"][j]
            if gap <= reach + size:
                pair = sorted((int(data["id"][i]), int(data["id"][j])))
                in_contact[tuple(pair)] = gap
    return in_contact


def _check_impact(data, rows, tolerance):
    """Inelastic: what touches does not approach afterwards, and is pushed only where it closes."""
    index = {int(name): row for row, name in enumerate(data["id"])}
    velocity = np.column_stack([data["vx"], data["vy"]])
    size = max(np.abs(velocity).max(), 1e-300)
    if "mass" not in data:
        return
    for row in rows:
        p = np.array([float(row["impulse_x_Ns"]), float(row["impulse_y_Ns"])])
        i, j = index[int(row["first"])], index[int(row["second"])]
        velocity[i] -= p / data["mass"][i]
        velocity[j] += p / data["mass"][j]
    for row in rows:
        i, j = index[int(row["first"])], index[int(row["second"])]
        normal = np.array([float(row["nx"]), float(row["ny"])])
        approach = normal @ (velocity[i] - velocity[j])
        push = float(row["reaction_Ns"]) * (1 / data["mass"][i] + 1 / data["mass"][j])
        off = abs(min(push, -approach))
        need(off <= (10 * tolerance + 1e-6) * size, f"complementarity is off by {off:g} m/s")


def check_json(content, may_be_null=MAY_BE_NULL):
    """Every number in it is one."""

    def strict(word):
        raise FaultError(f"{word} in a JSON file")

    def check(value, key):
        if isinstance(value, dict):
            for name, inner in value.items():
                check(inner, name)
        elif isinstance(value, list):
            for inner in value:
                check(inner, key)
        else:
            need(value is not None or may_be_null.search(key), f"{key}: null")

    content = json.loads(content, parse_constant=strict)
    check(content, "")
    return content


def data_rows(content):
    """Rows of the section Atoms of a data file, by id: strictly."""
    rows, section = {}, ""
    for line in unpacked(content).decode("utf-8", "replace").splitlines()[1:]:
        words = line.split("#")[0].split()
        if words and words[0].isalpha():
            section = words[0]
        elif words and section == "Atoms":
            need(words[0] not in rows, "an atom that occurs twice was taken")
            rows[words[0]] = [number(word, "Atoms") for word in words[1:7]]
    return rows


def check_run(files, data):
    """The first frame of a run is what its data file says, and nothing is missing."""
    record = check_json(files["run.json"])
    need(record["exit_state"] == "finished", record["exit_state"])
    frames, rows = frames_of(files["bodies.dump"]), data_rows(data)
    need(len(frames) == record["steps"] // record["frame_interval"] + 1, "frames are missing")
    for _, found in frames:
        need(len(found["id"]) == len(rows) == record["disks"], "disks are missing")
    start = frames[0][1]
    for index, name in enumerate(start["id"]):
        _, diameter, density, x, y, _ = rows[str(int(name))]
        mass = density * math.pi / 6 * diameter**3
        expected = (x, y, diameter / 2, mass)
        observed = [start[column][index] for column in ("x", "y", "radius", "mass")]
        need(np.allclose(observed, expected, rtol=1e-9, atol=1e-12), f"disk {name:g} is another")


def people_in(content, name, frame):
    """How many people a trajectory has in a frame, None where this cannot tell; rows must not be
    ragged."""
    if not name.endswith((".txt", ".csv", ".pp")):
        return None
    text = unpacked(content).decode("utf-8-sig")
    separator = {"p": ";", "v": ","}.get(name[-1])
    rows, head = [], None
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split(separator)]
        if not line.strip() or line.lstrip().startswith(("#", "$", "*")):
            continue
        if sum(bool(PLAIN.fullmatch(cell)) for cell in cells) < (1 if rows else 3):
            head = head or cells
            continue
        rows.append(cells)
    need(rows, "a trajectory without rows was taken")
    need(len({len(row) for row in rows}) == 1, "a ragged trajectory was taken")
    if name in ("metres.txt", "centimetres.txt", "bare.txt"):
        return len({row[0] for row in rows if float(row[1]) == float(frame)})
    if name == "table.csv" and head:
        at = {column: index for index, column in enumerate(head)}
        return len({row[at["id"]] for row in rows if float(row[at["frame"]]) == float(frame)})
    return None


def check_words(content):
    """A table of words and numbers: no ragged row, no number that is none."""
    rows = list(csv.reader(io.StringIO(content.decode("utf-8"))))
    need(len(rows) > 1, "a table without rows")
    need(len({len(row) for row in rows}) == 1, "a ragged table")
    bad = {
        cell for row in rows for cell in row if re.fullmatch(r"[+-]?(nan|inf(inity)?)", cell, re.I)
    }
    need(not bad, f"{bad} in a table")


def check_packed(content, people):
    """A new crowd has as many people as were asked for, and nobody is inside of another."""
    rows = list(data_rows(content).values())
    need(len(rows) == people, f"{len(rows)} people where {people} were asked for")
    disks = np.array([(row[3], row[4], row[1] / 2) for row in rows])
    distance = np.hypot(*(disks[:, None, :2] - disks[None, :, :2]).transpose(2, 0, 1))
    gap = distance - disks[:, None, 2] - disks[None, :, 2]
    np.fill_diagonal(gap, 1.0)
    need(gap.min() > -1e-6, f"people overlap by {-gap.min():g} m")


def _matrix(group):
    """A matrix of FCLIB in compressed columns, dense."""
    m, n = int(group["m"][0]), int(group["n"][0])
    need(int(group["nz"][0]) == -1 and m * n < 1e6, "another form than is written")
    starts, rows, values = (np.asarray(group[name]) for name in "pix")
    return csc_array((values, rows, starts), shape=(m, n)).toarray()


def _problem(file):
    """M, H, f, w and μ of FCLIB's global form."""
    group = file["fclib_global"]
    vectors = (np.asarray(group["vectors"][name]) for name in ("f", "w", "mu"))
    return [_matrix(group["M"]), _matrix(group["H"]), *vectors]


def _obeys(problem, reaction, tolerance):
    """M v = f + H r, u = Hᵀ v + w, 0 ≤ r ⊥ u ≥ 0 along the normals, |r_t| ≤ μ r_n."""
    mass, transfer, momentum, offset, mu = problem
    velocity = np.linalg.solve(mass, momentum + transfer @ reaction)
    left = np.linalg.solve(mass, momentum)
    u = (transfer.T @ velocity + offset).reshape(-1, 2)
    r = reaction.reshape(-1, 2)
    weight = np.einsum("ij,ij->j", transfer, np.linalg.solve(mass, transfer))[::2]
    off = np.abs(np.minimum(weight * r[:, 0], u[:, 0])).max()
    size = max(np.abs(left).max(), np.abs(offset).max(), 1e-300)
    need(off <= (100 * tolerance + 1e-6) * size, f"complementarity is off by {off / size:g}")
    slack = mu * r[:, 0] - np.abs(r[:, 1])
    need(slack.min() >= -1e-6 * max(1.0, np.abs(r).max()), "friction beyond its cone")


def check_problem(content, tolerance):
    """A problem that was written is finite and its answer obeys it; bodies do not matter."""
    with h5py.File(io.BytesIO(content)) as file:
        problem, reaction = _problem(file), np.asarray(file["solution/r"])
    need(all(np.isfinite(x).all() for x in (*problem, reaction)), "not finite")
    _obeys(problem, reaction, tolerance)


def check_answer(content, table, tolerance):
    """The answer to a problem that was damaged, where it can be read at all, obeys it."""
    rows = table_of(table)
    status, _, _ = in_fork(lambda: _solutions(content, rows, tolerance), 60.0)
    need(status in (0, 2) or status < 0, "the answer does not obey its problem")


def _solutions(content, rows, tolerance):
    """0 where the rows obey the problem, 1 where they do not, 2 where it has another form."""
    try:
        with h5py.File(io.BytesIO(content)) as file:
            problem = _problem(file)
    except (OSError, RuntimeError, KeyError, ValueError, IndexError, FaultError):
        return 2
    if "reaction_Ns" not in rows[0]:
        return 2
    along = [float(row["reaction_Ns"]) for row in rows]
    across = [float(row.get("friction_Ns", 0.0)) for row in rows]
    try:
        _obeys(problem, np.column_stack([along, across]).ravel(), tolerance)
    except FaultError:
        return 1
    return 0
