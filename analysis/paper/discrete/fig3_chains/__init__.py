"""Fig. 3: chains."""
