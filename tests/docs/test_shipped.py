"""What the code reads beside itself goes into the wheel."""

import re
import tomllib
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]
SETUPTOOLS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
SHIPPED = SETUPTOOLS["data-files"]


def test_everything_shipped_is_in_the_wheel():
    read = {
        PurePosixPath(name)
        for path in (ROOT / "analysis").rglob("*.py")
        for name in re.findall(r'shipped\("([^"]+)"\)', path.read_text())
    }
    assert PurePosixPath("docs/errata.md") in read
    for name in read:
        place = name if (ROOT / name).is_dir() else name.parent
        patterns = SHIPPED[f"share/crowd-percussions/{place}"]
        files = {path for pattern in patterns for path in ROOT.glob(pattern)}
        assert files
        assert (ROOT / name).is_dir() or ROOT / name in files


def test_everything_in_the_packages_is_in_the_wheel():
    """What is no Python is there only by a pattern of package-data."""
    patterns = SETUPTOOLS["package-data"]
    forgotten = []
    for package in SETUPTOOLS["packages"]["find"]["include"]:
        for path in (ROOT / package.removesuffix("*")).rglob("*.*"):
            if path.suffix == ".py" or "__pycache__" in path.parts or path.is_dir():
                continue
            homes = [home for home in path.parents if (home / "__init__.py").exists()]
            name = ".".join(homes[0].relative_to(ROOT).parts)
            given = {
                file for pattern in (*patterns["*"], *patterns.get(name, ()))
                for file in homes[0].glob(pattern)
            }  # fmt: skip
            if path not in given:
                forgotten.append(str(path.relative_to(ROOT)))
    assert forgotten == []
    assert {"nscd*", "analysis*", "crowd_percussions*"} == {
        *SETUPTOOLS["packages"]["find"]["include"]
    }
