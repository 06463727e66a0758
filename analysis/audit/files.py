"""A run, or a dump of disks with the contacts of any program, as a record to judge; and its page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.audit.judge import Audit
from analysis.audit.record import Record, record_of
from analysis.dumps import DumpError, EngineContacts, contacts_at, open_bodies, snapshot_of
from analysis.dumps.digits import LastDigit
from analysis.dumps.foreign import wall_fixes
from analysis.dumps.held import OwnContacts, open_contacts
from analysis.dumps.index import DumpIndex, index_dump
from analysis.film.files import bare, empty
from analysis.film.frame import Frames
from analysis.pages import drawing
from analysis.pages.html import render, write_pictures
from analysis.pages.numbers import significant
from analysis.pages.section import Section
from analysis.pages.words import Words
from analysis.percussions.setting import Setting, room_beside
from analysis.support.files import write_json, write_text
from analysis.support.frames import IMPULSE_COLUMNS
from analysis.support.reading import note
from nscd import Snapshot
from nscd.arrays import Floats

# Of numbers that are rounded to a step, the standard deviation is this share of it.
ROUNDED = 12**-0.5


def open_record(
    target: Path, contacts: Path | None, columns: str | None, room: Path | None, frames: str | None,
    acceleration: Sequence[float] | None, **stated: Any,
) -> Record:  # fmt: skip
    """Read a folder of a run or a dump, its contacts (those of the run where left out), and what else acts
    by the room or an acceleration (2,) m/s². Raises DumpError naming the file and the line or the frame."""
    file = target / "bodies.dump" if target.is_dir() else target
    own = [one for one in ("impulses.dump", "contacts.dump") if (file.parent / one).is_file() and target.is_dir()]
    if not (path := contacts or (file.parent / own[0] if own else None)):
        raise DumpError(f"{target}: no contacts. Give --contacts")
    trajectory = open_bodies(file, **stated).trajectory
    found, setting = room_beside(file, room, stated)
    setting = setting.of_dump(trajectory)
    scene = empty(found or bare(file), "dump")
    impulses = path.name == "impulses.dump" and contacts is None
    index = index_dump(path, "ENTRIES") if impulses else open_contacts(path, columns, trajectory)
    held = OwnContacts(index, scene, False, setting.standing)
    held.wall_fixes = wall_fixes(() if "is_wall" in index.columns else trajectory.ts.data)
    numbers = Frames.parse(frames or "::1").of(range(int(trajectory.n_frames)), file)
    if missing := {trajectory.steps[k] for k in numbers} - {*index.steps}:
        raise DumpError(f"{path}: step {min(missing)} of {file} is missing")
    moving = "vx" in trajectory.columns.index.columns
    stated_ = acceleration is not None or found is not None or "drive_x" in trajectory.ts.data

    def read() -> Record:
        snapshots, listed = [], []
        for number in numbers:
            ts = trajectory[number]
            snapshots.append(snapshot_of(ts, file, needs_velocity=False))
            listed.append(_listed(held, ts, snapshots[-1], snapshots[-2:-1] if impulses else None))
        if np.isnan(ts.time):
            raise DumpError(f"{file}: its frames have no times. Give --time-step")
        steps = np.diff([trajectory.steps[k] for k in numbers])
        pushes = (lambda now: external_of(setting, now, acceleration)) if stated_ else None
        try:
            found = record_of(snapshots, listed, pushes, setting.walls, moving, every_step=bool((steps == 1).all()))
        except ValueError as error:
            raise DumpError(f"{path}: {error}") from None
        return replace(found, noise=_noise(trajectory, index, found))

    record = read()
    if not (held.is_whole or impulses):
        if np.nansum(record.force * record.normal) < 0:
            held.sign = 1.0
            record = read()
        note(path, f"fx fy read as the force on the {'second' if held.sign > 0 else 'first'}, as contacts push")
    return record


def external_of(setting: Setting, now: Snapshot, acceleration: Sequence[float] | None) -> Floats:
    """Compute all forces (n,2) N that are no contacts: body force, and the drive of the dump or the room."""
    force: Floats = now.mass[:, None] * np.array(setting.acceleration if acceleration is None else acceleration)
    if now.drive is not None:
        return np.asarray(force + now.drive)
    if setting.drive is None:
        return force
    wanted, time = replace(setting, acceleration=(0.0, 0.0), arms=None, left_velocity="desired", window=None).left(now)
    return np.asarray(force + now.mass[:, None] * (wanted - now.velocity) / (time or 1.0))


def _listed(held: OwnContacts, ts: Any, now: Snapshot, before: list[Snapshot] | None) -> EngineContacts:
    """The contacts of a frame as they are listed; of impulses their mean force since the frame before."""
    number, fixed = held.index.steps.index(ts.data["step"]), held.standing
    every = now if fixed is None else fixed.behind(now)
    if before is not None:
        get = dict(zip(held.index.columns, held.index.table(number).T, strict=True))
        impulse = np.column_stack([get[name] for name in IMPULSE_COLUMNS[3:5]])
        impulse /= now.time - before[0].time if before else np.inf
        first, second = (get[name].astype(np.int64) for name in ("first", "second"))
        return EngineContacts(first=first, second=second, is_wall=get["is_wall"] == 1, force=impulse,
                              normal=np.nan * impulse, overlap=np.nan * first)  # fmt: skip
    found = contacts_at(held.index, number) if held.is_whole else held.pairs(number, every, strict=False)
    if held.wall_fixes:
        found = EngineContacts.joined([found, held.of_fixes(ts.data, every)])
    return found if fixed is None else found.on_walls(fixed.ids, len(held.scene.walls))


def _noise(trajectory: Any, index: DumpIndex, record: Record) -> float:
    """What the last digits of velocities, or places, and of forces leave open in the force on a body, N."""
    columns, h = trajectory.columns, float(np.median(record.durations)) if len(record.times) > 2 else 1.0

    def step(of: DumpIndex, chosen: Sequence[str]) -> float:
        words = dict(zip(of.columns, zip(*of.sample, strict=True), strict=False))
        last = LastDigit.of([word for name in chosen for word in words.get(name, ())])
        return ROUNDED * last.step(last.largest) if last else 0.0

    moved = step(columns.index, columns.place[:2] if record.moved else ("vx", "vy")) * columns.unit
    moved *= float(np.median(record.mass)) * (6**0.5 / h**2 if record.moved else 2**0.5 / h)
    return float(np.hypot(moved, 2 * step(index, ("fx", "fy"))))


def write_audit(found: Audit, name: str, folder: Path, command: str) -> list[Path]:
    """Write `audit.json` and `index.html` with its picture; return their paths."""
    words = Words(__package__)
    rows = [[one.name, ". ".join(one.faults.values()) or "–", significant(one.factor, 4), significant(one.shift),
             significant(one.residual)] for one in found.fits[:12]]  # fmt: skip
    first = Section(
        number="result", title=words.text("title"), introduction=[words.text("lead", seen=found.smallest_fault)],
        words=[f"**{found.words[0].upper()}{found.words[1:]}.**"], warnings=[f"{one}." for one in found.remarks],
        pictures=[words.picture("forces", _picture(found))],
    )  # fmt: skip
    last = Section(number="assumptions", title=words.text("title_assumptions"), files=["audit.json"],
                   introduction=words.items("assumptions"), tables=[words.table("table_fits", rows)])  # fmt: skip
    write_json(folder / "audit.json", found.to_dict())
    page = render("audit.html", command=command, first=first, folds=[last], name=name,
                  contents=[(one.number, one.title) for one in (first, last)],
                  images=write_pictures([first, last], folder / "figures"))  # fmt: skip
    write_text(folder / "index.html", page)
    return [folder / "audit.json", folder / "index.html"]


def _picture(found: Audit) -> Figure:
    """Needed against listed force, of bodies and intervals; what each hypothesis leaves unexplained."""
    figure, (left, right) = drawing.panels(9.5, 3.8, 1, 2)
    some = slice(None, None, 1 + found.needed.size // 20_000)
    needed, given = found.needed.ravel()[some], found.given.ravel()[some]
    left.plot(needed, given, ".", ms=2, color=drawing.BLUE, rasterized=True)
    ends = np.array([np.nanmin(needed, initial=0.0), np.nanmax(needed, initial=0.0)])
    left.plot(ends, ends, color=drawing.BLACK, lw=0.8)
    left.set(xlabel="needed (N)", ylabel="sum of listed contact forces (N)", title="each body and interval, x and y")
    fits = found.fits[7::-1]
    share = [max(1e-12, min(one.residual, 10.0)) for one in fits]
    right.barh([one.name for one in fits], share, color=drawing.BLUE)
    right.set(xscale="log", xlabel="not explained, share of what is needed", title="tested hypotheses")
    return figure
