"""JuPedSim's people moved by rigid steps: its journeys and routes say where they want to go, the
contact problem where they can; forces are written beside its trajectory.

JuPedSim 1.4 takes no model of one's own. It does take velocities: people of its social force model
without forces of their own go where they are told."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.dumps.contacts import CONTACT_COLUMNS
from analysis.support.write_frames import write_frame
from nscd import Snapshot, Walls
from nscd.arrays import Floats
from nscd.stepping import Motion, Push, WindowSums

if TYPE_CHECKING:
    from types import TracebackType

# Agents' numbers are below.
MOST_AGENTS = 1 << 30
# s and m of those whom the rigid step moves: the social force model then neither drives nor pushes.
NEVER, POINT = 1e12, 1e-6
# m, how far JuPedSim may have moved somebody otherwise than told.
ASTRAY = 1e-6


class RigidPeople:
    """Move the people of a JuPedSim simulation by rigid steps of its time step.

        with RigidPeople(simulation, contacts="crowd_contacts.dump", every=10) as people:
            people.iterate(1000)

    simulation: of a `SocialForceModel`, whose agents say radius (m), mass (kg), desired speed (m/s)
        and reaction time (s, one for all); walls are the boundary and the holes of its geometry
    friction: μ between people, and with walls
    contacts: a dump of forces, with the columns of contacts.dump and agents' numbers as ids; a force
        (N) is the percussion of `every` iterations over their time. It appears when all is done
    Raises ValueError for another model, for reaction times that differ, and where JuPedSim moves
    somebody otherwise than told; `StepError` where a step has no answer."""

    def __init__(
        self,
        simulation: Any,
        *,
        friction: float = 0.0,
        contacts: str | Path | None = None,
        every: int = 10,
    ) -> None:
        if every < 1:
            raise ValueError(f"every: {every}. At least 1 iteration is needed")
        self.simulation, self.friction, self.every = simulation, friction, every
        geometry = simulation.get_geometry()
        rings = [np.array(ring) for ring in (geometry.boundary(), *geometry.holes())]
        start = np.concatenate(rings)
        end = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
        real = (start != end).any(axis=1)  # a ring may end where it begins
        self.walls = Walls(start=start[real], end=end[real])
        self._out = Path(contacts) if contacts else None
        self._part = self._out.with_name(self._out.name + ".part") if self._out else None
        self._file = self._part.open("w", encoding="utf-8") if self._part else None
        self._sums = WindowSums(MOST_AGENTS, simulation.elapsed_time())
        self._bodies: dict[int, tuple[float, float, float, float]] = {}
        self._ids: list[int] = []
        self._motion: Motion | None = None

    def __repr__(self) -> str:
        return f"<RigidPeople: {len(self._ids)} at {self.simulation.elapsed_time():g} s>"

    def __enter__(self) -> RigidPeople:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        if self._file and self._part and self._out:
            self._file.close()
            if kind is None:
                self._part.replace(self._out)
            else:
                self._part.unlink()

    def iterate(self, count: int = 1) -> None:
        """Make so many steps, of the people and of the simulation."""
        for _ in range(count):
            self._step()
            done = self.simulation.iteration_count()
            if self._file and done % self.every == 0:
                self._write(done)

    def _step(self) -> None:
        agents = sorted(self.simulation.agents(), key=lambda agent: agent.id)
        ids = [agent.id for agent in agents]
        if self._motion is None or ids != self._ids:
            self._begin(agents, ids)
        motion = self._motion
        if motion is not None:
            position = np.array([agent.position for agent in agents])
            if (far := np.abs(position - motion.position).max()) > ASTRAY:
                raise ValueError(
                    f"simulation: JuPedSim moved somebody by {far:.3g} m otherwise than told"
                )
            self._targets = np.array([agent.target for agent in agents])
            before = motion.position.copy()
            done = motion.advance()
            neighbours = done.neighbours
            number = np.array(ids, dtype=np.int32)
            second = np.where(neighbours.second < 0, -1, number[neighbours.second]).astype(np.int32)
            neighbours = neighbours._replace(first=number[neighbours.first], second=second)
            self._sums.add(neighbours, done.reaction, done.friction)
            for agent, velocity in zip(
                agents, (motion.position - before) / motion.step, strict=True
            ):
                agent.model.velocity = tuple(velocity)
        self.simulation.iterate()

    def _begin(self, agents: list[Any], ids: list[int]) -> None:
        """Take over who is there now; velocities of those who were there before."""
        moving = {}
        if self._motion is not None:
            moving = dict(zip(self._ids, self._motion.velocity, strict=True))
        for agent in agents:
            if agent.id not in self._bodies:
                self._bodies[agent.id] = _body_of(agent)
        self._ids = ids
        if not agents:
            self._motion = None
            return
        radius, mass, speed, tau = np.array([self._bodies[i] for i in ids]).T
        if np.ptp(tau):
            raise ValueError(
                "simulation: the reaction times of agents differ. One for all is needed"
            )
        self._motion = Motion(
            Snapshot(
                position=np.array([agent.position for agent in agents]),
                velocity=np.array([moving.get(agent.id, agent.model.velocity) for agent in agents]),
                radius=radius,
                mass=mass,
            ),
            self.walls,
            step=self.simulation.delta_time(),
            push=Push(desired=lambda position: self._desired(position, speed), relaxation_time=tau[0]),
            friction=self.friction,
        )

    def _desired(self, position: Floats, speed: Floats) -> Floats:
        """Velocities (n,2) m/s towards the agents' targets."""
        way = self._targets - position
        length = np.hypot(*way.T)
        return way * (speed / np.where(length > 0, length, np.inf))[:, None]

    def _write(self, done: int) -> None:
        assert self._file is not None
        window = self._sums.close(self.simulation.elapsed_time())
        second = np.where(window.is_wall, window.second + 1, window.second)
        table = [window.first, second, window.is_wall, *window.normal.T]
        table += [np.maximum(0.0, -window.gap), *(window.impulse / window.duration).T]
        write_frame(self._file, "ENTRIES", done, CONTACT_COLUMNS, table)


def _body_of(agent: Any) -> tuple[float, float, float, float]:
    """Radius, mass, desired speed and reaction time of an agent whom rigid steps move from now on."""
    model = agent.model
    if not hasattr(model, "obstacle_scale"):
        raise ValueError(
            "simulation: agents of the SocialForceModel are needed, which take velocities"
        )
    core_arguments = model.radius, model.mass, model.desired_speed, model.reaction_time
    model.radius, model.reaction_time = POINT, NEVER
    model.agent_scale = model.obstacle_scale = 0.0
    return core_arguments
