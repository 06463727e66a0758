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

from analysis.pages import drawing
from analysis.pages.html import render, write_pictures
from analysis.pages.names import bodies_label, in_a_sentence
from analysis.pages.numbers import decimals, significant
from analysis.pages.ranges import Chart, mattering
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.percussions.setting import FORCE
from analysis.scene.rigid_bodies import people_of
from analysis.studies.exposure.limits import (
    QUANTITIES,
    SIGNS,
    above_key,
    known_limits,
    limits_of_bodies,
    limits_of_people,
)
from analysis.studies.exposure.picture import draw_loads
from analysis.studies.exposure.walls import outlined
from analysis.studies.film.frame import (
    HEADLINES,
    MOST_OPEN,
    MOVED_FAR,
    OWN,
    RIGID,
    Animation,
    Frame,
    window_of,
)
from analysis.studies.film.summary import (
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


def draw_series(animations: Sequence[Animation]) -> Figure:
    """Draw each headline number over time, those of two units apart: of runs every model, of a
    filmed crowd the middle radius within the band of all; crosses where percussions are not solved."""
    lines: list[tuple[Sequence[Animation], str, Line]] = [
        ([animation], model, (colour, line))
        for animation, colour in zip(animations, cycle(drawing.COLOURS), strict=False)
        for model, line in zip(animation.models, drawing.LINES, strict=False)
    ]
    shown = {
        (key, unit_of(animation, model, key)): None
        for key in HEADLINES
        for (animation,), model, _ in lines
        if any(key in one.values.get(model, {}) for one in animation.frames)
    }
    if animations[0].radius is not None:
        lines = [(animations, RIGID, (drawing.BLUE, "-"))]
    figure, every = drawing.panels(8.0, 2.2 * len(shown) + 1.0, len(shown), sharex=True)
    for axes, (key, unit) in zip(every, shown, strict=True):
        for mine, model, style in lines:
            if unit_of(mine[0], model, key) == unit:
                _draw_band(axes, mine, model, key, style)
        axes.set_ylabel(fill(f"{title_of(key, unit)} ({unit})", 30), fontsize=8)
        axes.set_ylim(bottom=0)
        axes.grid(alpha=0.3)
        if key == "contact_largest" and unit == FORCE:
            _draw_limits(axes, key)
        # an empty line that is not clipped would upset the layout
        for bad in ([one.time for one in animation.unsolved] for animation in animations if animation.unsolved):
            axes.plot(
                bad, np.zeros(len(bad)), "x", color=drawing.VERMILION, clip_on=False, zorder=5
            )
    every[-1].set_xlabel("time (s)")
    drawing.legend_below(figure, every, 2, anchor="outside upper center")
    return figure


def _draw_band(axes: Axes, animations: Sequence[Animation], model: str, key: str, style: Line) -> None:
    """A number of the middle reel, with what the mechanics leaves open; of a filmed crowd the band
    of all radii, and jumps."""
    every, number = np.stack([one.track(model, key) for one in animations]), len(animations) // 2
    animation, (low, high), finite = animations[number], band(every), ~np.isnan(every[..., 0])
    time = np.array([frame.time for frame in animation.frames])
    colour, line = style
    radii = [one.radius for one in animations if one.radius is not None]
    if len(radii) > 1:
        shared = finite.any(0)
        ends = np.nanmin(low[:, shared], axis=0), np.nanmax(high[:, shared], axis=0)
        label = f"radii {min(radii):g} to {max(radii):g} m"
        drawing.shade(axes, time[shared], *ends, colour, FAINTER, label=label)
    mine = finite[number]
    time, value = time[mine], every[number, mine, 0]
    low, high = low[number, mine], high[number, mine]
    if np.any(high > low):
        of = "90 % of" if animation.ensemble else "all"
        label = f"{of} admissible forces" if radii else ""
        drawing.shade(axes, time, low, high, colour, FAINT, label=label)
    positions = model == RIGID and not radii
    label = f"percussions, at the places of {animation.title}" if positions else animation.title
    axes.plot(time, value, color=colour, ls=line, lw=1.2, label=label)
    if radii:
        jumped = np.abs(jumps(animation)[key][mine]) > JUMP
        label = f"jumps since the frame before, {animation.title}"
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
            anchor = 1.005, limit.number / top
            axes.text(*anchor, words, fontsize=6, va="center", transform=axes.transAxes)


def draw_still(animation: Animation, shown: Frame, files: tuple[Path, ...] = ()) -> Figure:
    """Draw one frame in the first model; files: of users' limits."""
    now = shown.now
    figure, (axes,) = drawing.panels(*drawing.size_of(_in_view(animation, now), float(now.radius.max())))
    if marks := still_on(axes, animation, shown, files):
        style = {"ncols": 3, "fontsize": 7, "frameon": False}
        figure.legend(handles=marks, loc="outside lower center", **style)
    return figure


def still_on(axes: Axes, animation: Animation, shown: Frame, files: tuple[Path, ...] = ()) -> list[Line2D]:
    """Draw one frame on axes: people in the colours of the limits (files: of users) that their
    largest force is above, and a black line for each contact, wider for more force. Return the
    marks of the limits, for a legend."""
    now, contacts, size = shown.now, shown.match.contacts, shown.size(animation.models[0])
    of, pairs, unit = people_of(now)[1], ~contacts.is_wall, shown.unit(animation.models[0])
    maximum = np.zeros(len(now))
    np.maximum.at(maximum, of[contacts.first], size)
    np.maximum.at(maximum, of[contacts.second[pairs]], size[pairs])
    largest = float(size.max(initial=0.0)) or 1.0
    limits = [limit.number for limit in limits_of_bodies(files)] if unit == FORCE else []
    colours = np.array(drawing.above_colours(len(limits)))
    drawing.draw_disks(axes, now, colours[np.searchsorted(limits, maximum[of])].tolist())
    drawing.draw_walls(axes, [(wall.start_m, wall.end_m) for wall in animation.scene.walls])
    lines = LineCollection(list(contact_lines(now, contacts)), colors="black")
    lines.set_linewidth(list(0.1 + 3.0 * size / largest))
    axes.add_collection(lines)
    drawing.frame(axes, _in_view(animation, now), float(now.radius.max()))
    axes.set_title(f"thickest line: {significant(largest, 2)} {unit}", fontsize=8)
    named = zip(limits, colours[1:], strict=True)
    return [
        axes.plot([], [], "o", color=colour, label=f"above {significant(limit, 4)} N")[0]
        for limit, colour in named
    ]


def _in_view(animation: Animation, now: Snapshot) -> Floats:
    """What a still shows (n,2) m: people who did not leave, the doors, and without people the walls."""
    drive, people = animation.scene.drive, now.position
    if drive and len(now) and not (left := drive.gone(people, now.ids)).all():
        people = people[~left]
    doors = [np.array(one) for one in drive.gates] if drive else []
    walls = [np.array([wall.start_m, wall.end_m]) for wall in animation.scene.walls]
    return np.concatenate([people, *(doors if len(now) and doors else walls)])


# Places are whole multiples of this (m), and forces of the largest power of ten that leaves their
# largest so many steps: both are finer than a screen.
PLACE_M, STEPS = 1e-3, 1e4
STOPS = 9
HUES = drawing.BLUE, drawing.ORANGE, drawing.VERMILION, drawing.BLUE, drawing.PINK


def packed(animations: Sequence[Animation], files: tuple[Path, ...] = (), live: str = "") -> str:
    """Pack a film for the page: JSON of whole numbers, gzip, base64; files: of users' limits; live: name of
    the scene where explore.html is beside.

    The same film gives the same text. The names of its keys are those that film.js reads."""
    limits = limits_of_bodies(files)
    shades = matplotlib.colormaps[drawing.SHADES](np.linspace(0, 1, STOPS))
    content = {
        "place": PLACE_M,
        "live": live,
        "reels": [_animation(animation) for animation in animations],
        "limits": [one.number for one in limits],
        "above": drawing.above_colours(len(limits)),
        "shades": [to_hex(one) for one in shades],
        "colours": dict(zip(("known", "open", "more", "less", "head"), HUES, strict=True)),
    }
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode("ascii")


def _animation(animation: Animation) -> dict[str, Any]:
    """Everybody who is ever there, the walls, and the frames."""
    shown, walls, drive = animation.shown, animation.scene.walls, animation.scene.drive
    people = {
        int(one): (float(r), int(who))
        for each in shown
        for one, r, who in zip(
            each.now.ids, each.now.radius, each.people.ids[people_of(each.now)[1]], strict=True
        )
    }
    ids = np.array(sorted(people), dtype=np.int64)
    sizes = [each.size(model).max(initial=0.0) for each in shown for model in animation.models]
    largest = float(max(sizes, default=0.0))
    # the power of ten of which the largest has at most 10 times STEPS
    step = 10.0 ** math.floor(math.log10(largest / STEPS)) if largest > 0 else 1.0
    before = np.zeros((len(ids), 2))
    return {
        "title": animation.title,
        "since": round(animation.since, 6),
        "engine": animation.title if animation.engine else "",
        "bodies": _bodies(animation).split(",")[0] if animation.engine else "",
        "walls": [[*wall.start_m, *wall.end_m] for wall in walls],
        "names": [wall.name for wall in walls],
        "doors": [[*p, *q] for p, q in drive.gates] if drive else [],
        "period": float(np.ptp(animation.scene.period_x_m or 0.0)),
        "ids": ids.tolist(),
        "radius": [round(people[one][0] / PLACE_M) for one in ids.tolist()],
        # of each disk the first of its person
        "person": np.searchsorted(ids, [people[one][1] for one in ids.tolist()]).tolist(),
        "step": step,
        # of an impact the two models have no unit in common, and so no difference
        "units": {model: shown[0].unit(model) if shown else FORCE for model in animation.models},
        "jumps": [] if animation.radius is None else jumping(animation),
        "frames": [_frame(animation, frame, ids, step, before) for frame in animation.frames],
    }


def _bodies(animation: Animation) -> str:
    """Name what an engine's own forces are those of."""
    return "own forces" if animation.engine == OWN else bodies_label(animation.scene)


def _frame(animation: Animation, frame: Frame, ids: Indices, step: float, before: Floats) -> dict[str, Any]:
    """Places as differences from the frame before, which this one replaces; contacts by bodies."""
    head: dict[str, Any] = {"n": frame.number, "t": round(frame.time, 6), "s": frame.status}
    if frame.reason:
        head["why"] = frame.reason
    if frame.found is None:
        return head
    now, match = frame.now, frame.match
    people, coordinates = np.searchsorted(ids, now.ids), np.round(now.position / PLACE_M)
    moved = coordinates - before[people]
    before[people] = coordinates
    first, second = np.searchsorted(ids, match.ids).T
    forces = [np.where(frame.has(model), frame.size(model), np.nan) for model in animation.models]
    positions = frame.head_positions
    return head | {
        "p": np.diff(people, prepend=0).tolist(),
        "x": _integers(moved, 1.0),
        "a": np.diff(first, prepend=0).tolist(),
        "b": np.where(match.is_wall, -match.ids[:, 1], second).tolist(),
        "f": [_integers(force, step) for force in forces],
        "d": frame.determined.tolist(),
        "lo": _integers(frame.bounds[0], step),
        "hi": _integers(frame.bounds[1], step),
        **({} if positions is None else {"h": _integers(positions - now.position, PLACE_M)}),
    }


def _integers(values: Floats, unit: float) -> list[int]:
    """Values as whole multiples of a unit, one after the other; −1 where there is none."""
    multiples = np.where(np.isnan(values), -1.0, np.round(values / unit))
    return [int(one) for one in multiples.ravel()]


PAGE = "film.html"
# Radii farther apart (m) make no band: the forces of one between them may lie outside it.
STEP_M = 0.01


def write_film(animations: Sequence[Animation], folder: Path, command: str, source: str) -> Path:
    """Write film.html with its pictures into a folder, each whole; return its path.

    source: name of the file or the scene that was filmed"""
    words = words_of(animations)
    still, *others = _pictures(words, animations)
    images = write_pictures([Section(number="still", title="", pictures=[still, *others])], folder)
    tables = [_headlines(words, animations), *([_limits(words, animations)] if _forces(animations) else [])]
    drawn, notes = charts_and_notes(animations)
    page = render(
        PAGE,
        contents=[
            ("viewer", "The film"),
            ("assumptions", "Assumptions"),
            ("numbers", "In numbers"),
        ],
        title=" and ".join(dict.fromkeys(animation.scene.title or source for animation in animations)),
        filmed=animations[0].radius is not None,
        what=_what(words, animations, source),
        warnings=_warnings(words, animations),
        charts=drawn,
        notes=notes,
        still=still,
        data=packed(animations),
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
        engines=[animation.engine for animation in animations],
        command=command,
    )
    write_text(folder / PAGE, page)
    return folder / PAGE


def words_of(animations: Sequence[Animation]) -> Words:
    """Open the words of a film, with what several blocks ask for."""
    radii = [animation.radius for animation in animations if animation.radius is not None]
    middle = animations[len(animations) // 2]
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
        rigid=any(RIGID in animation.models for animation in animations),
        columns=list(bands(animations)),
        sampled=animations[0].ensemble,
        states="90 % of" if animations[0].ensemble else "all",
    )


def _forces(animations: Sequence[Animation]) -> bool:
    """Whether the percussions are forces."""
    shown = [(animation, model) for animation in animations for model in animation.models]
    return all(frame.unit(model) == FORCE for animation, model in shown for frame in animation.frames)


def _what(words: Words, animations: Sequence[Animation], source: str) -> list[str]:
    """What was filmed, and what presses it."""
    middle = animations[len(animations) // 2]
    drive, counts = middle.scene.drive, [len(frame.people) for frame in middle.shown]
    is_driven = drive is not None and _forces(animations)
    if middle.radius is None and middle.engine in ("", OWN):
        own = bool(middle.engine)
        sentences = [words.text("dump", file=source, own=own, least=min(counts), most=max(counts))]
    elif middle.radius is None:
        people = [max(len(frame.people) for frame in animation.shown) for animation in animations]
        names = [animation.engine for animation in animations]
        run = words.text(
            "run",
            people=people[0],
            engines=[in_a_sentence(animation.title) for animation in animations],
            names=names,
            soft=any(name != "rigid" for name in names),
            driven=is_driven,
            others=[] if _one_crowd(animations) else people,
        )
        sentences = [run]
    else:
        done = [frame.account for frame in middle.shown if frame.account is not None]
        all_done = [one.account for animation in animations for one in animation.shown if one.account]
        heads_text = words.text(
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
        sentences = [heads_text, _doubts(words, animations)]
    if is_driven:
        return [*sentences, words.text("push", push=push_of(middle), drive=drive)]
    soft = middle.engine != ""
    return [*sentences, words.text("impact", soft=soft)] if RIGID in middle.models else sentences


def _one_crowd(animations: Sequence[Animation]) -> bool:
    """Whether all runs are of the same people in the same room."""
    bodies = [(animation.scene.snapshot, animation.scene.walls, animation.scene.drive) for animation in animations]
    first = bodies[0]
    return all(
        len(one[0]) == len(first[0])
        and np.array_equal(one[0].position, first[0].position)
        and np.array_equal(one[0].radius, first[0].radius)
        and one[1:] == first[1:]
        for one in bodies
    )


def _doubts(words: Words, animations: Sequence[Animation]) -> str:
    """What limits the numbers of a filmed crowd: how far people were moved, and jumps."""
    far = {
        significant(animation.radius): float(
            np.mean([frame.values[RIGID][MOVED_FAR][0] for frame in animation.shown if len(frame.now)])
        )
        for animation in animations
    }
    middle = animations[len(animations) // 2]
    changes = {key: one for key, one in jumps(middle).items() if not np.isnan(one).all()}
    titles = {key: title_of(key, unit_of(middle, RIGID, key)) for key in changes}
    counts = {titles[key]: int((np.abs(one) > JUMP).sum()) for key, one in changes.items()}
    steps = max((int((~np.isnan(one)).sum()) for one in changes.values()), default=0)
    return words.text("doubts", far=far, counts=counts, steps=steps)


def _warnings(words: Words, animations: Sequence[Animation]) -> list[str]:
    """Which frames are not solved, by kinds of reasons."""
    of = sum(len(animation.frames) for animation in animations if RIGID in animation.models)
    return [
        words.text("unsolved", count=count, of=of, title=title, number=frame.number, reason=reason)
        for count, title, frame, reason in unsolved_kinds(animations)
    ]


def _headlines(words: Words, animations: Sequence[Animation]) -> Table:
    """Every headline number as an interval, in each model."""
    every = (headline(*one, key) for one in bands(animations).values() for key in HEADLINES)
    finite = [one for one in every if one is not None]
    unbounded = max((one.unbounded for one in finite), default=0)
    opened, by, unknown = left_open(animations)
    radii = sorted(animation.radius for animation in animations if animation.radius is not None)
    difference = max((b - a for a, b in pairwise(radii)), default=0.0)
    return words.table(
        "headlines",
        headline_rows(animations)[1],
        independent=min((one.independent for one in finite), default=0.0),
        opened=opened,
        by=by,
        of=sum(len(animation.frames) - len(animation.unsolved) for animation in animations if RIGID in animation.models),
        unknown=unknown,
        apart=difference if difference > 1.001 * STEP_M else None,
        note=words.text("note", count=unbounded, most=MOST_OPEN) if unbounded else "",
    )


def charts(animations: Sequence[Animation]) -> list[Chart]:
    """Draw each headline number as a bar for each model, those of two units apart."""
    made = []
    columns = bands(animations)
    if len(animations) == 1 and len(columns) > 1:
        columns = dict(zip((_bodies(animations[0]), "rigid"), columns.values(), strict=True))
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


def charts_and_notes(animations: Sequence[Animation]) -> tuple[list[Chart], list[str]]:
    """Draw the bars of `charts`; say how to read them, and what makes the force uncertain."""
    words, drawn, forces = words_of(animations), charts(animations), _forces(animations)
    is_open = sum(left_open(animations)[::2]) > 0  # mechanics leaves something open
    sentences = [words.text("bars", limits=any(one.shown for one in drawn), forces=forces, rigid=is_open)]
    if not forces:
        return drawn, sentences
    if animations[0].scene.drive is not None:
        middle = animations[len(animations) // 2]
        counts = [len(frame.people) for frame in middle.shown]
        people = (min(counts), max(counts))
        sentences.append(words.text("pressed", people=people, push=push_of(middle)))
    each = [
        found
        for animation in animations
        for model in animation.models
        if (found := headline([animation], model, "contact_largest"))
    ]
    if not each:
        return drawn, sentences
    medians, found = [one.median for one in each], each[len(each) // 2]
    spans = {"moment": (found.low, found.high)}
    if len(medians) > 1:
        what = "radius" if animations[0].radius is not None else "model"
        spans[what] = (min(medians), max(medians))
    done = "Simulated" if animations[0].radius is None else "Filmed"
    done += f": {significant(words.values['duration'])} s"
    return drawn, [*sentences, *force_notes(spans, done)]


def force_notes(
    spans: Mapping[str, tuple[float, float]],
    done: str,
    files: tuple[Path, ...] = (),
    average: str = "",
) -> list[str]:
    """Say what the largest contact force depends on most, and what limits of a chest mean beside
    what was done; spans: as of `mattering`; files: of users' limits; average: the word before the
    force where the ranges are of means."""
    words, maximum = Words(__package__), mattering(spans)
    varied = len(maximum) > 1 and any(low < high for low, high in spans.values())
    named = {one.name: one for one in known_limits(files)}
    return [
        *([words.text("matters", most=maximum, average=average)] if varied else []),
        words.text("lasting", named=named, done=done, average=average),
    ]


def _pictures(words: Words, animations: Sequence[Animation]) -> list[Picture]:
    """A typical frame of the middle reel, all numbers over time, and of forces the load along walls."""
    middle = animations[len(animations) // 2]
    maximum = middle.typical
    still, drawn = draw_still(middle, maximum), draw_series(animations)
    limits = any(axes.texts for axes in drawn.axes)  # each has its number beside it
    model, scene = middle.models[0], middle.scene
    made = [
        words.picture("still", still, title=middle.title, number=maximum.number, time=maximum.time),
        words.picture("series", drawn, limits=limits),
    ]
    windows = [window_of(one.match, one.now, model) for one in middle.shown]
    on = [outlined(scene, one) for one in windows]
    if _forces(animations) and any(one.force.any() for one in on):
        made.append(words.picture("walls", draw_loads(scene, on), title=middle.title, count=len(on)))
    return made


def _limits(words: Words, animations: Sequence[Animation]) -> Table:
    """How many people are above each limit at an instant."""
    rows: list[list[Cell]] = [
        [
            f"{significant(limit.number, 4)} {limit.unit}",
            f"{limit.what} ({limit.population})",
            QUANTITIES[limit.quantity].title,
            *(
                interval_text(headline(*one, above_key(limit)), partial(decimals, digits=0))
                for one in bands(animations).values()
            ),
            limit.signed,
        ]
        for limit in limits_of_people()
    ]
    return words.table("limits", rows, signs=SIGNS)
