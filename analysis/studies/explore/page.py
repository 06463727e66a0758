"""The page explore.html: the compiled core, scenes, and what draws and steers them."""

import base64
import gzip
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.pages.drawing import above_colours, scene_picture
from analysis.pages.html import drawn, write_html
from analysis.pages.section import Drawn, Picture, Section
from analysis.scene.scene import Scene, SceneError, read_scene, scene_names
from analysis.studies.explore.compiled import WASM
from analysis.studies.explore.page_input import (
    FAR_M,
    MOST_BYTES,
    MOST_PEOPLE,
    MOST_WALLS,
    TIME_GAP_S,
    rules,
)
from analysis.studies.exposure.limits import limits_of_bodies

PAGE, FIRST = "explore.html", "arch"


def offered() -> list[Scene]:
    """List the product's scenes that are pressed and that the page can step."""
    names = [FIRST, *(name for name in scene_names() if name != FIRST)]
    return [one for one in map(read_scene, names) if live_of(one)]


def refused(scene: Scene) -> str:
    """Say why the page cannot step a scene: its key; nothing where it can."""
    if scene.snapshot.bodies is not None:
        return "disks.bodies"
    return "walls.mass_kg" if scene.giving() else ""


def live_of(scene: Scene) -> str:
    """Return the name of a scene that is pressed and that the page can step; else nothing."""
    return scene.name if scene.analysis.kind == "driven" and not refused(scene) else ""


def content_of(scene: Scene) -> dict[str, Any]:
    """What the page knows of a scene: the content of its file, its disks, and the way on a grid, as
    runs of cells. Raises SceneError for what only another engine steps."""
    if key := refused(scene):
        raise SceneError(f"{scene.name}: {key}: not on this page. Use percussions run")
    disks, way = scene.snapshot, scene.drive.way if scene.drive else None
    vectors = {"x": disks.position, "u": disks.velocity, "r": disks.radius, "m": disks.mass}
    found = {
        "name": scene.name,
        "notes": scene.notes,
        "content": scene.content(),
        "disks": {"id": disks.ids.tolist(), "w": disks.spin.tolist()}
        | {key: values.ravel().tolist() for key, values in vectors.items()},
    }
    if way:
        onward = np.clip(way.onward, 0.0, FAR_M)
        found["way"] = json.loads(way.to_json(scene.wall_segments())) | {
            "onward_m": onward.tolist()
        }
    return found


def packed(content: bytes) -> str:
    """Write bytes as base64 of their gzip."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


def still_of(scene: Scene) -> Drawn:
    """Draw what stands for the page where it cannot run: small, as on telephones."""
    caption = f"{scene.title}, before it is pressed."
    made = drawn(Picture(name="explore", caption=caption, figure=scene_picture(scene)))
    return replace(made, png=made.narrow or made.png, narrow=b"")


def write_explore(
    scenes: Sequence[Scene], folder: Path, command: str, still: Picture | Drawn | None = None
) -> Path:
    """Write the page with these scenes, the first of which opens, and the picture that stands for it
    where it cannot run, into a folder; return its path. Raises SceneError for a scene that it cannot
    step."""
    limits = limits_of_bodies()
    content = {
        "scenes": [content_of(scene) for scene in scenes],
        "limits": [one.number for one in limits],
        "above": above_colours(len(limits)),
        "rules": rules(),
    }
    shown = still or still_of(scenes[0])
    return write_html(
        folder / PAGE,
        PAGE,
        [Section(number="", title="", pictures=[shown])],
        contents=(),
        still=shown,
        core=packed(WASM.read_bytes()),
        data=packed(json.dumps(content, separators=(",", ":"), allow_nan=False).encode()),
        gap=TIME_GAP_S,
        most={"people": MOST_PEOPLE, "walls": MOST_WALLS, "bytes": MOST_BYTES},
        command=command,
    )
