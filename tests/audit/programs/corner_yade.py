"""Six disks pressed into a corner, in YADE: bodies.dump, and contacts.csv of its interactions."""

import math
from pathlib import Path

import export_contacts
from yade import Vector3, utils
from yade import wrapper as yade

O = yade.Omega()  # noqa: E741  (YADE's name)
O.materials.append(yade.ViscElMat(kn=4e4, ks=1.2e4, cn=600, cs=0, frictionAngle=math.atan(0.4), density=1, label="m"))
for x, y in ((0.24, 0.245), (0.73, 0.26), (0.25, 0.74), (0.74, 0.745), (1.24, 0.25), (0.5, 1.2)):
    body = utils.sphere((x, y, 0), 0.25, material="m")
    body.state.mass, body.state.inertia = 75, Vector3(1, 1, 1) * 0.5 * 75 * 0.25**2
    body.state.vel, body.state.blockedDOFs = (-0.5, -0.4, 0), "zXY"
    O.bodies.append(body)
for centre, size in (((-0.5, 2, 0), (0.5, 5, 1)), ((2, -0.5, 0), (5, 0.5, 1))):
    O.bodies.append(utils.box(centre, size, fixed=True, material="m"))
shapes = [yade.Ig2_Sphere_Sphere_ScGeom(), yade.Ig2_Box_Sphere_ScGeom()]
laws = [yade.Ip2_ViscElMat_ViscElMat_ViscElPhys()], [yade.Law2_ScGeom_ViscElPhys_Basic()]
O.engines = [
    yade.ForceResetter(), yade.InsertionSortCollider([yade.Bo1_Sphere_Aabb(), yade.Bo1_Box_Aabb()]),
    yade.InteractionLoop(shapes, *laws), yade.NewtonIntegrator(damping=0, gravity=(-2, -1.4, 0)),
]  # fmt: skip
O.dt = 5e-4
HEAD = "NUMBER OF ATOMS\n6\nITEM: BOX BOUNDS ff ff pp\n-9 9\n-9 9\n-1 1\nITEM: ATOMS id x y radius mass vx vy omegaz"
bodies = []
for _ in range(200):
    O.step()
    bodies.append(f"ITEM: TIMESTEP\n{O.iter}\nITEM: {HEAD}")
    for k, one in enumerate(O.bodies[k].state for k in range(6)):
        numbers = one.pos[0], one.pos[1], 0.25, 75, one.vel[0], one.vel[1], one.angVel[2]
        bodies.append(f"{k + 1} " + " ".join(map(repr, numbers)))
    export_contacts.add()
Path("bodies.dump").write_text("\n".join(bodies) + "\n")
export_contacts.write()
