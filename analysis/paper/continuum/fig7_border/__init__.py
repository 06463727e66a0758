"""Fig. 7: the border of the crowd."""
