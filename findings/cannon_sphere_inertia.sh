#!/usr/bin/env bash
# cannon-es 0.20.0, Body.updateMassProperties (src/objects/Body.ts).
# One would guess: a body with one Sphere has a sphere's moment of inertia, 2/5 m r², which Sphere.calculateLocalInertia
#   gives.
# What happens: it gets that of its bounding box, 2/3 m r²: the shape's own is never asked for. A force along its
#   surface turns it 0.6 times as fast as a sphere, and it rolls down a slope at 0.6 g sin α instead of 5/7 = 0.714.
# Who is hurt: whoever compares rolling, spin or energy with mechanics or another engine.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
cd "$t"
npm install --silent --prefix . cannon-es@0.20.0
cat > run.cjs <<'E'
const { Body, Sphere, Vec3, World } = require("cannon-es");
console.log("cannon-es", require("fs").readFileSync("node_modules/cannon-es/package.json", "utf8").match(/"version": "([^"]+)/)[1]);
const [m, r] = [2, 0.5], sphere = new Sphere(r), body = new Body({ mass: m, shape: sphere, angularDamping: 0, linearDamping: 0 });
const own = sphere.calculateLocalInertia(m).z / (m * r * r), has = body.inertia.z / (m * r * r);
const world = new World();
world.addBody(body);
body.applyForce(new Vec3(1, 0, 0), new Vec3(0, -r, 0));
world.step(0.01);
const felt = (1 * r * 0.01) / body.angularVelocity.z / (m * r * r);
console.log(`inertia in m r²: of the shape ${own}, of the body ${has.toFixed(4)}, felt by a force ${felt.toFixed(4)}`);
process.exit(Math.abs(own - 0.4) < 1e-9 && Math.abs(has - 2 / 3) < 1e-9 && Math.abs(felt - 2 / 3) < 1e-6 ? 0 : (console.log("the behaviour has changed"), 1));
E
node run.cjs
