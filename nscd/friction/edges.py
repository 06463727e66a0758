"""The convex relative of an impact with friction: percussions within the cone, contacts that slide
open at μ times their speed. A quadratic programme, solved by an interior point."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner, kernel
from nscd.friction.cholesky.multifrontal import factorise_fronts
from nscd.friction.cholesky.substitution import solve_fronts
from nscd.friction.elimination import add_to, put
from nscd.friction.measures import imbalance
from nscd.friction.problem import add_impulses, contact_velocities

ITERATIONS = 100
# So many iterations without progress end it, ten times as many far from the answer.
PATIENCE, NEAR = 5, 1e-6
# Compliance of the edges relative to their Delassus diagonal: a proximal term of the iteration
# only.
RIGID = 1e-14
TINY = 1e-300


class Weighted(NamedTuple):
    """M + Σ weight f fᵀ + θ n nᵀ as the Cholesky factorisation takes it: f = t + γ n of each disk,
    (k,3)."""

    mass: Any
    normal_first: Any
    normal_weight: Any
    tangent_weight: Any
    tangent_first: Any
    tangent_second: Any


class Edges(NamedTuple):
    """A point of the interior: slack (2k,) m/s and multiplier (2k,) N·s of the edges of each cone,
    u (n,3); along, across (k,) N·s: λ and τ of the best point met, best its velocities (n,3), error
    (1,) its error."""

    slack: Any
    multiplier: Any
    u: Any
    along: Any
    across: Any
    best: Any
    error: Any


def start_edges(problem: Any) -> Edges:
    """Where the interior point begins: s = √w, λ = 1/√w, which makes unequal masses harmless."""
    k = len(problem.first)
    weight = problem.normal_inverse + problem.friction**2 * problem.tangent_inverse
    least = float(weight.min())
    return Edges(
        slack=np.repeat(problem.scale * np.sqrt(weight / least), 2),
        multiplier=np.repeat(problem.scale / np.sqrt(weight * least), 2),
        u=problem.left.copy(),
        along=np.zeros(k),
        across=np.zeros(k),
        best=problem.left.copy(),
        error=np.full(1, np.inf),
    )


def solve_edges(problem: Any, factor: Any, edges: Edges, tolerance: float) -> int:
    """Follow the central path from `edges`, changed in place, to the tolerance.

    It is the path of the convex programme

    min ½ (u−u⁻)·M(u−u⁻) + dissipation, subject to C u ± μ T u ≤ b: one inequality for each edge
    n ± μt of the cone, its multipliers λ₊ + λ₋ = λ, μ(λ₊ − λ₋) = τ. A contact that slides opens at
    μ|T u|. The iterations made. Mehrotra, SIAM J. Optim. 2 (1992) 575."""
    k = len(problem.first)
    zeros = np.zeros((k, 3))
    system = Weighted(problem.mass, problem.normal, np.zeros(k), np.empty(k), zeros, zeros.copy())
    return int(_follow(problem, factor.fronts, system, edges, tolerance))


@inner(fastmath=True)
def _factorise(problem: Any, fronts: Any, system: Any, theta: Any, press: Any) -> bool:
    """Factorise M + DᵀKD + Σ θ₊ e₊e₊ᵀ + θ₋ e₋e₋ᵀ, θ (2k,): as press (k,) along n and one term along
    t + γn."""
    for c in range(len(press)):
        one, two, mu = theta[2 * c], theta[2 * c + 1], problem.friction[c]
        across = mu * mu * (one + two) + problem.tangent_weight[c]
        gamma = mu * (one - two) / across if across > 0.0 else 0.0
        rest = one + two - gamma * mu * (one - two)
        if problem.tangent_weight[c] == 0.0 and mu > 0.0:
            rest = 4.0 * one * two / (one + two)  # the same without cancellation
        press[c] = rest + problem.normal_weight[c]
        system.tangent_weight[c] = across
        nx, ny = problem.normal[c, 0], problem.normal[c, 1]
        x, y = gamma * nx - ny, gamma * ny + nx
        first, second = system.tangent_first, system.tangent_second
        first[c, 0], first[c, 1], first[c, 2] = x, y, problem.lever[c, 0]
        second[c, 0], second[c, 1], second[c, 2] = -x, -y, problem.lever[c, 1]
    return bool(factorise_fronts(system, fronts, press))


@inner(fastmath=True)
def _edge_velocities(problem: Any, u: Any, v: Any, s: Any, out: Any) -> None:
    """out (2k,) = C u ± μ T u."""
    contact_velocities(problem, u, v, s)
    for c in range(len(v)):
        across = problem.friction[c] * s[c]
        out[2 * c] = v[c] + across
        out[2 * c + 1] = v[c] - across


@inner(fastmath=True)
def _push(problem: Any, edges: Any, factor: float, along: Any, across: Any, out: Any) -> None:
    """out += factor · Eᵀ edges."""
    for c in range(len(along)):
        along[c] = edges[2 * c] + edges[2 * c + 1]
        across[c] = problem.friction[c] * (edges[2 * c] - edges[2 * c + 1])
    add_impulses(problem, along, across, factor, out)


@inner(fastmath=True)
def _to_boundary(slack: Any, slack_step: Any, edge: Any, edge_step: Any) -> float:
    fastest = 1.0
    for c in range(len(slack)):
        fastest = max(fastest, -slack_step[c] / slack[c], -edge_step[c] / edge[c])
    return 1.0 / fastest


@inner
def _worst(problem: Any, dual: Any, edge: Any, slack: Any, weight: Any) -> float:
    """The larger of the natural map and of the imbalance over mass, m/s."""
    worst = 0.0
    for c in range(len(edge)):
        worst = max(worst, abs(min(weight[c // 2] * edge[c], slack[c])))
    for i in range(len(dual)):
        for a in range(2):
            worst = max(worst, abs(dual[i, a]) / problem.mass[i, a])
    return worst


@inner
def _keep(edges: Any, error: float, along: Any, across: Any) -> None:
    """Note the point as the best one met."""
    edges.error[0] = error
    put(edges.along, along)
    put(edges.across, across)
    put(edges.best, edges.u)


@inner
def _correct(
    slack: Any, slack_step: Any, edge: Any, edge_step: Any, length: float, mu: float, product: Any
) -> None:
    """Add to product (2k,) what the predictor leaves out, and Mehrotra's centring."""
    after = 0.0
    for c in range(len(slack)):
        one, two = slack[c] + length * slack_step[c], edge[c] + length * edge_step[c]
        after += one * two / len(slack)
    centring = (after / mu) ** 3
    if length < 0.1:
        centring = max(centring, 0.3)
    for c in range(len(slack)):
        product[c] += slack_step[c] * edge_step[c] - centring * mu


