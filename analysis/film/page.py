"""The page of a film: one self-contained HTML file that plays, with its charts."""

import base64
import gzip
import json
import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import cycle, pairwise
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.exposure.along import outlined
from analysis.exposure.limits import (
    QUANTITIES,
    SIGNS,
    above_key,
    known_limits,
    limits_of_bodies,
    limits_of_people,
)
from analysis.exposure.picture import draw_loads
from analysis.film.frame import HEADLINES, MOST_OPEN, MOVED_FAR, OWN, RIGID, Frame, Reel, window_of
from analysis.film.summary import (
    JUMP,
    band,
    bands,
    headline,
    headline_rows,
    interval_text,
    jumping,
    jumps,
    left_open,
    push_of,
    title_of,
    unit_of,
    unsolved_kinds,
)
from analysis.pages import drawing
from analysis.pages.html import render, write_pictures
from analysis.pages.names import bodies_label, in_a_sentence
from analysis.pages.numbers import decimals, significant
from analysis.pages.ranges import Chart, mattering
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.percussions.setting import FORCE
from analysis.scene.rigid_bodies import people_of
from analysis.support.files import write_text
from nscd import Snapshot
from nscd.arrays import Floats, Indices
from nscd.show import contact_lines

# Shades of what the mechanics leaves open, and of the band of all radii.
FAINT, FAINTER = 0.35, 0.15
# Labels of limits are at least this share of the axis apart.
BETWEEN = 0.08


# Colour and dashes.
Line = tuple[str, str]


def draw_series(reels: Sequence[Reel]) -> Figure:
    """Draw each headline number over time, those of two units apart: of runs every model, of a
    filmed crowd the middle radius within the band of all; crosses where percussions are not solved."""
    lines: list[tuple[Sequence[Reel], str, Line]] = [
        ([reel], model, (colour, line))
        for reel, colour in zip(reels, cycle(drawing.COLOURS), strict=False)
        for model, line in zip(reel.models, drawing.LINES, strict=False)
    ]
    shown = {
        (key, unit_of(reel, model, key)): None
        for key in HEADLINES
        for (reel,), model, _ in lines
        if any(key in one.values.get(model, {}) for one in reel.frames)
    }
    if reels[0].radius is not None:
        lines = [(reels, RIGID, (drawing.BLUE, "-"))]
    figure, every = drawing.panels(8.0, 2.2 * len(shown) + 1.0, len(shown), sharex=True)
    for axes, (key, unit) in zip(every, shown, strict=True):
        for mine, model, look in lines:
            if unit_of(mine[0], model, key) == unit:
                _draw_band(axes, mine, model, key, look)
        axes.set_ylabel(fill(f"{title_of(key, unit)} ({unit})", 30), fontsize=8)
        axes.set_ylim(bottom=0)
        axes.grid(alpha=0.3)
        if key == "contact_largest" and unit == FORCE:
            _draw_limits(axes, key)
        # an empty line that is not clipped would upset the layout
        for bad in ([one.time for one in reel.unsolved] for reel in reels if reel.unsolved):
            axes.plot(
                bad, np.zeros(len(bad)), "x", color=drawing.VERMILION, clip_on=False, zorder=5
            )
    every[-1].set_xlabel("time (s)")
    drawing.legend_below(figure, every, 2, place="outside upper center")
    return figure


