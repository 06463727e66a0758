"""What the page takes of links and files: the product's schema of scenes, links to them, and limits."""

from typing import Annotated, Any, Self

from pydantic import BaseModel, Field, Strict, model_validator
from pydantic.json_schema import models_json_schema

from analysis.scene.distance import Distance
from analysis.scene.drive import AHEAD, USUAL_RELAXATION_S
from analysis.scene.fields import SMALLEST, Number, Schema
from analysis.scene.law import AS_HERTZ, LAWS, NOMINAL, hertz_stiffness
from analysis.scene.placement import OVERLAP
from analysis.scene.scene import Room, SceneFile
from analysis.scene.schema import GRAVITY, Reconciliation
from analysis.support.reading import LARGEST_WHOLE

MOST_PEOPLE, MOST_WALLS, MOST_BYTES, FARTHEST_M = 5000, 1000, 4_000_000, 1e4
# m: so far is a door to which no way leads. s: a usual time gap.
FAR_M, TIME_GAP_S = 1e300, 0.6
# Of the page alone, by key: letters, entries, or how large a number may be.
MOST = {
    "title": 1000, "source": 10_000, "walls": MOST_WALLS, "goals": 100, "stops": 100,
    "pushers": 100, "time_gap_s": 100.0,
    **dict.fromkeys(("start_m", "end_m", "door_start_m", "door_end_m", "period_x_m"), FARTHEST_M),
    "speed_m_per_s": 1000.0, "acceleration_m_per_s2": 1000.0, "arm_force_N": 1e6,
}  # fmt: skip
Ids = Annotated[
    tuple[Annotated[int, Strict(), Field(ge=1, le=LARGEST_WHOLE)], ...],
    Field(min_length=1, max_length=MOST_PEOPLE),
]
Count = Annotated[int, Strict(), Field(ge=1, le=MOST_PEOPLE)]
Seed = Annotated[int, Strict(), Field(ge=0, le=4_000_000_000)]
Radius = Annotated[Number, Field(ge=0.01, le=10)]
Mass = Annotated[Number, Field(ge=0.1, le=1e5)]
Place = Annotated[Number, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
Speed = Annotated[Number, Field(ge=-1000, le=1000)]


class Placed(Schema):
    """Say how the page puts people before the doors of a room: how many, their radius (m), a seed."""

    count: Count
    radius: Annotated[Number, Field(ge=0.05, le=1)]
    seed: Seed


class Standing(Schema):
    """Say who of a scene stands where: ids (n), x, y, x, y … (2n) m."""

    id: Ids
    x: tuple[Place, ...]

    @model_validator(mode="after")
    def _of_one_crowd(self) -> Self:
        n = len(self.id)
        if len(set(self.id)) < n:
            raise ValueError("id: one distinct integer per disk is needed")
        for key, value in self:
            if len(value) != n * (2 if key in "xu" else 1):
                raise ValueError(f"{key}: {len(value)} numbers for {n} people")
        return self


class Disks(Standing):
    """Hold a crowd: places and velocities (2n) m, m/s, radii m, masses kg, spins rad/s (n)."""

    u: tuple[Speed, ...]
    r: tuple[Radius, ...]
    m: tuple[Mass, ...]
    w: tuple[Speed, ...]


class Content(Room):
    """Hold what a scene file says, without the names of other files."""

    reconciliation: Reconciliation | None = None


class Link(Schema):
    """Hold what an address of the page says: a scene of the page by name, or a content of its own; and
    its people, where they are not that scene's."""

    base: str = ""
    placed: Placed | None = None
    content: Content | None = None
    disks: Disks | None = None
    standing: Annotated[Standing | None, Field(alias="from")] = None

    @model_validator(mode="after")
    def _one_crowd(self) -> Self:
        if sum(one is not None for one in (self.placed, self.disks, self.standing)) > 1:
            raise ValueError("disks: only one of placed, disks and from")
        if not self.base and (self.content is None or not (self.placed or self.disks)):
            raise ValueError("base: a scene is needed, or a content with placed or disks")
        return self


def rules() -> dict[str, Any]:
    """What the page checks links and files by: JSON schemas without words, limits, and constants that
    validators have."""
    kinds: dict[str, type[BaseModel]]
    kinds = {"scene": SceneFile, "room": Room, "link": Link, "disks": Disks}
    _, schema = models_json_schema([(kind, "validation") for kind in kinds.values()])
    return {
        "$defs": _bare(schema["$defs"]),
        **{name: {"$ref": f"#/$defs/{kind.__name__}"} for name, kind in kinds.items()},
        "laws": {name: [bool(law.friction), law.own_stiffness] for name, law in LAWS.items()},
        "most": MOST, "people": MOST_PEOPLE, "bytes": MOST_BYTES, "largest_id": LARGEST_WHOLE,
        "smallest": SMALLEST, "ahead": AHEAD, "gravity": GRAVITY, "overlap": OVERLAP,
        "relaxation_s": USUAL_RELAXATION_S, "rubbing_law": AS_HERTZ, "nominal": NOMINAL[0],
        "distance": {key: one.default for key, one in Distance.model_fields.items()},
        "time_gap_s": TIME_GAP_S, "per_young_modulus": hertz_stiffness(1.0, 0.0, 1.0),
    }  # fmt: skip


def _bare(node: Any) -> Any:
    """A schema without titles, descriptions and defaults; a pattern's words as of any language."""
    if isinstance(node, list):
        return [_bare(one) for one in node]
    if not isinstance(node, dict):
        return node
    words = {"title", "description", "default", "additionalProperties"}
    found = {
        key: _bare(one) for key, one in node.items() if key not in words or isinstance(one, dict)
    }
    if isinstance(pattern := found.get("pattern"), str):
        letters = r"[\p{Alphabetic}\p{M}\p{Nd}\p{Pc}\p{Join_Control}]"
        found["pattern"] = pattern.replace(r"\w", letters)
    return found
