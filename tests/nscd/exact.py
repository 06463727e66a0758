"""Exact answers of small contact problems in rational arithmetic: the oracle of the tests.

Lawson and Hanson's active set on the dual, min ½ λ·Wλ − λ·Cû, λ ≥ 0: in exact arithmetic a contact
that would close is independent of those that are closed, so that it ends whatever is redundant."""

from fractions import Fraction

import numpy as np


def linear_solve(matrix, right):
    """x of matrix x = right, lists of Fractions, by elimination."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    n = len(rows)
    for column in range(n):
        pivot = next(r for r in range(column, n) if rows[r][column] != 0)
        rows[column], rows[pivot] = rows[pivot], rows[column]
        head = [value / rows[column][column] for value in rows[column]]
        rows[column] = head
        for r in range(n):
            factor = rows[r][column]
            if r != column and factor != 0:
                rows[r] = [a - factor * b for a, b in zip(rows[r], head, strict=True)]
    return [row[n] for row in rows]


def fractions(array):
    """The same numbers as nested lists of Fractions."""
    return [fractions(row) if np.ndim(row) else Fraction(float(row)) for row in array]


def product(matrix, vector):
    """matrix · vector, of lists of Fractions."""
    return [sum(a * b for a, b in zip(row, vector, strict=True) if a) for row in matrix]


def exact_velocity(snapshot, contacts, left, dissipation=None, maintained=False):
    """u⁺ (n,2) of the collision law with k = dissipation (k,) kg along the normals of disks without
    spin, as an array of Fractions; C u⁺ = 0 where maintained, whatever k.

    A contact has a hard percussion, 0 ≤ λ ⟂ −C u⁺ ≥ 0, and with k > 0 a soft one that pushes and
    never
    pulls: 0 ≤ κ ⟂ κ/k − C(u⁺ + u⁻) ≥ 0."""
    n = len(snapshot)
    K = [Fraction(0)] * len(contacts)
    if dissipation is not None and not maintained:
        K = fractions(dissipation)
    hard = _rows(contacts, n)
    soft = [c for c, k in enumerate(K) if k > 0]
    C = hard + [hard[c] for c in soft]
    size = len(C)
    mass = [m for m in fractions(snapshot.mass) for _ in (0, 1)]
    u = [v for row in fractions(left) for v in row]
    columns = [[a / m for a, m in zip(row, mass, strict=True)] for row in C]  # M⁻¹Cᵀ
    W = [product(C, column) for column in columns]
    q = product(C, u)
    for at, c in enumerate(soft, len(hard)):
        W[at][at] += 1 / K[c]
        q[at] *= 2
    reaction, closed = _least_norm(W, q, maintained)
    exact = [u[i] - sum(columns[c][i] * reaction[c] for c in closed) for i in range(2 * n)]
    # the Karush–Kuhn–Tucker conditions, to the last digit
    after = product(C, exact)
    for c in range(size):
        pushed = 0 if c < len(hard) else reaction[c] / K[soft[c - len(hard)]] - q[c] / 2
        closing = after[c] - pushed
        assert closing == 0 if maintained else closing <= 0
        assert maintained or (reaction[c] >= 0 and reaction[c] * closing == 0)
    return np.array(exact, dtype=object).reshape(n, 2)


def _rows(contacts, n):
    """C, a row (2n) of Fractions for each contact."""
    normal, rows = fractions(contacts.normal), []
    for c in range(len(contacts)):
        row = [Fraction(0)] * (2 * n)
        for axis in (0, 1):
            row[2 * contacts.first[c] + axis] += normal[c][axis]
            if not contacts.is_wall[c]:
                row[2 * contacts.second[c] + axis] -= normal[c][axis]
        rows.append(row)
    return rows


def _least_norm(W, q, maintained):
    """λ of min ½ λ·Wλ − λ·q over λ ≥ 0, or of W λ = q where maintained, and its indices."""
    k = len(q)
    reaction = [Fraction(0)] * k
    closed = []
    while True:
        pull = [q[c] - sum(W[c][e] * reaction[e] for e in closed) for c in range(k)]
        size = [abs(p) if maintained else p for p in pull]
        best = max((c for c in range(k) if c not in closed), key=size.__getitem__, default=None)
        if best is None or size[best] <= 0:
            return reaction, closed
        closed.append(best)
        while True:
            block = [[W[c][e] for e in closed] for c in closed]
            wanted = linear_solve(block, [q[c] for c in closed])
            if maintained or min(wanted) > 0:
                break
            steps = [
                reaction[c] / (reaction[c] - w)
                for c, w in zip(closed, wanted, strict=True)
                if w <= 0
            ]
            for c, w in zip(closed, wanted, strict=True):
                reaction[c] += min(steps) * (w - reaction[c])
            closed = [c for c in closed if reaction[c] > 0]
        reaction = [Fraction(0)] * k
        for c, w in zip(closed, wanted, strict=True):
            reaction[c] = w


def distance(snapshot, velocity, exact):
    """√(Σ m |velocity − exact|² / Σ m) (m/s), the differences taken in Fractions."""
    mass = fractions(snapshot.mass)
    difference = np.array(fractions(velocity), dtype=object) - exact
    square = sum(m * (x * x + y * y) for m, (x, y) in zip(mass, difference, strict=True))
    return float(square / sum(mass)) ** 0.5
