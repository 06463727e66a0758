"""Advice: the cheapest method whose measured error on such a scene is within what is asked."""
