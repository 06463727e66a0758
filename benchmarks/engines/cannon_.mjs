// cannon-es: multipliers of the contact and friction equations in `world` after `world.step`. Bodies are held in
// the plane by linearFactor and angularFactor.
import { h, installed, merged, mu, run, scene, version } from "./record.mjs";

const C = installed("cannon-es"), [gx, gy] = scene.gravity;
const world = new C.World({ gravity: new C.Vec3(gx, gy, 0), allowSleep: true });
Object.assign(world.defaultContactMaterial, { friction: mu, restitution: 0 });
world.solver.iterations = 50;
scene.walls.forEach(([x, y, nx, ny]) => {
  const wall = new C.Body({ mass: 0, shape: new C.Plane(), position: new C.Vec3(x, y, 0) });
  wall.quaternion.setFromVectors(new C.Vec3(0, 0, 1), new C.Vec3(nx, ny, 0));
  world.addBody(wall);
});
const bodies = scene.bodies.map(([x, y, r, m, vx, vy]) => {
  const body = new C.Body({ mass: m, shape: new C.Sphere(r), position: new C.Vec3(x, y, 0), velocity: new C.Vec3(vx, vy, 0) });
  Object.assign(body, { linearDamping: 0, angularDamping: 0, linearFactor: new C.Vec3(1, 1, 0) });
  body.angularFactor = new C.Vec3(0, 0, scene.turns ? 1 : 0);
  world.addBody(body);
  return body;
});
const walls = scene.walls.length, of = (body) => (body.id < walls ? -1 - body.id : body.id - walls);
const force = ({ bi, bj, multiplier, jacobianElementB: { spatial } }) =>
  [of(bi), of(bj), spatial.x * multiplier, spatial.y * multiplier];
run(version("cannon-es"), {
  step: () => world.step(h),
  state: () => bodies.map((b) => [b.position.x, b.position.y, b.velocity.x, b.velocity.y, b.angularVelocity.z]),
  listed: () => merged([...world.contacts, ...world.frictionEquations].map(force)),
});