@inner
def _advance(x: Any, length: float, step: Any) -> None:
    """x ← x + length · step, kept positive."""
    for c in range(len(x)):
        x[c] = max(x[c] + length * step[c], TINY)


@kernel
def _follow(problem: Any, fronts: Any, system: Any, edges: Any, tolerance: float) -> int:
    n, k = len(problem.mass), len(problem.first)
    slack, edge, u = edges.slack, edges.multiplier, edges.u
    v, s, along, across = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    work, press, weight = np.empty((4, k)), np.empty(k), np.empty(k)
    theta, wanted, primal = np.empty(2 * k), np.empty(2 * k), np.empty(2 * k)
    moved, product = np.empty(2 * k), np.empty(2 * k)
    slack_step, edge_step = np.empty(2 * k), np.empty(2 * k)
    dual, step = np.empty((n, 3)), np.empty((n, 3))
    for c in range(k):
        across_too = problem.friction[c] ** 2 * problem.tangent_inverse[c]
        weight[c] = problem.normal_inverse[c] + across_too
    iteration = stalled = 0
    while True:
        _edge_velocities(problem, u, v, s, moved)
        for c in range(k):
            along[c] = edge[2 * c] + edge[2 * c + 1]
            across[c] = problem.friction[c] * (edge[2 * c] - edge[2 * c + 1])
        imbalance(problem, u, v, s, along, across, work, dual)
        mu = 0.0
        for c in range(2 * k):
            primal[c] = moved[c] + slack[c] - problem.offset[c // 2]
            product[c] = problem.offset[c // 2] - moved[c]
            mu += slack[c] * edge[c] / (2 * k)
        error = _worst(problem, dual, edge, product, weight) / problem.scale
        stalled = 0 if error < 0.9 * edges.error[0] else stalled + 1
        if error < edges.error[0]:
            _keep(edges, error, along, across)
        if error <= tolerance or not error < np.inf or iteration == ITERATIONS:
            break
        if stalled > (PATIENCE if edges.error[0] < NEAR else 10 * PATIENCE):
            break
        iteration += 1
        for c in range(2 * k):
            theta[c] = 1.0 / (slack[c] / edge[c] + RIGID * weight[c // 2])
            product[c] = slack[c] * edge[c]
        if not _factorise(problem, fronts, system, theta, press):
            break
        length = 0.0
        for stage in range(2):  # predictor, corrector
            for c in range(2 * k):
                wanted[c] = primal[c] - product[c] / edge[c]
                moved[c] = theta[c] * wanted[c]
            step[:] = 0.0
            add_to(step, -1.0, dual)
            _push(problem, moved, -1.0, along, across, step)
            solve_fronts(fronts, step)
            _edge_velocities(problem, step, v, s, moved)
            for c in range(2 * k):
                edge_step[c] = theta[c] * (moved[c] + wanted[c])
                slack_step[c] = -(product[c] + slack[c] * edge_step[c]) / edge[c]
            length = _to_boundary(slack, slack_step, edge, edge_step)
            if stage == 0:
                _correct(slack, slack_step, edge, edge_step, length, mu, product)
        length *= min(max(0.995, 1.0 - 10.0 * error), 0.99999)
        add_to(u, length, step)
        _advance(slack, length, slack_step)
        _advance(edge, length, edge_step)
    return iteration
