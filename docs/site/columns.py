"""Print docs/columns.md from the declarations of the code that writes the columns:
python docs/site/columns.py > docs/columns.md."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT)]

from analysis.compare import comparison  # noqa: E402
from analysis.engines import energy  # noqa: E402
from analysis.exchange import fclib  # noqa: E402
from analysis.exposure import loads, places, sensors  # noqa: E402
from analysis.film import summary  # noqa: E402
from analysis.infer import page as infer  # noqa: E402
from analysis.measured import page as measured  # noqa: E402
from analysis.motion import pairwise  # noqa: E402
from analysis.paper import page as paper  # noqa: E402
from analysis.percussions import table  # noqa: E402
from analysis.push import page as push  # noqa: E402
from analysis.report import designs  # noqa: E402
from analysis.stability import page as stability  # noqa: E402
from analysis.standards import page as standards  # noqa: E402
from analysis.support import frames  # noqa: E402
from analysis.work_precision import point, whole_runs  # noqa: E402
from benchmarks.problems import score  # noqa: E402

TABLES = {
    "solve": table.COLUMNS, "fclib": fclib.BARE, "compare": comparison.CONTACTS,
    "film": summary.HEAD, "numbers": summary.NUMBERS, "exposure": loads.LOADS,
    "along": places.ALONG, "places": places.PLACES,
    "limits": loads.LIMITS_HEAD, "sensors": sensors.SENSORS, "windows": pairwise.WINDOWS,
    "window_contacts": pairwise.WINDOW_CONTACTS, "points": point.POINTS,
    "whole_runs": whole_runs.COLUMNS, "cells": stability.CELL_COLUMNS,
    "boundaries": stability.BOUNDARY_COLUMNS, "push": push.CASES, "score": score.COLUMNS,
    "designs": designs.COLUMNS, "replicates": designs.RUNS,
    "standards": standards.COLUMNS, "measured": measured.TABLE, "infer": infer.COLUMNS, "claims": paper.CLAIMS,
    "impulses": frames.IMPULSE_COLUMNS,
    "energy": energy.ENERGY, "losses": energy.CONTACTS,
}  # fmt: skip
PAGE = """\
# Columns

Every column of every CSV file, printed from the code (`python docs/site/columns.py`). SI units, all
digits. An empty cell or `nan` is no number. `first` and `second` are ids of disks. If `is_wall` is
1, `second` is the number of the wall in the scene's order, from 1.

## `percussions solve … --out contacts.csv`

One row per contact and frame, as in `to_dataframe()`. Empty columns are not written.

{solve}

An FCLIB file without bodies gives these, in its own units:

{fclib}

## `SCENE_ENGINE_kSTIFFNESS.csv` of a report, `comparison.csv` of a run

One row per contact that either model has. `_N`: a driven crowd at an instant, force against p/τ.
`_Ns`: an impact, ∫f dt against p.

{compare}

## `differences.csv` and `designs.csv` of `percussions report … --compare`

One row per design and quantity, and in `designs.csv` per replicate, too ([designs](results/designs.md)).

{designs}

`designs.csv`:

{replicates}

## `film.csv` of `percussions film`

One row per run (or radius of a filmed crowd), frame and model. An empty bound does not exist, or
was not computed ([films](results/film.md)).

{film}

## `exposure_people.csv`, `exposure_walls.csv`, `exposure_crowd.csv` of `percussions exposure`

One row per window and person, wall, or crowd ([exposure](results/exposure.md)).

{exposure}

## `exposure_outline.csv` and `exposure_places.csv` of `percussions exposure`

One row per place along an outline of joined walls, and one per window and place.

{along}

{places}

## `exposure_limits.csv` of `percussions exposure`

One row per limit and person, wall, or crowd.

{limits}

## `sensors.csv` of `percussions exposure RUN --sensors FILE`

One row per reading, sensor and part ([sensors](results/exposure.md#sensors)).

{sensors}

## `windows.csv` and `window_contacts.csv` of two runs

Written by `percussions compare RUN_A RUN_B` into the folder of the second run. One row per window
(and contact). Of two files `NAME_frames.csv` and `NAME_frame_contacts.csv` have a row per frame:
`time_s`, and forces in N.

{windows}

`window_contacts.csv`:

{window_contacts}

## `points.csv`, `pareto.csv`, `scaling.csv` of a chart

One row per method, setting and quantity. Errors are root mean squares over that of the rigid
reference.

{points}

## `whole_runs.csv` of a chart

One row per engine, setting and statistic.

{whole_runs}

## `cells.csv` and `boundaries.csv` of `percussions stability`

`cells.csv`:

{cells}

`boundaries.csv`:

{boundaries}

## `standards.csv` of `percussions standards`

One row per test and number; several runs of one test have theirs behind the name.

{standards}

## `scores.csv` of `percussions push`

{push}

`onsets.csv` has the onsets, measured and of each model's nearest case: s after the first person.

## `measured.csv` of `percussions measured`

One row per step and model.

{measured}

## `runs.csv` of `percussions infer`

{infer}

## `scores.csv` of `benchmarks/library.py score`

{score}

## `claims.csv` and `continuum_claims.csv` of `percussions paper`

{claims}

`errata.csv` and `continuum_errata.csv` have `where`, `printed`, `correct` and `why` of the
[errata](errata.md).

## `impulses.dump` of a run

A LAMMPS dump: one row per contact that pressed since the frame before. LAMMPS and YADE write it
with `impulses = true` under `[run]`.

{impulses}

Over the time between the frames this is a mean force, as in the rigid engine's `contacts.dump`.

## `energy.csv`, `energy.dump` of a run

{energy}

{losses}
"""


def page() -> str:
    """Return docs/columns.md."""
    tables = {name: one.table() for name, one in TABLES.items()}
    first, rest = tables["film"], tables.pop("numbers").split("\n", 2)[2]
    return PAGE.format(**tables | {"film": f"{first}\n{rest}"})


if __name__ == "__main__":
    sys.stdout.write(page())
