"""The factorisation of Â + CᵀΘC: the rate of one front beside the BLAS, and whole matrices beside
CHOLMOD and PARDISO.

    OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 python -m benchmarks.factors.factorisation \\
        [CASE ...]

Cases are files that `benchmarks/percussions.py --cases FOLDER` left."""

import argparse
import os
import sys
from pathlib import Path

from benchmarks.cases import read_case
from benchmarks.factors import fronts, libraries
from benchmarks.machine import describe

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> None:
    """Print both tables as Markdown."""
    parser = argparse.ArgumentParser(prog="factorisation", description=__doc__)
    parser.add_argument("cases", nargs="*", type=Path, metavar="CASE")
    given = parser.parse_args()
    for name in ONE_THREAD:
        if os.environ.get(name) != "1":
            sys.exit(f"{name}: set it to 1, so that everyone has one thread")
    for path in given.cases:
        if not path.is_file():
            sys.exit(f"{path}: no such file")
    print(describe(), end="\n\n")
    print(fronts.HEADING)
    print("\n".join(fronts.rows()), flush=True)
    if given.cases:
        print(f"\n{libraries.HEADING}")
    for path in given.cases:
        print("\n".join(libraries.rows(read_case(path), path.name.partition("_")[0])), flush=True)


if __name__ == "__main__":
    main()
