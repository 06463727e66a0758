"""The first screen of a report: one scene, what its people push with and bear."""
