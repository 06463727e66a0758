"""Fig. 5: an arch at the exit, unequal masses."""
