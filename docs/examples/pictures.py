"""The pictures of examples that draw none, from their numbers: python docs/examples/pictures.py."""

import contextlib
import runpy
import tempfile
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Circle

HERE = Path(__file__).resolve().parent
INK, FORCE = "#333333", "#b3261e"


def how_stiff(axes: Axes, found: dict[str, Any]) -> None:
    """Draw the stiffness and the cost of each error."""
    choices = {error: one for error, one in found["found"].items() if one is not None}
    stiffness = [one.stiffness_N_per_m for one in choices.values()]
    axes.loglog([100 * error for error in choices], stiffness, "o-", color=FORCE)
    for error, one in choices.items():
        axes.annotate(f" {one.cpu_seconds:.2g} CPU s", (100 * error, one.stiffness_N_per_m))
    axes.set(xlabel="asked error (%)", ylabel="stiffness (N/m)", xlim=(8, 120))


def my_threshold(axes: Axes, found: dict[str, Any]) -> None:
    """Draw for how long each person was above the limit."""
    axes.bar(np.arange(len(found["total"])), np.sort(found["total"])[::-1], color=FORCE)
    axes.set(xlabel="people, in order", ylabel=f"time above {found['limit'].number:g} N (s)")


def my_solver(axes: Axes, found: dict[str, Any]) -> None:
    """Draw the error against the number of sweeps."""
    sweeps, exact = (1, 2, 5, 10, 20, 50, 100), found["answer"].right_velocity
    errors = [np.abs(found["gauss_seidel"](number) - exact).max() for number in sweeps]
    axes.loglog(sweeps, errors, "o-", color=FORCE)
    axes.set(xlabel="sweeps", ylabel="largest error (m/s)")


def exchange(axes: Axes, found: dict[str, Any]) -> None:
    """Draw the normal and tangential part of each contact, and the cone of friction."""
    solution = found["found"].solution
    normal = (solution.impulse * found["found"].contacts.normal).sum(1)
    tangential = np.sqrt(np.maximum((solution.impulse**2).sum(1) - normal**2, 0))
    maximum = normal.max()
    axes.plot([0, maximum], [0, 0.3 * maximum], color=INK, label="0.3 × normal part")
    axes.plot(normal, tangential, "o", color=FORCE, label="contacts")
    axes.set(xlabel="normal part (N·s)", ylabel="tangential part (N·s)")
    axes.legend(frameon=False)


def pulse(axes: Axes, found: dict[str, Any]) -> None:
    """Draw the speed of the front against the gap, and that in a straight row."""
    gaps = np.linspace(0.05, 0.2, 50)
    axes.plot(gaps, 1 + 0.4 / gaps, color=INK, label="straight row, (d + g)/g")
    for kind, (mark, colour) in {
        "hard": ("o", FORCE),
        "soft": ("s", "#0072b2"),
        "arms": ("^", "#7a7a00"),
    }.items():
        chosen = [
            (gap, each) for (gap, k), ends in found["speeds"].items() if k == kind for each in ends
        ]
        axes.plot(*zip(*chosen, strict=True), mark, color=colour, label=kind, fillstyle="none")
    axes.set(xlabel="gap between people (m)", ylabel="speed of the front (m/s)", ylim=0)
    axes.legend(frameon=False)


def sweep(axes: Axes, found: dict[str, Any]) -> None:
    """Draw the largest force of each radius and frame."""
    for radius, forces in found["forces"].items():
        axes.plot([radius] * len(forces), forces, "o", color=FORCE)
    axes.set(xlabel="radius (m)", ylabel="largest force (N)", ylim=0)


def pillar(axes: Axes, found: dict[str, Any]) -> None:
    """Colour each person by what a pillar in that place relieves, with the way that relieves more."""
    relief, position = 100 - 100 * found["sums"] / found["alone"], found["crowd"].position
    maximum = np.abs(relief).max()
    circles = [Circle(at, r) for at, r in zip(position, found["crowd"].radius, strict=True)]
    people = PatchCollection(circles, cmap="RdBu", ec=INK, lw=0.5, clim=(-maximum, maximum))
    people.set_array(relief)
    axes.figure.colorbar(axes.add_collection(people), label="less of squared forces (%)")
    known = np.abs(found["slopes"]).sum(1) > 0  # not of whom no gradient is
    way = -found["slopes"][known] / np.hypot(*found["slopes"][known].T)[:, None]
    axes.quiver(*position[known].T, *way.T, color=INK, scale=22, width=0.01)
    axes.add_collection(
        LineCollection([*zip(found["walls"].start, found["walls"].end, strict=True)], color=INK)
    )
    low, high = position.min(0) - 0.5, position.max(0) + 0.5
    axes.set(
        aspect="equal",
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        xlabel="x (m)",
        ylabel="y (m)",
    )


if __name__ == "__main__":
    for draw in (how_stiff, my_threshold, my_solver, exchange, pulse, sweep, pillar):
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            made = runpy.run_path(str(HERE.parents[1] / "examples" / f"{draw.__name__}.py"))
        figure, axes = plt.subplots(figsize=(4.5, 3), layout="constrained")
        draw(axes, made)
        figure.savefig(HERE / f"{draw.__name__}.png", dpi=110)
        plt.close(figure)
