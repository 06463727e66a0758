"""The push inferred: numbers of tracks against closed forms, the posterior against that of a Gaussian, and a
crowd whose forces follow from what is drawn."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import shapely

from analysis.scene.new_scene import Crowd, room
from analysis.scene.scene import SceneError
from analysis.studies.infer import crowd, page, tracks
from analysis.studies.infer.inference import NAMES, infer, run_prior, uniform
from analysis.studies.infer.observations import see
from analysis.studies.infer.posterior import Reference

GATE = tracks.Gate(
    start=np.array([-0.5, 0.0]), end=np.array([0.5, 0.0]), outward=np.array([0.0, -1.0]),
    floor=shapely.box(-3, 0, 3, 6),
)  # fmt: skip
TIME = np.arange(0, 12, tracks.STEP_S)


def file_of(difference=0.5, speed=1.0, people=10, sway=None):
    """Tracks of people one behind the other who walk to the middle of the door."""
    y = 2.03 + difference * np.arange(people) - speed * TIME[:, None]
    x = np.zeros_like(y) if sway is None else sway[0] * np.cos(2 * np.pi * sway[1] * TIME[:, None] + 0 * y)
    return np.stack([x, y], axis=2)


def test_numbers_of_people_who_walk_in_a_line_are_their_speed_and_distance():
    found = tracks.measure(GATE, file_of(people=20), (1, 12))
    half_ring = np.pi * (1.5**2 - 0.5**2) / 2 + 1.0  # round both posts, and before the door
    assert GATE.area(GATE.zone) == pytest.approx(half_ring, rel=1e-3)
    assert found["flow"] == pytest.approx(2.0)  # 1 m/s over 0.5 m
    assert found["density"] == pytest.approx(2.0 / half_ring, rel=0.06)  # two in each metre
    assert [found[name] for name in ("speed", "early", "nearest_5", "nearest_50", "nearest_door")] == (
        pytest.approx([1.0, 1.0, 0.5, 0.5, 0.5]))  # fmt: skip
    # from the posts, of who is within 2.5 m of the line through the door's middle
    assert found["wall_5"] == pytest.approx(np.hypot(0.5, 0.05 * 2.5), rel=0.01)
    assert found["acceleration"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("observed", [0.0, 0.3])
def test_who_is_lost_near_the_door_has_left_and_who_is_lost_elsewhere_has_not(observed):
    walked = file_of()
    walked[walked[..., 1] < observed] = np.nan
    left = tracks.departures(GATE, walked)
    assert left == pytest.approx(10 * (2.0 + 0.5 * np.arange(10) - observed), abs=1.01)
    walked[walked[..., 1] < 1.0] = np.nan
    assert np.isinf(tracks.departures(GATE, walked)).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_velocities_of_neighbours_who_move_together_or_against_each_other_correlate(sign):
    turn = 0.05 * np.sin(2 * np.pi * 0.1 * TIME)[:, None] * [1.0, sign]
    both = np.stack([np.array([0.0, 0.4]) + turn, np.ones_like(turn)], axis=2)
    others = file_of(people=6, speed=0.25) + np.array([30.0, -1.9])  # far aside, they leave in 10 s
    found = tracks.measure(GATE, np.concatenate([both, others], axis=1), (0, 5))
    assert found["correlation"] == pytest.approx(sign, abs=0.02)


def test_smoothing_takes_sway_out_and_leaves_the_way():
    still, swaying = (tracks.smooth(file_of(sway=one)) for one in (None, (0.03, 1.0)))
    assert np.nanmax(np.abs(still - file_of())) < 1.0  # NaN at the ends, and else a straight way
    inner = slice(15, -15)
    assert still[inner] == pytest.approx(file_of()[inner], abs=1e-12)
    assert np.abs(swaying[inner] - still[inner]).max() < 0.003


def test_posterior_of_a_gaussian_is_the_known_one_and_covers():
    """θ normal, s = A θ + 0.4 ε: the posterior is normal with (1 + AᵀA/0.16)⁻¹."""
    random, model = np.random.default_rng(400), np.array([[1, 0.5], [0, 1], [1, -1.0]])
    theta = random.standard_normal((3000, 2))
    statistics = theta @ model.T + 0.4 * random.standard_normal((3000, 3))
    runs, few = Reference(theta, statistics), Reference(theta[:300], statistics[:300])
    observed, spread = np.array([0.6, 0.5, -0.4]), np.linalg.inv(np.eye(2) + model.T @ model / 0.16)
    low, median, high = runs.posterior(observed).quantiles()
    assert median == pytest.approx(spread @ model.T @ observed / 0.16, abs=0.05)
    assert high - low == pytest.approx(2 * 1.645 * np.sqrt(np.diag(spread)), rel=0.12)
    left_out = few.left_out()
    inside = (left_out[:, 0] <= theta[:300]) & (theta[:300] <= left_out[:, 2])
    assert inside.mean(0) == pytest.approx(0.9, abs=0.05)
    # of statistics that this model gives 9 in 10 are within the 90 % of the runs; others are found
    other = random.standard_normal((400, 2)) @ model.T + 0.4 * random.standard_normal((400, 3))
    assert np.mean([few.misfit(one) < 0.9 for one in other]) == pytest.approx(0.9, abs=0.05)
    for strange in ([2.0, 0.0, -2.0], [0.0, 99.0, 0.0], [9.0, 9.0, 0.0]):
        assert few.misfit(np.array(strange)) > 0.95


def test_prior_is_reproducible_within_its_bounds_and_people_react_within_their_time_gap():
    every = [crowd.crowd_of(uniform(3, number)) for number in range(200)]
    assert every[7] == crowd.crowd_of(uniform(3, 7)) != crowd.crowd_of(uniform(4, 7))
    for name, (low, high, _) in crowd.PRIOR.items():
        values = np.array([one[name] for one in every])
        assert low <= values.min() < values.max() <= high
    assert all(one["relaxation_time_s"] <= one["time_gap_s"] for one in every)
    # p is the square of a uniform number: its median is a quarter of the largest
    assert np.median([one["push_share"] for one in every]) == pytest.approx(0.125, abs=0.04)


def test_sway_has_the_standard_deviation_that_is_asked():
    moved = crowd.swayed(np.zeros((600, 50, 2)), 0.03, 5)
    assert moved.std(axis=0).mean() == pytest.approx(0.03, rel=0.05)
    assert np.array_equal(crowd.swayed(moved, 0.0, 5), moved)


@pytest.fixture(scope="module")
def site():
    """Ten people in a room of 4 m by 3 m."""
    small = room("small", 4.0, 3.0, 1.0, Crowd(people=10))
    gate = crowd.gate_of(small, "small", np.array([[-1.0, 0.0]]))
    return crowd.Site(room=small, gate=gate, people=10, span=tracks.span_of(10), duration_s=6.0)


def test_a_crowd_that_pushes_for_ever_presses_more_than_one_that_does_not_push(site):
    usual = crowd.crowd_of(np.full(len(crowd.PRIOR), 0.5)) | {"jostling_m_per_s": 0.0, "radius_m": 0.2}
    selected = ("speed_m_per_s", "relaxation_time_s", *crowd.OF_BODIES)
    kinds = (*2 * [usual | {"push_share": 0.0}], {key: usual[key] for key in selected})
    polite, again, pushing = (crowd.simulate(site, one, 1) for one in kinds)
    assert polite == again
    assert pushing.statistics["flow"] > polite.statistics["flow"]
    # m U/τ of one person is what the last one in a row of them presses with, at least
    assert pushing.contact_N > usual["speed_m_per_s"] / usual["relaxation_time_s"] * crowd.MASS_KG
    assert pushing.contact_N > 2 * polite.contact_N


def test_a_room_without_one_door_is_refused_by_its_key(site):
    goals = site.room.model_copy(update={"period_x_m": (0.0, 1.0)})
    with pytest.raises(SceneError, match="here: period_x_m"):
        crowd.gate_of(goals, "here", np.zeros((1, 2)))
    with pytest.raises(SceneError, match="here: drive: a door"):
        crowd.gate_of(site.room.model_copy(update={"drive": None}), "here", np.zeros((1, 2)))


def film(tmp_path, site, *more):
    """See eight people, one behind the other, walk out of the room at 0.5 m/s; further rows: id, frame, x, y."""
    rows = [(k, f, 0.05 * f - 0.3 - 0.5 * k, 0.0) for k in range(8) for f in range(90)] + [*more]
    message = "# framerate: 10 fps\n# id frame x/m y/m\n"
    (tmp_path / "film.txt").write_text(message + "".join(f"{n} {f} {x:.4f} {y}\n" for n, f, x, y in rows))
    site.room.write(tmp_path)
    return see(tmp_path / "film.txt", tmp_path / "small.toml", window_s=5.0)


@pytest.mark.parametrize(("more", "people", "notes"), [
    ([], 8, []),
    ([(9, f, -3.0, -1.0) for f in range(90)], 9, ["not leave while they are seen: 1"]),
    ([(9, f, 0.05 * f - 2.5, 1.0) for f in range(20, 40)], 8, ["come later and are not simulated: 1", "not leave"]),
    ([(9, f, 0.5, 0.0) for f in range(30)], 8, []),  # behind the door all the time
])  # fmt: skip
def test_windows_of_a_film_have_the_flow_of_those_who_leave_in_them(tmp_path, site, more, people, notes):
    observed = film(tmp_path, site, *more)
    assert len(observed.site.start) == observed.site.people == people
    assert observed.site.velocity[:8] == pytest.approx(np.tile([0.5, 0.0], (8, 1)))
    assert len(observed.notes) == len(notes)
    assert all(part in note for part, note in zip(notes, observed.notes, strict=True))
    # 0.6 s, 1.6 s, …: five leave in the first 5 s, too few in the next
    assert [(start, end) for start, end, _ in observed.windows] == [(0.0, 5.0)]
    assert observed.site.parts == ((0, 5),)
    for one in (observed.statistics, observed.windows[0][2]):
        assert one["flow"] == pytest.approx(1.0, rel=0.02)
        assert one["door_speed"] == pytest.approx(0.5)
        assert (one["door_spread"], one["door_gain"]) == pytest.approx((0, 0), abs=1e-9)
        assert one["third_50"] == pytest.approx(1.0)  # 0.5 and 0.5 m, or one who stands between two


def test_parts_of_a_run_are_measured_as_a_run_with_that_span(site):
    usual = crowd.crowd_of(np.full(len(crowd.PRIOR), 0.5))
    (part,) = crowd.simulate(replace(site, parts=((1, 5),)), usual, 3).parts
    alone = crowd.simulate(replace(site, span=(1, 5)), usual, 3)
    assert (part.contact_N, part.wall_N) == (alone.contact_N, alone.wall_N)
    assert part.statistics == pytest.approx(alone.statistics, nan_ok=True)


def made_up(seed, runs=200):
    """Runs whose statistics and forces follow from what is drawn, in closed form."""
    random = np.random.default_rng(seed)
    for number in range(runs):
        p, sigma = uniform(1, number)[:2]
        noise = 1 + 0.03 * random.standard_normal(3)
        flow, speed, density = noise * [1 + p, 0.05 + sigma, 3 - sigma + p]
        yield crowd.Ran({"flow": flow, "density": density, "speed": speed}, 500 * p, 100 * sigma)


def test_made_up_crowds_give_their_push_and_force_back(tmp_path, site):
    ran = list(made_up(2))
    truth = crowd.crowd_of(np.array([0.5, 0.2, *np.full(9, 0.5)]))
    found = infer(site, {"flow": 1.5, "density": 3.3, "speed": 0.25}, [*ran, None])
    assert found.fits
    assert found.unsolved == 1
    for name, value in (("push_share", truth["push_share"]), ("contact_N", 250.0), ("jostling_m_per_s", 0.03)):
        low, _, high = found.found[name]
        assert low <= value <= high
        assert found.width[name] < 0.4
        assert 0.84 <= found.coverage[name] <= 0.96
    low, _, high = found.found["wall_N"]
    assert (high + 20) / (low + 20) >= 1.5 - 1e-9
    assert max(found.owed, key=found.owed.get) == "push_share"
    # nothing tells the time gap: its interval is the prior's
    assert found.width["time_gap_s"] > 0.7
    # flow alone knows nothing of the jostling
    assert np.ptp(found.alone["flow",]["jostling_m_per_s"]) > 2 * np.ptp(found.found["jostling_m_per_s"])
    *_, written = page.write_inferred(found, "crowd", ["a note"], tmp_path, "percussions infer crowd")
    text = written.read_text(encoding="utf-8")
    assert text.index("Largest contact force: 2") < text.index("Push share")
    output = json.loads((tmp_path / "infer.json").read_text(encoding="utf-8"))
    assert output["fits"]
    assert output["found"]["contact_N"] == pytest.approx(found.found["contact_N"].tolist())


def test_what_no_run_looks_like_gets_no_force(tmp_path, site):
    found = infer(site, {"flow": 1.5, "density": 9.0, "speed": 0.25}, list(made_up(2)))
    assert not found.fits
    page.write_inferred(found, "crowd", [], tmp_path, "percussions infer crowd")
    output = json.loads((tmp_path / "infer.json").read_text(encoding="utf-8"))
    assert not output["fits"]
    assert output.keys().isdisjoint({"found", "width", "owed"})
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Nothing fits, so there is no force" in text
    assert "Largest contact force" not in text
    assert "density" in page.verdict(found)
    assert all(row[2] == "–" for row in page.rows(found))


def test_too_few_runs_are_refused(site):
    with pytest.raises(ValueError, match="59 of 60 can be compared"):
        infer(site, {"flow": 1.5}, [*list(made_up(2, 59)), None])


def test_the_command_infers_from_a_table(percussions, tmp_path, site):
    (tmp_path / "crowds.csv").write_text("people,flow_per_s\n8,1.6\n", encoding="utf-8")
    site.room.write(tmp_path)
    run = partial(percussions, "infer", "crowds.csv", "--room", "small.toml", "--runs", 60, "--jobs", 1)
    made = run()
    assert made.returncode in (0, 1), made.stderr
    assert "push share p" in made.stdout
    first = (tmp_path / "infer" / "runs.csv").read_text(encoding="utf-8")
    head, *rows = first.splitlines()
    assert head.split(",") == ["flow", *NAMES]
    assert 60 - json.loads((tmp_path / "infer" / "infer.json").read_text())["unsolved"] == len(rows)
    few = run_prior(replace(site, people=8, span=tracks.span_of(8), duration_s=8 / 1.6 + 2.0), 2, 1, None, 1)
    for row, one in zip(rows, few, strict=False):
        assert float(row.split(",")[0]) == pytest.approx(one.statistics["flow"])
