"""Trials of pushed rows: what a file may look like, and the shipped one. Pushed rows: collisions
in closed form, other engines, and trials with a known truth."""

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from analysis.studies.push.hindcast import NEVER_S, ONSET, Cases, baselines, hindcast, inputs_of

from analysis.studies.push.hindcast import most_force, most_impulse, odds, onsets, rigid, soft  # isort: skip
from analysis.studies.push.page import summary, verdicts, write_hindcast
from analysis.studies.push.trial import TrialError, read_trial
from analysis.support.files import or_shipped, shipped
from analysis.support.reading import UnreadableError
from tests.engines.at_hand import require
from tests.pages.browser import answers_first
from tests.push.oracles import by_lammps, case_of, made, row_of, stepped

EXCERPT = shipped("scenes") / "push_excerpt.csv"
SPEED, GAP, RATE = 1.0, 0.2, 25


def table(people=2, frames=80, along="y", sign=-1.0, gap=GAP):
    """Heads in a row: the first walks at 1 m/s from 0.2 s on, the others stand."""
    time = np.arange(frames) / RATE
    rows = []
    for person in range(people):
        anchor = person * (0.254 + gap) + (SPEED * np.maximum(time - 0.2, 0) if not person else 0.0)
        for frame, (t, x) in enumerate(zip(time, np.broadcast_to(anchor, time.shape), strict=True)):
            rows.append((person, frame, t, sign * x, 0.0, 80.0, "male"))
    names = ["id", "frame", "time", along, "x" if along == "y" else "y", "Weight_kg", "Gender"]
    return pd.DataFrame(rows, columns=names)


def written(folder, content, **arguments):
    path = folder / "heads.csv"
    content.to_csv(path, index=False)
    return read_trial(path, **arguments)


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
    complete = written(tmp_path, table(people=3))
    content = table(people=3)
    content["MoCap_ID"] = content.id.map({0: "A", 1: "B", 2: "C"})
    content["id"] = content.id.map({0: 7, 1: 3, 2: 5})
    content["Order_of_Participants_MoCap_ID"] = "Bag, A, B, C"
    content.loc[(content.id == 3) & content.frame.between(20, 22), "x"] = np.nan
    content = content[~((content.id == 5) & (content.frame == 30))]
    content = content.drop(columns="Weight_kg").sample(frac=1.0, random_state=1)
    mixed = written(tmp_path, content[sorted(content.columns)])
    np.testing.assert_allclose(mixed.along, complete.along, atol=1e-12)
    assert mixed.people == ("A", "B", "C")
    assert mixed.mass.tolist() == [85.5] * 3
    assert len(mixed.notes) == 5
    content = content.drop(columns="Order_of_Participants_MoCap_ID").drop(columns="MoCap_ID")
    assert written(tmp_path, content).people == ("7", "3", "5")


def test_a_push_that_began_before_the_file_is_said(tmp_path):
    content = table()
    (note,) = written(tmp_path, content[content.time > 0.5]).notes
    assert "moving in the first frame already: person 0. The push began before the file" in note


def as_text(tmp_path, text):
    path = tmp_path / "trial.csv"
    path.write_text(text)
    return read_trial(path)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_comments_and_separators_do_not_matter(tmp_path, mark):
    complete = written(tmp_path, table())
    text = table().to_csv(index=False, sep=mark)
    for changed_text in (
        f"# filmed in a hall\n# 25 fps\n{text}# the end\n",
        "#" + text,
        "\ufeff" + text.replace("\n", "\r\n"),
        text.replace("\n", "\n\n", 9),
    ):
        np.testing.assert_array_equal(as_text(tmp_path, changed_text).along, complete.along)
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
    for one, present in content.groupby("id"):
        time = np.arange(present.time.min(), present.time.max(), 1 / rate)
        position = {name: np.interp(time, present.time, present[name]) for name in ("x", "y")}
        rows.append(pd.DataFrame({"id": one, "time": time} | position))
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
        (table(people=1), "A row has at least two"),
        (changed(x="here"), "line 2: x: 'here' is not a number"),
        (pd.concat([table(), table()]), "is there twice"),
        (table(people=3).assign(x=lambda t: 1.0 * (t.id == 1)), "one behind the other"),
        (table(frames=5), "nobody is pushed"),
        (table(frames=20), "follow the push"),
        (table()[lambda t: ~((t.id == 1) & t.frame.between(20, 40))], "person 1 is missing from 0.76"),
        (changed(Weight_kg=-3.0), "Weight_kg: -3"),
        (changed(Weight_kg=1e-9), "Weight_kg: 1e-09 where 5 to 500 kg"),
        (changed(Weight_kg=np.inf), "Weight_kg: inf where 5 to 500 kg"),
        (changed(Weight_kg="heavy"), "Weight_kg: heavy where 5 to 500 kg"),
        (changed(y=table().y * 100), "a tenth of the steps are faster than 100 m/s"),
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
    time = np.arange(0, 3.1, 1e-4)
    fine = [
        pd.DataFrame({"id": one, "time": time, "x": 0.0, "y": np.interp(time, observed.time, observed.y)})
        for one, observed in content.groupby("id")
    ]
    assert np.diff(written(tmp_path, pd.concat(fine)).time) == pytest.approx(0.01)


