"""Where the scenes, decks, scripts and errata of the product are."""

import sysconfig
from pathlib import Path


def shipped(name: str) -> Path:
    """`scenes`, `lammps_inputs`, `yade_scripts` or `docs/errata.md`: of the checkout, or what an
    installed wheel put under share/."""
    beside = Path(__file__).resolve().parents[2] / name
    return (
        beside
        if beside.exists()
        else Path(sysconfig.get_path("data")) / "share" / "crowd-percussions" / name
    )


def or_shipped(path: Path) -> Path:
    """Give a path as it is, or the product's own file of that name where there is none:
    `scenes/gate_excerpt.txt`, from any folder."""
    if path.parts[:1] != ("scenes",) or ".." in path.parts or path.exists():
        return path
    own = shipped(str(path))
    return own if own.is_file() else path
