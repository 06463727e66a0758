"""docs/errata.md and the tests name each other, completely."""

import ast
import re
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAGE = (HERE.parents[1] / "docs" / "errata.md").read_text()
ENTRIES = re.split(r"^### ", PAGE, flags=re.MULTILINE)[1:]


def written_tests():
    """path::name of every test of the errata but those of this file."""
    names = []
    for path in sorted(HERE.glob("test_*.py")):
        if path != Path(__file__).resolve():
            functions = [
                node
                for node in ast.parse(path.read_text()).body
                if isinstance(node, ast.FunctionDef)
            ]
            names += [
                f"tests/errata/{path.name}::{f.name}"
                for f in functions
                if f.name.startswith("test_")
            ]
    return names


def test_page_names_exactly_the_tests_that_exist():
    named = Counter(re.findall(r"`(tests/errata/\w+\.py::\w+)`", PAGE))
    assert named == Counter(written_tests())


def test_every_entry_has_its_four_parts_and_a_test():
    assert ENTRIES
    for entry in ENTRIES:
        assert re.findall(r"^[-*] \*\*(\w+)\*\*:\s", entry, re.MULTILINE) == [
            "Printed",
            "Correct",
            "Why",
            "Test",
        ], entry
        assert "::test_" in entry.split("* **Test**:")[1], entry
