"""Trials of pushed rows: what a file may look like, and the shipped one."""

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.push.hindcast import NEVER_S, ONSET, hindcast, onsets
from analysis.push.page import summary, verdicts, write_hindcast
from analysis.push.trial import TrialError, read_trial
from analysis.support.files import or_shipped, shipped
from analysis.support.reading import UnreadableError

EXCERPT = shipped("scenes") / "push_excerpt.csv"
SPEED, GAP, RATE = 1.0, 0.2, 25


def table(people=2, frames=80, along="y", sign=-1.0, gap=GAP):
    """Heads in a row: the first walks at 1 m/s from 0.2 s on, the others stand."""
    time = np.arange(frames) / RATE
    rows = []
    for person in range(people):
        place = person * (0.254 + gap) + (SPEED * np.maximum(time - 0.2, 0) if not person else 0.0)
        for frame, (t, x) in enumerate(zip(time, np.broadcast_to(place, time.shape), strict=True)):
            rows.append((person, frame, t, sign * x, 0.0, 80.0, "male"))
    names = ["id", "frame", "time", along, "x" if along == "y" else "y", "Weight_kg", "Gender"]
    return pd.DataFrame(rows, columns=names)


def written(folder, content, **given):
    path = folder / "heads.csv"
    content.to_csv(path, index=False)
    return read_trial(path, **given)


@pytest.fixture
def trial(tmp_path):
    return written(tmp_path, table())


def test_what_is_read(trial):
    assert trial.people == ("0", "1")
    np.testing.assert_allclose(trial.torso_gap, GAP, atol=1e-3)
    np.testing.assert_allclose(trial.depth, 0.254)
    # central differences see the start a frame early, 0.15 of 0.5 m/s into it; two frames are before
    assert trial.start_s == pytest.approx(2.3 / RATE)
    assert onsets(trial, trial.along).tolist() == pytest.approx([0.0, NEVER_S], abs=1e-12)


def test_order_gaps_and_columns_do_not_matter(tmp_path):
    """Shuffled rows and columns, an order of names, lost and empty heads, no masses."""
    whole = written(tmp_path, table(people=3))
    content = table(people=3)
    content["MoCap_ID"] = content.id.map({0: "A", 1: "B", 2: "C"})
    content["id"] = content.id.map({0: 7, 1: 3, 2: 5})
    content["Order_of_Participants_MoCap_ID"] = "Bag, A, B, C"
    content.loc[(content.id == 3) & content.frame.between(20, 22), "x"] = np.nan
    content = content[~((content.id == 5) & (content.frame == 30))]
    content = content.drop(columns="Weight_kg").sample(frac=1.0, random_state=1)
    mixed = written(tmp_path, content[sorted(content.columns)])
    np.testing.assert_allclose(mixed.along, whole.along, atol=1e-12)
    assert mixed.people == ("A", "B", "C")
    assert mixed.mass.tolist() == [85.5] * 3
    assert len(mixed.notes) == 5
    content = content.drop(columns="Order_of_Participants_MoCap_ID").drop(columns="MoCap_ID")
    assert written(tmp_path, content).people == ("7", "3", "5")


def test_a_push_that_began_before_the_file_is_said(tmp_path):
    content = table()
    (note,) = written(tmp_path, content[content.time > 0.5]).notes
    assert "moving in the first frame already: person 0; the push began before the file" in note


def as_text(tmp_path, text):
    path = tmp_path / "trial.csv"
    path.write_text(text)
    return read_trial(path)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_comments_and_separators_do_not_matter(tmp_path, mark):
    whole = written(tmp_path, table())
    text = table().to_csv(index=False, sep=mark)
    for changed_text in (
        f"# filmed in a hall\n# 25 fps\n{text}# the end\n",
        "#" + text,
        "\ufeff" + text.replace("\n", "\r\n"),
        text.replace("\n", "\n\n", 9),
    ):
        np.testing.assert_array_equal(as_text(tmp_path, changed_text).along, whole.along)
    lines = text.splitlines()
    bad = mark.join("here" if k == 3 else c for k, c in enumerate(lines[2].split(mark)))
    broken = "\n".join(["# a", "# b", *lines[:2], bad, *lines[3:]])
    with pytest.raises(TrialError, match=r"trial\.csv, line 5: y: 'here' is not a number"):
        as_text(tmp_path, broken)
    with pytest.raises(TrialError, match=r"no table: |not a number"):
        as_text(tmp_path, text[:-30] + '"')


@pytest.mark.parametrize("rate", [25, 50, 100])
def test_noise_of_a_millimetre_is_no_onset_at_any_frame_rate(tmp_path, rate):
    content, random = table(), np.random.default_rng(3)
    expected = onsets(written(tmp_path, content), written(tmp_path, content).along)
    rows = []
    for one, seen in content.groupby("id"):
        time = np.arange(seen.time.min(), seen.time.max(), 1 / rate)
        place = {name: np.interp(time, seen.time, seen[name]) for name in ("x", "y")}
        rows.append(pd.DataFrame({"id": one, "time": time} | place))
    noisy = pd.concat(rows)
    noisy[["x", "y"]] += random.normal(0, 1e-3, (len(noisy), 2))
    trial = written(tmp_path, noisy)
    np.testing.assert_allclose(onsets(trial, trial.along), expected, atol=0.04)


