"""What models predict for inner forces from the loads on the boundary alone, and how far the measured
forces are from equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from analysis.studies.measured.packing import Packing
from analysis.studies.measured.scores import BAND, Scores, bands, score
from analysis.support.parallel import Progress
from nscd import ContactLaw, solve
from nscd.arrays import Floats
from nscd.indeterminacy.ensemble import Ensemble, ensemble
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.nearest import least_energy_within, nearest

# Shares of the mean force f that balances are open by: standard deviation of inner and of boundary
# disks, and the most of inner disks where the nearest admissible state is sought.
INNER, EDGE, TOLERANCE = 0.08, 0.16, 0.08
OVERLAP = 3.5 / 19  # in units of the smallest radius, of disks whose gap is 0
FRICTIONS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)
SOLVER_TOLERANCE = 1e-6
FEWEST = 10  # inner contacts with a force, to be scored
SAMPLING = {"chains": 2, "draws": 400, "most_sweeps": 32_000}
# Laws that are tried, by scale and openness of inner balances (f), and the largest model error (f).
LAWS = (1.0, INNER), (3.0, INNER), (1.0, 0.4), (3.0, 0.4), (1.0, 1.2), (1.0, 1.6)
MOST_ERROR = 4.0


class Prediction(NamedTuple):
    """Hold forces (k,) N that a model predicts, what its solver says, and the scores."""

    force: Floats
    status: str
    scores: Scores


class Distance(NamedTuple):
    """Hold how far forces are from the nearest admissible state, and what its solver says.

    rms: in σ, over contacts with a force"""

    rms: float
    status: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """Hold a step: its packing, the predictions by name, and by friction the distance of the measured
    forces, and of the same ones shuffled."""

    packing: Packing
    predictions: dict[str, Prediction]
    distance: dict[float, Distance]
    shuffled: dict[float, Distance]


def equilibrium(packing: Packing, friction: float) -> Equilibrium:
    """Pose the balance of all disks under the loads of the boundary."""
    disks, among = packing.snapshot, packing.contacts
    values = disks.position, disks.radius, np.column_stack([among.first, among.second])
    return Equilibrium.of_disks(*values, packing.loads, friction=friction)


def open_by(packing: Packing, inner: float, edge: float) -> Floats:
    """Give (n,3) N, what the balances of inner disks and of boundary disks may be open by; the torque
    of a boundary disk is not known."""
    row = np.array([[inner, inner, inner], [edge, edge, np.inf]])
    return np.asarray(row[packing.boundary.astype(int)])


def sampled(packing: Packing, friction: float, scale: float, inner: float, seed: int) -> Ensemble:
    """Sample the admissible states; scale and inner: of the law and of open balances, in units of f."""
    f, balance_of = packing.scale, equilibrium(packing, friction)
    spread = open_by(packing, inner * f, max(EDGE, inner) * f)
    return ensemble(balance_of, scale * f, spread, seed=seed, **SAMPLING)


def judge(packing: Packing, friction: float, seed: int = 0) -> Step:
    """Predict a step by every model, and find how far its forces are from equilibrium; friction: μ of
    the disks, beside which 0 is tried too."""
    f, force, k = packing.scale, packing.force, len(packing.contacts)
    if packing.carries.sum() < FEWEST or not f > 0:
        raise ValueError(
            f"{packing.name}: {packing.carries.sum()} forces inside, mean force {f:.3g} N from the "
            f"boundary. At least {FEWEST} forces and loads that press are needed"
        )
    deep = np.maximum(OVERLAP * packing.snapshot.radius.min() - packing.contacts.gap, 0.0)
    found = {
        "shuffled": (np.random.default_rng(seed).permutation(force), ""),
        "mean field": (np.full(k, f), ""),
        "overlap": (deep * f / deep.mean(), ""),
    }
    disks = packing.snapshot
    left = packing.loads / disks.mass[:, None]  # τ = 1 s, so that percussions are forces
    for mu in dict.fromkeys((0.0, friction)):
        rigid = solve(
            disks, packing.contacts, left_velocity=left, law=ContactLaw(friction=mu),
            tolerance=SOLVER_TOLERANCE,
        )  # fmt: skip
        found[f"percussions, μ = {mu:g}"] = rigid.reaction, rigid.status.value
    spread = open_by(packing, INNER * f, EDGE * f)
    soft = least_energy_within(equilibrium(packing, friction), spread=spread)
    found[f"least energy, μ = {friction:g}"] = soft.normal, soft.status
    for mu in dict.fromkeys((0.0, friction)):
        some = sampled(packing, mu, 1.0, INNER, seed)
        found[f"ensemble, μ = {mu:g}"] = some.mean(), some.status
    return Step(
        packing=packing,
        predictions={name: Prediction(*one, score(packing, one[0])) for name, one in found.items()},
        distance={mu: distance(packing, mu) for mu in sorted({*FRICTIONS, friction})},
        shuffled={mu: distance(packing, mu, seed) for mu in (0.0, friction)},
    )


def distance(packing: Packing, friction: float, shuffle: int | None = None) -> Distance:
    """Find how far the measured forces are from the nearest state in which inner disks are in balance;
    shuffle: seed of a permutation of these forces first."""
    order, observed = np.arange(len(packing.contacts)), np.flatnonzero(packing.force)
    if shuffle is not None:
        order[observed] = np.random.default_rng(shuffle).permutation(observed)
    force, sigma = packing.force[order], packing.sigma[order]
    allowed = open_by(packing, TOLERANCE * packing.scale, np.inf)
    near = nearest(equilibrium(packing, friction), force, sigma, allowed)
    distance = np.hypot(near.normal - force, near.tangential) / sigma
    return Distance(float(np.sqrt((distance[observed] ** 2).mean())), near.status)


class Law(NamedTuple):
    """Hold a law of the ensemble, in units of f, and what its bands of 90 % hold: of pairs that carry on
    the steps that chose the model error, and on the others; of contacts where nothing was detected.
    width: mean, over the mean measured force."""

    scale: float
    inner: float
    error: float
    used: float
    unseen: float
    none: float
    width: float


def calibrate(packings: Sequence[Packing], friction: float, progress: Progress) -> list[Law]:
    """Try laws on all steps; the last row is the first law with the least model error whose bands hold
    90 % on the first, third, … step."""
    found: list[Law] = []
    first: list[Floats] = []
    for number, (scale, inner) in enumerate(LAWS):
        draws = []
        for index, packing in enumerate(packings):
            progress("laws", (number + index / len(packings)) / len(LAWS))
            drawn = sampled(packing, friction, scale, inner, index).draws
            draws.append(drawn.reshape(-1, drawn.shape[2])[:, : len(packing.contacts)])
        first = first or draws
        found.append(_scored(packings, draws, scale, inner, 0.0))
    for error in np.arange(0.1, MOST_ERROR, 0.1).round(1).tolist():
        widened = _scored(packings, first, *LAWS[0], error)
        if widened.used >= BAND:
            break
    return [*found, widened]


def _scored(
    packings: Sequence[Packing], draws: Sequence[Floats], scale: float, inner: float, error: float
) -> Law:
    every = zip(packings, draws, strict=True)
    collected = np.array([bands(packing, some, error * packing.scale) for packing, some in every])
    unseen = collected[1::2, 0].mean() if len(collected) > 1 else np.nan
    return Law(scale, inner, error, collected[::2, 0].mean(), unseen, *collected[:, 1:].mean(0))
