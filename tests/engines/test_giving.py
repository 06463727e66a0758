"""Walls that give: a load that is put on, a periodic one, a single impact, two engines that agree, and walls that cannot
be."""

import numpy as np
import pytest

from analysis.engines import EngineError, engine
from analysis.engines import run as engine_runs
from analysis.percussions.setting import setting_beside
from analysis.scene.scene import SceneError, Wall, read_scene
from analysis.scene.schema import BodyForce
from tests.crowds import disks_at, scene_at
from tests.engines.at_hand import require

ENGINES = ["lammps", "yade"]
TURN = np.radians(30.0)
ALONG, NORMAL = (np.array([np.cos(TURN + a), np.sin(TURN + a)]) for a in (0.0, np.pi / 2))


def before_a_wall(velocity, force=None, mass=30.0, contact=None, **oscillator):
    """One disk of 75 kg that touches a slanted wall, which gives along NORMAL."""
    disk = disks_at([0.25 * -NORMAL], [velocity * NORMAL])
    ends = {"start_m": tuple(-2 * ALONG), "end_m": tuple(2 * ALONG)}
    rail = Wall(name="rail", mass_kg=mass, **ends, **oscillator)
    scene = scene_at(
        disk, name="giving", contact={"stiffness_N_per_m": 4e6, "restitution": 0.1} | (contact or {}),
        run={"duration_s": 0.5, "frames": 50},
        body_force=BodyForce(acceleration_m_per_s2=tuple(force * NORMAL)) if force else None,
    )  # fmt: skip
    return scene.model_copy(update={"walls": (rail,)})


def moved(scene, name, folder):
    """Step, displacement and velocity of the wall, frame by frame, of a run by an engine."""
    require(name)
    engine_runs.simulate(scene, name, folder)
    return np.loadtxt(folder / "wall_rail.txt").T


def test_a_load_that_is_put_on_overshoots_as_a_damped_oscillator_does(tmp_path):
    """Disk and wall move as one: (M + m) s'' + c s' + k s = m g. The largest deflection is 1 + exp(−π ζ/√(1
    − ζ²)) of m g/k. Two engines write the same numbers."""
    g, spring, damper, combined = 2.0, 1e4, 300.0, 105.0
    scene = before_a_wall(0.0, g, stiffness_N_per_m=spring, damping_N_s_per_m=damper)
    omega = np.sqrt(spring / combined)
    zeta = damper / (2 * combined * omega)
    root = np.sqrt(1 - zeta**2)
    found = [moved(scene, name, tmp_path / name) for name in ENGINES]
    time = np.linspace(0.0, 0.5, 51)
    phase = root * omega * time
    still = 75.0 * g / spring
    decay = np.exp(-zeta * omega * time)
    by_hand = still * (1 - decay * (np.cos(phase) + zeta / root * np.sin(phase)))
    speed = still * decay * omega / root * np.sin(phase)
    for _, s, v in found:
        np.testing.assert_allclose(s, by_hand, rtol=0, atol=5e-3 * still)
        assert s.max() == pytest.approx(still * (1 + np.exp(-np.pi * zeta / root)), rel=3e-3)
        np.testing.assert_allclose(v, speed, rtol=0, atol=5e-3 * still * omega)
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-10)


# What makes the force on each wall that gives F cos(Ωt), which nobody touches: in the words of a deck.
LOAD_N, OMEGA = 60.0, 30.0
LOADS = {
    "lammps": (
        "giving.in",
        "variable give_load_${wall_name} equal %g*cos(%g*step*v_time_step)\n"
        "variable give_force_${wall_name} equal v_give_load_${wall_name}\n",
    ),
    "yade": (
        "crowd_walls.py",
        "alone = Giving.change\n"
        "def change(wall, force, dt):\n"
        "    return alone(wall, force + %g * math.cos(%g * O.iter * dt) * wall.normal, dt)\n"
        "Giving.change = change\n",
    ),
}


