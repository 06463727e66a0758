"""Compare the results of two builds: `python tests/same_numbers.py OLD NEW` for two JSON or CSV
files.

Prints every place where a number, a verdict or a status differs, and exits with 1 if there is one.
Seconds, dates, versions and digests may differ, and so may words: of a sentence only the numbers in
it are compared. Claims are found by their statement, tables by their caption, rows by their first
cell and columns by their head, so that what is added moves none of the others. An error that states
its own uncertainty may move within it.
"""

import csv
import json
import math
import re
import sys
from pathlib import Path

TOLERANCE = 1e-6
# Keys whose values differ from run to run.
PASSING = re.compile(
    r"second|cpu|CPU|wall_s|date|version|digest|machine|time_of|per_s\b|made|reused"
    r"|^(mesh|collision)s$"
)
NUMBER = re.compile(r"[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")
# 2·10⁻⁵, 2·10^−5^, 10^(-5) and 10⁻⁵ as they stand on a page, for 2e-05 and 1e-05
POWER = re.compile(r"(?:(?<=\d)(·)|(?<![\d.]))10(?:\^\(?([-−]?\d+)[)^]|([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))")
PLAIN = str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")
THOUSANDS = re.compile(r"(?<=\d)[,\u202f](?=\d{3}(?!\d))")
VERDICTS = {"verdict", "status", "exit_state"}


def read(path):
    """The content of a JSON or CSV file."""
    if path.suffix == ".csv":
        with path.open(newline="") as file:
            return list(csv.DictReader(file))
    return json.loads(path.read_text())


def numbers_in(words):
    """The numbers in a sentence, in order of size, however they are written."""
    words = POWER.sub(lambda m: f"{'' if m[1] else '1'}e{(m[2] or m[3]).translate(PLAIN)}", words)
    words = THOUSANDS.sub("", words.replace("−", "-"))
    return sorted(map(_value, NUMBER.findall(words)), key=str)


def _value(written):
    try:
        return float(written)
    except ValueError:
        return written


def plain(words):
    """Words without markup and spaces, however their numbers are written."""
    words = re.sub(r"(?<=\d)e\+?0*(?=\d)", "e", POWER.sub(r"1e\2\3", words).translate(PLAIN))
    return re.sub(r"[~^_*\s()“”\u202f\xa0-]", "", words)


def named(entries):
    """The entries by their names; None where one has none, or two have the same."""
    names = []
    for entry in entries:
        if isinstance(entry, dict):
            name = entry.get("statement", entry.get("caption"))
            if name is not None and "where" in entry:
                name = f"{entry['figure']} {entry['where'].split(',')[0]} {name}"
        else:
            name = entry[0] if isinstance(entry, list) and entry else None
        if isinstance(name, list | dict | None):
            return None
        names.append(plain(str(name)))
    return dict(zip(names, entries, strict=True)) if len(set(names)) == len(names) else None


def by_column(table):
    """A table with each cell under its head; anything else as it is."""
    if not {"head", "rows"} <= table.keys():
        return table
    positions = [plain(head) for head in table["head"]]
    rows = [dict(zip(positions, row, strict=True)) for row in table["rows"]]
    firsts = [plain(str(row[0])) for row in table["rows"]]
    return {"rows": dict(zip(firsts, rows, strict=True)) if len(set(firsts)) == len(rows) else rows}


def within_bars(key, old, new):
    """Whether an error that states its own uncertainty is the same within that, or the uncertainty
    not ten times what it was."""
    if key.endswith("_bar") and old[key] is not None and new[key] is not None:
        return new[key] <= max(10 * old[key], TOLERANCE)
    bars = [
        side.get(key.replace("total", "model").replace("_error", "_bar")) for side in (old, new)
    ]
    if not key.endswith("_error") or None in (*bars, old[key], new[key]):
        return False
    return abs(old[key] - new[key]) <= sum(bars)


def differences(old, new, where=""):
    """Where the two differ, one line each."""
    if isinstance(old, dict) and isinstance(new, dict):
        old, new = by_column(old), by_column(new)
        for key in old.keys() | new.keys():
            if PASSING.search(key):
                continue
            if key not in old or key not in new:
                yield f"{where}.{key}: only in the {'old' if key in old else 'new'} one"
            elif key in VERDICTS and old[key] != new[key]:
                yield f"{where}.{key}: {old[key]} became {new[key]}"
            elif within_bars(key, old, new):
                continue
            else:
                yield from differences(old[key], new[key], f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list):
        a, b = named(old), named(new)
        if a is not None and b is not None:
            yield from differences(a, b, where)
            return
        if len(old) != len(new):
            yield f"{where}: {len(old)} entries became {len(new)}"
        for index, (a, b) in enumerate(zip(old, new, strict=False)):
            yield from differences(a, b, f"{where}[{index}]")
    elif isinstance(old, str) and isinstance(new, str):
        if numbers_in(old) != numbers_in(new):
            yield f"{where}: {old!r} became {new!r}"
    elif isinstance(old, int | float) and isinstance(new, int | float):
        if not math.isclose(old, new, rel_tol=TOLERANCE, abs_tol=1e-12):
            yield f"{where}: {old} became {new}"
    elif old != new:
        yield f"{where}: {old!r} became {new!r}"


def main(old, new):
    """Print the differences; 1 if there are any."""
    found = sorted(differences(read(Path(old)), read(Path(new))))
    for line in found:
        print(line)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
