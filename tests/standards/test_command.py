"""The command `percussions standards`."""

import csv
import json
import re

import pytest

from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.studies.standards import page
from analysis.studies.standards.cases import CASES, Judged


def rows_of(folder):
    with (folder / "standards.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.long
def test_pages_tables_and_status(percussions, tmp_path):
    chosen = ("--case", "corridor", "--case", "corner")
    done = percussions("standards", *chosen, "--out", "mine")
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "mine"
    content = json.loads((folder / "standards.json").read_text(encoding="utf-8"))
    assert {key: one["result"] for key, one in content["tests"].items()} == {
        "corridor": "pass", "corner": "pass",
    }  # fmt: skip
    # jostling of 0.06 m/s over 40 s
    ends = content["tests"]["corridor"]["numbers"]["speed_m_per_s"]
    assert ends == [pytest.approx(1, abs=0.03)] * 2
    rows = rows_of(folder)
    assert {row["result"] for row in rows} == {"pass", "not applicable"}
    assert [row["quantity"] for row in rows[:3]] == [
        "speed_m_per_s least", "speed_m_per_s most", "out least",
    ]  # fmt: skip
    text = (folder / "standards.html").read_text(encoding="utf-8")
    assert re.findall(r'<section id="(\w+)"', text)[:3] == ["result", "corridor", "corner"]
    assert "2 of 2 tests pass" in text
    assert (folder / "figures" / "corner.png").stat().st_size > 5_000
    done = percussions("standards", *chosen[:2], "--out", "mine")
    assert done.returncode == 0, done.stderr


def test_a_failed_run_is_a_failed_test(percussions, tmp_path, monkeypatch):
    """The runs of the first test, with an engine that ends with an error."""

    def ends(run, progress=None):
        raise EngineError("it ended")

    monkeypatch.setattr(EngineRun, "record", ends)
    monkeypatch.setattr(page, "run_ahead", lambda *_: {})
    tested = page.run_tests(page.choose(["corridor"]), "rigid", tmp_path)
    assert [(one.result, one.words["found"]) for one in tested] == [("fail", "it ended")]
    written = page.write_page(tested, "rigid", tmp_path, "percussions standards")
    assert "it ended" in written.read_text(encoding="utf-8")
    assert rows_of(tmp_path)[0]["value"] == "it ended"


def test_a_row_for_each_run():
    judged = Judged(True, {"last_s": {0: (1.0, 2.0)}, "crossed": {0: (100, 100)}})
    tested = page.Tested(case=CASES["counterflow"], tracks=(), judged=judged)
    rows = list(page._rows([tested], []))
    assert [row[-2:] for row in rows[:3]] == [
        ("last_s 0 least", 1.0),
        ("last_s 0 most", 2.0),
        ("crossed 0 least", 100),
    ]


def test_messages_and_help(percussions):
    for words, says in (
        (("--case", "nonsense"), "case: unknown 'nonsense'"),
        (("--engine", "nonsense"), "nonsense"),
    ):
        done = percussions("standards", *words)
        assert done.returncode == 1
        assert done.stderr.count("\n") == 1
        assert says in done.stderr
    done = percussions("standards", "--help")
    assert "percussions standards --case corridor" in done.stdout
