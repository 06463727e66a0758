"""What a scene file holds besides its disks: walls, drive, contact law, run, analysis, and what was
done to the heads of a real crowd."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, Strict, ValidationInfo, WithJsonSchema, model_validator

from analysis.scene.drive import Drive
from analysis.scene.fields import Count, FileName, Number, Period, Point, Positive, Schema, means_of
from analysis.scene.law import AS_HERTZ, LAWS, NOMINAL, Elastic, Law, hertz_stiffness
from nscd import Snapshot, Walls
from nscd.segments import lengths
from nscd.stepping import Arms

# The keys that may stand for the stiffness of hertz.
YOUNG, POISSON = "young_modulus_Pa", "poisson_ratio"


def _known_law(name: str) -> str:
    if name not in LAWS:
        *others, last = map(repr, LAWS)
        raise ValueError(f"Input should be {', '.join(others)} or {last}")
    return name


LawName = Annotated[str, AfterValidator(_known_law), WithJsonSchema({"enum": list(LAWS)})]


class ContactModel(Schema):
    """Repel by k·overlap (hooke), K·overlap^1.5 (hertz) or as chests do (body, body_hertz), with a
    dashpot for the asked restitution and Coulomb friction.

    stiffness_N_per_m: N/m, k; of hertz the tangent stiffness at an overlap of 1 % of the mean
        radius; a file may give young_modulus_Pa and poisson_ratio instead
    wall_stiffness_N_per_m: N/m, the same of walls; that of the disks where left out
    restitution: 0 to 1, of two bodies
    friction: coefficient; 0 is none
    tangential_ratio: stiffness of the tangential spring over k
    arm_reach_m: m, the gap between two people, or a person and a wall, from which arms push
    arm_force_N: N, with which they push where bodies touch"""

    law: LawName = "hooke"
    stiffness_N_per_m: Positive  # noqa: N815  (the unit is newton)
    wall_stiffness_N_per_m: Positive | None = None  # noqa: N815
    restitution: Annotated[Number, Field(ge=0, le=1)]
    friction: Annotated[Number, Field(ge=0, le=10)] = 0.0
    tangential_ratio: Annotated[Number, Field(gt=0, le=1)] = 2 / 7
    arm_reach_m: Annotated[Number, Field(gt=0, le=1)] | None = None
    arm_force_N: Positive | None = None  # noqa: N815

    @model_validator(mode="after")
    def _both_or_none(self) -> ContactModel:
        if (self.arm_reach_m is None) != (self.arm_force_N is None):
            missing = "arm_reach_m" if self.arm_reach_m is None else "arm_force_N"
            raise ValueError(f"{missing}: arms need both arm_reach_m and arm_force_N")
        return self

    @property
    def arms(self) -> Arms | None:
        """Give the outer layer, where there is one."""
        if self.arm_reach_m is None or self.arm_force_N is None:
            return None
        return Arms(self.arm_reach_m, self.arm_force_N)

    @property
    def kind(self) -> Law:
        """Give the law itself."""
        return LAWS[self.law]

    @property
    def at_walls(self) -> float:
        """Give the stiffness of walls (N/m)."""
        if self.kind.own_stiffness:
            return NOMINAL[1]
        return self.wall_stiffness_N_per_m or self.stiffness_N_per_m

    def elastic(self, mean_radius: float) -> Elastic:
        """Give the springs of pairs and of walls, for disks of mean radius (m)."""
        return self.kind.springs(self.stiffness_N_per_m, self.at_walls, mean_radius)

    def stiffest(self, mean_radius: float) -> float:
        """Compute the stiffness (N/m) that time steps follow: the larger of disks and walls; of
        bodies the tangent at a wall at a depth of the mean radius (m); and of arms."""
        arms = self.arms.stiffness if self.arms else 0.0
        if self.kind.own_stiffness:
            return max(arms, self.elastic(mean_radius).wall.tangent(mean_radius, mean_radius))
        return max(arms, self.at_walls, self.stiffness_N_per_m)

    @model_validator(mode="before")
    @classmethod
    def _of_bodies(cls, value: Any) -> Any:
        """Refuse friction that a law has not; put the stiffness of a body where the law has it."""
        law = LAWS.get(str(value.get("law"))) if isinstance(value, dict) else None
        if law is not None and not law.friction and value.get("friction"):
            raise ValueError(f"friction: law = {value['law']} has none. Take law = {AS_HERTZ}")
        if law is None or not law.own_stiffness:
            return value
        for key in ("stiffness_N_per_m", "wall_stiffness_N_per_m"):
            if value.get(key) not in (None, NOMINAL[0]):
                raise ValueError(f"{key}: law = {value['law']} has a stiffness of its own")
        return value | {"stiffness_N_per_m": NOMINAL[0], "wall_stiffness_N_per_m": None}

    @model_validator(mode="before")
    @classmethod
    def _of_material(cls, raw: Any, info: ValidationInfo) -> Any:
        """Put the stiffness in the place of Young's modulus and Poisson's ratio."""
        if not isinstance(raw, dict) or not {YOUNG, POISSON} & raw.keys():
            return raw
        rest = {key: value for key, value in raw.items() if key not in (YOUNG, POISSON)}
        if "stiffness_N_per_m" in rest or rest.get("law") != "hertz":
            raise ValueError(f"{YOUNG}: only for law = hertz, and instead of stiffness_N_per_m")
        material = Material.model_validate({key: raw.get(key) for key in (YOUNG, POISSON)})
        means = means_of(info)
        if means is None:
            raise ValueError(f"{YOUNG}: only where the radius of the disks is known")
        radius, _ = means
        stiffness = hertz_stiffness(material.young_modulus_Pa, material.poisson_ratio, radius)
        return rest | {"stiffness_N_per_m": stiffness}


class Material(Schema):
    """What bodies are made of.

    young_modulus_Pa: Pa, E
    poisson_ratio: ν"""

    young_modulus_Pa: Positive  # noqa: N815  (the unit is pascal)
    poisson_ratio: Annotated[Number, Field(gt=-1, le=0.5)]


Extent = Annotated[Number, Field(ge=0)]
Counted = Annotated[int, Strict(), Field(ge=0)]

# What two keys say in the words of a table.
DECILE = ("decile", "that a tenth of people exceed")
SHARE = ("moved share over 1 cm", "share of people moved by more than 1 cm")


class Reconciliation(Schema):
    """Record how heads became disks that do not overlap: where they come from, what was there and
    how far people were moved. A length is in m, a density in 1/m², as its name says.

    Overlaps are those of pairs of disks; densities are local ones (one over the area of each
    person's Voronoi cell within the room and within 0.8 m of the person): the mean over people, and
    what a tenth of the people exceed (the largest is an artefact of cells that the door cuts); none
    where the cells could not be computed."""

    file: str
    frame: Annotated[int, Strict()]
    people: Counted
    left_out: Counted
    radius_m: Positive
    radius_sd_m: Positive | None = None
    velocity_window_s: Positive
    overlaps_before: Counted
    wall_overlaps_before: Counted
    overlap_before_largest_m: Extent
    overlap_before_mean_m: Extent
    overlap_before_sum_m: Extent
    overlap_after_m: Extent
    moved_mean_m: Extent
    moved_rms_m: Extent
    moved_largest_m: Extent
    moved_share_over_1_cm: Annotated[Number, Field(ge=0, le=1)]
    moved_mean_x_m: Number
    moved_mean_y_m: Number
    density_before_mean_per_m2: Extent | None = None
    density_before_decile_per_m2: Extent | None = None
    density_after_mean_per_m2: Extent | None = None
    density_after_decile_per_m2: Extent | None = None
    contacts_after: Counted
    wall_contacts_after: Counted
    linearisations: Counted

    @property
    def statement(self) -> str:
        """What this scene is and is not, one paragraph in words."""
        overlap, mean = 100 * self.overlap_before_largest_m, 100 * self.overlap_before_mean_m
        moved, maximum = 100 * self.moved_mean_m, 100 * self.moved_largest_m
        fraction = 100 * self.moved_share_over_1_cm
        filmed = self.people + self.left_out
        spread = f" (standard deviation {self.radius_sd_m:.3g} m)" if self.radius_sd_m else ""
        before, after = self.density_before_decile_per_m2, self.density_after_decile_per_m2
        density = "The local densities are missing: their Voronoi cells could not be computed. "
        if before is not None and after is not None:
            density = (
                "The local density that a tenth of the people exceed went from "
                f"{before:.1f} to {after:.1f} people per m². "
            )
        return (
            f"Heads are not bodies. {self.file}, frame {self.frame}, has the heads of {filmed} "
            f"people. {self.left_out} outside the walls were left out. The other {self.people} became "
            f"disks of radius {self.radius_m:.4g} m{spread} round the heads. These overlapped each other "
            f"{self.overlaps_before} times, by up to {overlap:.1f} cm (mean {mean:.1f} cm), and walls "
            f"{self.wall_overlaps_before} times. They were moved until none overlap, together as "
            "little as possible (least sum of squares, a local "
            f"minimum). They moved by {moved:.1f} cm in the mean and {maximum:.1f} cm at most, "
            f"{fraction:.0f} % of the people by more than 1 cm. {density}Contacts afterwards: "
            f"{self.contacts_after} between people, {self.wall_contacts_after} with walls. Who "
            "touches whom is an outcome of the stated radius and of this rule, not an "
            "observation, and so are the forces computed from it."
        )

    def rows(self) -> list[tuple[str, float | int | str]]:
        """List name with unit and value, in the order of the fields, for a table."""
        units = {"_per_m2": " (1/m²)", "_m": " (m)", "_s": " (s)"}
        rows: list[tuple[str, float | int | str]] = []
        for key, value in self.model_dump(exclude_none=True).items():
            unit = next((end for end in units if key.endswith(end)), "")
            words = key.removesuffix(unit).replace("_", " ").replace(*DECILE).replace(*SHARE)
            rows.append((words + units.get(unit, ""), value))
        return rows


class OtherFrames(Schema):
    """Name frames of the same film, near in time, that became crowds in the same way.

    frames: their numbers in the file
    after_s: s after the scene's own frame, negative before it
    data: names of their data files, in the folder of the scene
    refused: numbers of frames that could not be made crowds"""

    frames: tuple[Annotated[int, Strict()], ...]
    after_s: tuple[Number, ...]
    data: tuple[FileName, ...]
    refused: tuple[Annotated[int, Strict()], ...] = ()

    @model_validator(mode="after")
    def _one_of_each(self) -> OtherFrames:
        if not len(self.frames) == len(self.after_s) == len(self.data):
            raise ValueError("frames, after_s and data need one entry per frame")
        if len(set(self.frames)) < len(self.frames) or set(self.frames) & set(self.refused):
            raise ValueError("frames: one is there twice, or refused too")
        return self

    @staticmethod
    def files(scene: str, frames: Sequence[int]) -> tuple[str, ...]:
        """Name the data files of the frames of a scene."""
        return tuple(f"{scene}_{number}.data" for number in frames)

    @property
    def statement(self) -> str:
        """Say which frames there are, in one line."""
        found = [
            f"{number} ({time:+.3g} s)"
            for number, time in sorted(zip(self.frames, self.after_s, strict=True))
        ]
        words = f"Other frames of the film: {', '.join(found) or 'none'}."
        if self.refused:
            left = ", ".join(str(number) for number in sorted(self.refused))
            words += f" Of frames that were tried, these could not be made crowds: {left}."
        return words.replace("-", "−")

    def rows(self) -> list[tuple[str, float | int | str]]:
        """List the frames for a table."""
        rows: list[tuple[str, float | int | str]] = []
        for words, numbers in (("became", self.frames), ("could not become", self.refused)):
            if numbers:
                frames = ", ".join(str(number) for number in sorted(numbers))
                rows.append((f"other frames that {words} crowds", frames))
        return rows

    def of(self, scene: str) -> OtherFrames:
        """Name the data files after another scene."""
        return self.model_copy(update={"data": self.files(scene, self.frames)})


class Wall(Schema):
    """Name a straight wall, which stands, or gives along its normal n as a mass on a spring with a
    damper: m s'' + c s' + k s = F·n with the force F of all contacts on it.

    name: a word of letters, digits and underscores
    start_m, end_m: m
    mass_kg: kg, m of a wall that gives
    stiffness_N_per_m, damping_N_s_per_m: N/m and N·s/m, k and c; 0 where left out"""

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w{0,99}$")]
    start_m: Point
    end_m: Point
    mass_kg: Positive | None = None
    stiffness_N_per_m: Annotated[Number, Field(ge=0)] | None = None  # noqa: N815
    damping_N_s_per_m: Annotated[Number, Field(ge=0)] | None = None  # noqa: N815

    @property
    def oscillator(self) -> tuple[float, float, float] | None:
        """Give m, k and c of a wall that gives; None of one that stands."""
        if self.mass_kg is None:
            return None
        return self.mass_kg, self.stiffness_N_per_m or 0.0, self.damping_N_s_per_m or 0.0

    @property
    def normal(self) -> Point:
        """Give the unit vector along which a wall gives: to the left on the way from start to end."""
        along = self.end_m[0] - self.start_m[0], self.end_m[1] - self.start_m[1]
        length = float(lengths(np.array(along)))
        return -along[1] / length, along[0] / length

    @model_validator(mode="after")
    def _is_whole(self) -> Wall:
        if self.start_m == self.end_m:
            raise ValueError("start_m and end_m are the same point")
        for key in ("stiffness_N_per_m", "damping_N_s_per_m"):
            if getattr(self, key) is not None and self.mass_kg is None:
                raise ValueError(f"{key}: a wall that gives needs a mass: give mass_kg")
        return self


# m/s², standard gravity.
GRAVITY = 9.80665


class BodyForce(Schema):
    """Accelerate everybody alike, as gravity does on a slope: by g sin(slope) downhill. What presses
    people on the ground is no force in its plane.

    acceleration_m_per_s2: (x, y) m/s²; the force on a disk is its mass times this
    slope_deg, downhill: instead of it, degrees and a unit vector"""

    acceleration_m_per_s2: Point | None = None
    slope_deg: Annotated[Number, Field(gt=0, lt=90)] | None = None
    downhill: Point | None = None

    @property
    def acceleration(self) -> Point:
        """Give (x, y) m/s²."""
        if self.acceleration_m_per_s2 is not None:
            return self.acceleration_m_per_s2
        assert self.slope_deg is not None
        assert self.downhill is not None
        sine = math.sin(math.radians(self.slope_deg))  # 12 digits are those of every processor
        along = GRAVITY * float(f"{sine:.12g}")
        return along * self.downhill[0], along * self.downhill[1]

    @model_validator(mode="after")
    def _one_way(self) -> BodyForce:
        inputs = self.acceleration_m_per_s2, self.slope_deg, self.downhill
        if [one is None for one in inputs] not in ([False, True, True], [True, False, False]):
            raise ValueError("acceleration_m_per_s2, or slope_deg and downhill, are needed")
        if self.downhill is not None and abs(lengths(np.array(self.downhill)) - 1) > 1e-9:
            raise ValueError("downhill must be a unit vector")
        return self


class Run(Schema):
    """Say how long to simulate and how often to write.

    duration_s: s
    frames: how many after the first
    time_step_s: s, of LAMMPS and YADE at most; it is shortened to fit between frames. Follows from
        the stiffness where left out
    drive_interval_steps: steps between two evaluations of the drive, in LAMMPS and YADE
    rigid_step_s: s, of the rigid engine at most; it is shortened to fit between frames. Follows
        from radius and speed where left out
    rigid_tolerance: of the contact problem of a step; where left out 1e-8, with friction 1e-3
    impulses: whether LAMMPS and YADE sum the impulses of contacts between frames, which costs time;
        the rigid engine always does"""

    duration_s: Positive
    frames: Count
    time_step_s: Positive | None = None
    drive_interval_steps: Count = 10
    rigid_step_s: Positive | None = None
    rigid_tolerance: Annotated[Number, Field(ge=1e-12, le=0.1)] | None = None
    impulses: Annotated[bool, Strict()] | None = None


class Analysis(Schema):
    """Say which percussions are compared with which forces.

    kind: driven: p/τ with the force at time_s; impact: p of the initial state with ∫f dt over the
        run
    time_s: s
    contact_tolerance_m: m, gap up to which disks are in contact"""

    kind: Literal["driven", "impact"]
    time_s: Annotated[Number, Field(ge=0)] = 0.0
    contact_tolerance_m: Positive = 1e-6

    @model_validator(mode="after")
    def _whole_impact(self) -> Analysis:
        if self.kind == "impact" and self.time_s:
            raise ValueError("time_s: an impact is compared over its whole run. Leave it out")
        return self


class Room(Schema):
    """Hold a scene without its disks: what `percussions import` puts a crowd into.

    period_x_m: m, two places along x that are one: who leaves at the one comes in at the other"""

    title: str
    source: str
    period_x_m: Period | None = None
    walls: tuple[Wall, ...] = ()
    drive: Drive | None = None
    body_force: BodyForce | None = None
    contact: ContactModel
    run: Run
    analysis: Analysis

    @model_validator(mode="after")
    def _a_door_ahead(self) -> Room:
        drive = self.drive
        if drive and drive.keeps_distance and not (self.period_x_m or drive.all_have_doors):
            raise ValueError(
                "drive.time_gap_s: who has no door ahead keeps no distance. Give door_start_m"
            )
        return self

    def __repr__(self) -> str:
        return f"<Room: {self._shown()}>"

    def _shown(self) -> str:
        law = f"{self.contact.law} {self.contact.stiffness_N_per_m:g} N/m"
        return f"{len(self.walls)} walls, {self.analysis.kind}, {law}, {self.run.duration_s:g} s"

    def wall_segments(self) -> Walls:
        """Give the walls as nscd takes them, in the room's order."""
        return Walls(
            start=np.array([wall.start_m for wall in self.walls]).reshape(-1, 2),
            end=np.array([wall.end_m for wall in self.walls]).reshape(-1, 2),
            period_x=self.period_x_m,
        )

    def giving(self) -> list[Wall]:
        """List the walls that give."""
        return [wall for wall in self.walls if wall.oscillator]

    def check_period(self, snapshot: Snapshot) -> None:
        """Raise ValueError naming the field for a period that is shorter than two diameters, disks
        that are not in it, and walls that do not go on across its ends."""
        if self.period_x_m is None:
            return
        low, high = self.period_x_m
        reach = 2 * float(snapshot.radius.max())
        reach += self.contact.arms.reach if self.contact.arms else 0.0
        if not high - low > 2 * reach:
            message = "two diameters" + (" and reaches of arms" if self.contact.arms else "")
            raise ValueError(
                f"period_x_m: {high - low:g} m. More than {message}, {2 * reach:g} m, is needed"
            )
        x = snapshot.position[:, 0]
        if (out := (x < low) | (x >= high)).any():
            who = snapshot.ids[np.argmax(out)]
            raise ValueError(f"period_x_m: disk {who} is not in it, from {low:g} to {high:g} m")
        if snapshot.compound is not None:
            raise ValueError("period_x_m: only for people of one disk each, without disks.bodies")
        if self.giving():
            raise ValueError(f"period_x_m: wall {self.giving()[0].name} gives. Leave out mass_kg")
        if self.drive and self.drive.gates:
            raise ValueError(
                "period_x_m: a corridor without end has no door. Leave out door_start_m"
            )
        ends = {point for wall in self.walls for point in (wall.start_m, wall.end_m)}
        for wall in self.walls:
            (x0, y0), (x1, y1) = sorted([wall.start_m, wall.end_m])
            for at, end, other in ((x0, low, high), (x1, high, low)):
                if at == end and y0 == y1 and (other, y0) in ends:
                    continue
                if (at - end) * (other - end) < reach * (high - low):
                    raise ValueError(
                        f"period_x_m: wall {wall.name} comes within {reach:g} m of x = {end:g} m. It "
                        "must keep away, or be level there and go on at the other end"
                    )

    def acceleration(self) -> Point:
        """Give the acceleration (x, y) m/s² of the body force; 0 where there is none."""
        return self.body_force.acceleration if self.body_force else (0.0, 0.0)

    def door(self) -> Walls | None:
        """Give the doors as segments, where there is a drive."""
        if self.drive is None or not self.drive.gates:
            return None
        ends = np.array(self.drive.gates)
        return Walls(start=ends[:, 0], end=ends[:, 1])
