"""The page of a film: headline intervals, viewer, series, limits, and how people were moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from analysis.exposure.counts import above_key, limits_of_people
from analysis.exposure.limits import QUANTITIES
from analysis.film.charts import draw_series, draw_still
from analysis.film.ends import MOST_OPEN
from analysis.film.frame import HEADLINES, MOVED_FAR, RIGID, Frame, Reel
from analysis.film.summary import (
    JUMP,
    Headline,
    bands,
    headline,
    headline_rows,
    jumps,
    left_open,
)
from analysis.film.viewer import packed
from analysis.pages.html import render, write_pictures
from analysis.pages.names import in_a_sentence
from analysis.pages.numbers import NONE, decimals, significant
from analysis.pages.section import Cell, Section, Table
from analysis.pages.words import Words
from analysis.percussions.setting import FORCE
from analysis.support.files import write_text

PAGE = "film.html"
# Radii farther apart (m) make no band: the forces of one between them may lie outside it.
STEP_M = 0.01


def write_film(reels: Sequence[Reel], folder: Path, command: str, source: str) -> Path:
    """Write film.html with its pictures into a folder, each whole; return its path.

    source: name of the file or the scene that was filmed"""
    words = Words(__package__)
    shared = _shared(reels)
    still, series = _pictures(words, reels, shared)
    images = write_pictures([Section(number="still", title="", pictures=[still, series])], folder)
    tables = [_limits(words, reels, shared)] if _forces(reels) else []
    if shared["radii"]:
        tables.append(_moved(words, reels))
    page = render(
        PAGE,
        title=" and ".join(dict.fromkeys(reel.scene.title for reel in reels)),
        what=_what(words, reels, shared, source),
        warnings=_warnings(words, reels),
        headlines=_headlines(words, reels, shared),
        still=still,
        how=words.text("how"),
        data=packed(reels),
        sections=[
            Section(
                number="numbers",
                title="In numbers",
                pictures=[series],
                tables=tables,
                files=["film.csv"],
            )
        ],
        images=images,
        command=command,
    )
    write_text(folder / PAGE, page)
    return folder / PAGE


def _shared(reels: Sequence[Reel]) -> dict[str, object]:
    """What several blocks of words ask for."""
    radii = [reel.radius for reel in reels if reel.radius is not None]
    middle = reels[len(reels) // 2]
    times = [frame.time for frame in middle.frames]
    return {
        "radii": (min(radii), max(radii)) if radii else None,
        "middle": middle.radius,
        "frames": len(times),
        "start": times[0],
        "end": times[-1],
        "duration": times[-1] - times[0],
        "step": (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else None,
    }


def _forces(reels: Sequence[Reel]) -> bool:
    """Whether the percussions are forces."""
    shown = [(reel, model) for reel in reels for model in reel.models]
    return all(frame.unit(model) == FORCE for reel, model in shown for frame in reel.frames)


def _what(
    words: Words, reels: Sequence[Reel], shared: Mapping[str, object], source: str
) -> list[str]:
    """What was filmed, and what presses it."""
    middle = reels[len(reels) // 2]
    shown = [frame for frame in middle.frames if frame.found is not None]
    counts = [len(frame.found.snapshot) for frame in shown if frame.found is not None]
    if middle.radius is None:
        people = [
            max(len(frame.found.snapshot) for frame in reel.frames if frame.found is not None)
            for reel in reels
        ]
        names = [reel.engine for reel in reels]
        about: dict[str, object] = {
            "people": people[0],
            "engines": [in_a_sentence(reel.title) for reel in reels],
            "names": names,
            "soft": any(name != "rigid" for name in names),
            "driven": middle.scene.drive is not None and _forces(reels),
            "others": [] if _one_crowd(reels) else people,
        }
        said = [words.text("run", **shared, **about)]
    else:
        done = [frame.account for frame in shown if frame.account is not None]
        said = [
            words.text(
                "heads",
                **shared,
                file=source,
                first=middle.frames[0].number,
                last=middle.frames[-1].number,
                least=min(counts),
                most=max(counts),
                moved=float(np.mean([one.moved_mean_m for one in done])),
                moved_most=max(one.moved_largest_m for one in done),
                shift=middle.shift,
            )
        ]
        said += _doubts(words, reels, shared)
    drive = middle.scene.drive
    if drive is None or not _forces(reels):
        return [*said, words.text("impact")] if RIGID in middle.models else said
    mass = np.concatenate([frame.found.snapshot.mass for frame in shown if frame.found is not None])
    push = drive.push(mass)
    ends = (float(push.min()), float(push.max()))
    return [*said, words.text("push", push=ends, drive=drive)]


def _one_crowd(reels: Sequence[Reel]) -> bool:
    """Whether all runs are of the same people in the same room."""
    bodies = [(reel.scene.snapshot, reel.scene.walls, reel.scene.drive) for reel in reels]
    first = bodies[0]
    return all(
        len(one[0]) == len(first[0])
        and np.array_equal(one[0].position, first[0].position)
        and np.array_equal(one[0].radius, first[0].radius)
        and one[1:] == first[1:]
        for one in bodies
    )


def _doubts(words: Words, reels: Sequence[Reel], shared: Mapping[str, object]) -> list[str]:
    """What limits the numbers of a filmed crowd: how far people were moved, and jumps."""
    far = {
        significant(reel.radius): float(
            np.mean([f.values[RIGID][MOVED_FAR].value for f in reel.frames if f.found is not None])
        )
        for reel in reels
    }
    middle = reels[len(reels) // 2]
    counts = {
        measure.title: sum(abs(share) > JUMP for share in jumps(middle)[key].values())
        for key, measure in HEADLINES.items()
    }
    steps = max(len(each) for each in jumps(middle).values())
    return [words.text("doubts", **shared, far=far, counts=counts, steps=steps)]


def _warnings(words: Words, reels: Sequence[Reel]) -> list[str]:
    """Which frames are not solved."""
    return [
        words.text(
            "unsolved",
            count=len(bad),
            of=len(reel.frames),
            title=reel.title,
            numbers=", ".join(str(frame.number) for frame in bad),
            reason=bad[0].reason or bad[0].status,
        )
        for reel in reels
        if (bad := reel.unsolved)
    ]


def _headlines(words: Words, reels: Sequence[Reel], shared: Mapping[str, object]) -> Table:
    """Every headline number as an interval, in each model."""
    columns, rows = headline_rows(reels)
    every = [headline(*one, key) for one in bands(reels).values() for key in HEADLINES]
    known = [one for one in every if one is not None]
    unbounded = max((one.unbounded for one in known), default=0)
    note = words.text("note", count=unbounded, most=MOST_OPEN) if unbounded else ""
    independent = min((one.independent for one in known), default=0.0)
    rigid = any(RIGID in reel.models for reel in reels)
    opened, by, unknown = left_open(reels) if rigid else (0, 0.0, 0)
    of = sum(len(reel.frames) - len(reel.unsolved) for reel in reels if RIGID in reel.models)
    radii = sorted(reel.radius for reel in reels if reel.radius is not None)
    apart = max((b - a for a, b in pairwise(radii)), default=0.0)
    about = {"independent": independent, "rigid": rigid, "opened": opened, "by": by, "of": of,
             "unknown": unknown, "apart": apart if apart > 1.001 * STEP_M else None}  # fmt: skip
    return words.table("headlines", rows, **shared, **about, columns=columns, note=note)


def _pictures(words: Words, reels: Sequence[Reel], shared: Mapping[str, object]):  # type: ignore[no-untyped-def]
    """The frame that carries most, of the middle reel, and all numbers over time."""
    middle = reels[len(reels) // 2]

    def largest(frame: Frame) -> float:
        return (
            -1.0 if frame.found is None else float(frame.size(middle.models[-1]).max(initial=0.0))
        )

    frame = max(middle.frames, key=largest)
    about = {"title": middle.title, "number": frame.number, "time": frame.time}
    still, series = (
        words.picture("still", draw_still(middle, frame), **about),
        words.picture("series", draw_series(reels), **shared),
    )
    return (
        replace(still, narrow=draw_still(middle, frame, narrow=True)),
        replace(series, narrow=draw_series(reels, narrow=True)),
    )


def _limits(words: Words, reels: Sequence[Reel], shared: Mapping[str, object]) -> Table:
    """How many people are above each limit at an instant."""
    columns = bands(reels)
    rows: list[list[Cell]] = [
        [
            f"{significant(limit.number, 4)} {limit.unit}",
            f"{limit.what}; {limit.population}",
            QUANTITIES[limit.quantity].title,
            *(_counts(headline(*band, above_key(limit))) for band in columns.values()),
            limit.cited,
        ]
        for limit in limits_of_people()
    ]
    return words.table("limits", rows, **shared, columns=list(columns))


def _counts(found: Headline | None) -> str:
    if found is None:
        return NONE
    median, low, high = (decimals(end, 0) for end in (found.median, found.low, found.high))
    return f"{median} ({low} – {high})"


def _moved(words: Words, reels: Sequence[Reel]) -> Table:
    """What was done to the heads, radius by radius."""
    rows: list[list[Cell]] = []
    for reel in reels:
        done = [frame.account for frame in reel.frames if frame.account is not None]
        if not done:
            continue
        columns = (
            ([one.overlaps_before for one in done], 0),
            ([100 * one.overlap_before_largest_m for one in done], 1),
            ([100 * one.moved_mean_m for one in done], 1),
            ([100 * one.moved_largest_m for one in done], 1),
            ([100 * one.moved_share_over_1_cm for one in done], 0),
            ([one.contacts_after + one.wall_contacts_after for one in done], 0),
        )
        cells = [
            f"{decimals(min(values), places)} – {decimals(max(values), places)}"
            for values, places in columns
        ]
        rows.append([significant(reel.radius), *cells])
    return words.table("moved", rows)
