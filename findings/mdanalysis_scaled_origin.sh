#!/usr/bin/env bash
# MDAnalysis 2.11.0, DumpReader._read_next_timestep (MDAnalysis/coordinates/LAMMPS.py): LAMMPS dumps in xs ys zs.
# One would guess: the columns "x y z" and "xs ys zs" of one snapshot give the same positions.
# What happens: both lose the box's lower corner, though the scaled ones are counted from it already: in a box from
#   10 to 30 x = 12 becomes 2, xs = 0.1 becomes -8. With unwrap_images=True the image is added before the scaling, so
#   that one image of a 20 m box is 400 m away.
# Who is hurt: whoever mixes the two in one study (positions off by the corner), or unwraps scaled dumps.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check MDAnalysis==2.11.0
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys, warnings
warnings.simplefilter("ignore")
import MDAnalysis

def x_of(columns, row, low, **options):
    pathlib.Path("d.lammpsdump").write_text(
        f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp pp\n{low} {low + 20}\n0 10\n0 1\n"
        f"ITEM: ATOMS id type {columns} ix iy iz\n1 1 {row}\n")
    return float(MDAnalysis.Universe("d.lammpsdump", format="LAMMPSDUMP", **options).atoms.positions[0, 0])

print("MDAnalysis", importlib.metadata.version("MDAnalysis"))
plain, scaled = x_of("x y z", "12 5 0.5 0 0 0", 10), x_of("xs ys zs", "0.1 0.5 0.5 0 0 0", 10)
print(f"2 m from the corner of a box 10..30: {plain:g} by x, {scaled:g} by xs")
image, scaled_image = (x_of(c, r, 0, unwrap_images=True) for c, r in
                       (("x y z", "2 5 0.5 1 0 0"), ("xs ys zs", "0.1 0.5 0.5 1 0 0")))
print(f"2 m in image 1 of a box 0..20, unwrapped: {image:g} by x, {scaled_image:g} by xs")
holds = [round(v, 3) for v in (plain, scaled, image, scaled_image)] == [2, -8, 22, 402]
sys.exit(0 if holds else "the behaviour has changed")
E
