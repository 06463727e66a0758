"""The crowd as a deformable solid: rooms, meshes, the collision (11) of the paper, pressure."""
