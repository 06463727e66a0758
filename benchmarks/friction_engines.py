"""Friction of the penalty engines against the rigid law as a jam at rest grows stiffer.

Usage: python benchmarks/friction_engines.py [--engines lammps yade] [--stiffness 1e6 1e7 1e8]
[--disks 40] [--mu 0.3] [--seconds 8] [--out FOLDER]

The engines remember how far a contact has slid since it closed, the rigid law knows the instant
only: where contacts stick it leaves forces open. So an engine's forces are held against the rigid
ones that are admissible: how far each normal and tangential force lies outside its interval, over
the mean normal force."""

import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np

from analysis.compare.comparison import Comparison, compare_run, keys_of
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from benchmarks.machine import describe, head, line, options
from nscd.indeterminacy.admissible import Admissible
from nscd.indeterminacy.determinacy import determinacy_of
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


def row(engine: str, stiffness: float, found: Comparison, mu: float) -> str:
    """One row of the table."""
    match, rigid = found.match, found.percussions
    both = match.in_penalty & match.in_rigid
    normal = (match.penalty * match.contacts.normal).sum(1)
    tangent = np.column_stack([-match.contacts.normal[:, 1], match.contacts.normal[:, 0]])
    across = (match.penalty * tangent).sum(1)
    pressed = match.in_penalty & (normal > 1e-3 * normal.mean())
    mobilised = np.abs(across[pressed]) / (mu * normal[pressed])
    held = Admissible.with_friction(rigid.contacts, rigid.answer)
    intervals = Intervals(held)

    def ends_of(row: int, tangential: bool = False) -> tuple[float, float]:
        span = intervals.of(weights_of_contacts(rigid.contacts, row), tangential=tangential)
        return span.lower, span.upper

    window = rigid.window or 1.0
    rows = range(len(rigid.contacts))
    ends = np.array([ends_of(row) for row in rows]) / window
    sides = np.array([ends_of(row, tangential=True) for row in rows]) / window
    here = both[match.in_rigid]  # of the rigid contacts, in their order of ids
    order = np.argsort(keys_of(rigid))
    one = outside(normal[both], ends[order][here])
    two = outside(across[both], sides[order][here])
    mean = float(normal[pressed].mean())
    assert rigid.answer.friction is not None
    state = rigid.answer.friction.state
    known = determinacy_of(held)
    cells = [
        engine, f"{stiffness:g}", len(both), int((~both).sum()), f"{mobilised.mean():.2f}",
        f"{(mobilised >= SLIDES).mean():.2f}", f"{(state >= 2).mean():.2f}",
        f"{known.determined.mean():.2f}",
        f"{one.max(initial=0.0) / mean:.1e}", f"{two.max(initial=0.0) / mean:.1e}",
    ]  # fmt: skip
    return line(cells)


def main() -> None:
    """Run the engines and print a table."""
    given = options(
        __doc__, engines=("lammps",), stiffness=(1e6, 1e7, 1e8), disks=40, mu=0.3, seconds=8.0,
        out=Path("out/benchmark/friction_engines"),
    )  # fmt: skip
    print(describe(), file=sys.stderr)
    print(head(*COLUMNS))
    for engine, stiffness in itertools.product(given.engines, given.stiffness):
        scene = make("jam", given.disks)
        scene = scene.with_contact(friction=given.mu, stiffness_N_per_m=stiffness)
        scene = scene.with_run(duration_s=given.seconds, frames=2)
        folder = given.out / f"{engine}_{stiffness:g}"
        if not (folder / "run.json").exists():
            simulate(scene, engine, folder)
        found = compare_run(folder, time=given.seconds)
        print(row(engine, stiffness, found, given.mu), flush=True)


if __name__ == "__main__":
    main()
