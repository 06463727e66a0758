"""Where the scenes, decks and scripts of the product are."""

from __future__ import annotations

import sysconfig
from pathlib import Path


def shipped(folder: str) -> Path:
    """`scenes`, `lammps_inputs` or `yade_scripts`: of the checkout, or what an installed wheel put
    under share/."""
    beside = Path(__file__).resolve().parents[2] / folder
    return (
        beside
        if beside.is_dir()
        else Path(sysconfig.get_path("data")) / "share" / "crowd-percussions" / folder
    )
