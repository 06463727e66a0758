"""The bridge: what do the percussions of ever more disks in the same room converge to?"""

from collections.abc import Sequence

import numpy as np

from analysis.pages.numbers import NONE, decimals
from analysis.pages.section import Cell, Section
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.continuum.bridge.charts import pressure_maps, profiles, trends
from analysis.paper.continuum.bridge.crowd import KERNEL, NEAR, SOFTNESS, WITHIN
from analysis.paper.continuum.bridge.models import Model
from analysis.paper.continuum.bridge.study import PLAN, Plan, Size, study
from analysis.support.progress import Progress
from nscd.arrays import Floats


def build(progress: Progress | None = None, plan: Plan = PLAN) -> Section:
    """Build the study: crowds of every packing and size, and the continuum models."""
    sizes = study(plan, progress)
    last = sizes[-1]
    words = Words(
        __package__,
        **{"sizes": sizes, "models": last.models, "kernel": KERNEL, "both": both},
        **{"near": NEAR, "softness": SOFTNESS, "within": WITHIN},
        counts=[size.n for size in sizes],
        crowds=sum(len(size.samples) for size in sizes),
        ends=[_ends(sizes, packing) for packing in dict.fromkeys(size.packing for size in sizes)],
    )
    models = {id(size.models): size.models for size in sizes}.values()
    return words.section(
        "bridge",
        pictures=[
            words.picture("bridge_trends", trends(sizes)),
            words.picture("bridge_profiles", profiles(sizes)),
            words.picture("bridge_maps", pressure_maps(sizes)),
        ],
        tables=[
            words.table("fields", [*map(_crowds, sizes), *map(_model, last.shown)]),
            words.table("distances", [_distances(size) for size in sizes]),
        ],
        warnings=[warning for size in sizes for warning in size.warnings]
        + sorted({warning for every in models for warning in unsolved(every.answers)}),
    )


def both(values: Floats, places: int = 2) -> str:
    """Write mean ± standard error; the value alone of a single crowd."""
    mean = decimals(float(values.mean()), places)
    if len(values) < 2:
        return mean
    return f"{mean} ± {decimals(float(values.std(ddof=1) / np.sqrt(len(values))), places)}"


def _ends(sizes: Sequence[Size], packing: str) -> tuple[Size, Size]:
    """The smallest and the largest of a packing."""
    same = sorted((size for size in sizes if size.packing == packing), key=lambda size: size.n)
    return same[0], same[-1]


def _crowds(size: Size) -> list[Cell]:
    return [
        str(size.packing),
        size.n,
        len(size.samples),
        size.coordination,
        both(size.kept, 3),
        both(size.wall_load, 1),
        NONE if size.spread is None else size.spread,
        both(size.deviator, 3),
        both(size.dissipative, 3),
        both(size.compression, 3),
        "not all solved" if size.warnings else "solved",
    ]


def _model(model: Model) -> list[Cell]:
    shares = [decimals(model.kept, 3), decimals(model.wall_load / 1e3, 1)]
    solved = model.answer is None or model.answer.status == "solved"
    status = "solved" if solved else "not solved"
    return [model.name, NONE, NONE, NONE, *shares, *[NONE] * 4, status]


def _distances(size: Size) -> list[Cell]:
    m = size.models
    pressing = [m.first_order, size.rough, m.blocked, m.table, size.best]
    moving = [m.first_order, size.rough, m.blocked, m.unhindered, m.table, size.best]
    return [
        str(size.packing),
        size.n,
        *(both(size.pressure_distance(model)) for model in pressing),
        size.rough.friction or 0.0,
        size.best.volume or 0.0,
        *(both(size.velocity_distance(model)) for model in moving),
    ]