def test_heads_that_do_not_fit_their_columns_are_refused(tmp_path):
    """pandas would drop cells beyond the head, and say so in a warning of its own."""
    text = table().to_csv(index=False)
    for changed_text, says in (
        (text.replace("id,frame", "id"), r"trial\.csv: no table: Length of header"),
        (text.replace("frame", "x", 1), "line 1: two columns are called x"),
    ):
        with pytest.raises(TrialError, match=says):
            as_text(tmp_path, changed_text)


def test_a_wall_behind_and_a_missing_file_are_refused(tmp_path):
    for wall in (0.0, np.nan, -np.inf):
        with pytest.raises(TrialError, match="It needs y below that"):
            written(tmp_path, table(), wall_m=wall)
    with pytest.raises(UnreadableError, match="no such file"):
        read_trial(tmp_path / "none.csv")


def test_the_shipped_trial(tmp_path):
    """What is known of it: its onsets; with chests that meet and no arms stiff people come near and
    soft ones are excluded; with soft arms, or with any posture, none is."""
    trial = read_trial(EXCERPT)
    np.testing.assert_allclose(onsets(trial, trial.along), [0, 0.17, 0.26, 0.38, 0.61], atol=0.02)
    chests, armed = (hindcast(trial, (0.0,), (2e3, 1.2e5), 2, reach) for reach in ((0,), (0, 0.2)))
    assert chests.combined() == ["120000", "rigid"]
    assert armed.combined() == ["2000", "120000", "rigid"]
    assert np.median(chests.models["2000"].scores[ONSET]) > 0.3
    found = hindcast(trial, (0.0, 1.0), (2e3, 1.2e5), 2)
    assert set(found.combined()) == {"2000", "120000", "rigid"}
    assert "not validated" in verdicts(found)[-1]
    *files, page = write_hindcast(found, tmp_path, "percussions push")
    assert "not validated" in page.read_text()
    answers_first(page.as_uri())
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


SOFT = (2e3, 2e4)


def going(frames=30, speed=SPEED):
    """Two people, the first of whom goes at a constant speed from the first frame on."""
    return row_of([80.0, 80.0], speed * np.arange(frames) / RATE)


def ways(trial, moved):
    return moved.along[:, 1:, 0] - trial.along[0, 1:]


def test_two_rigid_people_collide_in_closed_form():
    """Without a floor the second leaves at the speed of the first, when the gap has closed."""
    row = going()
    moved = rigid(row, case_of([GAP], 1e6))
    expected = np.maximum(row.time - GAP / SPEED, 0.0) * SPEED
    np.testing.assert_allclose(ways(row, moved)[:, 0], expected, atol=1e-4)
    assert moved.impulse[0] == pytest.approx(80.0 * SPEED, rel=1e-4)


def test_the_floor_takes_speed():
    """A pushed person who is then left alone goes U τ (1 − exp(−t/τ))."""
    row = going(frames=50)
    row.pushed[6:] = row.pushed[6]
    shown = ways(row, rigid(row, case_of([GAP], 0.5)))[:, 0]
    # rigid from 0.2 to 0.24 s: then alone at 1 m/s
    expected = 0.04 + SPEED * 0.5 * (1 - np.exp(-(row.time[6:] - row.time[6]) / 0.5))
    np.testing.assert_allclose(shown[6:], expected, atol=4e-3)


def test_a_soft_collision_in_closed_form():
    """A critically damped contact that never pulls: the second is overtaken by its own spring. In
    the overlap d, d'' + 2w d' + w² d = 0 with w² = k/m: d = v t exp(−w t), the force is
    m (2w d' + w² d), at most 2 w m v at once, and it ends at w t = 2, with the second at v (1 + e⁻²)."""
    row = going()
    moved, w = soft(row, case_of([GAP], 1e6), 5e4), np.sqrt(5e4 / 80.0)
    assert moved.largest[0] == pytest.approx(2 * w * 80.0 * SPEED, rel=0.06)
    last = np.diff(ways(row, moved)[:, 0])[-5:] * RATE
    np.testing.assert_allclose(last, SPEED * (1 + np.exp(-2)), rtol=2e-2)


