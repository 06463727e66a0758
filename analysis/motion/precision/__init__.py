"""Work against precision of whole runs: errors of what chaos does not spoil, over crowds."""
