"""The library of contact problems: what is written, and who is judged right."""

import csv
import json
import math
import shutil
import time
from functools import partial

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import linprog

from analysis.studies.exchange.fclib import read_answer, read_problem, write_answer
from analysis.studies.exchange.problem import ExchangeError
from benchmarks.library import main
from benchmarks.problems.judge import judge
from benchmarks.problems.score import SHIFT, means, profiles, times, with_friction
from benchmarks.problems.writing import PROBLEMS, Problem, read_manifest, write_library, write_one
from nscd.friction.planar import solve_planar
from tests.forked import as_program, in_fork

pytest.importorskip("h5py", reason="needs h5py")

LATTICE, PUSHED, RUBBING = "hexagonal_20", "push_20", "jammed_16_mu030"
SMALL = (
    *(Problem(family=family, size=20) for family in ("hexagonal", "push")),
    Problem(family="jammed", size=16, friction=0.3),
)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    write_library(folder, SMALL)
    return folder


@pytest.fixture
def judged(library, tmp_path):
    """The verdict on reactions (2k,) to a problem."""

    def verdict(name, reaction, unique=True):
        write_answer(tmp_path / "answer.hdf5", reaction, 0.5)
        return judge(library / f"{name}.hdf5", tmp_path / "answer.hdf5", unique=unique)

    return verdict


def known_problem(library, name):
    """The problem of a crowd, and the reactions in its file."""
    path = library / f"{name}.hdf5"
    problem = read_problem(path)
    return problem, read_answer(path, len(problem.contacts))[0]


