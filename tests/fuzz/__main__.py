"""Damaged input by hand, as long as wanted.

    python -m tests.fuzz --cases 10000 [--seed 1] [--first 0] [--keep FOLDER]

The root of the project is the current folder. Each case has a number and is the same in each run;
`--first N --cases 1 --keep FOLDER` leaves the files of one case in FOLDER/here."""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.fuzz.law import sweep
from tests.fuzz.material import Workshop

# Cases between two lines of progress.
EACH = 200


def say(line):
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def run():
    options = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    options.add_argument("--cases", type=int, default=1000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--keep", type=Path)
    args = options.parse_args()

    def cells(number, case, fault):
        say(f"{number}: {case.as_typed} [{case.material.target}]\n    {fault}")

    with tempfile.TemporaryDirectory() as folder:
        workshop = Workshop(Path(folder) / "runs", dear=True)
        case_folder = args.keep or Path(folder) / "case"
        numbers = range(args.first, args.first + args.cases)
        ends, faults = Counter(), []
        for start in range(0, args.cases, EACH):
            part = numbers[start : start + EACH]
            counted, found = sweep(workshop, args.seed, part, case_folder, cells=cells)
            ends, faults = ends + counted, faults + found
            say(f"{start + len(part)} cases, {len(faults)} faults so far")
    for end, count in sorted(ends.items()):
        say(f"{count:6d} {end}")
    say(f"{args.cases} cases, {len(faults)} faults")
    raise SystemExit(bool(faults))


run()
