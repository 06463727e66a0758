// planck (Box2D 2 in JavaScript): the impulses of `post-solve` along the normal and the tangent of the world
// manifold, asked for in `pre-solve` (variant) or in `post-solve`, as the documented callback suggests.
import { h, installed, mu, run, scene, variant, version } from "./record.mjs";

const { World, Vec2, Circle, Box } = installed("planck");
const world = new World({ gravity: Vec2(...scene.gravity) }), of = new Map();
scene.walls.forEach(([x, y, nx, ny], k) => {
  const body = world.createBody({ position: Vec2(x - nx, y - ny) });
  of.set(body.createFixture({ shape: new Box(ny ? 99 : 1, nx ? 99 : 1), friction: mu }), -1 - k);
});
const bodies = scene.bodies.map(([x, y, r, m, vx, vy], k) => {
  const body = world.createBody({ type: "dynamic", position: Vec2(x, y), linearVelocity: Vec2(vx, vy), fixedRotation: !scene.turns });
  of.set(body.createFixture({ shape: new Circle(r), density: m / (Math.PI * r * r), friction: mu, restitution: 0 }), k);
  return body;
});
let listed = [];
const normals = new Map(), normal = (contact) => ({ ...contact.getWorldManifold(null).normal });
world.on("pre-solve", (contact) => normals.set(contact, normal(contact)));
world.on("post-solve", (contact, { normalImpulses, tangentImpulses }) => {
  const n = variant === "pre-solve" ? normals.get(contact) : normal(contact);
  for (let k = 0; k < contact.getManifold().pointCount; k++) {
    const [a, b] = [normalImpulses[k] / h, tangentImpulses[k] / h];
    listed.push([of.get(contact.getFixtureA()), of.get(contact.getFixtureB()), a * n.x + b * n.y, a * n.y - b * n.x]);
  }
});
run(version("planck"), {
  step() { listed = []; world.step(h); },
  state: () => bodies.map((one) => [one.getPosition().x, one.getPosition().y, one.getLinearVelocity().x, one.getLinearVelocity().y, one.getAngularVelocity()]),
  listed: () => listed,
});
