"""Islands of the contact graph: those that nothing presses, and single contacts, never reach a solver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from nscd.problem import ContactProblem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Islands:
    """label (n,) of each disk's island; contacts (m,), disks (m,): how many it has; pressed (m,): one of its contacts would
    close; forest (m,): its contacts form a tree (the walls taken as one body), so that its reactions are unique."""

    label: NDArray[np.int32]
    contacts: NDArray[np.int64]
    disks: NDArray[np.int64]
    pressed: NDArray[np.bool_]
    forest: NDArray[np.bool_]


def find_islands(problem: ContactProblem) -> Islands:
    """The connected components of disks over disk–disk contacts; walls do not connect."""
    n = len(problem.mass)
    pairs = problem.second >= 0
    i, j = problem.first[pairs], problem.second[pairs]
    count, label = connected_components(
        coo_array((np.ones(len(i), dtype=np.int8), (i, j)), shape=(n, n)), directed=False
    )
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
