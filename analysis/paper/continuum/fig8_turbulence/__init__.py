"""Fig. 8: crowd turbulence."""
