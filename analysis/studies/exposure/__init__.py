"""What people and walls bear in a run, against limits that have a source."""
