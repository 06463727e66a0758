"""The search for the answer of one island: methods in turn, until a residual is small enough."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.friction.dilation import lower_dilation
from nscd.friction.measures import measure
from nscd.friction.path import ARRIVED, AWAY, clean, follow, open_all, perturb
from nscd.friction.problem import FrictionProblem, contact_velocities
from nscd.friction.rates import FIRM, LAM, SOFT, TAU, Path, path_of
from nscd.friction.sets import FREE, PENALTY, find_states, newton
from nscd.friction.sweeps import anderson, gauss_seidel

# Factorisations of Newton's method on the sets, and with other weights where it ends a path.
ROUNDS, FINISH = 6, ((PENALTY, 2), (1e6, 2))
# A path's end is used as the reference of the next one so often; the last ones are firm.
REPEATS, FIRM_FROM = 10, 6
# Pairs of sweeps at first; they double so often.
PAIRS, DOUBLINGS = 200, 6
BLOCK = 10
# Pivots for lowering the dilation, for one local path at first, and from the ray.
DILATION_PIVOTS, LOCAL_PIVOTS, RAY_PIVOTS = 12_000, 300, 20_000
# The largest island that is solved from the ray.
RAY_CONTACTS = 1000


class Search:
    """The best answer so far for a problem whose factor is given, and the methods that better it.

    error; reaction, friction (k,) N·s, velocity (n,3); route: which method found it; pairs of sweeps
    and pivots made."""

    def __init__(self, problem: FrictionProblem, factor: Any, tolerance: float) -> None:
        n, k = len(problem.mass), len(problem.first)
        self.problem, self.factor, self.tolerance = problem, factor, tolerance
        self.error, self.route = np.inf, "none"
        self.reaction, self.friction = np.zeros(k), np.zeros(k)
        self.velocity = problem.left.copy()
        self.pairs = self.pivots = 0
        self._path: Path | None = None
        self._scratch = np.empty((4, k))
        self._n = n

    @property
    def solved(self) -> bool:
        """Whether the best answer is within the tolerance."""
        return self.error <= self.tolerance

    def offer(self, lam: Any, tau: Any, u: Any, route: str) -> bool:
        """Keep an answer if it is the best so far; whether one within the tolerance is known."""
        v, s = self._scratch[0], self._scratch[1]
        error = float(measure(self.problem, u, lam, tau, v, s).max())
        if error < self.error:
            self.error, self.route = error, route
            self.reaction, self.friction = lam.copy(), tau.copy()
            self.velocity = u.copy()
        return self.solved

    def run(self, lam: Any, tau: Any, u: Any) -> None:
        """Search from the convex programme's answer until one within the tolerance is found."""
        if not self.problem.dissipative:
            lam, tau = self.by_dilation(lam, tau, u)
        if not self.solved:
            self.by_sweeps(lam, tau)
        if not self.solved and len(lam) <= RAY_CONTACTS and not self.problem.dissipative:
            self.by_ray()

    def by_sets(self, lam: Any, tau: Any, u: Any, rounds: int, route: str) -> bool:
        """Newton's method on the sets that the natural map sees in an answer."""
        k = len(lam)
        v_left, s_left, v, s = self._scratch
        closed, hold = np.zeros(k, dtype=np.bool_), np.zeros(k, dtype=np.int8)
        contact_velocities(self.problem, self.problem.left, v_left, s_left)
        contact_velocities(self.problem, u, v, s)
        find_states(self.problem, v_left, v, s, lam, tau, closed, hold)
        return self._newton(closed, hold, lam, tau, u, rounds, PENALTY, route)

    def by_dilation(self, lam: Any, tau: Any, u: Any) -> tuple[Any, Any]:
        """Paths from the convex programme's answer; the λ and τ that they reached."""
        path = self._storage()
        path.compliance[0] = SOFT
        reached = lower_dilation(self.problem, self.factor, path, lam, tau, u, DILATION_PIVOTS)
        self.pivots += reached.pivots
        if reached.dilation == 0.0:
            self._finish(path, "dilation")
        return reached.reaction, reached.friction

    def by_sweeps(self, lam: Any, tau: Any) -> None:
        """Long plain blocks of sweeps, short accelerated ones on a copy, Newton's method from both,
        and paths from the better."""
        plain = lam.copy(), tau.copy(), np.empty_like(self.velocity)
        pairs, pivots = PAIRS, LOCAL_PIVOTS
        for attempt in range(DOUBLINGS + 1):
            one, made = gauss_seidel(self.problem, *plain, pairs, 0.5 * self.tolerance)
            self.pairs += made
            if self._offer_whole(*plain, "sweeps"):
                return
            fast = tuple(a.copy() for a in plain)
            two, made = anderson(
                self.problem, *fast, pairs // 2 // BLOCK, BLOCK, 0.5 * self.tolerance
            )
            self.pairs += made
            if self._offer_whole(*fast, "sweeps"):
                return
            if self.by_sets(*(a.copy() for a in fast), 3, "sweeps"):
                return
            if not self.problem.dissipative:
                start = fast if two < one else plain
                if self._locally(start[0], start[1], start[2], pivots, attempt):
                    return
            pairs, pivots = 2 * pairs, int(1.5 * pivots)

    def by_ray(self, seed: int = 1) -> None:
        """A path from all contacts open: none that closes on itself can begin there."""
        path = self._storage()
        path.compliance[0] = SOFT
        noise = np.random.default_rng(seed).random(len(self.reaction))
        t = open_all(self.problem, path, noise)
        ended, made = follow(self.problem, self.factor, path, t, -1.0, RAY_PIVOTS)
        self.pivots += made
        if ended == ARRIVED:
            self._finish(path, "ray")

    def _locally(self, lam: Any, tau: Any, u: Any, pivots: int, seed: int) -> bool:
        path = self._storage()
        path.compliance[0] = SOFT
        lam, tau = lam.copy(), tau.copy()
        clean(self.problem, 0.0, u, lam, tau)
        size = 1e-3 * 0.1**seed * self.problem.scale
        noise = size * np.random.default_rng(seed).random(len(lam))
        for way in (-1.0, 1.0):
            perturb(self.problem, path, lam, tau, noise)
            ended, made = follow(self.problem, self.factor, path, 1.0, way, pivots)
            self.pivots += made
            if ended == ARRIVED:
                return self._finish(path, "path")
            if ended != AWAY:
                break
        return False

    def _finish(self, path: Path, route: str) -> bool:
        """From the end of a path, whose contacts are slightly soft, to the rigid answer: Newton's
        method on its sets, and further paths about its percussions."""
        k = len(path.hold)
        for repeat in range(REPEATS):
            lam, tau, u = path.x[LAM].copy(), path.x[TAU].copy(), path.u.copy()
            if self.offer(lam, tau, u, route):
                return True
            for penalty, rounds in FINISH:
                hold = path.hold.copy()
                answer = lam.copy(), tau.copy(), u.copy()
                if self._newton(hold != FREE, hold, *answer, rounds, penalty, route):
                    return True
            path.compliance[0] = SOFT if repeat < FIRM_FROM else FIRM
            lam = np.maximum(lam, 0.0)
            most = self.problem.friction * lam
            noise = 1e-9 * self.problem.scale * np.random.default_rng(repeat).random(k)
            perturb(self.problem, path, lam, np.clip(tau, -most, most), noise)
            ended, made = follow(self.problem, self.factor, path, 1.0, -1.0, LOCAL_PIVOTS)
            self.pivots += made
            if ended != ARRIVED:
                return False
        return False

    def _newton(
        self,
        closed: Any,
        hold: Any,
        lam: Any,
        tau: Any,
        u: Any,
        rounds: int,
        penalty: float,
        route: str,
    ) -> bool:
        newton(
            self.problem, self.factor, closed, hold, lam, tau, u, self.tolerance, rounds, penalty
        )
        return self.offer(lam, tau, u, route)

    def _offer_whole(self, pn: Any, pt: Any, u: Any, route: str) -> bool:
        """Offer whole percussions p_n, p_t and the velocities that balance them."""
        v_left, s_left, v, s = self._scratch.copy()
        contact_velocities(self.problem, self.problem.left, v_left, s_left)
        contact_velocities(self.problem, u, v, s)
        lam = pn - self.problem.normal_weight * (v + v_left)
        tau = pt - self.problem.tangent_weight * (s + s_left)
        return self.offer(lam, tau, u, route)

    def _storage(self) -> Path:
        if self._path is None:
            self._path = path_of(self._n, len(self.reaction))
        return self._path
