// p2-es: multipliers of the contact and friction equations of `world.narrowphase` after `world.step`.
import { h, installed, merged, mu, run, scene, version } from "./record.mjs";

const p2 = installed("p2-es");
const world = new p2.World({ gravity: scene.gravity });
Object.assign(world.defaultContactMaterial, { friction: mu, restitution: 0 });
world.solver.iterations = 50;
const of = new Map();
scene.walls.forEach(([x, y, nx, ny], k) => {
  const wall = new p2.Body({ position: [x, y], angle: Math.atan2(-nx, ny) });
  wall.addShape(new p2.Plane());
  world.addBody(wall);
  of.set(wall, -1 - k);
});
const bodies = scene.bodies.map(([x, y, r, m, vx, vy], k) => {
  const body = new p2.Body({ mass: m, position: [x, y], velocity: [vx, vy], damping: 0, angularDamping: 0, fixedRotation: !scene.turns });
  body.addShape(new p2.Circle({ radius: r }));
  world.addBody(body);
  of.set(body, k);
  return body;
});
const force = ({ bodyA, bodyB, multiplier, G }) => [of.get(bodyA), of.get(bodyB), G[3] * multiplier, G[4] * multiplier];
run(version("p2-es"), {
  step: () => world.step(h),
  state: () => bodies.map((b) => [...b.position, ...b.velocity, b.angularVelocity]),
  listed: () => merged([...world.narrowphase.contactEquations, ...world.narrowphase.frictionEquations].map(force)),
});
