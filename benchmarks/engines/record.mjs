// What record.py is for Python, for engines in JavaScript: node SCRIPT SCENE.json FOLDER VARIANT
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";

const [, , path, folder, variant] = process.argv;
export const scene = JSON.parse(readFileSync(path)), h = scene.step_s, mu = scene.friction;
export { variant };
export const installed = createRequire(`${process.env.ENGINE}/`); // packages of `npm install --prefix`

export const version = (name) => JSON.parse(readFileSync(`${process.env.ENGINE}/node_modules/${name}/package.json`)).version;

// Adds the rows of each pair: normal and friction have rows of their own in some engines.
export function merged(rows) {
  const sums = new Map();
  for (const [one, two, fx, fy] of rows) {
    const key = `${one} ${two}`, [, , x, y] = sums.get(key) ?? [one, two, 0, 0];
    sums.set(key, [one, two, x + fx, y + fy]);
  }
  return [...sums.values()];
}

// Makes all steps. step(n): one of h; state(): of each body x, y, vx, vy, spin; listed(): of each contact
// first, second (walls -1, -2, ...) and the force (N) on the second. same: contacts are of the places
// after the step.
export function run(number, { step, state, listed, same = false }) {
  let before = scene.bodies.map(([x, y, , , vx, vy]) => [x, y, vx, vy, 0]), dump = "";
  let table = "step,first,second,is_wall,fx,fy\n";
  const [from, until] = [scene.from_s, scene.until_s].map((t) => Math.round(t / h));
  for (let n = 1; n <= until; n++) {
    step(n);
    const after = state(), shown = same ? after : before;
    before = after;
    if (n < from) continue;
    dump += `ITEM: TIMESTEP\n${n}\nITEM: NUMBER OF ATOMS\n${shown.length}\nITEM: BOX BOUNDS ff ff pp\n`;
    dump += "-99 99\n".repeat(3) + "ITEM: ATOMS id x y radius mass vx vy omegaz\n";
    shown.forEach(([x, y, ...rest], k) => (dump += [k + 1, x, y, scene.bodies[k][2], scene.bodies[k][3], ...rest].join(" ") + "\n"));
    for (let [one, two, fx, fy] of listed()) {
      if (one < 0) [one, two, fx, fy] = [two, one, -fx, -fy];
      table += [n, one + 1, two < 0 ? -two : two + 1, two < 0 ? "True" : "False", fx, fy].join(",") + "\n";
    }
  }
  mkdirSync(folder, { recursive: true });
  for (const [name, text] of [["engine.json", JSON.stringify({ version: number, step_s: h })], ["bodies.dump", dump], ["contacts.csv", table]])
    writeFileSync(`${folder}/${name}`, text);
}
