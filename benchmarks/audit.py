"""`percussions audit` beside `solve` on one LAMMPS run of about a million contacts, and what it names in
random files of contacts.

    python benchmarks/audit.py [--frames 1000] [--files 1000] [--out FOLDER]

Files have their columns, rows and ids permuted and names changed, then one change of CHANGES, or two. Wrong:
a change that is not there is named, or forces with a change are said to agree."""

import argparse
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

from analysis.audit import audit
from analysis.dumps import open_bodies, snapshot_of
from analysis.dumps.held import open_contacts
from analysis.engines import engine
from benchmarks.machine import describe

COLUMNS = "first=c_ids[1],second=c_ids[2],fx=c_pl[2],fy=c_pl[3],tx=c_pl[4],ty=c_pl[5]"
STEP_S, G = 2e-4, 3 * np.array([-2, -1.4]) / np.hypot(2, 1.4)
LAW = "{k} {c} tangential linear_history 30000 0.5 0.4 damping velocity"
DECK = f"""units si
dimension 2
newton off
boundary f f p
comm_modify vel yes
atom_style sphere
atom_modify map array
region box block -0.1 12 -0.1 30 -0.5 0.5
create_box 1 box
lattice sq 0.41
region fill block 0.1 {{width}} 0.1 {{height}} -0.1 0.1 units box
create_atoms 1 region fill
variable d atom 0.36+0.06*((id*7919)%101)/101
set group all diameter v_d
set group all mass 75
displace_atoms all random 0.01 0.01 0 {{seed}}
velocity all set -0.3 -0.3 0
pair_style granular
pair_coeff * * hooke {LAW.format(k=1e5, c=300)}
region wl plane 0 0 0 1 0 0
region wf plane 0 0 0 0 1 0
fix wl all wall/gran/region granular hooke {LAW.format(k=1e5, c=400)} region wl contacts
fix wf all wall/gran/region granular hooke {LAW.format(k=1e5, c=400)} region wf contacts
fix g all gravity 3.0 vector -2 -1.4 0
fix nve all nve/sphere disc
fix 2d all enforce2d
compute ids all property/local patom1 patom2 cutoff radius
compute pl all pair/local dist fx fy p1 p2 cutoff radius
timestep {STEP_S}
run {{settle}}
dump b all custom 1 bodies.dump id x y radius mass vx vy omegaz f_wl[*] f_wf[*]
dump_modify b sort id format float %.17g
dump p all local 1 pairs.dump c_ids[*] c_pl[*]
dump_modify p format float %.17g
run {{run}}
"""
ROOM = f"""title = "corner"
source = "own"
walls = [{{name = "left", start_m = [0.0, -0.05], end_m = [0.0, 29.0]}},
         {{name = "floor", start_m = [-0.05, 0.0], end_m = [11.9, 0.0]}}]
[body_force]
acceleration_m_per_s2 = [{G[0]!r}, {G[1]!r}]
"""


def simulate(folder: Path, **values: float) -> None:
    """Run LAMMPS in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "corner.in").write_text(DECK.format(**values))
    (folder / "room.toml").write_text(ROOM)
    command = [engine("lammps").find(), "-in", "corner.in", "-log", "none"]
    subprocess.run([str(word) for word in command], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def seconds(folder: Path, *words: str) -> float:
    """CPU seconds of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "analysis.cli", *words, "bodies.dump", "--room", "room.toml", "--time-step", str(STEP_S)]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def crowd(folder: Path) -> tuple[list, list]:
    """Read snapshots, and the tables of all contacts with the force on the second, as LAMMPS wrote them."""
    trajectory = open_bodies(folder / "bodies.dump", STEP_S).trajectory
    index = open_contacts(folder / "pairs.dump", COLUMNS)
    snapshots, tables = [], []
    for number in range(len(trajectory)):
        ts, pairs = trajectory[number], dict(zip(index.columns, index.table(number).T, strict=True))
        snapshots.append(snapshot_of(ts))
        force = -np.column_stack([pairs["fx"] + pairs["tx"], pairs["fy"] + pairs["ty"]])
        parts = [(pairs["first"], pairs["second"], 0 * pairs["first"], force)]
        for wall, fix in enumerate(("f_wl", "f_wf"), 1):
            on = ts.data[f"{fix}[1]"] > 0
            push = -np.column_stack([ts.data[f"{fix}[2]"], ts.data[f"{fix}[3]"]])[on]
            parts.append((ts.data["id"][on], np.full(on.sum(), wall), np.ones(on.sum()), push))
        one, two, is_wall, force = (np.concatenate(each) for each in zip(*parts, strict=True))
        tables.append({"first": one.astype(int), "second": two.astype(int), "is_wall": is_wall > 0, "force": force})
    return snapshots, tables