def _draw_band(axes: Axes, reels: Sequence[Reel], model: str, key: str, look: Line) -> None:
    """A number of the middle reel, with what the mechanics leaves open; of a filmed crowd the band
    of all radii, and jumps."""
    every, number = np.stack([one.track(model, key) for one in reels]), len(reels) // 2
    reel, (low, high), known = reels[number], band(every), ~np.isnan(every[..., 0])
    time = np.array([frame.time for frame in reel.frames])
    colour, line = look
    radii = [one.radius for one in reels if one.radius is not None]
    if len(radii) > 1:
        shared = known.any(0)
        ends = np.nanmin(low[:, shared], axis=0), np.nanmax(high[:, shared], axis=0)
        label = f"radii {min(radii):g} to {max(radii):g} m"
        drawing.shade(axes, time[shared], *ends, colour, FAINTER, label=label)
    mine = known[number]
    time, value = time[mine], every[number, mine, 0]
    low, high = low[number, mine], high[number, mine]
    if np.any(high > low):
        of = "90 % of" if reel.ensemble else "all"
        label = f"{of} admissible forces" if radii else ""
        drawing.shade(axes, time, low, high, colour, FAINT, label=label)
    places = model == RIGID and not radii
    label = f"percussions, at the places of {reel.title}" if places else reel.title
    axes.plot(time, value, color=colour, ls=line, lw=1.2, label=label)
    if radii:
        jumped = np.abs(jumps(reel)[key][mine]) > JUMP
        label = f"jumps since the frame before, {reel.title}"
        at = time[jumped], value[jumped]
        axes.plot(*at, "o", mfc="none", ms=4, color=drawing.VERMILION, label=label)


def _draw_limits(axes: Axes, key: str) -> None:
    """The limits of a force on a person, as far as the axis goes."""
    top, labelled = axes.get_ylim()[1], -np.inf
    for limit in limits_of_people():
        if limit.quantity != key or limit.number > top:
            continue
        axes.axhline(limit.number, color=drawing.GREY, lw=0.8, ls=":")
        if limit.number - labelled > BETWEEN * top:
            labelled = limit.number
            words = f"{significant(limit.number, 4)} N"
            place = 1.005, limit.number / top
            axes.text(*place, words, fontsize=6, va="center", transform=axes.transAxes)


def draw_still(reel: Reel, shown: Frame, files: tuple[Path, ...] = ()) -> Figure:
    """Draw one frame in the first model; files: of users' limits."""
    now = shown.now
    figure, (axes,) = drawing.panels(*drawing.size_of(_in_view(reel, now), float(now.radius.max())))
    if marks := still_on(axes, reel, shown, files):
        look = {"ncols": 3, "fontsize": 7, "frameon": False}
        figure.legend(handles=marks, loc="outside lower center", **look)
    return figure


def still_on(axes: Axes, reel: Reel, shown: Frame, files: tuple[Path, ...] = ()) -> list[Line2D]:
    """Draw one frame on axes: people in the colours of the limits (files: of users) that their
    largest force is above, and a black line for each contact, wider for more force. Return the
    marks of the limits, for a legend."""
    now, contacts, size = shown.now, shown.match.contacts, shown.size(reel.models[0])
    of, pairs, unit = people_of(now)[1], ~contacts.is_wall, shown.unit(reel.models[0])
    most = np.zeros(len(now))
    np.maximum.at(most, of[contacts.first], size)
    np.maximum.at(most, of[contacts.second[pairs]], size[pairs])
    largest = float(size.max(initial=0.0)) or 1.0
    limits = [limit.number for limit in limits_of_bodies(files)] if unit == FORCE else []
    colours = np.array(drawing.above_colours(len(limits)))
    drawing.draw_disks(axes, now, colours[np.searchsorted(limits, most[of])].tolist())
    drawing.draw_walls(axes, [(wall.start_m, wall.end_m) for wall in reel.scene.walls])
    lines = LineCollection(list(contact_lines(now, contacts)), colors="black")
    lines.set_linewidth(list(0.1 + 3.0 * size / largest))
    axes.add_collection(lines)
    drawing.frame(axes, _in_view(reel, now), float(now.radius.max()))
    axes.set_title(f"thickest line: {significant(largest, 2)} {unit}", fontsize=8)
    named = zip(limits, colours[1:], strict=True)
    return [
        axes.plot([], [], "o", color=colour, label=f"above {significant(limit, 4)} N")[0]
        for limit, colour in named
    ]


