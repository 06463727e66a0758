"""Error against CPU seconds of the meshes, as a picture."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from analysis.pages.drawing import BLUE, GREEN, GREY, ORANGE, PINK
from analysis.paper.continuum.mesh.study import Point, Study

QUANTITIES = {
    "energy": "Room: velocity sum, energy norm",
    "pressure": "Room: pressure over a body",
    "load": "Room: load of all walls",
}
STYLES = {
    "P1 uniform": (BLUE, "o", "--", "white"),
    "P1 graded": (BLUE, "o", "-", BLUE),
    "P2 uniform": (ORANGE, "s", "--", "white"),
    "P2 graded": (ORANGE, "s", "-", ORANGE),
    "P1": (GREEN, "^", "-", GREEN),
    "P2": (PINK, "D", "-.", PINK),
}


def work_precision_picture(study: Study) -> Figure:
    """Three errors in the room and that of the energy in the half-annulus, each against CPU
    seconds."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    for axes, (name, title) in zip(panels, QUANTITIES.items(), strict=False):
        _curves(axes, study.room, name)
        limit = getattr(study.uncertainty, name)
        axes.axhspan(axes.get_ylim()[0], limit, color=GREY, alpha=0.5, lw=0, zorder=0)
        axes.set_title(title, fontsize=10)
    _curves(panels[3], study.annulus, "energy")
    panels[3].set_title("Half-annulus: velocity sum, energy norm", fontsize=10)
    handles = {
        label: h for p in panels for h, label in zip(*p.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=6, fontsize=8)
    return figure


def _curves(axes: Axes, points: Sequence[Point], name: str) -> None:
    for family in dict.fromkeys(p.family for p in points):
        colour, marker, line, face = STYLES[family]
        of = [p for p in points if p.family == family]
        label = family if " " in family else f"{family}, half-annulus"
        seconds, errors = zip(*((p.cpu_s, getattr(p.errors, name)) for p in of), strict=True)
        axes.plot(seconds, errors, color=colour, ls=line, marker=marker, mfc=face, label=label)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="CPU seconds, mesh and collision",
        ylabel="relative error",
    )
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3, which="major")
    axes.set_ylim(*axes.get_ylim())