def other_split(problem, reaction):
    """The admissible reactions with the most at one contact, by a linear program over λ ≥ 0 with
    the same momentum of every disk, 0 where contacts open."""
    rows = problem.contacts.normal_matrix(len(problem.snapshot))
    right = problem.left_velocity.ravel() - (rows.T @ reaction[::2]) / 75.0
    closed = -(rows @ right) < 1e-9
    aim = np.zeros(len(reaction) // 2)
    aim[len(aim) // 2] = -1.0
    ends = [(0.0, None if one else 0.0) for one in closed]
    found = linprog(aim, A_eq=rows.T, b_eq=rows.T @ reaction[::2], bounds=ends, method="highs-ds")
    assert found.status == 0
    return np.column_stack([found.x, np.zeros(len(aim))]).ravel()


def test_sixty_problems_with_names_of_their_own():
    assert len(PROBLEMS) == len({problem.name for problem in PROBLEMS}) == 60
    assert sum(not problem.friction for problem in PROBLEMS) == 31


@pytest.mark.long
def test_the_manifest_says_what_is_judged(library):
    entries = {entry["name"]: entry for entry in read_manifest(library)}
    assert set(entries) == {LATTICE, PUSHED, RUBBING}
    unique = {name for name, one in entries.items() if one["velocity"] == "unique"}
    assert unique == {LATTICE, PUSHED}
    assert all(one["residual"] < 1e-10 for one in entries.values())
    assert entries[LATTICE]["forces"] == "intervals"


def test_the_same_problem_is_the_same_file_whenever_it_is_written(library, tmp_path):
    time.sleep(1.1)  # clocks of files have seconds
    assert write_one(tmp_path, SMALL[1]) in read_manifest(library)


def test_another_split_of_what_balance_leaves_open_is_right(library, judged):
    problem, reaction = known_problem(library, LATTICE)
    other = other_split(problem, reaction)
    assert np.abs(other - reaction).max() > 0.1 * reaction.max()
    for fraction in (0.0, 0.5, 1.0):
        verdict = judged(LATTICE, (1 - fraction) * reaction + fraction * other)
        assert verdict.right, verdict
        assert verdict.outside < 1e-6


def test_a_split_that_pulls_is_wrong(library, judged):
    problem, reaction = known_problem(library, LATTICE)
    other = other_split(problem, reaction)
    pulls = reaction + 20.0 * (reaction - other)
    assert pulls.min() < 0
    verdict = judged(LATTICE, pulls)
    assert not verdict.right
    # the velocities are the same: only forces are wrong
    assert verdict.velocity < 1e-6


@pytest.mark.parametrize("name", [LATTICE, PUSHED, RUBBING])
def test_wrong_answers_are_wrong(library, judged, name):
    unique = name != RUBBING
    _, reaction = known_problem(library, name)
    assert judged(name, reaction, unique).right
    nudged = reaction.copy()
    nudged[2 * int(np.argmax(reaction[::2]))] *= 1.0 + 1e-4
    for wrong in (0 * reaction, 1.001 * reaction, nudged, -reaction, reaction + math.nan):
        assert not judged(name, wrong, unique).right


def test_a_force_that_balance_determines_is_named(library, judged):
    # a row is a chain: every reaction is determined; the wall's alone is changed
    _, reaction = known_problem(library, PUSHED)
    reaction[np.flatnonzero(reaction)[0]] *= 1.01
    verdict = judged(PUSHED, reaction)
    assert "determined" in verdict.why
    assert 1e-3 < verdict.determined <= 0.011


def test_with_friction_the_residual_alone_is_judged(library, judged):
    """Gauss–Seidel on the matrices alone ends at other reactions, which are as right."""
    problem, reaction = known_problem(library, RUBBING)
    local = problem.matrices(np.full(len(problem.contacts), 0.3)).local()
    other = solve_planar(local.delassus, local.free, local.friction, 1e-9).reaction.ravel()
    verdict = judged(RUBBING, other, unique=False)
    assert verdict.right
    assert math.isnan(verdict.velocity)
    assert np.abs(other - reaction).max() > 1e-3 * reaction.max()


def test_means_and_profiles_of_made_up_times():
    cells = [
        *(("fast", "a", 0.0, 1.0), ("fast", "b", 0.0, 4.0), ("slow", "a", 0.0, 2.0)),
        *(("slow", "c", 0.3, 1.0), ("liar", "a", 0.0, 0.1), ("liar", "b", 0.0, 0.1)),
    ]
    scores = pd.DataFrame(cells, columns=["solver", "problem", "mu", "cpu_s"])
    scores["verdict"] = np.where(scores.solver == "liar", "wrong", "right")
    missing = [("slow", "b", 0.0), ("fast", "c", 0.3), ("liar", "c", 0.3)]
    rest = pd.DataFrame(missing, columns=["solver", "problem", "mu"]).assign(verdict="missing")
    scores = pd.concat([scores, rest])
    seconds = times(with_friction(scores, False)).loc[["fast", "slow", "liar"]]
    fast = math.sqrt((1 + SHIFT) * (4 + SHIFT)) - SHIFT
    slow = math.sqrt((2 + SHIFT) * (10 + SHIFT)) - SHIFT
    assert means(seconds, 10.0).tolist() == pytest.approx([fast, slow, 10.0])
    fractions = profiles(seconds, np.array([1.0, 1.9, 2.0, 100.0])).to_numpy()
    assert fractions.tolist() == [[1, 1, 1, 1], [0, 0, 0.5, 0.5], [0, 0, 0, 0]]
    assert list(with_friction(scores, True).solver) == ["slow"]


@pytest.fixture
def by_command(tmp_path):
    """`benchmarks/library.py` in a folder of its own."""

    def called(*words):
        run = partial(as_program, [str(word) for word in words], tmp_path, main)
        return in_fork(run, 600)[:2]

    return called


@pytest.mark.long
def test_score_by_command(library, by_command, tmp_path):
    solution_files = tmp_path / "answers"
    for name in (LATTICE, RUBBING):
        write_answer(solution_files / "mine" / f"{name}.hdf5", known_problem(library, name)[1], 0.25)
    _, reaction = known_problem(library, PUSHED)
    write_answer(solution_files / "theirs" / f"{PUSHED}.hdf5", 2 * reaction, 0.01)
    status, message = by_command("score", library, solution_files / "mine", solution_files / "theirs")
    assert status == 0, message
    with (tmp_path / "scores/scores.csv").open() as file:
        rows = {(row["solver"], row["problem"]): row for row in csv.DictReader(file)}
    assert {key: row["verdict"] for key, row in rows.items()} == {
        ("mine", LATTICE): "right", ("mine", PUSHED): "missing", ("mine", RUBBING): "right",
        ("theirs", LATTICE): "missing", ("theirs", PUSHED): "wrong", ("theirs", RUBBING): "missing",
    }  # fmt: skip
    assert rows["mine", LATTICE]["cpu_s"] == "0.25"
    assert (tmp_path / "scores/profile.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        *(({"file": bad}, "problems.0.file: ") for bad in (7, "../manifest.json", "..")),
        ({"name": ["heap"]}, "problems.0.name: "),
        ({"disks": "many"}, "problems.0.disks: "),
        ({"friction": None}, "problems.0.friction: "),
        ({"contacts": ...}, "problems.0.contacts: Field required"),
        ({"twice": True}, "two problems are called "),
        ("[" * 100_000, "no manifest of a library"),
        ('{"version": true, "problems": []}', "version: "),
        ('{"version": 1, "problems": []}', "problems: "),
    ],
)
def test_an_odd_manifest_is_one_line(library, tmp_path, change, message):
    content = json.loads((library / "manifest.json").read_text())
    if isinstance(change, dict):
        first = content["problems"][0]
        first |= {key: value for key, value in change.items() if value is not ...}
        for key in (key for key, value in change.items() if value is ...):
            del first[key]
        if "twice" in change:
            content["problems"].append(first)
    text = change if isinstance(change, str) else json.dumps(content)
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(ExchangeError) as refused:
        read_manifest(tmp_path)
    (line,) = str(refused.value).splitlines()
    assert line.startswith(f"{tmp_path}/manifest.json: ")
    assert message in line


@pytest.mark.long
def test_what_cannot_be_judged_is_named(library, by_command, tmp_path):
    shutil.copytree(library, tmp_path / "changed")
    with (tmp_path / "changed" / f"{PUSHED}.hdf5").open("ab") as file:
        file.write(b"\0")
    (tmp_path / "none").mkdir()
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged/manifest.json").write_text(json.dumps({"version": 1}))
    for message, words in (("1", "'1'"), (b"3", "'3'"), (True, "True"), ([1.0, 2.0], "None")):
        write_answer(tmp_path / "odd" / f"{LATTICE}.hdf5", known_problem(library, LATTICE)[1], message)
        status, made = by_command("score", library, "odd")
        assert status == 1
        assert f"/solution, seconds: {words}. A number above 0 s is needed" in made
    for words, named in (
        (("score", "changed", "none"), f"changed/{PUSHED}.hdf5: not the file"),
        (("score", library, "none"), "none: no answer to any problem of"),
        (("score", "damaged", "none"), "damaged/manifest.json: no manifest"),
        (("score", "nowhere", "none"), "nowhere/manifest.json: no such file"),
        (("write", "--only", "heap_7"), "only: heap_7. There are: heap_40"),
    ):
        status, message = by_command(*words)
        assert (status, len(message.splitlines()), named in message) == (1, 1, True)