def _in_view(reel: Reel, now: Snapshot) -> Floats:
    """What a still shows (n,2) m: people who did not leave, the doors, and without people the walls."""
    drive, people = reel.scene.drive, now.position
    if drive and len(now) and not (left := drive.gone(people, now.ids)).all():
        people = people[~left]
    doors = [np.array(one) for one in drive.gates] if drive else []
    walls = [np.array([wall.start_m, wall.end_m]) for wall in reel.scene.walls]
    return np.concatenate([people, *(doors if len(now) and doors else walls)])


# Places are whole multiples of this (m), and forces of the largest power of ten that leaves their
# largest so many steps: both are finer than a screen.
PLACE_M, STEPS = 1e-3, 1e4
STOPS = 9
HUES = drawing.BLUE, drawing.ORANGE, drawing.VERMILION, drawing.BLUE, drawing.PINK


def packed(reels: Sequence[Reel], files: tuple[Path, ...] = (), live: str = "") -> str:
    """Pack a film for the page: JSON of whole numbers, gzip, base64; files: of users' limits; live: name of
    the scene where explore.html is beside.

    The same film gives the same text. The names of its keys are those that film.js reads."""
    limits = limits_of_bodies(files)
    shades = matplotlib.colormaps[drawing.SHADES](np.linspace(0, 1, STOPS))
    content = {
        "place": PLACE_M,
        "live": live,
        "reels": [_reel(reel) for reel in reels],
        "limits": [one.number for one in limits],
        "above": drawing.above_colours(len(limits)),
        "shades": [to_hex(one) for one in shades],
        "colours": dict(zip(("known", "open", "more", "less", "head"), HUES, strict=True)),
    }
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode("ascii")


def _reel(reel: Reel) -> dict[str, Any]:
    """Everybody who is ever there, the walls, and the frames."""
    shown, walls, drive = reel.shown, reel.scene.walls, reel.scene.drive
    people = {
        int(one): (float(r), int(who))
        for each in shown
        for one, r, who in zip(
            each.now.ids, each.now.radius, each.people.ids[people_of(each.now)[1]], strict=True
        )
    }
    ids = np.array(sorted(people), dtype=np.int64)
    sizes = [each.size(model).max(initial=0.0) for each in shown for model in reel.models]
    largest = float(max(sizes, default=0.0))
    # the power of ten of which the largest has at most 10 times STEPS
    step = 10.0 ** math.floor(math.log10(largest / STEPS)) if largest > 0 else 1.0
    before = np.zeros((len(ids), 2))
    return {
        "title": reel.title,
        "since": round(reel.since, 6),
        "engine": reel.title if reel.engine else "",
        "bodies": _bodies(reel).split(",")[0] if reel.engine else "",
        "walls": [[*wall.start_m, *wall.end_m] for wall in walls],
        "names": [wall.name for wall in walls],
        "doors": [[*p, *q] for p, q in drive.gates] if drive else [],
        "period": float(np.ptp(reel.scene.period_x_m or 0.0)),
        "ids": ids.tolist(),
        "radius": [round(people[one][0] / PLACE_M) for one in ids.tolist()],
        # of each disk the first of its person
        "person": np.searchsorted(ids, [people[one][1] for one in ids.tolist()]).tolist(),
        "step": step,
        # of an impact the two models have no unit in common, and so no difference
        "units": {model: shown[0].unit(model) if shown else FORCE for model in reel.models},
        "jumps": [] if reel.radius is None else jumping(reel),
        "frames": [_frame(reel, frame, ids, step, before) for frame in reel.frames],
    }


def _bodies(reel: Reel) -> str:
    """Name what an engine's own forces are those of."""
    return "own forces" if reel.engine == OWN else bodies_label(reel.scene)


