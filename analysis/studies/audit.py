"""A run, or a dump of disks with the contacts of any program, as a record to judge; and its page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.dumps import DumpError, open_bodies
from analysis.dumps.index import index_dump
from analysis.dumps.listed_contacts import ListedContacts, open_contacts
from analysis.dumps.unused_columns import wall_fixes
from analysis.pages import drawing
from analysis.pages.html import render, write_pictures
from analysis.pages.numbers import significant
from analysis.pages.section import Picture, Section, Table
from analysis.percussions.audit.hypotheses import WORDS
from analysis.percussions.audit.judge import Audit
from analysis.percussions.audit.record import Record
from analysis.percussions.listed_contacts import read_record
from analysis.percussions.setting import Setting, room_beside
from analysis.studies.film.files import bare, empty
from analysis.studies.film.frame import FrameRange
from analysis.support.files import write_json, write_text
from analysis.support.reading import note


def open_record(
    target: Path, contacts: Path | None, columns: str | None, room: Path | None, frames: str | None,
    acceleration: Sequence[float] | None, **stated: Any,
) -> tuple[Record, Setting]:  # fmt: skip
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
    checked = ListedContacts(index, empty(found or bare(file), "dump"), False, setting.fixed_disks)
    checked.wall_fixes = wall_fixes(() if "is_wall" in index.columns else trajectory.ts.data)
    numbers = FrameRange.parse(frames or "::1").of(range(int(trajectory.n_frames)), file)
    if missing := {trajectory.steps[k] for k in numbers} - {*index.steps}:
        raise DumpError(f"{path}: step {min(missing)} of {file} is missing")
    if np.isnan(trajectory[numbers[0]].time):
        raise DumpError(f"{file}: its frames have no times. Give --time-step")
    how: Any = {"acceleration": acceleration, "impulses": impulses}
    record = read_record(checked, trajectory, setting, numbers, **how)
    if not (checked.is_whole or impulses):
        push = float(np.nansum(record.force * record.normal))
        if not push and len(record.times) > 1 + record.moved:  # walls alone, whose normals are not known
            needed = record.needed()
            push = float(np.nansum(needed * record.sums(record.force)[: len(needed)]))
        if push < 0:
            checked.sign, others = 1.0, checked.wall_fixes or checked.fixed_disks is not None
            record = read_record(checked, trajectory, setting, numbers, **how) if others else replace(record, force=-record.force)
        if push:
            note(path, f"fx fy read as the force on the {'second' if checked.sign > 0 else 'first'}, as contacts push")
        record = replace(record, signed=bool(checked.wall_fixes))
    return record, setting


def write_audit(found: Audit, name: str, folder: Path, command: str) -> list[Path]:
    """Write `audit.json` and `index.html` with its picture; return their paths."""
    page, smallest_fault = WORDS["page"], significant(found.smallest_fault, 2)
    rows = [[one.name, ", also ".join(one.faults.values()) or "right", *map(significant, one[1:])] for one in found.fits[:12]]
    first = Section(
        number="result", title="Result", introduction=[page["lead"].format(seen=smallest_fault)][: len(rows)],
        words=[f"**{found.words[0].upper()}{found.words[1:]}.**"], warnings=[f"{one}." for one in found.remarks],
        pictures=[Picture(name="forces", caption=page["forces"], figure=_picture(found))] if rows else [],
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
