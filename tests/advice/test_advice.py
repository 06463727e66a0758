"""Advice on a library whose errors and costs are known by formula, and on the one that is
stored."""

import dataclasses
from dataclasses import astuple
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.studies.advice.candidates import LONGEST, Question, asked_error, rates_of, safety_of
from analysis.studies.advice.choice import MARGIN, _cautious, headline, left_out
from analysis.studies.advice.choice import advise as choose
from analysis.studies.advice.library import Curves, Entry, Library, price_of, similarity_of

from analysis.studies.advice.library import read_library, stored_library, write_library  # isort: skip
from analysis.engines.penalty import damping_ratio_for
from analysis.engines.price import PRICES
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision.point import Point, PointStatus
from nscd import Snapshot
from tests.refusals import refusals

SHARES, STIFFER = (0.25, 1.0, 4.0, 8.0), (1.0, 1e1, 1e2, 1e3, 1e4)
START, PER_STEP = 1e-6, 3e-7


def advise(scene, error, *, library, chart=None, **requested):
    return choose(scene, Question(error=error, **requested), library=library, chart=chart)


def changed(scene, **arrays):
    """The scene with other arrays in its snapshot."""
    names = "position", "velocity", "radius", "mass"
    old = {name: getattr(scene.snapshot, name) for name in names}
    return scene.model_copy(update={"snapshot": Snapshot(**(old | arrays))})


def point(scene, numerical, model, seconds, **setting):
    arguments = {
        "scene": scene.name, "disks": len(scene.snapshot), "method": "lammps", "law": "hooke", "solver": "",
        "time_step_s": None, "time_step_share": None, "stiffness_N_per_m": None, "tolerance": None,
        "cpu_seconds": seconds, "quantity": "disk_force", "unit": "N", "numerical_error": numerical,
        "numerical_bar": 0.0, "model_error": model, "model_bar": 0.0, "total_error": numerical + model,
        "status": PointStatus.OK, "reason": "", "machine": "made up", "date": "2026-01-01",
    }  # fmt: skip
    return Point(**arguments | setting)


def entry(scene, numerical=lambda fraction, _: 0.01 * fraction, model=lambda stiffer: 0.3 / stiffer**0.5):
    """Of a driven scene: errors by formula, cost START + PER_STEP·disks·steps; one rigid
    solution."""
    like, window = similarity_of(scene), 0.02
    points = []
    for stiffer in STIFFER:
        safe = 1e-3 / stiffer**0.5
        for fraction in SHARES:
            seconds = START + PER_STEP * like.disks * window / (fraction * safe)
            how = {"time_step_share": fraction, "stiffness_N_per_m": stiffer * 1e6}
            errors = numerical(fraction, stiffer), model(stiffer)
            points.append(point(scene, *errors, seconds, time_step_s=fraction * safe, **how))
    rigid = {"method": "rigid", "law": "", "solver": "auto", "tolerance": 1e-8}
    found = *points, point(scene, 1e-9, 0.0, 0.001, **rigid)
    about = {"name": scene.name, "likeness": like, "window_s": window}
    return Entry(**about, stiffness_N_per_m=1e6, points=found)


@pytest.fixture(scope="module")
def scene():
    return make("arch", 40)


@pytest.fixture(scope="module")
def sure(scene):
    """A library that needs no safety: one scene, known exactly."""
    rates = {f"disk_{what}": 0.0 for what in ("numerical", "model", "rigid")}
    return Library(entries=(entry(scene),), rates=rates)


def test_an_error_is_read():
    fractions = [asked_error(text) for text in ("5%", "5 %", "0.05", "99.9%")]
    assert fractions == pytest.approx([0.05, 0.05, 0.05, 0.999])


BAD = "0", "0%", "-5%", "100%", "1", "five", "", "%", "nan", "inf%"
test_a_bad_error_is_refused = refusals(*((partial(asked_error, text), r"^error: ") for text in BAD))


