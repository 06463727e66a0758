"""Fig. 4: an arch at the exit, equal masses."""
