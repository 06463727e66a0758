"""Crowds of one size against the continuum models: distances and shares, one number per crowd."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.paper.answers import unsolved
from analysis.paper.continuum.bridge.crowd import Packing, Sample, sample
from analysis.paper.continuum.bridge.models import Crowd, Model, Models
from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.stress import FlowField

Plan = Mapping[Packing, Mapping[int, int]]
"""How many crowds (seeds 1, 2, …) of each packing and N."""

# a large crowd averages over its own disorder, so that few of them say as much as many small ones
PLAN: Plan = {
    Packing.TOUCHING: {600: 8, 2400: 6, 10_000: 4, 40_000: 2},
    Packing.NEAR: {600: 8, 2400: 4, 10_000: 3, 40_000: 1},
    Packing.PRESSED: {600: 8, 2400: 4, 10_000: 3, 40_000: 1},
}


@dataclass(frozen=True, eq=False)
class Size:
    """All crowds of one packing and one N, against the continuum models of that packing's crowd."""

    packing: Packing
    n: int
    samples: Sequence[Sample]
    models: Models

    def pressure_distance(self, model: Model) -> Floats:
        """(s,), ‖p − p_model‖/‖p_(20)‖ of each crowd, L² over the points."""
        return self._distance("pressure", model, self.models.first_order.pressure)

    def velocity_distance(self, model: Model) -> Floats:
        """(s,), ‖u⁺ − u⁺_model‖/‖u⁻‖ of each crowd, L² over the points."""
        return self._distance("velocity", model, self.models.unhindered.velocity)

    def _distance(self, name: str, model: Model, scale: Floats) -> Floats:
        theirs = getattr(model, name)
        ours = [s.stress.pressure if name == "pressure" else s.flow.velocity for s in self.samples]
        distance = np.array([np.linalg.norm(one - theirs) for one in ours])
        return np.asarray(distance / np.linalg.norm(scale))

    def pressure_gap(self, model: Model) -> float:
        """‖p_model − p_(20)‖/‖p_(20)‖: how far a model is from (20)."""
        reference = self.models.first_order.pressure
        return float(np.linalg.norm(model.pressure - reference) / np.linalg.norm(reference))

    def _nearest_pressure(self, models: Sequence[Model]) -> Model:
        return min(models, key=lambda model: float(self.pressure_distance(model).mean()))

    @cached_property
    def best(self) -> Model:
        """(11) with the k_v, among VOLUMES, whose pressure is nearest to the crowds'."""
        return self._nearest_pressure(self.models.deformable)

    @cached_property
    def rough(self) -> Model:
        """(20) with the friction, 0 or among FRICTIONS, whose pressure is nearest to the
        crowds'."""
        return self._nearest_pressure([self.models.first_order, *self.models.frictional])

    @property
    def shown(self) -> list[Model]:
        """The models that stand in a table, with what is fitted among them."""
        m = self.models
        return [m.first_order, m.blocked, m.unhindered, m.table, self.best, self.rough]

    @property
    def nearest(self) -> Model:
        """The one of the models shown to which pressure and velocity together are nearest."""
        distances = (self.pressure_distance, self.velocity_distance)
        return min(self.shown, key=lambda model: sum(float(far(model).mean()) for far in distances))

    @property
    def deviator(self) -> Floats:
        """(s,), ‖Σ + p1‖/‖Σ‖ of each crowd: what is not pressure."""
        shares = []
        for s in self.samples:
            rest = s.stress.stress + s.stress.pressure[:, None, None] * np.eye(2)
            shares.append(np.linalg.norm(rest) / np.linalg.norm(s.stress.stress))
        return np.array(shares)

    @property
    def dissipative(self) -> Floats:
        """(s,), R² of Σ = k D(w), w = u⁺ + u⁻, through the origin, of each crowd: 1 − ‖Σ −
        kD(w)‖²/‖Σ‖² with the best k ≥ 0."""
        shares = []
        for s in self.samples:
            total = s.flow.gradient + s.left.gradient
            rate = 0.5 * (total + total.transpose(0, 2, 1))
            sigma = s.stress.stress
            along = max(float((sigma * rate).sum()), 0.0)
            shares.append(along**2 / ((sigma**2).sum() * (rate**2).sum()))
        return np.array(shares)

    @property
    def compression(self) -> Floats:
        """(s,), how much of the compression that people want is left, ∫(div u⁺)₋/∫(div u⁻)₋."""
        return np.array([_negative(s.flow) / _negative(s.left) for s in self.samples])

    @property
    def kept(self) -> Floats:
        """(s,), the share of the kinetic energy that each crowd keeps."""
        return np.array([s.kept for s in self.samples])

    @property
    def wall_load(self) -> Floats:
        """(s,) kN·s, the load of the walls in each crowd."""
        return np.array([s.wall_load for s in self.samples]) / 1e3

    @property
    def coordination(self) -> float:
        """Contacts per disk, mean over the crowds."""
        return float(np.mean([s.coordination for s in self.samples]))

    @property
    def spread(self) -> float | None:
        """Root mean square distance of a crowd's pressure from their mean, over ‖p_(20)‖; None for
        a single crowd."""
        if len(self.samples) < 2:
            return None
        every = np.array([s.stress.pressure for s in self.samples])
        variance = every.var(axis=0, ddof=1).sum()
        return float(np.sqrt(variance) / np.linalg.norm(self.models.first_order.pressure))

    @property
    def warnings(self) -> list[str]:
        """The crowds that are not solved."""
        name = f"{self.packing}, N = {self.n}, seed"
        return unsolved((f"{name} {s.seed}", s.answer) for s in self.samples)


def _negative(flow: FlowField) -> float:
    return float(np.maximum(-np.trace(flow.gradient, axis1=1, axis2=2), 0.0).sum())


def study(plan: Plan = PLAN, progress: Progress | None = None) -> list[Size]:
    """Solve all crowds of the plan, by packing and N, and the continuum of each packing's mean
    size R."""
    total = sum(n * count for sizes in plan.values() for n, count in sizes.items())
    done, crowds = 0, dict[tuple[Packing, int], list[Sample]]()
    for packing, n in ((packing, n) for packing, sizes in plan.items() for n in sizes):
        crowds[packing, n] = []
        for seed in range(1, plan[packing][n] + 1):
            crowds[packing, n].append(sample(packing, n, seed))
            done += n
            if progress:
                progress("crowds", done / total)
    models: dict[float, Models] = {}
    found = []
    for packing, n in crowds:
        same = [s for (kind, _), some in crowds.items() if kind is packing for s in some]
        # to the centimetre: `touching` and `near` are the same heaps
        size = round(float(np.mean([s.size for s in same])), 2)
        if size not in models:
            models[size] = Models.of(Crowd(size))
        found.append(Size(packing, n, crowds[packing, n], models[size]))
    return found