def test_likeness_of_a_chain():
    like = similarity_of(make("chain", 12))
    assert (like.driven, like.disks, like.depth, like.mass_ratio) == (False, 12, 11, 1)
    assert like.links == pytest.approx(11 / 12)
    assert like.damping_ratio == damping_ratio_for(0.01)
    # 75 kg, 1e6 N/m, 0.3 s, 11 contacts from end to end
    assert like.hardness == pytest.approx(0.3 / np.sqrt(75 / 1e6) / 11)


@given(mass=st.floats(0.1, 10), time=st.floats(0.1, 10))
def test_likeness_has_no_units(mass, time):
    """Other units of mass and time change nothing."""
    base = make("chain_masses", 6)
    other = changed(base, mass=base.snapshot.mass * mass, velocity=base.snapshot.velocity / time)
    other = other.with_contact(stiffness_N_per_m=1e6 * mass / time**2)
    other = other.with_run(duration_s=0.3 * time)
    one, same = (list(map(float, dataclasses.astuple(similarity_of(s)))) for s in (other, base))
    assert one == pytest.approx(same, rel=1e-9)


def test_distance():
    made = make("chain", 9), make("chain", 17), make("arch", 30)
    chain, longer, arch = map(similarity_of, made)
    assert chain.distance(chain) == 0
    assert chain.distance(longer) == longer.distance(chain)
    # twice the depth, and a few more contacts a disk
    assert chain.distance(longer) == pytest.approx(np.hypot(1, np.log2((16 / 17) / (8 / 9))))
    assert chain.distance(arch) == np.inf


def test_errors_between_points_follow_the_power_law(scene):
    one = entry(scene)
    curves = Curves(likeness=one.likeness, load="disk", entries=[one])
    found = curves.soft("lammps", "hooke", 4.0, one.likeness.hardness * 37**0.5)
    assert (found.numerical, found.model) == pytest.approx((0.04, 0.3 / 37**0.5))


def test_no_luck_of_a_softer_contact_counts(scene):
    """Where the error is by chance small at a stiffness, the larger one at the next is taken."""
    lucky = entry(scene, model=lambda stiffer: 0.001 if stiffer == 10 else 0.3 / stiffer**0.5)
    curves = Curves(likeness=lucky.likeness, load="disk", entries=[lucky])
    found = curves.soft("lammps", "hooke", 1.0, lucky.likeness.hardness * 10**0.5)
    assert found.model == pytest.approx(0.03)


def test_what_failed_near_is_not_advised(scene):
    one = entry(scene)
    bad = [p for p in one.points if (p.time_step_share, p.stiffness_N_per_m) == (4, 1e8)]
    lost = tuple(dataclasses.replace(p, status=PointStatus.FAILED) for p in bad)
    failed = dataclasses.replace(one, points=(*(p for p in one.points if p not in bad), *lost))
    curves = Curves(likeness=one.likeness, load="disk", entries=[failed])
    at = one.likeness.hardness
    assert curves.soft("lammps", "hooke", 4.0, at * 90**0.5) is None
    assert curves.soft("lammps", "hooke", 4.0, at * 2**0.5) is not None
    # far softer than anything measured
    assert curves.soft("lammps", "hooke", 1.0, at / 2) is None


def test_price_is_that_of_the_runs(scene):
    cost = price_of("lammps", "hooke", [entry(scene)])
    assert (cost.start_s, cost.disk_step_s) == pytest.approx((START, PER_STEP), rel=1e-6)
    for (engine, law), known in PRICES.items():  # those that are said before a run
        if engine != "rigid":
            fitted = price_of(engine, law, stored_library().entries)
            assert astuple(known) == pytest.approx(astuple(fitted), rel=1e-4)


