"""Other continuum models of the same crowd."""
