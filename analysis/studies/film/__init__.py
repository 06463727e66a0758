"""A film: the contact forces of every frame of a run or of a filmed crowd, to be watched."""
