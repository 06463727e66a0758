"""Crowds that have a name: what people before a door do, as far as films and laboratories show it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.scene.distance import Distance
from analysis.scene.drive import Drive
from analysis.scene.scene import Scene
from nscd.segments import lengths

# People per metre and second through doors: Seyfried et al. 2009, Kretz et al. 2006, and CrowdQueue
# (Adrian, Seyfried, Sieben 2020), of which a film is behind τ, T and the jostling below.
MEASURED_FLOW = 1.2, 1.9
# m/s (Weidmann 1993), s, s.
WALK = {"speed_m_per_s": 1.34, "relaxation_time_s": 0.3, "time_gap_s": 0.6}
# N, of those who push for ever, in a scene whose people keep their distance.
PUSH_N = 150.0


@dataclass(frozen=True, slots=True)
class NamedCrowd:
    """Hold what people do, in words, the keys of their drive (of those who push for ever: none), and
    the shares of push that a report takes in turn."""

    label: str
    does: str
    drive: Mapping[str, float]
    fractions: tuple[float, ...]


CROWDS = {
    "waiting": NamedCrowd(
        "waiting", "people keep a distance and nobody pushes, as in a film (CrowdQueue)",
        WALK | {"jostling_m_per_s": 0.06}, (0.0,),
    ),
    "pressing": NamedCrowd(
        "pressing", "people keep a distance, jostle more and push with 10–40 % (assumed)",
        WALK | {"jostling_m_per_s": 0.1}, (0.1, 0.4),
    ),
    "pushing": NamedCrowd(
        "everybody pushes for ever", "the paper's drive, whoever is ahead", {}, (1.0,)
    ),
}  # fmt: skip


def keys_of(name: str, fraction: float | None = None) -> dict[str, float]:
    """Give the keys of a named crowd's drive, with a share of push or the first of its own."""
    crowd = CROWDS[name]
    own = crowd.fractions[0] if fraction is None else fraction
    return {**crowd.drive, "push_share": own} if crowd.drive else {}


# Recommended ranges (s; share), and sources.
TIME_GAPS_S, PUSH_SHARES = (0.6, 1.0), (0.0, 0.4)
RECOMMENDED = (
    "recommended: drive.time_gap_s 0.6 s as in films, 0.8 s for the standards' 1.33 people per m and "
    "s (0.6 to 1.0 s, Weidmann 1993). drive.push_share 0.1, what if 0, 0.1, 0.2, 0.4 (CrowdQueue)"
)


def distance_lines(drive: Drive) -> Iterator[str]:
    """Say how hard people push, and which range is recommended."""
    gap, fraction = drive.time_gap_s, drive.push_share
    if gap is None:
        yield "push: everybody pushes for ever, as no measured crowd does"
    else:
        inside = TIME_GAPS_S[0] <= gap <= TIME_GAPS_S[1] and fraction <= PUSH_SHARES[1]
        outside = "" if inside else ": outside what is recommended"
        yield f"push: time gap {gap:g} s, share {fraction:g} of the push{outside}"
    yield f"  {RECOMMENDED}"


def crowd_label(name: str, fraction: float) -> str:
    """Name a crowd in a page, with its share of push where others of that name have another."""
    crowd = CROWDS[name]
    return f"{crowd.label}, p = {fraction:g}" if len(crowd.fractions) > 1 else crowd.label


def with_crowd(scene: Scene, name: str, fraction: float | None = None) -> Scene:
    """Return a driven scene with the people of a named crowd; who pushes for ever does so with the
    scene's own drive, or with 150 N where its people keep their distance."""
    assert scene.drive is not None
    none = {key: one.default for key, one in Distance.model_fields.items() if key != "seed"}
    keys: dict[str, Any] = none | keys_of(name, fraction)
    if name == "pushing" and scene.drive.keeps_distance:
        longer = scene.drive.relaxation_time_s * scene.mean_push / PUSH_N
        keys |= {"relaxation_time_s": longer, "seed": 1}
    return scene.with_drive(**keys)


def crowds_beside(scene: Scene) -> Iterator[tuple[str, float, bool]]:
    """Yield each named crowd with each of its shares of push, and whether it is that of the scene."""
    assert scene.drive is not None
    for name, crowd in CROWDS.items():
        for fraction in crowd.fractions:
            same = with_crowd(scene, name, fraction).drive
            yield name, fraction, same is not None and same.model_dump() == scene.drive.model_dump()


def door_width(scene: Scene) -> float:
    """Sum the widths (m) of the different doors of a driven scene."""
    doors = set(scene.drive.gates) if scene.drive else ()
    return float(sum(lengths(np.subtract(*door)) for door in doors))
