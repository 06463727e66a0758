"""Islands of the contact graph: those that nothing presses, and single contacts, never reach a
solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nscd.arrays import Flags, Index32, Indices
from nscd.compiling import kernel
from nscd.problem import ContactProblem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Islands:
    """Hold the m islands of a contact graph.

    label: (n,) island of each disk
    contacts, disks: (m,) how many it has
    pressed: (m,) whether one of its contacts would close
    forest: (m,) whether its contacts form a tree (the walls taken as one body), so that its
        reactions are unique"""

    label: Index32
    contacts: Indices
    disks: Indices
    pressed: Flags
    forest: Flags


def find_islands(problem: ContactProblem) -> Islands:
    """Find the connected components of disks over disk–disk contacts; walls do not connect."""
    pairs = problem.second >= 0
    label, count = components(len(problem.mass), problem.first, problem.second)
    island = label[problem.first]
    closing = problem.approach(problem.free) > problem.offset
    contacts = np.bincount(island, minlength=count)
    disks = np.bincount(label, minlength=count)
    walls = np.bincount(island[~pairs], minlength=count)
    return Islands(
        label=label,
        contacts=contacts,
        disks=disks,
        pressed=np.bincount(island[closing], minlength=count) > 0,
        forest=contacts < disks + (walls > 0),
    )


@kernel
def components(n: int, first: Any, second: Any) -> Any:
    """Label (n,) each disk's component, and count them.

    first, second: (k,) disks, second −1 for a wall

    Union–find with path halving; the earlier root wins."""
    root = np.arange(n).astype(np.int32)
    for c in range(len(first)):
        i, j = first[c], second[c]
        if j < 0:
            continue
        while root[i] != i:
            root[i] = root[root[i]]
            i = root[i]
        while root[j] != j:
            root[j] = root[root[j]]
            j = root[j]
        if i < j:
            root[j] = i
        else:
            root[i] = j
    label = np.empty(n, np.int32)
    count = 0
    for i in range(n):  # a root comes before all that it leads
        if root[i] == i:
            label[i] = count
            count += 1
        else:
            label[i] = label[root[i]]
    return label, count
