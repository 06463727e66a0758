"""All commands, in the order of `--help`. A new one is a function in one of these modules, and its name
here."""

from analysis.cli import compare, pages, runs, scenes
from analysis.cli.app import app
from analysis.cli.options import with_options

__all__ = ["app"]
COMMANDS = (
    scenes.scenes, scenes.new, runs.run, scenes.import_, runs.solve, compare.compare, compare.film,
    pages.explore, runs.export, compare.exposure, pages.report, pages.chart, pages.stability,
    pages.standards, pages.advise, pages.paper, pages.push, pages.measured, pages.infer, pages.audit,
    runs.doctor,
)  # fmt: skip

for command in COMMANDS:
    app.command(name=command.__name__.rstrip("_"))(with_options(command))
