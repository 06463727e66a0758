"""Words in Markdown with slots, and the formats of numbers."""

import importlib
import re
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.pages.numbers import decimals, interval, number, percent, seconds

from analysis.pages.numbers import significant, statistic  # isort: skip
from analysis.pages.section import Verdict
from analysis.pages.words import Words, html_of, words_of

ROOT = Path(__file__).resolve().parents[2]
SOURCE = """
## found
- The error is {{ error | percent }}
  of *k* = {{ stiffness | number }} N/m.
{% for law in laws %}
- Law {{ law }}.
{% endfor %}

## fig_0
One paragraph,
in two lines.

Another.

## table
Errors of {{ count }}
meshes.

| side (m) |
| error of |v| (–) | *k* |

## claim
- where: Fig. 0
- statement: a: b
- reason: {{ count }} of 3
"""


@pytest.fixture
def words(tmp_path, monkeypatch):
    def make(source=SOURCE):
        folder = tmp_path / "worded"
        folder.mkdir(exist_ok=True)
        (folder / "__init__.py").touch()
        (folder / "words.md").write_text(source, encoding="utf-8")
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.delitem(sys.modules, "worded", raising=False)
        importlib.invalidate_caches()
        return Words("worded")

    return make


def test_blocks_are_filled(words):
    read = words()
    assert read.items("found", error=0.123, stiffness=2.5e6, laws="ab") == [
        "The error is 12.3 % of *k* = 2.5·10⁶ N/m.",
        "Law a.",
        "Law b.",
    ]
    assert read.text("fig_0") == "One paragraph, in two lines.\n\nAnother."
    claim = read.claim("claim", Verdict.HOLDS, count=2)
    assert (claim.where, claim.statement, claim.reason) == ("Fig. 0", "a: b", "2 of 3")
    table = read.table("table", [[1.0, 2, 3]], count=2)
    assert (table.caption, table.rows) == ("Errors of 2 meshes.", [[1.0, 2, 3]])
    assert table.head == ["side (m)", "error of |v| (–)", "*k*"]
    everything = words_of("worded", error=0.0, stiffness=1, laws="", count=1)
    assert everything["fig_0"] == read.text("fig_0")
    assert everything["claim"] == ["where: Fig. 0", "statement: a: b", "reason: 1 of 3"]


@pytest.mark.parametrize(
    ("block", "values", "message"),
    [
        ("claim", {"count": 0.1}, r"worded: words.md: claim: 0.1 stands in a slot without"),
        ("claim", {}, "words.md: claim: 'count' is undefined"),
        ("other", {}, "no block other. It has found, fig_0, table, claim"),
    ],
)
def test_a_slot_without_value_or_format_is_refused(words, block, values, message):
    with pytest.raises(ValueError, match=message):
        words().text(block, **values)


def test_a_section_has_its_title_and_words(words):
    read = words("## title\nFour disks\n\n## words\n- {{ count }} of them.\n")
    section = read.section("1", pictures=[], tables=[], count=4)
    assert (section.number, section.title, section.words) == ("1", "Four disks", ["4 of them."])
    assert not section.differs
    more = words("## title\nx\n\n## words\n- y\n\n## differs\n- {{ n }}\n")
    assert more.section("1", pictures=[], tables=[], n=2).differs == ["2"]


def test_a_statement_is_judged_by_its_parts():
    assert Verdict.of(True, True) is Verdict.HOLDS
    assert Verdict.of(True, False) is Verdict.PARTLY
    assert Verdict.of(False) is Verdict.FAILS


def test_a_name_stands_once_and_a_claim_has_three_parts(words):
    with pytest.raises(ValueError, match="two blocks are called a"):
        words("## a\n\n## b\n\n## a\n")
    with pytest.raises(ValueError, match="claim needs the items where, statement and reason"):
        words("## claim\n- where: Fig. 0\n- statement: x\n").claim("claim", Verdict.FAILS)


PAGES = sorted(ROOT.glob("analysis/**/*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}/{page.stem}")
def test_every_words_file_is_in_the_markdown_of_pages(page):
    """No number without a filter's form, no index or power without its marks."""
    slots = r"(?sm)\{\{.*?\}\}|\{%.*?%\}|^## [^\n]*"
    output = re.sub(slots, "", page.read_text("utf-8"))
    assert re.findall(r"(?<![\w`/])[^\W\d_]_\w+|\d[eE][-+]?\d+|\^[({]", output) == []
    lines = page.read_text("utf-8").splitlines()
    assert [line for line in lines if len(line) > 100 and not line.startswith("|")] == []


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("M^−1/2^ u~d~ and `x^2^`", "M<sup>−1/2</sup> u<sub>d</sub> and <code>x^2^</code>"),
        ("a < b <script> & *c*", "a &lt; b &lt;script&gt; &amp; <em>c</em>"),
        ("2^ 3^ ~ 4", "2^ 3^ ~ 4"),
        ("[press](javascript:alert(1))", "[press](javascript:alert(1))"),
        ("[errata](#errata)", '<a href="#errata">errata</a>'),
        ("[x](evil.html) ![x](#x) <http://x.y>", '[x](evil.html) !<a href="#x">x</a> &lt;http://x.y&gt;'),
    ],
)  # fmt: skip
def test_markdown_on_a_page(words, shown):
    assert html_of(words) == shown


@given(st.text(alphabet="<>/&\"'`*_^~[]()!:ab javscript\n"))
def test_no_tag_of_the_text_passes(text):
    tags = set(re.findall(r"<[^>]*>?", str(html_of(text))))
    for tag in tags:
        assert re.fullmatch(r"</?(em|strong|code|sup|sub|a|br)>|<(a|img) [^<>]*>|<br />", tag), tag
        assert "javascript:" not in tag


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        (number(1234.6), "1\u202f235"), (number(-2.5e-7), "−2.5·10⁻⁷"), (number(1e6), "10⁶"),
        (number(None), "–"), (number(float("nan")), "–"), (decimals(-0.125, 1), "−0.1"),
        (significant(0.0500001), "0.05"), (significant(123.456, 4), "123.5"),
        (percent(0.1234), "12.3 %"), (percent(0.1234, 2), "12 %"), (percent(1e-5), "10⁻³ %"),
        (interval((0.5, 0.50001)), "0.5"), (interval((0.25, 3.0)), "0.25 to 3"),
        (statistic("penalty_max", 450.0, "N"), "450 N"),
        (statistic("contact_correlation", 0.98765, "N"), "0.9877"),
        (statistic("closure_error", 0.0012, "N·s"), "0.1 %"),
        (statistic("rank", 3, "N"), "3"),
        (seconds(0.0123), "12 ms"), (seconds(2.345), "2.3 s"), (seconds(1234.5), "1\u202f234 s"),
    ],
)  # fmt: skip
def test_numbers_as_they_stand_on_a_page(written, shown):
    assert written == shown


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300))
def test_a_number_reads_back_to_its_digits(value):
    """At least three digits of any number can be read back from what is written."""
    text = number(value).replace("\u202f", "").replace("−", "-")
    superscripts = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    if "10" in text and text.translate(superscripts) != text:
        lead, _, power = text.rpartition("10")
        sign = -1 if lead == "-" else 1
        factor = float(lead[:-1]) if lead.endswith("·") else sign
        read = factor * float(f"1e{power.translate(superscripts)}")
    else:
        read = float(text)
    assert read == pytest.approx(value, rel=6e-3)
