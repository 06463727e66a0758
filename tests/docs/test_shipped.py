"""What the code reads beside itself goes into the wheel."""

import re
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]
BUILD = (ROOT / "CMakeLists.txt").read_text()
PATTERNS = re.findall(r'"([\w/*]+\.\w+)"', BUILD[BUILD.index("foreach(files") :])


def test_everything_shipped_is_in_the_wheel():
    """What is in the packages themselves is there without being named."""
    read = {
        PurePosixPath(name)
        for path in (ROOT / "analysis").rglob("*.py")
        for name in re.findall(r'shipped\("([^"]+)"\)', path.read_text())
    }
    assert PurePosixPath("docs/errata.md") in read
    files = {path for pattern in PATTERNS for path in ROOT.glob(pattern)}
    for name in read:
        assert ROOT / name in files | {path.parent for path in files}, name