def _frame(reel: Reel, frame: Frame, ids: Indices, step: float, before: Floats) -> dict[str, Any]:
    """Places as differences from the frame before, which this one replaces; contacts by bodies."""
    head: dict[str, Any] = {"n": frame.number, "t": round(frame.time, 6), "s": frame.status}
    if frame.reason:
        head["why"] = frame.reason
    if frame.found is None:
        return head
    now, match = frame.now, frame.match
    people, places = np.searchsorted(ids, now.ids), np.round(now.position / PLACE_M)
    moved = places - before[people]
    before[people] = places
    first, second = np.searchsorted(ids, match.ids).T
    forces = [np.where(frame.has(model), frame.size(model), np.nan) for model in reel.models]
    heads = frame.heads
    return head | {
        "p": np.diff(people, prepend=0).tolist(),
        "x": _whole(moved, 1.0),
        "a": np.diff(first, prepend=0).tolist(),
        "b": np.where(match.is_wall, -match.ids[:, 1], second).tolist(),
        "f": [_whole(force, step) for force in forces],
        "d": frame.determined.tolist(),
        "lo": _whole(frame.bounds[0], step),
        "hi": _whole(frame.bounds[1], step),
        **({} if heads is None else {"h": _whole(heads - now.position, PLACE_M)}),
    }


def _whole(values: Floats, unit: float) -> list[int]:
    """Values as whole multiples of a unit, one after the other; −1 where there is none."""
    multiples = np.where(np.isnan(values), -1.0, np.round(values / unit))
    return [int(one) for one in multiples.ravel()]


PAGE = "film.html"
# Radii farther apart (m) make no band: the forces of one between them may lie outside it.
STEP_M = 0.01


def write_film(reels: Sequence[Reel], folder: Path, command: str, source: str) -> Path:
    """Write film.html with its pictures into a folder, each whole; return its path.

    source: name of the file or the scene that was filmed"""
    words = words_of(reels)
    still, *others = _pictures(words, reels)
    images = write_pictures([Section(number="still", title="", pictures=[still, *others])], folder)
    tables = [_headlines(words, reels), *([_limits(words, reels)] if _forces(reels) else [])]
    drawn, notes = charts_and_notes(reels)
    page = render(
        PAGE,
        contents=[
            ("viewer", "The film"),
            ("assumptions", "Assumptions"),
            ("numbers", "In numbers"),
        ],
        title=" and ".join(dict.fromkeys(reel.scene.title or source for reel in reels)),
        filmed=reels[0].radius is not None,
        what=_what(words, reels, source),
        warnings=_warnings(words, reels),
        charts=drawn,
        notes=notes,
        still=still,
        data=packed(reels),
        sections=[
            Section(
                number="numbers",
                title="In numbers",
                pictures=others,
                tables=tables,
                files=["film.csv"],
            )
        ],
        images=images,
        engines=[reel.engine for reel in reels],
        command=command,
    )
    write_text(folder / PAGE, page)
    return folder / PAGE


