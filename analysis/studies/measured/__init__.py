"""Measured contact forces of photoelastic disks, against what models predict from the boundary."""
