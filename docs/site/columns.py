"""Print docs/columns.md from the declarations of the code that writes the columns:
python docs/site/columns.py > docs/columns.md."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT)]

from analysis.support.columns import declared, markdown  # noqa: E402

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
    tables = {name: markdown(name) for name in declared()}
    first, rest = tables["film"], tables.pop("numbers").split("\n", 2)[2]
    return PAGE.format(**tables | {"film": f"{first}\n{rest}"})


if __name__ == "__main__":
    sys.stdout.write(page())