def test_choice_is_the_cheapest_by_hand(scene, sure):
    """Numerical 1 % a safe step, model 30 %/√stiffer: within 5 % the softest is 100 times the
    scene's (3 %) with the safe step (1 %); a thousand times (0.95 %) takes the fourfold step (4 %),
    which is cheaper by 4/√10."""
    advice = advise(scene, 0.05, methods=("lammps",), library=sure)
    assert (advice.choice.stiffness_N_per_m, advice.choice.time_step_share) == (1e9, 4.0)
    assert advice.choice.promised_error == pytest.approx(0.04 + 0.3 / 1000**0.5)
    # half of that: within 2.47 % are the safe step at 1000 and 10,000 times (1.95 %, 1.3 %)
    assert (advice.better.stiffness_N_per_m, advice.better.time_step_share) == (1e9, 1.0)
    assert advice.better.cpu_seconds > advice.choice.cpu_seconds
    # the rigid model needs no time steps
    assert advise(scene, 0.05, methods=("rigid", "lammps"), library=sure).choice.method == "rigid"


def test_against_the_model_law_and_stiffness_are_the_scenes(scene, sure):
    advice = advise(scene, 0.005, against="model", library=sure, methods=("rigid", "lammps"))
    settings = {(c.method, c.law, c.stiffness_N_per_m) for c in advice.curve}
    assert settings == {("lammps", "hooke", 1e6)}
    assert advice.choice.time_step_share == 0.25
    assert advice.choice.promised_error == pytest.approx(0.0025)


def test_where_nothing_reaches_the_best_is_named(scene, sure):
    advice = advise(scene, 0.001, methods=("lammps",), library=sure)
    assert advice.choice is None
    assert advice.better is None
    assert advice.best.promised_error == pytest.approx(0.0025 + 0.003)


def test_rates_make_up_for_what_was_off(scene):
    """Of two scenes that look alike one has errors thrice as large, predicted from the other; the
    factor makes up for it."""
    twin = scene.model_copy(update={"name": "twin"})
    other = entry(twin, lambda fraction, _: 0.03 * fraction, lambda stiffer: 0.9 / stiffer**0.5)
    pair = [entry(scene), other]
    rates = rates_of(pair)
    curves = Curves(likeness=pair[1].likeness, load="disk", entries=pair[:1])
    safety = safety_of(rates, curves)
    assert (safety.numerical, safety.model) == pytest.approx((3.0, 3.0), rel=1e-6)
    # what was never predicted is never promised
    walls = Curves(likeness=pair[0].likeness, load="wall", entries=pair)
    assert safety_of(rates, walls).model == np.inf


def test_bad_questions(scene, sure):
    jam, other = {"chart": entry(make("jam", 40)).points}, make("four_disks")
    frictional, friction_work = (one.with_contact(friction=0.3) for one in (scene, make("pair")))
    for requested, more, says in (
        (scene, {"quantity": "noise"}, "quantity: unknown 'noise'"),
        (other, {"quantity": "wall-load"}, "wall-load: nobody touches a wall"),
        (other, {"quantity": "displacement"}, "displacement is for driven"),
        (frictional, {}, r"contact\.friction"),
        (friction_work, {}, r"friction: 0\.3, but advice is for frictionless"),
        (scene, jam, "chart: no points of scene arch"),
    ):
        with pytest.raises(ValueError, match=says):
            advise(requested, 0.05, library=sure, **more)
    # nothing in the library is like a crowd before so wide a door: no guess
    drive = scene.drive.model_copy(update={"door_start_m": (0, -40), "door_end_m": (0, 40)})
    unlike = scene.model_copy(update={"drive": drive})
    advice = advise(unlike, 0.05, library=sure, methods=("rigid",))
    assert (advice.choice, advice.best, advice.read) == (None, None, ())
    assert "no measured scene is enough like it" in headline(advice)


def test_a_chart_of_the_scene_is_read_as_it_is(scene, sure):
    worse = entry(scene, lambda fraction, _: 0.02 * fraction)
    advice = advise(scene, 0.05, methods=("lammps",), library=sure, chart=worse.points)
    assert advice.own
    assert (advice.choice.stiffness_N_per_m, advice.choice.time_step_share) == (1e8, 1.0)


def test_library_goes_through_its_file(tmp_path, sure):
    write_library(sure, tmp_path / "library.json.gz")
    again = read_library((tmp_path / "library.json.gz").read_bytes())
    assert again.rates == sure.rates
    assert [*map(dataclasses.asdict, again.entries)] == [*map(dataclasses.asdict, sure.entries)]