@pytest.mark.parametrize("stiffness", [None, 1e6])
@pytest.mark.parametrize("wall", [None, 5.0])
def test_arms_push_before_bodies_touch(stiffness, wall):
    """One person, who is near a wall or not, against m x'' = F_1 − F_2 − m x'/τ by another
    integrator: rooms of 0.08 m, in which a reach of 0.1 m is one of 0.08 m. Nobody touches."""
    tau, force, reach, room = 0.4, 400.0, 0.1, 0.08
    row = row_of([80.0, 80.0], 0.05 * np.minimum(np.arange(26) / 5, 1.0), wall)
    case = case_of([room] * (1 if wall is None else 2), tau, reach, force)
    moved = rigid(row, case) if stiffness is None else soft(row, case, stiffness)

    def slope(t, state):
        x, v, _ = state
        behind, before = room + x - np.interp(t, row.time, row.pushed), room - x
        first, other = (force / reach * max(0.0, room - gap) for gap in (behind, before))
        return [v, (first - (other if wall else 0.0)) / 80.0 - v / tau, first]

    exact = solve_ivp(slope, (0.0, 1.0), [0.0] * 3, t_eval=row.time, rtol=1e-8, max_step=0.01)
    assert exact.y[0, -1] > 0.015
    np.testing.assert_allclose(ways(row, moved)[:, 0], exact.y[0], atol=1e-3)
    assert moved.impulse[0] == pytest.approx(exact.y[2, -1], rel=0.03)
    assert stiffness is None or moved.largest[0] < force


def test_the_reach_is_an_input_of_its_own(tmp_path):
    """Without it all other inputs are the same; far reaches and near ones fit alike where nothing
    is known of them."""
    file, wall, *_ = made(tmp_path, 1, "5000", True)
    trial = read_trial(file, wall)
    some, none = (inputs_of(trial, (0, 1), 3, reach) for reach in ((0.0, 0.2), (0.0, 0.0)))
    for one, other in zip(some[:5], none[:5], strict=True):
        np.testing.assert_array_equal(one, other)
    assert not none.reach.any()
    assert (some.reach.min(), some.reach.max()) == pytest.approx((0.0, 0.2), abs=1e-3)
    assert not none.arms_at(np.full(none.gap.T.shape, 0.01)).any()
    assert abs(np.corrcoef(some.reach, some.arms)[0, 1]) < 0.15


def pushed_row(wall):
    """Five people, a smooth push of 0.2 m in 0.6 s, their gaps and the floor's time."""
    phase = np.clip(np.arange(40) / RATE / 0.6, 0, 1)
    first = 0.2 * (phase - np.sin(2 * np.pi * phase) / (2 * np.pi))
    gap = np.array([0.03, 0.06, 0.02, 0.05] + [0.045] * wall)
    return row_of([80, 70, 95, 60, 75], first, 5.0 if wall else None), gap


@pytest.mark.parametrize("wall", [False, True])
def test_rigid_rows_are_those_of_the_rigid_engine(wall):
    row, gap = pushed_row(wall)
    moved = rigid(row, case_of(gap, 0.8))
    expected, impulse = stepped(row, gap, 0.8)
    np.testing.assert_allclose(ways(row, moved), expected, atol=3e-3)
    assert moved.impulse[0] == pytest.approx(impulse, rel=0.04)
    assert (expected[-1, -1] < 0.046) == wall


@pytest.mark.parametrize(("stiffness", "wall"), [(1e6, False), (2e4, True)])
def test_soft_rows_are_those_of_lammps(tmp_path, stiffness, wall):
    require("lammps")
    row, gap = pushed_row(wall)
    moved = soft(row, case_of(gap, 0.8), stiffness)
    expected, largest, impulse = by_lammps(row, gap, 0.8, stiffness, tmp_path)
    np.testing.assert_allclose(ways(row, moved), expected, atol=2e-3)
    assert moved.largest[0] == pytest.approx(largest, rel=0.02)
    assert moved.impulse[0] == pytest.approx(impulse, rel=0.02)


def test_a_wall_stops_the_row_and_makes_a_case_impossible():
    gap = [GAP, GAP, 0.1]
    for far, possible in ((sum(gap) - 0.01, True), (sum(gap) + 0.05, False)):
        row = row_of([80.0] * 3, np.linspace(0, far, 30), wall=5.0)
        row.along[:, 1:] += row.pushed[:, None]  # as far as everybody was measured to go
        moved = rigid(row, case_of(gap, 0.5))
        assert moved.possible.tolist() == [possible]
        assert moved.along[-1, 2, 0] - moved.along[0, 2, 0] <= 0.1 + 1e-9
    hard = soft(row, case_of(gap, 0.5), 1e6)
    assert hard.impulse[0] > most_impulse(row, np.array([0.5]))[0]
    assert not hard.possible.any()


