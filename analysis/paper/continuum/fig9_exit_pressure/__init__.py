"""Fig. 9: pressure before an exit."""
