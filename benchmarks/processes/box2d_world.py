"""A crowd in Box2D 3, step by step over a pipe; run by the Python that has box2d-python (3.12 or newer).

Usage: python box2d_world.py GIVEN.npz. For each line of n pairs of velocities (float64, bytes) on
standard input, Box2D makes one step and answers on standard output: CPU seconds of b2World_Step
alone, the number of contacts, positions and velocities, and of each contact first, second (−1: a
wall), normal, separation before the step (m) and percussion of the step (N·s), all float64."""

import sys
import time

import numpy as np
from box2d._box2d import ffi, lib

file = np.load(sys.argv[1])
position, radius, mass = file["position"], file["radius"], file["mass"]
step, substeps, n = float(file["step"]), int(file["substeps"]), len(file["radius"])

world_given = lib.b2DefaultWorldDef()
world_given.gravity = (0.0, 0.0)
world_given.enableSleep = False
world = lib.b2CreateWorld(ffi.new("b2WorldDef *", world_given))


def body_at(x, y, moves):
    inputs = lib.b2DefaultBodyDef()
    inputs.type = lib.b2_dynamicBody if moves else lib.b2_staticBody
    inputs.position, inputs.fixedRotation = (x, y), True
    return lib.b2CreateBody(world, ffi.new("b2BodyDef *", inputs))


def shape(density):
    inputs = lib.b2DefaultShapeDef()
    inputs.density, inputs.friction, inputs.restitution = density, 0.0, 0.0
    return ffi.new("b2ShapeDef *", inputs)


ground = body_at(0.0, 0.0, False)
for (x, y), (z, w) in zip(file["start"], file["end"], strict=True):
    lib.b2CreateSegmentShape(ground, shape(1.0), ffi.new("b2Segment *", ((x, y), (z, w))))
bodies, location = [], {}
for i in range(n):
    body = body_at(*map(float, position[i]), True)
    circle = ffi.new("b2Circle *", ((0.0, 0.0), float(radius[i])))
    one = lib.b2CreateCircleShape(body, shape(float(mass[i] / (np.pi * radius[i] ** 2))), circle)
    bodies.append(body)
    location[one.index1] = i

room = ffi.new("b2ContactData[64]")


def contacts():
    found = []
    for i, body in enumerate(bodies):
        for c in range(lib.b2Body_GetContactData(body, room, 64)):
            one = location.get(room[c].shapeIdA.index1, -1)
            other = location.get(room[c].shapeIdB.index1, -1)
            manifold = room[c].manifold
            if i != max(one, other) or manifold.pointCount == 0:
                continue  # once a pair
            point, sign = manifold.points[0], 1.0
            if one < 0:
                one, other, sign = other, one, -1.0
            normal = sign * manifold.normal.x, sign * manifold.normal.y
            found.append((one, other, *normal, point.separation, substeps * point.normalImpulse))
    return np.array(found, dtype=float).reshape(-1, 6)


while line := sys.stdin.buffer.read(16 * n):
    for body, (x, y) in zip(bodies, np.frombuffer(line).reshape(n, 2), strict=True):
        lib.b2Body_SetLinearVelocity(body, (x, y))
    started = time.process_time()
    lib.b2World_Step(world, step, substeps)
    seconds = time.process_time() - started
    at = [lib.b2Body_GetPosition(body) for body in bodies]
    by = [lib.b2Body_GetLinearVelocity(body) for body in bodies]
    state = np.array([[(p.x, p.y) for p in at], [(v.x, v.y) for v in by]])
    in_contact = contacts()
    sys.stdout.buffer.write(np.array([seconds, len(in_contact)]).tobytes())
    sys.stdout.buffer.write(state.tobytes() + in_contact.tobytes())
    sys.stdout.buffer.flush()
