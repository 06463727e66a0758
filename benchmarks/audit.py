"""`percussions audit` beside `solve` on one LAMMPS run of about a million contacts, and what it names in
random files of contacts.

    python benchmarks/audit.py [--frames 1000] [--files 1000] [--out FOLDER]

Files have their columns, rows and ids permuted and names changed, then one change of CHANGES, or two. Wrong:
a change that is not there is named, or forces with a change are said to agree."""

import argparse
import logging
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

from analysis.dumps import open_bodies
from analysis.dumps.listed_contacts import open_contacts
from analysis.engines import engine
from analysis.percussions.audit.judge import judge
from analysis.studies.audit import open_record
from benchmarks.machine import describe

COLUMNS = "first=c_ids[1],second=c_ids[2],fx=c_pl[2],fy=c_pl[3],tx=c_pl[4],ty=c_pl[5]"
STEP_S, SETTLE, G = 2e-4, 4000, 3 * np.array([-2, -1.4]) / np.hypot(2, 1.4)
LAW = "{k} {c} tangential linear_history 30000 0.5 0.4 damping velocity"
DECK = (Path(__file__).parent / "engines" / "head.in").read_text() + f"""region box block -0.1 12 -0.1 30 -0.5 0.5
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
acceleration_m_per_s2 = {G.tolist()}
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
    program, of = Path(sys.executable).with_name("percussions"), ["--room", "room.toml", "--time-step", str(STEP_S)]
    command = [program, *words, "bodies.dump", *of]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def crowd(folder: Path) -> list[dict]:
    """Read the tables of all contacts with the force on the second, as LAMMPS wrote them."""
    trajectory = open_bodies(folder / "bodies.dump", STEP_S).trajectory
    index, tables = open_contacts(folder / "pairs.dump", COLUMNS), []
    for number, ts in enumerate(trajectory):
        pairs = dict(zip(index.columns, index.table(number).T, strict=True))
        force = -np.column_stack([pairs["fx"] + pairs["tx"], pairs["fy"] + pairs["ty"]])
        parts = [(pairs["first"], pairs["second"], 0 * pairs["first"], force)]
        for wall, fix in enumerate(("f_wl", "f_wf"), 1):
            on = ts.data[f"{fix}[1]"] > 0
            push = -np.column_stack([ts.data[f"{fix}[2]"], ts.data[f"{fix}[3]"]])[on]
            parts.append((ts.data["id"][on], np.full(on.sum(), wall), np.ones(on.sum()), push))
        one, two, is_wall, force = (np.concatenate(each) for each in zip(*parts, strict=True))
        tables.append({"first": one, "second": two, "is_wall": is_wall > 0, "force": force})
    return tables


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
    """Give ids in another order, which changes no force."""
    back = (random.random(len(table["first"])) < 0.5) & ~table["is_wall"]
    one, two = (np.where(back, table[b], table[a]) for a, b in (("first", "second"), ("second", "first")))
    return table | {"first": one, "second": two, "force": np.where(back[:, None], -1, 1) * table["force"]}


def write_file(path: Path, tables: list[dict], start: int, random) -> str:
    """Write a table with names, columns and rows in any order; return which name is which."""
    steps = np.repeat(np.arange(len(tables)) + SETTLE + start, [len(table["first"]) for table in tables])
    rows = np.column_stack([steps, np.concatenate([np.column_stack([*table.values()]) for table in tables])])
    names = dict(zip(("step", "first", "second", "is_wall", "fx", "fy"), random.permutation([*"ABCDEF"]), strict=True))
    order, mark = random.permutation(6), random.choice([*",;\t"])
    head = mark.join(np.array([*names.values()])[order])
    np.savetxt(path, random.permutation(rows)[:, order], "%.17g", mark, header=head, comments="")
    return ",".join(f"{name}={column}" for name, column in names.items())


def random_files(folders: list[Path], number: int, double: bool) -> list[int]:
    """Count files that were named, left open, and named wrongly."""
    random, counts, names = np.random.default_rng(5), [0, 0, 0], [*CHANGES]
    crowds, path = [crowd(folder) for folder in folders], folders[0].with_name("contacts.csv")
    for k in range(number):
        n = random.integers(len(crowds))
        start = int(random.integers(len(crowds[n]) - 60))
        faults, right = [names[k % len(names)]], set()
        faults += [names[random.integers(1, len(names))]] if double else []
        some = [permuted(table, random) for table in crowds[n][start : start + 60]]
        for fault in dict.fromkeys(faults):
            new = [CHANGES[fault](table, random) for table in some]
            if any(not np.array_equal(a["force"], b["force"]) for a, b in zip(some, new, strict=True)):
                right |= {*fault} - {"sign"}  # no walls that nobody touches, and no sign, which a file leaves open
            some = new
        frames = f"{start}:{start + 59}"
        columns, dump, room = write_file(path, some, start, random), folders[n] / "bodies.dump", folders[n] / "room.toml"
        found = judge(open_record(dump, path, columns, room, frames, None, time_step=STEP_S)[0], time_step=STEP_S)
        wrong = (found.status == "agrees" and right) or ({*found.faults} - right - {"factor"})
        exact = {*found.faults} == right and found.status == ("differs" if right else "agrees")
        counts[2 if wrong else 0 if exact else 1] += 1
        if wrong or not (exact or double):
            print("wrong:" if wrong else "open:", *sorted(right), "|", found.words)
    return counts


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--out", type=Path, default=Path("out/audit"))
    args = parser.parse_args()
    print(describe())
    if args.frames:
        simulate(args.out / "large", width=9, height=10, settle=20000, run=args.frames - 1, seed=1234)
        own = ["--contacts", "pairs.dump", "--contacts-columns", COLUMNS]
        spent = {"audit": seconds(args.out / "large", "audit", *own)}
        spent |= {"solve": seconds(args.out / "large", "solve", "--out", "s.csv")}
        spent |= {"solve --openness none": seconds(args.out / "large", "solve", "--openness", "none", "--out", "s.csv")}
        for name, one in spent.items():
            print(f"{name:24s} {one:7.1f} CPU s, {one / spent['audit']:.2f} of audit")
    logging.disable()  # notes on files
    if args.files:
        shapes = [(1.4, 2.0, 7), (2.2, 1.3, 8), (3.0, 2.2, 9), (1.0, 4.0, 10)]
        for n, (width, height, seed) in enumerate(shapes):
            simulate(args.out / str(n), width=width, height=height, settle=SETTLE, run=199, seed=seed)
        for double in (False, True):
            named, left, wrong = random_files([args.out / str(n) for n in range(len(shapes))], args.files, double)
            print(f"{'two changes' if double else 'one change or none'}: {named} named, {left} open, {wrong} wrong")


if __name__ == "__main__":
    main()
