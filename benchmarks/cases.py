"""A benchmark case as a file, so that every solver gets the same bits in a process of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from families import Case

from nscd import Contacts, Snapshot, Walls


def write_case(path: Path, case: Case) -> None:
    """Write a case as .npz."""
    contacts = case.contacts
    np.savez(
        path,
        name=case.name,
        position=case.snapshot.position,
        velocity=case.snapshot.velocity,
        radius=case.snapshot.radius,
        mass=case.snapshot.mass,
        start=case.walls.start,
        end=case.walls.end,
        first=contacts.first,
        second=contacts.second,
        is_wall=contacts.is_wall,
        normal=contacts.normal,
        gap=contacts.gap,
        point=contacts.point,
        left_velocity=case.left_velocity,
    )


def read_case(path: Path) -> Case:
    """Read what `write_case` wrote."""
    with np.load(path) as file:
        a = {name: file[name] for name in file.files}
    return Case(
        name=str(a["name"]),
        snapshot=Snapshot(
            position=a["position"], velocity=a["velocity"], radius=a["radius"], mass=a["mass"]
        ),
        walls=Walls(start=a["start"], end=a["end"]),
        contacts=Contacts(
            first=a["first"],
            second=a["second"],
            is_wall=a["is_wall"],
            normal=a["normal"],
            gap=a["gap"],
            point=a["point"],
        ),
        left_velocity=a["left_velocity"],
    )
