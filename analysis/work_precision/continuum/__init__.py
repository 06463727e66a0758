"""The two continuum models on the crowd of a window."""
