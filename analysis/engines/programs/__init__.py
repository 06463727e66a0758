"""What runs in a process of its own for an engine, and what is made of what it leaves."""
