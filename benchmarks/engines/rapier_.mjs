// Rapier: `contactImpulse` and `contactTangentImpulse` of the manifolds of each pair after `world.step`.
import { h, installed, mu, run, scene } from "./record.mjs";

const R = installed("@dimforge/rapier2d-compat");
await R.init();
const world = new R.World({ x: scene.gravity[0], y: scene.gravity[1] }), of = new Map();
world.timestep = h;
if (scene.substeps > 1) world.numSolverIterations = scene.substeps * 4;
const add = (k, shape, body) => of.set(world.createCollider(shape.setFriction(mu).setRestitution(0), body).handle, k);
scene.walls.forEach(([x, y, nx, ny], k) => {
  add(-1 - k, R.ColliderDesc.cuboid(ny ? 99 : 1, nx ? 99 : 1), world.createRigidBody(R.RigidBodyDesc.fixed().setTranslation(x - nx, y - ny)));
});
const bodies = scene.bodies.map(([x, y, r, m, vx, vy], k) => {
  const given = R.RigidBodyDesc.dynamic().setTranslation(x, y).setLinvel(vx, vy);
  const body = world.createRigidBody(scene.turns ? given : given.lockRotations());
  add(k, R.ColliderDesc.ball(r).setMass(m), body);
  return body;
});
function listed() {
  const rows = [];
  world.forEachCollider((one) => world.contactPairsWith(one, (two) => {
    if (one.handle > two.handle) return; // each pair once
    world.contactPair(one, two, (manifold, flipped) => {
      const { x, y } = manifold.normal(), sign = flipped ? -1 : 1;
      for (let k = 0; k < manifold.numContacts(); k++) {
        const [a, b] = [manifold.contactImpulse(k) / h, manifold.contactTangentImpulse(k) / h];
        rows.push([of.get(one.handle), of.get(two.handle), sign * (a * x - b * y), sign * (a * y + b * x)]);
      }
    });
  }));
  return rows;
}
run(R.version(), {
  step: () => world.step(),
  state: () => bodies.map((b) => [b.translation().x, b.translation().y, b.linvel().x, b.linvel().y, b.angvel()]),
  listed,
});
