"""Dumps: what is written is what is read; damaged, reordered and foreign ones."""

import numpy as np
import pytest

from analysis.dumps.reader import DumpError, index_contacts, open_bodies, read_contacts, snapshot_of

COLUMNS = "id type x y z radius mass vx vy vz omegaz fx fy"


def frame(step, rows, columns=COLUMNS, kind="ATOMS"):
    body = "".join(" ".join(str(value) for value in row) + "\n" for row in rows)
    return (
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{len(rows)}\nITEM: BOX BOUNDS ff ff pp\n"
        f"-10 10\n-10 10\n-0.5 0.5\nITEM: {kind} {columns}\n{body}"
    )


def rows(n=4, seed=0):
    rng = np.random.default_rng(seed)
    return [
        [
            i + 1,
            1,
            *rng.normal(size=2).tolist(),
            0,
            0.2,
            75.0 + i,
            *rng.normal(size=2).tolist(),
            0,
            0.5,
            1,
            2,
        ]
        for i in range(n)
    ]


def test_float64_and_id_order(tmp_path):
    path = tmp_path / "bodies.dump"
    table = rows()
    path.write_text(frame(0, table) + frame(10, table[::-1]))
    universe = open_bodies(path, 1e-3)
    assert universe.trajectory.n_frames == 2
    for ts, time in zip(universe.trajectory, (0.0, 0.01), strict=True):
        snapshot = snapshot_of(ts)
        assert snapshot.time == pytest.approx(time)
        np.testing.assert_array_equal(snapshot.ids, [1, 2, 3, 4])
        np.testing.assert_array_equal(snapshot.position, [row[2:4] for row in table])
        np.testing.assert_array_equal(snapshot.mass, [75, 76, 77, 78])


def test_foreign_dump_with_the_least_columns(tmp_path):
    path = tmp_path / "foreign.lammpstrj"
    path.write_text(
        frame(
            5, [[2, 0.5, 0.0, 0.5, 1000.0], [1, 0.0, 0.0, 0.5, 1000.0]], "id x y diameter density"
        )
    )
    snapshot = snapshot_of(open_bodies(path).trajectory.ts)
    np.testing.assert_allclose(snapshot.mass, 1000 * 4 / 3 * np.pi * 0.25**3)
    np.testing.assert_array_equal(snapshot.radius, 0.25)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "empty"),
        ("not a dump\n" * 12, "line 1: not the head of a frame"),
        (frame(0, rows())[:-60], "truncated"),
        (frame(0, rows()) + frame(10, rows())[:70], "truncated"),
        (frame(10, rows()) + frame(10, rows()), "step 10 follows step 10"),
        (frame(0, rows()) + frame(1, rows(3)), "3 disks at step 1"),
        (
            frame(
                0,
                [row[:-1] for row in rows()],
                COLUMNS[:-3].replace(" mass", "").replace(" radius", ""),
            ),
            "truncated",
        ),
        (frame(0, [[1, 0.0, 0.0]], "id x y"), "missing columns: radius, mass"),
        (frame(0, [[1, 0.0, "abc", 0.1, 1.0]], "id x y radius mass"), "row 1"),
        (frame(0, [[1, 0.0, 0.0, 0.1, 1.0]] * 2, "id x y radius mass"), "an id occurs twice"),
    ],
)
def test_damaged(tmp_path, content, message):
    path = tmp_path / "bad.dump"
    path.write_text(content)
    with pytest.raises(DumpError, match=message) as error:
        open_bodies(path)
    assert "bad.dump" in str(error.value)


def test_zero_radius_and_nan_are_named_with_their_step(tmp_path):
    path = tmp_path / "bad.dump"
    path.write_text(frame(7, [[1, 0.0, 0.0, 0.0, 1.0]], "id x y radius mass"))
    with pytest.raises(DumpError, match=r"step 7: radius: 0 in row 0"):
        snapshot_of(open_bodies(path).trajectory.ts, path)
    path.write_text(frame(7, [[1, "nan", 0.0, 0.1, 1.0]], "id x y radius mass"))
    with pytest.raises(DumpError, match=r"step 7: position: not a finite number"):
        snapshot_of(open_bodies(path).trajectory.ts, path)


def test_contacts(tmp_path):
    path = tmp_path / "contacts.dump"
    names = "first second is_wall nx ny overlap fx fy"
    table = [[1, 2, 0, 1.0, 0.0, 1e-3, 1000.0, 0.0], [1, 3, 1, 0.0, -1.0, 2e-3, 0.0, -2000.0]]
    path.write_text(frame(0, [], names, "ENTRIES") + frame(5, table, names, "ENTRIES"))
    empty, full = read_contacts(path)
    assert len(empty) == 0
    np.testing.assert_array_equal(full.is_wall, [False, True])
    np.testing.assert_array_equal(full.force, [[1000, 0], [0, -2000]])
    path.write_text(frame(0, [[1, 2]], "first second", "ENTRIES"))
    with pytest.raises(DumpError, match="missing columns: is_wall"):
        index_contacts(path)
