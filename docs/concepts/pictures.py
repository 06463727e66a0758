"""The pictures of docs/concepts, drawn from solved problems: python docs/concepts/pictures.py."""

import csv
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.dumps import snapshot_of
from analysis.studies.exposure.limits import known_limits
from analysis.studies.exposure.loads import read_exposure, write_stops
from analysis.studies.standards.page import choose, draw, run_tests
from crowd_percussions import (
    ContactLaw,
    Crowd,
    PercussionAnalysis,
    Snapshot,
    Walls,
    find_contacts,
    open_bodies,
    read_contacts,
    read_scene,
    room,
    simulate,
    solve,
)

FOLDER = Path(__file__).resolve().parent / "pictures"
INK, PEOPLE, FORCE = "#333333", "#cfdbe8", "#b3261e"


def _disks(axes: Axes, position: object, radius: object) -> None:
    for location, size in zip(np.asarray(position), np.asarray(radius), strict=True):
        axes.add_patch(plt.Circle(tuple(location), size, fc=PEOPLE, ec=INK))


def _arrow(axes: Axes, start: tuple[float, float], by: tuple[float, float], color: str) -> None:
    style = {"arrowstyle": "-|>", "color": color, "lw": 2}
    axes.annotate("", (start[0] + by[0], start[1] + by[1]), start, arrowprops=style)


def _save(figure: Figure, name: str) -> None:
    figure.savefig(FOLDER / f"{name}.png", dpi=130)
    plt.close(figure)


def percussion() -> None:
    """Draw two people before and after a collision, and the percussion between them."""
    pair = Snapshot(
        position=[[0, 0], [0.5, 0]], velocity=[[2, 0], [0, 0]], radius=[0.25] * 2, mass=[75] * 2
    )
    found = solve(pair, find_contacts(pair, tolerance=1e-9), law=ContactLaw(restitution=0.5))
    figure, both = plt.subplots(1, 2, figsize=(7, 2.2), layout="constrained")
    for axes, velocity, title in zip(
        both, (pair.velocity, found.right_velocity), ("before", "after"), strict=True
    ):
        _disks(axes, pair.position, pair.radius)
        for position, speed in zip(pair.position, velocity[:, 0], strict=True):
            if speed:
                _arrow(axes, tuple(position), (0.2 * speed, 0), INK)
            axes.text(position[0], -0.17, f"{speed:g} m/s", ha="center", color=INK)
        axes.set(title=title, xlim=(-0.3, 1.1), ylim=(-0.3, 0.42), aspect="equal")
        axes.axis("off")
    _arrow(both[1], (0.25, 0.33), (0.3, 0), FORCE)
    both[1].text(0.6, 0.3, f"percussion p = {found.impulse[0, 0]:g} N·s", color=FORCE)
    _save(figure, "percussion")


def row() -> None:
    """Draw three people who push a wall: the contact forces p/τ."""
    tau, push = 0.5, 150.0
    radius, mass = np.full(3, 0.25), np.full(3, 75.0)
    line = Snapshot(
        position=[[-0.25, 0], [-0.75, 0], [-1.25, 0]],
        velocity=[[push * tau / 75, 0]] * 3,
        radius=radius,
        mass=mass,
    )
    wall = Walls(start=[[0, -1]], end=[[0, 1]])
    contacts = find_contacts(line, wall, tolerance=1e-9)
    force = np.hypot(*solve(line, contacts).impulse.T) / tau
    figure, axes = plt.subplots(figsize=(7, 2.4), layout="constrained")
    _disks(axes, line.position, radius)
    axes.plot([0, 0], [-0.4, 0.4], color=INK, lw=4)
    for (x, y), size in zip(contacts.point, force, strict=True):
        axes.plot(x, y, "o", color=FORCE)
        axes.text(
            x - 0.03 * (x == 0),
            0.33,
            f"{size:.0f} N",
            color=FORCE,
            ha="right" if x == 0 else "center",
        )
    for x in line.position[:, 0]:
        _arrow(axes, (x - 0.16, 0), (0.26, 0), INK)
        axes.text(x - 0.02, -0.15, f"push {push:.0f} N", color=INK, ha="center", fontsize=9)
    axes.text(0.06, 0, "wall", va="center")
    axes.set(xlim=(-1.6, 0.3), ylim=(-0.42, 0.45), aspect="equal")
    axes.axis("off")
    _save(figure, "row")


