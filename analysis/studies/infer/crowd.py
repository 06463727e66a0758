"""A crowd of which little is known: what is drawn, and what one run of it shows and presses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from analysis.engines.programs.rigid import motion_of
from analysis.scene.placement import rooms_of
from analysis.scene.scene import Drive, Room, Scene, SceneError
from analysis.scene.schema import ContactModel, Run
from analysis.scene.waiting import COVER, Doorway, positions_of
from analysis.studies.infer.tracks import STEP_S, Gate, departures, measure
from nscd import Snapshot
from nscd.arrays import Floats
from nscd.segments import lengths
from nscd.stepping import StepError, WindowSums

# Least, largest, and the power of the uniform number between them; relaxation_time_s ends at the time
# gap where that is shorter.
PRIOR = {
    "push_share": (0.0, 0.5, 2), "jostling_m_per_s": (0.0, 0.15, 1), "time_gap_s": (0.35, 1.1, 1),
    "speed_m_per_s": (1.0, 1.6, 1), "radius_m": (0.10, 0.20, 1), "relaxation_time_s": (0.3, 0.7, 1),
    "heading_sd_rad": (0.05, 0.4, 1), "friction": (0.0, 0.3, 1), "jostling_length_m": (0.4, 1.6, 1),
    "jostling_period_s": (1.5, 6.0, 1), "sway_m": (0.0, 0.04, 1),
}  # fmt: skip
OF_BODIES = ("radius_m", "friction", "sway_m")
OF_DOOR = ("door_start_m", "door_end_m", "outward", "aim", "clearance_m")
# s, of a run (at 0.02 s means of numbers differ by less than 2 %); by which share radii differ; kg.
RIGID_STEP_S, SPREAD, MASS_KG = 0.05, 0.1, 75.0
SWAYS, SWAY_HZ = 4, (0.3, 1.0)  # heads sway at so many frequencies (1/s) between these
# s that a run goes on after the last departure that counts; it may last so many times as long as seen.
AFTER_S, PATIENCE = 1.5, 1.8
# Where nobody was seen at the start: people per m², from so many m before the door on.
START_PER_M2, FREE_M = 3.0, 0.5
# The largest radius over the 5 % nearest distance; loads are above their number in a tenth of the time.
OF_NEAREST, HIGH = 0.6, 0.9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Site:
    """Hold where a crowd is, and what is compared.

    room: walls and a door; gate: the door, and where it is measured; people: how many
    span: numbers of the departures between which is measured; parts: of further such spans
    duration_s: of what was seen, from the start to the last of these
    start, velocity: (n,2) m, m/s, of heads at the beginning; without, each run begins elsewhere (`waiting`), at rest
    largest_m: m, of mean radii: heads were seen nearer to each other than wider people stand"""

    room: Room
    gate: Gate
    people: int
    span: tuple[int, int]
    duration_s: float
    start: Floats | None = None
    velocity: Floats | None = None
    largest_m: float = 0.2
    parts: tuple[tuple[int, int], ...] = ()


class Ran(NamedTuple):
    """Hold a run: its STATISTICS, the largest contact force and the sum of loads on walls (N, over 0.1 s,
    exceeded in a tenth of the time of the span), and the same of the site's parts."""

    statistics: dict[str, float]
    contact_N: float  # noqa: N815  (the unit is newton)
    wall_N: float  # noqa: N815
    parts: tuple[Ran, ...] = ()


def gate_of(room: Room, path: str, positions: Floats) -> Gate:
    """Find the door of a room and the floor around heads (n,2) m. Raises SceneError naming the key."""
    if (drive := room.drive) is None or not drive.has_door:
        raise SceneError(f"{path}: drive: a door is needed (door_start_m, door_end_m, outward)")
    for name, inputs in (("drive.goals", drive.goals), ("body_force", room.body_force), ("period_x_m", room.period_x_m)):
        if inputs:
            raise SceneError(f"{path}: {name}: a push is inferred on a level floor with one door")
    if not (rooms := rooms_of(positions, room.wall_segments(), room.door())):
        raise SceneError(f"{path}: walls: with the door they must enclose a room")
    start, end, outward = (np.array(part) for part in (drive.door_start_m, drive.door_end_m, drive.outward))
    return Gate(start=start, end=end, outward=outward, floor=shapely.union_all(rooms))


