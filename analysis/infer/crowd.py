"""A crowd of which little is known: what is drawn, and what one run of it shows and presses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from analysis.engines.programs.rigid import motion_of
from analysis.infer.tracks import STEP_S, Gate, departures, measure
from analysis.scene.placement import rooms_of
from analysis.scene.scene import Drive, Room, Scene, SceneError
from analysis.scene.schema import ContactModel, Run
from analysis.scene.waiting import COVER, Doorway, places
from nscd import Snapshot
from nscd.arrays import Floats
from nscd.segments import lengths
from nscd.stepping import StepError, WindowSums

# Least, largest, and the power of the uniform number between them; relaxation_time_s ends at the time
# gap where that is shorter.
PRIOR = {
    "push_share": (0.0, 0.5, 2),
    "jostling_m_per_s": (0.0, 0.15, 1),
    "time_gap_s": (0.35, 1.1, 1),
    "speed_m_per_s": (1.0, 1.6, 1),
    "radius_m": (0.10, 0.20, 1),
    "relaxation_time_s": (0.3, 0.7, 1),
    "heading_sd_rad": (0.05, 0.4, 1),
    "friction": (0.0, 0.3, 1),
    "jostling_length_m": (0.4, 1.6, 1),
    "jostling_period_s": (1.5, 6.0, 1),
    "sway_m": (0.0, 0.04, 1),
}
NO_DRIVE = ("radius_m", "friction", "sway_m")
OF_DOOR = ("door_start_m", "door_end_m", "outward", "aim", "clearance_m")
# s: of a run; m: how much radii differ, as a share; kg.
RIGID_STEP_S, SPREAD, MASS_KG = 0.02, 0.1, 75.0
# Heads sway at so many frequencies (1/s) between these.
SWAYS, SWAY_HZ = 4, (0.3, 1.0)
# s that a run goes on after the last departure that counts; and it may last so many times as long.
AFTER_S, PATIENCE = 1.5, 1.8
# Where nobody was seen at the start: people per m², and m that are free before the door.
START_PER_M2, FREE_M = 3.0, 0.5
# Of largest contacts and wall loads over time.
HIGH = 0.9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Site:
    """Hold where a crowd is, and what is compared.

    room: walls and a door; gate: the door, and where it is measured
    people: how many
    span: numbers of the departures between which is measured
    duration_s: of what was seen, from the start to the last of these
    start: (n,2) m, heads at the beginning; without, each run begins elsewhere (`waiting`)"""

    room: Room
    gate: Gate
    people: int
    span: tuple[int, int]
    duration_s: float
    start: Floats | None = None


class Ran(NamedTuple):
    """Hold a run: the numbers of STATISTICS, the largest contact force and the sum of loads on walls (N,
    over 0.1 s, exceeded in a tenth of the time of the span)."""

    statistics: dict[str, float]
    contact_N: float  # noqa: N815  (the unit is newton)
    wall_N: float  # noqa: N815


def gate_of(room: Room, path: str, heads: Floats) -> Gate:
    """Find the door of a room and the floor around heads (n,2) m. Raises SceneError naming the key
    for a room without one door, or one that is not shut."""
    drive = room.drive
    if drive is None or not drive.has_door:
        raise SceneError(f"{path}: drive: a door is needed (door_start_m, door_end_m, outward)")
    if drive.goals or room.body_force or room.period_x_m:
        raise SceneError(f"{path}: one door on a level floor is needed, without goals or a period")
    rooms = rooms_of(heads, room.wall_segments(), room.door())
    if not rooms:
        raise SceneError(f"{path}: walls: with the door they must enclose a room")
    return Gate(
        start=np.array(drive.door_start_m),
        end=np.array(drive.door_end_m),
        outward=np.array(drive.outward),
        floor=shapely.union_all(rooms),
    )


def waiting(gate: Gate, people: int, seed: int) -> Floats:
    """Put people at random before a gate, 3 per m² from 0.5 m on: (n,2) m. Raises SceneError where they do
    not fit."""
    ends = tuple(gate.start), tuple(gate.end)
    free = gate.floor.difference(shapely.LineString(ends).buffer(FREE_M))
    radius = np.full(people, np.sqrt(COVER / (START_PER_M2 * np.pi)))
    return places(gate.floor, [], [Doorway(ends=ends, start=free)], [people], radius, seed)


def uniform(seed: int, number: int) -> Floats:
    """Draw the numbers (k,) from 0 to 1 of a run's PRIOR: the same on every processor."""
    return np.random.default_rng([seed, number]).random(len(PRIOR))


