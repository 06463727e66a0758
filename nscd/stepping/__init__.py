"""Rigid crowds in motion: Moreau–Jean time stepping over the percussions of each step."""

from nscd.stepping.arms import Arms
from nscd.stepping.motion import Motion, Push, StepError, StepReport, WindowImpulses, WindowSums

__all__ = ["Arms", "Motion", "Push", "StepError", "StepReport", "WindowImpulses", "WindowSums"]