def waiting(gate: Gate, people: int, seed: int) -> Floats:
    """Put people at random before a gate, 3 per m² from 0.5 m on: (n,2) m. Raises SceneError for too many."""
    ends = (float(gate.start[0]), float(gate.start[1])), (float(gate.end[0]), float(gate.end[1]))
    free = gate.floor.difference(shapely.LineString(ends).buffer(FREE_M))
    radius = np.full(people, np.sqrt(COVER / (START_PER_M2 * np.pi)))
    return positions_of(gate.floor, [], [Doorway(ends=ends, start=free)], [people], radius, seed)


def crowd_of(drawn: Floats, largest_m: float = np.inf) -> dict[str, float]:
    """Give the parameters of PRIOR that numbers (k,) from 0 to 1 stand for; largest_m: see `Site`."""
    crowd: dict[str, float] = {}
    for (name, (low, high, power)), u in zip(PRIOR.items(), drawn.tolist(), strict=True):
        maximum = {"relaxation_time_s": crowd.get("time_gap_s", high), "radius_m": largest_m}.get(name, high)
        crowd[name] = low + (min(high, maximum) - low) * (u * u if power == 2 else u)
    return crowd


def scene_of(site: Site, crowd: Mapping[str, float], seed: int) -> Scene:
    """Make the scene of a crowd; one without a time gap pushes for ever."""
    drive, n = site.room.drive, site.people
    fraction = 1 + SPREAD * (2 * np.random.default_rng([seed, 1]).random(n) - 1)
    start = waiting(site.gate, n, seed) if site.start is None else site.start
    snapshot = Snapshot(position=start, velocity=np.zeros((n, 2)) if site.velocity is None else site.velocity,
                        radius=crowd["radius_m"] * fraction, mass=np.full(n, MASS_KG))  # fmt: skip
    law = {key: value for key, value in crowd.items() if key not in OF_BODIES}
    law |= {key: getattr(drive, key) for key in OF_DOOR} | ({"seed": seed} if "time_gap_s" in crowd else {})
    frames = round((PATIENCE * site.duration_s + AFTER_S) / STEP_S)
    stated = {
        "drive": Drive.model_validate(law),
        "contact": ContactModel(stiffness_N_per_m=1e6, restitution=0.0, friction=crowd["friction"]),
        "run": Run(duration_s=STEP_S * frames, frames=frames, rigid_step_s=RIGID_STEP_S),
    }
    return Scene.of(site.room.model_copy(update=stated), name="infer", snapshot=snapshot).round_walls()


def simulate(site: Site, crowd: Mapping[str, float], seed: int) -> Ran | None:
    """Run a crowd until the last departure that counts; None where a step is not solved."""
    scene = scene_of(site, crowd, seed)
    motion, windows = motion_of(scene, scene.snapshot), WindowSums(site.people)
    loads, after = [(0.0, 0.0)], AFTER_S
    try:
        motion.separate()
        tracks = [motion.position.copy()]
        while after > 0 and len(tracks) <= scene.run.frames:
            for _ in range(round(STEP_S / motion.step)):
                done = motion.advance()
                windows.add(done.neighbours, done.reaction, done.friction)
            tracks.append(motion.position.copy())
            found = windows.close(motion.time)
            force = lengths(found.impulse) / STEP_S
            loads.append((float(force.max(initial=0.0)), float(force[found.is_wall].sum())))
            after -= STEP_S * ((site.gate.ahead(motion.position) <= 0).sum() > site.span[1])
    except StepError:
        return None
    return shown(site, np.array(tracks), np.array(loads), crowd["sway_m"], seed)


def shown(site: Site, position: Floats, loads: Floats, sway: float, seed: int) -> Ran:
    """Measure tracks (f,n,2) m whose heads sway (m) and loads (f,2) N: the largest contact, all walls."""
    left, positions = np.sort(departures(site.gate, position)), swayed(position, sway, seed)
    each = []
    for span in (site.span, *site.parts):
        begin, end = (int(min(left[k], len(position) - 1)) for k in span)
        high = np.quantile(loads[min(begin, end - 1) : end + 1], HIGH, axis=0)
        each.append(Ran(measure(site.gate, positions, span), *high.tolist()))
    return each[0]._replace(parts=tuple(each[1:]))


def swayed(position: Floats, sway: float, seed: int) -> Floats:
    """Add the sway of heads to tracks (f,n,2) m: with a standard deviation (m) along and across."""
    random, (low, high) = np.random.default_rng([seed, 2]), SWAY_HZ
    turning, phase = 2 * np.pi * random.random((2, SWAYS, 1, *position.shape[1:]))
    time = STEP_S * np.arange(len(position))[None, :, None, None]
    angle = (2 * np.pi * low + (high - low) * turning) * time + phase
    return np.asarray(position + sway * np.sqrt(2 / SWAYS) * np.cos(angle).sum(0))
