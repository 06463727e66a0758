"""Mats and vests: a constant load through a low pass, momentum per time, sums of sectors, and files
that are wrong."""

import csv

import numpy as np
import pytest

from analysis.cli.compare import exposure
from analysis.cli.options import OfFile
from analysis.engines.run import simulate
from analysis.studies.exposure.limits import LimitError
from analysis.studies.exposure.loads import read_exposure
from analysis.studies.exposure.sensors import Sensor, readings, write_sensors
from tests.exposure.test_exposure import PEOPLE, PUSH, RADIUS, row

MAT = '[[sensors]]\nname = "mat"\nwall = "wall0"\nrate_Hz = 20.0\n'
VEST = '[[sensors]]\nname = "vest"\nperson = 1\nrate_Hz = 20.0\n'


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("row") / "run"
    simulate(row(), "rigid", folder)
    return folder


def of(**keys):
    return Sensor(name="mat", wall="wall0", **keys)


def read(folder, text):
    path = folder.parent / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with write_sensors(folder, path).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_constant_load_comes_through_the_low_pass_as_one_less_exp():
    """At readings between frames, too, and with a threshold."""
    end, tau = np.array([0.1, 0.2, 0.35, 0.5]), 1 / (2 * np.pi * 3.0)
    impulse = 700.0 * np.diff(end, prepend=0.0)[:, None]
    time, found = readings(impulse, end, of(rate_Hz=7.0, cutoff_Hz=3.0))
    assert time == pytest.approx([1 / 7, 2 / 7, 3 / 7])
    by_hand = 700.0 * (1 - np.exp(-time / tau))
    assert found[:, 0] == pytest.approx(by_hand, rel=1e-12)
    _, above = readings(impulse, end, of(rate_Hz=7.0, cutoff_Hz=3.0, threshold_N=690.0))
    assert above[:, 0] == pytest.approx(np.where(by_hand < 690.0, 0.0, by_hand))


@pytest.mark.parametrize("cutoff", [None, 2.0])
def test_the_mean_of_an_impulse_train_is_momentum_per_time(cutoff):
    """A blow of 30 N·s in every fifth window of 10 ms: 600 N, over whole periods of the steady part."""
    impulse, end = np.zeros((1000, 1)), 0.01 * np.arange(1, 1001)
    impulse[::5] = 30.0
    time, found = readings(impulse, end, of(rate_Hz=100.0, cutoff_Hz=cutoff))
    assert len(time) == 1000
    assert found[:, 0].max() > 630.0
    assert found[500:].mean() == pytest.approx(600.0, rel=1e-9)


def test_a_mat_reads_the_wall_and_the_sectors_of_a_vest_sum_to_the_forces_on_the_person(pressed):
    """By hand: the wall carries the push of all, on the half of it where the row stands; the first person
    is pressed with five pushes from the wall's side, and four from the other."""
    mats = read(pressed, f"{MAT}from_m = 0.3\nto_m = 0.5\nparts = 2\nheight_m = 0.5\n")
    # the row stands at 0.4 m, where the second part begins
    last = [float(line["force_N"]) for line in mats[-2:]]
    assert sum(last) == pytest.approx(PUSH * PEOPLE, rel=1e-6)
    assert sorted(last)[0] == 0.0
    line = mats[-2:][int(np.argmax(last))]
    assert float(line["line_load_N_per_m"]) == pytest.approx(max(last) / 0.1)
    assert float(line["pressure_Pa"]) == pytest.approx(max(last) / 0.1 / 0.5)
    vests = read(pressed, f"{VEST}arc_deg = [-90.0, 270.0]\nparts = 2\n")
    front, back = (float(line["force_N"]) for line in vests[-2:])
    assert [front, back] == pytest.approx([PUSH * PEOPLE, PUSH * (PEOPLE - 1)], rel=1e-6)
    assert float(vests[-1]["line_load_N_per_m"]) == pytest.approx(back / (np.pi * RADIUS))
    sums = read_exposure(pressed, 0.05).loads["contact_sum"][-1]
    for person, full in enumerate(sums, start=1):
        text = VEST.replace("person = 1", f"person = {person}\nparts = 8")
        sectors = read(pressed, text)[-8:]
        assert sum(float(line["force_N"]) for line in sectors) == pytest.approx(full, rel=1e-6)


def test_the_command_writes_the_readings(pressed, tmp_path, capsys):
    file = tmp_path / "mat.toml"
    file.write_text(MAT, encoding="utf-8")
    exposure(pressed, sensors=file, of_file=OfFile())
    assert f"{pressed / 'sensors.csv'}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MAT + "parts = 0\n", "sensors 'mat' parts: "),
        (MAT + "person = 1\n", "sensors 'mat': wall, of a mat, or person, of a vest, is needed"),
        (MAT + "arc_deg = [0.0, 90.0]\n", "sensors 'mat': arc_deg: not of a mat"),
        (VEST + "height_m = 1.0\n", "sensors 'vest': height_m: not of a vest"),
        (VEST + "arc_deg = [90.0, 0.0]\n", "sensors 'vest': arc_deg: from the smaller"),
        (VEST.replace("20.0", "-1.0"), "sensors 'vest' rate_Hz: "),
        (VEST.replace("person = 1", "person = 9"), "sensors 'vest' person: nobody has the id 9"),
        (MAT.replace("wall0", "front"), "sensors 'mat' wall: 'front'. There are: wall0"),
        (MAT + "to_m = 0.9\n", "sensors 'mat' from_m, to_m: 0 to 0.9 m of a wall of 0.8 m"),
        (MAT.replace("20.0", "1000.0"), "sensors 'mat' rate_Hz: 1000. The run has a frame every 0.05"),
        (MAT + MAT, "two sensors are called mat"),
        (MAT + "gain = 2.0\n", "sensors 'mat' gain: unknown key"),
    ],
)  # fmt: skip
def test_a_sensor_that_cannot_be_is_refused_by_its_name(pressed, text, message):
    with pytest.raises(LimitError) as refused:
        read(pressed, text)
    assert str(refused.value).startswith(f"{pressed.parent / 'mine.toml'}: {message}")
    assert "\n" not in str(refused.value)
