"""The rigid engine: Moreau–Jean time stepping over the percussions of each step, on a scene."""

import functools
import sys
from dataclasses import replace
from importlib.metadata import version as version_of
from pathlib import Path

import numpy as np

from analysis.engines.base import Engine
from analysis.engines.guard import speed_most
from analysis.engines.process import Command, digest_of, python_command
from analysis.engines.record import EngineError, Timing, divided
from analysis.scene.scene import Scene
from nscd.segments import lengths

NAME = "rigid"
# What a person goes in a step, at the desired speed, as a share of the mean radius: by default, and
# at most. Flow and speed are 2-6 % low at the first, 15 % at 0.24.
STEP_SHARE, SAFE_SHARE = 0.06, 0.25
# Of the smallest radius: beyond, a disk could go from one side of a wall to the other.
LARGEST_SHARE = 1.0
# Of √(m/k) of arms: by default, and at most. Explicit steps of a lattice of springs, in which each
# has six, are stable up to 2/√6 = 0.82.
ARMS_SHARE, ARMS_SAFE = 0.2, 0.7
# Of a step. With friction forces, wall loads and flow at 1e-3 are those at 1e-8 within their scatter
# over ten crowds, at a sixth of the time or less; from 3e-3 on mean forces are too small, by 1 to 3 %
# (benchmarks/step_tolerance.py).
TOLERANCE, TOLERANCE_WITH_FRICTION = 1e-8, 1e-3
PROGRAM = "analysis.engines.programs.rigid"
_ROOT = Path(__file__).resolve().parents[2]


def timing(scene: Scene) -> Timing:
    """Return when it steps: the step that is asked for, else 0.06 of the mean radius over the
    fastest speed of the scene, and at most 0.2 √(m/k) of the lightest person and the slope k of arms,
    shortened a little to fit into the time between frames. Raises ValueError for steps that nobody
    can count."""
    run, e, speed = scene.run, scene.contact.restitution, _fastest(scene)
    reach = float(scene.snapshot.radius.mean())
    longest, safe = (
        min(fraction * reach / speed if speed else run.duration_s, of_arms * arms_time(scene))
        for fraction, of_arms in ((STEP_SHARE, ARMS_SHARE), (SAFE_SHARE, ARMS_SAFE))
    )
    try:
        step, interval = divided(run, run.rigid_step_s or longest)
    except OverflowError as error:
        raise ValueError(
            f"{scene.name}: run.duration_s: {run.duration_s:g} s are {error}"
        ) from None
    return Timing(
        time_step=step,
        safe_time_step=safe,
        steps=interval * run.frames,
        frame_interval=interval,
        damping_ratio=0.0,
        restitution_least=e,
        restitution_most=e,
    )


def arms_time(scene: Scene) -> float:
    """Return √(m/k) (s) of the lightest person and the slope of arms; infinite without them."""
    arms = scene.contact.arms
    return float(np.sqrt(scene.snapshot.mass.min() / arms.stiffness)) if arms else np.inf


def tolerance_of(scene: Scene) -> float:
    """Return how exactly the contact problem of a step is solved (dimensionless)."""
    usual = TOLERANCE_WITH_FRICTION if scene.contact.friction else TOLERANCE
    return scene.run.rigid_tolerance or usual


def _fastest(scene: Scene) -> float:
    """The fastest speed that a scene asks for (m/s), its drive's or without one what falling gives."""
    if scene.drive is None:
        return speed_most(scene)
    return max(float(lengths(scene.snapshot.velocity).max()), scene.drive.fastest)


class Rigid(Engine):
    """The product's own engine, which writes the form of all engines itself; its guard is the
    solver's residual."""

    NAME, TITLE, COMMAND, ASK = NAME, "the rigid engine", "python", "--version"
    INSTALL = "pip install crowd-percussions"
    RESUMES = True

    def find(self) -> Path | None:
        """Return this Python: the engine is a part of the product."""
        return Path(sys.executable)

    def version(self) -> str | None:
        """Return the version of the product."""
        return version_of("crowd-percussions")

    @functools.cache  # noqa: B019  (there is one of it)
    def deck_digest(self) -> str:
        """Return the digest of the solvers, the stepper and its program."""
        programs = [Path(__file__), Path(__file__).parent / "programs" / "rigid.py"]
        return digest_of([*(_ROOT / "nscd").rglob("*.py"), *programs])

    def timing(self, scene: Scene) -> Timing:
        """Return when it steps; see `timing`."""
        return timing(scene)

    def setting(self, scene: Scene) -> str:
        """Name the step that was asked for and the tolerance, where they are not the default."""
        step, tolerance = scene.run.rigid_step_s, scene.run.rigid_tolerance
        parts = [f"h{step:.6g}" if step else "moreau_jean"]
        return "_".join(parts + ([f"tol{tolerance:.6g}"] if tolerance else []))

    def check(self, scene: Scene) -> None:
        """Raise EngineError for a step in which a disk could cross a wall, or in which arms give more
        than they take, and for walls that give."""
        if giving := scene.giving():
            raise EngineError(
                f"{scene.name}: walls.mass_kg: the rigid engine's walls stand, {giving[0].name} gives: "
                "use lammps or yade"
            )
        smallest, step = float(scene.snapshot.radius.min()), timing(scene).time_step
        if step > (maximum := ARMS_SAFE * arms_time(scene)):
            raise EngineError(
                f"{scene.name}: run.rigid_step_s: arms are not stable in steps of {step:g} s. Give a "
                f"step of at most {maximum:.3g} s"
            )
        if step * _fastest(scene) > LARGEST_SHARE * smallest:
            raise EngineError(
                f"{scene.name}: run.rigid_step_s: in {step:g} s a disk at {_fastest(scene):g} m/s "
                f"goes farther than its radius, {smallest:g} m, and could cross a wall. Give a step "
                f"of at most {LARGEST_SHARE * smallest / _fastest(scene):.3g} s"
            )

    def write_input(self, scene: Scene, decks: Path) -> None:
        """The program reads the scene itself."""
        decks.mkdir(exist_ok=True)

    def command(
        self, folder: Path, time_step_s: float, *, decks: str, out: str = ".", guard: bool = True
    ) -> Command:
        """Return the command that runs the scene in the folder."""
        return python_command(PROGRAM, "scene.toml", "--out", out, "--step", repr(time_step_s))

    def on_ranks(self, command: Command, ranks: int, scene: Scene) -> Command:
        """Return the command for so many threads."""
        return replace(command, words=(*command.words, "--threads", str(ranks)))
