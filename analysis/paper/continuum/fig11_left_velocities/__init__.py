"""Fig. 11: left velocities."""
