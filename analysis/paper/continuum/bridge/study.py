"""Crowds of one size against the continuum models: distances and shares, one number a crowd."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.paper.continuum.bridge.crowd import Packing, Sample
from analysis.paper.continuum.bridge.models import Crowd, Model
from nscd.arrays import Floats
from nscd.stress import FlowField

VOLUMES = 10.0 ** np.arange(2.0, 4.51, 0.25)  # kg, among which k_v is fitted
FRICTIONS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)


@dataclass(frozen=True, kw_only=True, eq=False)
class Models:
    """The continuum models of one crowd: (20), nobody moves, everybody walks freely, (11) with
    Table 1 and with each of VOLUMES, (20) with each of FRICTIONS."""

    first_order: Model
    blocked: Model
    unhindered: Model
    table: Model
    deformable: Sequence[Model]
    frictional: Sequence[Model]

    @classmethod
    def of(cls, crowd: Crowd) -> Models:
        """Solve them all."""
        return cls(
            first_order=crowd.first_order(),
            blocked=crowd.blocked(),
            unhindered=crowd.unhindered(),
            table=crowd.table(),
            deformable=[crowd.deformable(float(volume)) for volume in VOLUMES],
            frictional=[crowd.frictional(friction) for friction in FRICTIONS],
        )

    @property
    def every(self) -> Sequence[Model]:
        """All of them."""
        named = (self.first_order, self.blocked, self.unhindered, self.table)
        return (*named, *self.deformable, *self.frictional)


@dataclass(frozen=True, eq=False)
class Size:
    """All crowds of one packing and one N, against the continuum models of that packing's crowd."""

    samples: Sequence[Sample]
    models: Models

    @property
    def packing(self) -> Packing:
        return self.samples[0].packing

    @property
    def n(self) -> int:
        return self.samples[0].n

    def pressure_distance(self, model: Model) -> Floats:
        """‖p − p_model‖/‖p_(20)‖ of each crowd (s,), L² over the points."""
        scale = np.linalg.norm(self.models.first_order.pressure)
        return np.array(
            [np.linalg.norm(s.stress.pressure - model.pressure) / scale for s in self.samples]
        )

    def pressure_gap(self, model: Model) -> float:
        """‖p_model − p_(20)‖/‖p_(20)‖: how far a model is from (20)."""
        reference = self.models.first_order.pressure
        return float(np.linalg.norm(model.pressure - reference) / np.linalg.norm(reference))

    def velocity_distance(self, model: Model) -> Floats:
        """‖u⁺ − u⁺_model‖/‖u⁻‖ of each crowd (s,), L² over the points."""
        scale = np.linalg.norm(self.models.unhindered.velocity)
        return np.array(
            [np.linalg.norm(s.flow.velocity - model.velocity) / scale for s in self.samples]
        )

    @cached_property
    def best(self) -> Model:
        """(11) with the k_v, among VOLUMES, whose pressure is nearest to the crowds'."""
        return min(
            self.models.deformable, key=lambda model: float(self.pressure_distance(model).mean())
        )

    @cached_property
    def rough(self) -> Model:
        """(20) with the friction, 0 or among FRICTIONS, whose pressure is nearest to the
        crowds'."""
        every = (self.models.first_order, *self.models.frictional)
        return min(every, key=lambda model: float(self.pressure_distance(model).mean()))

    @property
    def deviator(self) -> Floats:
        """‖Σ + p1‖/‖Σ‖ of each crowd (s,): what is not pressure."""
        shares = []
        for s in self.samples:
            rest = s.stress.stress + s.stress.pressure[:, None, None] * np.eye(2)
            shares.append(np.linalg.norm(rest) / np.linalg.norm(s.stress.stress))
        return np.array(shares)

    @property
    def dissipative(self) -> Floats:
        """R² of Σ = k D(w), w = u⁺ + u⁻, through the origin, of each crowd (s,): 1 − ‖Σ −
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
        """How much of the compression that people want is left, ∫(div u⁺)₋/∫(div u⁻)₋, of each
        crowd (s,)."""
        return np.array([_negative(s.flow) / _negative(s.left) for s in self.samples])

    @property
    def kept(self) -> Floats:
        """Share of the kinetic energy that each crowd keeps (s,)."""
        return np.array([s.kept for s in self.samples])

    @property
    def wall_load(self) -> Floats:
        """Load of the walls in each crowd (s,) N·s."""
        return np.array([s.wall_load for s in self.samples])

    @property
    def spread(self) -> float:
        """Root mean square distance of a crowd's pressure from their mean, over ‖p_(20)‖; NaN for a
        single crowd."""
        if len(self.samples) < 2:
            return float("nan")
        every = np.array([s.stress.pressure for s in self.samples])
        variance = every.var(axis=0, ddof=1).sum()
        return float(np.sqrt(variance) / np.linalg.norm(self.models.first_order.pressure))

    @property
    def nearest(self) -> Model:
        """The model, (11) and (20) with what is fitted among them, to which pressure and velocity
        together are nearest."""
        models = self.models
        every = (
            models.first_order,
            models.blocked,
            models.unhindered,
            models.table,
            self.best,
            self.rough,
        )

        def distance(model: Model) -> float:
            return float(
                self.pressure_distance(model).mean() + self.velocity_distance(model).mean()
            )

        return min(every, key=distance)


def _negative(flow: FlowField) -> float:
    return float(np.maximum(-np.trace(flow.gradient, axis1=1, axis2=2), 0.0).sum())
