"""What a run folder must be to be compared, and like with like: law, instant, impulses."""

import json
import re
import shutil

import numpy as np
import pytest

from analysis import engines
from analysis.compare.comparison import compare_run
from analysis.compare.study import remarks
from analysis.dumps import DumpError
from analysis.engines.record import EngineError, RunRecord
from analysis.engines.run import finished_run, simulate
from analysis.scene.scene import SceneError
from analysis.scene.shipped_scenes import make
from nscd import ContactLaw

if engines.engine("lammps").find() is None:
    pytest.skip("LAMMPS is not installed", allow_module_level=True)


def ran(scene, folder):
    """The folder of a finished run of the scene."""
    simulate(scene, "lammps", folder)
    return folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Folders of an impact with restitution 0.5 and of a crowd before a door."""
    root = tmp_path_factory.mktemp("runs")
    pair = make("pair").with_contact(restitution=0.5)
    pair = pair.with_run(duration_s=0.05, frames=1000, time_step_s=5e-6)
    jam = make("jam", 20).with_run(duration_s=2.0, frames=8)
    return {"pair": ran(pair, root / "pair"), "jam": ran(jam, root / "jam")}


@pytest.fixture
def copy_of(runs, tmp_path):
    """A copy of one of the folders, to be damaged."""

    def copy(name):
        return shutil.copytree(runs[name], tmp_path / name)

    return copy


def test_an_impact_has_the_restitution_of_its_scene(runs):
    """p = m_eff (1 + e) U, in the penalty run and in the percussions alike."""
    found = compare_run(runs["pair"])
    expected = 37.5 * 1.5 * 2
    assert found.law == ContactLaw(restitution=0.5)
    assert np.hypot(*found.match.rigid[0]) == pytest.approx(expected, rel=1e-9)
    assert np.hypot(*found.match.penalty[0]) == pytest.approx(expected, rel=5e-3)
    assert [*remarks(found)] == []
    other = compare_run(runs["pair"], law=ContactLaw())
    assert np.hypot(*other.match.rigid[0]) == pytest.approx(75, rel=1e-9)
    assert [*remarks(other)] == [
        "the engine's contacts have restitution 0.5, the percussions 0: the difference of the laws "
        "is in every number"
    ]


def test_a_pressed_crowd_has_no_restitution(runs):
    """Its restitution is 0.1, its forces are those of a crowd at rest."""
    assert compare_run(runs["jam"]).law == ContactLaw()


def test_friction_is_a_sentence(tmp_path):
    scene = make("jam", 12).with_contact(friction=0.3).with_run(duration_s=0.5, frames=2)
    folder = ran(scene, tmp_path / "rough")
    found = compare_run(folder)
    known, k = int(found.match.determined.sum()), len(found.match.determined)
    assert found.solution.friction.coefficient.tolist() == [0.3] * len(found.solution.reaction)
    assert [*remarks(found)] == [
        "both models have friction 0.3: the balance leaves forces open where contacts stick, "
        f"{known} of {k} are determined"
    ]
    assert [*remarks(compare_run(folder, law=ContactLaw()))] == [
        "the engine's contacts have friction 0.3, the percussions 0: the difference of the laws is "
        "in every number"
    ]


def test_few_frames_are_said_and_fewer_refused(tmp_path):
    scene = make("pair").with_contact(restitution=0.5)
    found = compare_run(ran(scene.with_run(duration_s=0.05, frames=16), tmp_path / "few"))
    assert 0.01 < found.balance.closure_error < 0.05
    (message,) = remarks(found)
    needed = int(re.search(r"About (\d+) frames", message)[1])
    better = ran(scene.with_run(duration_s=0.05, frames=needed), tmp_path / "enough")
    assert compare_run(better).balance.closure_error < 0.01
    assert [*remarks(compare_run(better))] == []
    with pytest.raises(DumpError, match=r"by \d+%, so they are not compared\. About \d+ frames"):
        compare_run(ran(scene.with_run(duration_s=0.05, frames=6), tmp_path / "fewest"))


@pytest.mark.parametrize("time", [np.nan, -1.0, 1e9, np.inf])
def test_instants_beyond_the_run(runs, time):
    with pytest.raises(DumpError, match=r"time: .* s\. The run is from 0 to 2 s"):
        compare_run(runs["jam"], time)


def test_an_impact_has_no_instant(runs):
    with pytest.raises(DumpError, match="An impact is compared over its whole run"):
        compare_run(runs["pair"], 0.01)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("time_step_s", 1.0), ("time_step_s", float("nan")), ("time_step_s", -1e-5), ("steps", 3),
        ("steps", True), ("disks", 7), ("disks", "20"), ("frame_interval", 1),
        ("restitution_least", 0.7), ("scene", "other"), ("scene", "../evil"),
        ("scene_digest", "0"), ("dump_digests", {}), ("exit_state", "prepared"),
    ],
)  # fmt: skip
def test_a_record_of_another_run(copy_of, key, value):
    folder = copy_of("jam")
    record = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps(record | {key: value}))
    with pytest.raises(EngineError, match=r"run.json"):
        compare_run(folder)


@pytest.mark.parametrize("name", ["bodies.dump", "contacts.dump", "scene.data", "scene.toml"])
@pytest.mark.parametrize("name_of_run", ["pair", "jam"])
def test_a_file_that_is_not_of_the_run(copy_of, name_of_run, name):
    """A digit, a file of another run, none at all: all the same."""
    folder = copy_of(name_of_run)
    path = folder / name
    text = path.read_text()
    digit = text.rindex("5")
    path.write_text(text[:digit] + "7" + text[digit + 1 :])
    named = r"scene\." if name.startswith("scene") else name
    with pytest.raises((EngineError, SceneError), match=named):
        compare_run(folder)
    path.unlink()
    with pytest.raises((EngineError, SceneError), match=rf"{name}: no such file|No such file"):
        compare_run(folder)
    path.write_text(text)
    compare_run(folder)


def test_a_damaged_run_is_run_again(copy_of):
    folder = copy_of("pair")
    scene = make("pair").with_contact(restitution=0.5)
    scene = scene.with_run(duration_s=0.05, frames=1000, time_step_s=5e-6)
    assert finished_run(scene, "lammps", folder)
    (folder / "contacts.dump").write_text("")
    assert finished_run(scene, "lammps", folder) is None


def test_contacts_of_nobody(copy_of):
    """An engine that names disks or walls which the scene has not."""
    folder = copy_of("jam")
    path = folder / "contacts.dump"
    text = path.read_text()
    row = re.search(r"^\d+ \d+ 0 .*\n(?!.*^ITEM)", text.rpartition("ITEM: ENTRIES")[2], re.M)[0]
    words = row.split()
    for changed, message in [
        (["1", "999", *words[2:]], "a contact of 1 and 999, which the scene has not"),
        ([words[0], "77", "1", *words[3:]], "and wall 77, which the scene has not"),
    ]:
        path.write_text(text.replace(row, " ".join(changed) + "\n"))
        RunRecord.read(folder).finished(folder).write(folder)
        with pytest.raises(DumpError, match=rf"contacts.dump, line \d+: .*{message}"):
            compare_run(folder)


def test_elastic_contacts_have_percussions_too(tmp_path):
    scene = make("pair").with_contact(restitution=1.0)
    folder = ran(scene.with_run(duration_s=0.05, frames=1000, time_step_s=5e-6), tmp_path / "e1")
    found = compare_run(folder)
    assert np.hypot(*found.match.rigid[0]) == pytest.approx(150, rel=1e-3)
