"""Figs. 4 and 5: arches of equal and unequal masses."""
