"""Both continuum models over a ladder of meshes, and on two finer ones that say how wrong those
are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.support.cache import keep, kept
from analysis.work_precision.continuum.solves import (
    COMPARED,
    ContinuumModel,
    answer_of,
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
EDITION = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContinuumLadder:
    """The continuum on a window.

    answers: of both models on each mesh.
    references: of each model, on meshes twice and four times as fine as the finest of them.
    reason: why there is none of all this, in words."""

    answers: tuple[Answer, ...] = ()
    references: tuple[tuple[Answer, Answer], ...] = ()
    reason: str = ""

    def judged(self) -> Iterator[tuple[Answer, Converged]]:
        """Yield each answer with its model, converged."""
        models = {}
        for coarse, fine in self.references:
            sure = coarse.status == fine.status == PointStatus.OK
            models[coarse.law] = Converged(
                own=fine.values if sure else None,
                looser=coarse.values if sure else None,
                why=f"the reference is {fine.status}: {fine.reason or coarse.reason}",
                wrong="the mesh is too coarse: wrong",
            )
        for answer in self.answers:
            yield answer, models[answer.law]


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


def _kept(window: Window, side_m: float, path: Path) -> tuple[Answer, ...]:
    """Both models from the file, or made and, if both are `ok`, kept there."""
    file = path.with_name(f"{path.name}_{side_m:.6g}m.npz")
    key = f"{window.scene.digest()} {EDITION}"
    if found := kept(file, key):
        values = {m: {q: found[f"{m}_{q.name}"] for q in COMPARED} for m in ContinuumModel}
        return tuple(answer_of(model, side_m, values[model]) for model in ContinuumModel)
    made = solve_both(window, side_m)
    if all(answer.status == PointStatus.OK for answer in made):
        arrays = {f"{a.law}_{q.name}": v for a in made for q, v in (a.values or {}).items()}
        keep(file, key, arrays)
    return made