def test_the_stored_rates_belong_to_the_stored_scenes():
    stored = stored_library()
    assert rates_of(stored.entries) == pytest.approx(stored.rates, rel=0.02, abs=5e-3)
    assert all(point.machine and point.date for one in stored.entries for point in one.points)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "requested"),
    [("pair", 0.05), ("chain", 0.01), ("corridor", 0.3)]
    + [(name, requested) for name in ("arch", "gate") for requested in (0.01, 0.05, 0.3)],
)
def test_no_choice_breaks_its_promise_or_is_needlessly_dear(name, requested):
    advice = advise(read_scene(name), requested, library=stored_library())
    assert advice.choice.promised_error <= requested
    within = [c for c in advice.curve if c.promised_error <= requested]
    assert advice.choice.cpu_seconds <= (1 + MARGIN) * min(c.cpu_seconds for c in within)
    assert (np.diff([c.cpu_seconds for c in advice.curve]) >= 0).all()
    assert (np.diff([c.promised_error for c in advice.curve]) <= 0).all()
    assert all((c.time_step_share or 0) <= LONGEST for c in advice.curve)


def test_what_a_scene_has_no_need_of(tmp_path):
    """Two pairs and a single disk: one pair collides, the other rests."""
    base = make("pair")
    anchor, velocity = [[0, 0], [0.5, 0], [5, 0], [5.5, 0], [9, 0]], [[2, 0], *[[0, 0]] * 4]
    resting = changed(base, position=anchor, velocity=velocity, radius=[0.25] * 5, mass=[75.0] * 5)
    lines = [*left_out(resting, tmp_path)]
    assert any("10 unknown velocities instead of 15" in line for line in lines)
    assert "disks that touch nothing: 1 of 5" in lines
    assert "islands that nothing presses: 1 with 2 disks" in lines
    assert "disks that touch others and carry nothing: 2 of 5" in lines
    assert "contacts that carry nothing: 1 of 2" in lines
    assert any(line.startswith("arms: who does not touch is farther than 0.2 m") for line in lines)
    assert any(line.startswith("shoulders: before a door wall load") for line in lines)
    near = changed(resting, position=[[0, 0], [0.5, 0], [1.1, 0], [5.5, 0], [9, 0]])
    words = "\n".join(left_out(near, tmp_path / "near"))
    assert "\narms: 1 pairs that do not touch are within 0.2 m" in words


def test_a_promise_covers_how_far_errors_of_nearly_equal_steps_are_apart(scene):
    one, other = (point(scene, error, 0.1, 1.0) for error in (0.002, 0.0035))
    found = _cautious(one, other, one)
    assert (found.numerical_error, found.numerical_bar) == pytest.approx((0.0035, 0.0015))
    bad = dataclasses.replace(one, status=PointStatus.INACCURATE)
    assert _cautious(one, bad, other) is bad


def test_an_elastic_impact_has_no_rigid_model_but_engines_of_its_own(sure):
    elastic = make("pair").with_contact(restitution=1.0)
    with pytest.raises(ValueError, match="needs a restitution below 1"):
        advise(elastic, 0.05, library=sure)
    advice = advise(elastic, 0.05, library=sure, against="model", methods=("rigid", "lammps"))
    assert {candidate.method for candidate in advice.found} == {"lammps"}
    errors = {c.time_step_share: c.numerical_error for c in advice.found}
    assert errors[max(errors)] > 100 * errors[min(errors)] > 0


def test_restitution_is_left_out_of_a_pressed_crowd_only(tmp_path):
    pressed, impact = (left_out(read_scene(n), tmp_path / n) for n in ("gate", "four_disks"))
    words = "\n".join(["", *pressed])
    assert "\nrestitution e = 0.1: " in words
    assert "\nway round walls: 0 of 55 people have a wall before the door: not needed, " in words
    assert "restitution" not in "".join(impact)
