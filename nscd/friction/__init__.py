"""Percussions with Coulomb friction: the exact law of Signorini and Coulomb in two dimensions."""

from nscd.friction.answer import StepAnswer, carried_over, solve_step
from nscd.friction.problem import FrictionProblem, problem_of

__all__ = ["FrictionProblem", "StepAnswer", "carried_over", "problem_of", "solve_step"]
