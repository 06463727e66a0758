"""Cells of the atlas: of an engine's trial, judged from its dumps, and of a solver of percussions,
judged against another way to the same answer."""

import numpy as np

from analysis.stability.case import Cell, Outcome
from analysis.stability.frames import Frames
from analysis.stability.trial import Trial, guard_says
from nscd import Percussions, Status
from nscd.arrays import Floats

# More energy than the start had, as a share of it, that rounding and a sound time step do not make.
GAIN = 0.05
# The momentum of a crowd on which nothing acts, over Σm|u|: forces are equal and opposite to the
# last digit.
DRIFT = 1e-9
ENGINE_QUANTITIES = (
    "largest energy / energy at the start",
    "largest overlap / radius",
    "disks in the last frame",
    "change of momentum / Σm|u|",
)
SOLVERS = ("auto", "interior_point", "active_set", "projected_gradient", "gauss_seidel")
TOLERANCE = 1e-8
# An answer with a residual of TOLERANCE may be further from the truth than that; this far is wrong.
WRONG = 1e-5
SOLVER_QUANTITIES = ("error of u⁺ / |u⁻|", "residual", "iterations")


def engine_cell(frames: Frames, outcome: Outcome, reason: str) -> Cell:
    """Make a cell with the ENGINE_QUANTITIES. Disks that are lost and a run that ended early
    override the outcome."""
    trial = frames.trial
    if why := _lost(frames):
        outcome, reason = Outcome.LOST, why
    elif frames.trouble and frames.gain > 1 + GAIN:
        outcome = Outcome.ENERGY_GAIN
        reason = f"{frames.trouble}, with {frames.gain:.3g} times the energy"
    elif frames.trouble:
        outcome, reason = Outcome.REFUSED, f"{frames.trouble}: {_last_error(trial)}"
    elif outcome is Outcome.STABLE and frames.drift > DRIFT:
        outcome, reason = Outcome.INACCURATE, f"momentum changed by {frames.drift:.2g} of Σm|u|"
    overlap = float(frames.overlap.max()) if len(frames.overlap) else float("nan")
    return Cell(
        outcome=outcome,
        reason=reason,
        said=trial.status,
        numbers=(frames.gain, overlap, float(frames.disks), frames.drift),
        guard="" if outcome is Outcome.STABLE else guard_says(trial),
        reused=trial.reused,
    )


def undriven_cell(frames: Frames) -> Cell:
    """Make a cell of a crowd that nothing drives: stable as long as its energy does not grow by
    more than GAIN."""
    if not frames.gain > 1 + GAIN:
        reason = f"energy at most {frames.gain:.4g} of the start's"
        return engine_cell(frames, Outcome.STABLE, reason)
    when = frames.time[int(np.argmax(frames.energy > (1 + GAIN) * frames.energy[0]))]
    gained = f"{frames.gain:.3g} times the energy of the start"
    reason = f"{gained}; beyond {1 + GAIN:g} from t = {when:.3g} s"
    return engine_cell(frames, Outcome.ENERGY_GAIN, reason)


def rigid_cell(outcome: Outcome, reason: str, said: str) -> Cell:
    """Make a cell of what runs no engine (the product's own checks, percussions): it has none of
    the ENGINE_QUANTITIES."""
    nothing = (float("nan"),) * len(ENGINE_QUANTITIES)
    return Cell(outcome=outcome, reason=reason, said=said, numbers=nothing)


def refused_cell(why: Exception) -> Cell:
    """Make a cell of something that the product turned down before anything ran."""
    return rigid_cell(Outcome.REFUSED, str(why), "refused")


def solver_cell(answer: Percussions, reference: Floats, scale: float) -> Cell:
    """Make a cell with the SOLVER_QUANTITIES: not converged where the residual says so, inaccurate
    where u⁺ differs from the reference (n,2) m/s by more than WRONG of `scale`, the largest |u⁻|
    (m/s)."""
    error = float(np.abs(answer.right_velocity - reference).max()) / (scale or 1.0)
    if answer.status is not Status.SOLVED:
        outcome, reason = Outcome.NOT_CONVERGED, answer.reason
    elif not error <= WRONG:
        outcome, reason = Outcome.INACCURATE, f"u⁺ is wrong by {error:.2g}"
    else:
        outcome, reason = Outcome.STABLE, f"u⁺ is right to {error:.2g}"
    return Cell(
        outcome=outcome,
        reason=reason,
        said=str(answer.status),
        numbers=(error, answer.residual, float(answer.iterations)),
    )


def _lost(frames: Frames) -> str:
    """Why disks count as lost: gone from the dump, nowhere, or lost by the engine's own words; ""
    where none is."""
    if frames.lost:
        return frames.trouble
    return _last_error(frames.trial) if "ost atoms" in frames.trial.last_words else ""


def _last_error(trial: Trial) -> str:
    """The last line in which the engine speaks of an error, "" where it does not."""
    lines = [line.strip() for line in trial.last_words.splitlines() if "error" in line.lower()]
    return lines[-1] if lines else ""
