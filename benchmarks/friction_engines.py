"""Friction of the penalty engines against the rigid law as a jam at rest grows stiffer.

Usage: python benchmarks/friction_engines.py [--engines lammps yade] [--stiffness 1e6 1e7 1e8]
[--disks 40] [--mu 0.3] [--seconds 8] [--out FOLDER]

The engines remember how far a contact has slid since it closed, the rigid law knows the instant
only: where contacts stick it leaves forces open. So an engine's forces are held against the rigid
ones that are admissible: how far each normal and tangential force lies outside its interval, over
the mean normal force."""

import argparse
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from analysis.compare.comparison import Comparison, compare_run, keys_of
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from benchmarks.machine import options, show
from nscd.indeterminacy.determinacy import determinacy_of
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.intervals import Intervals, weights_of_contacts

# A contact slides if this share of its friction is mobilised.
SLIDES = 0.999
COLUMNS = (
    "engine", "k (N/m)", "contacts", "only one model has it", "mobilised", "slide", "rigid: slide",
    "rigid: determined", "outside, normal", "outside, tangential",
)  # fmt: skip


def outside(value: Any, ends: Any) -> Any:
    """How far values (k,) lie outside intervals (k,2)."""
    return np.maximum(np.maximum(ends[:, 0] - value, value - ends[:, 1]), 0.0)


def row(engine: str, stiffness: float, found: Comparison, mu: float) -> list[object]:
    """One row of the table."""
    match, rigid = found.match, found.percussions
    both = match.in_penalty & match.in_rigid
    normal = (match.penalty * match.contacts.normal).sum(1)
    across = (match.penalty * match.contacts.tangent).sum(1)
    pressed = match.in_penalty & (normal > 1e-3 * normal.mean())
    mobilised = np.abs(across[pressed]) / (mu * normal[pressed])
    equilibrium = Equilibrium.with_friction(rigid.contacts, rigid.solution)
    intervals, window = Intervals(equilibrium), rigid.window or 1.0
    weights = [weights_of_contacts(rigid.contacts, one) for one in range(len(rigid.contacts))]
    here = both[match.in_rigid]  # of the rigid contacts, in their order of ids
    order, mean = np.argsort(keys_of(rigid)), float(normal[pressed].mean())
    beyond = []
    for value, tangential in ((normal, False), (across, True)):
        spans = (intervals.of(weight, tangential=tangential) for weight in weights)
        ends = np.array([(span.lower, span.upper) for span in spans]) / window
        beyond.append(outside(value[both], ends[order][here]).max(initial=0.0) / mean)
    assert rigid.solution.friction is not None
    return [
        engine, f"{stiffness:g}", len(both), int((~both).sum()), f"{mobilised.mean():.2f}",
        f"{(mobilised >= SLIDES).mean():.2f}", f"{(rigid.solution.friction.state >= 2).mean():.2f}",
        f"{determinacy_of(equilibrium).determined.mean():.2f}", *(f"{one:.1e}" for one in beyond),
    ]  # fmt: skip


def rows(args: argparse.Namespace) -> Iterator[list[object]]:
    """Run the engines; a row for each and each stiffness."""
    for engine, stiffness in itertools.product(args.engines, args.stiffness):
        scene = make("jam", args.disks)
        scene = scene.with_contact(friction=args.mu, stiffness_N_per_m=stiffness)
        scene = scene.with_run(duration_s=args.seconds, frames=2)
        folder = args.out / f"{engine}_{stiffness:g}"
        if not (folder / "run.json").exists():
            simulate(scene, engine, folder)
        yield row(engine, stiffness, compare_run(folder, time=args.seconds), args.mu)


if __name__ == "__main__":
    args = options(
        __doc__, engines=("lammps",), stiffness=(1e6, 1e7, 1e8), disks=40, mu=0.3, seconds=8.0,
        out=Path("out/benchmark/friction_engines"),
    )  # fmt: skip
    show(COLUMNS, rows(args))
