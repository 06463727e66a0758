"""The picture of Fig. 10: pressure and speed against the density."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREEN, ORANGE, PINK
from analysis.paper.continuum.exit_room import PERSON, TIME_STEP
from nscd.arrays import Floats
from nscd.continuum.rivals.density_laws import ExponentialSpeed, KladekSpeed, PowerPressure


def curves(
    density: Floats,
    *,
    largest: Floats,
    mean: Floats,
    measured: Floats,
    printed: Floats,
    speed: Floats,
    adapted: tuple[Floats, Floats],
) -> Figure:
    """Against the density (k,) people/m²: `largest` and `mean` percussion of (11) (N·s/m); (M1)
    `measured` and as `printed` (people/s²); mean speed (m/s) of (11), and where the left speed is
    `adapted` (density, speed)."""
    figure = Figure(figsize=(13.0, 4.8), layout="constrained")
    forces, numbers, speeds = figure.subplots(1, 3)
    fine = np.linspace(density[0], density[-1], 200)
    power = PowerPressure().pressure
    forces.plot(density, largest / TIME_STEP, "o-", color=BLUE, label="(11) over δt, largest")
    forces.plot(
        density, mean / TIME_STEP, "o--", mfc="none", color=BLUE, label="(11) over δt, mean"
    )
    forces.plot(density, PERSON * measured, "s-.", color=ORANGE, label="(M1)")
    forces.plot(fine, PERSON * power(fine), "-", color=BLACK, label="(M2)")
    forces.set(yscale="log", ylabel="pressure (N/m)", title="(a) in one unit")
    numbers.plot(density, largest / PERSON, "o-", color=BLUE, label="(11), largest, not divided")
    numbers.plot(
        density, mean / PERSON, "o--", mfc="none", color=BLUE, label="(11), mean, not divided"
    )
    numbers.plot(density, printed, "D:", color=PINK, label="(M1) as printed")
    numbers.plot(fine, power(fine), "-", color=BLACK, label="(M2)")
    numbers.set(ylabel="number per person, units mixed", title="(a) as plain numbers")
    speeds.plot(density, speed, "o-", color=BLUE, label="(11), 2 m/s wanted")
    speeds.plot(*adapted, "^--", mfc="none", color=GREEN, label="(11), speed of (L2) wanted")
    speeds.plot(fine, ExponentialSpeed().speed(fine), "-.", color=ORANGE, lw=2, label="(L1)")
    speeds.plot(fine, KladekSpeed().speed(fine), "-", color=BLACK, label="(L2)")
    speeds.set(ylabel="speed (m/s)", title="(b) mean speed", ylim=(-0.05, None))
    for axes in (forces, numbers, speeds):
        axes.set_xlabel("density (people/m²)")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    return figure
