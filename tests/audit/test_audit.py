"""The judge names what was done to forces that are right, and says what it cannot judge."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.engines import engine
from analysis.percussions.audit import audit
from nscd import Snapshot
from tests.audit.crowd import CORNER, FRICTION, STEP_S, pressed, weight
from tests.engines.at_hand import require

PROGRAMS = Path(__file__).parent / "programs"
SNAPSHOTS, TABLES = pressed()


def judged(tables, snapshots=SNAPSHOTS, **arguments):
    return audit(snapshots, tables, **{"external": weight, "walls": CORNER, "friction": FRICTION} | arguments)


def scaled(factor):
    return lambda table, random: table | {"force": factor * table["force"]}


def some(keep):
    def change(table, random):
        chosen = keep(table, random)
        return {name: column[chosen] for name, column in table.items()}

    return change


def signs(table, random):
    return table | {"force": table["force"] * random.choice([-1, 1], (len(table["force"]), 1))}


def permuted(table, random):
    """Other orders of rows and of ids: the same contacts."""
    turned = (random.random(len(table["first"])) < 0.5) & ~table["is_wall"]
    sign, order = np.where(turned, -1, 1)[:, None], random.permutation(len(turned))
    first, second = np.where(turned, [table["second"], table["first"]], [table["first"], table["second"]])
    new = {"first": first, "second": second, "is_wall": table["is_wall"]}
    new |= {name: sign * table[name] for name in ("force", "normal")}
    return {name: new[name][order] for name in random.permutation([*new])}


def reordered(table, random):
    """Ids in any order, the force on the larger one all the same."""
    new = permuted(table, random)
    back = (new["first"] > new["second"]) & ~new["is_wall"]
    return new | {"force": np.where(back[:, None], -new["force"], new["force"])}


def both(table, random):
    pairs = {name: column[~table["is_wall"]] for name, column in table.items()}
    back = pairs | {"first": pairs["second"], "second": pairs["first"]}
    back |= {name: -pairs[name] for name in ("force", "normal")}
    return {name: np.concatenate([table[name], back[name]]) for name in table}


def points(table, random):
    """Two rows of the pairs of odd first ids, each with the whole force."""
    rows = np.repeat(np.arange(len(table["first"])), np.where(table["is_wall"], 1, 1 + table["first"] % 2))
    return {name: column[rows] for name, column in table.items()}


def normal_part(table, random):
    return table | {"force": (table["force"] * table["normal"]).sum(axis=1)[:, None] * table["normal"]}


FAULTS = {
    "as it is": (scaled(1.0), ()),
    "rows and columns permuted": (permuted, ()),
    "impulses": (scaled(STEP_S), ("impulse",)),
    "impulses again": (scaled(1 / STEP_S), ("impulse",)),
    "substeps": (scaled(1 / 7), ("substeps",)),
    "turned": (scaled(-1.0), ("sign",)),
    "grams": (scaled(1e3), ("units",)),
    "centimetres": (scaled(1e2), ("units",)),
    "dyn": (scaled(1e5), ("units",)),
    "nothing has this factor": (scaled(0.87), ("factor",)),
    "signs of contacts": (signs, ("signs of contacts",)),
    "order": (reordered, ("order",)),
    "no walls": (some(lambda table, random: ~table["is_wall"]), ("walls missing",)),
    "half": (some(lambda table, random: random.random(len(table["first"])) < 0.5), ("contacts missing",)),
    "both directions": (both, ("both directions",)),
    "contact points": (points, ("contact points",)),
    "axes": (lambda table, random: table | {"force": table["force"][:, ::-1]}, ("axes",)),
    "normal part": (normal_part, ("normal part only",)),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_named(name):
    change, faults = FAULTS[name]
    random = np.random.default_rng(1)
    found = judged([change(table, random) for table in TABLES])
    assert found.faults == faults, found.words
    assert found.status == ("differs" if faults else "agrees")


def test_two_faults_at_once_are_both_named():
    found = judged([{k: c[~t["is_wall"]] for k, c in scaled(-1e2)(t, 0).items()} for t in TABLES])
    assert found.faults == ("sign", "units", "walls missing")


@pytest.mark.parametrize(("late", "faults"), [(1, ()), (2, ("step before",)), (-1, ("step after",))])
def test_forces_of_another_step_are_named(late, faults):
    """Forces of the step that ends at a frame are right, too; those of one step more are not."""
    tables = [TABLES[min(max(k - late, 0), len(TABLES) - 1)] for k in range(len(TABLES))]
    assert judged(tables).faults == faults


def test_two_that_explain_alike_are_both_said_and_none_is_named():
    """Steps of 1 ms: impulses are as many times smaller as forces of masses in g are larger."""
    quick = [Snapshot(position=s.position, velocity=2 * s.velocity, radius=s.radius, mass=s.mass, time=s.time / 2)
             for s in SNAPSHOTS]  # fmt: skip
    found = judged([scaled(4e-3)(t, 0) for t in TABLES], quick, external=lambda now: 4 * weight(now))
    assert (found.status, found.faults) == ("differs", ())
    assert "impulses (N·s)" in found.words
    assert "masses of the bodies in g" in found.words


@pytest.mark.long
def test_random_files_are_named_and_never_wrongly():
    """What is wrong is drawn, with a crowd; either it is named, or nothing is said to be known."""
    random, right = np.random.default_rng(2), 0
    names = ["rows and columns permuted", "turned", "grams", "centimetres", "signs of contacts", "half", "dyn", "no walls"]
    drawn = (pressed(120, seed, side=3) for seed in range(5))
    crowds = [one for one in drawn if any(table["is_wall"].any() for table in one[1])]
    for number in range(160):
        name, (snapshots, tables) = names[number % len(names)], crowds[random.integers(len(crowds))]
        change, faults = FAULTS[name]
        found = judged([change(permuted(table, random), random) for table in tables], snapshots)
        assert found.faults in (faults, ()), (name, found.words)
        assert found.status != "agrees" or not faults, (name, found.words)
        right += found.faults == faults and found.status != "unknown"
    assert right >= 0.95 * 160


@pytest.mark.parametrize(
    ("tables", "snapshots", "inputs", "why"),
    [
        (TABLES, SNAPSHOTS, {"external": None}, "acceleration of (-2, -1.4) m/s², which was not given"),
        (TABLES[:1], SNAPSHOTS[:1], {}, "2 frames or more"),
        ([{k: c[:0] for k, c in t.items()} for t in TABLES], SNAPSHOTS, {}, "no contact with a force"),
        (TABLES[::20], SNAPSHOTS[::20], {}, "too far for forces that change so fast"),
    ],
)
def test_what_cannot_be_judged_is_said_why(tables, snapshots, inputs, why):
    found = judged(tables, snapshots, **inputs)
    assert (found.status, found.exit_status) == ("unknown", 2)
    assert why in found.words


def test_a_crowd_at_rest_that_nothing_presses_fixes_no_factor():
    """Two disks between two walls, at rest: any force balances, and only an external one decides."""
    two = [Snapshot(position=[[0.2, 1], [0.6, 1]], radius=[0.2, 0.2], mass=[75, 75], time=t) for t in (0, 1, 2)]
    table = {"first": [1, 1, 2], "second": [2, 1, 2], "is_wall": [False, True, True],
             "force": [[90.0, 0], [-90.0, 0], [90.0, 0]]}  # fmt: skip
    assert "nothing moves and nothing presses" in audit(two, [table] * 3, external=0).words


def test_a_data_frame():
    parts = []
    for now, table in zip(SNAPSHOTS, TABLES, strict=True):
        columns = {name: table[name] for name in ("first", "second", "is_wall")}
        parts.append(pd.DataFrame(columns).assign(time_s=now.time, fx=table["force"][:, 0], fy=table["force"][:, 1]))
    every = pd.concat(parts)
    assert judged(every).status == "agrees"
    with pytest.raises(ValueError, match="time_s: rows at instants"):
        judged(every.assign(time_s=every.time_s + 1e-4))


@pytest.mark.parametrize("arms", [(0, 0), (0.5, 0), (0.5, 0.5), (0, 1)])
def test_spins_and_where_torques_act(arms):
    """At the radius, as LAMMPS' gran/hooke has it, or at the middle of overlaps: `granular`, but not with walls."""
    snapshots, tables = pressed(arms=arms)
    (message,) = [one for one in judged(tables, snapshots).remarks if "spins" in one]
    assert message == ("spins agree with the torques to 0 %, with an inertia of 0.5 m r² (disc 0.5, sphere 0.4) and arms of "
                    f"the radius less {arms[0]} of the overlap of bodies, {arms[1]} of that with walls")  # fmt: skip


