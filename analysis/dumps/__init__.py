"""What the engines write, one reader for all: bodies, contacts, impulses."""

from analysis.dumps.bodies import Bodies
from analysis.dumps.contacts import (
    CONTACT_COLUMNS,
    EngineContacts,
    contacts_at,
    index_contacts,
    read_contacts,
)
from analysis.dumps.find_frames import DumpError, NoContactError
from analysis.dumps.index import DumpIndex, index_dump
from analysis.dumps.open_dump import open_bodies, snapshot_of

__all__ = [
    "CONTACT_COLUMNS", "Bodies", "DumpError", "DumpIndex", "EngineContacts", "NoContactError",
    "contacts_at", "index_contacts", "index_dump", "open_bodies", "read_contacts",
    "snapshot_of",
]  # fmt: skip
