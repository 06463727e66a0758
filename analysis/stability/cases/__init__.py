"""The cases of the atlas, one file each: what penalty engines fail at, and solvers of
percussions."""
