"""Pages as they are rendered: nothing of a file name or a title becomes more than text."""

import base64
import re

import pytest
from matplotlib.figure import Figure

from analysis.pages.html import cell_html, cell_kind, href, render, write_pictures
from analysis.pages.section import Picture, Section, Table


def page_of(section, images=()):
    return render(
        "report.html",
        firsts=[],
        sections=[section],
        images=dict(images),
        command="percussions <report>",
    )


def test_a_file_named_like_a_script_is_a_file():
    page = page_of(
        Section(
            number="scene",
            title='<b onclick="x">title</b>',
            introduction=["[press](javascript:alert(1)) <script>alert(1)</script>"],
            files=["javascript:alert(1).csv", "data:text,x.csv", 'a"b.csv'],
        )
    )
    links = re.findall(r'href="([^"]*)"', page)
    assert "./javascript%3Aalert%281%29.csv" in links
    assert "./a%22b.csv" in links
    assert all(re.match(r"\./|#|numbers\.json$|data:,$", link) for link in links)
    assert "<script" not in page
    assert "<b onclick" not in page


@pytest.mark.parametrize(
    ("name", "link"), [("a b.png", "./a%20b.png"), ("figures/x.png", "./figures/x.png")]
)
def test_names_of_files_in_links(name, link):
    assert href(name) == link


def test_a_table_says_in_each_cell_under_which_head_it_stands():
    table = Table(
        caption="c", head=["x~d~ (m)", "status"], rows=[[1.0, "solved"], [2e-7, "failed"]]
    )
    page = page_of(Section(number="s", title="t", tables=[table]))
    assert page.count('data-head="xd (m)"') == 2
    assert '<td class="name alarm" data-head="status">failed</td>' in page
    assert '<td class="name" data-head="status">solved</td>' in page
    assert "2·10⁻⁷" in page


@pytest.mark.parametrize(
    ("cell", "shown", "kind"),
    [
        (0.05, "0.05", ""),
        (1 / 3, "0.3333", ""),
        (12, "12", ""),
        ("–", "–", ""),
        ("1.2 %", "1.2 %", ""),
        ("LAMMPS", "LAMMPS", "name"),
        ("a sentence that is long enough to be wrapped", None, "words"),
    ],
)
def test_cells(cell, shown, kind):
    assert cell_kind(cell, "head") == kind
    if shown is not None:
        assert cell_html(cell) == shown


def test_a_picture_for_a_telephone_stands_beside_the_other(tmp_path):
    wide, narrow = Figure(figsize=(4, 1)), Figure(figsize=(1, 4))
    section = Section(
        number="both",
        title="both",
        pictures=[
            Picture(name="panels", caption="two", figure=wide, narrow=narrow),
            Picture(name="one", caption="one", figure=Figure(figsize=(2, 2))),
        ],
    )
    images = write_pictures([section], tmp_path)
    shapes = {
        name: [
            tuple(int.from_bytes(base64.b64decode(png)[k : k + 4]) // 150 for k in (16, 20))
            for png in every
        ]
        for name, every in images.items()
    }
    assert shapes == {"panels": [(4, 1), (1, 4)], "one": [(2, 2)]}
    page = page_of(section, images)
    (source,) = re.findall(r'<source media="([^"]*)" srcset="data:image/png;base64,([^"]*)">', page)
    assert source == ("screen and (max-width: 40rem)", images["panels"][1])
    assert {path.name for path in tmp_path.iterdir()} == {
        "panels.png", "panels.pdf", "one.png", "one.pdf"
    }  # fmt: skip
