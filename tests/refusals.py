"""Bad input that is refused by name."""

import pytest


def refusals(*cases):
    """A test: each call ends in a ValueError with the words (a pattern) beside it."""

    @pytest.mark.parametrize(("call", "says"), cases)
    def refused(call, says):
        with pytest.raises(ValueError, match=says):
            call()

    return refused
