"""Advice for crowds as soft as people."""
