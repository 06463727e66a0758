// Box2D 3 (box2d3-wasm): the points of `b2Body_GetContactData` after `b2World_Step`, which makes four substeps by
// default. Variants: `totalNormalImpulse` over the step, or `normalImpulse` over the substep; with both `tangentImpulse`.
import { h, installed, mu, run, scene, variant, version } from "./record.mjs";
import { pathToFileURL } from "node:url";

const entry = `${process.env.ENGINE}/node_modules/box2d3-wasm/build/dist/es/entry.mjs`;
const { default: load } = await import(pathToFileURL(entry));
const B = await load(), of = new Map(), key = (shape) => shape.index1;
const vector = ([x, y]) => Object.assign(new B.b2Vec2(), { x, y });
const settings = B.b2DefaultWorldDef(), substeps = scene.substeps > 1 ? scene.substeps : 4;
settings.gravity = vector(scene.gravity);
const world = B.b2CreateWorld(settings);
function added(k, x, y, velocity, shape, dynamic, density = 0) {
  const one = B.b2DefaultBodyDef(), look = B.b2DefaultShapeDef(), { material } = look;
  Object.assign(one, { position: vector([x, y]), linearVelocity: vector(velocity) });
  if (dynamic) one.type = B.b2BodyType.b2_dynamicBody;
  if (dynamic && !scene.turns) one.motionLocks = Object.assign(new B.b2MotionLocks(), { angularZ: true });
  look.material = Object.assign(material, { friction: mu, restitution: 0 });
  look.density = density;
  const body = B.b2CreateBody(world, one);
  of.set(key(dynamic ? B.b2CreateCircleShape(body, look, shape) : B.b2CreatePolygonShape(body, look, shape)), k);
  return body;
}
scene.walls.forEach(([x, y, nx, ny], k) => added(-1 - k, x - nx, y - ny, [0, 0], B.b2MakeBox(ny ? 99 : 1, nx ? 99 : 1), false));
const bodies = scene.bodies.map(([x, y, r, m, vx, vy], k) => {
  const circle = Object.assign(new B.b2Circle(), { center: vector([0, 0]), radius: r });
  return added(k, x, y, [vx, vy], circle, true, m / (Math.PI * r * r));
});
function listed() {
  const rows = new Map();
  for (const body of bodies) for (const one of B.b2Body_GetContactData(body, B.b2Body_GetContactCapacity(body))) {
    const [a, b] = [of.get(key(one.shapeIdA)), of.get(key(one.shapeIdB))], { manifold } = one, { x, y } = manifold.normal;
    let [fx, fy] = [0, 0];
    for (let k = 0; k < manifold.pointCount; k++) {
      const point = manifold.GetPoint(k), t = (point.tangentImpulse / h) * substeps;
      const n = variant === "normalImpulse" ? (point.normalImpulse / h) * substeps : point.totalNormalImpulse / h;
      [fx, fy] = [fx + n * x + t * y, fy + n * y - t * x];
    }
    rows.set(`${a} ${b}`, [a, b, fx, fy]); // a pair is listed at both of its bodies
  }
  return [...rows.values()];
}
run(version("box2d3-wasm"), {
  step: () => B.b2World_Step(world, h, substeps),
  state: () => bodies.map((one) => {
    const [p, v] = [B.b2Body_GetPosition(one), B.b2Body_GetLinearVelocity(one)];
    return [p.x, p.y, v.x, v.y, B.b2Body_GetAngularVelocity(one)];
  }),
  listed,
});
process.exit(0); // its threads wait
