"""Real crowds: a frame of a trajectory becomes a scene, and the account of what that changed."""
