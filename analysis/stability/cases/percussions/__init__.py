"""What solvers of percussions fail at."""
