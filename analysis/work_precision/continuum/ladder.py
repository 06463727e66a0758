"""Both continuum models over a ladder of meshes, and on two finer ones that say how wrong those
are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.support.cache import keep, kept
from analysis.work_precision.continuum.solves import (
    ContinuumAnswer,
    ContinuumModel,
    solve_both,
    solve_continuum,
)
from analysis.work_precision.point import PointStatus
from analysis.work_precision.points_of import Answer, Converged
from analysis.work_precision.window import Window

# Sides of the triangles, in mean radii of the disks.
SIDES = (4.0, 2.0, 1.0)
COARSE = (4.0, 2.0)
# The reference has sides of the smallest times these: its change from the first to the second is
# its error bar.
FINER = (0.5, 0.25)
# Counts up whenever the reference comes to have other numbers.
EDITION = 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContinuumLadder:
    """The answers of both models on each mesh; of each model its reference, on meshes twice and
    four times as fine as the finest of them; reason: why there is none of all this, in words."""

    answers: tuple[ContinuumAnswer, ...] = ()
    references: tuple[tuple[ContinuumAnswer, ContinuumAnswer], ...] = ()
    reason: str = ""

    def judged(self, window: Window) -> Iterator[tuple[Answer, Converged]]:
        """Yield each answer with its model, converged."""
        models = {}
        for coarse, fine in self.references:
            sure = coarse.status == fine.status == PointStatus.OK
            models[coarse.model] = Converged(
                own=fine.values(window) if sure else None,
                looser=coarse.values(window) if sure else None,
                why=f"the reference is {fine.status}: {fine.reason or coarse.reason}",
                wrong="the mesh is too coarse: wrong",
            )
        for answer in self.answers:
            yield answer.answer(window), models[answer.model]


def continuum_ladder(window: Window, sides: Sequence[float], path: Path) -> ContinuumLadder:
    """Solve on meshes of these sides (in mean radii), finest last; the references, which take long,
    are kept in `path`_*.npz."""
    if not sides:
        return ContinuumLadder(reason="it was not asked for")
    radius = float(window.scene.snapshot.radius.mean())
    try:
        answers = [
            solve_continuum(window, model, side * radius)
            for model in ContinuumModel
            for side in sides
        ]
        coarse, fine = (_kept(window, share * sides[-1] * radius, path) for share in FINER)
    except ValueError as error:
        return ContinuumLadder(reason=str(error))
    return ContinuumLadder(answers=tuple(answers), references=tuple(zip(coarse, fine, strict=True)))


def _kept(window: Window, side_m: float, path: Path) -> tuple[ContinuumAnswer, ...]:
    """Both models from the file, or made and, if both are `ok`, kept there."""
    file = path.with_name(f"{path.name}_{side_m:.6g}m.npz")
    key = f"{window.scene.digest()} {EDITION}"
    if found := kept(file, key):
        return tuple(
            ContinuumAnswer(
                model=model,
                side_m=side_m,
                change=found[f"{model}_change"],
                wall_impulse=found[f"{model}_wall_impulse"],
                cpu_seconds=None,
                status=PointStatus.OK,
                reason="",
            )
            for model in ContinuumModel
        )
    made = solve_both(window, side_m)
    if all(answer.status == PointStatus.OK for answer in made):
        arrays = {
            f"{answer.model}_{name}": getattr(answer, name)
            for answer in made
            for name in ("change", "wall_impulse")
        }
        keep(file, key, arrays)
    return made
