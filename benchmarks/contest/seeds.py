"""One instant of many crowds of a family: our solver and its peers on the same seeds, in turn.

A peer runs with the setting that was fastest to 1e-10 on that crowd, set-up included as for us."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.cases import accuracy, case_of, scaled
from benchmarks.contest.compete import TARGET
from benchmarks.contest.peers import CANONICAL, EVERYONE, MISSING, OWN, Peer
from benchmarks.machine import in_turn, timed
from benchmarks.problems.families import Case

# Calls of each solver on a crowd, of which the fastest counts.
TURNS = 12
NAMES = ("family", "disks", "solver", "right", "ms, median", "worst residual", "peer", "right", "ms",
         "worst residual", "ratio, median", "worst twentieth", "worst")  # fmt: skip


def over_seeds(family: str, size: int, seeds: Sequence[int], peers: Sequence[str]) -> Iterator[Any]:
    """The rows of a family, ours by each peer: CPU ms, and the peer's over ours over the seeds where both
    were right. Residuals of ours are recomputed from λ alone, a peer's as `accuracy` says."""
    results = {name: np.full((len(seeds), 2), np.nan) for name in ("auto", CANONICAL, *peers)}
    for row, seed in enumerate(seeds):
        case = case_of(family, size, None, seed)
        ready = {name: _fastest(case, EVERYONE[name], name in OWN) for name in results}
        times = in_turn({name: partial(timed, one[0]) for name, one in ready.items() if one}, TURNS)
        for name, peer in ((name, EVERYONE[name]) for name in peers if row == 0 and not ready[name]):
            print(f"{name}: {MISSING}, or not right at the first seed. Install it with: {peer.install}")
        for name, spent in times.items():
            results[name][row] = 1e3 * min(seconds for seconds, _ in spent), ready[name][1]
    for ours in ("auto", CANONICAL):
        for peer in peers:
            ratio = results[peer][:, 0] / results[ours][:, 0]
            ends = ["–"] * 3
            if np.isfinite(ratio).any():
                ends = [f"{end:.2f}" for end in np.nanquantile(ratio, [0.5, 0.05, 0.0])]
            yield family, size, ours, *_words(results[ours]), peer, *_words(results[peer]), *ends


def _words(found: Any) -> tuple[str, ...]:
    """How many were right, median of the ms, and largest residual of these."""
    right = found[np.isfinite(found[:, 0])]
    if not len(right):
        return "0", "–", "–"
    return f"{len(right)} of {len(found)}", f"{np.median(right[:, 0]):.2f}", f"{right[:, 1].max():.1e}"


def _fastest(case: Case, peer: Peer, alone: bool) -> Any:
    """The fastest call of a peer to a residual of 1e-10, and that residual; none where it has none."""
    problem, best, least = scaled(case), None, np.inf
    for make in peer.variants.values():
        try:
            solver = make(problem)
        except ImportError:
            return None
        for requested in peer.requested:
            call = partial(solver, requested)
            (seconds, solution), (again, _) = timed(call), timed(call)
            residual = accuracy(case, solution.reaction, None if alone else solution.velocity).residual
            if residual <= TARGET:
                if min(seconds, again) < least:
                    best, least = (call, residual), min(seconds, again)
                break
    return best
