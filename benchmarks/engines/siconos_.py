"""Siconos: `lambda_(1)` of each interaction after `computeOneStep`, an impulse in the frame of the contact, turned by
the relation's Jacobian. Native discs and planes; discs that do not turn have a large inertia."""

import subprocess

import numpy as np
import siconos.kernel as sk
import siconos.numerics as sn
from record import Record, scene
from siconos.mechanics.collision.bodies import Disk, DiskDiskR, DiskPlanR

h = scene.step_s / scene.substeps
model = sk.NonSmoothDynamicalSystem(0, scene.until_s + 1)
law = sk.NewtonImpactFrictionNSL(0.0, 0.0, scene.friction, 2)
discs, selected = [], []  # arrays that are given by their address
for x, y, r, m, vx, vy in scene.bodies:
    disc = Disk(r, m, [x, y, 0.0], [vx, vy, 0.0])
    selected += [np.diag([m, m, 1e9]), np.array([m * scene.gravity[0], m * scene.gravity[1], 0.0])]
    if not scene.turns:
        disc.setMassPtr(selected[-2])
    disc.setFExtPtr(selected[-1])
    model.insertDynamicalSystem(disc)
    discs.append(disc)
linked = []
for j, (_, _, r, *_) in enumerate(scene.bodies):
    for k, (x, y, nx, ny) in enumerate(scene.walls):
        linked.append((j, -1 - k, DiskPlanR(r, nx, ny, -(nx * x + ny * y), x, y, 198.0), (discs[j],)))
    for i in range(j):
        linked.append((i, j, DiskDiskR(scene.bodies[i][2], r), (discs[i], discs[j])))
contacts = []
for one, two, relation, between in linked:
    contact = sk.Interaction(law, relation)
    model.link(contact, *between)
    contacts.append((one, two, relation, contact))
problem = sk.FrictionContact(2, sn.SICONOS_FRICTION_2D_NSGS)
problem.numericsSolverOptions().dparam[sn.SICONOS_DPARAM_TOL] = 1e-12
problem.numericsSolverOptions().iparam[sn.SICONOS_IPARAM_MAX_ITER] = 100000
moreau = sk.MoreauJeanOSI(0.5)
simulation = sk.TimeStepping(model, sk.TimeDiscretisation(0, h), moreau, problem)
known = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "python3-siconos"], capture_output=True, text=True, check=False)
record = Record(known.stdout or "not a package of Debian")
for step in record.steps():
    for _ in range(scene.substeps):
        simulation.computeOneStep()
        rows = []
        for one, two, relation, contact in contacts:
            impulse = np.array(contact.lambda_(1))
            if impulse.any():
                first = (np.array(relation.jachq())[:, :3].T @ impulse / h)[:2]
                rows.append((one, two, -first[0], -first[1]))
        simulation.nextStep()
    record.frame(step, [(*one.q()[:2], *one.velocity()) for one in discs], rows)
