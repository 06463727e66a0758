"""The fewest disks that separate what lies on both sides of a strip.

By Menger's theorem they are as many as there are paths through the strip that share no disk. These
are found one by one; what a last search cannot reach lies beyond the separator: Ford & Fulkerson,
Canad. J. Math. 8 (1956) 399."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner

# Where a disk lies; 0 is outside the part that is cut.
LEFT, STRIP, RIGHT, CUT = 1, 2, 3, 4
# In place of the next disk of a path: none, and the end of the strip.
NOBODY, END = -1, -2


class Paths(NamedTuple):
    """Hold the paths through a strip, and storage to find one more.

    after, before: (n,) the next disk of the path through a disk, and the one before
    seen, came: (2n,) when a gate of a disk was reached last, and from which. Disk a is entered by
        gate 2a and left by gate 2a + 1, and only one path leads from the one to the other
    stack: of gates"""

    after: Any
    before: Any
    seen: Any
    came: Any
    stack: Any


@inner
def room_for_paths(n: int) -> Paths:
    """Reserve storage for n disks."""
    return Paths(
        np.empty(n, np.int32), np.empty(n, np.int32), np.empty(2 * n, np.int32),
        np.empty(2 * n, np.int32), np.empty(2 * n, np.int32),
    )  # fmt: skip


@inner
def cut_strip(
    strip: Any, across: Any, along: Any, side: Any, start: Any, neighbour: Any, paths: Any
) -> None:
    """Take the fewest disks of a strip into the cut, the others to the left or to the right.

    strip: (m,) disks, those with side[a] = STRIP; no disk left of it touches one right of it
    across, along: (n,) m, coordinates from left to right and along the strip
    side: (n,) is changed for the disks of the strip
    start, neighbour: the contact graph
    paths: storage, see `room_for_paths`"""
    rim, rank, stamp = _rim(strip, along, side, start, neighbour), 0, 0
    for a in strip:
        paths.after[a] = paths.before[a] = NOBODY
        paths.seen[2 * a] = paths.seen[2 * a + 1] = 0
    while True:
        stamp += 1
        found = 0
        for a in rim:
            if paths.before[a] == END:
                paths.seen[2 * a] = stamp
            elif paths.seen[2 * a] != stamp:
                last = _search(a, stamp, across, side, start, neighbour, paths)
                if last >= 0:
                    _add(last, paths)
                    found += 1
        rank += found
        if found == 0:
            break
    for a in strip:
        if paths.seen[2 * a + 1] == stamp:
            side[a] = LEFT
        elif paths.seen[2 * a] == stamp:
            side[a] = CUT
        else:
            side[a] = RIGHT


@inner
def _rim(strip: Any, along: Any, side: Any, start: Any, neighbour: Any) -> Any:
    """The disks of the strip that touch the left, along it."""
    rim, size = np.empty(len(strip), np.int32), 0
    for a in strip:
        if touches(a, LEFT, side, start, neighbour):
            rim[size] = a
            size += 1
    found = rim[:size]
    return found[np.argsort(along[found])]


@inner
def touches(a: int, other: int, side: Any, start: Any, neighbour: Any) -> bool:
    """Tell whether a disk touches one of a side."""
    for e in range(start[a], start[a + 1]):  # noqa: SIM110  (any() over a generator does not compile)
        if side[neighbour[e]] == other:
            return True
    return False


@inner
def _search(
    begin: int, stamp: int, across: Any, side: Any, start: Any, neighbour: Any, paths: Any
) -> int:
    """Search depth first, to the right first, for a path from a disk at the left to the right; the
    gate where it ends, −1 if there is none.

    A path may take away a part of one that was found: it enters a disk of that path, follows it
    back, and leaves it at a disk before."""
    after, before, seen, came, stack = paths
    stack[0], top = 2 * begin, 1
    seen[2 * begin], came[2 * begin] = stamp, -1
    while top > 0:
        top -= 1
        gate = stack[top]
        a = gate >> 1
        following = -1
        if gate & 1 == 0:
            if before[a] == NOBODY:
                following = gate + 1
            elif before[a] != END:
                following = 2 * before[a] + 1
        elif touches(a, RIGHT, side, start, neighbour):
            return int(gate)
        elif before[a] != NOBODY:
            following = gate - 1
        if following >= 0 and seen[following] != stamp:
            seen[following], came[following] = stamp, gate
            stack[top] = following
            top += 1
        if gate & 1 == 0:
            continue
        bottom = top
        for e in range(start[a], start[a + 1]):
            b = neighbour[e]
            if side[b] == STRIP and after[a] != b and seen[2 * b] != stamp:
                seen[2 * b], came[2 * b] = stamp, gate
                at = top
                while at > bottom and across[stack[at - 1] >> 1] > across[b]:
                    stack[at] = stack[at - 1]
                    at -= 1
                stack[at] = 2 * b
                top += 1
    return -1


@inner
def _add(last: int, paths: Any) -> None:
    """Add the path that ends at a gate: first what it takes away from others, then its own steps."""
    after, before, _, came, _ = paths
    gate = last
    while came[gate] >= 0:
        a, b = came[gate] >> 1, gate >> 1
        if a != b and gate & 1 == 1:
            after[b] = before[a] = NOBODY
        gate = came[gate]
    before[gate >> 1] = END
    gate = last
    while came[gate] >= 0:
        a, b = came[gate] >> 1, gate >> 1
        if a != b and gate & 1 == 0:
            after[a], before[b] = b, a
        gate = came[gate]
    after[last >> 1] = END
