"""The table of a push trial: rows of heads as a file has them."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.support.reading import read_text

NEEDED = ("id", "time", "x", "y")


class TrialError(ValueError):
    """A trial that cannot be read; the message names the file and what is wrong in it."""


def read_table(file: Path) -> pd.DataFrame:
    """Read a table of heads: id, time (s), x, y (m) as numbers, other columns as they are, by the
    numbers of their lines; each person once at a time.

    Cells stand between commas, semicolons or tabs; lines that begin with # are comments, unless the
    names of the columns follow it. Raises TrialError naming the file, the line and the column."""
    table = _cells(file)
    missing = [name for name in NEEDED if name not in table.columns]
    if missing:
        raise TrialError(
            f"{file}: no column {', '.join(missing)}; needed are {', '.join(NEEDED)}, there are "
            f"{', '.join(map(str, table.columns))[:200]}"
        )
    for name in NEEDED:
        numbers = pd.to_numeric(table[name], errors="coerce")
        words = table[name].notna() & numbers.isna()
        if words.any() or (name in ("id", "time") and not np.isfinite(numbers).all()):
            row = int(np.argmax(words | ~np.isfinite(numbers)))
            raise TrialError(
                f"{file}, line {table.index[row]}: {name}: "
                f"{str(table[name].iloc[row])[:40]!r} is not a number"
            )
        table[name] = numbers
    twice = table.duplicated(["id", "time"])
    if twice.any():
        first = table[twice].iloc[0]
        raise TrialError(f"{file}: person {first.id:g} is there twice at {first.time:g} s")
    return table


def _cells(file: Path) -> pd.DataFrame:
    """The table of a file, its rows by the numbers of their lines: cells between commas, semicolons
    or tabs, of which its head has most; lines that begin with # are comments, unless it is the
    head."""
    lines = list(enumerate(read_text(file).splitlines(), start=1))
    named = [one for one in lines if set(NEEDED) <= set(_words(one[1]))]
    kept = [one for one in lines if one[1].strip() and not one[1].lstrip().startswith("#")]
    head = min([*named[:1], *kept[:1]], default=None)
    if head is None:
        raise TrialError(f"{file}: there is no row in it")
    rows = [one for one in kept if one[0] > head[0]]
    mark = max(",;\t", key=head[1].count)
    text = "\n".join(line for _, line in [head, *rows])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # cells that it would drop
            table = pd.read_csv(io.StringIO(text), sep=mark, skipinitialspace=True, index_col=False)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, pd.errors.ParserWarning) as error:
        raise TrialError(f"{file}: no table: {error}".splitlines()[0]) from None
    names = [name.strip('# "') for name in head[1].split(mark)]
    if twice := next((name for name in NEEDED if names.count(name) > 1), None):
        raise TrialError(f"{file}, line {head[0]}: two columns are called {twice}")
    table.columns = [str(name).strip().lstrip("#").strip() for name in table.columns]
    if len(table) != len(rows):
        raise TrialError(f"{file}: a quotation mark that is not closed")
    table.index = pd.Index([number for number, _ in rows])
    return table


def _words(line: str) -> list[str]:
    """The names in a line that may be the head."""
    return re.split(r"[\s,;#\"]+", line)


def of_person(table: pd.DataFrame, one: float, column: str) -> object:
    """Give what a column says of a person, first; None where it says nothing."""
    if column not in table:
        return None
    found = table.loc[table.id == one, column].dropna()
    return found.iloc[0] if len(found) else None
