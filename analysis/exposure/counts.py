"""How many people are above each limit in a window, as numbers of a series."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from analysis.dumps.windows import Window
from analysis.exposure.limits import QUANTITIES, Limit, known_limits
from analysis.exposure.loads import loads_of
from analysis.scene.scene import Scene


@lru_cache(maxsize=8)
def limits_of_people(files: tuple[Path, ...] = ()) -> tuple[Limit, ...]:
    """List the product's limits of a person and those of further files, the smallest first, those
    of a force before others. Raises LimitError."""
    of_people = [one for one in known_limits(files) if QUANTITIES[one.quantity].of == "person"]
    return tuple(sorted(of_people, key=lambda one: (one.quantity, one.number)))


def above_key(limit: Limit) -> str:
    """Name the series of how many people are above a limit."""
    return f"above_{limit.name}"


def exposure_values(
    scene: Scene, window: Window, limits: tuple[Path, ...] = ()
) -> dict[str, float]:
    """Count who is above each limit (files: of users), and find the largest load on any metre of any wall (kN/m)."""
    loads = loads_of(scene, window)
    counts = {above_key(one): float(loads.above(one).sum()) for one in limits_of_people(limits)}
    return counts | {"wall_line_load": float(loads.wall["wall_line_load"].max(initial=0.0))}
