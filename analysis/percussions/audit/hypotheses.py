"""What may be wrong with forces that do not balance momentum. Each hypothesis is a fit with a residual."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array, hstack
from scipy.sparse.linalg import lsqr

from analysis.percussions.audit.record import Record
from nscd.arrays import Floats, Mask

WORDS = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
# Frames after the start of an interval at which its forces may be listed, and at which they should be.
SHIFTS, NOW = (0.5, 0.0, 1.0, -0.5, -1.0, 1.5, 2.0), (0.0, 0.5, 1.0)
# A factor is that of a hypothesis within this, of units and times within the second (forces change between
# frames), of a number of substeps where few other factors are as near, or five residuals. Hypotheses explain alike
# whose residuals are within a factor, or rounding. What rows show goes before a general fault that explains the same.
SAME_FACTOR, NEARLY, SUBSTEPS, ALIKE, ROUNDING, MOST_SUBSTEPS = 1e-4, 3e-3, 0.01, 3.0, 1e-4, 64
SHOWN = (("order", "signs of contacts"), ("both directions", "one side"), ("both directions", "substeps"),
         ("contact points", "substeps"))  # fmt: skip
# Faults of which forces are none, whatever the factor.
WRONG_FORCES = {"sign", "one side", "signs of contacts", "axes", "contact points", "both directions", "order"}
# Faults beside which contacts that pull are looked for, and their share of the squares of all forces at most.
TURNED, MOST_PULLING = {"sign", "units", "impulse", "substeps", "factor", "signs of contacts"}, 0.02
# Where rows are missing, bodies with all of theirs need this share of all, in so many numbers at least, and
# the others have this share of the residual.
LEFT, FEWEST, ELSEWHERE = 0.01, 8, 0.9
# Tangential parts below this share are rounding. Of so many contacts those that are not listed are looked
# for, where equations are more than unknowns by this share.
ALONG, MOST_ROWS, SPARE = 1e-3, 2_000, 0.1


class Fit(NamedTuple):
    """Hold a hypothesis: true forces are `factor` times those listed, `shift` frames after the start of an
    interval, changed as `faults` (name → words) say; `residual` of what is needed is not explained."""

    faults: dict[str, str]
    factor: float
    shift: float
    residual: float

    @property
    def name(self) -> str:
        """Name what is wrong."""
        return ", ".join(self.faults) or "as listed"

    def plus(self, faults: dict[str, str], **values: float) -> Fit:
        """Add faults to it."""
        return self._replace(faults=self.faults | faults, **values)


def fault(name: str, key: str = "", **values: Any) -> dict[str, str]:
    """Give a fault and its words, those of another key where there are several."""
    return {name: WORDS["faults"][key or name].format(**values)}


def percent(fraction: float) -> str:
    """Write a share for a message."""
    return f"{100 * fraction:.3g} %" if fraction >= 1e-9 else "0 %"


def variants(record: Record) -> Iterator[tuple[dict[str, str], Floats]]:
    """Give the sums (f,n,2) N of forces as they are listed, and changed as a hypothesis has it."""
    force, first, second, n = record.force, record.first, record.second, record.momentum.shape[1] + 1
    pairs, none = second >= 0, 0.0 * force
    yield {}, record.sums(force)
    if pairs.any():
        yield fault("one side", end="first"), record.sums(none, -force)
        yield fault("one side", end="second"), record.sums(force, np.where(pairs[:, None], none, -force))
    along = np.nan_to_num((force * record.normal).sum(axis=1))
    pulls, fraction = along < 0, (along < 0).sum() / max(1, np.count_nonzero(along))
    if 0 < fraction < 1:
        turned = fault("signs of contacts", share=percent(min(fraction, 1 - fraction)))
        yield turned, record.sums(np.where(pulls[:, None], -force, force))
    yield fault("axes"), record.sums(force[:, ::-1])
    back = pairs & (first > second)
    key = (record.frame * n + np.minimum(first, second)) * n + np.maximum(first, second)
    _, of, count = np.unique(key, return_inverse=True, return_counts=True)
    if (pairs & (count[of] > 1)).any():
        both = back.any() and np.isin(key[back], key[pairs & ~back]).mean() > ELSEWHERE
        merged = force / np.where(pairs, count[of], 1)[:, None]
        yield fault("both directions" if both else "contact points"), record.sums(merged)
    if (back & (count[of] == 1)).any() and (pairs & ~back).any():
        yield fault("order"), record.sums(np.where(back[:, None], -force, force))


def factors(record: Record, time_step: float | None) -> list[tuple[float, dict[str, str]]]:
    """Give the factors from listed to true forces that hypotheses have, with their faults."""
    found = [(float(unit), fault("units", what=words)) for unit, words in WORDS["units"].items()]
    steps = {float(np.median(record.durations)), time_step or 0.0} - {0.0}
    for h in steps:
        for power, key in ((-1, "impulse"), (1, "impulse over time"), (-2, "impulse times time")):
            found.append((h**power, fault("impulse", key, h=h)))
    found += [(c / h, fault("impulse", h=h) | other) for h in steps for c, other in found if "units" in other]
    for n in range(2, MOST_SUBSTEPS + 1):
        found += [(1.0 * n, fault("substeps", n=n)), (1 / n, fault("substeps", "substeps summed", n=n))]
    return found


def meanings(
    factor: float, residual: float, named: list[Any], signed: bool = True
) -> list[tuple[dict[str, str], float]]:
    """Give what a factor may mean: faults, and the exact factor of each; substeps, and a unit and a time at
    once, where nothing else is. signed: see `Record`."""
    way, near = float(np.sign(factor) or 1.0), max(SAME_FACTOR, 5 * residual)
    turned = fault("sign") if factor < 0 and signed else {}
    if abs(abs(factor) - 1) <= max(near, NEARLY):
        return [(turned, way)]
    found = []
    for c, one in named:
        width = min(SUBSTEPS / max(c, 1 / c), NEARLY) if "substeps" in one else NEARLY
        if abs(abs(factor) / c - 1) <= max(near, width):
            found.append((turned | one, way * c))
    found = [each for each in found if _weight(each[0]) - len(turned) < 2] or found
    return found or [(turned | fault("factor", factor=1 / abs(factor)), factor)]


def _weight(faults: dict[str, str]) -> int:
    """Count faults; substeps, of which there may be any number, count twice."""
    return len(faults) + ("substeps" in faults)


def at_shift(record: Record, sums: Floats, shift: float) -> tuple[Floats, Mask]:
    """Take the forces (i,n,2) N listed at a shift, and which intervals have them."""
    at, last = np.arange(len(record.durations)) + record.moved + shift, len(sums) - 1
    early, late = (each(at).astype(int).clip(0, last) for each in (np.floor, np.ceil))
    return 0.5 * (sums[early] + sums[late]), (at >= 0) & (at <= last)


def fit_all(record: Record, named: list[Any], keep: Mask | None = None, of: Any = None) -> list[Fit]:
    """Fit every variant, or those `of` a list, at every shift by least squares of impulses, the best first;
    of the bodies and intervals (i,n) to keep. named: see `factors`."""
    needed, weight, found = record.needed(), record.durations[:, None, None], []
    here, options = ~np.isnan(needed).any(axis=2) & (True if keep is None else keep), [*(of or variants(record))]
    for shift in SHIFTS:
        some = here & at_shift(record, options[0][1], shift)[1][:, None]
        a = (weight * needed)[some].ravel()
        if len(a) < (FEWEST if keep is not None else 1) or not a.any():
            continue
        for faults, sums in options:
            b = (weight * at_shift(record, sums, shift)[0])[some].ravel()
            if not b.any():
                continue
            size, factor = float(np.linalg.norm(a)), float(a @ b / (b @ b))
            late = {} if shift in NOW else fault("step before" if shift > 1 else "step after")
            for more, exact in meanings(factor, float(np.linalg.norm(a - factor * b)) / size, named, record.signed):
                if exact > 0 or "signs of contacts" not in faults:
                    left = float(np.linalg.norm(a - exact * b)) / size
                    found.append(Fit(faults | more | late, exact, shift, left))
    return sorted(found, key=lambda fit: fit.residual)


def chosen(fits: list[Fit], within: float) -> list[Fit]:
    """Take of the fits that explain what is needed those with the fewest faults, each words once. A factor
    that nothing has is taken alone, of forces that are else as they are listed, if it explains far more."""
    good = [fit for fit in fits if fit.residual <= within and "factor" not in fit.faults]
    plain = [fit for fit in fits if fit.residual <= within and {*fit.faults} <= {"factor", "sign"}][:1]
    if not good or (plain and good[0].residual > max(ALIKE * plain[0].residual, ROUNDING)):
        return plain
    alike = [fit for fit in good if fit.residual <= max(ALIKE * good[0].residual, ROUNDING)]
    fewest = min(_weight(fit.faults) for fit in alike)
    named = {(*fit.faults.values(),): fit for fit in reversed(alike) if _weight(fit.faults) == fewest}
    for shown, general in SHOWN:
        if any(shown in one.faults for one in named.values()):
            named = {words: one for words, one in named.items() if general not in one.faults}
    return sorted(named.values(), key=lambda fit: fit.residual)


def with_rows_missing(
    record: Record, named: list[Any], within: float, of: Any = None
) -> Iterator[tuple[list[Fit], list[Fit]]]:
    """Fit the bodies that touch no wall, and no other body, without a row at both ends of an interval, or
    around it, see `fit_all`: the fits, and those that explain all but the others. Then tangential forces
    that are not listed."""
    needed, sums, (lone, on_wall) = record.needed(), record.sums(record.force), record.unlisted
    of = of or [*variants(record)]
    cases = [("walls missing", on_wall), ("contacts missing", lone | on_wall)]
    for width, name, missing in ((wide_case, *case) for wide_case in (0, 1) for case in cases):
        around, good = np.pad(missing, ((width, 3 * width), (0, 0))), []
        near = np.lib.stride_tricks.sliding_window_view(around, 2 + 2 * width + record.moved, axis=0).any(axis=-1)
        keep: Mask = ~np.asarray(near)[: len(needed)]
        fits = fit_all(record, named, keep, of) if not keep.all() else []
        fits = [one for one in fits if width or one.shift in NOW]
        for one in chosen(fits, within):
            values, here = at_shift(record, sums, one.shift)
            off, all_ = (np.nan_to_num(x)[here] ** 2 for x in (needed - one.factor * values, needed))
            enough = all_[keep[here]].sum() >= LEFT * all_.sum() and values[here][keep[here]].any()
            if enough and off[~keep[here]].sum() >= ELSEWHERE * off.sum():
                good.append(one.plus(fault(name)))
        yield [one.plus(fault(name)) for one in fits[:5]], good
    extra = [fit for shift in NOW if (fit := _with_tangential(record, shift))]
    for best in sorted(extra, key=lambda fit: fit.residual)[:1]:
        fits = [best.plus(more, factor=exact) for more, exact in meanings(best.factor, best.residual, named, record.signed)]
        yield fits, fits if best.residual <= within and "factor" not in fits[0].faults else []


def with_signs(record: Record, fits: list[Fit]) -> list[tuple[dict[str, str], Floats]]:
    """Turn contacts, from the best fit in which all push, one after the other on each body, while that explains
    more: those of dashpots that pull. The sums of these, nothing if this turns many or explains little."""
    best = next((fit for fit in fits if "signs of contacts" in fit.faults and {*fit.faults} <= TURNED), None)
    if best is None or record.moved:
        return []
    (f, n, _), needed = record.momentum.shape, np.nan_to_num(record.needed()) / best.factor
    size, pair = (record.force**2).sum(axis=1), record.second >= 0
    body = record.frame[:, None] * n + np.column_stack([record.first, np.where(pair, record.second, record.first)])
    pulls = np.nan_to_num((record.force * record.normal).sum(axis=1)) < 0
    spans, way, left, idle = sorted({math.floor(best.shift), math.ceil(best.shift)}), pulls, [], 0
    while idle < len(spans):
        force = np.where(way[:, None], -record.force, record.force)
        inputs, good = at_shift(record, record.sums(force), best.shift)
        rest, gain, maximum = np.where(good[:, None, None], needed - inputs, 0.0), np.zeros(len(force)), np.zeros(f * n)
        left.append(float(np.linalg.norm(rest)))
        for at in (record.frame - span for span in spans):  # the intervals that have these forces
            here = (at >= 0) & (at < len(rest))
            off = rest[at * here, record.second] * pair[:, None] - rest[at * here, record.first]
            gain -= here * ((off * force).sum(axis=1) + (1 + pair) * size / len(spans))
        gain[np.isnan(record.normal[:, 0]) | ((record.frame + len(left)) % len(spans) > 0)] = 0.0
        np.maximum.at(maximum, body, gain[:, None])
        turn = (gain > 0) & (gain >= maximum[body].max(axis=1))  # of frames and bodies that share no equation
        way, idle = way ^ turn, 0 if turn.any() else idle + 1
    if left[-1] > left[0] / ALIKE or size[way ^ pulls].sum() > MOST_PULLING * size.sum():
        return []
    fraction = float(way.mean())
    return [(fault("signs of contacts", share=percent(min(fraction, 1 - fraction))), record.sums(force))]


def _with_tangential(record: Record, shift: float) -> Fit | None:
    """Fit a tangential force to each contact listed with its normal part only, from momentum and spins of
    the first frames. None where a pair has another part, or equations are too few."""
    f, n, _ = record.momentum.shape
    across = record.normal[:, :1] * record.force[:, 1:] - record.normal[:, 1:] * record.force[:, :1]
    maximum = int(np.searchsorted(np.cumsum(np.bincount(record.frame, minlength=f)), MOST_ROWS))
    turned = 0.5 * np.diff(record.turning, axis=0)[:maximum] / record.durations[:maximum, None]  # N, of discs
    largest, pairs = float(np.abs(record.force).max()), record.second >= 0
    lone = np.abs(across[:, 0]) <= ALONG * largest
    if record.moved or not np.nan_to_num(turned).any() or not (pairs.any() and lone[pairs].all()):
        return None
    a = np.concatenate([record.needed()[:maximum], turned[..., None]], axis=2)
    here, torque = ~np.isnan(a.ravel()), -np.nan_to_num(across) / largest
    sums = np.concatenate([record.sums(record.force / largest), record.sums(torque, torque)], axis=2)
    tangent = np.column_stack([-record.normal[:, 1], record.normal[:, 0]])
    columns, unknown = [coo_array(at_shift(record, sums, shift)[0][:maximum].reshape(-1, 1))], 0
    for early in (0, 1) if shift == 0.5 else (int(shift),):
        at = record.frame - early
        for position, sign in ((record.first, -1.0), (record.second, 1.0)):
            who = np.flatnonzero(lone & (at >= 0) & (at < len(a)) & (position >= 0))
            row, unknown = (at[who] * n + position[who]) * 3, max(unknown, len(who))
            for axis, value in enumerate((*(sign * tangent[who].T), -np.ones(len(who)))):
                columns.append(coo_array((value, (row + axis, who)), shape=(a.size, len(at))))
    if (spare := int(here.sum()) - unknown - 1) < SPARE * here.sum():
        return None
    matrix = hstack([columns[0], sum(columns[2:], columns[1])]).tocsr()[here]
    x, _, _, left, *_ = lsqr(matrix, a.ravel()[here], atol=1e-7, btol=1e-7, iter_lim=200)
    fraction = float(left / np.sqrt(spare) / np.sqrt((a.ravel()[here] ** 2).mean()))
    return Fit(fault("normal part only"), float(x[0] / largest), shift, fraction)
