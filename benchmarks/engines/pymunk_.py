"""pymunk: `Arbiter.total_impulse` in `post_solve` of each pair, over the step."""

import pymunk
from record import Record, scene

space, shapes = pymunk.Space(), {}
space.gravity = scene.gravity
for k, (x, y, nx, ny) in enumerate(scene.walls):
    a, b = ((x - nx - 99 * s * ny, y - ny + 99 * s * nx) for s in (-1, 1))
    shapes[pymunk.Segment(space.static_body, a, b, 1.0)] = -1 - k
for k, (x, y, r, m, vx, vy) in enumerate(scene.bodies):
    body = pymunk.Body(m, m * r * r / 2 if scene.turns else float("inf"))
    body.position, body.velocity = (x, y), (vx, vy)
    space.add(body)
    shapes[pymunk.Circle(body, r)] = k
for shape in shapes:
    shape.friction = scene.friction**0.5  # of two it takes the product
    space.add(shape)
bodies, listed = space.bodies, []


def after(arbiter, *_):
    first, second = (shapes[one] for one in arbiter.shapes)
    x, y = arbiter.total_impulse
    listed.append((second, first, x / h, y / h))  # it is on the first


space.on_collision(post_solve=after)
record = Record(pymunk.version)
h = record.step / scene.substeps
for step in record.steps():
    for _ in range(scene.substeps):
        listed.clear()
        space.step(h)
    record.frame(step, [(*b.position, *b.velocity, b.angular_velocity) for b in bodies], listed, same=True)
