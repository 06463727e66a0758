"""A packing with measured contact forces: read, its error bar, its boundary and its loads.

Files of a step, all `PREFIX_WHAT`: `ParticleData.dlm` (id, x, y, r) and
`NormWeightedAdjacencyMatrix.dlm` (n × n, N[i,j] the normal force at the contact of i with j as fitted
in the image of i), or `coordinates.txt` (x y r) and `bonds.txt` (i j flag T N from 0, one side only).
Lengths in pixels, forces in N. Liu, Kollmer, Daniels, Schwarz, Henkes, arXiv 2006.00557."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from analysis.support.cells import cells_of, number_of
from analysis.support.reading import UnreadableError, read_text
from nscd import Contacts, Snapshot, find_contacts
from nscd.arrays import Floats, Indices, Mask

DISKS, MATRIX = "ParticleData.dlm", "NormWeightedAdjacencyMatrix.dlm"
PLACES, BONDS = "coordinates.txt", "bonds.txt"
LARGEST_FILE = 100 << 20  # a matrix of 2,000 disks as text
# In units of the smallest radius: gaps of contacts; edges of boundary disks from the wall, of any and
# of those that nothing stands before; gaps beyond which a pair is no contact but a wrong index.
GAP, NEAR, SIGHT, NEVER = 4 / 19, 20 / 19, 45 / 19, 1.0
# Of the mean of two sides, where the file has one only: within what published data have.
ALPHA, BETA_N = 0.085, 0.0046
BINS, FEWEST = 6, 60  # of the fit of the error
NORMAL_MEDIAN = 0.6745  # median |z| of a normal law
DETECTED = 0.01  # quantile of the forces below which none is detected


class ErrorBar(NamedTuple):
    """Hold σ = √((αF)² + β²), β in N, of the mean F of both sides, and the correlation of the sides."""

    alpha: float = ALPHA
    beta: float = BETA_N
    correlation: float = float("nan")

    @property
    def assumed(self) -> bool:
        """Tell whether it is not from both sides of the contacts."""
        return not np.isfinite(self.correlation)

    def of(self, force: Floats, sides: Indices) -> Floats:
        """Compute σ (…,k) N of forces (…,k) N that were seen from one or two sides (k,)."""
        one = np.hypot(self.alpha * force, self.beta)
        return np.asarray(one * np.sqrt(2 / np.maximum(sides, 1)))


@dataclass(frozen=True, kw_only=True, eq=False)
class Packing:
    """Hold a step: n disks at rest, lengths in px, masses as areas, and their k contacts.

    force: (k,) N, F, the mean of the sides that saw it; sides: (k,) 0, 1 or 2
    error: of F; least: N, below which nothing is detected"""

    name: str
    snapshot: Snapshot
    contacts: Contacts
    force: Floats
    sides: Indices
    error: ErrorBar
    least: float

    @cached_property
    def sigma(self) -> Floats:
        """σ (k,) N of all contacts: of none detected the least that is."""
        return np.where(self.sides > 0, self.error.of(self.force, self.sides), self.least)

    @cached_property
    def boundary(self) -> Mask:
        """Tell (n,) which disks a wall can touch: their edge is near the bounding box, or farther and
        no other disk is between (by the ray from the centre)."""
        x, r = self.snapshot.position, self.snapshot.radius
        found = np.zeros(len(r), dtype=bool)
        for axis, sign in ((0, -1), (0, 1), (1, -1), (1, 1)):
            beside = np.abs(x[:, None, 1 - axis] - x[None, :, 1 - axis]) < r[None]
            edge = sign * x[:, axis] + r
            far = edge.max() - edge
            hidden = (beside & (far[None] < far[:, None])).any(1)
            found |= far < np.where(hidden, NEAR, SIGHT) * r.min()
        return found

    @cached_property
    def inner(self) -> Mask:
        """Tell (k,) which contacts are of two inner disks: those that are predicted and scored."""
        edge = self.boundary
        return np.asarray(~edge[self.contacts.first] & ~edge[self.contacts.second])

    @cached_property
    def carries(self) -> Mask:
        """Tell (k,) which of these have a force."""
        return self.inner & (self.force > 0)

    @cached_property
    def loads(self) -> Floats:
        """L (n,2) N of the walls: Σ F n balances the normal forces of a boundary disk; shifted to zero
        sum. Inner disks have none."""
        edge = self.boundary[:, None]
        return np.asarray(self.needed - edge * self.needed.sum(0) / edge.sum())

    @property
    def unbalanced(self) -> float:
        """|Σ L| over Σ |L| before the shift: what the measured forces leave open."""
        return float(np.hypot(*self.needed.sum(0)) / np.hypot(*self.needed.T).sum())

    @cached_property
    def needed(self) -> Floats:
        """L (n,2) N before the shift."""
        push = self.force[:, None] * self.contacts.normal
        load = self.contacts.sum_at_disks(push, len(self.snapshot), on_second=-push)
        return np.where(self.boundary[:, None], load, 0.0)

    @cached_property
    def scale(self) -> float:
        """f (N), the mean force of contacts by the virial: −Σ L·x / Σ d, d between centres."""
        r, among = self.snapshot.radius, self.contacts
        length = float((r[among.first] + r[among.second] + among.gap).sum())
        return -float((self.loads * self.snapshot.position).sum()) / length


def steps_of(folder: Path) -> dict[str, tuple[Path, Path]]:
    """Find the steps in a folder: by their names the files of disks and of forces. Raises ValueError
    where there is none, or where a step lacks a file."""
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder")
    ends = (DISKS, PLACES), (MATRIX, BONDS)
    every = [(path, end) for path in folder.iterdir() for kind in ends for end in kind]
    names = {path.name.removesuffix(end) for path, end in every if path.name.endswith(end)}
    if not names:
        raise ValueError(f"{folder}: no step in it. Needed are {DISKS} and {MATRIX}")
    found = {}
    for prefix in sorted(names):
        paths = []
        for kind in ends:
            both = [folder / f"{prefix}{end}" for end in kind]
            paths.append(next((path for path in both if path.exists()), both[0]))
            if not paths[-1].exists():
                raise ValueError(f"{paths[-1]}: no such file")
        found[prefix.removesuffix("_").removesuffix("_solved_Tracke") or folder.name] = tuple(paths)
    return found  # type: ignore[return-value]


def read_packing(name: str, disks: Path, forces: Path, error: ErrorBar | None = None) -> Packing:
    """Read a step; error: its error bar, which else comes from both sides or is the published one.

    Raises ValueError naming file and line for what is no such table: not square, another size than
    there are disks, ids out of order, no number, a force below 0, no force at all."""
    listed = disks.suffix == ".dlm"
    table = _numbers(disks, "," if listed else None)
    if listed:
        _refuse(disks, table[:, 0] != np.arange(1, len(table) + 1), "ids 1, 2, … are needed")
        table = table[:, 1:]
    if table.shape[1] < 3:
        raise UnreadableError(f"{disks}: x, y and r are needed")
    position, radius = table[:, :2], table[:, 2]
    _refuse(disks, ~(radius > 0), "a radius > 0 is needed")
    read = _matrix if forces.suffix == ".dlm" else _bonds
    first, second, one, other = read(forces, len(radius))
    if not len(first):
        raise UnreadableError(f"{forces}: no force in it")
    snapshot = disks_at(position, radius)
    contacts, location = contacts_listed(snapshot, first, second)
    if (location < 0).any():
        i, j = first[location < 0][0] + 1, second[location < 0][0] + 1
        raise UnreadableError(f"{forces}: disks {i} and {j} have a force and do not touch")
    visited = np.zeros((2, len(contacts)))
    visited[:, location] = one, other
    sides = (visited > 0).sum(0)
    force = visited.sum(0) / np.maximum(sides, 1)
    return Packing(
        name=name, snapshot=snapshot, contacts=contacts, force=force, sides=sides,
        error=error or _fitted(visited, force), least=float(np.quantile(visited[visited > 0], DETECTED)),
    )  # fmt: skip


def disks_at(position: Floats, radius: Floats) -> Snapshot:
    """Make disks at rest of positions (n,2) px and radii (n,) px, with their areas as masses."""
    return Snapshot(position=position, radius=radius, mass=np.pi * radius**2)


def contacts_listed(disks: Snapshot, first: Indices, second: Indices) -> tuple[Contacts, Indices]:
    """Find the pairs with a gap of at most GAP, and all pairs first < second (m,) with a force; return
    them and the place (m,) of the latter among them, −1 where they are far apart."""
    n, unit = len(disks), disks.radius.min()
    found = find_contacts(disks, tolerance=NEVER * unit)
    pairs = first * n + second
    selected = found.select((found.gap <= GAP * unit) | np.isin(found.first * n + found.second, pairs))
    where = {pair: index for index, pair in enumerate((selected.first * n + selected.second).tolist())}
    return selected, np.array([where.get(pair, -1) for pair in pairs.tolist()], dtype=np.int64)


def _refuse(path: Path, wrong: Mask, words: str) -> None:
    """Raise UnreadableError for the first line that is wrong."""
    if wrong.any():
        raise UnreadableError(f"{path}, line {int(np.argmax(wrong)) + 1}: {words}")


def _numbers(path: Path, between: str | None) -> Floats:
    """The rows of a table of numbers, all of one length; decimal commas too, between ; or tabs."""
    rows: list[list[float]] = []
    content = read_text(path, LARGEST_FILE).rstrip()
    for line, text in enumerate(content.splitlines(), start=1):
        try:
            rows.append(list(map(float, text.split(between))))
        except ValueError:
            cells = cells_of(text)
            numbers = [value for value in map(number_of, cells) if value is not None]
            if len(numbers) < len(cells) or ("." in content and "," in "".join(cells)):
                what = "numbers, with decimal points or commas throughout"
                raise UnreadableError(f"{path}, line {line}: {text[:60]!r}: {what}") from None
            rows.append(numbers)
        if not (rows[-1] and len(rows[-1]) == len(rows[0]) and np.isfinite(rows[-1]).all()):
            there = f"{len(rows[0])} finite numbers are needed, as line 1 has"
            raise UnreadableError(f"{path}, line {line}: {there}")
    if not rows:
        raise UnreadableError(f"{path}: empty")
    return np.array(rows)


Sides = tuple[Indices, Indices, Floats, Floats]


def _matrix(path: Path, n: int) -> Sides:
    """Pairs with a force, and what either side saw, of a dense matrix."""
    observed = _numbers(path, ",")
    if observed.shape != (n, n):
        raise UnreadableError(f"{path}: {observed.shape[0]} × {observed.shape[1]} numbers for {n} disks")
    _refuse(path, np.asarray((observed < 0).any(1)), "a force below 0")
    _refuse(path, observed.diagonal() != 0, "a force of a disk on itself")
    first, second = np.nonzero(np.triu((observed > 0) | (observed.T > 0)))
    return first, second, observed[first, second], observed[second, first]


def _bonds(path: Path, n: int) -> Sides:
    """Pairs with a force of a list `i j flag T N` from 0, seen from i alone."""
    rows = _numbers(path, None)
    if rows.shape[1] != 5:
        raise UnreadableError(f"{path}: {rows.shape[1]} numbers a line. Needed are i j flag T N")
    pair = np.sort(rows[:, :2], axis=1)
    wrong = (pair != np.round(pair)).any(1) | (pair[:, 0] < 0) | (pair[:, 1] >= n)
    _refuse(path, np.asarray(wrong | (pair[:, 0] == pair[:, 1])), f"not two of {n} disks")
    _refuse(path, rows[:, 4] < 0, "a force below 0")
    position = pair @ (n, 1)
    _refuse(
        path, ~np.isin(np.arange(len(pair)), np.unique(position, return_index=True)[1]), "a pair again"
    )
    carries = rows[:, 4] > 0
    first, second = pair[carries].astype(np.int64).T
    return first, second, rows[carries, 4], np.zeros(len(first))


def _fitted(observed: Floats, force: Floats) -> ErrorBar:
    """α and β from the robust spread median|a − b| / 2 / 0.6745 in bins of F with equal counts."""
    both = np.flatnonzero((observed > 0).all(0))
    if len(both) < FEWEST:
        return ErrorBar()
    bins = np.array_split(both[np.argsort(force[both])], BINS)
    difference = np.abs(observed[0] - observed[1]) / (2 * NORMAL_MEDIAN)
    spread, middle = np.array([[np.median(difference[some]), np.median(force[some])] for some in bins]).T
    weight = 1 / np.maximum(spread, 1e-9 * middle) ** 2
    squares, _ = nnls(np.column_stack([weight * middle**2, weight]), weight * spread**2)
    alpha, beta = np.sqrt(squares).tolist()
    correlation = float(np.corrcoef(*observed[:, both])[0, 1])
    return ErrorBar(alpha, max(beta, 1e-6 * force.max()), correlation)
