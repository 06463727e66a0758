"""The contacts of two models on one snapshot, paired by ids."""

from dataclasses import dataclass

import numpy as np

from analysis.dumps import EngineContacts
from analysis.percussions.snapshot import SnapshotPercussions
from nscd import Contacts
from nscd.arrays import Flags, Floats, Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Match:
    """Pair the contacts of the penalty and of the rigid model: the k that either of them has.

    contacts: k, disks by their places in the snapshot; normal and gap (m) are the rigid model's
        where it has the contact, else the engine's
    ids: (k,2), of the first disk, and of the second or the number of the wall from 1; rising
    penalty, rigid: (k,2) N or N·s, what the first body gives to the second; 0 where the model has
        not the contact
    in_penalty, in_rigid: (k,) which model has it
    determined: (k,) whether the balance of the disks, and that nothing pulls, fix its rigid force
    """

    contacts: Contacts
    ids: Indices
    penalty: Floats
    rigid: Floats
    in_penalty: Flags
    in_rigid: Flags
    determined: Flags

    @property
    def is_wall(self) -> Flags:
        """(k,): whether the second body is a wall."""
        return self.contacts.is_wall

    @property
    def keys(self) -> Indices:
        """(k,): one integer per contact, rising; the same in every run of a scene."""
        return _keys(self.ids[:, 0], self.ids[:, 1], self.is_wall)

    def normal_parts(self) -> tuple[Floats, Floats]:
        """Give the normal components of penalty and rigid, each (k,), positive where they push."""
        normal = self.contacts.normal
        return (self.penalty * normal).sum(1), (self.rigid * normal).sum(1)


def match_contacts(found: SnapshotPercussions, engine: EngineContacts, determined: Flags) -> Match:
    """Match the rigid contacts of a snapshot, and their forces (impulses of an impact), with an
    engine's.

    determined: (k',), of the rigid contacts"""
    contacts, snapshot = found.contacts, found.snapshot
    rigid_keys = keys_of(found)
    engine_keys = _keys(engine.first, engine.second, engine.is_wall)
    keys = np.union1d(rigid_keys, engine_keys)
    at_rigid, at_engine = np.searchsorted(keys, rigid_keys), np.searchsorted(keys, engine_keys)
    k = len(keys)
    in_penalty, in_rigid, fixed = (np.zeros(k, dtype=bool) for _ in range(3))
    in_penalty[at_engine] = in_rigid[at_rigid] = True
    fixed[at_rigid] = determined
    normal, gap, penalty, rigid = np.zeros((k, 2)), np.zeros(k), np.zeros((k, 2)), np.zeros((k, 2))
    normal[at_engine], gap[at_engine] = engine.normal, -engine.overlap
    normal[at_rigid], gap[at_rigid] = contacts.normal, contacts.gap
    penalty[at_engine], rigid[at_rigid] = engine.force, found.pressing
    is_wall = (keys & 1).astype(bool)
    ids = np.column_stack([keys >> 32, (keys >> 1) & 0x7FFFFFFF])
    first = np.searchsorted(snapshot.ids, ids[:, 0])
    other = np.searchsorted(snapshot.ids, np.where(is_wall, snapshot.ids[0], ids[:, 1]))
    both = Contacts(
        first=first,
        second=np.where(is_wall, ids[:, 1] - 1, other),
        is_wall=is_wall,
        normal=normal,
        gap=gap,
        point=snapshot.position[first] + snapshot.radius[first, None] * normal,
    )
    return Match(
        contacts=both,
        ids=ids,
        penalty=penalty,
        rigid=rigid,
        in_penalty=in_penalty,
        in_rigid=in_rigid,
        determined=fixed,
    )


def keys_of(found: SnapshotPercussions) -> Indices:
    """Give the key of each rigid contact of a snapshot, (k,), as in `Match.keys`."""
    contacts, ids = found.contacts, found.snapshot.ids
    wall = contacts.is_wall
    second = np.where(wall, contacts.second + 1, ids[np.where(wall, 0, contacts.second)])
    return _keys(ids[contacts.first], second, wall)


def _keys(first: Indices, second: Indices, is_wall: Flags) -> Indices:
    """first · 2³² + second · 2 + is_wall: sorts by first, then second."""
    keys: Indices = (first << 32) | (second << 1) | is_wall
    return keys
