"""All commands, in the order of `--help`. A new one is a function in a file of its name, and its name
here."""

import importlib

from analysis.cli.app import app
from analysis.cli.options import with_options

__all__ = ["app"]
COMMANDS = (
    "scenes", "new", "run", "import_", "solve", "compare", "film", "export", "exposure", "report", "chart",
    "stability", "standards", "advise", "paper", "push", "doctor",
)  # fmt: skip

for name in COMMANDS:
    command = getattr(importlib.import_module(f"analysis.cli.{name}"), name)
    app.command(name=name.rstrip("_"))(with_options(command))