def words_of(reels: Sequence[Reel]) -> Words:
    """Open the words of a film, with what several blocks ask for."""
    radii = [reel.radius for reel in reels if reel.radius is not None]
    middle = reels[len(reels) // 2]
    times = [frame.time for frame in middle.frames]
    duration = times[-1] - times[0]
    return Words(
        __package__,
        radii=(min(radii), max(radii)) if radii else None,
        middle=middle.radius,
        frames=len(times),
        start=times[0],
        end=times[-1],
        duration=duration,
        step=duration / (len(times) - 1) if len(times) > 1 else None,
        rigid=any(RIGID in reel.models for reel in reels),
        columns=list(bands(reels)),
        sampled=reels[0].ensemble,
        states="90 % of" if reels[0].ensemble else "all",
    )


def _forces(reels: Sequence[Reel]) -> bool:
    """Whether the percussions are forces."""
    shown = [(reel, model) for reel in reels for model in reel.models]
    return all(frame.unit(model) == FORCE for reel, model in shown for frame in reel.frames)


def _what(words: Words, reels: Sequence[Reel], source: str) -> list[str]:
    """What was filmed, and what presses it."""
    middle = reels[len(reels) // 2]
    drive, counts = middle.scene.drive, [len(frame.people) for frame in middle.shown]
    is_driven = drive is not None and _forces(reels)
    if middle.radius is None and middle.engine in ("", OWN):
        own = bool(middle.engine)
        said = [words.text("dump", file=source, own=own, least=min(counts), most=max(counts))]
    elif middle.radius is None:
        people = [max(len(frame.people) for frame in reel.shown) for reel in reels]
        names = [reel.engine for reel in reels]
        run = words.text(
            "run",
            people=people[0],
            engines=[in_a_sentence(reel.title) for reel in reels],
            names=names,
            soft=any(name != "rigid" for name in names),
            driven=is_driven,
            others=[] if _one_crowd(reels) else people,
        )
        said = [run]
    else:
        done = [frame.account for frame in middle.shown if frame.account is not None]
        all_done = [one.account for reel in reels for one in reel.shown if one.account]
        heads = words.text(
            "heads",
            file=source,
            first=middle.frames[0].number,
            last=middle.frames[-1].number,
            least=min(counts),
            most=max(counts),
            moved=float(np.mean([one.moved_mean_m for one in done])),
            moved_most=max(one.moved_largest_m for one in done),
            overlap=any(one.moved_largest_m > 0 for one in all_done),
            door=drive is not None,
            shift=middle.shift,
        )
        said = [heads, _doubts(words, reels)]
    if is_driven:
        return [*said, words.text("push", push=push_of(middle), drive=drive)]
    soft = middle.engine != ""
    return [*said, words.text("impact", soft=soft)] if RIGID in middle.models else said


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


def _doubts(words: Words, reels: Sequence[Reel]) -> str:
    """What limits the numbers of a filmed crowd: how far people were moved, and jumps."""
    far = {
        significant(reel.radius): float(
            np.mean([frame.values[RIGID][MOVED_FAR][0] for frame in reel.shown if len(frame.now)])
        )
        for reel in reels
    }
    middle = reels[len(reels) // 2]
    changes = {key: one for key, one in jumps(middle).items() if not np.isnan(one).all()}
    titles = {key: title_of(key, unit_of(middle, RIGID, key)) for key in changes}
    counts = {titles[key]: int((np.abs(one) > JUMP).sum()) for key, one in changes.items()}
    steps = max((int((~np.isnan(one)).sum()) for one in changes.values()), default=0)
    return words.text("doubts", far=far, counts=counts, steps=steps)


def _warnings(words: Words, reels: Sequence[Reel]) -> list[str]:
    """Which frames are not solved, by kinds of reasons."""
    of = sum(len(reel.frames) for reel in reels if RIGID in reel.models)
    return [
        words.text("unsolved", count=count, of=of, title=title, number=frame.number, reason=reason)
        for count, title, frame, reason in unsolved_kinds(reels)
    ]


def _headlines(words: Words, reels: Sequence[Reel]) -> Table:
    """Every headline number as an interval, in each model."""
    every = (headline(*one, key) for one in bands(reels).values() for key in HEADLINES)
    known = [one for one in every if one is not None]
    unbounded = max((one.unbounded for one in known), default=0)
    opened, by, unknown = left_open(reels)
    radii = sorted(reel.radius for reel in reels if reel.radius is not None)
    apart = max((b - a for a, b in pairwise(radii)), default=0.0)
    return words.table(
        "headlines",
        headline_rows(reels)[1],
        independent=min((one.independent for one in known), default=0.0),
        opened=opened,
        by=by,
        of=sum(len(reel.frames) - len(reel.unsolved) for reel in reels if RIGID in reel.models),
        unknown=unknown,
        apart=apart if apart > 1.001 * STEP_M else None,
        note=words.text("note", count=unbounded, most=MOST_OPEN) if unbounded else "",
    )


def charts(reels: Sequence[Reel]) -> list[Chart]:
    """Draw each headline number as a bar for each model, those of two units apart."""
    made = []
    columns = bands(reels)
    if len(reels) == 1 and len(columns) > 1:
        columns = dict(zip((_bodies(reels[0]), "rigid"), columns.values(), strict=True))
    for key in HEADLINES:
        found: dict[str, dict[str, tuple[float, float, float]]] = {}
        for name, (mine, model) in columns.items():
            if one := headline(mine, model, key):
                of = found.setdefault(unit_of(mine[0], model, key), {})
                of[name] = one.median, one.low, one.high
        for unit, named in found.items():
            limited = limits_of_bodies() if (key, unit) == ("contact_largest", FORCE) else []
            marks = [limit.number for limit in limited]
            made.append(Chart(title_of(key, unit), unit, named, marks=marks))
    return made


def charts_and_notes(reels: Sequence[Reel]) -> tuple[list[Chart], list[str]]:
    """Draw the bars of `charts`; say how to read them, and what makes the force uncertain."""
    words, drawn, forces = words_of(reels), charts(reels), _forces(reels)
    wide = sum(left_open(reels)[::2]) > 0  # mechanics leaves something open
    said = [words.text("bars", limits=any(one.shown for one in drawn), forces=forces, rigid=wide)]
    if not forces:
        return drawn, said
    if reels[0].scene.drive is not None:
        middle = reels[len(reels) // 2]
        counts = [len(frame.people) for frame in middle.shown]
        people = (min(counts), max(counts))
        said.append(words.text("pressed", people=people, push=push_of(middle)))
    each = [
        found
        for reel in reels
        for model in reel.models
        if (found := headline([reel], model, "contact_largest"))
    ]
    if not each:
        return drawn, said
    medians, found = [one.median for one in each], each[len(each) // 2]
    spans = {"moment": (found.low, found.high)}
    if len(medians) > 1:
        what = "radius" if reels[0].radius is not None else "model"
        spans[what] = (min(medians), max(medians))
    done = "Simulated" if reels[0].radius is None else "Filmed"
    done += f": {significant(words.values['duration'])} s"
    return drawn, [*said, *force_notes(spans, done)]


def force_notes(
    spans: Mapping[str, tuple[float, float]],
    done: str,
    files: tuple[Path, ...] = (),
    average: str = "",
) -> list[str]:
    """Say what the largest contact force depends on most, and what limits of a chest mean beside
    what was done; spans: as of `mattering`; files: of users' limits; average: the word before the
    force where the ranges are of means."""
    words, most = Words(__package__), mattering(spans)
    varied = len(most) > 1 and any(low < high for low, high in spans.values())
    named = {one.name: one for one in known_limits(files)}
    return [
        *([words.text("matters", most=most, average=average)] if varied else []),
        words.text("lasting", named=named, done=done, average=average),
    ]


def _pictures(words: Words, reels: Sequence[Reel]) -> list[Picture]:
    """A typical frame of the middle reel, all numbers over time, and of forces the load along walls."""
    middle = reels[len(reels) // 2]
    most = middle.typical
    still, drawn = draw_still(middle, most), draw_series(reels)
    limits = any(axes.texts for axes in drawn.axes)  # each has its number beside it
    model, scene = middle.models[0], middle.scene
    made = [
        words.picture("still", still, title=middle.title, number=most.number, time=most.time),
        words.picture("series", drawn, limits=limits),
    ]
    windows = [window_of(one.match, one.now, model) for one in middle.shown]
    on = [outlined(scene, one) for one in windows]
    if _forces(reels) and any(one.force.any() for one in on):
        made.append(words.picture("walls", draw_loads(scene, on), title=middle.title, count=len(on)))
    return made


def _limits(words: Words, reels: Sequence[Reel]) -> Table:
    """How many people are above each limit at an instant."""
    rows: list[list[Cell]] = [
        [
            f"{significant(limit.number, 4)} {limit.unit}",
            f"{limit.what} ({limit.population})",
            QUANTITIES[limit.quantity].title,
            *(
                interval_text(headline(*one, above_key(limit)), partial(decimals, places=0))
                for one in bands(reels).values()
            ),
            limit.signed,
        ]
        for limit in limits_of_people()
    ]
    return words.table("limits", rows, signs=SIGNS)
