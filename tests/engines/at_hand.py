"""What the tests of the engines need to be there."""

from pathlib import Path

import pytest

from analysis.engines import engine

ROOT = Path(__file__).resolve().parents[2]


def lammps(**arguments):
    """The plain command of LAMMPS with these variables."""
    variables = [word for name, value in arguments.items() for word in ("-var", name, str(value))]
    return ["lmp", "-in", "lammps_inputs/crowd.in", "-log", "none", *variables]


def yade(*words):
    """The plain command of YADE."""
    return ["yade", "-L", "noserver", "-j1", "-n", "-x", "yade_scripts/crowd.py", *map(str, words)]


def require(name):
    """Skip the test where the engine is not installed."""
    if engine(name).find() is None:
        pytest.skip(f"{name} is not installed")
