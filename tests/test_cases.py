"""Small files of other programs and of users, each with its right value or its message: one folder or
`.toml` file a case in `data/cases/`.

    why = "what the case stands for"
    [files]                  # beside those of the folder
    "pair.dump" = '''…'''
    [[run]]                  # one after the other, in one folder
    command = "solve pair.dump"
    exit = 0                 # where left out
    says = ['regular expression']    # in what is printed, or said beside it
    never = ['…']
    writes = false           # no file is made; and a refusal is one line
    [[run.values]]           # numbers of a table that is written
    file = "contacts.csv"
    column = "force_N"
    where = {is_wall = 1}    # rows that count; all where left out
    of = "each"              # or sum, largest, count
    are = [750.0]
    within = 1e-9            # relative to the largest; where left out 1e-6"""

import csv
import re
import shlex
import shutil
import tomllib
from pathlib import Path

import pytest

CASES = Path(__file__).parent / "data" / "cases"
REDUCE = {"each": list, "sum": lambda x: [sum(x)], "largest": lambda x: [max(x)],
          "count": lambda x: [len(x)]}  # fmt: skip


def cell(text):
    try:
        return float(text)
    except ValueError:
        return text


def numbers_of(folder, file, column, where=(), of="each"):
    """The numbers of a column, in rows with these cells."""
    with (folder / file).open(encoding="utf-8", newline="") as table:
        rows = [{name: cell(text) for name, text in row.items()} for row in csv.DictReader(table)]
    rows = [row for row in rows if all(row[name] == value for name, value in dict(where).items())]
    return REDUCE[of]([row[column] for row in rows])


@pytest.mark.parametrize("case", sorted(CASES.iterdir()), ids=lambda path: path.stem)
def test_case(percussions, tmp_path, case):
    manifest = case
    if case.is_dir():
        shutil.copytree(case, tmp_path, dirs_exist_ok=True)
        manifest = case / "case.toml"
        (tmp_path / "case.toml").unlink()
    content = tomllib.loads(manifest.read_text(encoding="utf-8"))
    assert content["why"]
    for name, text in content.get("files", {}).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert content["run"]
    for run in content["run"]:
        before, status = set(tmp_path.rglob("*")), run.get("exit", 0)
        made = percussions(*shlex.split(run["command"]))
        printed = made.stdout + made.stderr
        assert made.returncode == status, printed
        assert [one for one in run.get("says", []) if not re.search(one, printed)] == [], printed
        assert [one for one in run.get("never", []) if re.search(one, printed)] == [], printed
        if not run.get("writes", True):
            assert set(tmp_path.rglob("*")) == before
            if status:
                sentences = [one for one in made.stderr.splitlines() if not one.startswith("note: ")]
                assert len(sentences) == 1, sentences
        for value in run.get("values", []):
            within, right = value.pop("within", 1e-6), value.pop("are")
            found = numbers_of(tmp_path, **value)
            scale = max(map(abs, right), default=1.0) or 1.0
            assert found == pytest.approx(right, rel=0, abs=within * scale), value
