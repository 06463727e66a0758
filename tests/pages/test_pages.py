"""Pages as they are rendered: nothing of a file name or a title becomes more than text."""

import base64
import http.server
import re
import threading
from pathlib import Path

import pytest
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from playwright.sync_api import sync_playwright

from analysis.pages.drawing import add_scale, for_telephone, panels
from analysis.pages.html import cell_html, cell_kind, render, write_pictures
from analysis.pages.section import Claim, Picture, Section, Table
from tests.pages.browser import BROWSER, QUIET

ROOT = Path(__file__).resolve().parents[2]


def page_of(section, images=()):
    first = Section(number="first", title="none")
    about = {"name": "row", "first": first, "folds": [section], "command": "percussions <report>"}
    return render("push.html", images=dict(images), **about)


def test_a_file_named_like_a_script_is_a_file():
    files = ["javascript:alert(1).csv", "data:text,x.csv", 'a"b.csv']
    words = ["[press](javascript:alert(1)) <script>alert(1)</script>"]
    title = '<b onclick="x">title</b>'
    page = page_of(Section(number="scene", title=title, introduction=words, files=files))
    links = re.findall(r'href="([^"]*)"', page)
    assert "./javascript%3Aalert%281%29.csv" in links
    assert "./a%22b.csv" in links
    assert all(re.match(r"\./|#|data:,$", link) for link in links)
    assert "<script" not in page
    assert "<b onclick" not in page


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_data_of_others_call_nobody(tmp_path):
    """Pictures and links in titles, notes, names of walls, sources and file names are text; and were
    there a way in, the page's policy would hold: nothing is loaded, no foreign script runs."""
    requested = []

    class Server(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            requested.append(self.path)

    with http.server.HTTPServer(("127.0.0.1", 0), Server) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        away = f"http://127.0.0.1:{server.server_port}/x.png"
        evil = f"![a]({away}) [b]({away}) <{away}> [c]: {away} <img src={away}> [d][c]"
        section = Section(
            number="scene", title=evil, introduction=[evil], words=[evil], warnings=[evil],
            tables=[Table(caption=evil, head=[evil], rows=[[evil]])],
            files=[evil],
            claims=[Claim(where=evil, statement=evil, reason=evil, verdict="holds")],
        )
        page = page_of(section)
        assert not re.search(r"<img|href=.?(http|//)", page)
        (tmp_path / "page.html").write_text(page, encoding="utf-8")
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=BROWSER, args=QUIET)
            shown = browser.new_page()
            shown.goto((tmp_path / "page.html").as_uri())
            assert evil in shown.locator("#scene summary").text_content()
            calls = f"""new Promise(end => {{
                let count = 0;
                setTimeout(() => end(count), 5000);
                document.addEventListener("securitypolicyviolation", () => {{
                    if (++count === 4) end(count); }});
                new Image().src = "{away}";
                fetch("{away}").catch(() => 0);
                const [script, style] = ["script", "link"].map(t => document.createElement(t));
                script.textContent = "document.title = 'run'";
                Object.assign(style, {{ rel: "stylesheet", href: "{away}" }});
                document.body.append(script, style); }})"""
            assert shown.evaluate(calls) == 4
            assert shown.title() != "run"
            browser.close()
        server.shutdown()
    assert requested == []


def test_every_page_has_the_policy():
    for template in (ROOT / "analysis/pages/templates").glob("*.html"):
        content = template.read_text()
        full = "<html" in content
        assert full == (template.name == "page.html")
        assert full or "<script" not in content or "{% block scripts %}" in content


def test_a_table_says_in_each_cell_under_which_head_it_stands():
    rows = [[1.0, "solved"], [2e-7, "failed"]]
    table = Table(caption="c", head=["x~d~ (m)", "status"], rows=rows)
    page = page_of(Section(number="s", title="t", tables=[table]))
    assert page.count('data-head="xd (m)"') == 2
    assert '<td class="name alarm" data-head="status">failed</td>' in page
    assert '<td class="name" data-head="status">solved</td>' in page
    assert "2·10⁻⁷" in page


@pytest.mark.parametrize(
    ("cell", "shown", "kind"),
    [
        *((cell, shown, "") for cell, shown in ((0.05, "0.05"), (1 / 3, "0.3333"), (12, "12"))),
        *((cell, shown, "") for cell, shown in (("–", "–"), ("1.2 %", "1.2\xa0%"))),
        ("[Time in a corridor](#corridor_fast)", None, "name"),
        ("a sentence that is long enough to be wrapped", None, "words"),
    ],
)
def test_cells(cell, shown, kind):
    assert cell_kind(cell, "head") == kind
    if shown is not None:
        assert cell_html(cell) == shown


def test_a_picture_for_a_telephone_stands_beside_the_other(tmp_path):
    width, narrow = Figure(figsize=(4, 1)), Figure(figsize=(1, 4))
    both, (left, right) = panels(9, 4, 1, 2, sharey=True)
    left.set(ylabel="force (N)", aspect="equal")
    add_scale(both, right, Normalize(0, 1), "shade")
    pictures = [
        Picture(name="panels", caption="two", figure=width, narrow=narrow),
        Picture(name="one", caption="one", figure=Figure(figsize=(2, 2))),
        Picture(name="side_by_side", caption="wide", figure=both),
    ]
    section = Section(number="both", title="both", pictures=pictures)
    images = write_pictures([section], tmp_path)

    def shape(png):
        return [round(int.from_bytes(base64.b64decode(png)[k : k + 4]) / 150) for k in (16, 20)]

    assert [shape(png) for name in images for png in images[name]][:3] == [[4, 1], [1, 4], [2, 2]]
    for_telephone(Figure())  # has nothing to turn
    # a wide figure of two panels has them below each other, each with its label
    assert [shape(png) for png in images["side_by_side"]] == [[9, 4], [4, 9]]
    high, low = left.get_tightbbox(), right.get_tightbbox()
    assert high.y0 > low.y1
    assert min(high.x0, low.x0) > 0
    assert right.get_ylabel() == "force (N)"
    page = page_of(section, images)
    first, _ = re.findall(r'<source media="([^"]*)" srcset="data:image/png;base64,([^"]*)">', page)
    assert first == ("screen and (max-width: 40rem)", images["panels"][1])
    assert {path.name for path in tmp_path.iterdir()} == {
        f"{name}.{kind}" for name in images for kind in ("png", "pdf")
    }  # fmt: skip
