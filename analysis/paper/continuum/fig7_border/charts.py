"""The picture of Fig. 7: mesh and border, pressure, what the walls give."""

import numpy as np
from matplotlib.figure import Figure
from skfem import MeshTri1

from analysis.pages.drawing import BLACK, BLUE, GREY, ORANGE, PINK, draw_vectors
from analysis.pages.fields import draw_field, draw_room, rounded
from analysis.paper.continuum.fig7_border.study import Run, inward
from nscd.continuum.pressure import body_wall_percussion
from nscd.continuum.room import Room

BAR = 1 / 4000  # m for each N·s/m
ARROW = 0.8  # m


def border(room: Room, run: Run, shown: MeshTri1) -> Figure:
    """Draw the room's mesh and kinds of border; p at the vertices of `shown`, μ over a body, r_ext
    on the free border."""
    figure = Figure(figsize=(11.0, 5.4), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    mesh, wall, push = run.answer.space.mesh, run.answer.space.wall, inward(room)
    left.triplot(*mesh.p, mesh.t.T, color=GREY, lw=0.4)
    for words, place, colour in (
        ("$Γ_w$, wall", (0.15, 5.0), BLACK),
        ("$Γ_e$, exit", (0.15, 1.9), ORANGE),
        ("$Γ_f$, free", (-7.6, 4.0), BLUE),
    ):
        left.annotate(words, place, color=colour, fontsize=10)
    left.annotate(
        "Ω, the crowd", (-4.6, 1.0), fontsize=10, bbox={"fc": "white", "ec": "none", "pad": 1}
    )
    drawn = draw_field(right, shown, run.pressure, rounded(run.peak))
    figure.colorbar(drawn, ax=right, label="pressure over a body (N·s/m)", shrink=0.9)
    mu = body_wall_percussion(run.answer, 0.1)
    ends = wall.point + BAR * mu[:, None] * wall.normal
    # the pillar's bars would hide the pressure around it
    outer = (mu > 0) & (np.abs(wall.point).min(1) < 1e-9)
    for start, end in zip(wall.point[outer], ends[outer], strict=True):
        right.plot(*np.stack([start, end]).T, color=PINK, lw=1)
    for start, end in room.pieces("free"):
        share = np.linspace(0.1, 0.9, 4)[:, None]
        at = start + share * (end - start)
        vector = push(at)
        vector *= ARROW / np.hypot(*vector.T).max()
        draw_vectors(right, at - vector, vector, width=0.004, color=BLUE)
    for axes in (left, right):
        draw_room(axes, room)
        axes.set(xlabel="x (m)", xlim=(-7.8, 1.6), ylim=(-1.0, 7.0))
    left.set_ylabel("y (m)")
    return figure
