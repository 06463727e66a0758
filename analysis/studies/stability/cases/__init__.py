"""The cases of the atlas: what penalty engines, solvers of percussions and rigid steps fail at."""
