"""Shared: hypothesis without deadlines (compiled kernels make the first example slow), and
Ctrl-C, which some tests send, where a shell in the background has switched it off."""

import signal

from hypothesis import settings

signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("crowd", deadline=None, max_examples=40, derandomize=True)
settings.load_profile("crowd")
