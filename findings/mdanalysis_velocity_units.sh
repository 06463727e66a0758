#!/usr/bin/env bash
# MDAnalysis 2.11.0: DATAReader, DATAWriter and DumpReader (MDAnalysis/coordinates/LAMMPS.py).
# One would guess: a velocity of 1.5 in a LAMMPS data file and in a dump of the same run is one number in the
#   Universe, and written back to a data file it is 1.5 again.
# What happens: the data file is taken as Angstrom/fs and multiplied by 1,000, the dump is not; the writer divides by
#   1,000 in both cases. Data and dump in one Universe, written as data: 0.0015.
# Who is hurt: whoever restarts LAMMPS from a frame of a dump by way of MDAnalysis: people start at 1.5 mm/s; and
#   whoever compares the first frame with the data file.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check MDAnalysis==2.11.0
cd "$t"
printf '%s\n' 'two people' '' '2 atoms' '1 atom types' '' '0 20 xlo xhi' '0 10 ylo yhi' '-0.5 0.5 zlo zhi' '' Masses '' \
  '1 70' '' 'Atoms # atomic' '' '1 1 2 5 0' '2 1 6 5 0' '' Velocities '' '1 1.5 0 0' '2 -1 0 0' > start.data
printf '%s\n' 'ITEM: TIMESTEP' 0 'ITEM: NUMBER OF ATOMS' 2 'ITEM: BOX BOUNDS ff ff pp' '0 20' '0 10' '-0.5 0.5' \
  'ITEM: ATOMS id type x y z vx vy vz' '1 1 2 5 0 1.5 0 0' '2 1 6 5 0 -1 0 0' > run.lammpsdump
"$t/v/bin/python" - <<'E'
import importlib.metadata, sys, warnings
warnings.simplefilter("ignore")
import MDAnalysis
style = {"atom_style": "id type x y z"}
by_data = MDAnalysis.Universe("start.data", **style)
by_dump = MDAnalysis.Universe("start.data", "run.lammpsdump", format="LAMMPSDUMP", **style)
by_dump.atoms.write("again.data")
lines = open("again.data").read().split("Velocities")[1].split()
data, dump, again = float(by_data.atoms.velocities[0, 0]), float(by_dump.atoms.velocities[0, 0]), float(lines[1])
print("MDAnalysis", importlib.metadata.version("MDAnalysis"))
print(f"velocity 1.5: {data:g} from the data file, {dump:g} from the dump, {again:g} in the data file written of it")
holds = (round(data, 3), round(dump, 6), again) == (1500, 1.5, 0.0015)
sys.exit(0 if holds else "the behaviour has changed")
E
