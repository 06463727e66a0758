"""What the code reads beside itself goes into the wheel."""

import re
import tomllib
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["data-files"]


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
