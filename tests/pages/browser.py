"""A page opened in a real browser from a file:// address."""

import contextlib
import html
import re
import shutil
from collections import defaultdict
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

from playwright.sync_api import sync_playwright

from analysis.pages.html import cell_html, templates
from analysis.studies.paper.page import Built, with_long_tables_apart

NAMES = "chromium", "chromium-browser", "google-chrome"
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
PHONE, HEIGHT = 600, 844
# What a first screen may say.
FIRST_WORDS = 120
# What the paper's two pages may say in all, with everything open: by section, and beside these.
PAPER_WORDS = {
    "1": 270, "2": 300, "3": 265, "4": 1050, "5": 450, "6": 690, "beside": 390,
    "7": 275, "3.2.1": 405, "8": 300, "9": 295, "10": 195, "11": 215, "mesh": 300, "bridge": 400,
    "beside the continuum": 425,
}  # fmt: skip
assert sum(PAPER_WORDS.values()) <= 6225
QUIET = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
]  # fmt: skip


def words(text):
    return len(re.findall(r"[^ \t\n\xa0]*\w[^ \t\n\xa0]*", text))


def says_little(section, folder):
    """A section of the paper's pages has no more words than it may, with its folds open; its long
    tables go to the folder."""
    section = with_long_tables_apart(Built(section=section, cpu_seconds=0), folder, "").section
    title = f"Fig. {section.number}" if section.number[0].isdigit() else ""
    page = templates().get_template("macros.html").module
    shown = page.section(section, defaultdict(lambda: [""]), title)
    inline = re.sub(r"</?(?:a|b|em|span|sub|sup|code)\b[^>]*>", "", shown)
    message = words(html.unescape(re.sub(r"<[^>]*>", " ", inline)))
    assert message <= PAPER_WORDS[section.number], message
    return message


def answers_first(address):
    """On a screen and on a telephone the page begins with a picture and few words, without
    scrolling; and everything works without a mouse."""
    if BROWSER is None:
        return
    for width in (1300, 400):
        with opened(address, width) as page:
            glance = page.locator(".first .glance").first
            assert glance.evaluate("one => one.getBoundingClientRect().bottom") <= HEIGHT
            assert glance.locator("img, canvas").first.is_visible()
            works_by_keyboard(page)
            # the numbers of an axis are a picture
            page.evaluate("document.querySelectorAll('.axis').forEach(one => one.remove())")
            message = page.locator("h1, .first .lead, .first .glance").all_inner_texts()
            assert words(" ".join(message)) <= FIRST_WORDS


def works_by_keyboard(page):
    """Tab comes to whatever can be used, seen where it is, and Enter unfolds."""
    page.evaluate("window.met = new Set(); addEventListener('focusin', one => met.add(one.target))")
    focus = """() => { const one = document.activeElement, kind = one.tagName;
        return [kind, kind === "SUMMARY" && !one.parentNode.open, getComputedStyle(one).outline]}"""
    kind = ""
    while kind != "BODY":
        page.keyboard.press("Tab")
        kind, closed, outline = page.evaluate(focus)
        assert kind == "BODY" or "none" not in outline
        if closed:
            page.keyboard.press("Enter")
            assert not page.evaluate(focus)[1]
    missed = """[...document.querySelectorAll("a[href], button, input, select, summary, [tabindex]")]
        .filter(one => one.checkVisibility() && !met.has(one)).map(one => one.outerHTML)"""
    assert page.evaluate(missed) == []


def rows_of(page, section, caption):
    """The rows of the table of a section whose caption begins so, each head → text."""
    for table in page.locator(f"#{section} table").all():
        if (table.locator("caption").text_content() or "").startswith(caption):
            positions = table.locator("th").all_text_contents()
            return [
                dict(zip(positions, row.locator("td").all_text_contents(), strict=True))
                for row in table.locator("tbody tr").all()
            ]
    raise AssertionError(f"no table '{caption}' in {section}")


def has_its_numbers(section, content):
    """A section, unfolded, has the rows of its short tables, links to the long ones, its warnings,
    no empty cell, and few words."""
    short = [one["rows"] for one in content["tables"] if not one["file"]]
    assert section.locator("table").count() == len(short)
    assert section.locator("tr").count() == sum(len(rows) + 1 for rows in short)
    message = section.text_content()
    for cell in (cell for rows in short for row in rows for cell in row):
        assert isinstance(cell, str) or cell_html(cell) in message
    for one in (one for one in content["tables"] if one["file"]):
        (at,) = section.locator(f"a[href='./{one['file']}']").all()
        file = Path(url2pathname(urlsplit(at.evaluate("a => a.href")).path))
        assert file.read_text().count("\n") == len(one["rows"]) + 1
    assert words(section.inner_text()) <= PAPER_WORDS[section.get_attribute("data-figure")]
    assert section.locator("[role=alert]").count() == bool(content["warnings"])
    assert all(cell.strip() for cell in section.locator("td, th").all_text_contents())


def says_little_beside(page, limit):
    """A page of the paper whose sections are open has few words beside these."""
    page.locator("summary").evaluate_all("all => all.forEach(one => one.parentNode.open = true)")
    sections = page.locator("section[data-figure]").all_inner_texts()
    full = words(page.locator("body").inner_text())
    beside = full - sum(map(words, sections))
    assert beside <= PAPER_WORDS[limit], beside


def has_its_verdicts(page, claims):
    """The page links to each statement by verdict, and says the verdict beside its figure."""
    order = ["does not hold", "holds in part", "holds"]
    for verdict, shown in zip(order, page.locator("[data-verdict]").all(), strict=True):
        mine = [claim for claim in claims if claim["verdict"] == verdict]
        assert shown.get_attribute("data-verdict") == verdict
        assert shown.locator("a").count() == len(mine)
        raised = any("^" in claim["statement"][:50] for claim in mine)
        assert (shown.locator("a sup").count() > 0) == raised
        assert not set("^~*`") & set(shown.inner_text())
        for claim in mine:
            beside = page.locator(f"[data-figure='{claim['figure']}'] .claims").inner_text()
            assert verdict in beside.lower()


@contextlib.contextmanager
def opened(address, width):
    """The page, on a screen so many pixels wide; it must load offline and without complaint, with
    all its pictures, and not scroll sideways."""
    assert address.startswith("file://")
    complaints, requested = [], []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=QUIET)
        page = browser.new_page(viewport={"width": width, "height": HEIGHT})
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: requested.append(request.url))
        page.goto(address)
        yield page
        missing = "[...document.images].filter(i => !i.complete || !i.naturalWidth).length"
        assert page.evaluate(missing) == 0
        ids = page.locator("[id]:not(svg *)").evaluate_all("all => all.map(one => one.id)")
        assert len(set(ids)) == len(ids)
        # nothing scrolls sideways, and no value is off the screen
        width = page.viewport_size["width"]
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        if width < PHONE:
            right = "[...document.querySelectorAll('td')].map(t => t.getBoundingClientRect().right)"
            assert page.evaluate(f"Math.max(0, ...{right})") <= width
        browser.close()
    assert complaints == []
    assert all(url.startswith(("file:", "data:")) for url in requested), requested
