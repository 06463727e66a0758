"""What penalty engines fail at."""
