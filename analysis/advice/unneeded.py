"""What a model of the scene can do without, because the scene has no need of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.engines import ENGINES
from analysis.scene.scene import Scene
from analysis.work_precision.window_start import prepare_window
from nscd import ContactLaw, solve
from nscd.percussions import Status
from nscd.problem import impact_problem
from nscd.solvers.islands import find_islands

# A reaction below this share of the largest is none.
NOTHING = 1e-9


def left_out(scene: Scene, folder: Path) -> list[str]:
    """What is left out, a line each: friction, spin, islands that nothing presses, disks that carry
    nothing.

    A crowd that is still to be pressed together is pressed first, by an engine, and kept in the
    folder; without an engine a line says that its contacts are not known. The scene is one without
    friction (`likeness_of` refuses others)."""
    n = len(scene.snapshot)
    lines = [
        "friction cone: μ = 0, one unknown a contact instead of two",
        f"spin: no tangential forces, {2 * n} unknown velocities instead of {3 * n}",
    ]
    to_press = scene.drive is not None and scene.reconciliation is None
    if to_press and not any(engine.find() for engine in ENGINES):
        return [
            *lines,
            "islands, disks that carry nothing: not known, no engine is there to press the crowd together",
        ]
    folder.mkdir(parents=True, exist_ok=True)
    window = prepare_window(scene, folder)
    snapshot, contacts, left = window.scene.snapshot, window.contacts, window.left_velocity
    if gone := n - len(snapshot):
        lines.append(f"people who have passed the door: {gone} of {n}")
    n = len(snapshot)
    islands = find_islands(impact_problem(snapshot, contacts, left, ContactLaw()))
    alone = int((islands.contacts == 0).sum())
    idle = (islands.contacts > 0) & ~islands.pressed
    if alone:
        lines.append(f"disks that touch nothing: {alone} of {n}")
    if idle.any():
        lines.append(
            f"islands that nothing presses: {int(idle.sum())} with {int(islands.disks[idle].sum())} disks"
        )
    answer = solve(snapshot, contacts, left_velocity=left, canonical=False)
    if answer.status != Status.SOLVED:
        return [
            *lines,
            f"disks that carry nothing: not known, the solution is {answer.status}: {answer.reason}",
        ]
    loaded = answer.reaction > NOTHING * answer.reaction.max(initial=0.0)
    carries = np.zeros(n, dtype=bool)
    carries[contacts.first[loaded]] = True
    pairs = loaded & ~contacts.is_wall
    carries[contacts.second[pairs]] = True
    touching = np.zeros(n, dtype=bool)
    touching[contacts.first] = True
    touching[contacts.second[~contacts.is_wall]] = True
    if idle_disks := int((touching & ~carries).sum()):
        lines.append(f"disks that touch others and carry nothing: {idle_disks} of {n}")
    if open_contacts := int((~loaded).sum()):
        lines.append(f"contacts that carry nothing: {open_contacts} of {len(contacts)}")
    return lines
