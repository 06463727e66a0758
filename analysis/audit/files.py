"""A run, or a dump of disks with the contacts of any program, as a record to judge; and its page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.audit.hypotheses import WORDS
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
from analysis.pages.section import Picture, Section, Table
from analysis.percussions.setting import Setting, room_beside
from analysis.support.files import write_json, write_text
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
    own = [file.with_name(one) for one in ("impulses.dump", "contacts.dump") if target.is_dir()]
    path = contacts or next(filter(Path.is_file, own), None)
    if path is None:
        raise DumpError(f"{target}: no contacts. Give --contacts")
    trajectory = open_bodies(file, **stated).trajectory
    found, setting = room_beside(file, room, stated)
    setting = setting.of_dump(trajectory)
    impulses = path in own[:1]
    index = index_dump(path, "ENTRIES") if impulses else open_contacts(path, columns, trajectory)
    held = OwnContacts(index, empty(found or bare(file), "dump"), False, setting.standing)
    held.wall_fixes = wall_fixes(() if "is_wall" in index.columns else trajectory.ts.data)
    numbers = Frames.parse(frames or "::1").of(range(int(trajectory.n_frames)), file)
    steps = [trajectory.steps[k] for k in numbers]
    if missing := {*steps} - {*index.steps}:
        raise DumpError(f"{path}: step {min(missing)} of {file} is missing")
    if np.isnan(trajectory[numbers[0]].time):
        raise DumpError(f"{file}: its frames have no times. Give --time-step")
    known = acceleration is not None or found is not None or "drive_x" in trajectory.ts.data
    has_velocity, every = "vx" in trajectory.ts.data, bool((np.diff(steps) == 1).all())

    def read() -> Record:
        snapshots, listed = [], []
        for number in numbers:
            snapshots.append(snapshot_of(trajectory[number], file, needs_velocity=False))
            number = index.steps.index(trajectory.steps[number])
            duration = float(np.diff([one.time for one in snapshots[-2:]] * 2)[0]) or np.inf
            listed.append(_listed(held, number, trajectory.ts, snapshots[-1], duration if impulses else 0.0))
        pushes = (lambda now: external_of(setting, now, acceleration)) if known else None
        try:
            record = record_of(snapshots, listed, pushes, setting.walls, has_velocity, every_step=every)
        except ValueError as error:
            raise DumpError(f"{path}: {error}") from None
        return replace(record, noise=_noise(trajectory, index, record))

    record = read()
    if not (held.is_whole or impulses):
        push = float(np.nansum(record.force * record.normal))
        if not push and len(record.times) > 1 + record.moved:  # walls alone, whose normals are not known
            needed = record.needed()
            push = float(np.nansum(needed * record.sums(record.force)[: len(needed)]))
        if push < 0:
            held.sign = 1.0
            record = read()
        note(path, f"fx fy read as the force on the {'second' if held.sign > 0 else 'first'}, as contacts push")
    return record


def external_of(setting: Setting, now: Snapshot, acceleration: Sequence[float] | None) -> Floats:
    """Compute all forces (n,2) N that are no contacts: body force, and the drive of the dump or the room."""
    force: Floats = now.mass[:, None] * np.array(setting.acceleration if acceleration is None else acceleration)
    if now.drive is not None or setting.drive is None:
        return force if now.drive is None else force + now.drive
    alone = replace(setting, acceleration=(0.0, 0.0), arms=None, left_velocity="desired", window=None)
    wanted, time = alone.left(now)
    return np.asarray(force + now.mass[:, None] * (wanted - now.velocity) / (time or 1.0))


def _listed(held: OwnContacts, number: int, ts: Any, now: Snapshot, duration: float) -> EngineContacts:
    """The contacts of a frame as they are listed; of impulses their mean force over a duration (s)."""
    if duration:
        first, second, wall, *impulse = held.index.table(number).T
        force, one, two = np.column_stack(impulse[:2]) / duration, first.astype(np.int64), second.astype(np.int64)
        return EngineContacts(first=one, second=two, is_wall=wall == 1, force=force, normal=np.nan * force, overlap=first)
    fixed = held.standing
    every = now if fixed is None else fixed.behind(now)
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
    page, seen = WORDS["page"], significant(found.smallest_fault, 2)
    rows = [[one.name, ", also ".join(one.faults.values()) or "right", *map(significant, one[1:])] for one in found.fits[:12]]
    first = Section(
        number="result", title="Result", introduction=[page["lead"].format(seen=seen)],
        words=[f"**{found.words[0].upper()}{found.words[1:]}.**"], warnings=[f"{one}." for one in found.remarks],
        pictures=[Picture(name="forces", caption=page["forces"], figure=_picture(found))],
    )  # fmt: skip
    last = Section(number="assumptions", title="Hypotheses and assumptions", introduction=page["assumptions"],
                   tables=[Table(caption=page["fits"], head=page["head"], rows=rows)])  # fmt: skip
    write_json(folder / "audit.json", found.to_dict())
    contents = [(one.number, one.title) for one in (first, last)]
    images = write_pictures([first], folder / "figures")
    filled = {"command": command, "first": first, "folds": [last], "name": name, "images": images}
    write_text(folder / "index.html", render("audit.html", contents=contents, **filled))
    return [folder / "audit.json", folder / "index.html"]


def _picture(found: Audit) -> Figure:
    """Needed against listed force, of bodies and intervals; what each hypothesis leaves unexplained."""
    figure, (left, right) = drawing.panels(9.5, 3.8, 1, 2)
    some = slice(None, None, 1 + found.needed.size // 20_000)
    left.plot(found.needed.ravel()[some], found.given.ravel()[some], ".", ms=2, color=drawing.BLUE)
    ends = [np.nanmin(found.needed, initial=0.0), np.nanmax(found.needed, initial=0.0)]
    left.plot(ends, ends, color=drawing.BLACK, lw=0.8)
    left.set(xlabel="needed (N)", ylabel="sum of listed contact forces (N)", title="each body and interval, x and y")
    fits = found.fits[7::-1]
    right.barh([one.name for one in fits], [max(1e-12, min(one.residual, 10.0)) for one in fits], color=drawing.BLUE)
    right.set(xscale="log", xlabel="not explained, share of what is needed", title="tested hypotheses")
    return figure
