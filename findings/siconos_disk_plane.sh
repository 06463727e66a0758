#!/usr/bin/env bash
# Siconos 4.4.0 (Debian 12), DiskPlanR (mechanics/src/collision/native/bodies/DiskPlanR.cpp, init).
# One would guess: DiskPlanR(r, A, B, C) is the contact of a disc with the endless line A x + B y + C = 0, and
#   DiskPlanR(r, A, B, C, x, y, w) with a piece of it of width w.
# What happens: `init` takes the ends of the line from halfWidth before it is set, so that they are anywhere: mostly
#   both at (0, 0), and the contact is one with this point. A disc of 0.25 m at (5, 0.25), which lies on the line
#   y = 0, is 4.756 m, or 1e232 m, away from it. It falls through, without a word.
# Who is hurt: whoever links discs with walls by four numbers: only a disc above the point rests.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
cd "$t"
packages="python3-siconos libsiconos-numerics7 libsiconos-kernel7 libsiconos-mechanics7 libbullet3.24 libmumps-seq-5.5
libscotch-7.0 liblapacke libtmglib3 libumfpack5 libklu1 libcxsparse3 libsliplu1 libspqr2 libldl2 libbtf1 libmongoose2
librbio2 libgraphblas7 libsiconos-control7 libsiconos-io7 libhdf5-cpp-103-1"
apt-get -o APT::Sandbox::User=root download $packages > log 2>&1 || { cat log; exit 1; }
for one in *.deb; do dpkg -x "$one" root; done
version=$(dpkg-deb -f python3-siconos_*.deb Version)
export LD_LIBRARY_PATH="$t/root/usr/lib/$(gcc -print-multiarch)" PYTHONPATH="$t/root/usr/lib/python3/dist-packages"
/usr/bin/python3 - "$version" <<'E'
import sys
from siconos.mechanics.collision.bodies import DiskPlanR

print("Siconos", sys.argv[1])
kept, far = [], {4: set(), 7: set()}  # of one memory each
for _ in range(20):
    for numbers in ((0.25, 0.0, 1.0, 0.0), (0.25, 0.0, 1.0, 0.0, 0.0, 0.0, 100.0)):
        kept.append(DiskPlanR(*numbers))
        far[len(numbers)].add(float(f"{kept[-1].distance(5.0, 0.25, 0.25):.4g}"))
for count, distances in far.items():
    print(f"of {count} numbers, a disc at (5, 0.25) is from the line, m:", *sorted(distances))
sys.exit(0 if far[7] == {0.0} and far[4] - {0.0} else "the behaviour has changed")
E