@pytest.mark.parametrize("name", ENGINES)
def test_walls_resonate_with_a_periodic_load(tmp_path, name, monkeypatch):
    """m s'' + c s' + k s = F cos Ωt ends in s = Re X exp(iΩt), X = F/(k − mΩ² + icΩ): walls tuned to half
    of Ω, to Ω and to twice of it. The person walks away."""
    require(name)
    mass, damper, file, words = 30.0, 150.0, *LOADS[name]
    chosen = type(engine(name))
    write = chosen.write_input

    def loaded(self, scene, decks):
        write(self, scene, decks)
        with (decks / file).open("a", encoding="utf-8") as deck:
            deck.write(words % (LOAD_N, OMEGA))

    monkeypatch.setattr(chosen, "write_input", loaded)
    springs = mass * (OMEGA * np.array([0.5, 1.0, 2.0])) ** 2
    walls = tuple(
        Wall(name=f"wall_{n}", start_m=(n, -2.0), end_m=(n, 2.0), mass_kg=mass,
             damping_N_s_per_m=damper, stiffness_N_per_m=spring)
        for n, spring in enumerate(springs.tolist(), start=1)
    )  # fmt: skip
    scene = scene_at(
        disks_at([[0.0, 0.0]], [[-1.0, 0.0]]), name="tuned",
        contact={"stiffness_N_per_m": 1e5, "restitution": 0.1},
        run={"duration_s": 4.0, "frames": 400, "time_step_s": 1e-3},
    ).model_copy(update={"walls": walls})  # fmt: skip
    engine_runs.simulate(scene, name, tmp_path / name)
    for spring, wall in zip(springs, walls, strict=True):
        _, s, v = np.loadtxt(tmp_path / name / f"wall_{wall.name}.txt").T
        time = np.linspace(0.0, 4.0, 401)
        solution = LOAD_N / (spring - mass * OMEGA**2 + 1j * damper * OMEGA)
        turning, late = solution * np.exp(1j * OMEGA * time), time > 3.0
        np.testing.assert_allclose(s[late], turning.real[late], rtol=0, atol=2e-3 * abs(solution))
        speed = (1j * OMEGA * turning).real[late]
        np.testing.assert_allclose(v[late], speed, rtol=0, atol=2e-3 * OMEGA * abs(solution))


@pytest.mark.parametrize("name", ENGINES)
def test_a_single_impact_gives_the_wall_two_m_v_over_both_masses(tmp_path, name):
    """Elastic, on a wall without a spring: momentum is kept, V' = 2 m v/(m + M)."""
    scene = before_a_wall(1.0, mass=50.0, contact={"restitution": 1.0})
    scene = scene.with_run(duration_s=0.05, frames=5)
    _, way, speed = moved(scene, name, tmp_path / name)
    assert speed[-1] == pytest.approx(2 * 75 / 125, rel=2e-3)
    assert way[-1] - way[-2] == pytest.approx(0.01 * speed[-1], rel=1e-6)
    last = (tmp_path / name / "bodies.dump").read_text(encoding="utf-8").splitlines()[-1].split()
    after = np.array([float(last[7]), float(last[8])]) @ NORMAL
    assert 75 * after + 50 * speed[-1] == pytest.approx(75.0, rel=1e-9)


def test_engines_agree_under_another_law(tmp_path):
    scene = before_a_wall(1.0, stiffness_N_per_m=1e5, contact={"law": "hertz"})
    scene = scene.with_run(duration_s=0.05, frames=5)
    first, second = (moved(scene, name, tmp_path / name) for name in ENGINES)
    assert first[1][-1] > 0.01
    np.testing.assert_allclose(first, second, rtol=0, atol=1e-10)


def test_what_cannot_have_walls_that_give_says_so(tmp_path, refused):
    assert "walls.mass_kg: rail gives. Percussions are" in refused("report", "rail", "--seeds", "0")
    scene = before_a_wall(1.0, stiffness_N_per_m=1e4)
    soft = scene.with_contact(law="body")
    for one, name, says in (
        (scene, "rigid", "giving: walls.mass_kg: the rigid engine's walls stand, ra"),
        (soft, "lammps", "walls.mass_kg: LAMMPS does not know .* = body. Use yade"),
    ):
        with pytest.raises(EngineError, match=says):
            engine_runs.check_before(one, name, tmp_path / "no")
    path = scene.write(tmp_path)
    (tmp_path / "bodies.dump").write_text("", encoding="utf-8")
    says = r"walls.mass_kg: rail gives. Percussions are for walls that"
    with pytest.raises(ValueError, match=says):
        setting_beside(tmp_path / "bodies.dump", path)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("stiffness_N_per_m = 1e4", "walls.0: stiffness_N_per_m: a wall that gives needs a mass"),
        ("damping_N_s_per_m = 1.0", "walls.0: damping_N_s_per_m: a wall that gives needs a mass"),
        ("mass_kg = 0.0", "walls.0.mass_kg: "),
        ("mass_kg = 1.0\nstiffness_N_per_m = -1.0", "walls.0.stiffness_N_per_m: "),
        ("mass_kg = 50.0", "walls.0: lower gives (mass_kg) and meets another wall: end it 1 mm"),
    ],
)
def test_a_wall_that_cannot_give_is_refused_by_its_key(tmp_path, keys, message):
    path, barrier = read_scene("terrace").write(tmp_path), '\n\n[[walls]]\nname = "barrier"'
    path.write_text(path.read_text(encoding="utf-8").replace(barrier, f"\n{keys}{barrier}"))
    with pytest.raises(SceneError) as refused:
        read_scene(path)
    assert str(refused.value).startswith(f"{path}: {message}")
