"""The native core piece by piece: elimination, fronts, separators, readers."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import cholesky
from scipy.sparse.csgraph import connected_components, maximum_flow
from scipy.sparse.linalg import spsolve

from benchmarks.problems.families import FAMILIES
from nscd import _core
from nscd._core import PANEL, eliminate


def _height(pivots):
    return -(-pivots // 4) * 4 if pivots <= PANEL else -(-pivots // 8) * 8


def in_chunks(matrix, pivots):
    """A front as `eliminate` takes it, at an address that is a multiple of 64 bytes."""
    rest = len(matrix) - pivots
    width, more, height = -(-pivots // 8), -(-rest // 8), _height(pivots)
    panel = np.zeros((height, 8 * (width + more)))
    panel[:pivots, :pivots] = np.triu(matrix[:pivots, :pivots])
    panel[:pivots, 8 * width : 8 * width + rest] = matrix[:pivots, pivots:]
    others = np.zeros((8 * more, 8 * more))
    others[:rest, :rest] = matrix[pivots:, pivots:]
    parts = [panel.reshape(height, width + more, 8).transpose(1, 0, 2).ravel()]
    parts += [others[: 8 * c + 8, 8 * c : 8 * c + 8].ravel() for c in range(more)]
    numbers = np.concatenate(parts)
    room = np.empty(len(numbers) + 7)
    front = room[-(room.ctypes.data // 8) % 8 :][: len(numbers)]
    front[:] = numbers
    return front


def from_chunks(front, size, pivots):
    """Lᵀ of the pivots (pivots, size), and the upper half of the Schur complement."""
    rest = size - pivots
    width, more, height = -(-pivots // 8), -(-rest // 8), _height(pivots)
    at = 8 * (width + more) * height
    rows = front[:at].reshape(width + more, height, 8).transpose(1, 0, 2).reshape(height, -1)
    upper = np.triu(rows[:pivots, :pivots])
    np.fill_diagonal(upper, 1.0 / np.diag(upper))
    others = np.zeros((8 * more, 8 * more))
    for c in range(more):
        others[: 8 * c + 8, 8 * c : 8 * c + 8] = front[at : at + 64 * (c + 1)].reshape(-1, 8)
        at += 64 * (c + 1)
    beside = rows[:pivots, 8 * width : 8 * width + rest]
    return np.hstack([upper, beside]), np.triu(others[:rest, :rest])


@pytest.mark.parametrize(
    ("size", "pivots"),
    [(1, 1), (5, 2), (8, 3), (23, 23), (90, 31), (153, PANEL), (300, PANEL + 1), (700, 600)],
)
def test_rows_of_the_factor_and_the_schur_complement(size, pivots):
    half = np.random.default_rng(size).normal(size=(size, size + 3))
    matrix = half @ half.T + np.eye(size)
    factor = cholesky(matrix)
    front = in_chunks(matrix, pivots)
    assert eliminate(front, pivots, size - pivots)
    rows, others = from_chunks(front, size, pivots)
    scale = np.abs(matrix).max()
    np.testing.assert_allclose(rows, factor[:pivots], atol=1e-12 * scale)
    left = matrix[pivots:, pivots:] - factor[:pivots, pivots:].T @ factor[:pivots, pivots:]
    np.testing.assert_allclose(others, np.triu(left), atol=1e-12 * scale)


@pytest.mark.parametrize(("size", "wrong"), [(7, 4), (7, 5), (7, 6), (PANEL + 9, PANEL + 3)])
@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan])
def test_an_indefinite_matrix_is_refused(size, wrong, value):
    matrix = np.eye(size)
    matrix[wrong, wrong] = value
    assert not eliminate(in_chunks(matrix, size), size, 0)


def test_a_tiny_matrix_is_no_indefinite_one():
    front = in_chunks(1e-250 * np.eye(6), 4)
    assert eliminate(front, 4, 2)
    rows, _ = from_chunks(front, 6, 4)
    np.testing.assert_allclose(np.diag(rows[:, :4]), 1e-125)


def matrix_of(first, second, rows, weights, mass):
    """M + Σ wᵀ r rᵀ over rows (k,2d) of the two disks of each contact."""
    n, d = mass.shape
    full = sparse.diags_array(mass.ravel()).tocsr()
    for row, weight in zip(rows, weights, strict=True):
        matrix = sparse.lil_array((len(weight), n * d))
        for c in range(len(weight)):
            matrix[c, first[c] * d + np.arange(d)] = row[c, :d]
            if second[c] >= 0:
                matrix[c, second[c] * d + np.arange(d)] = row[c, d:]
        matrix = matrix.tocsr()
        full += matrix.T @ sparse.diags_array(weight) @ matrix
    return full.tocsc()


@pytest.mark.parametrize(("fronts", "threads"), [(False, 1), (True, 1), (True, 2)])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("name", ["heap", "hexagonal"])
def test_the_factor_solves(name, d, fronts, threads):
    """By rows, by fronts, and by fronts of which two threads work on eight pieces."""
    case = FAMILIES[name](200)
    crowd, contacts, draw = case.snapshot, case.contacts, np.random.default_rng(d)
    k, wall = len(contacts), contacts.is_wall
    first = contacts.first.astype(np.int32)
    second = np.where(wall, -1, contacts.second).astype(np.int32)
    other = np.where(wall, 0.0, crowd.radius[np.where(wall, 0, second)])
    levers = np.column_stack([crowd.radius[first], other])
    mass = np.column_stack([crowd.mass, crowd.mass, crowd.inertia])[:, :d].copy()
    along, across = np.full(k, 0.7), np.full(k, 0.5 if d == 3 else 0.0)
    theta = 10.0 ** draw.uniform(-2, 2, k) * mass[0, 0]
    normal, none = np.array(contacts.normal), np.zeros((k, 1))
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    rows = [
        np.hstack([normal, none, -normal, none]),
        np.hstack([tangent, levers[:, :1], -tangent, levers[:, 1:]]),
    ]
    if d == 2:
        rows = [np.hstack([row[:, :2], row[:, 3:5]]) for row in rows]
    right = draw.normal(size=mass.shape)
    matrix = matrix_of(first, second, rows, [theta + along, across], mass)
    expected = spsolve(matrix, right.ravel()).reshape(right.shape)
    factor = _core.Factor(
        (first, second, normal, crowd.position, crowd.radius, crowd.mass), along, across, d == 3,
        fronts, threads, 100 if threads > 1 else 10**9,
    )  # fmt: skip
    for _ in range(2):
        assert factor.factorise(theta)
        found = factor.solve(right)
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def dissected(case, position, leaf):
    """The ends of contacts, and the separator tree with parts of up to `leaf` disks."""
    contacts, crowd = case.contacts, case.snapshot
    first = contacts.first.astype(np.int32)
    second = np.where(contacts.is_wall, -1, contacts.second).astype(np.int32)
    pairs = first, second, np.array(contacts.normal), position, crowd.radius, crowd.mass
    none = np.zeros(len(first))
    factor = _core.Factor(pairs, none, none, False, True, leaf=leaf)
    of = factor.ordering()
    return first, second, (of.order, of.node_first, of.node_end, of.node_parent)


def test_separators_are_a_tree_that_holds_every_border():
    case = FAMILIES["heap"](300)
    first, second, (order, node_first, node_end, above) = dissected(case, case.snapshot.position, 8)
    n, position = len(order), np.argsort(order)
    np.testing.assert_array_equal(np.sort(order), np.arange(n))
    np.testing.assert_array_equal(node_first[1:], node_end[:-1])
    assert (node_first[0], node_end[-1]) == (0, n)
    assert (node_end >= node_first).all()
    assert ((above > np.arange(len(above))) | (above < 0)).all()
    # what a node reaches is eliminated by those above it
    node = np.searchsorted(node_end, np.arange(n), side="right")
    reached = [set() for _ in above]
    for a, b, other in zip(position[first], position[second], second, strict=True):
        if other >= 0:
            reached[node[min(a, b)]].add(int(max(a, b)))
    for s in range(len(above)):
        reached[s] = {k for k in reached[s] if k >= node_end[s]}
        up = set()
        t = above[s]
        while t >= 0:
            up.add(int(t))
            t = above[t]
        assert {int(node[k]) for k in reached[s]} <= up
        if above[s] >= 0:
            reached[above[s]] |= reached[s]


# Of the disks of a part, on either side of its median: see nscd/core/elimination_order.cpp.
STRIP_SHARE = 0.15


def fewest(edges, left, strip, right, n):
    """The fewest disks of the strip that part left from right: each can be passed once, from its
    gate a to its gate n + a."""
    source, sink, width = 2 * n, 2 * n + 1, n
    begin = [*strip, *np.concatenate([edges[:, 0], edges[:, 1]]) + n]
    end = [*np.asarray(strip) + n, *np.concatenate([edges[:, 1], edges[:, 0]])]
    capacity = [1] * len(strip) + [width] * (2 * len(edges))
    for disks, of in ((left, source), (right, sink)):
        begin += [of] * len(disks) if of == source else [*disks]
        end += [*np.asarray(disks) + n] if of == source else [sink] * len(disks)
        capacity += [width] * len(disks)
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
    first, second, (order, node_first, node_end, _) = dissected(case, position, n - 1)
    cut = order[node_first[-1] : node_end[-1]]

    edges = np.stack([first, second], axis=1)[second >= 0]
    rank = np.argsort(position[:, int(np.argmax(np.ptp(position, axis=0)))])
    one, two = int((0.5 - STRIP_SHARE) * n), int((0.5 + STRIP_SHARE) * n)
    assert len(cut) == fewest(edges, rank[:one], rank[one:two], rank[two:], n)
    assert set(cut) <= set(rank[one:two])

    left = np.setdiff1d(np.arange(n), cut)
    selected = edges[~np.isin(edges, cut).any(axis=1)]
    _, part = connected_components(
        sparse.coo_array((np.ones(len(selected)), selected.T), shape=(n, n)), directed=False
    )
    halves = part[np.intersect1d(left, rank[:one])], part[np.intersect1d(left, rank[two:])]
    assert not np.intersect1d(*halves).size


ROOT = Path(__file__).resolve().parents[2]


def test_readers_of_dumps_and_random_bytes_have_no_errors_of_memory(tmp_path):
    if shutil.which("g++") is None:
        pytest.skip("g++ is not installed: nothing to watch memory with")
    program = tmp_path / "readers"
    sources = [ROOT / "tests/core/readers.cpp", ROOT / "nscd/core/dump_text.cpp"]
    flags = "-std=c++20 -O1 -g0 -Wno-psabi -fsanitize=address,undefined -fno-sanitize-recover=all"
    words = ["g++", *flags.split(), "-D_GLIBCXX_ASSERTIONS", f"-I{ROOT / 'nscd/core'}"]
    subprocess.run([*words, *sources, "-o", program], check=True, capture_output=True)
    ended = subprocess.run([program], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_the_stub_is_that_of_the_core(tmp_path):
    stub = tmp_path / "_core.pyi"
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "nscd._core", "-o", str(stub)]
    subprocess.run(command, check=True)
    assert stub.read_text() == Path(_core.__file__).with_name("_core.pyi").read_text()
