"""What may be wrong with forces that do not balance momentum: each hypothesis is a fit with its
residual."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, hstack
from scipy.sparse.linalg import lsqr

from analysis.audit.motion import Record
from nscd.arrays import Flags, Floats

# Frames by which forces may be late; an engine says its forces before a step, after it, or as means.
SHIFTS, NOW = (0.5, 0.0, 1.0, -0.5, -1.0, 1.5, 2.0), (0.0, 0.5, 1.0)
# A factor is one that is named if it is within this, or three times the residual.
SAME_FACTOR = 1e-4
# Hypotheses explain alike if their residuals are within this factor, or below what is rounding.
ALIKE, ROUNDING = 3.0, 1e-7
# What the order of rows shows goes before the general fault that explains the same.
SHOWN = (("order", "signs of contacts"), ("both directions", "one side"))
# Of what is needed so large a share must be at the bodies that are left, and of the residual at the others.
LEFT, ELSEWHERE = 0.01, 0.9
# Tangential parts below this share are rounding. So many contacts are looked at for those that are not
# listed, and such a share of equations must be more than unknowns.
ALONG, MOST_ROWS, SPARE, MOST_SUBSTEPS = 1e-3, 2_000, 0.1, 64
UNITS = {1e-3: "masses in g or lengths in mm, not kg and m", 1e-2: "lengths in cm, not m",
         1e-5: "dyn, not N", 1e-6: "masses in g and lengths in mm, not kg and m"}  # fmt: skip


class Fit(NamedTuple):
    """Hold a tested hypothesis: the true forces are `factor` times those listed, changed as `faults` say.

    faults: what is wrong, by name, and in words; none where forces are as they should be
    shift: frames after the start of an interval at which the forces are listed
    residual: what stays unexplained, as a share of what is needed"""

    faults: Mapping[str, str]
    factor: float
    shift: float
    residual: float

    @property
    def name(self) -> str:
        """Name what is wrong."""
        return " and ".join(self.faults) or "as listed"


def variants(record: Record, shape: tuple[int, ...]) -> Iterator[tuple[dict[str, str], Floats]]:
    """Give the sums (f,n,2) N of the forces as they are listed, and changed as each hypothesis has it."""
    rows, force = record.rows, record.rows.force
    yield {}, rows.sums(shape, force)
    pairs = rows.second >= 0
    if pairs.any():
        for end, other in (("first", "second"), ("second", "first")):
            words = f"of each pair only the {end} gets its force: that on the {other} is not true"
            yield {"one side": words}, rows.sums(shape, force, end)
    along = np.nan_to_num((force * rows.normal).sum(axis=1))
    pulls = along < 0
    share = pulls.sum() / max(1, np.count_nonzero(along))
    if 0 < share < 1:
        pushed = np.where(pulls[:, None], -force, force)
        words = f"the sign is turned in {min(share, 1 - share):.2%} of the contacts or more"
        yield {"signs of contacts": words}, rows.sums(shape, pushed)
        yield {"signs of contacts": words}, rows.sums(shape, np.where(pulls[:, None], force, -force))
    yield {"axes": "fx and fy are exchanged"}, rows.sums(shape, force[:, ::-1])
    turned = pairs & (rows.first > rows.second)
    low, high = np.where(turned, rows.second, rows.first), np.where(turned, rows.first, rows.second)
    key = (rows.frame * shape[1] + low) * (shape[1] + 1) + high
    _, of, count = np.unique(key, return_inverse=True, return_counts=True)
    times = np.where(pairs, count[of], 1)
    if (times > 1).any():
        both = len(np.unique(key[turned])) and np.isin(key[turned], key[pairs & ~turned]).mean() > 0.9
        name, words = "contact points", "the rows of several contact points have the whole force each"
        if both:
            name, words = "both directions", "each pair is listed in both directions, with its force in each"
        yield {name: words}, rows.sums(shape, force / times[:, None])
    if (turned & ~np.isin(key, key[pairs & ~turned])).any():
        words = "the force is that on the body of the larger id, in whichever order ids are listed"
        yield {"order": words}, rows.sums(shape, np.where(turned[:, None], -force, force))


def factors(record: Record, time_step: float | None, substeps: int | None) -> dict[float, tuple[str, str]]:
    """Give the factors that have a name, and what they then mean."""
    found: dict[float, tuple[str, str]] = {}
    for h in {float(np.median(record.durations)), time_step or 0.0} - {0.0}:
        found[1 / h] = "impulse", f"they are impulses (N·s) over {h:.6g} s, not forces"
        found[h] = "impulse", f"they are divided by {h:.6g} s once too often"
        found[1 / h**2] = "impulse", f"they are multiplied by the square of {h:.6g} s"
    for unit, words in UNITS.items():
        found[unit] = "units", words
        found[1 / unit] = "units", f"the bodies have {words}"
    for n in (substeps,) if substeps else range(2, MOST_SUBSTEPS + 1):
        why = "as of substeps or of contact points" + (", or of both directions" if n == 2 else "")
        why = f"as of {n} substeps" if substeps else why
        found.setdefault(1.0 * n, ("substeps", f"they are {n} times too small, {why}"))
        found.setdefault(1 / n, ("substeps", f"they are {n} times too large, {why}"))
    return found


def at_shift(record: Record, sums: Floats, shift: float, intervals: int) -> tuple[Floats, Flags]:
    """Take the forces (i,n,2) N of a shift, and which intervals have them."""
    at = np.arange(intervals) + record.base + shift
    good, last = (at >= 0) & (at <= len(sums) - 1), len(sums) - 1
    early, late = np.floor(at).astype(int).clip(0, last), np.ceil(at).astype(int).clip(0, last)
    return 0.5 * (sums[early] + sums[late]), good


def fit_all(
    record: Record, named: Mapping[float, tuple[str, str]], keep: Flags | None = None
) -> list[Fit]:
    """Fit every variant at every shift, by least squares of impulses. The best is first.

    named: see `factors`; keep: (i,n) the bodies and intervals that count"""
    needed, weight = record.needed(), record.durations[:, None, None]
    shape, found = (len(record.times), len(record.ids)), []
    here = ~np.isnan(needed).any(axis=2) & (True if keep is None else keep)
    for faults, disks in variants(record, shape):
        sums = record.joined(disks)
        for shift in SHIFTS:
            given, good = at_shift(record, sums, shift, len(needed))
            some = here & good[:, None]
            a, b = (weight * needed)[some].ravel(), (weight * given)[some].ravel()
            if not (some.any() and a.any() and b.any()):
                continue
            factor = float(a @ b / (b @ b))
            residual = float(np.linalg.norm(a - factor * b) / np.linalg.norm(a))
            late = {} if shift in NOW else {"step": _late(shift)}
            for more, exact in meanings(factor, residual, named):
                if "signs of contacts" in faults and exact < 0:
                    continue
                left = float(np.linalg.norm(a - exact * b) / np.linalg.norm(a))
                found.append(Fit(faults | more | late, exact, shift, max(left, residual)))
    return sorted(found, key=lambda fit: fit.residual)


def _late(shift: float) -> str:
    return "they are those of the step before" if shift > 1 else "they are those of the step after"


def meanings(
    factor: float, residual: float, named: Mapping[float, tuple[str, str]]
) -> list[tuple[dict[str, str], float]]:
    """Give what a factor may mean: faults, and the exact factor of each."""
    turned = {"sign": "the sign is turned"} if factor < 0 else {}
    size, way = abs(factor), np.sign(factor) or 1.0
    near = max(SAME_FACTOR, 3 * residual)
    if abs(size - 1) <= near:
        return [(turned, float(way))]
    every = [(one, what) for one, what in named.items() if abs(size / one - 1) <= near]
    found = [(turned | {name: words}, float(way * one)) for one, (name, words) in every]
    return found or [(turned | {"factor": f"the factor to the true forces is {factor:.4g}"}, factor)]


def chosen(fits: list[Fit], within: float) -> list[Fit]:
    """Take of the fits that explain what is needed those with the fewest faults, one a name."""
    good = [fit for fit in fits if fit.residual <= within and "factor" not in fit.faults]
    if not good:
        return []
    most = max(ALIKE * good[0].residual, ROUNDING)
    alike = [fit for fit in good if fit.residual <= most]
    fewest = min(len(fit.faults) for fit in alike)
    names = {fit.name: fit for fit in reversed(alike) if len(fit.faults) == fewest}
    for shown, general in SHOWN:
        if any(shown in one.faults for one in names.values()):
            names = {name: one for name, one in names.items() if general not in one.faults}
    return sorted(names.values(), key=lambda fit: fit.residual)


def without(record: Record, needed: Floats) -> dict[str, Flags]:
    """Give which bodies and intervals (i,n) are left without those that touch what has no row: a wall,
    another body, either."""
    pairs, walls = record.unlisted()
    kept = {}
    for name, open_ in (("walls missing", walls), ("contacts missing", pairs | walls)):
        if record.body is not None:
            open_ = record.joined(np.repeat(open_[..., None], 2, axis=2).astype(float))[..., 0] > 0
        around = np.pad(open_, ((1, 3), (0, 0)))
        near = np.lib.stride_tricks.sliding_window_view(around, 4 + record.base, axis=0).any(axis=-1)
        kept[name] = ~near[: len(needed)]
    return kept


def elsewhere(record: Record, fit: Fit, keep: Flags, sums: Floats) -> bool:
    """Tell whether what a fit leaves unexplained is at the bodies that are not kept, and enough is
    needed at those kept."""
    needed = record.needed()
    given, good = at_shift(record, sums, fit.shift, len(needed))
    off = np.nan_to_num(needed - fit.factor * given)[good] ** 2
    all_, mine = np.nan_to_num(needed)[good] ** 2, keep[good]
    enough = all_[mine].sum() >= LEFT * all_.sum() and np.count_nonzero(given[good][mine]) >= 8
    return bool(enough and off[~mine].sum() >= ELSEWHERE * off.sum())


def with_tangential(record: Record) -> Fit | None:
    """Fit a tangential force to each contact that is listed with its normal part only, from momentum and
    spins of the first frames. None where a listed force has a tangential part, or equations are too few."""
    rows, (f, n) = record.rows, record.spin.shape
    tangent = np.column_stack([-rows.normal[:, 1], rows.normal[:, 0]])
    across = np.abs((rows.force * tangent).sum(axis=1))
    if not across.max(initial=0.0) <= ALONG * np.abs(rows.force).max(initial=0.0):
        return None
    most = int(np.searchsorted(np.cumsum(np.bincount(rows.frame, minlength=f)), MOST_ROWS))
    spun, some = np.diff(record.spin, axis=0)[:most], rows.frame <= most
    if record.moved or record.body is not None or not np.nan_to_num(spun).any():
        return None
    torque = 0.5 * record.mass * record.radius * spun / record.durations[:most, None]  # over r: N
    a = np.concatenate([record.needed()[:most], torque[..., None]], axis=2)
    here, frame, tangent = ~np.isnan(a.ravel()), rows.frame[some], tangent[some]
    sums, best = rows.sums((f, n), rows.force), None
    scale = float(np.abs(rows.force).max())
    for shift in NOW:
        given, _ = at_shift(record, sums, shift, len(a))
        listed = np.concatenate([given / scale, np.zeros_like(a[..., :1])], axis=2).reshape(-1, 1)
        entries: list[tuple[Floats, ...]] = []
        for early in (0, 1) if shift == 0.5 else (int(shift),):
            for place, sign in ((rows.first[some], -1.0), (rows.second[some], 1.0)):
                good = (frame >= early) & (frame - early < len(a)) & (place >= 0)
                at, who = ((frame - early) * n + place)[good] * 3, np.flatnonzero(good)
                for axis, value in enumerate((*(sign * tangent[good].T), -np.ones(len(at)))):
                    entries.append((value, at + axis, who))
        value, row, of = (np.concatenate(one) for one in zip(*entries, strict=True))
        matrix = coo_array((value, (row, of)), shape=(a.size, len(frame))).tocsr()
        spare = int(here.sum()) - len(np.unique(of)) - 1
        if spare < SPARE * here.sum():
            return None
        x, _, _, left, *_ = lsqr(hstack([matrix, coo_array(listed)]).tocsr()[here], a.ravel()[here],
                                 atol=1e-9, btol=1e-9, iter_lim=500)  # fmt: skip
        share = float(left / np.sqrt(spare) / np.sqrt((a.ravel()[here] ** 2).mean()))
        if best is None or share < best.residual:
            words = "only the normal parts are listed: forces along the surfaces are missing"
            best = Fit({"normal part only": words}, float(x[-1] / scale), shift, share)
    return best
