"""Tables of people as text, as trackers, simulators and spreadsheets write them: columns found by their
names, units and frame rate in the lines above, ids that are texts."""

import codecs
import re
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from analysis.support import reading
from analysis.support.cells import LEAST_NUMBERS, cells_of, number_of
from analysis.support.reading import UnreadableError
from nscd.arrays import Floats, Indices

PLAIN = ("id", "frame", "x", "y")
# Names of columns, without regard to case, spaces, signs and units: of trackers, crowd:it, Pathfinder,
# Viswalk, Vadere, JuPedSim, SUMO.
AXIS = "{0} pos{0} {0}pos position{0} {0}position coord{0} {0}coord coordcent{0} start{0} person{0}"
NAMES = {axis: AXIS.format(axis) for axis in "xyz"} | {
    "id": "id no pid ped pedid pedestrian pedestrianid person personid persid agent agentid track trackid",
    "frame": "frame frameid frameno framenum framenumber framenr fr timestep",
    "time": "time t simtime simsec times timestamp timesteptime",
    "end_time": "endtime",
    "end_x": "endx",
    "end_y": "endy",
    "v_x": "vx",
    "v_y": "vy",
}
ROLES = {name: role for role, names in NAMES.items() for name in names.split()}
NEEDED = ("id", "frame", "time", "x", "y")
# A name, and its unit: x/m, X [m], x_m, x in m, t(s).
NAME = re.compile(
    r"(.*?)\s*(?:\[(.*)\]|\((.*)\)|/\s*(\w+)|[_ ](?:in[_ ])?(m|cm|mm|s|ms|px))?", re.IGNORECASE
)
# Spaces round the unit of a name, where spaces stand between names.
LOOSE = re.compile(r"\s*([\[(/])\s*|\s+in\s+(?=[cm]?m\b)")
PER_METRE = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
TIMES = {"s": 1.0, "ms": 0.001}
WORDS = r"(?:centi|milli)?met(?:er|re)s?|[cm]?m|px|pixels?|ft|feet"
# A unit in a comment: "x/m", "in cm", "[m]", "in metres". No "in Mannheim", no "in m/s".
UNIT = re.compile(
    rf"(?:\b[xy]\s*/\s*|\bin\s+)({WORDS})(?![\w/²^])|[\[(]\s*({WORDS})\s*[\])]", re.IGNORECASE
)
NUMBER = r"[+-]?(?:\d+(?:\.\d+|,\d{1,2})?(?:e[+-]?\d+)?(?!,?\d)|(?:nan|inf)\b)"
# The number after the word, or the one before "fps". No fraction.
RATE = re.compile(
    r"(?:frame[ _-]?rate|frames? per s(?:ec(?:ond)?)?|\bfps\b)(?:\s*[\[(][^\])]*[\])])?"
    rf"\s*(?:[:=]|of\b|is\b)?\s*({NUMBER})(?![\w.]*/\s*\d)\s*(?:fps|1/s|hz)?"
    rf"|(?<![\w.,])({NUMBER})\s*(?:fps\b|frames?\s*(?:per|/)\s*s)",
    re.IGNORECASE,
)
COMMENTS = tuple("#$*")


class Columns(NamedTuple):
    """Hold the names of columns, what each means and its unit, and whether the file names them."""

    names: list[str]
    roles: dict[str, int]
    units: dict[str, str]
    named: bool


class Table(NamedTuple):
    """Hold a table: the lines above it, its columns, and its rows by their lines: id, and frame or
    time (s) or both, x, y, and what else is known, in the units of the file."""

    file: Path
    head: list[str]
    columns: Columns
    rows: pd.DataFrame

    @property
    def length(self) -> str | None:
        """The unit of x and y: that of their names, or else in a comment. Raises UnreadableError for
        two, and for one that is no length."""
        units = self.columns.units
        stated = {units[axis] for axis in "xy" if axis in units} or units_in("\n".join(self.head))
        if len(stated) > 1 or not stated <= PER_METRE.keys():
            raise UnreadableError(
                f"{self.file}: states the unit {' and '.join(sorted(stated))}. One of m, cm and mm is read"
            )
        return next(iter(stated), None)

    def frame_rate(self, inputs: float | None) -> float | None:
        """Frames per second in the lines above. Raises UnreadableError for two, unless one is given."""
        every = (found for line in self.head for found in RATE.findall(line))
        stated = {float((one or other).replace(",", ".")): one or other for one, other in every}
        if len(stated) > 1 and inputs not in stated:
            both = " and ".join(stated.values())
            raise UnreadableError(f"{self.file}: states the frame rates {both}. Give --frame-rate")
        return inputs if inputs in stated else next(iter(stated), None)

    def note(self, *used: str) -> None:
        """Say which columns are not used."""
        indices = {self.columns.roles.get(role) for role in used}
        names = (name for index, name in enumerate(self.columns.names) if index not in indices)
        reading.note_unused(self.file, "columns", names)


