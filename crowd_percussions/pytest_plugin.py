"""A fixture for the tests of any engine, by a line in their conftest.py:

    pytest_plugins = ["crowd_percussions.pytest_plugin"]"""

from collections.abc import Callable

import pytest


@pytest.fixture
def assert_forces_balance() -> Callable[..., None]:
    """Give what fails unless contact forces are those that the momentum of bodies needs; see `audit`."""
    from analysis.percussions.audit import audit

    def check(*snapshots_and_contacts: object, **inputs: object) -> None:
        found = audit(*snapshots_and_contacts, **inputs)  # type: ignore[arg-type]
        assert found.status == "agrees", found.words

    return check
