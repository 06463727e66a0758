"""Time steps above critical, with damping."""

from pathlib import Path

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cases.penalty.time_step import swing
from analysis.stability.cells import ENGINE_QUANTITIES
from analysis.stability.crowds import PERIOD_S, critical_time_step, pressed_rhombus

ACROSS = 4
# With dashpots what is just unstable grows slowly.
STEPS = 5000


def attempt(step: float, restitution: float, folder: Path) -> Cell:
    """Run a rhombus of that restitution at a time step (in √(m/k)) with LAMMPS."""
    return swing(pressed_rhombus(ACROSS, restitution), "lammps", step, STEPS, folder)


def theory(restitution: float) -> float:
    """Compute where leapfrog with dashpots becomes unstable on the packing, in √(m/k)."""
    return critical_time_step(pressed_rhombus(ACROSS, restitution)) / PERIOD_S


def case(quick: bool) -> Case:
    """Make the case."""
    full = (0.025, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9)
    return Case(
        name="damping",
        columns=Axis("time step / √(m/k)", (0.05, 0.2, 0.5, 1.0) if quick else full),
        rows=Axis(
            "asked restitution (LAMMPS)", (1.0, 0.1) if quick else (1.0, 0.5, 0.2, 0.1, 0.01)
        ),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
        theory=theory,
        values={"across": ACROSS, "steps": STEPS},
    )
