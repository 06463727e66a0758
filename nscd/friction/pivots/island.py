"""The search for the answer of one island: methods in turn, until a residual is small enough."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from nscd.friction.measures import measure
from nscd.friction.pivots.path import ARRIVED, AWAY, clean, follow, open_all, perturb
from nscd.friction.pivots.point import BRINK, Point, proximal_points
from nscd.friction.pivots.rates import LAM, SOFT, TAU, Path, path_of
from nscd.friction.problem import FrictionProblem, contact_velocities
from nscd.friction.proximal import PENALTY as SOFT_PENALTY
from nscd.friction.proximal import proximal_newton
from nscd.friction.sets import FREE, PENALTY, find_states, newton
from nscd.friction.sweeps import anderson, gauss_seidel, velocities_of

# Factorisations of Newton's method on the sets, and with other weights where it ends a path.
ROUNDS, FINISH = 6, ((PENALTY, 2), (1e6, 2))
# The end of a path is the reference of the next so often, with contacts that get firmer by a tenth,
# down to FIRMEST, where the error falls to no less than SLOW of itself.
REPEATS, FIRMEST, SLOW = 4, 1e-8, 0.5
# Pairs of sweeps at first; they double so often. Blocks of them between Anderson's combinations:
# how many before a path, and pairs in each.
PAIRS, DOUBLINGS, BLOCKS, BLOCK = 200, 6, 10, 8
# Pivots allowed for a local path at first, and for one from the ray.
LOCAL_PIVOTS, RAY_PIVOTS = 300, 5000
# Rounds of proximal steps, and pivots allowed for a path from where they stand; how many of these
# go before the proximal point method; the noise of these paths.
PROXIMAL, FEW = ((8, 100), (16, 150), (32, 300), (64, 300)), 2
PROXIMAL_NOISE = 1e-2
# The cost of steps of the proximal point method, in pivots: at first and further from where the
# proximal steps led, from no percussions, and from the convex programme's answer; from random ones.
# They bound the time that a search may take. Newton's method is tried where no contact changed, and
# after SOME steps nearer than NEAR.
POINT, FURTHER, NONE, CONVEX, RANDOM = 1500, 6000, 12_500, 6000, 1500
NEAR, SOME = 1e-5, 4
# The largest island that is solved from the ray.
RAY_CONTACTS = 1000
# States of an island's contacts that are tried in one search from random ones. Velocities farther
# apart than this share of their scale are two answers.
STATES, APART = 256, 1e-6


Answer = tuple[Any, Any, Any]  # λ, τ (k,) N·s, u (n,3)


class Search:
    """The best answer so far for a problem whose factor is given, and the methods that better it.

    error; reaction, friction (k,) N·s, velocity (n,3); route: which method found it; pairs of
    sweeps and pivots made."""

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

    def run(self, lam: Any, tau: Any, u: Any, *, patient: bool) -> None:
        """Search from the convex programme's answer until one within the tolerance is found, or
        only by what is quick."""
        if self.problem.dissipative:
            if patient:
                self.by_sweeps(lam, tau)
            return
        moved = lam.copy(), tau.copy(), u.copy()
        self.by_proximal(*moved, PROXIMAL[:FEW])
        points = self.points_from(*moved)  # most often nearer than the convex programme's answer
        if not self.solved:
            self.by_point(points, POINT)
        if not self.solved:
            self.by_proximal(*moved, PROXIMAL[FEW:])
        if not self.solved and patient:
            self.by_point(points, FURTHER)
        if not self.solved and patient:
            self.run_from(0)
        if not self.solved and patient:
            self.by_point(self.points_from(lam, tau, u), CONVEX)

    def run_from(self, seed: int, known: Sequence[Any] = ()) -> None:
        """Search from random states, for an answer that is not `known`, and random percussions
        within the cones; from no percussions with seed 0."""
        rng, k = np.random.default_rng(seed), len(self.reaction)
        lam = rng.exponential(self.problem.scale / self.problem.normal_inverse, k)
        tau = self.problem.friction * lam * rng.uniform(-1.0, 1.0, k)
        if seed and self.by_random_states(rng, (lam, tau, self.problem.left), known):
            return
        if self.problem.dissipative:
            self.by_sweeps(lam, tau)
            return
        if not seed:
            lam[:] = tau[:] = 0.0
        points = self.points_from_sweeps(lam, tau)
        if not self.solved:
            self.by_point(points, RANDOM if seed else NONE)
        if not self.solved and k <= RAY_CONTACTS:
            self.by_ray(seed)

    @property
    def solved(self) -> bool:
        """Whether the best answer is within the tolerance."""
        return self.error <= self.tolerance

    def offer(self, lam: Any, tau: Any, u: Any, route: str) -> bool:
        """Keep an answer if it is the best so far; whether one within the tolerance is known."""
        error = self._error(lam, tau, u)
        if error < self.error:
            self.error, self.route = error, route
            self.reaction, self.friction = lam.copy(), tau.copy()
            self.velocity = u.copy()
        return self.solved

    def by_sets(self, lam: Any, tau: Any, u: Any, rounds: int, route: str) -> bool:
        """Newton's method on the sets that the natural map sees in an answer."""
        k = len(lam)
        v_left, s_left, v, s = self._scratch
        closed, hold = np.zeros(k, dtype=np.bool_), np.zeros(k, dtype=np.int8)
        contact_velocities(self.problem, self.problem.left, v_left, s_left)
        contact_velocities(self.problem, u, v, s)
        find_states(self.problem, v_left, v, s, lam, tau, closed, hold)
        return self._newton(closed, hold, (lam, tau, u), (rounds, PENALTY), route)

    def by_random_states(
        self, rng: np.random.Generator, start: Answer, known: Sequence[Any]
    ) -> bool:
        """One step of Newton's method from each state of a small island, in random order, or all of
        its steps from some, until an answer is not one of the known u (n,3)."""
        k = len(start[0])
        small = 4**k <= STATES
        rounds = 1 if small else ROUNDS
        codes = rng.permutation(4**k)[:, None] >> 2 * np.arange(k) & 3 if small else None
        drawn = rng.integers(0, 4, (STATES // k // ROUNDS, k)) if codes is None else codes
        again: Answer | None = None
        for states in drawn.astype(np.int8):
            self.error = np.inf
            lam, tau, u = (part.copy() for part in start)
            if self._newton(states != FREE, states, (lam, tau, u), (rounds, PENALTY), "sets"):
                if all(self._apart(u, other) for other in known):
                    return True
                again = lam, tau, u
        self.error = np.inf
        return again is not None and self.offer(*again, "sets")

    def _apart(self, u: Any, other: Any) -> bool:
        """Whether velocities (n,3) are two answers: by the energy of their difference."""
        mass, least = self.problem.mass, APART * self.problem.scale
        return bool((mass * (u - other) ** 2).sum() > least**2 * mass[:, 0].sum())

    def by_proximal(
        self, lam: Any, tau: Any, u: Any, efforts: tuple[tuple[int, int], ...] = PROXIMAL
    ) -> None:
        """Proximal steps from percussions, which are changed, and paths from where they stand;
        efforts: rounds, and pivots of the path after them."""
        weight = np.full(1, SOFT_PENALTY)
        for rounds, pivots in efforts:
            _, made = proximal_newton(
                self.problem, self.factor, lam, tau, u, rounds, 0.5 * self.tolerance, weight
            )
            self.pairs += made
            if self.offer(lam, tau, u, "proximal"):
                return
            if self._locally(lam, tau, u, pivots, self._noise(PROXIMAL_NOISE, rounds)):
                return

    def by_point(self, points: Iterator[Point], effort: int) -> None:
        """Steps of the proximal point method, at the cost of `effort` pivots: see `points_from`."""
        path, there, step = self._storage(), np.empty_like(self.velocity), 0
        while effort > 0:
            point = next(points)
            effort -= point.cost
            self.pivots += point.pivots
            if not point.made:
                continue
            velocities_of(self.problem, point.reaction, point.friction, there)
            if self.offer(point.reaction, point.friction, there, "proximal_point"):
                return
            step += 1
            settled = self.error < NEAR and step % SOME == 0
            if settled or not point.pivots:
                for weight, _ in FINISH:
                    hold = path.hold.copy()
                    end = point.reaction.copy(), point.friction.copy(), there.copy()
                    if self._newton(hold != FREE, hold, end, (1, weight), "proximal_point"):
                        return

    def points_from(self, lam: Any, tau: Any, u: Any) -> Iterator[Point]:
        """Where the proximal point method goes from an answer."""
        return proximal_points(self.problem, self.factor, self._storage(), (lam, tau, u))

    def points_from_sweeps(self, lam: Any, tau: Any) -> Iterator[Point]:
        """The same from accelerated sweeps from percussions, which are changed."""
        u = np.empty_like(self.velocity)
        _, made = anderson(self.problem, lam, tau, u, BLOCKS, BLOCK, 0.5 * self.tolerance)
        self.pairs += made
        self.offer(lam, tau, u, "sweeps")
        return self.points_from(lam, tau, u)

    def by_sweeps(self, lam: Any, tau: Any) -> None:
        """Long plain blocks of sweeps, short accelerated ones on a copy, and Newton's method: of a
        problem with dissipation."""
        plain = lam.copy(), tau.copy(), np.empty_like(self.velocity)
        pairs, aim = PAIRS, 0.5 * self.tolerance
        for _ in range(DOUBLINGS + 1):
            _, made = gauss_seidel(self.problem, *plain, pairs, aim)
            self.pairs += made
            if self._offer_whole(*plain, "sweeps"):
                return
            fast = plain[0].copy(), plain[1].copy(), plain[2].copy()
            _, made = anderson(self.problem, *fast, pairs // 2 // BLOCK, BLOCK, aim)
            self.pairs += made
            if self._offer_whole(*fast, "sweeps"):
                return
            if self.by_sets(fast[0].copy(), fast[1].copy(), fast[2].copy(), 3, "sweeps"):
                return
            pairs *= 2

    def by_ray(self, seed: int) -> None:
        """A path from all contacts open: none that closes on itself can begin there."""
        path = self._storage()
        path.compliance[0] = SOFT
        noise = np.random.default_rng(seed).random(len(self.reaction))
        t = open_all(self.problem, path, noise)
        ended, made = follow(self.problem, self.factor, path, t, -1.0, RAY_PIVOTS)
        self.pivots += made
        if ended == ARRIVED and not self._finish(path, "ray"):
            self.by_point(self.points_from(path.x[LAM], path.x[TAU], path.u), POINT)

    def _locally(self, lam: Any, tau: Any, u: Any, pivots: int, noise: Any) -> bool:
        path = self._storage()
        path.compliance[0] = SOFT
        lam, tau = lam.copy(), tau.copy()
        clean(self.problem, u, lam, tau)
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
        method on its sets, further paths about its percussions, and firmer contacts."""
        before = np.inf
        for repeat in range(REPEATS):
            lam, tau, u = path.x[LAM].copy(), path.x[TAU].copy(), path.u.copy()
            error = self._error(lam, tau, u)
            if self.offer(lam, tau, u, route):
                return True
            for weight, rounds in FINISH:
                hold = path.hold.copy()
                answer = lam.copy(), tau.copy(), u.copy()
                if self._newton(hold != FREE, hold, answer, (rounds, weight), route):
                    return True
            # percussions that drift at a constant rate get to the next change of a state sooner
            if error > SLOW * before and path.compliance[0] > FIRMEST:
                path.compliance[0] *= 0.1
            before = error
            lam = np.maximum(lam, 0.0)
            most = self.problem.friction * lam
            perturb(self.problem, path, lam, np.clip(tau, -most, most), self._noise(BRINK, repeat))
            ended, made = follow(self.problem, self.factor, path, 1.0, -1.0, LOCAL_PIVOTS)
            self.pivots += made
            if ended != ARRIVED:
                break
        return False

    def _error(self, lam: Any, tau: Any, u: Any) -> float:
        v, s = self._scratch[0], self._scratch[1]
        return float(measure(self.problem, u, lam, tau, v, s).max())

    def _newton(
        self, closed: Any, hold: Any, answer: Answer, effort: tuple[int, float], route: str
    ) -> bool:
        (lam, tau, u), (rounds, weight) = answer, effort
        newton(self.problem, self.factor, closed, hold, lam, tau, u, self.tolerance, rounds, weight)
        return self.offer(lam, tau, u, route)

    def _offer_whole(self, pn: Any, pt: Any, u: Any, route: str) -> bool:
        """Offer whole percussions p_n, p_t and the velocities that balance them."""
        v_left, s_left, v, s = np.empty((4, len(pn)))
        contact_velocities(self.problem, self.problem.left, v_left, s_left)
        contact_velocities(self.problem, u, v, s)
        lam = pn - self.problem.normal_weight * (v + v_left)
        tau = pt - self.problem.tangent_weight * (s + s_left)
        return self.offer(lam, tau, u, route)

    def _noise(self, size: float, seed: int) -> Any:
        random = np.random.default_rng(seed).random(len(self.reaction))
        return size * self.problem.scale * random

    def _storage(self) -> Path:
        if self._path is None:
            self._path = path_of(self._n, len(self.reaction))
        return self._path
