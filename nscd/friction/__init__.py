"""Percussions with Coulomb friction: the exact law of Signorini and Coulomb in two dimensions."""
