"""The report: which runs it needs, its first screens, and the page with its files."""