def test_coarse_frames_and_an_order_against_the_push_are_said(tmp_path):
    content = table(people=3)
    content["MoCap_ID"] = content.id.map({0: "A", 1: "B", 2: "C"})
    content["Order_of_Participants_MoCap_ID"] = "Bag, C, B, A"
    with pytest.raises(TrialError, match="never goes forward"):
        written(tmp_path, content)
    coarse = written(tmp_path, table()[lambda t: t.frame % 3 == 0])
    assert "frames are 0.12 s apart: onsets are not known better than that" in coarse.notes


def test_who_is_seen_only_after_the_push_is_refused(tmp_path):
    late = table(people=3)
    late = late[~((late.id == 2) & (late.time < 0.4))]
    with pytest.raises(TrialError, match=r"person 2 is first seen at 0\.4 s, when person 0, the f"):
        written(tmp_path, late)
    early = table(people=3)
    early = early[~((early.id == 2) & (early.time < 0.12))]
    assert written(tmp_path, early).notes == ()


def changed(**columns):
    content = table()
    for name, value in columns.items():
        content[name] = value
    return content


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (table().drop(columns="time"), "no column time"),
        (table(people=1), "a row has at least two"),
        (changed(x="here"), "line 2: x: 'here' is not a number"),
        (pd.concat([table(), table()]), "is there twice"),
        (table(people=3).assign(x=lambda t: 1.0 * (t.id == 1)), "one behind the other"),
        (table(frames=5), "nobody is pushed"),
        (table(frames=20), "follow the push"),
        (table()[lambda t: ~((t.id == 1) & t.frame.between(20, 40))], "person 1 is missing from 0.76"),
        (changed(Weight_kg=-3.0), "Weight_kg: -3"),
        (changed(Weight_kg=1e-9), "Weight_kg: 1e-09; 5 to 500 kg"),
        (changed(Weight_kg=np.inf), "Weight_kg: inf; 5 to 500 kg"),
        (changed(Weight_kg="heavy"), "Weight_kg: heavy; 5 to 500 kg"),
        (changed(y=table().y * 100), "x and y in m"),
        (changed(time=table().frame.map(lambda f: f / 25 if f < 30 else 1.2 + 1e-9 * f)), "evenly"),
    ],
)  # fmt: skip
def test_what_is_refused(tmp_path, content, words):
    with pytest.raises(TrialError, match=words):
        written(tmp_path, content)


def test_frames_at_odd_times_do_not_multiply(tmp_path):
    """The heads of each person at times of their own, and 10 kHz: no more than 100 frames a second."""
    content = table()
    odd = written(tmp_path, content.assign(time=content.time + 0.013 * content.id))
    assert len(odd.time) <= len(written(tmp_path, content).time)
    fine = [
        pd.DataFrame({"id": one, "time": np.arange(0, 3.1, 1e-4)}).assign(
            y=lambda t, seen=seen: np.interp(t.time, seen.time, seen.y), x=0.0
        )
        for one, seen in content.groupby("id")
    ]
    assert np.diff(written(tmp_path, pd.concat(fine)).time) == pytest.approx(0.01)


def test_a_row_with_more_cells_than_the_head_is_refused(tmp_path):
    """pandas would drop the cells, and say so in a warning of its own."""
    content = table().to_csv(index=False).replace("id,frame", "id")
    (tmp_path / "heads.csv").write_text(content)
    with pytest.raises(TrialError, match=r"heads\.csv: no table: Length of header"):
        read_trial(tmp_path / "heads.csv")


def test_a_wall_behind_and_a_missing_file_are_refused(tmp_path):
    for wall in (0.0, np.nan, -np.inf):
        with pytest.raises(TrialError, match="below that is needed"):
            written(tmp_path, table(), wall_m=wall)
    with pytest.raises(UnreadableError, match="no such file"):
        read_trial(tmp_path / "none.csv")


def test_the_shipped_trial(tmp_path):
    """What is known of it: its onsets; with chests that meet stiff people come near and soft ones
    are excluded; with any posture none is."""
    trial = read_trial(EXCERPT)
    np.testing.assert_allclose(onsets(trial, trial.along), [0, 0.17, 0.26, 0.38, 0.61], atol=0.02)
    chests = hindcast(trial, (0.0,), (2e3, 1.2e5), 2)
    assert chests.together() == ["120000", "rigid"]
    assert np.median(chests.models["2000"].scores[ONSET]) > 0.3
    found = hindcast(trial, (0.0, 1.0), (2e3, 1.2e5), 2)
    assert set(found.together()) == {"2000", "120000", "rigid"}
    assert "not validated" in verdicts(found)[-1]
    *files, page = write_hindcast(found, tmp_path, "percussions push")
    assert "not validated" in page.read_text()
    rows = list(csv.DictReader(files[0].read_text().splitlines()))
    assert len(rows) == 6 * len(found.inputs.tau)
    assert len(summary(found)) == 6


def test_the_shipped_trial_is_found_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert or_shipped(Path("scenes/push_excerpt.csv")) == EXCERPT
    assert not or_shipped(Path("scenes/none.csv")).exists()
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "push_excerpt.csv").write_text("mine")
    assert or_shipped(Path("scenes/push_excerpt.csv")).read_text() == "mine"


def test_a_column_of_another_name_is_not_taken_for_one(tmp_path):
    with pytest.raises(TrialError, match="line 1: two columns are called x"):
        as_text(tmp_path, table().to_csv(index=False).replace("frame", "x", 1))
