"""DART: `Contact.force` of `World.getLastCollisionResult()`. Bodies move by a joint in the plane, so that nothing
leaves it. Steps are 1 ms, its default: at 5 ms gravity alone is above its speed of sleep. Variant awake: no sleep."""

import dartpy as dart
import numpy as np
from record import Record, scene, variant

world, number = dart.simulation.World(), {}
world.setGravity([*scene.gravity, 0])
world.setTimeStep(0.001)
if variant == "awake":
    options = world.getDeactivationOptions()
    options.mEnabled = False
    world.setDeactivationOptions(options)


def body_of(k, shape, joint):
    skeleton = dart.dynamics.Skeleton(str(k))
    joint, body = getattr(skeleton, f"create{joint}AndBodyNodePair")()
    node = body.createShapeNode(shape)
    node.createCollisionAspect()
    node.createDynamicsAspect().setFrictionCoeff(scene.friction)
    return skeleton, joint, body


for k, (x, y, nx, ny) in enumerate(scene.walls):
    skeleton, joint, body = body_of(-1 - k, dart.dynamics.BoxShape([198 if ny else 2, 198 if nx else 2, 9]), "WeldJoint")
    position = np.eye(4)
    position[:2, 3] = x - nx, y - ny
    joint.setTransformFromParentBodyNode(dart.math.Isometry3(position))
    world.addSkeleton(skeleton)
moving = []
for k, (x, y, r, m, vx, vy) in enumerate(scene.bodies):
    skeleton, joint, body = body_of(k, dart.dynamics.SphereShape(r), "PlanarJoint" if scene.turns else "TranslationalJoint2D")
    inertia = np.eye(3) * 0.4 * m * r * r
    body.setInertia(dart.dynamics.Inertia(m, [0, 0, 0], inertia))
    skeleton.setPositions([x, y, 0][: skeleton.getNumDofs()])
    skeleton.setVelocities([vx, vy, 0][: skeleton.getNumDofs()])
    world.addSkeleton(skeleton)
    moving.append(skeleton)


def of(thing):
    return int(thing.getShapeFrame().asShapeNode().getBodyNodePtr().getSkeleton().getName())


record = Record(dart.__version__, 0.001 * scene.substeps)
for step in record.steps():
    for _ in range(scene.substeps):
        world.step()
    contacts = world.getLastCollisionResult().getContacts()
    listed = [(of(c.collisionObject2), of(c.collisionObject1), *c.force[:2]) for c in contacts]
    state = [np.append(np.r_[one.getPositions()[:2], one.getVelocities()], 0.0)[:5] for one in moving]
    record.frame(step, state, [row for row in listed if max(row[:2]) >= 0])
