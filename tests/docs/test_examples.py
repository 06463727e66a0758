"""The examples run as they stand, alone in a folder, and what they print is right."""

import contextlib
import io
import json
import re
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from analysis.scene.scene import read_scene

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LINES = 40


@pytest.fixture
def example(tmp_path, monkeypatch):
    """Run an example in an empty folder; returns its names."""
    monkeypatch.chdir(tmp_path)

    def run(name, form="py"):
        file = EXAMPLES / f"{name}.{form}"
        found = _cell_by_cell(file) if form == "ipynb" else runpy.run_path(str(file))
        plt.close("all")
        return found

    return run


def _cell_by_cell(file):
    """Run the cells of a notebook; what they print is what it shows."""
    names = {}
    for cell in json.loads(file.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            shown = ["".join(out["text"]) for out in cell["outputs"] if "text" in out]
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile("".join(cell["source"]), str(file), "exec"), names)
            assert printed.getvalue() == "".join(shown)
    return names


def test_my_room(example):
    """At most all of the push arrives at the walls before the door and behind it; it is some."""
    found = example("my_room")
    push = 60 * 100.0
    assert 0.0 < found["wall_load"] < 2 * push
    assert found["last"].solution.status == "solved"
    assert Path("my_room.png").stat().st_size > 1000


@pytest.mark.parametrize("form", ["py", "ipynb"])
def test_my_trajectory(example, form):
    """The shipped scene is the same crowd."""
    found = example("my_trajectory", form)
    here = found["crowd"].scene.snapshot.position
    np.testing.assert_array_equal(here, read_scene("gate").snapshot.position)
    assert found["load"][found["maximum"]] == found["load"].max() > 0
    assert Path("my_trajectory.png").exists() == (form == "py")


@pytest.mark.parametrize("form", ["py", "ipynb"])
def test_my_dump(example, form):
    """Each contact passes on the momentum of those behind it: 75 kg · 1 m/s a person."""
    found = example("my_dump", form)
    wanted = [[75, 0], [150, 0], [75, 0]]
    np.testing.assert_allclose(found["percussions"].impulse, wanted, atol=1e-9)


def test_first(example):
    """The wall takes the momentum that the people lose."""
    found = example("first", "ipynb")
    lost = (75.0 * (found["people"].velocity - found["solution"].right_velocity)).sum(axis=0)
    np.testing.assert_allclose(found["solution"].impulse[found["contacts"].is_wall].sum(axis=0), lost, atol=1e-9)


def test_how_stiff(example):
    """Less error asks for stiffer springs, which cost more."""
    found = [one for one in example("how_stiff")["found"].values() if one is not None]
    assert len(found) >= 2
    assert np.all(np.diff([one.stiffness_N_per_m for one in found]) >= 0)
    assert np.all(np.diff([one.cpu_seconds for one in found]) >= 0)
    assert np.all(np.diff([one.promised_error for one in found]) < 0)


@pytest.mark.parametrize("form", ["py", "ipynb"])
def test_determined(example, form):
    """A ring and its middle have one self-stress, which all contacts take part in: none is
    determined, and with 75 N·s a person each spoke may carry anything from 0 to 75."""
    found = example("determined", form)
    assert (found["known"].rank, found["known"].determined.any()) == (11, False)
    assert found["ends"] == pytest.approx([0.0, 75.0])


def test_pillar(example):
    """The gradient foretells what 2 mm do, to second order."""
    found = example("pillar")
    best, alone = found["sums"][found["best"]], found["alone"]
    assert found["foretold"] < best < alone
    assert found["solved"] - best == pytest.approx(found["foretold"] - best, rel=0.02)


@pytest.mark.long
def test_film(example):
    """Nobody touches at first; then they press."""
    found = example("film")
    assert found["largest"][0] == 0 < found["largest"][-1]
    assert len(found["largest"]) == 11
    assert Path("film.gif").read_bytes().startswith(b"GIF")


def test_my_threshold(example):
    found = example("my_threshold")
    assert found["above"] == (found["total"] > 0).sum() > 0
    assert (found["longest"] <= found["total"] + 1e-12).all()
    assert found["total"].max() <= 1.0 + 1e-9


def test_my_solver(example):
    """Two methods that share nothing but the problem meet."""
    first, last = example("my_solver")["errors"]
    assert last < 1e-10 < first


def test_exchange(example):
    found = example("exchange")
    assert found["found"].solution.status == "solved"
    assert found["difference"] < 1e-12


@pytest.mark.long
def test_pulse(example):
    """A straight row of hard people passes a push on at (d + g)/g of its speed; a crowd is slower,
    and the wider its gaps the slower. Bodies that touch later, because softer, are no faster."""
    found = example("pulse")
    row = found["front_speed"](found["standing"](0.1, 1, rows=1))
    assert row == pytest.approx(1.0 * 0.5 / 0.1, rel=0.05)
    hard, soft = ([min(found["speeds"][g, k]) for g in (0.05, 0.1, 0.2)] for k in ("hard", "soft"))
    assert np.all(np.diff(hard) < 0)
    assert np.all(np.array(hard) < 1 + 0.4 / np.array([0.05, 0.1, 0.2]))
    assert np.all(np.array(soft) < 1.02 * np.array(hard))


def test_sweep(example):
    """Larger bodies at the same heads press harder."""
    pytest.importorskip("distributed")
    forces = example("sweep")["forces"]
    assert max(forces[0.16]) < min(forces[0.18]) < max(forces[0.18]) < min(forces[0.20])


def test_each_is_short_has_a_question_and_a_test():
    names = [path.stem for path in sorted(EXAMPLES.glob("*.py"))]
    assert len(names) == 12
    text = Path(__file__).read_text(encoding="utf-8")
    page = (EXAMPLES.parent / "docs" / "examples.md").read_text(encoding="utf-8")
    for name in names:
        content = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
        question, _ = content.removeprefix('"""').split("\n", 1)
        assert question.endswith("?")
        assert len(content.splitlines()) <= LINES
        assert f"def test_{name}(example" in text
        assert f"[{name}.py](../examples/{name}.py)" in page
        assert question in page
        (row,) = (line for line in page.splitlines() if f"/{name}.py)" in line)
        assert f"](examples/{name}.png)" in row
        assert re.search(r"\d s \|$", row), "how long it takes"
