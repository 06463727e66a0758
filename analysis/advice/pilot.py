"""An impact tried before it is run: the engines' own scheme on the very scene, in this process.

The error of an explicit scheme is of first order in Δt√(k/m): its dashpots see the velocity of half
a step before. How large it is no number of the scene tells. Pushes of one corridor with the same
damping ratio and as many contacts at once differ by a factor of 60, since it depends on which
contacts open and close again. But an impact is short, and the scheme is known: it costs less to
step through it here than to start an engine."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from analysis.advice.error_curves import LEAST, Errors
from analysis.engines.penalty import penalty_of
from analysis.work_precision.points_of import WRONG, Judge
from analysis.work_precision.rigid_reference import rigid_reference
from analysis.work_precision.soft_reference import (
    ReferenceError,
    leapfrog,
    soft_reference,
)
from analysis.work_precision.soft_runs import SoftSetting, scene_of
from analysis.work_precision.window import Window, relative_error

# Shares of the safe time step that are stepped through.
SHARES = (1 / 16, 1 / 4, 1.0, 4.0)
# What is promised over what is expected: engines round otherwise, and shorten steps to meet frames.
NUMERICAL, MODEL = 1.5, 1.1
# An error that is promised to be smaller than this would be one of rounding, here or in a dump.
ROUNDING = 1e-9
# A larger impact (disks, disks times safe time steps) would take longer to try than advice may.
MOST_DISKS, MOST_WORK = 600, 5e6


@dataclass(frozen=True, kw_only=True, eq=False)
class Pilot:
    """The errors of an impact's soft settings, in a quantity whose name begins with `load`."""

    window: Window
    load: str

    def errors(self, law: str) -> dict[float, Errors]:
        """Compute the errors at each share of the safe time step, with the scene's stiffness.

        Steps that are wrong by more than the whole are left out; nothing is found for an impact too
        large to try."""
        scene = self.window.scene.with_contact(law=law)
        disks, steps = len(scene.snapshot), scene.run.duration_s / penalty_of(scene).safe_time_step
        if disks > MOST_DISKS or disks * steps > MOST_WORK:
            return {}
        return _errors(self.window, self.load, law)

    def promise(self, errors: Errors) -> Errors:
        """Give the errors that are promised where these are expected."""
        return Errors(numerical=NUMERICAL * errors.numerical + ROUNDING, model=MODEL * errors.model)


@functools.lru_cache(maxsize=8)
def _errors(window: Window, load: str, law: str) -> dict[float, Errors]:
    stiffness, scene = window.scene.contact.stiffness_N_per_m, window.scene
    rigid = rigid_reference(scene.snapshot, window.contacts, window.left_velocity, window.law)
    judge = Judge(window=window, name=scene.name, rigid=rigid)
    asked = next((q for q in judge.exact if q.name.split("_")[0] == load), None)
    try:
        reference = soft_reference(window.variant(law, stiffness))
    except ReferenceError:
        return {}
    if asked is None:
        return {}
    exact = judge.exact[asked]
    own, looser = (
        window.quantities(motion, stiffness)[asked]
        for motion in (reference.motion, reference.looser)
    )
    bar = relative_error(looser, own, exact)
    model = max(relative_error(own, exact, exact) + judge.bar[asked], LEAST)
    found: dict[float, Errors] = {}
    for share in SHARES:
        setting = SoftSetting(engine="", law=law, stiffness_N_per_m=stiffness, share=share)
        with np.errstate(all="ignore"):
            motion = leapfrog(scene_of(window, setting))
            values = window.quantities(motion, stiffness)[asked]
            numerical = relative_error(values, own, exact)
        if numerical <= WRONG:
            found[share] = Errors(numerical=numerical + bar, model=model)
    return found
