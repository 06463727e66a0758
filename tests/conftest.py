"""Shared: hypothesis without deadlines (compiled kernels make the first example slow)."""

from hypothesis import settings

settings.register_profile("crowd", deadline=None, max_examples=40, derandomize=True)
settings.load_profile("crowd")
