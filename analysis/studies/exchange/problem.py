"""Contact problems as matrices in the forms that FCLIB knows, and its layout in HDF5.

FCLIB: fclib.h of the Frictional Contact Library (Apache-2.0), Acary et al., Inria technical report
RT-444 (2014)."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, vstack
from scipy.sparse.linalg import splu

from analysis.support.extras import load
from analysis.support.files import whole_file
from analysis.support.foreign import Node, read_foreign
from analysis.support.reading import UnreadableError, begins
from nscd import Snapshot
from nscd.arrays import LARGEST, Floats
from nscd.contacts import Contacts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GlobalProblem:
    """Hold the problem M v = f + H r, u = Hᵀ v + w, of k contacts in the plane.

    Of each contact u_n opens, r_n presses, and Coulomb's law is 0 ≤ r_n ⟂ u_n ≥ 0, |r_t| ≤ μ r_n,
    r_t u_t = −μ r_n |u_t|."""

    mass: csc_array  # M (v,v) kg, kg m²
    transfer: csc_array  # H (v,2k), columns in the order normal, tangent of each contact
    momentum: Floats  # f (v,) N·s
    offset: Floats  # w (2k,) m/s
    friction: Floats  # μ (k,)

    @classmethod
    def of(
        cls, snapshot: Snapshot, contacts: Contacts, left: Floats, friction: Floats
    ) -> GlobalProblem:
        """State the inelastic impact of disks with left velocity (n,2) m/s and the spins of the
        snapshot, at contacts with μ (k,): v = (x, y, ω) of each disk, H = −(C, T)ᵀ. Raises ValueError
        for bodies of several disks."""
        snapshot.need_disks("FCLIB")
        n, k = len(snapshot), len(contacts)
        diagonal = np.column_stack([snapshot.mass, snapshot.mass, snapshot.inertia]).ravel()
        velocity = np.column_stack([left, snapshot.spin]).ravel()
        return cls(
            mass=csc_array(diags_array(diagonal)),
            transfer=_transfer(snapshot, contacts, n, k),
            momentum=diagonal * velocity,
            offset=np.zeros(2 * k),
            friction=friction,
        )

    def local(self) -> LocalProblem:
        """Eliminate the velocities: W = Hᵀ M⁻¹ H, q = Hᵀ M⁻¹ f + w. Raises ValueError for a mass
        matrix that has no inverse."""
        diagonal = self.mass.diagonal()
        if self.mass.nnz == len(diagonal) and (diagonal != 0).all():
            carried = csc_array(diags_array(1.0 / diagonal) @ self.transfer)
            free = self.momentum / diagonal
        else:
            try:
                factor = splu(csc_array(self.mass))
            except RuntimeError:
                raise ValueError("M: singular. A mass matrix has an inverse") from None
            carried = csc_array(factor.solve(self.transfer.toarray()))
            free = factor.solve(self.momentum)
        return LocalProblem(
            delassus=csc_array(self.transfer.T @ carried),
            free=self.transfer.T @ free + self.offset,
            friction=self.friction,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalProblem:
    """Hold the problem u = W r + q of k contacts in the plane, without its bodies."""

    delassus: csc_array  # W (2k,2k) 1/kg
    free: Floats  # q (2k,) m/s
    friction: Floats  # μ (k,)


def _transfer(snapshot: Snapshot, contacts: Contacts, n: int, k: int) -> csc_array:
    """H (3n,2k): what reactions along the normal and across it give to each disk."""
    normal, tangent, lever = contacts.normal, contacts.tangent, snapshot.radius[:, None]
    along = np.column_stack([normal, np.zeros(k)])
    # both turn the same way
    first, second = (
        np.column_stack([across, -lever[disk]])
        for across, disk in ((-tangent, contacts.first), (tangent, contacts.second))
    )
    rows = vstack([contacts.rows(-along, along, n), contacts.rows(first, second, n)])
    found = csc_array(rows.T)[:, np.arange(2 * k).reshape(2, k).T.ravel()]
    found.eliminate_zeros()
    found.sort_indices()
    return found


# The first bytes of an HDF5 file.
SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Its groups that are read.
KNOWN = ("fclib_global", "fclib_local", "solution", "truth", "crowd")
# What `nz` says of a matrix that is no list of triplets.
COLUMNS, ROWS = -1, -2


class ExchangeError(ValueError):
    """Refuse a file of another program; the message names the file and the group or dataset."""


def is_hdf5(path: Path) -> bool:
    """Tell whether a file begins as HDF5 does. Raises UnreadableError for what is no file."""
    return begins(path, SIGNATURE)


@contextlib.contextmanager
def new_file(path: Path) -> Iterator[Any]:
    """Open an HDF5 file for writing, which takes its name only if the block ends well."""
    content = io.BytesIO()
    with load("h5py").File(content, "w") as file:
        yield file
    with whole_file(path, "wb") as full:
        full.write(content.getvalue())


def opened(path: Path) -> Group:
    """Read the parts of an HDF5 file that FCLIB and this program know. Raises ExchangeError naming
    it."""
    load("h5py")
    if not is_hdf5(path):
        raise ExchangeError(f"{path}: no HDF5 file")
    try:
        return Group(path, read_foreign(path, "hdf5", KNOWN))
    except UnreadableError as error:
        raise ExchangeError(str(error)) from None


def put_words(group: Any, name: str, words: str) -> None:
    """Write a text as FCLIB does: fixed length, ended by a zero byte."""
    library, content = load("h5py"), words.encode() + b"\0"
    kind = library.h5t.C_S1.copy()
    kind.set_size(len(content))
    kind.set_strpad(library.h5t.STR_NULLTERM)
    space = library.h5s.create(library.h5s.SCALAR)
    # without the time, so that the same problem is the same file
    undated = library.h5p.create(library.h5p.DATASET_CREATE)
    undated.set_obj_track_times(False)
    made = library.h5d.create(group.id, name.encode(), kind, space, undated)
    made.write(library.h5s.ALL, library.h5s.ALL, np.array(content), mtype=kind)


def put_whole(group: Any, name: str, value: int) -> None:
    """Write a whole number as FCLIB does: one element of 32 bits."""
    group.create_dataset(name, data=np.array([value], dtype=np.int32))


def put_numbers(group: Any, name: str, values: ArrayLike, unit: str | None = None) -> None:
    """Write an array of float64, with its unit as an attribute where one is given."""
    made = group.create_dataset(name, data=np.asarray(values, dtype=np.float64))
    if unit is not None:
        made.attrs["unit"] = unit


def put_matrix(group: Any, name: str, matrix: csc_array) -> None:
    """Write a matrix in compressed columns."""
    subgroup, matrix = group.create_group(name), csc_array(matrix)
    put_whole(subgroup, "nzmax", matrix.nnz)
    put_whole(subgroup, "m", matrix.shape[0])
    put_whole(subgroup, "n", matrix.shape[1])
    put_whole(subgroup, "nz", COLUMNS)
    subgroup.create_dataset("p", data=matrix.indptr.astype(np.int32))
    subgroup.create_dataset("i", data=matrix.indices.astype(np.int32))
    put_numbers(subgroup, "x", matrix.data)


class Group:
    """A group of a file that is read, each part checked for its kind, shape and numbers."""

    def __init__(self, path: Path, content: Node, name: str = "") -> None:
        self.path, self.content, self.name = path, content, name

    def refuse(self, key: str, why: str) -> ExchangeError:
        """Make the error that names the file and the part."""
        return ExchangeError(f"{self.path}: {self.name}/{key}: {why}")

    def __contains__(self, key: str) -> bool:
        return key in self.content.below

    def group(self, key: str) -> Group:
        """Open a group below this one."""
        if key not in self:
            raise self.refuse(key, "missing group")
        below = self.content.below[key]
        if below.values is not None:
            raise self.refuse(key, "no group")
        return Group(self.path, below, f"{self.name}/{key}")

    def _dataset(self, key: str) -> Any:
        if key not in self:
            raise self.refuse(key, "missing")
        found = self.content.below[key].values
        if found is None:
            raise self.refuse(key, "no dataset")
        return found

    def length(self, key: str) -> int:
        """Read how many rows a dataset has."""
        found = self._dataset(key)
        if not found.shape:
            raise self.refuse(key, "an array is needed")
        return int(found.shape[0])

    def words(self, key: str) -> str:
        """Read a text."""
        found = self._dataset(key)
        if found.shape or found.dtype.kind != "S":
            raise self.refuse(key, "a text is needed")
        return bytes(found[()]).rstrip(b"\0").decode("utf-8", "replace")

    def integer(self, key: str, minimum: int = 0) -> int:
        """Read one whole number."""
        found = self._dataset(key)
        if found.size != 1 or found.dtype.kind not in "iu":
            raise self.refuse(key, "one whole number is needed")
        value = int(np.ravel(found[()])[0])
        if value < minimum:
            raise self.refuse(key, f"{value}. At least {minimum} is needed")
        return value

    def wholes(self, key: str, shape: tuple[int, ...]) -> Any:
        """Read an array of whole numbers of this shape."""
        found = self._dataset(key)
        if found.dtype.kind not in "iub" or found.shape != shape:
            raise self.refuse(key, f"whole numbers of shape {shape} are needed, not {found.shape}")
        return found[()].astype(np.int64)

    def numbers(
        self, key: str, shape: tuple[int, ...], unit: str | None = None, *, gaps: bool = False
    ) -> Floats:
        """Read an array of finite numbers of this shape, in this unit where one is asked for; numbers
        that cannot be computed with are refused, but for nan where there may be gaps."""
        found = self._dataset(key)
        if found.dtype.kind not in "fiu" or found.shape != shape:
            raise self.refuse(key, f"numbers of shape {shape} are needed, not {found.shape}")
        stated = self.content.below[key].attributes.get("unit")
        if unit is not None and stated != unit:
            raise self.refuse(key, f"unit {stated!r} where {unit!r} is needed")
        values: Floats = found[()].astype(np.float64)
        valid = (np.abs(values.ravel()) <= LARGEST) | (gaps & np.isnan(values.ravel()))
        if not valid.all():
            index = int(np.argmin(valid))
            raise self.refuse(
                key,
                f"entry {index + 1}: {values.flat[index]:g}. Numbers up to {LARGEST:g} are needed",
            )
        return values

    def matrix(self, key: str, rows: int | None = None) -> csc_array:
        """Read a matrix in compressed columns (nz = −1), rows (−2) or triplets (≥ 0), with this
        number of rows where it is given."""
        group = self.group(key)
        m, n = group.integer("m"), group.integer("n")
        if rows is not None and m != rows:
            raise group.refuse("m", f"{m} where {rows} is needed")
        nz, entries = group.integer("nz", ROWS), group.integer("nzmax")
        if nz >= 0:
            row, column = group.wholes("p", (nz,)), group.wholes("i", (nz,))
            group.check_range("p", row, m)
            group.check_range("i", column, n)
            return csc_array(coo_array((group.numbers("x", (nz,)), (row, column)), shape=(m, n)))
        major, minor = (n, m) if nz == COLUMNS else (m, n)
        starts = group.wholes("p", (major + 1,))
        if starts[0] or starts[-1] > entries or (np.diff(starts) < 0).any():
            raise group.refuse(
                "p", f"from 0 to at most nzmax = {entries}, never falling, is needed"
            )
        indices, values = group.wholes("i", (entries,)), group.numbers("x", (entries,))
        group.check_range("i", indices, minor)
        kind = csc_array if nz == COLUMNS else csr_array
        end = starts[-1]
        full = kind((values[:end], indices[:end], starts), shape=(m, n))
        # entries that are given twice count twice
        found = csc_array(full)
        found.sum_duplicates()
        return found

    def check_range(self, key: str, indices: Any, end: int) -> None:
        """Refuse indices outside of 0 … end − 1."""
        if len(indices) and not (indices.min() >= 0 and indices.max() < end):
            raise self.refuse(key, f"an index outside of 0 … {end - 1}")
