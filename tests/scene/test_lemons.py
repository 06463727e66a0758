"""Crowds of LEMONS: five disks a person, of which one is made only where that is asked for."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from analysis.scene import read_scene
from analysis.scene.real.lemons import read_lemons
from tests.crowds import room_text

ROOT = Path(__file__).resolve().parents[2]
EVACUATION = ROOT.parent / "shared/data/lemons_evacuation"
ROOM = room_text(kind="impact")
DYNAMICS = """<Agents>
<Agent Id="0"><Kinematics Position="1.0,1.0" Velocity="0.5,0.0" Theta="0.0" Omega="0.2"/>
<Dynamics Fp="100.0,0.0" Mp="0.0"/></Agent>
<Agent Id="4"><Kinematics Position="1.4,1.0" Velocity="-0.5,0.0" Theta="1.0" Omega="0.0"/></Agent>
</Agents>
"""
BODIES = """<Agents>
<Agent Type="pedestrian" Id="0" Mass="80.0">
<Shape Type="disk" Radius="0.1" Position="0.0,0.15"/>
<Shape Type="disk" Radius="0.1" Position="0.0,-0.15"/>
</Agent>
<Agent Type="pedestrian" Id="4" Mass="70.0">
<Shape Type="disk" Radius="0.2" Position="0.0,0.0"/></Agent>
</Agents>
"""
GEOMETRY = """<Geometry><Wall Id="0">
<Corner Coordinates="0.0,0.0"/><Corner Coordinates="3.0,0.0"/>
<Corner Coordinates="3.0,2.0"/><Corner Coordinates="0.0,2.0"/><Corner Coordinates="0.0,0.0"/>
</Wall></Geometry>
"""
FILES = {"AgentDynamics.xml": DYNAMICS, "Agents.xml": BODIES, "Geometry.xml": GEOMETRY}
WORDS = ("import", "AgentDynamics.xml", "--room", "room.toml", "--name", "mine")


@pytest.fixture
def folder(tmp_path):
    for name, text in {**FILES, "room.toml": ROOM}.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_person_of_several_disks_is_refused_by_name(refused, folder):
    assert refused(*WORDS) == (
        "percussions: Agents.xml: agent 0: 2 disks; here a person is one: --one-disk takes one of "
        "the same area"
    )


def test_one_disk_each_where_it_is_asked_for(percussions, folder):
    made = percussions(*WORDS, "--one-disk")
    assert made.returncode == 0, made.stderr
    assert "are not taken" in made.stdout
    scene = read_scene(folder / "mine.toml")
    disks = scene.snapshot
    assert disks.ids.tolist() == [1, 5]
    # two disks that do not overlap: twice the area of one
    assert disks.radius == pytest.approx([0.1 * np.sqrt(2), 0.2], abs=2e-6)
    assert disks.mass.tolist() == [80.0, 70.0]
    assert disks.velocity.tolist() == [[0.5, 0.0], [-0.5, 0.0]]
    assert disks.spin.tolist() == [0.2, 0.0]
    assert disks.position == pytest.approx(np.array([[1.0, 1.0], [1.4, 1.0]]))
    assert [wall.start_m for wall in scene.walls] == [(0, 0), (3, 0), (3, 2), (0, 2)]
    assert percussions("run", "mine.toml", "--engine", "rigid").returncode == 0


def covered(shapes, step=5e-4):
    """The area (m²) that disks cover together, counted on a grid."""
    x, y = np.meshgrid(*[np.arange(-0.4, 0.4, step)] * 2)
    inside = np.zeros_like(x, dtype=bool)
    for (px, py), radius in shapes:
        inside |= (x - px) ** 2 + (y - py) ** 2 <= radius**2
    return inside.sum() * step**2


@pytest.mark.skipif(not EVACUATION.exists(), reason="LEMONS' own example is not here")
def test_the_evacuation_of_lemons(percussions, tmp_path):
    crowd = read_lemons(EVACUATION / "AgentDynamics.xml", one_disk=True)
    assert (len(crowd.snapshot), len(crowd.walls), crowd.shapes) == (8, 12, 5)
    first = [((-0.017, 0.164), 0.098), ((0.010, 0.072), 0.134), ((0.015, 0.0), 0.141)]
    first += [((x, -y), radius) for (x, y), radius in first[:2]]
    assert np.pi * crowd.snapshot.radius[0] ** 2 == pytest.approx(covered(first), rel=2e-3)
    assert crowd.snapshot.mass[3] == 115.67
    shutil.copytree(EVACUATION, tmp_path / "evacuation")
    (tmp_path / "room.toml").write_text(ROOM)
    words = ("evacuation/AgentDynamics.xml", "--room", "room.toml", "--name", "mine", "--one-disk")
    made = percussions("import", *words)
    assert made.returncode == 0, made.stderr
    assert "each with 5 disks there" in made.stdout


BAD = {
    "xml": ("AgentDynamics.xml", "<Agents>", "<Agents", "AgentDynamics.xml: no XML: "),
    "missing": ("Agents.xml", 'Id="4"', 'Id="5"', "AgentDynamics.xml: agent 4 is not both here and"),
    "twice": ("Agents.xml", 'Id="4"', 'Id="0"', "Agents.xml: agent '0': one whole number each"),
    "nan": ("AgentDynamics.xml", "0.5,0.0", "nan,0", "AgentDynamics.xml: agent 0: Velocity: 'nan,0'"),
    "one": ("AgentDynamics.xml", "1.4,1.0", "1.4", "AgentDynamics.xml: agent 4: Position: '1.4'; 2 fin"),
    "radius": ("Agents.xml", '"0.2"', '"-1"', "Agents.xml: agent 4: Radius: -1; a number above 0"),
    "square": ("Agents.xml", '"disk"', '"box"', "Agents.xml: agent 0: Shape: 'box'; only disks"),
    "heavy": ("Agents.xml", '"70.0"', '"1e20"', "Agents.xml: agent 4: Mass: 1e+20 kg; between 0 and 1000"),
    "mass": ("Agents.xml", '"70.0"', '"0"', "Agents.xml: agent 4: Mass: 0 kg; between 0 and 1000"),
    "history": ("AgentDynamics.xml", "Agents>", "Interactions>", "AgentDynamics.xml: <Interactions> whe"),
    "bomb": ("Agents.xml", "<Agents>", "<!DOCTYPE x><Agents>", "Agents.xml: a document type is not"),
    "outside": ("AgentDynamics.xml", "1.4,1.0", "9,9", "AgentDynamics.xml: disk 5 at (9, 9) m is"),
    "one_point": ("AgentDynamics.xml", "1.4,1.0", "1.0,1.0", "AgentDynamics.xml: position: disk 1 and disk 5 coi"),
    "corner": ("Geometry.xml", "3.0,0.0", "3.0", "Geometry.xml: wall 0: Coordinates: '3.0'; 2 finite"),
}  # fmt: skip


@pytest.mark.parametrize("bad", BAD)
def test_bad_input_is_one_line(refused, folder, bad):
    name, old, new, says = BAD[bad]
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))
    assert refused(*WORDS, "--one-disk").startswith(f"percussions: {says}")


def test_options_of_trajectories_and_missing_files(refused, folder):
    options = {"frame": 3, "people": "ANSUR II", "radius": 0.2, "mass": 75, "radius-spread": 0.1}
    options |= {"seed": 1, "unit": "cm", "frame-rate": 25, "window": 0.4, "others": 4, "apart": 1}
    for name, value in options.items():
        assert refused(*WORDS, "--one-disk", f"--{name}", value) == (
            f"percussions: --{name}: only of a trajectory; LEMONS' files say it themselves"
        )
    said = refused("import", "heads.txt", "--room", "room.toml")
    assert said.startswith("percussions: --frame: of a trajectory it is needed")
    (folder / "Geometry.xml").unlink()
    assert refused(*WORDS, "--one-disk") == "percussions: Geometry.xml: no such file"