@pytest.mark.parametrize("bad", [{"second": [99]}, {"second": [1]}, {"force": [[np.nan, 0.0]]}])
def test_a_contact_of_nobody_is_refused(bad):
    table = {"first": [1], "second": [2], "force": [[1.0, 0.0]]} | bad
    with pytest.raises(ValueError, match="contacts: frame 0, row 0"):
        audit(SNAPSHOTS[:2], [table] * 2)


ROOM = """title = "corner"
source = "own"
[[walls]]
name = "left"
start_m = [0.0, -1.0]
end_m = [0.0, 9.0]
[[walls]]
name = "floor"
start_m = [-1.0, 0.0]
end_m = [9.0, 0.0]
[body_force]
acceleration_m_per_s2 = [{}, {}]
"""
PAIR = "first=c_ids[1],second=c_ids[2],fx=c_pl[2],fy=c_pl[3]"


def read(percussions, tmp_path, columns, contacts, status, faults):
    made = percussions("audit", "bodies.dump", "--contacts", contacts, "--contacts-columns", columns,
                       "--time-step", "5e-4", "--room", "room.toml")  # fmt: skip
    assert made.returncode == status, made.stdout + made.stderr
    assert json.loads((tmp_path / "audit" / "audit.json").read_text())["faults"] == faults


