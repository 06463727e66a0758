#!/usr/bin/env bash
# PedPy 1.5.1, load_walkable_area_from_crowdit (pedpy/io/crowdit_loader.py).
# One would guess: the outline of a crowd:it floor is the walkable area and further walls are lines in it.
# What happens: with one wall it is the walkable area; as soon as there is a second one, *every* wall, the outline
#   included, is closed and becomes an obstacle in a box 1 mm larger. A hall of 80 m2 with one open partition
#   has 0.036 m2 left: a ring of 1 mm round the building. No error, no warning.
# Who is hurt: whoever takes densities or Voronoi cells in a crowd:it floor of more than one wall.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1 shapely==2.2.0
cd "$t"
outline='<wall id="o"><point x="0" y="0"/><point x="10" y="0"/><point x="10" y="8"/><point x="0" y="8"/><point x="0" y="0"/></wall>'
partition='<wall id="p"><point x="2" y="2"/><point x="2" y="6"/><point x="6" y="6"/></wall>'
echo "<floor><layer id=\"A\">$outline</layer></floor>" > one.floor
echo "<floor><layer id=\"A\">$outline$partition</layer></floor>" > two.floor
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import pedpy, shapely
one, two = (pedpy.load_walkable_area_from_crowdit(geometry_file=pathlib.Path(f"{n}.floor")).polygon
            for n in ("one", "two"))
person = shapely.Point(8, 4)
print("PedPy", importlib.metadata.version("pedpy"))
print(f"outline alone: {one.area} m2, a person at (8, 4) is inside: {one.contains(person)}")
print(f"with a partition: {two.area:.3f} m2, the person is inside: {two.contains(person)}")
holds = one.area == 80 and one.contains(person) and abs(two.area - 0.036) < 1e-3 and not two.contains(person)
sys.exit(0 if holds else "the behaviour has changed")
E
