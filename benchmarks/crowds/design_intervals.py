"""How often intervals of the difference of two designs hold the true one, on crowds that are known.

    nice -n 19 python benchmarks/crowds/design_intervals.py FOLDER narrow.toml wide.toml --replicates 40

Replicates of both designs are run; runs that are in FOLDER are taken as they are. Their means are
the true ones. Of these replicates, which stand for all, as many as a comparison has are drawn with
replacement, and its intervals are held against the true differences; so are those of a comparison
that goes on until one quantity is decided, or for 41 replicates. For the last column both designs are
drawn from the first, apart: no difference is there. Prints the table of docs/results/designs.md."""

from itertools import takewhile

import numpy as np

from analysis.scene.scene import read_scene
from analysis.studies.motion.design_differences import (
    QUANTITIES,
    Difference,
    Table,
    difference,
    interim_levels,
)
from analysis.studies.motion.inference import LEVEL
from analysis.studies.report.designs_page import Replicates, designs_of
from benchmarks.machine import head, line, options
from nscd.arrays import Floats

COUNTS = (5, 8, 12)
# --until stops with this quantity, or after MOST.
MOST, STOP = 41, "wall_left"
Known = list[dict[str, Floats]]  # by quantity, the replicates of both designs


def schedule(count: int) -> list[tuple[int, float]]:
    """One look at so many replicates, or (0) all looks of --until up to MOST."""
    every = interim_levels(COUNTS[0])
    return [(count, 1 - LEVEL)] if count else [*takewhile(lambda style: style[0] <= MOST, every)]


def differences(of: Known, size: int, alpha: float) -> dict[str, Difference]:
    """Compare the first replicates."""
    table = Table(values=[{key: one[key][:size] for key in one} for one in of], reached=0)
    return table.differences(alpha)[0]


def measured(known: Known, count: int, draws: int) -> list[str]:
    """One row: how many replicates, whether all intervals hold, and a difference that is not there."""
    random, (first, second) = np.random.default_rng(count), known
    true = {key: second[key].mean() - first[key].mean() for key in first}
    covered, wrong, sizes = 0, 0, list[int]()
    for _ in range(draws):
        one, other = random.integers(0, len(next(iter(first.values()))), (2, MOST))
        pairs = [{key: of[key][one] for key in of} for of in known]
        alike = [pairs[0], {key: first[key][other] for key in first}]
        for size, alpha in schedule(count):
            found = differences(pairs, size, alpha)
            if found[STOP].significant:
                break
        sizes.append(size)
        covered += all(abs(each.value - true[key]) <= each.half for key, each in found.items())
        every = (differences(alike, *style).values() for style in schedule(count))
        wrong += any(each.significant for some in every for each in some)
    name = str(count or f"until {STOP} is decided: {np.mean(sizes):.0f} (mean)")
    return [name, f"{covered / draws:.1%}", f"{wrong / draws:.1%}"]


def main() -> None:
    """Run, draw and print."""
    args = options(__doc__, "folder", "first", "second", replicates=40, draws=2000)
    designs = designs_of([read_scene(args.first), read_scene(args.second)])
    of = Replicates(designs=designs, engine="rigid", out=args.folder)
    of.until(args.replicates)
    known = [dict(one) for one in of.interim(1 - LEVEL).table.values]
    print(head("quantity", "correlation", "paired", "true difference", "spread"))
    for key, first in known[0].items():
        combined = np.corrcoef(first, known[1][key])[0, 1]
        one = difference(known[1][key], first, 1 - LEVEL, paired=QUANTITIES[key].paired)
        spread = first.std(ddof=1)
        print(line([key, f"{combined:.2f}", QUANTITIES[key].paired, f"{one.value:.3g}", f"{spread:.2g}"]))
    print(head("replicates", "all intervals hold", "any false difference"))
    for count in (*COUNTS, 0):
        print(line(measured(known, count, args.draws)), flush=True)


if __name__ == "__main__":
    main()
