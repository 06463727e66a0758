"""PyBullet: `getContactPoints` after `stepSimulation`: normal force and two of friction. Spheres are set back
into the plane where rounding let them leave it; those that do not turn have no inverse inertia."""

from importlib.metadata import version

import pybullet as p
from record import Record, scene

p.connect(p.DIRECT)
p.setGravity(*scene.gravity, 0)
p.setPhysicsEngineParameter(fixedTimeStep=scene.step_s, numSubSteps=scene.substeps if scene.substeps > 1 else 0)
number, mu = {}, scene.friction**0.5  # of two it takes the product
for k, (x, y, nx, ny) in enumerate(scene.walls):
    body = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[99 if ny else 1, 99 if nx else 1, 9]),
                             basePosition=[x - nx, y - ny, 0])  # fmt: skip
    number[body] = -1 - k
for k, (x, y, r, m, vx, vy) in enumerate(scene.bodies):
    body = p.createMultiBody(m, p.createCollisionShape(p.GEOM_SPHERE, radius=r), basePosition=[x, y, 0])
    p.resetBaseVelocity(body, [vx, vy, 0])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0, rollingFriction=0, spinningFriction=0)
    if not scene.turns:
        p.changeDynamics(body, -1, localInertiaDiagonal=[0, 0, 0])
    number[body] = k
for body in number:
    p.changeDynamics(body, -1, lateralFriction=mu, restitution=0)
bodies = [body for body, k in number.items() if k >= 0]


def state(body):
    (x, y, _), _ = p.getBasePositionAndOrientation(body)
    (vx, vy, _), (*_, spin) = p.getBaseVelocity(body)
    return x, y, vx, vy, spin


def force(point):
    """On the first: its normal points from the second to the first."""
    normal, size, one, along, other, across = point[7], *point[9:14]
    return [size * n + one * a + other * b for n, a, b in zip(normal, along, across, strict=True)][:2]


record = Record(version("pybullet"))
for step in record.steps():
    p.stepSimulation()
    listed = [(number[c[2]], number[c[1]], *force(c)) for c in p.getContactPoints()]
    for body in bodies:
        (x, y, z), turned = p.getBasePositionAndOrientation(body)
        if z:
            (vx, vy, _), (*_, spin) = p.getBaseVelocity(body)
            p.resetBasePositionAndOrientation(body, [x, y, 0], turned)
            p.resetBaseVelocity(body, [vx, vy, 0], [0, 0, spin])
    record.frame(step, [state(body) for body in bodies], listed)
