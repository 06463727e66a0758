"""What was done to the heads of a real crowd to make a scene of them: the parts `[reconciliation]`
and `[other_frames]` of a scene file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, Strict, model_validator

from analysis.scene.values import FileName, Number, Part, Positive

Length = Annotated[Number, Field(ge=0)]
Count = Annotated[int, Strict(), Field(ge=0)]

# What two keys say in the words of a table.
DECILE = ("decile", "that a tenth of people exceed")
SHARE = ("moved share over 1 cm", "share of people moved by more than 1 cm")


class Reconciliation(Part):
    """Record how heads became disks that do not overlap: where they come from, what was there and
    how far people were moved. A length is in m, a density in 1/m², as its name says.

    Overlaps are those of pairs of disks; densities are local ones (one over the area of each
    person's Voronoi cell within the room and within 0.8 m of the person): the mean over people, and
    what a tenth of the people exceed (the largest is an artefact of cells that the door cuts); none
    where the cells could not be computed."""

    file: str
    frame: Annotated[int, Strict()]
    people: Count
    left_out: Count
    radius_m: Positive
    radius_sd_m: Positive | None = None
    velocity_window_s: Positive
    overlaps_before: Count
    wall_overlaps_before: Count
    overlap_before_largest_m: Length
    overlap_before_mean_m: Length
    overlap_before_sum_m: Length
    overlap_after_m: Length
    moved_mean_m: Length
    moved_rms_m: Length
    moved_largest_m: Length
    moved_share_over_1_cm: Annotated[Number, Field(ge=0, le=1)]
    moved_mean_x_m: Number
    moved_mean_y_m: Number
    density_before_mean_per_m2: Length | None = None
    density_before_decile_per_m2: Length | None = None
    density_after_mean_per_m2: Length | None = None
    density_after_decile_per_m2: Length | None = None
    contacts_after: Count
    wall_contacts_after: Count
    linearisations: Count

    @property
    def statement(self) -> str:
        """What this scene is and is not, one paragraph in words."""
        overlap, mean = 100 * self.overlap_before_largest_m, 100 * self.overlap_before_mean_m
        moved, most = 100 * self.moved_mean_m, 100 * self.moved_largest_m
        share = 100 * self.moved_share_over_1_cm
        heads = self.people + self.left_out
        spread = f" (standard deviation {self.radius_sd_m:.3g} m)" if self.radius_sd_m else ""
        before, after = self.density_before_decile_per_m2, self.density_after_decile_per_m2
        density = "The local densities are missing: their Voronoi cells could not be computed. "
        if before is not None and after is not None:
            density = (
                "The local density that a tenth of the people exceed went from "
                f"{before:.1f} to {after:.1f} people per m². "
            )
        return (
            f"Heads are not bodies. {self.file}, frame {self.frame}, has the heads of {heads} "
            f"people; {self.left_out} outside the walls were left out. As disks "
            f"of radius {self.radius_m:.4g} m{spread} round the heads, the other {self.people} had "
            f"overlaps: {self.overlaps_before} with each other, by up to {overlap:.1f} cm "
            f"({mean:.1f} cm in the mean), and {self.wall_overlaps_before} with walls. They were moved until none "
            "overlap, together as little as possible (least sum of squares, a local minimum): "
            f"{moved:.1f} cm in the mean, {most:.1f} cm at most, {share:.0f} % of the people more "
            f"than 1 cm. {density}Contacts afterwards: "
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


class OtherFrames(Part):
    """Name frames of the same film, near in time, that became crowds in the same way.

    frames: their numbers in the file
    after_s: s after the scene's own frame, negative before it
    data: names of their data files, in the folder of the scene
    refused: numbers of frames that could not be made crowds
    """

    frames: tuple[Annotated[int, Strict()], ...]
    after_s: tuple[Number, ...]
    data: tuple[FileName, ...]
    refused: tuple[Annotated[int, Strict()], ...] = ()

    @model_validator(mode="after")
    def _one_of_each(self) -> OtherFrames:
        if not len(self.frames) == len(self.after_s) == len(self.data):
            raise ValueError("frames, after_s and data need one entry per frame")
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
