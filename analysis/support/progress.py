"""Progress of long work."""

from collections.abc import Callable

# Called with a label and the share that is done, 0 to 1.
Progress = Callable[[str, float], None]
