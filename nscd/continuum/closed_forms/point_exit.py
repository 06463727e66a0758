"""The pressure of (11) where everybody walks to one point of a long wall, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import iv, modstruve

from nscd.arrays import Floats


def point_sink(r: ArrayLike, speed: float, density: float, volume: float) -> Floats:
    """Compute p(r), N·s/m, of (11) where everybody walks to one point of a long smooth wall.

    r: m.
    speed: m/s, U.
    density: kg/m², ρ.
    volume: kg, k_v.

    w = f(r) r̂ with s = r/h, h = √(k_v/ρ), f = πU(L₁(s) − I₁(s)) (modified Struve and Bessel),
    p = −½k_v(f′ + f/r); (π/2)U√(k_vρ) at r = 0, k_v U/r far away.
    """
    s = np.maximum(np.asarray(r, dtype=np.float64) * np.sqrt(density / volume), 1e-9)
    # d(sL₁)/ds = sL₀ and d(sI₁)/ds = sI₀, so that f′ + f/r = πU(L₀ − I₀)/h
    rate = np.pi * speed * np.sqrt(density / volume) * (modstruve(0, s) - iv(0, s))
    return np.asarray(-0.5 * volume * rate)
