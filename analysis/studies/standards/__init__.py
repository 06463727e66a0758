"""Tests of standards for models of evacuation, as far as contact forces can be asked."""
