"""Solvers of a ContactProblem: one file a method, each a function problem → (reaction,
iterations)."""
