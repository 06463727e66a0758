"""Non-smooth contact dynamics of disks: contacts of a snapshot and the percussions at them. SI
units."""

from nscd.bodies import Snapshot, Walls
from nscd.contacts import Contacts, find_contacts
from nscd.laws import ContactLaw
from nscd.percussions import ContactState, Percussions, Status
from nscd.solve import solve

__all__ = [
    "ContactLaw", "ContactState", "Contacts", "Percussions", "Snapshot", "Status", "Walls",
    "find_contacts", "solve",
]  # fmt: skip
