"""Seven small scenes of discs that any engine of rigid bodies can run, as plain data.

Walls are half-planes (a point and the normal out of them), so that 3-D engines take planes or thick
boxes. Bodies of scenes that do not turn are blocks as far as mechanics goes. Forces are recorded in
[from, until] at every step, of `step_s` in engines of rigid bodies and of `fine_step_s` in those of springs."""

from __future__ import annotations

import math
from typing import Any

G, FLOOR, LEFT = 9.81, [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]
TILT = math.radians(10.0)
SLEPT, FRICTION = 5.0, 0.3  # s; μ of scenes that are not about it


def right(x: float) -> list[float]:
    """Give the wall to the right at x (m)."""
    return [x, 0.0, -1.0, 0.0]


def disc(x: float, y: float, r: float = 0.25, v: tuple[float, float] = (0.0, 0.0)) -> list[float]:
    """Give a body: x, y, radius (m), mass (kg), velocity (m/s)."""
    return [x, y, r, 75.0 * (r / 0.25) ** 2, *v]


def scene(window: tuple[float, float], bodies: list[list[float]], walls: list[list[float]], **rest: Any) -> dict[str, Any]:
    """Give a scene, of bodies without friction that do not turn where `rest` does not say otherwise."""
    maximum = {"gravity": [0.0, -G], "friction": 0.0, "turns": False, "substeps": 1, "step_s": 0.005, "fine_step_s": 2e-4}
    return maximum | {"from_s": window[0], "until_s": window[1], "stiffness": 1e6, "bodies": bodies, "walls": walls} | rest


def stacked(window: tuple[float, float], substeps: int = 1) -> dict[str, Any]:
    """Three discs in a slot, each against the other wall than the one below: no friction, all is determined."""
    rise = math.sqrt(0.5**2 - 0.2**2)
    bodies = [disc(0.25, 0.25), disc(0.45, 0.25 + rise), disc(0.25, 0.25 + 2 * rise)]
    return scene(window, bodies, [FLOOR, LEFT, right(0.7)], substeps=substeps)


def scenes() -> dict[str, dict[str, Any]]:
    """Give all scenes by name."""
    radius = [0.2 + 0.01 * (7 * k % 11) / 2 for k in range(20)]
    heap = [disc(0.27 + 0.52 * (k // 4), 0.27 + 0.52 * (k % 4), radius[k]) for k in range(20)]
    rows = [divmod(k, 4) for k in range(20)]
    fall = [disc(0.3 + 0.52 * column + 0.03 * (row % 2), 0.3 + 0.55 * row, radius[k], (0.3 * (-1) ** k, -2.0))
            for k, (row, column) in enumerate(rows)]  # fmt: skip
    wedge = math.sqrt(0.5**2 - 0.26**2)
    row = [disc(0.25 + 0.52 * k, 0.25) for k in range(3)] + [disc(0.51 + 0.52 * k, 0.25 + wedge) for k in range(2)]
    incline = {"gravity": [G * math.sin(TILT), -G * math.cos(TILT)], "friction": 0.5}
    return {
        "corner": scene((0.2, 0.4), heap, [FLOOR, LEFT], gravity=[-4.0, -7.0], friction=FRICTION, turns=True),
        "impacts": scene((0.0, 0.5), fall, [FLOOR, LEFT, right(2.2)], friction=FRICTION, turns=True),
        "sleep": stacked((SLEPT - 0.1, SLEPT)),
        "substeps": stacked((0.2, 0.3), 4),
        "creep": scene((0.3, 0.4), [disc(0.0, 0.25)], [FLOOR], **incline),
        "lift": scene((0.1, 0.3), [disc(0.0, 0.25, v=(3.0, 0.0))], [FLOOR], friction=0.5),
        "supports": scene((0.3, 0.4), row, [FLOOR, LEFT, right(1.54)]),
    }
