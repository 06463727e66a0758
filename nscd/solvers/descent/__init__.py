"""Descent: its sweeps."""
