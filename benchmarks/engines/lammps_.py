"""LAMMPS: `compute pair/local` of pairs (its force is the normal part, p1 and p2 the tangential one) and the arrays
of `fix wall/gran … contacts`. Variants: the pair style, and planes or one region as walls. `hooke` has no
tangential spring. Bodies that do not turn have plain `fix nve`."""

import math
import subprocess
import sys
from pathlib import Path

from record import Record, folder, scene, variant

style, kind = variant.split()
kn, g, mu = scene.stiffness, scene.gravity, scene.friction
law = f"{kn} 0 80 40 {mu} 1" if style == "gran/hooke" else (
    f"hooke {kn} 80 tangential linear_history {kn * 2 / 7} 0.5 {mu} damping mass_velocity")  # fmt: skip
wall_law = f"hooke {law}" if style == "gran/hooke" else f"granular {law}"
axes = [("x" if nx else "y", nx + ny > 0, x if nx else y) for x, y, nx, ny in scene.walls]
if kind == "plane":
    ends = [f"{axis}plane {at if low else 'NULL'} {'NULL' if low else at}" for axis, low, at in axes]
    walls = [f"fix w{k} all wall/gran {wall_law} {end} contacts" for k, end in enumerate(ends)]
else:
    lo, hi = ({axis: at for axis, low, at in axes if low == want} for want in (True, False))
    box = " ".join(f"{lo.get(axis, 'INF')} {hi.get(axis, 'INF')}" for axis in "xy")
    walls = [f"region room block {box} INF INF side in", f"fix w0 all wall/gran/region {wall_law} region room contacts"]
fixes = [line.split()[1] for line in walls if line.startswith("fix")]
record = Record("", scene.fine_step_s * scene.substeps)
atoms = [f"create_atoms 1 single {x} {y} 0\nset atom {k} diameter {2 * r} mass {m} vx {vx} vy {vy}"
         for k, (x, y, r, m, vx, vy) in enumerate(scene.bodies, 1)]  # fmt: skip
n, h, first = "\n", scene.substeps, record.first * scene.substeps
(folder / "in.deck").write_text(Path(__file__).with_name("head.in").read_text() + f"""region box block -9 9 -9 9 -0.5 0.5
create_box 1 box
{n.join(atoms)}
pair_style {style if style == "granular" else f"{style} {law}"}
pair_coeff * * {law if style == "granular" else ""}
{n.join(walls)}
fix move all nve{"/sphere disc" if scene.turns else ""}
fix 2d all enforce2d
fix g all gravity {math.hypot(*g)} vector {g[0]} {g[1]} 0
timestep {scene.fine_step_s}
compute ids all property/local patom1 patom2 cutoff radius
compute f all pair/local fx fy p1 p2 cutoff radius
run {first}
dump b all custom {h} bodies.txt id x y vx vy omegaz {" ".join(f"f_{fix}[{k}]" for fix in fixes for k in (1, 2, 3, 5, 6))}
dump_modify b sort id format float %.17g
dump c all local {h} pairs.txt c_ids[1] c_ids[2] c_f[1] c_f[2] c_f[3] c_f[4]
dump_modify c format float %.17g
run {(record.last - record.first) * h}
""")
lmp = Path(sys.executable).with_name("lmp")
output = subprocess.run([lmp, "-in", "in.deck", "-log", "none"], cwd=folder, capture_output=True, text=True, check=False)
if output.returncode:
    sys.exit(output.stdout[-900:])
record.named(output.stdout.split("(", 1)[1].split(")")[0])


def frames(name):
    """Give the rows of each frame of a dump as numbers."""
    for text in (folder / name).read_text().split("ITEM: TIMESTEP\n")[1:]:
        lines = text.splitlines()
        yield int(lines[0]), [[float(word) for word in line.split()] for line in lines[8:]]


def wall_of(x, y):
    """The wall that a point of contact is on."""
    return min(range(len(axes)), key=lambda k: abs({"x": x, "y": y}[axes[k][0]] - axes[k][2]))


for (step, bodies), (_, pairs) in zip(frames("bodies.txt"), frames("pairs.txt"), strict=True):
    listed = [(int(j) - 1, int(i) - 1, fx + tx, fy + ty) for i, j, fx, fy, tx, ty in pairs]
    for k, row in enumerate(bodies):
        for on, fx, fy, x, y in (row[at : at + 5] for at in range(6, len(row), 5)):
            if on:
                listed.append((k, -1 - wall_of(x, y), -fx, -fy))
    record.frame(step // h, [row[1:6] for row in bodies], listed, same=True)
