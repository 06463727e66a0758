"""Frames of a film solved together: each as `solve` alone answers it, whoever works on them."""

import numpy as np
import pytest

from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.percussions import percussions_of
from analysis.percussions.setting import Setting
from analysis.percussions.solve_dump import DumpToSolve, solve_dump
from analysis.scene.shipped_scenes import make
from analysis.support.write_frames import write_frame
from benchmarks.problems.families import jammed

FRAMES = 12
NAMES = ("id", "x", "y", "radius", "mass", "vx", "vy")


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A heap that is shaken a little more in each frame, one of whom is never there; its walls."""
    heap, random = jammed(70), np.random.default_rng(3)
    crowd = heap.snapshot
    steps = 2e-5 * random.standard_normal((FRAMES, len(crowd), 2))
    path = tmp_path_factory.mktemp("film") / "bodies.dump"
    with path.open("w") as file:
        for step in range(FRAMES):
            x, y = (crowd.position + steps[: step + 1].sum(0)).T
            vx, vy = (heap.left_velocity + 0.1 * random.standard_normal((len(crowd), 2))).T
            rows = np.column_stack([crowd.ids, x, y, crowd.radius, crowd.mass, vx, vy])
            rows = np.delete(rows, 7 if step < 4 else 20, axis=0)
            if step == 5:
                rows = rows[::-1]
            write_frame(file, "ATOMS", step, NAMES, list(rows.T))
    return path, heap.walls


def job(film, **arguments):
    path, walls = film
    setting = Setting(
        walls=walls,
        wall_names=tuple(f"wall{number}" for number in range(len(walls))),
        drive=make("arch", 30).drive,
        contact_tolerance=1e-3,
        left_velocity=arguments.pop("left", "dump"),
    )
    return DumpToSolve(path=path, setting=setting, indeterminacy="none", **arguments)


@pytest.mark.parametrize("left", ["dump", "desired"])
def test_each_frame_is_answered_as_alone(film, left):
    dump = job(film, left=left, tolerance=1e-10)
    assert dump.in_batches
    (found,) = dump.solve(range(FRAMES))
    lines = [line.split(",") for line in found.rows.decode().splitlines()]
    trajectory, at = open_bodies(dump.path).trajectory, 0
    assert found.summary.frames == FRAMES
    for frame in trajectory:
        snapshot = snapshot_of(frame, dump.path)
        alone = percussions_of(dump.setting, snapshot, tolerance=1e-10)
        assert alone.solution.canonical
        cells = alone.columns(step=frame.data["step"])
        rows = [
            dict(zip(found.columns, line, strict=True))
            for line in lines[at : at + len(alone.contacts)]
        ]
        at += len(rows)
        for name in ("step", "first", "second", "is_wall", "nx", "ny", "gap_m"):
            assert [float(row[name]) for row in rows] == list(cells[name]), name
        for name in ("wall", "status"):
            assert [row[name] for row in rows] == list(cells[name]), name
        largest = alone.solution.reaction.max()
        for name in ("reaction_Ns", "impulse_x_Ns", "impulse_y_Ns"):
            of_rows = np.array([float(row[name]) for row in rows])
            assert np.abs(of_rows - cells[name]).max() <= 1e-9 * largest
        assert max(float(row["residual"]) for row in rows) <= 1e-10
    assert at == len(lines) == found.summary.contacts > 50 * FRAMES


def test_threads_write_the_same_bytes(film, tmp_path, monkeypatch):
    monkeypatch.setattr("analysis.percussions.solve_dump.BLOCK", film[0].stat().st_size // 5)
    dump, full = job(film), []
    assert len(dump.blocks(range(FRAMES))) == 6
    for workers in (1, 2, 3):
        full.append(solve_dump(dump, tmp_path / f"{workers}.csv", workers=workers))
    texts = {(tmp_path / f"{workers}.csv").read_bytes() for workers in (1, 2, 3)}
    assert len(texts) == 1
    assert full[0] == full[1] == full[2]


def test_frames_that_are_not_solved_together_are_solved_alone(film):
    dump = job(film, tolerance=2e-16 * 50)
    solved = dump.solve(range(FRAMES))
    sentences = [line for some in solved for line in some.summary.unsolved]
    assert sum(some.summary.frames for some in solved) == FRAMES
    assert sentences == sorted(sentences, key=lambda line: int(line.split("step ")[1].split(":")[0]))


@pytest.mark.parametrize(
    ("row", "what"),
    [
        ("2 0.1 0 0.25 75 0 0", "step 40: disk 1 and disk 2 overlap by 1.6 of a radius"),
        ("2 0 0 0.25 75 0 0", "step 40: position: disk 1 and disk 2 coincide"),
        ("2 0.5 0 1e-9 75 0 0", "step 40: contact_tolerance: 1e-06 m. The smallest radius is 1e-09 m"),
        ("2 0.5 0 -1 75 0 0", "step 40: radius: -1 in row 1. A disk needs a positive radius"),
        ("2 0.5 0 0.25 75 1e120 0", "step 40: velocity: 1e\\+120 in row 1. At most 1e\\+100"),
        ("1 0.5 0 0.25 75 0 0", "id 1 occurs twice at step 40"),
        ("2 0.5 nan 0.25 75 0 0", "line 22: y: nan m: a finite place is needed"),
        ("2.5 0.5 0 0.25 75 0 0", "id: 2.5 where a whole number"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_as_of_one_frame(tmp_path, row, what):
    path = tmp_path / "some.dump"
    with path.open("w") as file:
        for step in (30, 40):
            write_frame(file, "ATOMS", step, NAMES, [[1, 2], [0, 0.5], [0, 0], [0.25] * 2, [75] * 2,
                                                     [2, 0], [0, 0]])  # fmt: skip
    path.write_text(path.read_text().replace("\n2 0.5 0 0.25 75 0 0", "\n@", 1)
                    .replace("\n2 0.5 0 0.25 75 0 0", f"\n{row}").replace("@", "2 0.5 0 0.25 75 0 0"))  # fmt: skip
    dump = DumpToSolve(path=path, setting=Setting(left_velocity="dump"), indeterminacy="none")
    with pytest.raises(DumpError, match=what):
        dump.solve(range(2))
