"""The verdict: whether contact forces are those that the momentum of their bodies needs, or what they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any

import numpy as np

from analysis.percussions.audit import hypotheses as tested
from analysis.percussions.audit.hypotheses import WORDS, Fit, percent
from analysis.percussions.audit.record import External, Record, record_of
from nscd import Snapshot, Walls
from nscd.arrays import Floats

# What may stay unexplained of the force that is needed. From one interval to the next forces change by
# the second share where frames are too far apart. The third is rounding.
WITHIN, FAR, NOTHING = 0.05, 0.3, 1e-9
# Places that change for another factor than velocities say, by more than the second share, where the factor
# leaves less than the first.
ASTRAY, SURE = 0.1, 0.02
# Frames are all steps if they are a time step apart within this share.
SAME_STEP = 1e-3
# Torques below this share of forces times radii are not looked at.
TURNS = 1e-3
# Torques act at the radius less these shares of the overlap, of two bodies and of one with a wall.
ARMS = tuple((body, wall) for body in (0.0, 0.5) for wall in (0.0, 0.5, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Audit:
    """Hold a verdict.

    status: agrees, differs, or unknown where it cannot be judged; words: it as a sentence
    faults: what is wrong, by name; none where several hypotheses explain alike, or none does
    fits: the best of each hypothesis, the nearest first
    factor: from listed to true forces, where all that explain them have one
    residual: what forces as they are listed leave unexplained, as a share of what is needed
    smallest_fault: N, of the force on a body, that could be seen; remarks: other sentences
    needed, given: (i,n,2) N, what momentum needs and listed forces sum to, of each interval and body"""

    status: str
    words: str = ""
    faults: tuple[str, ...] = ()
    fits: tuple[Fit, ...] = ()
    factor: float = float("nan")
    residual: float = float("nan")
    smallest_fault: float = float("nan")
    remarks: tuple[str, ...] = ()
    needed: Floats = field(default_factory=lambda: np.zeros((0, 1, 2)))
    given: Floats = field(default_factory=lambda: np.zeros((0, 1, 2)))

    @property
    def exit_status(self) -> int:
        """Give 0 where forces agree, 1 where they do not, 2 where it cannot be judged."""
        return ("agrees", "differs", "unknown").index(self.status)

    def to_dict(self) -> dict[str, Any]:
        """Give the verdict for JSON."""
        own = {name: getattr(self, name) for name in ("status", "words", "faults", "factor", "residual", "remarks")}
        fits = [one._asdict() | {"faults": [*one.faults], "words": [*one.faults.values()]} for one in self.fits]
        return own | {"smallest_fault_N": self.smallest_fault, "hypotheses": fits}


def audit(
    snapshots: Sequence[Snapshot],
    contacts: Any,
    *,
    external: External = None,
    walls: Walls | None = None,
    friction: float | None = None,
    time_step: float | None = None,
    within: float = WITHIN,
) -> Audit:
    """Judge contact forces (N) by the momentum of their bodies.

    snapshots: of the bodies, with velocities, their times growing
    contacts: of each snapshot a table (mapping of arrays, pandas, EngineContacts) with first, second (ids),
        fx, fy or force (N, on the second), and is_wall where the second is none of the bodies; or one
        pandas table of all with a column time_s (s)
    external: N, all other forces: (n,2), (2,) for each, or a function of a snapshot; None: not known
    walls: by which bodies that touch a wall without a row are found
    friction: Coulomb's μ, to count forces outside its cone
    time_step: s, of the simulation: frames may be further apart, and if not, are known to be all steps
    within: share of the needed force that may stay unexplained

    Raises ValueError naming the frame and the row of a contact of nobody."""
    if hasattr(contacts, "columns"):
        when = np.asarray(contacts["time_s"], dtype=float)
        contacts = [contacts[np.isclose(when, one.time, rtol=1e-9, atol=1e-12)] for one in snapshots]
        if sum(map(len, contacts)) != len(when):
            raise ValueError("contacts: time_s: rows at instants of which there is no snapshot")
    record = record_of(snapshots, contacts, external, walls)
    every = time_step is not None and np.allclose(np.diff(record.times), time_step, rtol=SAME_STEP, atol=0.0)
    return judge(replace(record, every_step=every), friction, time_step, within)


def judge(
    record: Record, friction: float | None = None, time_step: float | None = None, within: float = WITHIN
) -> Audit:
    """Judge the contacts of a record, see `audit`."""
    needed = record.needed() if len(record.times) > 1 + record.moved else np.zeros((0, 1, 2))
    maximum, size = (float(np.abs(np.nan_to_num(x)).max(initial=0.0)) for x in (record.force, needed))
    still = size <= max(NOTHING * maximum, 0.0 if record.stated else record.noise)
    pace, left = record.pace
    why = "frames" if not len(needed) else "no force" if not maximum else "still" if still else ""
    if not why and left <= ASTRAY and abs(pace - 1) > 3 * left + SURE:
        # bodies that as good as rest only need what holds their weight, whatever their pace
        change = np.linalg.norm(np.nan_to_num(np.diff(record.momentum, axis=0)) / record.durations[:, None, None])
        changed = change * max(abs(pace), 1 / max(abs(pace), NOTHING))
        why = "pace" if changed > SURE * np.linalg.norm(np.nan_to_num(needed)) else ""
    if why:
        what = WORDS["reasons"][why].format(frames=2 + record.moved, pace=pace)
        return Audit(status="unknown", words=WORDS["unknown"].format(what=what))
    named = tested.factors(record, time_step)
    fits = tested.fit_all(record, named)
    found = tested.chosen(fits, within)
    if (not found or "signs of contacts" in found[0].faults) and (turned := tested.with_signs(record, fits)):
        fits = sorted([*fits, *tested.fit_all(record, named, of=turned)], key=lambda fit: fit.residual)
        found = tested.chosen(fits, within)
    for more, good in tested.with_rows_missing(record, named, within) if not found else ():
        fits, found = sorted([*fits, *more], key=lambda fit: fit.residual), good
        if found:
            break
    if found and not found[0].faults and found[0].residual > tested.ROUNDING and record.unlisted.any():
        listed: list[Any] = [({}, record.sums(record.force))]
        rows = tested.with_rows_missing(record, named, found[0].residual / tested.ALIKE, listed)
        found = next((good for _, good in islice(rows, 4) if good), found)
    shift = next((fit.shift for fit in (*found, *fits) if fit.shift in tested.NOW), 0.5)
    values, here = tested.at_shift(record, record.sums(record.force), shift)
    needed, values, weight = needed[here], values[here], record.durations[here][:, None, None]
    off, all_ = (np.linalg.norm(np.nan_to_num(weight * x)) for x in (needed - values, needed))
    best = {one.name: one for one in reversed([*fits, *found])}
    observed = (found[0].residual if found else 1.0) * float(np.sqrt(np.nanmean(needed**2)))
    verdict = Audit(
        status="unknown", fits=tuple(sorted(best.values(), key=lambda one: one.residual)),
        residual=float(off / (all_ or 1.0)), smallest_fault=max(record.noise, observed), needed=needed, given=values,
    )  # fmt: skip
    if not found:
        return _unexplained(verdict, record, within)
    faults, fraction = found[0].faults, percent(found[0].residual)
    one = np.ptp([fit.factor for fit in found]) <= tested.SAME_FACTOR * abs(found[0].factor)
    remarks, factor = tuple(_remarks(record, found[0], friction)), found[0].factor if one else float("nan")
    verdict = replace(verdict, remarks=remarks, factor=factor)
    if not faults:
        return replace(verdict, status="agrees", words=WORDS["agrees"].format(share=fraction))
    what = ". Or ".join(". Also ".join(one.faults.values()) for one in found)
    words = WORDS["alike" if len(found) > 1 else "differs"].format(what=what, share=fraction)
    return replace(verdict, status="differs", words=words, faults=tuple(faults) if len(found) == 1 else ())


def _unexplained(verdict: Audit, record: Record, within: float) -> Audit:
    """The verdict where no hypothesis explains what is needed: not judged for a reason, or different."""
    needed, why, values = record.needed(), "", {"noise": record.noise, "h": float(np.median(record.durations))}
    values["size"] = size = float(np.sqrt(np.nanmean(needed**2)))
    change, both = np.diff(needed, axis=0), np.abs(needed[1:]) + np.abs(needed[:-1])
    rest = (verdict.needed - verdict.given) / record.mass[:, None]
    values["x"], values["y"] = g = np.nanmean(rest, axis=(0, 1)).tolist()
    left, all_ = (np.linalg.norm(np.nan_to_num(x)) for x in (rest - g, rest))
    if record.noise > within * size:
        why = "digits"
    elif not record.stated:
        why = "acceleration" if left <= within * all_ else "external"
    elif not record.every_step and np.nansum(change**2) >= FAR**2 * np.nansum(both**2):
        why = "apart"
    if not why:
        return replace(verdict, status="differs", words=WORDS["unexplained"].format(share=percent(verdict.residual)))
    return replace(verdict, words=WORDS["unknown"].format(what=WORDS["reasons"][why].format(**values)))


def _remarks(record: Record, best: Fit, friction: float | None) -> list[str]:
    """Count contacts that pull, and those outside the friction cone, and hold spins against torques."""
    along, force = (record.force * record.normal).sum(axis=1), np.hypot(*record.force.T)
    finite, sentences = ~np.isnan(along) & (force > 0), []
    if finite.any() and "signs of contacts" not in best.faults and (pulls := float((best.factor * along[finite] < 0).mean())):
        sentences.append(WORDS["pull"].format(share=percent(pulls)))
    if friction is not None and finite.any():
        across = np.sqrt(np.maximum(force**2 - along**2, 0.0))
        out = float((across > 1.001 * friction * np.abs(along) + 1e-6 * force)[finite].mean())
        sentences += [WORDS["cone"].format(share=percent(out), friction=friction)] if out else []
    turned = np.diff(record.turning, axis=0)
    if record.moved or np.isnan(along).any() or {*best.faults} - {"sign", "impulse", "units", "substeps"}:
        return sentences
    torque = best.factor * (record.normal[:, 1] * record.force[:, 0] - record.normal[:, 0] * record.force[:, 1])[:, None]
    size, fits = np.linalg.norm(record.sums(record.force)) * abs(best.factor) * float(np.median(record.durations)), []
    for body, wall in ARMS:
        arms = torque * (1 - np.where(record.second < 0, wall, body)[:, None] * record.overlap)
        values, good = tested.at_shift(record, record.sums(arms[:, 1:], arms[:, :1]), best.shift)
        a, b = (values[..., 0] * record.durations[:, None])[good].ravel(), turned[good].ravel()
        if np.linalg.norm(a) > TURNS * size and b.any():
            inertia = float(a @ b / (b @ b))
            fits.append((float(np.linalg.norm(a - inertia * b) / np.linalg.norm(a)), body, wall, inertia))
    for off, body, wall, inertia in sorted(fits)[:1]:
        sentences.append(WORDS["spins"].format(share=percent(off), inertia=inertia))
        sentences[-1] += WORDS["arms"].format(body=body, wall=wall) if max(fits)[0] > tested.ALIKE * off else ""
    return sentences
