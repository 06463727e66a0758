"""Fig. 6: rival force laws."""
