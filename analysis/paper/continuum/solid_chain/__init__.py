"""Section 3.2.1: the chain."""
