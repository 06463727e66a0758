"""What a model of the scene does without, because the scene has no need of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from analysis.pages.numbers import significant
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from analysis.work_precision.soft_runs import soft_engines
from analysis.work_precision.window import Window
from analysis.work_precision.window_start import prepare_window
from nscd.contacts import find_islands
from nscd.percussions import Status

# An impulse below this share of the largest is none.
NOTHING = 1e-9


def left_out(scene: Scene, folder: Path) -> list[str]:
    """List what is left out, a line each: friction, spin, the restitution of a pressed crowd,
    islands that nothing presses, disks that carry nothing.

    A crowd that is still to be pressed together is pressed first, by an engine, and kept in the
    folder; without an engine a line says that its contacts are not known. The scene is one without
    friction (`likeness_of` refuses others)."""
    n = len(scene.snapshot)
    lines = [
        "friction cone: μ = 0, one unknown per contact instead of two",
        f"spin: no tangential forces, {2 * n} unknown velocities instead of {3 * n}",
    ]
    if scene.drive is not None and scene.contact.restitution:
        lines.append(
            f"restitution e = {significant(scene.contact.restitution)}: "
            "forces of a crowd that is pressed and rests do not depend on it"
        )
    elif scene.contact.restitution == 1:
        return [
            *lines,
            "islands, disks that carry nothing: not known, the rigid model has no e = 1",
        ]
    to_press = scene.drive is not None and scene.reconciliation is None
    if to_press and not soft_engines():
        return [
            *lines,
            "islands, disks that carry nothing: not known, no engine is there to press the crowd "
            "together",
        ]
    folder.mkdir(parents=True, exist_ok=True)
    window = prepare_window(scene, folder)
    if gone := n - len(window.scene.snapshot):
        lines.append(f"people who have passed the door: {gone} of {n}")
    return [*lines, *_islands(window), *_idle(window)]


def _islands(window: Window) -> Iterator[str]:
    snapshot, contacts = window.scene.snapshot, window.contacts
    islands = find_islands(snapshot, contacts, window.left_velocity)
    idle = (islands.contacts > 0) & ~islands.pressed
    if alone := int((islands.contacts == 0).sum()):
        yield f"disks that touch nothing: {alone} of {len(snapshot)}"
    if idle.any():
        disks = int(islands.disks[idle].sum())
        yield f"islands that nothing presses: {int(idle.sum())} with {disks} disks"


def _idle(window: Window) -> Iterator[str]:
    snapshot, contacts = window.scene.snapshot, window.contacts
    answer = percussions_of(window.setting, snapshot, window.law, canonical=False).answer
    if answer.status != Status.SOLVED:
        why = f"the solution is {answer.status}: {answer.reason}"
        yield f"disks that carry nothing: not known, {why}"
        return
    impulse = np.hypot(*answer.impulse.T)
    loaded, pairs = impulse > NOTHING * impulse.max(initial=0.0), ~contacts.is_wall
    carries, touching = np.zeros(len(snapshot), dtype=bool), np.zeros(len(snapshot), dtype=bool)
    for disks, chosen in ((carries, loaded), (touching, np.ones_like(loaded))):
        disks[contacts.first[chosen]] = True
        disks[contacts.second[chosen & pairs]] = True
    if idle := int((touching & ~carries).sum()):
        yield f"disks that touch others and carry nothing: {idle} of {len(snapshot)}"
    if unloaded := int((~loaded).sum()):
        yield f"contacts that carry nothing: {unloaded} of {len(contacts)}"