def window() -> None:
    """Draw the contact force of a collision in LAMMPS, and its mean over 0.1 s."""
    scene = read_scene("pair").with_run(duration_s=0.1, frames=1000)
    scene = scene.with_contact(restitution=0.5, stiffness_N_per_m=1e5)
    with tempfile.TemporaryDirectory() as folder:
        simulate(scene, "lammps", Path(folder) / "run")
        frames = list(read_contacts(Path(folder) / "run" / "contacts.dump"))
    force = [np.hypot(*frame.force.T).sum() for frame in frames]
    time = np.linspace(0, 0.1, len(force))
    impulse = np.trapezoid(force, time)
    figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
    axes.fill_between(1e3 * time, force, color=PEOPLE)
    axes.plot(1e3 * time, force, color=INK, label=f"force of the instant, peak {max(force):.0f} N")
    mean = impulse / 0.1
    axes.axhline(mean, color=FORCE, label=f"mean over a window of 0.1 s: {mean:.0f} N")
    axes.text(60, 0.4 * max(force), f"shaded area: impulse {impulse:.1f} N·s", color=INK)
    axes.set(xlabel="time (ms)", ylabel="contact force (N)")
    axes.legend(frameon=False)
    _save(figure, "window")


def wall_load() -> None:
    """Draw the load along the walls beside a door, and the metre with most."""
    scene = room("hall", 10.0, 8.0, 0.8, Crowd(people=150, push=100.0), duration=3.0)
    with tempfile.TemporaryDirectory() as folder:
        simulate(scene, "rigid", Path(folder) / "run")
        universe = open_bodies(str(Path(folder) / "run" / "bodies.dump"))
        found = PercussionAnalysis(universe, scene).run(start=-1).results.frames[0]
    contacts = found.contacts
    walls = np.where(contacts.is_wall, contacts.second, -1)
    force = np.hypot(*found.pressing.T)
    busiest = max(range(len(scene.walls)), key=lambda wall: force[walls == wall].sum())
    wall = scene.walls[busiest]
    start, end = np.array(wall.start_m), np.array(wall.end_m)
    length = float(np.hypot(*(end - start)))
    along = (contacts.point[walls == busiest] - start) @ (end - start) / length
    force = force[walls == busiest]
    worst = max(force[(along >= x) & (along <= x + 1)].sum() for x in along)
    at = next(x for x in along if force[(along >= x) & (along <= x + 1)].sum() == worst)
    figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
    axes.axvspan(at, at + 1, color=PEOPLE, label=f"worst metre: {worst:.0f} N/m")
    axes.vlines(along, 0, force, color=FORCE, lw=2)
    total = force.sum()
    axes.set(
        xlabel="distance along the wall (m)",
        ylabel="contact force (N)",
        title=f"load on this wall: {total:.0f} N",
        xlim=(0, length),
        ylim=0,
    )
    axes.legend(frameon=False)
    _save(figure, "wall_load")


def way() -> None:
    """Draw the ways of people who turn two corners, and where two streams block each other."""
    figure, panels = plt.subplots(1, 2, figsize=(9, 4.4), layout="constrained")
    titles = ("turns: ways in 20 s", "ell: after 12 s, with desired directions")
    for axes, name, title in zip(panels, ("turns", "ell"), titles, strict=True):
        scene = read_scene(name)
        with tempfile.TemporaryDirectory() as folder:
            simulate(scene, "rigid", Path(folder) / "run")
            bodies = open_bodies(Path(folder) / "run" / "bodies.dump")
            frames = [snapshot_of(step) for step in bodies.trajectory]
        assert scene.drive is not None
        for wall in scene.walls:
            axes.plot(*zip(wall.start_m, wall.end_m, strict=True), color=INK, lw=2)
        for exit_ in scene.drive.doors:
            axes.plot(*zip(*exit_.door, strict=True), color="#2e7d32", lw=3, ls=":")
        if name == "turns":
            _disks(axes, frames[0].position, frames[0].radius)
            for person in range(0, len(scene.snapshot), 4):
                axes.plot(
                    *np.array([one.position[person] for one in frames]).T, color=FORCE, lw=0.8
                )
        else:
            last = frames[-1]
            _disks(axes, last.position, last.radius)
            wanted = scene.drive.desired_velocity(last.position, last.ids)
            for _, mine in scene.drive.exits(last.ids):
                axes.quiver(
                    *last.position[mine].T,
                    *wanted[mine].T,
                    color=FORCE if mine[0] else "#1f5fa8",
                    scale=30,
                    width=0.006,
                )
        (x0, y0), (x1, y1) = scene.wall_segments().start.min(0), scene.wall_segments().start.max(0)
        axes.set(xlim=(x0 - 0.2, x1 + 0.2), ylim=(y0 - 0.2, y1 + 0.2), aspect="equal")
        axes.set_title(title)
        axes.set(xlabel="x (m)", ylabel="y (m)")
    figure.savefig(FOLDER.parents[1] / "results" / "pictures" / "way.png", dpi=100)
    plt.close(figure)


