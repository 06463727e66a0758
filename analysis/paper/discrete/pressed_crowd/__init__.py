"""A crowd pressed to an exit: its percussions, and what Figs. 4 and 5 show of it alike."""
