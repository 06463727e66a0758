"""All commands, in the groups and the order of `--help`. A new one is a function in one of these modules,
and its name here."""

from analysis.cli import compare, pages, runs, scenes
from analysis.cli.app import OneCommand, app
from analysis.cli.options import with_options

__all__ = ["app"]
COMMANDS = {
    "See a crowd": (
        scenes.scenes, scenes.new, runs.run, runs.solve, compare.film, pages.explore, compare.exposure,
        pages.infer,
    ),
    "Compare": (pages.report, compare.compare),
    "Check a method": (
        pages.audit, pages.push, pages.measured, pages.chart, pages.advise, pages.stability,
        pages.standards, pages.paper,
    ),
    "Exchange with other programs": (scenes.import_, runs.export, runs.doctor),
}  # fmt: skip

for group, commands in COMMANDS.items():
    for command in commands:
        name = command.__name__.rstrip("_")
        app.command(name=name, cls=OneCommand, rich_help_panel=group)(with_options(command))
