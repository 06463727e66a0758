"""The interior point: its path, and how it is used."""