def stops() -> None:
    """Draw what the walls of a jam carry before and after those stop who bore too much too long."""
    limit = next(one for one in known_limits() if one.name == "asphyxia_seconds")
    scene = read_scene("jam").with_run(duration_s=20.0)
    figure, (position, load) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    with tempfile.TemporaryDirectory() as folder:
        for turn, style in enumerate((":", "-", "-")):
            run = Path(folder) / f"run{turn}"
            simulate(scene, "rigid", run)
            found = read_exposure(run)
            if turn != 1:
                load.plot(found.time, found.loads["wall_load"].sum(1) / 1e3, style, color=INK)
            scene = read_scene(write_stops(found, limit, Path(folder))[1])
        last = snapshot_of(open_bodies(run / "bodies.dump").trajectory[-1])
    assert scene.drive is not None
    gone = scene.drive.stopped(last.ids, last.time)
    for disk in np.flatnonzero(np.hypot(*last.position.T) < 9):
        fill = FORCE if gone[disk] else PEOPLE
        position.add_patch(plt.Circle(last.position[disk], last.radius[disk], fc=fill, ec=INK, lw=0.4))
    for wall in scene.walls:
        position.plot(*zip(wall.start_m, wall.end_m, strict=True), color=INK, lw=2)
    position.set(xlim=(-9, 0.5), ylim=(-5, 5), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    position.set_title("after 20 s; red: who stopped")
    load.set(xlabel="time (s)", ylabel="load on all walls (kN)", ylim=(0, None))
    load.set_title("dotted: nobody stops")
    figure.savefig(FOLDER.parents[1] / "results" / "pictures" / "stops.png", dpi=100)
    plt.close(figure)


def standards() -> None:
    """Draw the ways of 100 people through a corridor, alone and against 100 others."""
    with tempfile.TemporaryDirectory() as folder:
        (tested,) = run_tests(choose(["counterflow"]), "rigid", Path(folder))
    path = FOLDER.parents[1] / "results" / "pictures" / "standards.png"
    draw([tested.tracks[0], tested.tracks[-1]]).savefig(path, dpi=100)


def step_tolerance() -> None:
    """Draw what steps with friction cost, and by how much their forces are off, by tolerance."""
    results = FOLDER.parents[1] / "results"
    with (results / "tables" / "step_tolerance.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    box = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8}
    colors = {"0.1": "#0072b2", "0.3": INK, "0.6": "#d55e00"}
    figure, both = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained", sharey=True)
    for axes, people in zip(both, ("594", "2000"), strict=True):
        axes.axhline(0, color="#999999", lw=0.8)
        for friction, color in colors.items():
            points = [r for r in rows if (r["case"], r["friction"]) == (f"arch {people}", friction)]
            if not points:
                continue
            off = [tuple(map(float, r["mean force, %"].split(" ± "))) for r in points[1:]]
            cost = [float(r["CPU s"]) for r in points]
            error, half = zip((0.0, 0.0), *off, strict=True)
            axes.errorbar(cost, error, half, fmt="o-", ms=4, capsize=3, color=color, label=f"μ = {friction}")
            for r, x, y in zip(points, cost, error, strict=True):
                if friction == "0.3":
                    exponent = f"{float(r['tolerance']):.0e}".replace("e-0", "·10⁻").replace("1·", "")
                    text = exponent[:-1] + "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(exponent[-1])]
                    axes.annotate(text, (x, y), (4, 9), textcoords="offset points", fontsize=8, color=color, bbox=box)
        axes.set(xscale="log", xlabel="CPU seconds of 2 s", title=f"{int(people):,} people before a door")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.legend(loc="lower right")
    both[0].set_ylabel("mean contact force: difference from 10⁻⁸ (%)")
    figure.savefig(results / "pictures" / "step_tolerance.png", dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for picture in (percussion, row, window, wall_load, way, stops, standards, step_tolerance):
        picture()
