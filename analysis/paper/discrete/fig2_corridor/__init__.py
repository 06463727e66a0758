"""Fig. 2: a push in a corridor."""
