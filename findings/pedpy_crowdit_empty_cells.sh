#!/usr/bin/env bash
# PedPy 1.5.1, load_trajectory_from_crowdit (pedpy/io/crowdit_loader.py, read_csv(...).dropna()).
# One would guess: of a crowd:it CSV only pedID, time, posX and posY matter ("at least" these, says the help).
# What happens: rows are dropped where *any* column is empty, also one that PedPy does not use. Where a further
#   column is filled for some people only, the others are gone: half the crowd, no error, no warning.
# Who is hurt: whoever adds a column (group, note, destination) and then takes density or flow: both are too low.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import pedpy
people = []
for group in (None, ""):  # no such column, then one which only the persons 3 and 4 have filled
    rows = ["pedID,time,posX,posY" + ("" if group is None else ",group")]
    rows += [f"{p},{i / 10},{i / 10},{p}" + ("" if group is None else ",school" if p > 2 else ",")
             for p in (1, 2, 3, 4) for i in range(20)]
    pathlib.Path("c.csv").write_text("\n".join(rows) + "\n")
    data = pedpy.load_trajectory_from_crowdit(trajectory_file=pathlib.Path("c.csv")).data
    people.append(sorted(data["id"].unique().tolist()))
print("PedPy", importlib.metadata.version("pedpy"))
print("four people without the further column:", people[0])
print("with a column filled for the persons 3 and 4 only:", people[1])
holds = people == [[1, 2, 3, 4], [3, 4]]
sys.exit(0 if holds else "the behaviour has changed")
E
