"""What was done to the heads of a real crowd to make a scene of them: the part `[reconciliation]`
of a scene file."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Length = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0)]


class Reconciliation(BaseModel):
    """Record how heads became disks that do not overlap: where they come from, what was there and
    how far people were moved. A length is in m, a density in 1/m², as its name says.

    Overlaps are those of pairs of disks; densities are local ones (one over the area of each
    person's Voronoi cell within the room and within 0.8 m of the person): the mean over people, and
    what a tenth of the people exceed (the largest is an artefact of cells that the door cuts)."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    file: str
    frame: int
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
    moved_share_over_1_cm: Annotated[float, Field(ge=0, le=1)]
    moved_mean_x_m: float
    moved_mean_y_m: float
    density_before_mean_per_m2: Length
    density_before_decile_per_m2: Length
    density_after_mean_per_m2: Length
    density_after_decile_per_m2: Length
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
        return (
            f"Heads are not bodies. {self.file}, frame {self.frame}, has the heads of {heads} "
            f"people; {self.left_out} outside the walls were left out. As disks "
            f"of radius {self.radius_m:.4g} m{spread} round the heads, the other {self.people} had "
            f"overlaps: {self.overlaps_before} with each other, by up to {overlap:.1f} cm "
            f"({mean:.1f} cm in the mean), and {self.wall_overlaps_before} with walls. They were moved until none "
            "overlap, together as little as possible (least sum of squares, a local minimum): "
            f"{moved:.1f} cm in the mean, {most:.1f} cm at most, {share:.0f} % of the people more "
            "than 1 cm. The local density that a tenth of the people exceed went from "
            f"{before:.1f} to {after:.1f} people per m². Contacts afterwards: "
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
            rows.append((key.removesuffix(unit).replace("_", " ") + units.get(unit, ""), value))
        return rows
