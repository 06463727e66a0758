"""The crowd as a deformable solid: rooms, meshes, the collision problem (11) of the paper, fields
and pressure. SI units."""
