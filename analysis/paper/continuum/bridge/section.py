"""The bridge from contacts to stress: what do the percussions of ever more disks in the same room
converge to?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.pages.section import Cell, Picture, Section, Table
from analysis.paper.continuum.bridge.charts import pressure_maps, profiles, trends
from analysis.paper.continuum.bridge.crowd import (
    KERNEL,
    NEAR,
    SOFTNESS,
    WITHIN,
    Packing,
    Sample,
    sample,
)
from analysis.paper.continuum.bridge.models import Crowd, Model
from analysis.paper.continuum.bridge.study import Models, Size
from analysis.support.progress import Progress
from nscd.arrays import Floats

Plan = Mapping[Packing, Mapping[int, int]]
"""How many crowds (seeds 1, 2, …) of each packing and N."""

# a large crowd averages over its own disorder, so that few of them say as much as many small ones
PLAN: Plan = {
    Packing.TOUCHING: {600: 8, 2400: 6, 10_000: 4, 40_000: 2},
    Packing.NEAR: {600: 8, 2400: 4, 10_000: 3, 40_000: 1},
    Packing.PRESSED: {600: 8, 2400: 4, 10_000: 3, 40_000: 1},
}


def build(progress: Progress | None = None, plan: Plan = PLAN) -> Section:
    """The study as a section: crowds of every packing and size, their fields against the continuum
    models, and what follows."""
    sizes = study(plan, progress)
    return Section(
        number="bridge",
        title="From contacts to stress: which continuum do the percussions approach?",
        words=_words(sizes),
        pictures=[
            Picture(
                name="bridge_trends",
                caption="Against the number of disks in the same room, with standard errors where there are several crowds: "
                "kinetic energy kept, how far the pressure is from that of (20) and of (20) with the internal friction that fits "
                "best, and the part of the stress that is no pressure. Lines across: continuum models.",
                figure=trends(sizes),
            ),
            Picture(
                name="bridge_profiles",
                caption="Pressure against the distance from the exit, averaged over crowds and over bands of 0.5 m.",
                figure=profiles(sizes),
            ),
            Picture(
                name="bridge_maps",
                caption="Pressure of one crowd of each packing, smallest and largest N, and of continuum models, all under the "
                "same kernel and on one scale of colour. Friction and k_v: fitted to the largest pressed crowd.",
                figure=pressure_maps(sizes),
            ),
        ],
        tables=[_fields_table(sizes), _distance_table(sizes)],
        differs=(),
        warnings=[s.warning for size in sizes for s in size.samples if s.warning]
        + sorted({m.warning for size in sizes for m in size.models.every if m.warning}),
    )


def study(plan: Plan = PLAN, progress: Progress | None = None) -> list[Size]:
    """All crowds of the plan, by packing and N, each packing with the models of a continuum of its
    own mean size R."""
    total = sum(n * count for sizes in plan.values() for n, count in sizes.items())
    done = 0
    crowds: dict[Packing, list[list[Sample]]] = {}
    for packing, sizes in plan.items():
        crowds[packing] = []
        for n, count in sizes.items():
            crowds[packing].append([])
            for seed in range(1, count + 1):
                crowds[packing][-1].append(sample(packing, n, seed))
                done += n
                if progress:
                    progress("crowds", done / total)
    found = []
    models: dict[float, Models] = {}
    for same in crowds.values():
        # to the centimetre: `touching` and `near` are the same heaps
        size = round(float(np.mean([s.size for samples in same for s in samples])), 2)
        if size not in models:
            models[size] = Models.of(Crowd(size))
        found += [Size(samples, models[size]) for samples in same]
    return found


def _words(sizes: Sequence[Size]) -> list[str]:
    largest = [
        _largest(sizes, packing) for packing in dict.fromkeys(size.packing for size in sizes)
    ]
    models = largest[-1].models
    counts = [size.n for size in sizes]
    words = [
        f"{sum(len(size.samples) for size in sizes)} crowds of {min(counts):,} to {max(counts):,} disks, all with the mass of "
        "600 people of 75 kg in the same half-round room before a 1 m exit: as N grows the disks shrink as N^(-1/2). They "
        "want to walk at 2 m/s to the nearest point of the exit; percussions with k = 0. The door is shut while the crowd "
        "packs and open when it walks. `touching`: a heap grown disk by disk, each touching two others, contacts where they "
        f"touch; `near`: the same heap, gaps up to {NEAR:g} of the mean radius count as contacts; `pressed`: soft disks "
        f"(overlaps of the order of {SOFTNESS:g} of a radius) at rest against the shut door.",
        f"Stress, pressure and velocity are coarse-grained with a compact kernel of {KERNEL.width:g} m standard deviation "
        f"(it ends at {KERNEL.reach:.2f} m) and compared within {WITHIN:g} m of the exit; continuum fields pass through "
        "the same kernel. Differences are L² norms over these points, of pressures relative to that of (20), of velocities "
        "relative to u⁻. (20) is its complementarity form. (20) with friction s adds a shear stress of at most √2 s p "
        "(Frobenius norm), that is (17) and (18) with the pressure of the complementarity. k_v and s are fitted to the pressure "
        "alone, so that the velocities are a test.",
        f"The models, for the size of the pressed crowds: (20) keeps {models.first_order.kept:.0%} of the kinetic energy and "
        f"loads the walls with {models.first_order.wall_load / 1e3:.1f} kN·s; if nobody moves, p = ρU(R − d) and the load is "
        f"{models.blocked.wall_load / 1e3:.1f} kN·s; (11) with Table 1 keeps {models.table.kept:.0%}, with a load of "
        f"{models.table.wall_load / 1e3:.1f} kN·s.",
    ]
    return words + [_finding(sizes, size) for size in largest]


def _finding(sizes: Sequence[Size], large: Size) -> str:
    same = [size for size in sizes if size.packing == large.packing]
    small, models = min(same, key=lambda size: size.n), large.models
    fitted = (
        f"; with {large.rough.name.partition(', ')[2]} from {_both(small.pressure_distance(large.rough))} to "
        f"{_both(large.pressure_distance(large.rough))}, and that of the velocity from "
        f"{_both(small.velocity_distance(large.rough))} to {_both(large.velocity_distance(large.rough))}"
        if large.rough is not models.first_order
        else ""
    )
    return (
        f"{str(large.packing).capitalize()}: from {small.n} to {large.n:,} disks the kinetic energy kept goes from "
        f"{small.kept.mean():.1%} to {large.kept.mean():.1%}, and the distance of the pressure from (20) from "
        f"{_both(small.pressure_distance(models.first_order))} to {_both(large.pressure_distance(models.first_order))}{fitted}. "
        f"The part of the stress that is no pressure goes from {small.deviator.mean():.1%} to {large.deviator.mean():.1%}; "
        f"k D(u⁺ + u⁻) explains {large.dissipative.mean():.0%} of the stress of {large.n:,} disks. Of all models the nearest "
        f"to them in pressure and velocity is: {large.nearest.name}."
    )


def _largest(sizes: Sequence[Size], packing: Packing) -> Size:
    return max((size for size in sizes if size.packing == packing), key=lambda size: size.n)


def _both(values: Floats, digits: str = ".2f") -> str:
    """Mean ± standard error; the value alone of a single crowd."""
    mean = f"{values.mean():{digits}}"
    if len(values) < 2:
        return mean
    return f"{mean} ± {values.std(ddof=1) / np.sqrt(len(values)):{digits}}"


def _fields_table(sizes: Sequence[Size]) -> Table:
    rows: list[list[Cell]] = [
        [
            str(size.packing),
            size.n,
            len(size.samples),
            float(np.mean([s.coordination for s in size.samples])),
            _both(size.kept, ".3f"),
            _both(size.wall_load / 1e3, ".1f"),
            "–" if np.isnan(size.spread) else size.spread,
            _both(size.deviator, ".3f"),
            _both(size.dissipative, ".3f"),
            _both(size.compression, ".3f"),
            "solved" if not any(s.warning for s in size.samples) else "not all solved",
        ]
        for size in sizes
    ]
    for model in _models(sizes):
        rows.append([model.name, "–", "–", "–", f"{model.kept:.3f}", f"{model.wall_load / 1e3:.1f}", *["–"] * 4,
                     "not solved" if model.warning else "solved"])  # fmt: skip
    return Table(
        caption="Crowds and models. Spread: distance between crowds of the same kind. Then three shares: the part of Σ that is "
        "no pressure, ‖Σ + p1‖/‖Σ‖; what k D(u⁺ + u⁻) explains of Σ (R² through the origin); the compression that is left, "
        "∫(div u⁺)₋ over ∫(div u⁻)₋. Mean ± standard error. Models: for the size of the pressed crowds.",
        head=["packing", "N", "crowds", "contacts a disk", "kinetic energy kept", "wall load (kN·s)", "spread of p",
              "deviator of Σ", "R² of k D(w)", "compression left", "status"],
        rows=rows,
    )  # fmt: skip


def _models(sizes: Sequence[Size]) -> list[Model]:
    last = sizes[-1]
    return [
        last.models.first_order,
        last.models.blocked,
        last.models.unhindered,
        last.models.table,
        last.best,
        last.rough,
    ]


def _distance_table(sizes: Sequence[Size]) -> Table:
    rows: list[list[Cell]] = []
    for size in sizes:
        m = size.models
        pressed = [m.first_order, size.rough, m.blocked, m.table, size.best]
        moving = [m.first_order, size.rough, m.blocked, m.unhindered, m.table, size.best]
        friction = size.rough.name.partition("friction ")[2] or "0"
        volume = size.best.name.partition("= ")[2].removesuffix(" kg")
        row: list[Cell] = [str(size.packing), size.n]
        row += [_both(size.pressure_distance(model)) for model in pressed]
        row += [friction, volume]
        row += [_both(size.velocity_distance(model)) for model in moving]
        rows.append(row)
    return Table(
        caption="How far the disks' coarse-grained pressure p and right velocity u⁺ are from each continuum model: L² difference "
        "over the norm of the pressure of (20), and over that of u⁻. Mean ± standard error over crowds. s and k_v: the best "
        "for the pressure among the values tried (s = 0 is (20)).",
        head=["packing", "N", "p: (20)", "p: (20), friction s", "p: nobody moves", "p: (11), Table 1", "p: (11), k_v", "s",
              "k_v (kg)", "u⁺: (20)", "u⁺: (20), friction s", "u⁺: nobody moves", "u⁺: u⁻", "u⁺: (11), Table 1",
              "u⁺: (11), k_v"],
        rows=rows,
    )  # fmt: skip
