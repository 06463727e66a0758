"""Rigid crowds in motion: Moreau–Jean time stepping over the percussions of each step."""

from nscd.stepping.motion import Motion, Push, StepError, StepReport, WindowImpulses, WindowSums

__all__ = ["Motion", "Push", "StepError", "StepReport", "WindowImpulses", "WindowSums"]
