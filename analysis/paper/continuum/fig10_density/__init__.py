"""Fig. 10: density laws."""
