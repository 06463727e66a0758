// matter.js: `normalImpulse` and `tangentImpulse` of the contacts of `engine.pairs.list` after `Engine.update`, in
// its units of mass times length in a step, so that they are divided by h². The sign is not documented.
import { h, installed, mu, run, scene, version } from "./record.mjs";

const { Engine, Bodies, Body, Composite } = installed("matter-js");
const engine = Engine.create({ gravity: { x: scene.gravity[0], y: scene.gravity[1], scale: 1e-6 }, enableSleeping: false });
const S = 100; // lengths are in cm, near the pixels that its slops are made for
const of = new Map(), material = { friction: mu, frictionAir: 0, restitution: 0 };
engine.gravity.scale *= S;
scene.walls.forEach(([x, y, nx, ny], k) => {
  const wall = Bodies.rectangle(S * (x - nx), S * (y - ny), S * (ny ? 198 : 2), S * (nx ? 198 : 2), { isStatic: true, ...material });
  Composite.add(engine.world, wall);
  of.set(wall, -1 - k);
});
const bodies = scene.bodies.map(([x, y, r, m, vx, vy], k) => {
  const body = Bodies.circle(S * x, S * y, S * r, material, 64);
  Body.setMass(body, m);
  if (!scene.turns) Body.setInertia(body, Infinity);
  Body.setVelocity(body, { x: S * vx / 60, y: S * vy / 60 }); // of 1/60 s
  Composite.add(engine.world, body);
  of.set(body, k);
  return body;
});
function listed() {
  const rows = [];
  for (const { isActive, bodyA, bodyB, contacts, contactCount, collision: { normal, tangent } } of engine.pairs.list) {
    for (const { normalImpulse: a, tangentImpulse: b } of isActive ? contacts.slice(0, contactCount) : [])
      rows.push([of.get(bodyA), of.get(bodyB), ...["x", "y"].map((i) => (a * normal[i] + b * tangent[i]) / (S * h * h))]);
  }
  return rows;
}
const speed = (body) => { const v = Body.getVelocity(body); return [v.x * 60 / S, v.y * 60 / S, Body.getAngularVelocity(body) * 60]; };
run(version("matter-js"), {
  step: () => Engine.update(engine, 1e3 * h),
  state: () => bodies.map((body) => [body.position.x / S, body.position.y / S, ...speed(body)]),
  listed,
});
