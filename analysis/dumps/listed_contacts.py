"""The contacts that came with a dump of disks, held against its disks. What only LAMMPS' own dump of
pairs leaves out is found from them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps.bodies import PLACES, FixedDisks
from analysis.dumps.contact_tables import index_table
from analysis.dumps.contacts import CONTACT_COLUMNS, EngineContacts, contacts_at, keys_of
from analysis.dumps.find_frames import DumpError
from analysis.dumps.index import DumpIndex, index_dump
from analysis.dumps.last_digits import LEAST_PLACE, LastDigit
from analysis.dumps.open_dump import snapshot_of
from analysis.scene.scene import Scene
from analysis.support.reading import begins, note, note_unused
from nscd import Snapshot
from nscd.arrays import Floats, Indices, Mask

# What a dump of pairs must have: ids, and the force on one of the two (N). It may have tangential
# forces beside normal ones (N), and the distance of the centres (m).
PAIR_COLUMNS, MORE_COLUMNS = ("first", "second", "fx", "fy"), ("tx", "ty", "dist")
# Names of LAMMPS' compute property/local.
ALIASES = {"patom1": "first", "patom2": "second", "natom1": "first", "natom2": "second"}
KNOWN = (*CONTACT_COLUMNS, *MORE_COLUMNS, "step", "time_s")
# m, texts have places to so much at least, and need not to more; directions may be off by this, too.
COARSEST_M, FINEST_M, DIRECTION = 1e-3, 1e-9, 1e-5
# Frames in which the sign of forces is looked at, and the shares of normal forces that may pull there,
# and of which it is said.
LOOKED_AT, PULLING, LITTLE = 20, 0.25, 0.001


def open_contacts(path: Path, mapping: str | None = None, bodies: Any = None) -> DumpIndex:
    """Index a dump of contacts, of pairs as LAMMPS' dump local writes it, or a table (CSV, Parquet) for the
    frames of a trajectory of bodies, under the names of CONTACT_COLUMNS, or PAIR_COLUMNS and MORE_COLUMNS.

    mapping: words such as `first=c_ids[1] fx=c_f[3]`, names and the columns that are meant

    Raises DumpError for columns that are missing or named twice, and whatever `index_dump` finds."""

    def rename(columns: Sequence[str]) -> tuple[str, ...]:
        has = f"It has: {' '.join(columns)}"
        meant = {one: ALIASES[one] for one in columns if one in ALIASES}
        for word in (mapping or "").replace(",", " ").split():
            name, _, column = word.partition("=")
            if name not in KNOWN and column in KNOWN:
                name, column = column, name
            if name not in KNOWN or column not in columns:
                raise DumpError(
                    f"{path}: --contacts-columns: {word!r} where NAME=COLUMN is needed, NAME one of "
                    f"{', '.join(KNOWN)}. {has}"
                )
            meant = {one: old for one, old in meant.items() if old != name} | {column: name}
        names = tuple(meant.get(one, one) for one in columns)
        missing = [name for name in PAIR_COLUMNS if name not in names]
        if missing or len({*names}) < len(names):
            raise DumpError(
                f"{path}: {'missing columns: ' if missing else 'one name for two columns'}"
                f"{', '.join(missing)}. {has}. Say which is which with --contacts-columns"
            )
        full = {*CONTACT_COLUMNS} <= {*names}
        used = CONTACT_COLUMNS if full else (*PAIR_COLUMNS, *MORE_COLUMNS, "is_wall", "step", "time_s")
        note_unused(path, "columns", [old for old, new in zip(columns, names, strict=True) if new not in used])
        return names

    if bodies is not None and (path.is_dir() or not begins(path, b"ITEM:")):
        return index_table(path, bodies, rename)
    index = index_dump(path, "ENTRIES")
    return replace(index, columns=rename(index.columns))


def checked_contacts(
    index: DumpIndex, number: int, snapshot: Snapshot, scene: Scene, fixed: Any = ()
) -> EngineContacts:
    """Read the contacts of a frame, of which the snapshot is. Raises DumpError naming the line of one
    with a disk or a wall that does not exist, but for walls of `fixed` disks."""
    contacts = contacts_at(index, number)
    _check_known(index, number, contacts, snapshot, len(scene.walls), fixed)
    return contacts


def _check_known(
    index: DumpIndex,
    number: int,
    contacts: EngineContacts,
    snapshot: Snapshot,
    walls: int,
    fixed: Any = (),
) -> None:
    wall = contacts.is_wall
    is_body = np.isin(contacts.first, snapshot.ids)
    there = (contacts.second <= walls) | np.isin(contacts.first, fixed)
    is_body &= np.where(wall, there, np.isin(contacts.second, snapshot.ids))
    if not is_body.all():
        row = int(np.argmin(is_body))
        raise DumpError(
            f"{index.path}, {index.frames[number].where(row)}: a contact of "
            f"{contacts.first[row]} and {'wall ' if wall[row] else ''}{contacts.second[row]}, "
            "which the scene has not"
        )


def _resolution(values: Iterable[float], largest: float) -> float:
    """Estimate (m) to what numbers are known: one of the last digit of some of them."""
    words = [repr(abs(one)).split("e")[0].replace(".", "").strip("0") for one in values]
    last = LastDigit(max(map(len, words), default=17), LEAST_PLACE, largest).step(largest or 1.0)
    return min(COARSEST_M, max(FINEST_M, last))


@dataclass(slots=True)
class ListedContacts:
    """Read the contacts of an index frame by frame, and hold each against the disks.

    geometry: whether they are of the instant of the disks; forces of rigid steps are means before it
    fixed_disks: those that do not move, whose contacts become those of walls behind the scene's
    sign: where that is not stated, whether forces are those on the second (1) or on the first (−1)
    factor: N for 1 listed; of forces of all columns, or beside the sign
    wall_fixes: of LAMMPS' wall/gran … contacts, of which the dump of disks has the arrays"""

    index: DumpIndex
    scene: Scene
    geometry: bool = True
    fixed_disks: FixedDisks | None = None
    sign: float = -1.0
    factor: float = 1.0
    wall_fixes: tuple[str, ...] = ()

    @property
    def lacks_walls(self) -> bool:
        """Tell whether these are pairs alone."""
        return "is_wall" not in self.index.columns and not self.wall_fixes

    @property
    def is_whole(self) -> bool:
        """Tell whether normals, overlaps and signs are stated, as no other program writes them."""
        return {*CONTACT_COLUMNS} <= {*self.index.columns}

    @property
    def stated(self) -> float:
        """Give the force of the first on the second (N) for 1 listed."""
        return self.factor if self.is_whole else self.sign * self.factor

    def at(self, ts: Any, snapshot: Snapshot) -> EngineContacts:
        """Read the contacts of a frame of bodies.

        Raises DumpError naming the line of one that is not between these disks, or not so, and of a
        force between bodies that are apart."""
        if self.fixed_disks is None:
            return self._of(ts, snapshot)
        every = self.fixed_disks.behind(snapshot)
        return self._of(ts, every).on_walls(self.fixed_disks.ids, len(self.scene.walls))

    def _of(self, ts: Any, snapshot: Snapshot) -> EngineContacts:
        """The contacts of a frame of all its disks."""
        number = self.index.steps.index(ts.data["step"])
        if self.is_whole:
            fixed = () if self.fixed_disks is None else self.fixed_disks.ids
            found = checked_contacts(self.index, number, snapshot, self.scene, fixed)
            if self.geometry:
                self._check_against_bodies(number, found, snapshot, ts.data)
            return replace(found, force=self.factor * found.force)
        found = self.pairs(number, snapshot)
        self._check_against_bodies(number, found, snapshot, ts.data)
        found = found.select((found.overlap > 0) | found.force.any(1))
        if self.wall_fixes:
            found = EngineContacts.joined([found, self.of_fixes(ts.data, snapshot)])
        turned = ~found.is_wall & (found.first > found.second)
        way = np.where(turned, -1.0, 1.0)[:, None]
        low, high = np.where(turned, (found.second, found.first), (found.first, found.second))
        normal, force = way * found.normal, way * found.force
        return replace(found, first=low, second=high, normal=normal, force=force)

    def of_fixes(self, data: Any, snapshot: Snapshot) -> EngineContacts:
        """Take the forces on walls of LAMMPS' arrays: of each fix a flag, the force on the disk, the point of
        contact. One fix has one row for a disk, even in a corner."""
        walls, parts = self.scene.wall_segments(), []
        for number, fix in enumerate(self.wall_fixes, 1):
            flag, fx, fy, x, y = (data[f"{fix}[{k}]"] for k in (1, 2, 3, 5, 6))
            on, point = flag > 0, np.column_stack([x, y])
            away = [np.hypot(*(walls.nearest_point(point, np.full(len(x), w)) - point).T) for w in range(len(walls))]
            second = np.argmin(away, axis=0) + 1 if away else np.full(len(x), number)
            way, radius = point - snapshot.position[: len(x)], snapshot.radius[: len(x)]
            far = np.hypot(*way.T)
            every = EngineContacts(first=snapshot.ids[: len(x)], second=second, is_wall=far >= 0, overlap=radius - far,
                                   normal=way / np.maximum(far, 1e-300)[:, None], force=-np.column_stack([fx, fy]))  # fmt: skip
            parts.append(every.select(on))
        return EngineContacts.joined(parts)

    def pairs(self, number: int, snapshot: Snapshot, strict: bool = True) -> EngineContacts:
        """Read a frame as it is listed, normals and overlaps from the disks, walls without a number the
        nearest. `strict`: refuse contacts that are listed twice, and those of no wall."""
        index, here = self.index, range(number, number + 1)
        get = dict(zip(index.columns, index.table(number).T, strict=True))
        wall, walls = get.get("is_wall", 0 * get["fx"]) == 1, self.scene.wall_segments()
        open_ = wall & ~((get["second"] >= 1) & (get["second"] <= len(walls)))
        first = index.ids(here, get["first"], "first")
        second = index.ids(here, np.where(open_, 1, get["second"]), "second")
        force = np.column_stack([get["fx"], get["fy"]])
        force += np.column_stack([get.get(name, 0.0 * force[:, 0]) for name in ("tx", "ty")])
        open_ &= np.isin(first, snapshot.ids)
        if strict and len(walls) > 1 and open_.any():
            second[open_] = self._nearest(first[open_], force[open_], snapshot)
        keys = keys_of(np.minimum(first, second), np.maximum(first, second), wall)
        keys = np.where(wall, keys_of(first, second, wall), keys)
        again = np.full(len(keys), strict)
        again[np.unique(keys, return_index=True)[1]] = False
        index.refuse(here, ~np.isfinite(force).all(1), "fx, fy: not a finite number")
        index.refuse(here, ~wall & (first == second), "second: a disk with itself")
        index.refuse(here, again, "this contact is listed twice")
        found = EngineContacts(first=first, second=second, is_wall=wall, normal=force,
                               overlap=get.get("dist", force[:, 0]), force=self.sign * self.factor * force)  # fmt: skip
        _check_known(index, number, found, snapshot, len(walls) if strict else 1 << 40)
        if not strict:
            return replace(found, normal=np.full_like(force, np.nan))
        to, gap = self._geometry(found, snapshot)
        length = np.hypot(*to.T)
        if "dist" in get:
            slack = 1e-5 * length + 3 * COARSEST_M
            bad = ~(np.abs(get["dist"] - length) <= slack)
            index.refuse(here, bad, "dist: ", get["dist"], " m is not the distance of the bodies")
        return replace(found, normal=to / np.maximum(length, 1e-300)[:, None], overlap=-gap)

    def _nearest(self, first: Indices, force: Floats, snapshot: Snapshot) -> Indices:
        """Number the walls (k,) that disks touch, of several that across which the force (k,2) is."""
        walls, order = self.scene.wall_segments(), np.argsort(snapshot.ids)
        who = order[np.searchsorted(snapshot.ids, first, sorter=order)]
        position = walls.within(snapshot.position)[who]
        to = np.stack([walls.nearest_point(position, np.full(len(who), w)) - position for w in range(len(walls))])
        far = np.hypot(*np.moveaxis(to, -1, 0))
        across = np.abs((to * force).sum(axis=2)) / np.maximum(far, 1e-300)
        across[far > far.min(axis=0) + 0.1 * snapshot.radius[who]] = -1.0
        return np.asarray(across.argmax(axis=0) + 1)

    def _geometry(self, contacts: EngineContacts, snapshot: Snapshot) -> tuple[Floats, Floats]:
        """The ways (k,2) m from the first centre to the second, or to the wall, and the gaps (k,) m."""
        wall, walls = contacts.is_wall, self.scene.wall_segments()
        position = walls.within(snapshot.position)
        order, both = np.argsort(snapshot.ids), np.stack([contacts.first, contacts.second])
        both[1, wall] = contacts.first[wall]
        first, second = order[np.searchsorted(snapshot.ids, both, sorter=order)]
        to = walls.shortest(position[second] - position[first])
        fixed = wall & ~self._beside(contacts)
        to[fixed] = walls.nearest_point(position[first[fixed]], contacts.second[fixed] - 1) - position[first[fixed]]  # fmt: skip
        other = np.where(wall, 0.0, snapshot.radius[second])
        return to, np.hypot(*to.T) - snapshot.radius[first] - other

    def _beside(self, contacts: EngineContacts) -> Mask:
        """Tell (k,) which contacts are of a disk that does not move with a wall, which count nothing."""
        fixed = () if self.fixed_disks is None else self.fixed_disks.ids
        return contacts.is_wall & np.isin(contacts.first, fixed)

    def _check_against_bodies(self, number: int, found: EngineContacts, snapshot: Snapshot, data: Any) -> None:
        index, here = self.index, range(number, number + 1)
        to, gap = self._geometry(found, snapshot)
        names = [one for position, _ in PLACES[1:] for one in position[:2] if one in data] or ["x", "y"]
        some = np.concatenate([data[name][:100] for name in names]).tolist()
        slack = 3 * _resolution(some, float(np.abs(snapshot.position).max(initial=1e-3)))
        length = np.maximum(np.hypot(*to.T), 1e-300)
        off = np.abs(found.normal - to / length[:, None]).max(1, initial=0.0)
        counts = ~self._beside(found)
        what = "nx, ny: not the direction of the bodies from the first to the second"
        index.refuse(here, counts & (off > DIRECTION + slack / length), what)
        reach = self.scene.contact.arms.reach if self.scene.contact.arms else 0.0
        separated = counts & (gap > slack + reach) & found.force.any(1)
        index.refuse(here, separated, "a force between bodies that are ", gap, " m apart")
        own = np.abs(found.overlap)
        slack += _resolution(own[:100].tolist(), float(own.max(initial=0.0)))
        unlike = counts & (np.abs(found.overlap + gap) > slack)
        index.refuse(here, unlike, "overlap: that of the bodies is ", -gap, " m")

    def check_signs(self, trajectory: Any, file: Path, stated: bool = False) -> None:
        """Find on which of a pair its force is, as contacts push, where it is not `stated`. Raises DumpError
        where some push and others pull."""
        steps = trajectory.steps
        chosen = {steps[k] for k in np.linspace(0, len(steps) - 1, LOOKED_AT).astype(int)}
        sums, pulls = np.zeros((2, 2)), ["", ""]
        for step in sorted(chosen):
            ts = trajectory[steps.index(step)]
            found = self.at(ts, snapshot_of(ts, file, needs_velocity=False))
            along = (found.force * found.normal).sum(1)
            for wall, kind in enumerate(("", "wall ")):
                mine = np.flatnonzero(found.is_wall == wall)
                pull = mine[along[mine] < 0]
                sums[wall] += along[mine].clip(0).sum(), -along[pull].sum()
                if len(pull) and not pulls[wall]:
                    row = int(pull[0])
                    pulls[wall] = f"step {step}: {found.first[row]} and {kind}{found.second[row]}"
        if self.lacks_walls:
            note(self.index.path, "no forces of walls: loads lack them")
        open_ = slice(0, 1 if self.lacks_walls or self.wall_fixes else 2)
        if not (self.is_whole or stated) and sums[open_, 1].sum() > sums[open_, 0].sum():
            self.sign, sums[open_] = 1.0, sums[open_, ::-1].copy()
            note(self.index.path, "fx fy read as the force on the second")
        for wall, (push, pull) in enumerate(sums.tolist()):
            if pull > PULLING * (push + pull):
                why = "fx fy is the force of the first on the second. Is it that on the first here (--contacts-factor -1)?"
                if self.lacks_walls:
                    why = "Others push. Is fx fy the force on the first of each row?"
                raise DumpError(
                    f"{self.index.path}, {pulls[wall]} pull each other, and no law here pulls. {why}"
                )
            if pull > LITTLE * (push + pull):
                note(self.index.path, f"{pulls[wall]} pull each other. Is their force turned?")
