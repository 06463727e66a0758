"""Commands that take a trajectory of real people."""
