"""One solver on one case, in a process of its own: from loose to tight until the residual is
reached.

Started by percussions.py, which ends it when its time is over. Prints `ready` and one line of JSON
an attempt, whose velocities go to FOLDER/ATTEMPT.npy and reactions to FOLDER/ATTEMPT_reaction.npy."""

import argparse
import json
import resource
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from cases import Case, Scaled, Solver, accuracy, read_case, scaled
from contest.compete import CANONICAL
from contest.peers import LISTED, PEERS

from benchmarks.problems.families import heap
from nscd import solve
from nscd.solve import SOLVERS


def main() -> int:
    """Attempt after attempt; 3 if the peer is not installed."""
    given = arguments()
    case = read_case(given.case)
    try:
        attempts = [*peer_variants(case, given.solver), *own_variants(case, given.solver)]
    except ImportError:
        return 3
    except MemoryError as error:
        print(error, file=sys.stderr)
        return 1
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print("ready", flush=True)
    number = 0
    for variant, ladder, run in attempts:
        if given.variant is not None and variant != given.variant:
            continue
        before = None
        for asked in given.asked or ladder:
            seconds, answer = timed(run, asked)
            if isinstance(answer, Exception):
                failed = {"variant": variant, "asked": asked, "error": str(answer)}
                print(json.dumps(failed), flush=True)
                break
            reaction, velocity, iterations = answer
            found = accuracy(case, reaction, velocity)
            if found.residual == before and asked >= 1:
                break  # more iterations are not made
            before = found.residual
            if found.residual <= 1e-8:
                for _ in range(repeats(seconds)):
                    seconds = min(seconds, timed(run, asked)[0])
            np.save(given.folder / f"{number}.npy", found.velocity)
            np.save(given.folder / f"{number}_reaction.npy", reaction)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - base
            peak = max(peak, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
            line = {"variant": variant, "asked": asked, "seconds": seconds, "velocity": number}
            line |= {"residual": found.residual, "own": found.own}
            print(json.dumps(line | {"iterations": iterations, "peak_MB": peak / 1024}), flush=True)
            number += 1
            if found.residual <= given.target:
                break
    return 0


def arguments() -> argparse.Namespace:
    """What is asked for on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", type=Path)
    parser.add_argument("solver")
    parser.add_argument("folder", type=Path)
    # stop at this residual (0: try all); tolerances or iterations, not its own; only this variant
    parser.add_argument("--target", type=float, default=0.0)
    parser.add_argument("--asked", type=float, nargs="*")
    parser.add_argument("--variant")
    return parser.parse_args()


Run = Callable[[float], tuple[object, object, int, float | None]]


def repeats(seconds: float) -> int:
    """How often to time once more, for the best."""
    return 20 if seconds < 0.05 else 4 if seconds < 0.5 else 1 if seconds < 10 else 0


def timed(run: Run, asked: float) -> tuple[float, object]:
    """CPU seconds of a solve, set-up included, and (λ, u, iterations), or the exception that ended
    it."""
    started = time.process_time()
    try:
        reaction, velocity, iterations, elsewhere = run(asked)
    except Exception as error:  # whatever a foreign solver raises is its result
        return float("inf"), error
    seconds = time.process_time() - started if elsewhere is None else elsewhere
    return seconds, (reaction, velocity, iterations)


def peer_variants(case: Case, name: str) -> Iterator[tuple[str, tuple[float, ...], Run]]:
    """A peer's variants on the scaled problem; none if there is no such peer."""
    peer = next((peer for peer in (*PEERS, *LISTED) if peer.name == name), None)
    if peer is not None:
        problem = scaled(case)
        for variant, prepare in peer.variants.items():
            yield variant, peer.asked, partial(run_peer, problem, prepare(problem))


def run_peer(
    problem: Scaled, solver: Solver, asked: float
) -> tuple[object, object, int, float | None]:
    """λ (k,) N·s, u (2n,) m/s or None, iterations not said, CPU seconds if the solver measured them
    itself."""
    found = solver(asked)
    velocity = None if found.velocity is None else found.velocity * problem.velocity
    return found.multiplier * problem.reaction, velocity, 0, found.seconds


def own_variants(case: Case, name: str) -> Iterator[tuple[str, tuple[float, ...], Run]]:
    """This product's solver of that name, with its kernels loaded; none if there is no such
    solver."""
    if name in (*SOLVERS, CANONICAL):
        run_own(name, heap(100), 1e-8)
        yield "", (1e-10, 1e-11, 1e-12), partial(run_own, name, case)


def run_own(name: str, case: Case, tolerance: float) -> tuple[object, object, int, float | None]:
    """λ, u, iterations of `nscd.solve`, everything from the snapshot and its contacts counted."""
    canonical = name == CANONICAL
    how = {"solver": "auto" if canonical else name, "canonical": canonical}
    given = case.snapshot, case.contacts
    found = solve(*given, left_velocity=case.left_velocity, tolerance=tolerance, **how)
    return found.reaction, found.right_velocity.ravel(), found.iterations, None


if __name__ == "__main__":
    sys.exit(main())
