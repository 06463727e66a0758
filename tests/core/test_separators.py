"""The separators of a crowd against SciPy's maximum flow, by Menger's theorem."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.csgraph import connected_components, maximum_flow

from benchmarks.problems.families import FAMILIES
from nscd._core import dissect

# Of the disks of a part, on either side of its median: see nscd/core/order.cpp.
STRIP_SHARE = 0.15


def fewest(edges, left, strip, right, n):
    """The fewest disks of the strip that part left from right: each can be passed once, from its
    gate a to its gate n + a."""
    source, sink, wide = 2 * n, 2 * n + 1, n
    begin = [*strip, *np.concatenate([edges[:, 0], edges[:, 1]]) + n]
    end = [*np.asarray(strip) + n, *np.concatenate([edges[:, 1], edges[:, 0]])]
    capacity = [1] * len(strip) + [wide] * (2 * len(edges))
    for disks, of in ((left, source), (right, sink)):
        begin += [of] * len(disks) if of == source else [*disks]
        end += [*np.asarray(disks) + n] if of == source else [sink] * len(disks)
        capacity += [wide] * len(disks)
    graph = sparse.csr_array((capacity, (begin, end)), shape=(2 * n + 2, 2 * n + 2), dtype=np.int32)
    return maximum_flow(graph, source, sink).flow_value


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", ["heap", "masses", "hexagonal"])
@pytest.mark.parametrize("n", [40, 300, 900])
def test_the_first_cut_is_as_small_as_any_in_its_strip(name, n, turned):
    case = FAMILIES[name](n)
    position = np.array(case.snapshot.position)
    position = position - 1e-9 * np.arange(len(position))[:, None]  # no two at the same place
    if turned:
        position = np.ascontiguousarray(position[:, ::-1])
    n = len(position)
    first = case.contacts.first.astype(np.int32)
    second = np.where(case.contacts.is_wall, -1, case.contacts.second).astype(np.int32)
    order, node_first, node_end, _ = dissect(position, first, second, n - 1)
    cut = order[node_first[-1] : node_end[-1]]

    edges = np.stack([first, second], axis=1)[second >= 0]
    rank = np.argsort(position[:, int(np.argmax(np.ptp(position, axis=0)))])
    one, two = int((0.5 - STRIP_SHARE) * n), int((0.5 + STRIP_SHARE) * n)
    assert len(cut) == fewest(edges, rank[:one], rank[one:two], rank[two:], n)
    assert set(cut) <= set(rank[one:two])

    left = np.setdiff1d(np.arange(n), cut)
    kept = edges[~np.isin(edges, cut).any(axis=1)]
    _, part = connected_components(
        sparse.coo_array((np.ones(len(kept)), kept.T), shape=(n, n)), directed=False
    )
    halves = part[np.intersect1d(left, rank[:one])], part[np.intersect1d(left, rank[two:])]
    assert not np.intersect1d(*halves).size
