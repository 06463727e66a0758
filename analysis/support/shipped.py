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
