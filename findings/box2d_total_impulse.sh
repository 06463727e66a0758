#!/usr/bin/env bash
# Box2D 3 (box2d3-wasm 5.2.0), b2ManifoldPoint.totalNormalImpulse (src/contact_solver.c: the solving and the relaxing
#   pass of a substep both add the impulse that is held, not what they changed).
# One would guess: it is the impulse of the step: "the total normal impulse applied across sub-stepping and restitution".
# What happens: a disc of 2 kg at rest gets m g h = 0.0981 N s in a step of 5 ms. totalNormalImpulse says twice that,
#   for any number of substeps. In an impact the factor is another one. normalImpulse is that of the last substep: times
#   the number of substeps it is right at rest, and not in an impact.
# Who is hurt: whoever takes forces, damage or sound from it. No number of a step in motion is its impulse.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
cd "$t"; npm install --silent --no-audit --no-fund box2d3-wasm@5.2.0
cat > case.mjs <<'E'
import { readFileSync } from "node:fs";
import load from "box2d3-wasm";
const B = await load(), h = 0.005, mass = 2, g = 9.81;
console.log("box2d3-wasm", JSON.parse(readFileSync("node_modules/box2d3-wasm/package.json")).version);
const vector = (x, y) => Object.assign(new B.b2Vec2(), { x, y });
function disc(substeps, height, speed) {
  const settings = B.b2DefaultWorldDef();
  settings.gravity = vector(0, -g);
  const world = B.b2CreateWorld(settings), shape = B.b2DefaultShapeDef(), floor = B.b2DefaultBodyDef();
  floor.position = vector(0, -1);
  B.b2CreatePolygonShape(B.b2CreateBody(world, floor), shape, B.b2MakeBox(9, 1));
  const falling = B.b2DefaultBodyDef();
  Object.assign(falling, { type: B.b2BodyType.b2_dynamicBody, position: vector(0, height), linearVelocity: vector(0, -speed) });
  const body = B.b2CreateBody(world, falling);
  shape.density = mass / (Math.PI * 0.25);
  B.b2CreateCircleShape(body, shape, Object.assign(new B.b2Circle(), { center: vector(0, 0), radius: 0.5 }));
  return function step() {
    const before = B.b2Body_GetLinearVelocity(body).y;
    B.b2World_Step(world, h, substeps);
    const needed = mass * (B.b2Body_GetLinearVelocity(body).y - before + g * h);
    const [contact] = B.b2Body_GetContactData(body, 8);
    const point = contact?.manifold.GetPoint(0);
    return [needed, point?.totalNormalImpulse ?? 0, (point?.normalImpulse ?? 0) * substeps];
  };
}
let holds = true;
for (const substeps of [1, 4, 8]) {
  const rest = disc(substeps, 0.5, 0);
  for (let k = 0; k < 90; k++) rest();
  const [needed, total, last] = rest();
  console.log(`at rest, ${substeps} substeps, N s: needed ${needed.toFixed(5)}, total ${total.toFixed(5)}, of the last substep × ${substeps} ${last.toFixed(5)}`);
  holds &&= Math.abs(total / needed - 2) < 0.02 && Math.abs(last / needed - 1) < 0.01;
}
const fall = disc(4, 0.6, 2), steps = Array.from({ length: 30 }, fall);
const sums = [0, 1, 2].map((k) => steps.reduce((sum, one) => sum + one[k], 0));
console.log("an impact at 2 m/s, 150 ms, N s: needed, total, of the last substeps × 4:", ...sums.map((x) => x.toFixed(3)));
holds &&= Math.abs(sums[1] / sums[0] - 1) > 0.1 && Math.abs(sums[2] / sums[0] - 1) > 0.1;
if (!holds) console.error("the behaviour has changed");
process.exit(holds ? 0 : 1);
E
node case.mjs
