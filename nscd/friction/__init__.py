"""Percussions with Coulomb friction written out: the exact law of Signorini and Coulomb in two
dimensions. `nscd.solve` solves them, and `nscd.stepping.Motion` those of a step."""

from nscd.friction.problem import FrictionProblem, friction_problem

__all__ = ["FrictionProblem", "friction_problem"]
