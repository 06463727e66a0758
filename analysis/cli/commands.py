"""All commands, in the order of `--help`. A new one is a file with a function, and a line here."""

from analysis.cli.advise import advise
from analysis.cli.app import app
from analysis.cli.chart import chart
from analysis.cli.compare import compare
from analysis.cli.doctor import doctor
from analysis.cli.export import export
from analysis.cli.exposure import exposure
from analysis.cli.film import film
from analysis.cli.import_crowd import import_
from analysis.cli.options import with_options
from analysis.cli.paper import paper
from analysis.cli.push import push
from analysis.cli.report import report
from analysis.cli.run import run
from analysis.cli.scenes import new, scenes
from analysis.cli.solve import solve
from analysis.cli.stability import stability

__all__ = ["app"]

for command in (
    scenes, new, run, import_, solve, compare, film, export, exposure, report, chart, stability, advise, paper,
    push, doctor,
):  # fmt: skip
    app.command(name=command.__name__.rstrip("_").replace("_", "-"))(with_options(command))
