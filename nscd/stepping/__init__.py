"""Rigid crowds in motion: Moreau–Jean time stepping over the percussions of each step."""

from nscd.stepping.motion import Motion
from nscd.stepping.push import Push
from nscd.stepping.report import StepError, StepReport
from nscd.stepping.windows import WindowImpulses, WindowSums

__all__ = ["Motion", "Push", "StepError", "StepReport", "WindowImpulses", "WindowSums"]
