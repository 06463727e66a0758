"""From contacts to stress: what percussions of ever more disks converge to."""
