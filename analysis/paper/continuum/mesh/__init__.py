"""What a mesh buys."""
