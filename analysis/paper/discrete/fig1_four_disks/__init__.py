"""Fig. 1: four disks."""
