"""Answers in closed form: chain, half-annulus, point exit."""
