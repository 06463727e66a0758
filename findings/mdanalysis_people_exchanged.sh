#!/usr/bin/env bash
# MDAnalysis 2.11.0, LammpsDumpParser and DumpReader (topology/LAMMPSParser.py, coordinates/LAMMPS.py).
# One would guess: a row of the Universe is one id for the whole dump, or a dump where ids change is refused
#   (as it is where their number changes).
# What happens: each frame is sorted by its own ids and the names are those of the first frame. When one particle
#   leaves and another enters, their number is the same, and all rows behind it move up: id, mass and type belong to
#   somebody else, displacements jump by the distance between people. No error, no warning.
# Who is hurt: whoever reads a flow with deletion and insertion (a doorway fed from behind) through MDAnalysis.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check MDAnalysis==2.11.0
cd "$t"
cat > d.lammpsdump <<'E'
ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS ff ff pp
0 20
0 10
-0.5 0.5
ITEM: ATOMS id type mass x y z
1 1 70 9.9 5 0
2 1 80 5 5 0
3 1 90 1 5 0
ITEM: TIMESTEP
1
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS ff ff pp
0 20
0 10
-0.5 0.5
ITEM: ATOMS id type mass x y z
2 1 80 5.1 5 0
3 1 90 1.1 5 0
4 1 50 0.1 5 0
E
"$t/v/bin/python" - <<'E'
import importlib.metadata, sys, warnings
warnings.simplefilter("ignore")
import MDAnalysis
atoms = (universe := MDAnalysis.Universe("d.lammpsdump", format="LAMMPSDUMP")).atoms
first = {int(i): float(x) for i, x in zip(atoms.ids, atoms.positions[:, 0].round(3))}
universe.trajectory[1]
then = {int(i): float(x) for i, x in zip(atoms.ids, atoms.positions[:, 0].round(3))}
print("MDAnalysis", importlib.metadata.version("MDAnalysis"))
print(f"id 2 of 80 kg walks from 5.0 to 5.1 m; read: from {first[2]:.1f} to {then[2]:.1f} m")
print(f"id 1 has left, yet is at {then[1]:.1f} m; ids {atoms.ids.tolist()}, masses {atoms.masses.tolist()}")
holds = (abs(first[2] - 5) < 1e-3 and abs(then[2] - 1.1) < 1e-3 and abs(then[1] - 5.1) < 1e-3
         and atoms.ids.tolist() == [1, 2, 3] and atoms.masses.tolist() == [70, 80, 90])
sys.exit(0 if holds else "the behaviour has changed")
E
