"""An open library of contact problems, to hold solvers against each other: made, kept, judged."""