def units_in(text: str) -> set[str]:
    """The units of length that a comment states."""
    return {unit_of(one or other) for one, other in UNIT.findall(text)}


def unit_of(word: str) -> str:
    """Shorten the name of a unit."""
    short = re.sub(r"met(?:er|re)s?$", "m", word.strip().lower())
    longer = {"centim": "cm", "millim": "mm", "pixel": "px", "pixels": "px", "feet": "ft"}
    longer |= dict.fromkeys(("sec", "second", "seconds"), "s")
    return longer.get(short, short)


def read_table(file: Path, *, named: bool, columns: Sequence[str] = ()) -> Table:
    """Read a table of people as text.

    named: whether its columns must have names; else they are id, frame, x, y where they have none
    columns: what its columns are, in their order, whatever names they have

    Raises UnreadableError naming the file and the line, column or option: the first row that is not as
    the one before all, columns that are missing or of which two could be one, a decimal point beside
    a decimal comma."""
    head: list[str] = []
    layout: Columns | None = None
    points = commas = False
    ids: dict[str, int] = {}
    codes, lines, values = array("q"), array("q"), array("d")
    for number, text in _lines(file):
        cells, where = cells_of(text), f"{file}, line {number}: {text[:60]!r}"
        if layout is None:
            if not _is_row(text, cells, where):
                head.append(text)
                continue
            layout = _layout(file, head, cells, named, columns)
            indices = {role: position for role, position in layout.roles.items() if role != "id"}
            who, width = layout.roles["id"], len(layout.names)
        elif not text or text.startswith(COMMENTS):
            continue
        if len(cells) != width:
            raise UnreadableError(f"{where} is not a row as the first one, with {width} cells")
        picked = [cells[position] for position in indices.values()]
        for role, cell in zip(indices, picked, strict=True):
            value = number_of(cell)
            if value is None and role in NEEDED:
                raise UnreadableError(f"{where} is not a row: {role}: {cell[:40]!r} is no number")
            values.append(np.nan if value is None else value)
        joined = "".join(picked)
        points, commas = points or "." in joined, commas or "," in joined
        if points and commas:
            raise UnreadableError(f"{where}: decimal points and decimal commas in one table")
        codes.append(ids.setdefault(cells[who], len(ids)))
        lines.append(number)
    if layout is None:
        raise UnreadableError(f"{file}: no row of numbers")
    table = np.frombuffer(values).reshape(len(lines), len(indices))
    rows = pd.DataFrame(table, pd.Index(lines, name="line"), list(indices))
    rows.insert(0, "id", numbered(file, list(ids), np.frombuffer(codes, dtype=np.int64)))
    return Table(file, head, layout, seen_once(file, rows))


