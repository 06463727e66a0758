"""What the page of engines says is judged by `audit` on the engines that are here."""

import pandas as pd
import pytest

from benchmarks.engines.__main__ import engines, row_of
from benchmarks.engines.page import PAGE, table_of

pytestmark = pytest.mark.long


@pytest.mark.parametrize(
    ("name", "variant", "scene", "faults"),
    [
        ("rigid", "default", "substeps", ""),
        ("rigid", "default", "lift", ""),
        ("lammps", "granular plane", "creep", ""),
        ("lammps", "granular plane", "substeps", ""),
        ("lammps", "granular region", "substeps", "walls missing"),
        ("yade", "default", "creep", ""),
    ],
)
def test_an_engine_is_judged(tmp_path, name, variant, scene, faults):
    """Walls of one region have one row for a disc that touches two: its supports do not add up."""
    (engine,) = (one for one in engines(tmp_path) if one.name == name)
    if not engine.is_installed:
        pytest.skip(f"{name} is not installed")
    row = row_of(engine, variant, scene, tmp_path / scene)
    assert row.get("status") == ("differs" if faults else "agrees"), row
    assert faults in row["verdict"]
    # μ = 0.5 holds a body on 10°; a sliding one goes 3 − μ g t along the floor, and stays on it
    along = {"creep": 0.0, "lift": 3 - 0.5 * 9.81 * 0.2}.get(scene)
    if along is not None:
        assert row["creep_m_per_s"] == pytest.approx(along, rel=0.01, abs=1e-3)
        assert row["lift_m"] <= 1e-6


def test_the_page_is_that_of_its_verdicts():
    rows = pd.read_csv(PAGE.parent / "tables" / "engines.csv", keep_default_na=False)
    assert table_of(rows) in PAGE.read_text(encoding="utf-8")
