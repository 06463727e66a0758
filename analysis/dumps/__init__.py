"""What the engines write, one reader for all: bodies, contacts, impulses."""

from analysis.dumps.reader import (
    BodiesReader,
    DumpError,
    EngineContacts,
    contacts_at,
    frame_at,
    index_contacts,
    index_dump,
    open_bodies,
    read_contacts,
    snapshot_of,
)

__all__ = [
    "BodiesReader",
    "DumpError",
    "EngineContacts",
    "contacts_at",
    "frame_at",
    "index_contacts",
    "index_dump",
    "open_bodies",
    "read_contacts",
    "snapshot_of",
]
