"""JuPedSim's people moved by rigid steps. Needs the package `jupedsim`."""

import numpy as np
import pytest

from analysis.dumps import read_contacts
from analysis.studies.exchange.jupedsim import RigidPeople
from nscd import Snapshot, Walls
from nscd.stepping import Motion, Push, WindowSums

jupedsim = pytest.importorskip("jupedsim")
shapely = pytest.importorskip("shapely")

ROOM = [(0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (0.0, 3.0)]
DOOR = [(5.5, 1.2), (6.0, 1.2), (6.0, 1.8), (5.5, 1.8)]
PLACES = [(4.9, 1.5), (4.6, 1.93), (4.6, 1.07), (4.35, 1.5), (4.15, 2.0), (4.15, 1.0)]


BODY = {"radius": 0.25, "mass": 75.0}


def simulation(positions=PLACES, model=jupedsim.SocialForceModel, **person):
    made = jupedsim.Simulation(model=model(), geometry=shapely.Polygon(ROOM), dt=0.01)
    door = made.add_exit_stage(shapely.Polygon(DOOR))
    goal = {"journey_id": made.add_journey(jupedsim.JourneyDescription([door])), "stage_id": door}
    kind = getattr(jupedsim, f"{model.__name__}AgentParameters")
    for position in positions:
        made.add_agent(kind(position=position, **goal, **person))
    return made


def test_alone_as_the_drive_says():
    """v(t) = u_d (1 − (1 + h/τ)⁻ᵏ) after k implicit steps, until the door; and out."""
    made = simulation([(1.0, 1.5)], desired_speed=1.2, reaction_time=0.5, **BODY)
    people = RigidPeople(made)
    people.iterate(100)
    (agent,) = made.agents()
    factor = (1 + 0.01 / 0.5) ** -np.arange(1.0, 101.0)
    way = 1.0 + 0.01 * 1.2 * (1 - factor).sum()
    np.testing.assert_allclose(agent.position, [way, 1.5], atol=1e-9)
    assert repr(people) == "<RigidPeople: 1 at 1 s>"
    people.iterate(400)
    assert not list(made.agents())


def test_positions_and_forces_are_those_of_the_rigid_step(tmp_path):
    made = simulation(desired_speed=1.0, reaction_time=0.5, **BODY)
    with RigidPeople(made, friction=0.2, contacts=tmp_path / "forces.dump", every=20) as people:
        people.iterate(40)
    target = np.array([5.75, 1.5])

    def desired(position):
        way = target - position
        return way / np.hypot(*way.T)[:, None]

    ring = np.array(ROOM)
    motion = Motion(
        Snapshot(position=PLACES, velocity=np.zeros((6, 2)), radius=[0.25] * 6, mass=[75.0] * 6),
        Walls(start=ring, end=np.roll(ring, -1, axis=0)),
        step=0.01,
        push=Push(desired=desired, relaxation_time=0.5),
        friction=0.2,
    )
    sums = WindowSums(6)
    for step in range(40):
        if step == 20:
            sums.close(0.2)
        done = motion.advance()
        sums.add(done.neighbours, done.reaction, done.friction)
    ids = np.array(sorted(agent.id for agent in made.agents()))
    positions = np.array([agent.position for agent in made.agents()])
    np.testing.assert_allclose(positions, motion.position, atol=1e-9)
    window = sums.close(0.4)
    frame = list(read_contacts(tmp_path / "forces.dump"))[-1]
    pressed = np.hypot(*window.impulse.T) > 1e-9
    assert pressed.sum() >= 2
    keys = zip(frame.first, frame.second, strict=True)
    mine = dict(zip(keys, frame.force, strict=True))
    for i, j, p in zip(window.first, window.second, window.impulse / 0.2, strict=True):
        np.testing.assert_allclose(mine[ids[i], ids[j]], p, atol=1e-5 * 75)


def test_what_it_cannot_move():
    other = simulation([(1.0, 1.0)], jupedsim.CollisionFreeSpeedModel)
    with pytest.raises(ValueError, match="agents of the SocialForceModel are needed"):
        RigidPeople(other).iterate()
    slow = simulation(PLACES[:2], **BODY)
    next(iter(slow.agents())).model.reaction_time = 1.0
    with pytest.raises(ValueError, match="the reaction times of agents differ"):
        RigidPeople(slow).iterate()
    with pytest.raises(ValueError, match="every: 0"):
        RigidPeople(simulation(**BODY), every=0)
    moved = simulation([(1.0, 1.5)], **BODY)
    people = RigidPeople(moved)
    people.iterate()
    next(iter(moved.agents())).model.velocity = (3.0, 0.0)
    moved.iterate()
    with pytest.raises(ValueError, match=r"moved somebody by 0\.03 m otherwise than told"):
        people.iterate()