def test_posture_and_room_at_the_wall_are_two_inputs(tmp_path):
    file, wall, *_ = made(tmp_path, 1, "5000")
    trial = read_trial(file, wall)
    first, other = (inputs_of(trial, (0.0, 0.9), batch) for batch in (0, 1))
    assert abs(np.corrcoef(first.arms, first.wall)[0, 1]) < 0.1
    assert (first.arms.max(), first.wall.max()) == pytest.approx((0.9, 1.0), abs=0.01)
    assert len(np.unique(first.arms)) == len(np.unique(first.wall)) == len(first.tau)
    # posture says nothing of the room at the wall, nor that room of the room between people
    assert abs(np.corrcoef(first.arms, first.gap[:, -1])[0, 1]) < 0.1
    assert abs(np.corrcoef(first.wall, first.gap[:, 0])[0, 1]) < 0.1
    assert not np.isin(first.arms, other.arms).any()


def test_baselines_know_no_mechanics():
    row = going()
    base = {name: ways(row, one) for name, one in baselines(row, case_of([GAP], 0.5)).items()}
    assert np.ptp(base["nobody"]) == 0
    np.testing.assert_allclose(base["geometry"][:, 0], np.maximum(row.pushed - GAP, 0), atol=1e-9)
    late = np.interp(row.time - GAP / SPEED, row.time, row.pushed)
    np.testing.assert_allclose(base["copy"][:, 0], late, atol=1e-9)


def test_odds_are_given_only_where_all_draws_agree():
    """Against closed form; where batches disagree no order is settled; impossible cases are not
    ranked."""
    row = going()
    changes = {"arms": np.array([0, 1, 0, 1.0]), "batch": np.array([0, 0, 1, 1])}
    inputs = inputs_of(row, (0, 1), 0)._replace(wall=np.zeros(4), reach=np.zeros(4), **changes)

    def off(errors, possible=(1, 1, 1, 1)):
        """Four cases in which the second is so much (σ = 0.08 s) too early."""
        onset = onsets(row, row.along) - np.outer(errors, [0.0, 0.08])
        scores = {ONSET: 0.08 * np.array(errors)}
        able = np.array(possible, bool)
        return Cases(onset=onset, scores=scores, largest=onset, impulse=onset, possible=able)

    models = {
        "early": off([3, 3, 3, 3]),
        "mixed": off([3, 3, 0, 0]),
        "one": off([1, 1, 0, 0]),
        "never": off([0, 0, 0, 0], (0, 0, 0, 0)),
        "partly": off([0, 0, 0, 99], (1, 1, 1, 0)),
        "far": off([9, 9, 9, 9]),
    }
    found = odds(row, inputs, models)
    assert "never" not in found
    assert found["partly"].fraction == 1
    assert found["one"].fraction == pytest.approx((np.exp(-0.5) + 1) / 2)
    early = found["early"]
    assert early.fraction == pytest.approx(np.exp(-4.5))
    assert (early.low, early.high) == pytest.approx((np.exp(-4.5), np.exp(-1.125)))
    # with 2 σ it is three times less likely only
    assert (early.settled, early.out) == (True, False)
    assert (found["mixed"].settled, found["far"].out) == (False, True)


@pytest.mark.long
@pytest.mark.parametrize("wall", [False, True])
def test_the_truth_is_inside_what_is_said(tmp_path, wall):
    """Trials with a known truth: it is not excluded, and its force and impulse lie in the range of
    the models that are not; no range is above what the measured Σ m v allows; and another range of
    postures does not exclude what is likeliest."""
    missed = []
    for seed in range(4):
        name = f"{SOFT[seed % len(SOFT)]:g}"
        file, end, largest, impulse = made(tmp_path, seed, name, wall)
        trial = read_trial(file, end)
        found, other = (hindcast(trial, arms, SOFT, 2) for arms in ((0, 1), (0, 0.5, 0.75, 0.9)))
        message = np.array([found.likely(one)[1:] for one in found.combined()])
        force, through = ((np.nanmin(message[:, k]), np.nanmax(message[:, k])) for k in (0, 1))
        missed += [name not in found.combined(), name not in other.combined()]
        missed += [not force[0] <= largest <= force[1], not through[0] <= impulse <= through[1]]
        best = max(found.odds, key=lambda one: found.odds[one].fraction)
        assert best in other.combined()
        assert force[1] <= most_force(trial, SOFT[-1])
        assert through[1] <= most_impulse(trial, np.array([0.1]))[0]
    # 16 statements; of the ranges, which hold 5 to 95 %, one in ten may miss
    assert sum(missed) <= 1, missed
