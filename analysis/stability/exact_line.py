"""Percussions of a short line of disks in exact arithmetic."""

import itertools
from collections.abc import Sequence
from fractions import Fraction


def exact_line(
    mass: Sequence[int], velocity: Sequence[Fraction], dissipation: Sequence[Fraction]
) -> tuple[list[Fraction], Fraction]:
    """Compute u⁺ (n) and the change of the kinetic energy ½Σm(u⁺² − u⁻²) of n touching disks in a
    line, in exact arithmetic.

    M(u⁺ − u⁻) + Cᵀp = 0, p = k max(C(u⁺ + u⁻), 0) + λ, 0 ≤ λ ⟂ −C u⁺ ≥ 0 (see `ContactLaw`) with
    one k (kg) per contact. Every choice of closed contacts, and of those where k acts, is tried
    until one gives λ ≥ 0, C u⁺ ≤ 0 and the signs of C(u⁺ + u⁻): for short lines only. Raises
    ValueError where none does, which the convexity of the problem excludes."""
    n = len(mass)
    before = [velocity[c] - velocity[c + 1] for c in range(n - 1)]
    for closed in itertools.product((True, False), repeat=n - 1):
        choices = [
            (shut,) if not k or shut or v <= 0 else (True, False)
            for shut, k, v in zip(closed, dissipation, before, strict=True)
        ]
        for acts in itertools.product(*choices):
            k = [
                value if act and v > 0 else Fraction(0)
                for value, act, v in zip(dissipation, acts, before, strict=True)
            ]
            after, reaction = _with_closed(mass, velocity, k, closed)
            rates = [after[c] - after[c + 1] for c in range(n - 1)]
            pushed = [a + b for a, b in zip(rates, before, strict=True)]
            signs = all(
                w >= 0 if acting else w <= 0 or not value
                for w, acting, value in zip(pushed, k, dissipation, strict=True)
            )
            if signs and all(r >= 0 for r in reaction) and all(v <= 0 for v in rates):
                change = sum(
                    (m * (a * a - b * b) for m, a, b in zip(mass, after, velocity, strict=True)),
                    Fraction(0),
                )
                return after, change / 2
    raise ValueError("velocity: no set of closed contacts fits")


def _with_closed(
    mass: Sequence[int],
    velocity: Sequence[Fraction],
    dissipation: Sequence[Fraction],
    closed: Sequence[bool],
) -> tuple[list[Fraction], list[Fraction]]:
    """u⁺ (n) and λ (n − 1) with these contacts closed and no λ at the others."""
    n = len(mass)
    rows: list[list[Fraction]] = []
    for i in range(n):
        row, right = [Fraction(0)] * (2 * n - 1), mass[i] * velocity[i]
        row[i] += mass[i]
        for c, sign in ((i, 1), (i - 1, -1)):
            if 0 <= c < n - 1:
                row[c] += sign * dissipation[c]
                row[c + 1] -= sign * dissipation[c]
                right -= sign * dissipation[c] * (velocity[c] - velocity[c + 1])
                row[n + c] += sign
        rows.append([*row, right])
    for c in range(n - 1):
        row = [Fraction(0)] * (2 * n)
        if closed[c]:
            row[c], row[c + 1] = Fraction(1), Fraction(-1)
        else:
            row[n + c] = Fraction(1)
        rows.append(row)
    found = _eliminate(rows)
    return found[:n], found[n:]


def _eliminate(rows: list[list[Fraction]]) -> list[Fraction]:
    """The solution of a regular system, rows with the right side last, by Gauss and Jordan."""
    size = len(rows)
    for i in range(size):
        pivot = next(r for r in range(i, size) if rows[r][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [value / rows[i][i] for value in rows[i]]
        for r in range(size):
            if r != i and rows[r][i]:
                factor = rows[r][i]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[i], strict=True)]
    return [row[-1] for row in rows]
