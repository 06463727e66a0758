"""What the tests of the engines need to be there."""

from pathlib import Path

import pytest

from analysis.engines import engine

ROOT = Path(__file__).resolve().parents[2]


def require(name):
    """Skip the test where the engine is not installed."""
    if engine(name).find() is None:
        pytest.skip(f"{name} is not installed")
