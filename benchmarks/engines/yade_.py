"""YADE: `phys.normalForce + phys.shearForce` of each interaction, on its second body, after a step. Law
ViscElMat; velocities are half a step behind, so that frames hold the force between two of them."""

# ruff: noqa: F405

import math

import yade
from record import Record, scene
from yade import O, utils
from yade.wrapper import *  # noqa: F403

c, kn = 2 * 40.0 * 75 / 2, scene.stiffness  # of half the mass
O.materials.append(ViscElMat(kn=2 * kn, ks=2 * kn * 2 / 7, cn=2 * c, cs=0, frictionAngle=math.atan(scene.friction), density=1))
for x, y, nx, _ in scene.walls:
    O.bodies.append(utils.wall((x, y, 0), axis=0 if nx else 1, sense=0))
walls, g = len(scene.walls), Vector3(*scene.gravity, 0)
for x, y, r, m, vx, vy in scene.bodies:
    body = O.bodies[O.bodies.append(utils.sphere((x, y, 0), r))]
    body.state.mass, body.state.inertia = m, (0.5 * m * r * r,) * 3
    body.state.blockedDOFs = "zXY" if scene.turns else "zXYZ"
    body.state.vel = Vector3(vx, vy, 0) - g * scene.fine_step_s / 2
bodies = [O.bodies[k] for k in range(walls, len(O.bodies))]
O.dt = scene.fine_step_s
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()], [Ip2_ViscElMat_ViscElMat_ViscElPhys()],
                    [Law2_ScGeom_ViscElPhys_Basic()]),
    NewtonIntegrator(gravity=g, damping=0),
]  # fmt: skip


def of(number):
    return number - walls if number >= walls else -1 - number


def state(body):
    (x, y, _), (vx, vy, _) = body.state.pos, body.state.vel
    return x, y, vx, vy, body.state.angVel[2]


record = Record(yade.config.version, scene.fine_step_s * scene.substeps)
for step in record.steps():
    before = [state(body) for body in bodies]
    for _ in range(scene.substeps):
        before = [state(body) for body in bodies]
        O.step()
    if record.wanted(step):
        forces = [(i.id1, i.id2, i.phys.normalForce + i.phys.shearForce) for i in O.interactions if i.isReal]
        record.frame(step, before, [(of(a), of(b), f[0], f[1]) for a, b, f in forces], same=True)