def _lines(file: Path) -> Iterator[tuple[int, str]]:
    """The lines of a text file and their numbers."""
    if any(reading.begins(file, mark) for mark in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise UnreadableError(f"{file}: UTF-16. Save it as UTF-8")
    with reading.open_file(file) as content:
        for number, line in enumerate(reading.lines_of(content, file), start=1):
            text = line.decode("utf-8", "replace").removeprefix("\ufeff").strip()
            if "\r" in text:
                where = f"{file}, line {number}: {text[:60]!r}"
                raise UnreadableError(f"{where} has a carriage return. Lines end in \\n or \\r\\n")
            if number == 1 and re.fullmatch(r"version \d+", text):
                raise UnreadableError(
                    f"{file}: PeTrack's own file, in pixels. Its exported .txt is read"
                )
            yield number, text


def _is_row(text: str, cells: list[str], where: str) -> bool:
    """Tell whether a line is a row, not one of those above."""
    numbers = [value for value in map(number_of, cells) if value is not None]
    there = len(numbers) - int(np.isnan(numbers).sum())
    if text and len(cells) < LEAST_NUMBERS and there == len(cells):
        raise UnreadableError(f"{where} has too few cells for a row")
    return not text.startswith(COMMENTS) and len(numbers) >= LEAST_NUMBERS and there > 1


def _layout(
    file: Path, head: list[str], row: list[str], named: bool, columns: Sequence[str]
) -> Columns:
    """The columns of a table that begins with this row."""
    names, below = _header(head, row)
    if not (names or columns) and named:
        raise UnreadableError(f"{file}: its columns have no names. Give --columns")
    if len(columns) > len(row) or len(row) < len(PLAIN):
        raise UnreadableError(
            f"{file}: its rows have {len(row)} columns. Needed are {' '.join(columns or PLAIN)}"
        )
    inputs = names or [""] * len(row)
    shown = [name or f"column {index_of}" for index_of, name in enumerate(inputs, start=1)]
    stated = list(columns) or names or list(PLAIN)
    roles: dict[str, int] = {}
    units: dict[str, str] = {}
    for index, (role, unit) in enumerate(map(_parsed, stated)):
        if role in NEEDED and role in roles:
            both = f"{shown[roles[role]]} and {shown[index]}"
            raise UnreadableError(f"{file}: {both} could both be {role}. Say which with --columns")
        if role:
            roles.setdefault(role, index)
            if unit := unit or _parsed(shown[index])[1] or below[index]:
                units.setdefault(role, unit)
    missing = [role for role in ("id", "x", "y") if role not in roles]
    missing += [] if {"frame", "time"} & roles.keys() else ["frame or time"]
    if missing:
        raise UnreadableError(
            f"{file}: no column for {', '.join(missing)} among {', '.join(stated)[:200]}. "
            "Give --columns with a word for each, as in 'id frame x y'"
        )
    own = [_parsed(name)[0] for name in names if columns]
    for role in NEEDED:
        if own.count(role) == 1 and role in roles and own.index(role) != roles[role]:
            raise UnreadableError(
                f"{file}: --columns: {role} is {shown[roles[role]]!r}. The file names it otherwise"
            )
    return Columns(shown, roles, units, bool(names))


def _header(head: list[str], row: list[str]) -> tuple[list[str], list[str]]:
    """Of the lines above a row that name its columns the one that has most names known, and the units
    in a line below it."""
    names: list[str] = []
    units, maximum = [""] * len(row), 0
    for text in head:
        bare = text.lstrip("#").strip()
        loose = LOOSE.sub(lambda found: found[1] or "/", bare)
        fitted = (_fitted(cells_of(one), row) for one in (bare, loose))
        cells = next((cells for cells in fitted if len(cells) == len(row)), [])
        if not cells:
            continue
        words = [unit_of(cell) for cell in cells]
        understood = sum(bool(_parsed(cell)[0]) for cell in cells)
        if names and {*words} & (PER_METRE.keys() | TIMES.keys()):
            units = words
        elif understood >= max(maximum, 2 if text.startswith(COMMENTS) else 0):
            names, maximum = cells, understood
    return names, units


def _fitted(cells: list[str], row: list[str]) -> list[str]:
    """The cells above a row, one more or less where only the mark at the end of a line makes it."""
    while len(cells) > len(row) and not cells[-1]:
        cells.pop()
    return [*cells, ""] if len(cells) == len(row) - 1 and not row[-1] else cells


def _parsed(name: str) -> tuple[str, str]:
    """What a name of a column means, empty where it is not known, and its unit."""
    bare = re.sub(r"-PID\d+$", "", name.rpartition(":")[2].strip(' #*$"'))
    found = NAME.fullmatch(bare)
    word, *units = found.groups() if found else (bare,)
    unit = unit_of(next(filter(None, units), ""))
    role = ROLES.get(re.sub(r"[\W_]", "", word.lower()), "")
    return ("", unit) if unit == "px" else (role, unit)


def numbered(file: Path, ids: list[str], codes: Indices) -> Floats:
    """The ids of rows, from 1 in order of appearance where they are texts or too large, which is said;
    codes: of each row the place of its id."""
    values = [number_of(one) for one in ids]
    odd = [value is None or abs(value) >= reading.LARGEST_WHOLE for value in values]
    if any(odd) and not any(value is not None and np.isnan(value) for value in values):
        odd_one = ids[odd.index(True)]
        reading.note(file, f"ids such as {odd_one}: people are numbered from 1 as they appear")
        return np.asarray(codes + 1, dtype=np.float64)
    return np.array(values, dtype=np.float64)[codes]


def seen_once(file: Path, rows: pd.DataFrame) -> pd.DataFrame:
    """Leave out rows without a place and rows that are there twice, which is said. Raises
    UnreadableError for a person in two places at once."""
    unseen = rows[["x", "y"]].isna().all(axis=1)
    keys = [role for role in (*NEEDED, "end_time", "end_x", "end_y") if role in rows]
    again = rows.duplicated(keys) & ~unseen
    for which, what in ((unseen, "rows without a place"), (again, "rows that are there twice")):
        reading.note_unused(file, what, [str(which.sum())] if which.any() else [])
    rows = rows[~(unseen | again)]
    when = "frame" if "frame" in rows else "time"
    twice = rows[rows.duplicated(["id", when])]
    if len(twice):
        who, now = twice[["id", when]].iloc[0]
        raise UnreadableError(f"{file}: {when} {now:g}: person {who:g} occurs twice")
    return rows
