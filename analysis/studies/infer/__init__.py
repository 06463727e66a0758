"""The push of a crowd, inferred from what is seen of it before a door, and the forces that follow."""
