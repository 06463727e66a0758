"""Picture of crowds by their distance to the exit."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, ORANGE
from analysis.paper.discrete.pressed_crowd.arch import RING_M, Arch

STYLES = {"unequal masses": ("s-", ORANGE, "."), "equal masses": ("o--", BLUE, "x")}


def rings(archs: Mapping[str, Arch]) -> Figure:
    """Draw speed on the right and force of each person, and their means over rings."""
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    panels = figure.subplots(1, 2)
    for name, arch in archs.items():
        style, colour, dot = STYLES[name]
        ring, inside, distance = arch.rings(), arch.inside(), arch.distance()
        held = [r for r in range(int(ring.max()) + 1) if (ring == r).any()]
        middles = [(r + 0.5) * RING_M for r in held]
        speed = np.hypot(*arch.answer.right_velocity.T)
        for axis, values in zip(panels, (speed, arch.carried() / 1e3), strict=True):
            axis.plot(distance[inside], values[inside], dot, ms=3, color=colour, alpha=0.35)
            means = [values[ring == r].mean() for r in held]
            label = f"{name}: mean of rings of {RING_M:g} m"
            axis.plot(middles, means, style, color=colour, mec=BLACK, label=label)
    for axis, label in zip(
        panels, ("right speed |u⁺| (m/s)", "sum of normal magnitudes (kN)"), strict=True
    ):
        axis.set(xlabel="distance from the middle of the exit (m)", ylabel=label, ylim=(0, None))
        axis.legend(fontsize=8, loc="upper right")
    return figure
