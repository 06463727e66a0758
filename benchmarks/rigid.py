"""The rigid engine beside LAMMPS and YADE on the same scenes: CPU seconds, overlap, residual, energy.

    python benchmarks/rigid.py [--scenes arch jam corridor arch_5000] [--share 1.0] [--friction 0]
        [--models "rigid, exact" …] [--out FOLDER]

Every row is a whole run by the command's own path, in a process of its own, one after the other: its
start is in the CPU time. The residual is the largest of a step from each frame, recomputed; the
energy is the kinetic one at the end. The last line fits the price of the rigid engine, start and disk step, as
`analysis/studies/advice/library.py` has it."""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines.programs.rigid import motion_of
from analysis.engines.run import simulate
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from benchmarks.machine import options, show
from nscd import Snapshot, find_contacts

# Simulated seconds.
SCENES = {"arch": 12.0, "jam": 6.0, "corridor": 2.0, "arch_5000": 0.5}
EXACT, WITH_FRICTION = "rigid, exact", "rigid, to 1e-3"
# Steps with friction are solved to 1e-3; the others are measured where nothing is said.
MODELS: dict[str, tuple[str, dict[str, float]]] = {
    EXACT: ("rigid", {"rigid_tolerance": 1e-8}),
    "rigid, to 1e-4": ("rigid", {"rigid_tolerance": 1e-4}),
    "LAMMPS, 1e6 N/m": ("lammps", {"stiffness_N_per_m": 1e6}),
    "LAMMPS, 1e7 N/m": ("lammps", {"stiffness_N_per_m": 1e7}),
    "YADE, 1e6 N/m": ("yade", {"stiffness_N_per_m": 1e6}),
    WITH_FRICTION: ("rigid", {"rigid_tolerance": 1e-3}),
}
COLUMNS = (
    "scene", "simulated", "model", "steps", "CPU s", "CPU s per s", "deepest overlap (m)",
    "largest residual", "energy (J)",
)  # fmt: skip


def scene_of(name: str, duration: float) -> Scene:
    """Make a scene, in ten frames and steps of 5 ms; `arch_5000` is `arch` with 5,000 people."""
    known, _, disks = name.partition("_")
    scene = make(known, disks=int(disks)) if disks else make(known)
    return scene.with_run(duration_s=duration, frames=10, time_step_s=None, rigid_step_s=0.005)


def overlap_of(frames: Sequence[Snapshot], scene: Scene) -> float:
    """Measure the deepest overlap (m) in any frame."""
    walls = scene.wall_segments()
    found = [find_contacts(one, walls, tolerance=1e-3).gap.min(initial=0.0) for one in frames]
    return max(0.0, -float(min(found)))


def main() -> None:
    """Print the table, row by row."""
    usual = tuple(title for title in MODELS if title != WITH_FRICTION)
    args = options(
        __doc__, scenes=SCENES, share=1.0, friction=0.0, models=usual, out=Path
    )  # share: of the simulated time
    if unknown := set(args.models) - set(MODELS):
        sys.exit(f"models: {', '.join(unknown)}. There are: {', '.join(MODELS)}")
    work: list[tuple[float, float]] = []
    show(COLUMNS, rows(args, work))
    if len(work) > 1:
        steps, used = np.array(work).T
        (start, step), _ = nnls(np.column_stack([1.0 / used, steps / used]), np.ones(len(used)))
        print(f"\n{EXACT}: {start:.2g} s and {step:.2g} s for each disk and step")


def rows(args: argparse.Namespace, work: list[tuple[float, float]]) -> Iterator[list[str]]:
    """A row for each scene and model; adds particle-steps and CPU seconds of EXACT to the work."""
    out = args.out or Path(tempfile.mkdtemp())
    for name in args.scenes:
        scene = scene_of(name, args.share * SCENES[name]).with_contact(friction=args.friction)
        for title in (title for title in MODELS if title in args.models):
            engine, change = MODELS[title]
            soft = engine != "rigid"
            made = scene.with_contact(**change) if soft else scene.with_run(**change)
            folder = out / f"{name}_{title.replace(' ', '_').replace('/', '_')}"
            record, simulated = simulate(made, engine, folder), scene.run.duration_s
            if title == EXACT:
                work.append((record.particle_steps, record.cpu_seconds))
            trajectory = open_bodies(folder / "bodies.dump").trajectory
            frames = [snapshot_of(trajectory[number]) for number in range(len(trajectory))]
            again = [] if soft else [motion_of(made, one).advance() for one in frames[:-1]]
            residual = f"{max(step.residual for step in again):.1e}" if again else "–"
            energy = 0.5 * frames[-1].mass @ (frames[-1].velocity ** 2).sum(1)
            spent = f"{record.cpu_seconds:.1f}", f"{record.cpu_seconds / simulated:.2g}"
            cells = [name, f"{simulated:g} s", title, f"{record.steps:,}", *spent]
            yield [*cells, f"{overlap_of(frames, made):.1e}", residual, f"{energy:.3g}"]


if __name__ == "__main__":
    main()