def crowd_of(drawn: Floats) -> dict[str, float]:
    """Give the parameters that numbers (k,) from 0 to 1 stand for."""
    crowd: dict[str, float] = {}
    for (name, (low, high, power)), u in zip(PRIOR.items(), drawn, strict=True):
        top = min(high, crowd["time_gap_s"]) if name == "relaxation_time_s" else high
        crowd[name] = low + (top - low) * float(u**power)
    return crowd


def scene_of(site: Site, crowd: Mapping[str, float | None], seed: int) -> Scene:
    """Make the scene of a crowd; without a time gap everybody pushes for ever."""
    random, drive = np.random.default_rng([seed, 1]), site.room.drive
    assert drive is not None
    share = 1 + SPREAD * (2 * random.random(site.people) - 1)
    snapshot = Snapshot(
        position=waiting(site.gate, site.people, seed) if site.start is None else site.start,
        radius=(crowd["radius_m"] or 0.0) * share,
        mass=np.full(site.people, MASS_KG),
    )
    way = {key: getattr(drive, key) for key in OF_DOOR}
    law = {key: crowd[key] for key in PRIOR if key not in NO_DRIVE}
    if law["time_gap_s"] is None:
        law = {key: law[key] for key in ("speed_m_per_s", "relaxation_time_s")}
    else:
        law["seed"] = seed % 4_000_000_000
    duration = PATIENCE * site.duration_s + AFTER_S
    frames = max(1, round(duration / STEP_S))
    run = {"duration_s": STEP_S * frames, "frames": frames, "rigid_step_s": RIGID_STEP_S}
    contact = ContactModel(stiffness_N_per_m=1e6, restitution=0.0, friction=crowd["friction"] or 0.0)
    stated = {
        "drive": Drive.model_validate(way | law), "contact": contact, "run": Run.model_validate(run)
    }
    scene = Scene.of(site.room.model_copy(update=stated), name="infer", snapshot=snapshot)
    return scene.round_walls()


def simulate(site: Site, crowd: Mapping[str, float | None], seed: int) -> Ran | None:
    """Run a crowd until the last departure that counts; None where a step is not solved."""
    scene = scene_of(site, crowd, seed)
    motion, windows = motion_of(scene, scene.snapshot), WindowSums(len(scene.snapshot))
    tracks, contact, wall = [], [0.0], [0.0]
    steps, needed, after = round(STEP_S / motion.step), site.span[1] + 1, AFTER_S
    try:
        motion.separate()
        tracks.append(motion.position.copy())
        for number in range(1, scene.run.frames + 1):
            for _ in range(steps):
                done = motion.advance()
                windows.add(done.neighbours, done.reaction, done.friction)
            tracks.append(motion.position.copy())
            found = windows.close(number * STEP_S)
            force = lengths(found.impulse) / STEP_S
            contact.append(float(force.max(initial=0.0)))
            wall.append(float(force[found.is_wall].sum()))
            gone = int((site.gate.ahead(motion.position) <= 0).sum())
            after -= STEP_S * (gone >= needed)
            if after <= 0:
                break
    except StepError:
        return None
    position = np.array(tracks)
    seen = swayed(position, crowd["sway_m"] or 0.0, seed)
    left = np.sort(departures(site.gate, position))
    begin, end = (int(min(left[k], len(position) - 1)) for k in site.span)
    rows = slice(min(begin, end - 1), end + 1)
    loads = (float(np.quantile(each[rows], HIGH)) for each in (contact, wall))
    return Ran(measure(site.gate, seen, site.span), *loads)


def swayed(position: Floats, sway: float, seed: int) -> Floats:
    """Add the sway of heads to tracks (f,n,2) m: with a standard deviation (m) along and across."""
    random, (low, high) = np.random.default_rng([seed, 2]), SWAY_HZ
    shape = (SWAYS, 1, *position.shape[1:])
    turning = 2 * np.pi * (low + (high - low) * random.random(shape))
    phase = 2 * np.pi * random.random(shape)
    time = STEP_S * np.arange(len(position))[None, :, None, None]
    return np.asarray(position + sway * np.sqrt(2 / SWAYS) * np.cos(turning * time + phase).sum(0))
