"""What the rigid engine fails at."""
