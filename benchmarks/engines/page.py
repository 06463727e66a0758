"""Writes the table of `docs/results/engines.md` from a run: python -m benchmarks.engines.page [out/engines/engines.csv]"""

import re
import shutil
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

import pandas as pd

PAGE = Path(__file__).parents[2] / "docs/results/engines.md"
SHOWN = {"corner": "corner", "impacts": "impacts", "sleep": "asleep, 5 s", "substeps": "4 substeps", "supports": "supports"}


def cell(verdict: str) -> str:
    """Give a verdict for the page: what is not explained where forces agree, else the fault."""
    if not re.fullmatch(r"\de[+-]\d+", verdict):
        return f"**{'none' if 'no contact' in verdict else verdict.replace('% not explained', ' %')}**"
    front, power = verdict.split("e")
    small = str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{100 * float(verdict):g} %" if float(verdict) >= 1e-3 else f"{front}·10{small}".removeprefix("1·")


def table_of(rows: pd.DataFrame) -> str:
    """Give the table in Markdown. Variants of an engine whose cells are of one kind share a line, of the worst."""
    known, lines = tomllib.loads((Path(__file__).with_name("engines.toml")).read_text(encoding="utf-8")), defaultdict(list)
    for (engine, _), one in rows.set_index("scene").groupby(["engine", "variant"], sort=False):
        kinds = (re.sub(r".*(%|10).*", r"\1", text) if text[0] != "*" else text for text in map(cell, one.verdict[[*SHOWN]]))
        lines[engine, *kinds].append(one)
    text = [f"|engine|its documentation|{'|'.join(SHOWN.values())}|creep|lift|", "|" + "---|" * (len(SHOWN) + 4)]
    for (engine, *_), ones in sorted(lines.items(), key=lambda item: [*known].index(item[0][0])):
        inputs, variants = known[engine], ", ".join(one.variant.iloc[0] for one in ones)
        name = f"{inputs['title']} {re.split(r' - |[+]', ones[0].version.iloc[0])[0].replace(' ', '')}, {variants}"
        message = f"[{inputs['says']}]({inputs['docs']})"
        worst = [max((one.verdict[scene] for one in ones), key=lambda v: float(v) if v[1] == "e" else 0) for scene in SHOWN]
        creep = max(one.creep_m_per_s["creep"] for one in ones)
        lift = max(one.lift_m["lift"] - one.lift_m["creep"] for one in ones)  # above its height at rest
        moved = (f"{1e3 * x:.1f}".replace("-0.0", "0.0") for x in (creep, lift))
        text.append(f"|{'|'.join([name.removesuffix(', default'), message, *map(cell, worst), *moved])}|")
    return "\n".join(text)


if __name__ == "__main__":
    run = Path(*sys.argv[1:2] or ["out/engines/engines.csv"])
    table = table_of(pd.read_csv(run, keep_default_na=False))
    PAGE.write_text(re.sub(r"(?ms)^\|.*^\|[^\n]*", lambda _: table, PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    shutil.copy(run, PAGE.parent / "tables" / "engines.csv")