def run_program(name, tmp_path, *words):
    require(name)
    ours = os.pathsep.join(str(PROGRAMS.parents[2] / one) for one in ("yade_scripts", "examples/yade"))
    environment = os.environ | {"PYTHONPATH": ours, "OMP_NUM_THREADS": "1"}
    command = [engine(name).find(), *words]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, env=environment)


def test_lammps_says_normal_forces_of_pairs_alone_unless_asked(percussions, tmp_path):
    """Of `compute pair/local` fx, fy are the normal force; the tangential one is p1, p2. Gravity of 3 m/s²
    along (-2, -1.4); walls by fix wall/gran … contacts."""
    run_program("lammps", tmp_path, "-in", PROGRAMS / "corner.in", "-log", "none")
    (tmp_path / "room.toml").write_text(ROOM.format(*np.array([-2, -1.4]) * 3 / np.hypot(2, 1.4)))
    complete, text = f"{PAIR},tx=c_pl[4],ty=c_pl[5]", (tmp_path / "bodies.dump").read_text()
    read(percussions, tmp_path, complete, "pairs.dump", 0, [])
    read(percussions, tmp_path, PAIR, "pairs.dump", 1, ["normal part only"])
    (tmp_path / "bodies.dump").write_text(text.replace("f_wl[8]", "other").replace("f_wf[8]", "another"))
    read(percussions, tmp_path, complete, "pairs.dump", 1, ["walls missing"])


@pytest.mark.long
def test_yade_tells_its_interactions(percussions, tmp_path):
    run_program("yade", tmp_path, "-L", "noserver", "-j1", "-n", "-x", PROGRAMS / "corner_yade.py")
    (tmp_path / "room.toml").write_text(ROOM.format(-2.0, -1.4))
    columns, rows = "first=first", pd.read_csv(tmp_path / "contacts.csv")
    read(percussions, tmp_path, columns, "contacts.csv", 0, [])
    for factor, faults in ((5e-4, ["impulse"]), (0.25, ["substeps"]), (1e5, ["units"])):
        rows.assign(fx=factor * rows.fx, fy=factor * rows.fy).to_csv(tmp_path / "wrong.csv", index=False)
        read(percussions, tmp_path, columns, "wrong.csv", 1, faults)


def test_the_fixture_of_pytest_says_what_is_wrong(assert_forces_balance):
    arguments = {"external": weight, "walls": CORNER}
    assert_forces_balance(SNAPSHOTS, TABLES, **arguments)
    with pytest.raises(AssertionError, match="they are impulses"):
        assert_forces_balance(SNAPSHOTS, [scaled(STEP_S)(t, 0) for t in TABLES], **arguments)
