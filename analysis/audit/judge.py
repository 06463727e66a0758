"""The verdict: whether contact forces are those that the momentum of their bodies needs, and what else
they may be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.audit import hypotheses as tested
from analysis.audit.hypotheses import Fit
from analysis.audit.motion import Record, frames_of, record_of
from nscd import Snapshot, Walls
from nscd.arrays import Floats

# What may stay unexplained of the force that is needed.
WITHIN = 0.05
# From one interval to the next forces change by this share of themselves where frames are far apart.
FAR = 0.3
# Less than this share of the contact forces is rounding.
NOTHING = 1e-9
STATUS = {"agrees": 0, "differs": 1, "unknown": 2}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Audit:
    """Hold a verdict.

    status: agrees, differs, or unknown where it cannot be judged
    words: the verdict in a sentence, with what is wrong or why it cannot be judged
    faults: what is wrong, by name; none where several hypotheses explain alike, or none does
    fits: the best of each tested hypothesis, the nearest first
    residual: what the forces as listed leave unexplained, as a share of what is needed
    smallest_fault: N, of the force on a body, that could be seen
    remarks: what is said beside it
    needed, given: (i,n,2) N, what momentum needs and what contacts sum to, of each interval and body;
        given as listed, at the frame that fits best"""

    status: str
    words: str
    faults: tuple[str, ...]
    fits: tuple[Fit, ...]
    residual: float
    smallest_fault: float
    remarks: tuple[str, ...]
    needed: Floats
    given: Floats

    @property
    def exit_status(self) -> int:
        """Give 0 where forces agree, 1 where they do not, 2 where it cannot be judged."""
        return STATUS[self.status]

    def to_dict(self) -> dict[str, Any]:
        """Give the verdict for JSON."""
        fits = [
            {"hypothesis": one.name, "meaning": ". ".join(one.faults.values()), "factor": one.factor,
             "frames_late": one.shift, "residual": one.residual} for one in self.fits
        ]  # fmt: skip
        own = ("status", "words", "faults", "residual", "remarks")
        return {name: getattr(self, name) for name in own} | {
            "smallest_fault_N": self.smallest_fault, "hypotheses": fits,
        }  # fmt: skip


def audit(
    snapshots: Sequence[Snapshot],
    contacts: Sequence[Any] | Any,
    *,
    external: Callable[[Snapshot], ArrayLike] | ArrayLike | None = None,
    walls: Walls | None = None,
    friction: float | None = None,
    time_step: float | None = None,
    within: float = WITHIN,
) -> Audit:
    """Judge contact forces (N) by the momentum of their bodies.

    snapshots: of the bodies, with velocities, their times growing
    contacts: of each snapshot a table (mapping of arrays, pandas, EngineContacts) with first, second (ids),
        fx, fy or force (N, on the second), and is_wall where the second is none of the bodies; or one
        pandas table with time_s (s) too
    external: N, all other forces: (n,2), (2,) for each, or a function of a snapshot; None: not known
    walls: by which a body that touches a wall with no row is found
    friction: Coulomb's μ, to count forces outside its cone
    time_step: s, of the simulation, where frames are further apart
    within: share of the needed force that may stay unexplained

    Raises ValueError naming the frame and the row of a contact of nobody.

    >>> two = [
    ...     Snapshot(
    ...         position=[[0, 0], [0.5, 0]],
    ...         velocity=[[u, 0], [v, 0]],
    ...         radius=[0.25, 0.25],
    ...         mass=[75, 75],
    ...         time=t,
    ...     )
    ...     for t, u, v in ((0, 2, 0), (0.01, 1.5, 0.5), (0.02, 1, 1))
    ... ]
    >>> push = {"first": [1], "second": [2], "fx": [3750.0], "fy": [0.0]}  # N
    >>> print(audit(two, [push] * 3, external=0).words)
    the forces agree with the change of momentum to 0.0 %
    """
    parts = contacts
    if hasattr(contacts, "columns"):
        parts = frames_of(contacts, [one.time for one in snapshots])
    record = record_of(snapshots, parts, external=external, walls=walls)
    return judge(record, friction=friction, time_step=time_step, within=within)


def judge(
    record: Record,
    *,
    friction: float | None = None,
    time_step: float | None = None,
    substeps: int | None = None,
    within: float = WITHIN,
) -> Audit:
    """Judge the contacts of a record, see `audit`. substeps: in one time step, where they are known."""
    shape = len(record.times), len(record.ids)
    if len(record.times) < 2 + record.base:
        return _unknown(f"{2 + record.base} frames or more are needed", record)
    needed, rows = record.needed(), record.rows
    listed = record.joined(rows.sums(shape, rows.force))
    most, size = float(np.abs(rows.force).max(initial=0.0)), float(np.abs(np.nan_to_num(needed)).max())
    if most == 0:
        return _unknown("no contact with a force is listed", record)
    if size <= max(NOTHING * most, 0.0 if record.stated else record.noise):
        why = "nothing moves and nothing presses from outside: any factor balances. Give external forces"
        return _unknown(why, record)
    named = tested.factors(record, time_step, substeps)
    fits = tested.fit_all(record, named)
    found = tested.chosen(fits, within)
    loose = [one for one in fits if {*one.faults} == {"factor"} and one.residual <= within]
    if not found and not loose:
        fits, found = _where_rows_are_missing(record, fits, named, within)
    if not found:
        found = loose[:1]
    as_listed = [one for one in fits if not one.faults]
    if not as_listed:  # the factor is another: nothing of it explained
        free = [one for one in fits if {*one.faults} <= {"factor", "sign"} and one.shift in tested.NOW]
        as_listed = [Fit({}, 1.0, (free or fits or [Fit({}, 1.0, 0.5, 1.0)])[0].shift, 1.0)]
    shift = found[0].shift if found else as_listed[0].shift
    given, good = tested.at_shift(record, listed, shift, len(needed))
    needed, given = needed[good], given[good]
    off = _share(needed, given, record.durations[good])
    residual = found[0].residual if found else as_listed[0].residual
    seen = max(record.noise, residual * float(np.sqrt(np.nanmean(needed**2))))
    verdict = Audit(
        status="unknown", words="", faults=(), fits=_best_of_each(fits, as_listed), residual=off,
        smallest_fault=seen, remarks=(), needed=needed, given=given,
    )  # fmt: skip
    if not found:
        return _unexplained(verdict, record, within)
    return _explained(verdict, record, found, friction)


def _share(needed: Floats, given: Floats, durations: Floats) -> float:
    """What is unexplained, as a share of what is needed, by impulses."""
    weight = durations[:, None, None]
    a, b = (np.nan_to_num(weight * one) for one in (needed, given + 0 * needed))
    return float(np.linalg.norm(a - b) / (np.linalg.norm(a) or 1.0))


def _best_of_each(fits: Sequence[Fit], listed: Sequence[Fit]) -> tuple[Fit, ...]:
    best: dict[str, Fit] = {}
    for one in (*fits, *listed):
        best.setdefault(one.name, one)
    return tuple(sorted(best.values(), key=lambda one: one.residual))


def _unknown(why: str, record: Record) -> Audit:
    none = np.zeros((0, len(record.ids), 2))
    return Audit(
        status="unknown", words=f"the forces cannot be judged: {why}", faults=(), fits=(),
        residual=np.nan, smallest_fault=np.nan, remarks=(), needed=none, given=none,
    )  # fmt: skip


def _where_rows_are_missing(
    record: Record, fits: list[Fit], named: Any, within: float
) -> tuple[list[Fit], list[Fit]]:
    """Fit the bodies with all their contacts listed, and tangential forces. All fits, and those that
    explain."""
    needed, shape = record.needed(), (len(record.times), len(record.ids))
    listed = record.joined(record.rows.sums(shape, record.rows.force))
    words = {"walls missing": "bodies that touch a wall do not balance: no forces of walls are listed there",
             "contacts missing": "contacts are missing: bodies that touch more than is listed do not balance"}  # fmt: skip
    for name, keep in tested.without(record, needed).items():
        if keep.all() or not keep.any():
            continue
        some = [
            one._replace(faults=one.faults | {name: words[name]})
            for one in tested.fit_all(record, named, keep)
        ]
        good = [one for one in tested.chosen(some, within) if tested.elsewhere(record, one, keep, listed)]
        fits = [*fits, *some[:5]]
        if good:
            return fits, good
    extra = tested.with_tangential(record)
    if extra is not None and extra.residual <= within:
        ways = tested.meanings(extra.factor, extra.residual, named)
        found = [extra._replace(faults=extra.faults | more, factor=exact) for more, exact in ways]
        return [*fits, *found], found
    return ([*fits, extra] if extra else fits), []


def _explained(
    verdict: Audit, record: Record, found: Sequence[Fit], friction: float | None
) -> Audit:
    """The verdict where hypotheses explain what is needed."""
    best, rows = found[0], record.rows
    remarks = []
    force, along = best.factor * rows.force, best.factor * (rows.force * rows.normal).sum(axis=1)
    known = ~np.isnan(along) & force.any(axis=1)
    if known.any() and "signs of contacts" not in best.faults and (pulls := (along[known] < 0).mean()):
        remarks.append(f"{pulls:.2%} of the contacts pull")
    if friction is not None and known.any():
        n, f = np.abs(along[known]), np.hypot(*force[known].T)
        out = (np.sqrt(np.maximum(f**2 - n**2, 0)) > (1 + 1e-3) * friction * n + 1e-9 * f).mean()
        if out:
            remarks.append(f"{out:.2%} of the contacts are outside the friction cone of μ = {friction:g}")
    remarks += _spins(record, best)
    percent = f"{100 * best.residual:.2g} %" if best.residual > 1e-12 else "0.0 %"
    if not best.faults:
        words = f"the forces agree with the change of momentum to {percent}"
        return replace(verdict, status="agrees", words=words, remarks=tuple(remarks))
    said = ". ".join(best.faults.values())
    words = f"the forces do not agree: {said}. So they explain the momentum to {percent}"
    faults = tuple(best.faults)
    if len(found) > 1:
        every = ", or ".join(" and ".join(one.faults.values()) for one in found)
        words, faults = f"the forces do not agree, and this explains it alike: {every}", ()
    return replace(verdict, status="differs", words=words, faults=faults, remarks=tuple(remarks))


def _spins(record: Record, best: Fit) -> list[str]:
    """Say whether the torques of the forces turn the bodies, as discs or as spheres."""
    rows, f, n = record.rows, len(record.times), len(record.ids)
    spun = record.mass * record.radius**2 * np.diff(record.spin, axis=0)
    normal = np.nan_to_num(rows.normal)
    turn = -best.factor * (normal[:, 0] * rows.force[:, 1] - normal[:, 1] * rows.force[:, 0])
    if record.moved or record.body is not None or {*best.faults} - {"sign", "impulse", "units", "factor"}:
        return []
    if not (np.nan_to_num(spun).any() and turn.any()) or np.isnan(rows.normal).any():
        return []
    torque = np.zeros((f * n, 2))
    for place, some in ((rows.first, rows.second > -2), (rows.second, rows.second >= 0)):
        at = (rows.frame * n + place)[some]
        torque[:, 0] += np.bincount(at, (record.radius[place] * turn)[some], minlength=f * n)
    given, good = tested.at_shift(record, torque.reshape(f, n, 2), best.shift, len(spun))
    here = good[:, None] & ~np.isnan(spun)
    a, b = (given[..., 0] * record.durations[:, None])[here], spun[here]
    share = float(a @ b / (b @ b))
    off = float(np.linalg.norm(a - share * b) / (np.linalg.norm(a) or 1.0))
    kind = next((k for c, k in ((0.5, "discs"), (0.4, "spheres")) if abs(share / c - 1) < max(0.05, off)), "")
    said = f"of {kind}" if kind else f"{share:.3g} m r²"
    return [f"spins agree with the torques to {100 * off:.2g} %, inertia {said}"]


def _unexplained(verdict: Audit, record: Record, within: float) -> Audit:
    """The verdict where no hypothesis explains what is needed: not judged for a reason, or different."""
    needed, why = record.needed(), ""
    size, h = float(np.sqrt(np.nanmean(needed**2))), record.durations
    change = np.linalg.norm(np.nan_to_num(np.diff(needed, axis=0)))
    both = np.linalg.norm(np.nan_to_num(np.abs(needed[1:]) + np.abs(needed[:-1])))
    coarse = record.steps is None or max(np.diff(record.steps), default=2) > 1
    if record.noise > within * size:
        why = f"digits of the text leave {record.noise:.2g} N open of {size:.2g} N on a body"
    elif not record.stated:
        mass = record.joined(np.repeat(record.mass[None, :, None], 2, axis=2))
        rest = (verdict.needed - verdict.given) / mass
        g = np.nanmean(rest, axis=(0, 1))
        why = "external forces are not known. Give them"
        if np.linalg.norm(np.nan_to_num(rest - g)) <= within * np.linalg.norm(np.nan_to_num(rest)):
            why = f"they balance with an acceleration of ({g[0]:.4g}, {g[1]:.4g}) m/s², which was not given"
    elif coarse and (len(needed) < 2 or change > FAR * both):
        why = f"frames are {np.median(h):.3g} s apart, too far for forces that change so fast. Write more"
    if why:
        return replace(verdict, words=f"the forces cannot be judged: {why}")
    words = f"the forces do not agree: {verdict.residual:.1%} of what momentum needs is not explained, and "
    return replace(verdict, status="differs", words=words + "no tested hypothesis explains it")
