"""Licences and versions: said once, and the same wherever they are repeated."""

import re
import tomllib
from importlib import metadata

import pytest
import yaml

from tests.docs.documented import ROOT


def name_of(requirement):
    return re.split(r"[<>=!~; \[]", requirement)[0]


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
SHIPPED = map(EXTRAS.get, ("engines", "continuum", "pages", "real", "exchange"))
LIBRARIES = [name_of(line) for part in (PROJECT["dependencies"], *SHIPPED) for line in part]
PAGE = (ROOT / "docs/licences.md").read_text(encoding="utf-8")
FAMILIES = ("Lesser|LGPL", "General Public|GPL", "BSD", "MPICH", "MIT", "Python Software|PSF")


def rows():
    """What the tables of the page say: package → licence."""
    return dict(re.findall(r"^\| ([\w-]+) \| ([^|]+) \|", PAGE, flags=re.MULTILINE))


def family(words):
    return next(kind for kind in FAMILIES if re.search(kind, words))


@pytest.mark.parametrize("package", LIBRARIES)
def test_the_licence_of_a_dependency_is_the_one_that_it_states_itself(package):
    stated = metadata.metadata(package)
    words = [
        stated.get("License-Expression") or "",
        *(line for line in stated.get_all("Classifier") or [] if "License" in line),
        (stated.get("License") or "").strip()[:80],
    ]
    assert family(rows()[package]) == family(" ".join(words))


def test_no_other_row():
    assert set(rows()) - set(LIBRARIES) == {"program", "library"}
    tests = {name_of(line) for line in EXTRAS["test"] + EXTRAS["docs"]}
    assert all(re.search(rf"\b{package}\s\(", PAGE) for package in tests)


def test_one_version_and_one_licence():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    newest = re.search(r"^## ([\d.]+)", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    assert {cited["version"], newest[1]} == {PROJECT["version"]}
    assert cited["license"] == PROJECT["license"] == "BSD-3-Clause"
    assert (ROOT / "LICENSE").read_text().startswith("BSD 3-Clause License\n")
    (author,) = PROJECT["authors"]
    assert cited["authors"] == [author]
    assert author["name"] in (ROOT / "LICENSE").read_text()
    (paper,) = cited["references"]
    assert paper["doi"] in (ROOT / "README.md").read_text(encoding="utf-8")
