"""Crowds in motion: one scene, several engines and crowds, as intervals over crowds and
instants."""