def times(factor: float):
    """Multiply all forces."""
    return lambda table, random: table | {"force": factor * table["force"]}


def some(table, random, keep):
    """Keep rows."""
    return {name: column[keep] for name, column in table.items()}


def turned(table, random):
    """Turn the signs of half of the contacts."""
    return table | {"force": table["force"] * random.choice([-1, 1], (len(table["first"]), 1))}


CHANGES = {
    (): lambda table, random: table,
    ("sign",): times(-1),
    ("impulse",): times(STEP_S),
    ("substeps",): times(1 / 7),
    ("units",): times(1e3),
    ("signs of contacts",): turned,
    ("axes",): lambda table, random: table | {"force": table["force"][:, ::-1]},
    ("walls missing",): lambda table, random: some(table, random, ~table["is_wall"]),
    ("contacts missing",): lambda table, random: some(table, random, random.random(len(table["first"])) < 0.5),
}  # fmt: skip


def permuted(table, random):
    """Give rows and ids in another order, which changes no force."""
    back, rows = (random.random(len(table["first"])) < 0.5) & ~table["is_wall"], random.permutation(len(table["first"]))
    one, two = (np.where(back, table[b], table[a]) for a, b in (("first", "second"), ("second", "first")))
    force = np.where(back[:, None], -1, 1) * table["force"]
    new = {"first": one, "second": two, "is_wall": table["is_wall"], "force": force}
    return {name: new[name][rows] for name in random.permutation([*new])}


def random_files(crowds: list, number: int, double: bool) -> list[int]:
    """Count files that were named, left open, and named wrongly."""
    random, counts, names = np.random.default_rng(5), [0, 0, 0], [*CHANGES]
    for k in range(number):
        snapshots, tables = crowds[random.integers(len(crowds))]
        start = int(random.integers(len(snapshots) - 60))
        faults = [names[k % len(names)]]
        faults += [names[random.integers(1, len(names))]] if double else []
        some = [permuted(table, random) for table in tables[start : start + 60]]
        for fault in dict.fromkeys(faults):
            some = [CHANGES[fault](table, random) for table in some]
        found = audit(snapshots[start : start + 60], some, external=lambda now: now.mass[:, None] * G, walls=walls())
        right = {name for fault in faults for name in fault}
        wrong = (found.status == "agrees" and right) or ({*found.faults} - right - {"factor"})
        exact = {*found.faults} == right and found.status == ("differs" if right else "agrees")
        counts[2 if wrong else 0 if exact else 1] += 1
        if wrong or not (exact or double):
            print("wrong:" if wrong else "open:", *sorted(right), "|", found.words)
    return counts


def walls():
    """Give the corner."""
    from nscd import Walls

    return Walls(start=[[0, -0.05], [-0.05, 0]], end=[[0, 29], [11.9, 0]])


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--out", type=Path, default=Path("out/audit"))
    given = parser.parse_args()
    print(describe())
    if given.frames:
        simulate(given.out / "large", width=9, height=10, settle=20000, run=given.frames - 1, seed=1234)
        own = ["--contacts", "pairs.dump", "--contacts-columns", COLUMNS]
        spent = {"audit": seconds(given.out / "large", "audit", *own)}
        spent |= {"solve": seconds(given.out / "large", "solve", "--out", "s.csv")}
        spent |= {"solve --openness none": seconds(given.out / "large", "solve", "--openness", "none", "--out", "s.csv")}
        for name, one in spent.items():
            print(f"{name:24s} {one:7.1f} CPU s, {one / spent['audit']:.2f} of audit")
    if given.files:
        shapes = [(1.4, 2.0, 7), (2.2, 1.3, 8), (3.0, 2.2, 9), (1.0, 4.0, 10)]
        for n, (width, height, seed) in enumerate(shapes):
            simulate(given.out / str(n), width=width, height=height, settle=4000, run=199, seed=seed)
        crowds = [crowd(given.out / str(n)) for n in range(len(shapes))]
        for double in (False, True):
            named, left, wrong = random_files(crowds, given.files, double)
            print(f"{'two changes' if double else 'one change or none'}: {named} named, {left} open, {wrong} wrong")


if __name__ == "__main__":
    main()
