"""The mean and the spread over all admissible forces: a law over them, sampled, with the check that the
chains of the sampling agree.

The law is that of most entropy of given mean force and given openness of the balance: its density is
exp(−Σ f_n/scale − ½ Σ (net/spread)²) on f_n ≥ 0, |f_t| ≤ μ f_n. Where the balance is exact it is that
density on the states in balance. It is a prior, no mechanics: soft contacts that were loaded one after
the other choose one state, which the law does not know.

Checks: split R̂ and effective sample size, Gelman et al., Bayesian Data Analysis (2013), section 11.4;
Geyer, Stat. Sci. 7 (1992) 473."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, csr_array, hstack

from nscd import _core
from nscd.arrays import Floats, Indices, Mask, count, number
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.linear import ProgramError, carrying, maximise
from nscd.indeterminacy.orthogonal import factorise, undetermined_rows

# A contact has converged where R̂ is at most this, of both forces, and so many draws are as good as
# independent: the mean is then known to a tenth of the standard deviation.
ALIKE, ENOUGH = 1.05, 100
# Time of a flight, in which a free point moves by so many scales, or mean forces; chains begin where as many flights
# lead under another law, so that they agree only if they forget.
FLIGHT, BEGIN = 3.0, 20
# More unknowns would need a projector of over 0.5 GB.
MOST_LOOSE = 8000
NO_END = "scale: an even law has no end where forces have no upper bound"
# A force whose spread is below this share of the scale is determined.
NO_SPREAD = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Ensemble:
    """Hold draws of all admissible forces of k contacts; means and so on are (k,), of f_n, and of f_t
    with `tangential`.

    draws: (c,d,2k) N (N·s of percussions), of c chains, f_n and then f_t
    r_hat, effective: (2k,) split R̂ and effective sample size; 1 and c·d where determined
    sweeps: of each chain
    scale: N, of the law"""

    draws: Floats
    r_hat: Floats
    effective: Floats
    sweeps: int
    scale: float

    def _part(self, tangential: bool) -> slice:
        k = self.draws.shape[2] // 2
        return slice(k, None) if tangential else slice(0, k)

    def mean(self, *, tangential: bool = False) -> Floats:
        """Average over all draws, N."""
        return np.asarray(self.draws[:, :, self._part(tangential)].mean((0, 1)))

    def sd(self, *, tangential: bool = False) -> Floats:
        """Compute the standard deviation over all draws, N."""
        return np.asarray(self.draws[:, :, self._part(tangential)].std((0, 1)))

    def quantile(self, fraction: float, *, tangential: bool = False) -> Floats:
        """Compute the value, N, that so large a share of the draws stays below."""
        values: Any = np.quantile(self.draws[:, :, self._part(tangential)], fraction, axis=(0, 1))
        return np.asarray(values)

    @property
    def converged(self) -> Mask:
        """Tell (k,) whether R̂ and the effective sample size say that both forces of a contact are
        known."""
        good = (self.r_hat <= ALIKE) & (self.effective >= ENOUGH)
        return np.asarray(good.reshape(2, -1).all(0))

    @property
    def status(self) -> str:
        """Say `converged`, or how many contacts are not, and the worst R̂."""
        bad = int((~self.converged).sum())
        if not bad:
            return "converged"
        return (
            f"not converged: {bad} of {len(self.converged)} contacts after {self.sweeps} sweeps, "
            f"R-hat up to {self.r_hat.max():.2f}"
        )

    def __repr__(self) -> str:
        chains, draws, both = self.draws.shape
        return f"<Ensemble: {both // 2} contacts, {chains} × {draws} draws, {self.status}>"


def ensemble(
    equilibrium: Equilibrium,
    scale: float,
    spread: ArrayLike = 0.0,
    *,
    seed: int = 0,
    chains: int = 4,
    draws: int = 250,
    most_sweeps: int = 32_000,
) -> Ensemble:
    """Sample the admissible forces, in rounds of doubled length until all contacts have converged: where
    balances may be open by Gibbs sampling, where they are exact by flights (`nscd/core/ensemble.hpp`).

    scale: N, f of the law; inf: an even law
    spread: N, standard deviation of what balances are open by, see `equilibrium`; 0: exact
    seed: of the random numbers; the same ones give the same draws
    chains, draws: how many, and how many of each are kept, of its last round
    most_sweeps: of each chain, or flights, in all rounds

    Raises ValueError naming the field, where no state is in balance, and for an even law where forces
    have no upper bound; ProgramError if a linear program has no usable answer."""
    f = float(scale)
    if not f > 0:
        raise ValueError(f"scale: {scale}. A force > 0 is needed")
    chains, draws = count(chains, "chains"), count(draws, "draws")
    rounds, seed = draws, int(number(seed, "seed"))
    chain = _chain_of(equilibrium, equilibrium.rows(spread, "spread"), f)
    states = [chain.begin(np.random.default_rng([seed, c])) for c in range(chains)]
    total, number_ = 0, 1
    while True:
        draws_kept = []
        for c in range(chains):
            word = int(np.random.default_rng([seed, c, number_]).integers(1 << 62))
            some, states[c] = chain.go(states[c], word, rounds // draws * draws, rounds // draws)
            draws_kept.append(some)
        total, number_ = total + rounds, number_ + 1
        forces = chain.forces(np.stack(draws_kept))
        r_hat, effective = convergence(forces, NO_SPREAD * chain.size)
        found = Ensemble(draws=forces, r_hat=r_hat, effective=effective, sweeps=total, scale=f)
        if found.converged.all() or total + 2 * rounds > most_sweeps:
            return found
        rounds *= 2


def convergence(draws: Floats, little: float) -> tuple[Floats, Floats]:
    """Compute split R̂ and the effective sample size (v,) of draws (c,d,v) of v numbers by c chains;
    those that move by less than `little` are known."""
    c, d, _ = draws.shape
    half = d // 2
    chain = np.concatenate([draws[:, :half], draws[:, d - half :]]) if half > 1 else draws
    m, n = chain.shape[:2]
    within = chain.var(1, ddof=1).mean(0)
    total = (n - 1) / n * within + (chain.mean(1).var(0, ddof=1) if m > 1 else 0.0)
    moving = np.sqrt(total) > little
    with np.errstate(divide="ignore", invalid="ignore"):
        r_hat = np.where(moving, np.sqrt(total / within), 1.0)
        spectrum = np.fft.rfft(chain - chain.mean(1, keepdims=True), 2 * n, axis=1)
        lagged = np.fft.irfft(np.abs(spectrum) ** 2, axis=1)[:, :n].mean(0) / n
        rho = 1.0 - (within - lagged * n / (n - 1)) / total
    pairs = rho[: 2 * (n // 2)].reshape(n // 2, 2, -1).sum(1)
    positive = np.cumprod(pairs > 0, axis=0).astype(bool)  # up to where noise is left
    falling = np.minimum.accumulate(pairs, axis=0)
    time = 2 * np.where(positive, falling, 0.0).sum(0) - 1.0
    size = m * n / np.maximum(time, 1.0 / np.log10(max(m * n, 10)))
    effective = np.where(moving, size, float(c * d))
    return r_hat, effective


@dataclass(frozen=True, eq=False)
class _Chain:
    """What goes from one state x (u,) to the next, forces in units of `size`."""

    equilibrium: Equilibrium
    size: float
    slope: float
    chosen: Indices  # unknowns that move
    middle: Floats  # (u,) a state that is in balance where that is exact, else the mean of the law
    fixed: Floats | float  # (2k,) N, forces of the unknowns that do not
    matrix: csr_array | None = None  # (u,r) balances over their spread
    load: Floats | None = None  # (r,)
    projector: Floats | None = None  # (u,u) on what leaves exact balances as they are

    def forces(self, x: Floats) -> Floats:
        """Sum f_n and f_t (c,d,2k) N of x (c,d,u)."""
        c, d, u = x.shape
        moving = self.equilibrium.sums[:, self.chosen] @ (self.size * x.reshape(c * d, u)).T
        return np.asarray((moving.T + self.fixed).reshape(c, d, -1))

    def begin(self, random: np.random.Generator) -> Floats:
        """Begin a chain away from the others."""
        other = random.exponential(1.0, len(self.middle))
        if self.projector is None:
            return np.asarray(self.middle * other)
        seed = int(random.integers(1 << 62))
        return self.go(self.middle, seed, BEGIN, BEGIN, -(self.projector @ other))[1]

    def go(
        self, x: Floats, seed: int, moves: int, thin: int, pull: Floats | None = None
    ) -> tuple[Floats, Floats]:
        """Make moves; give every `thin`-th state (d,u), and the last. pull: gravity of another law."""
        if not len(x):
            return np.zeros((moves // thin, 0)), x
        if self.projector is not None:
            pull = -self.slope * self.projector.sum(1) if pull is None else pull
            time = FLIGHT * max(1.0, float(self.middle.mean()))
            drawn = _core.flights(self.projector, pull, time, x, seed, moves, thin)
            return drawn.draws, drawn.last
        assert self.matrix is not None
        assert self.load is not None
        m, net = self.matrix, self.load - self.matrix.T @ x
        rows = m.indptr.astype(np.int64), m.indices.astype(np.int32), m.data
        drawn = _core.gibbs(*rows, self.slope, x, net, seed, moves, thin)
        return drawn.draws, drawn.last


def _chain_of(equilibrium: Equilibrium, spread: Floats, scale: float) -> _Chain:
    """Gibbs sampling where all balances may be open, flights where they are exact."""
    counts, u = np.isfinite(spread), len(equilibrium.contact)
    slope = float(np.isfinite(scale))
    size = scale if slope else float(np.abs(equilibrium.load).max(initial=0.0)) or 1.0
    if (spread > 0).all():
        matrix = csr_array(equilibrium.matrix[:, counts] * (size / spread[counts]))
        if not slope and (matrix.power(2).sum(1) == 0).any():
            raise ValueError(NO_END)
        load = equilibrium.load[counts] / spread[counts]
        return _Chain(equilibrium, size, slope, np.arange(u), np.full(u, 0.5), 0.0, matrix, load)
    if (counts & (spread > 0)).any():
        raise ValueError("spread: all balances exact, or none. Infinite ones may be beside both")
    chosen, middle = _interior(equilibrium, counts, size)
    some, rows = equilibrium.contacts.select(equilibrium.contact[chosen]), csr_array(equilibrium.matrix[chosen] * counts)
    factor = factorise(some, equilibrium.bodies, rows)
    loose = undetermined_rows(factor)
    if loose.sum() > MOST_LOOSE:
        raise ValueError(f"contacts: {loose.sum()} loose forces. At most {MOST_LOOSE} are sampled")
    if not slope:
        stress = maximise(np.ones(len(chosen)), csc_array(rows.T), np.zeros(len(counts)), 1.0).point
        if stress.max(initial=0.0) > NO_SPREAD:
            raise ValueError(NO_END)
    projector = np.ascontiguousarray(factor.self_stress(np.eye(len(chosen))[:, loose])[loose])
    fixed = equilibrium.sums[:, chosen[~loose]] @ (size * middle[~loose])
    return _Chain(equilibrium, size, slope, chosen[loose], middle[loose], fixed, projector=projector)


def _interior(equilibrium: Equilibrium, exact: Mask, size: float) -> tuple[Indices, Floats]:
    """The unknowns that are more than 0 in some state with exact balances, and a state where all of
    them are, in units of `size`."""
    balance, load = csc_array(equilibrium.matrix[:, np.flatnonzero(exact)].T), equilibrium.load[exact] / size
    chosen = every = np.arange(len(equilibrium.contact))
    if not equilibrium.complete:
        try:
            point = maximise(np.zeros(len(every)), balance, load).point
        except ProgramError as error:
            raise ValueError(f"load: no forces that push balance it ({error})") from None
        chosen = np.flatnonzero(carrying(point, every, balance))
    inner = csc_array(balance[:, chosen])
    both = csc_array(hstack([inner, csc_array(np.asarray(inner.sum(1)).reshape(-1, 1))]))
    upper = np.append(np.full(len(chosen), np.inf), 1.0)
    found = maximise(np.append(np.zeros(len(chosen)), 1.0), both, load, upper).point
    return chosen, found[:-1] + found[-1]
