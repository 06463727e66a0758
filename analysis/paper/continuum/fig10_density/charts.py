"""The picture of Fig. 10: pressure and speed against the density."""

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREEN, ORANGE, PINK
from analysis.paper.continuum.fig10_density.study import DENSITIES, STEP, Densities
from nscd.continuum.medium import PERSON
from nscd.continuum.rivals.density_laws import ExponentialSpeed, KladekSpeed, PowerPressure


def curves(found: Densities) -> Figure:
    """Draw pressures in one unit, as plain numbers, and speeds, against the density."""
    figure = Figure(figsize=(13.0, 4.8), layout="constrained")
    forces, numbers, speeds = figure.subplots(1, 3)
    density = np.array(DENSITIES)
    largest, mean, measured, printed, speed = (
        np.array([getattr(solved, name) for solved in found.free])
        for name in ("largest", "mean", "measured", "printed", "mean_speed")
    )
    adapted = ([s.density for s in found.adapted], [s.mean_speed for s in found.adapted])
    fine = np.linspace(density[0], density[-1], 200)
    power = PowerPressure().pressure
    forces.plot(density, largest / STEP, "o-", color=BLUE, label="(11) over δt, largest")
    forces.plot(density, mean / STEP, "o--", mfc="none", color=BLUE, label="(11) over δt, mean")
    forces.plot(density, measured, "s-.", color=ORANGE, label="(M1)")
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
