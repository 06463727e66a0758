// The page of `percussions explore`: nscd's core, compiled, presses a crowd. Nothing is loaded.
(async () => {
  const live = document.getElementById("live"), root = live.querySelector(".film");
  const $ = (name) => root.querySelector(`.${name}`);
  let core, known;
  try {
    const none = new Proxy({}, { get: () => () => 0 });
    const code = await unpacked($("core").innerHTML).arrayBuffer();
    core = (await WebAssembly.instantiate(code, { wasi_snapshot_preview1: none })).instance.exports;
    core._initialize(), known = await unpacked($("scenes").innerHTML).json(), RULES = known.rules;
  } catch { return; }  // the picture and its sentence stay
  live.querySelector(".off").remove(), root.hidden = false;

  // ---- the core's numbers: parts and LAW as in explore/live.cpp
  const PARTS = "position velocity spin radius mass goes stop share ids exits grid next corners onward walls law distance contacts resting".split(" ");
  const COLUMNS = 8, NEVER = 1e300, AHEAD = RULES.ahead, PULL = 1.0, ARMS_SAFE = 0.7, FLOW_S = 5, MEASURED = [1.2, 1.9], WIDE_M = 0.8, PICTURE_S = 0.034, STEPS_MS = 20;
  const part = (name) => {
    const number = PARTS.indexOf(name);
    return new Float64Array(core.memory.buffer, core.at(number), core.size(number));
  };
  const put = (name, values) => { if (!core.room(PARTS.indexOf(name), values.length) && values.length) throw Error(`${name}: too many`); part(name).set(values); };
  const accepted = (bad) => { if (bad) throw Error(`${PARTS[bad - 1] || "time"}: the core refuses it`); };
  const mean = (values) => values.reduce((sum, one) => sum + one, 0) / values.length;
  const least = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);
  const most = (values) => values.reduce((a, b) => Math.max(a, b), 0);
  const long = (x, y) => Math.sqrt(x * x + y * y);  // Math.hypot is rounded differently elsewhere
  const copy = (value) => JSON.parse(JSON.stringify(value));

  // ---- a scene: {name, notes, content, disks: {id, x, u, r, m, w}, way}
  let scene, base = "", placed = null;  // `placed`: how its people were put there, where that was here
  let run = {}, pulls = [], origin = "";  // `origin`: the scene as it was opened

  const exits = (content) => (content.drive ? [content.drive, ...(content.drive.goals || [])] : []).map((one) => {
    if (one.door_start_m) return one;
    const [x, y] = one.outward, ends = [1, -1].map((s) => [AHEAD * (x - 0.5 * s * y), AHEAD * (y + 0.5 * s * x)]);
    return { ...one, door_start_m: ends[0], door_end_m: ends[1], ahead: true };
  });
  const downhill = ({ slope_deg: slope, downhill: way }) => way.map((one) => RULES.gravity * +Math.sin(slope * Math.PI / 180).toPrecision(12) * one);
  const acceleration = ({ body_force: of }) => (of ? of.acceleration_m_per_s2 || downhill(of) : [0, 0]);

  // The step and the steps between frames, as the rigid engine takes them. Throws where it refuses them.
  function timing({ content, disks }) {
    const { drive, contact, run: asked } = content;
    const start = most(disks.r.map((_, i) => long(disks.u[2 * i], disks.u[2 * i + 1])));
    const falls = long(...acceleration(content)) * asked.duration_s, speed = drive ? Math.max(start, drive.speed_m_per_s + 5 * (drive.jostling_m_per_s || 0)) : start + falls;
    let longest = speed ? 0.06 * mean(disks.r) / speed : asked.duration_s;
    const arms = contact.arm_reach_m ? Math.sqrt(least(disks.m) / (contact.arm_force_N / contact.arm_reach_m)) : Infinity;
    longest = asked.rigid_step_s || Math.min(longest, 0.2 * arms);
    const between = asked.duration_s / asked.frames;
    if (!(between / longest < 1e200)) throw Error(`run.duration_s: ${asked.duration_s} s are too many steps to count`);
    const interval = Math.max(1, Math.ceil(between / longest * (1 - 1e-12))), even = between / interval, step = Math.abs(even - longest) <= 1e-12 * longest ? longest : even;
    if (step > ARMS_SAFE * arms) throw Error(`run.rigid_step_s: arms are not stable in steps of ${step} s. Give at most ${ARMS_SAFE * arms} s`);
    if (step * speed > least(disks.r)) throw Error(`run.rigid_step_s: in ${step} s a disk at ${speed} m/s goes farther than its radius. Give at most ${least(disks.r) / speed} s`);
    return [step, interval];
  }

  function law() {
    const { drive, contact, run: asked, period_x_m: period } = scene.content, tolerance = asked.rigid_tolerance || (contact.friction ? 1e-3 : 1e-8);
    const [low, high] = period || [0, 0];
    [run.h, run.interval] = timing(scene);
    put("law", [run.h, drive ? drive.relaxation_time_s : 0, ...acceleration(scene.content), contact.restitution, contact.friction || 0, tolerance,
      contact.arm_reach_m || 0, contact.arm_force_N || 0, drive ? drive.speed_m_per_s : 0, low, high - low]);
    const keeps = { ...RULES.distance, ...drive }, of = "heading_sd_rad heading_hold_s jostling_m_per_s jostling_length_m jostling_period_s seed".split(" ");
    put("distance", [keeps.time_gap_s || 0, ...of.map((key) => keeps[key])]), put("share", pushShares(drive, scene.disks.id));
  }
  function geometry() {
    const aim = scene.content.drive && scene.content.drive.aim === "centre";
    put("walls", (scene.content.walls || []).flatMap((wall) => [...wall.start_m, ...wall.end_m]));
    put("exits", exits(scene.content).flatMap(({ door_start_m: a, door_end_m: b, outward }) => {
      const c = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
      return [...(aim ? [...c, ...c] : [...a, ...b]), ...outward, ...a];
    }));
  }
  function people() {
    const { id, x, u, w, r, m } = scene.disks, { drive } = scene.content;
    const of = (list, one) => (list || []).findIndex(({ people: [a, b] }) => a <= one && one <= b);
    put("position", x), put("velocity", u), put("spin", w), put("radius", r), put("mass", m);
    put("goes", id.map((one) => of(drive && drive.goals, one) + 1));
    put("stop", id.map((one) => { const k = of(drive && drive.stops, one); return k < 0 ? NEVER : drive.stops[k].time_s; }));
    put("ids", id);
    const way = scene.way;
    put("grid", way ? [...way.origin_m, way.cell_m, ...way.rows_columns] : []);
    put("corners", way ? way.corners_m.flat() : []), put("onward", way ? way.onward_m.flat() : []);
    put("next", way ? way.next.flatMap((runs) => runs.flatMap((count, i) => (i % 2 ? [] : Array(count).fill(runs[i + 1])))) : []);
  }

  // Put a scene into the core. Throws where that refuses it.
  function load(next) {
    scene = next, run = { step: 0, frames: [], load: [], flow: [], peak: [], since: 0, began: copy(scene), ended: "" }, pulls = [];
    limited(scene.content, []), people(), law(), geometry(), accepted(core.begin(0));
  }
  const check = () => checkScene(scene, (most) => { core.deepest(most); return [...part("resting")]; });
  // Take up a scene from its start.
  function begin(next) {
    load(next), drawing = null, say(""), run.duration = 0;
    const moved = core.separate();
    if (moved < 0) end("The people do not fit between the walls.");
    // so that a link to them is taken
    if (moved > RULES.overlap * least(scene.disks.r)) scene.disks.x = [...part("position")], run.began = copy(scene);
    run.before = part("velocity").slice(), write(), fill(), fit(), draw(), heading();
  }
  // Act, or say why not and leave all as it was.
  function trying(act, before = "") {
    const was = [scene, run, pulls, placed, base, chosen, drawing, origin];
    core.keep();
    try { return act(), true; } catch (error) {
      core.back(), [scene, run, pulls, placed, base, chosen, drawing, origin] = was;
      run.shown = -1;
      heading();
      if (!drawing) fill(), fit(), draw();
      return say(`${before}${error.message}.`), false;
    }
  }
  // ---- titles: that of the scene as it was opened, or what has become of it
  const stamp = (one) => JSON.stringify([one.content, one.disks]);
  const nameOf = (one) => (stamp(one) !== origin && /\d/.test(one.name) ? "my_scene" : one.name);
  function titleOf(one, count = one.disks.id.length, time = 0) {
    if (stamp(one) === origin && count === one.disks.id.length && !time) return one.content.title;
    const { drive, contact } = one.content, doors = exits(one.content).filter((door) => !door.ahead).map((door) => `${+gap(door.door_start_m, door.door_end_m).toFixed(2)} m`);
    const parts = [doors.length > 3 ? `${doors.length} doors` : doors.length ? `door${doors.length > 1 ? "s" : ""} of ${doors.join(" and ")}` : "", `${count} people`,
      drive ? `push ${+push(one).toPrecision(3)} N` : "", drive && drive.time_gap_s ? `push share ${shareOf(drive)}` : "", contact.friction ? `friction ${contact.friction}` : ""];
    return `${nameOf(one).replace(/_/g, " ")}: ${parts.filter(Boolean).join(", ")}${time ? `, after ${time.toFixed(2)} s` : ""}`;
  }
  function heading() { $("title").textContent = titleOf(scene), run.moved = false, scenes.value = stamp(scene) === origin ? base : ""; }
  function end(words) { run.ended = words; pause(); say(words); }

  // A frame: the window ends.
  function write() {
    core.window(), run.duration = run.frames.length ? run.interval * run.h : 0;
    const velocity = part("velocity").slice(), position = part("position").slice(), t = run.step * run.h;
    const force = velocity.map((u, i) => (run.duration ? scene.disks.m[i >> 1] * (u - run.before[i]) / run.duration : 0));
    const frame = { step: run.step, t, x: position, u: velocity, w: part("spin").slice(), f: force, contacts: part("contacts").slice(), over: run.duration };
    run.frames.push(frame), run.before = velocity;
    let load = 0, peak = 0;
    each(frame, ({ wall, normal, across }) => { load += wall ? normal : 0, peak = Math.max(peak, long(normal, across)); });
    run.load.push([t, load]), run.peak.push([t, peak]);
    const doors = exits(scene.content);
    run.flow.push([t, scene.disks.id.filter((_, i) => beyond(i, doors)).length]);
  }
  // Contacts of a frame: places of both, whether the second is a wall, mean force in N along and across the normal.
  function each(frame, take) {
    const c = frame.contacts;
    for (let k = 0; k < c.length; k += COLUMNS) {
      const [nx, ny, , px, py] = c.subarray(k + 3, k + COLUMNS), over = frame.over || Infinity;
      take({ first: c[k], second: c[k + 1], wall: c[k + 2] === 1, normal: (px * nx + py * ny) / over, across: (nx * py - ny * px) / over });
    }
  }
  function beyond(i, doors) {  // whether somebody has passed the line of the own door
    const door = doors[part("goes")[i]], x = part("position");
    return !!door && !door.ahead && (x[2 * i] - door.door_start_m[0]) * door.outward[0] + (x[2 * i + 1] - door.door_start_m[1]) * door.outward[1] >= 0;
  }
  function advance() {
    if (run.ended) return false;
    let done = 1;
    try { if (pulls.length) pull(); done = core.step(); } catch (error) { done = error.message; }
    const why = { 0: "the contacts are not solved. Restart, or pull more slowly", "-1": "somebody is at no finite place. Restart" };
    if (done !== 1) return end(`At ${(run.step * run.h).toFixed(2)} s ${why[done] || `the core stops: ${done}. Reload this page`}.`), false;
    run.step += 1;
    if (run.step % run.interval === 0) write();
    return true;
  }

  // ---- pulling: points of walls and doors follow the pointer, with at most PULL m/s
  const ends = () => [...(scene.content.walls || []), ...exits(scene.content).filter((one) => !one.ahead)]
    .flatMap((one) => ("name" in one ? ["start_m", "end_m"] : ["door_start_m", "door_end_m"]).map((key) => ({ one, key })));
  const same = (p, q) => gap(p, q) < 1e-9;
  function pull() {
    for (const one of pulls) {
      const far = long(...one.left), share = far > 0 ? Math.min(1, PULL * run.h / far) : 0;
      const move = one.left.map((value) => share * value);
      for (const { one: of, key } of one.points) of[key] = of[key].map((value, k) => value + move[k]);
      one.left = one.left.map((value, k) => value - move[k]);
    }
    pulls = pulls.filter((one) => one.held || long(...one.left) > 1e-6);
    run.moved = true, geometry(), accepted(core.reconnect());
  }
  // What can be pulled at a point: an edge of a door along its line, or a group of walls that no door ends.
  function grip(point, reach) {
    const far = ({ one, key }) => gap(one[key], point), doors = ends().filter(({ one }) => "outward" in one);
    const near = doors.filter((end) => far(end) < reach).sort((a, b) => far(a) - far(b))[0];
    if (near) return edge(near.one, near.key);
    const group = new Set((scene.content.walls || []).filter((wall) => away(point, wall.start_m, wall.end_m) < reach).slice(0, 1));
    if (!group.size) return null;
    for (let size = 0; size < group.size;) {
      size = group.size;
      for (const wall of scene.content.walls) if ([...group].some((other) => ["start_m", "end_m"].some((a) => ["start_m", "end_m"].some((b) => same(wall[a], other[b]))))) group.add(wall);
    }
    const points = [...group].flatMap((one) => ["start_m", "end_m"].map((key) => ({ one, key })));
    const fixed = points.some(({ one, key }) => doors.some((end) => same(one[key], end.one[end.key])));
    return fixed ? null : { points, left: [0, 0], held: true };
  }
  function edge(door, key) {
    const points = ends().filter(({ one, key: other }) => same(one[other], door[key]));
    const [a, b] = [door.door_start_m, door.door_end_m], along = b.map((v, k) => (v - a[k]) / gap(a, b));
    return { points, left: [0, 0], held: true, along };
  }
  const gap = ([x, y], [u, v]) => long(x - u, y - v), away = (point, start, end) => gap(point, nearest(point, start, end));

  // ---- people in a room: at random near their doors, pushed apart
  function random(count, seed) {  // of [0, 1): xorshift of 32 bits
    let state = (seed * 2654435761 + 88675123) >>> 0 || 1;
    const next = () => { state ^= state << 13, state ^= state >>> 17, state ^= state << 5; return (state >>> 0) / 2 ** 32; };
    return Array.from({ length: count + 8 }, next).slice(8);
  }
  function crossing([ax, ay], [bx, by], [cx, cy], [dx, dy]) {
    const side = (px, py, qx, qy, rx, ry) => (qx - px) * (ry - py) - (qy - py) * (rx - px);
    return side(ax, ay, bx, by, cx, cy) * side(ax, ay, bx, by, dx, dy) <= 0 && side(cx, cy, dx, dy, ax, ay) * side(cx, cy, dx, dy, bx, by) <= 0;
  }
  // Places from which a door is reached without a wall between, nearest first: cells of a grid.
  function before(door, lines, radius) {
    const box = [0, 1].map((k) => lines.flat().map((p) => p[k])).map((all) => [least(all), -least(all.map((v) => -v))]);
    const cell = Math.max(0.1, Math.sqrt((box[0][1] - box[0][0]) * (box[1][1] - box[1][0]) / 2e5));
    const [a, b] = [door.door_start_m, door.door_end_m], size = box.map(([low, high]) => Math.ceil((high - low) / cell) + 1);
    const at = (i, j) => [box[0][0] + cell * i, box[1][0] + cell * j], seen = new Uint8Array(size[0] * size[1]), found = [];
    const inner = [0, 1].map((k) => 0.5 * (a[k] + b[k]) - 1.5 * cell * door.outward[k]);
    let now = [[Math.round((inner[0] - box[0][0]) / cell), Math.round((inner[1] - box[1][0]) / cell)]];
    // only lines that come near the square of 16 by 16 cells
    const squares = new Map(), reach = radius + cell, near = (i, j) => {
      const key = `${i >> 4} ${j >> 4}`, middle = at((i & ~15) + 7.5, (j & ~15) + 7.5);
      if (!squares.has(key)) squares.set(key, lines.filter(([s, e]) => away(middle, s, e) < reach + 12 * cell));
      const p = at(i, j);
      return squares.get(key).filter(([s, e]) => away(p, s, e) < reach);
    };
    for (let level = 0; now.length; ++level) {
      const next = [];
      for (const [i, j] of now) {
        const p = at(i, j), around = near(i, j);
        if (!around.some(([s, e]) => away(p, s, e) < radius)) found.push([cell * level + away(p, a, b), p]);
        for (const [di, dj] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
          const [u, v] = [i + di, j + dj], key = u * size[1] + v;
          if (u < 0 || v < 0 || u >= size[0] || v >= size[1] || seen[key]) continue;
          if (!around.some(([s, e]) => crossing(p, at(u, v), s, e))) seen[key] = 1, next.push([u, v]);
        }
      }
      now = next;
    }
    return [found.sort((p, q) => p[0] - q[0]).map((one) => one[1]), cell];
  }
  // Put so many people of a mean radius (m) and of 10 % more or less before the doors of a scene. Throws where they do not fit.
  function place({ count, radius, seed }, of = scene) {
    const next = copy({ ...of, disks: null }), { content } = next, doors = exits(content);
    delete content.reconciliation;
    if (!doors.length || doors.some((one) => one.ahead)) throw Error("people are put before a door, and this scene has none");
    const lines = [...(content.walls || []).map((one) => [one.start_m, one.end_m]), ...doors.map((one) => [one.door_start_m, one.door_end_m])];
    const r = random(count, seed).map((one) => +(radius * (1 + 0.1 * (2 * one - 1))).toFixed(6)), x = [];
    const side = 2.2 * most(r), there = new Map(), squareOf = ([u, v], i = 0, j = 0) => `${Math.floor(u / side) + i} ${Math.floor(v / side) + j}`;
    let first = 0;
    doors.forEach((door, number) => {
      const last = Math.round(count * (number + 1) / doors.length);
      if (number) door = content.drive.goals[number - 1], door.people = [first + 1, last];
      const [cells, cell] = before(door, lines, 1.02 * most(r));
      // the nearest cells that have room for them, in any order
      const room = Math.min(cells.length, Math.ceil(r.slice(first, last).reduce((sum, one) => sum + 4.6 * one * one, 0) / (cell * cell)));
      for (const [part, wide] of [[room, 0.95], [room, 0.85], [room, 0.75], [cells.length, 0.75]]) {
        if (x.length >= 2 * last) break;
        const order = random(part, seed + number + 1), queue = [...order.keys()].sort((p, q) => order[p] - order[q]);
        for (const k of queue) {
          const i = x.length / 2, p = cells[k], free = (j) => gap(p, [x[2 * j], x[2 * j + 1]]) >= wide * (r[j] + r[i]);
          if (i === last) break;
          if (![-1, 0, 1].every((u) => [-1, 0, 1].every((v) => (there.get(squareOf(p, u, v)) || []).every(free)))) continue;
          x.push(...p), there.set(squareOf(p), [...(there.get(squareOf(p)) || []), i]);
        }
      }
      first = last;
    });
    next.disks = { id: r.map((_, i) => i + 1), x, u: x.map(() => 0), r, m: r.map(() => (of.disks ? mean(of.disks.m) : 75)), w: r.map(() => 0) };
    const none = Error(`${count} people of radius ${radius} m do not fit`);
    if (x.length < 2 * count) throw none;
    load(next), put("walls", lines.flat(2)), accepted(core.begin(0));
    const moved = core.separate();
    next.disks.x = [...part("position")];
    if (moved < 0 || outsider(next) >= 0) throw none;
    placed = { count, radius, seed };
    begin(next);
  }
  const asked = () => ({ count: +$("people").value, radius: +$("radius").value, seed: +$("seed").value });

  // ---- files
  const WHOLE = ["frames", "drive_interval_steps", "people", "people_seed", "seed"];
  function toToml(content, path = "") {
    const written = (key, value) => {
      if (Array.isArray(value)) return `[${value.map((one) => written(key, one)).join(", ")}]`;
      const text = JSON.stringify(value);
      return typeof value === "number" && !WHOLE.includes(key) && /^-?\d+$/.test(text) ? `${text}.0` : text;
    };
    const isTable = (value) => value !== null && typeof value === "object" && (!Array.isArray(value) || (value.length && typeof value[0] === "object" && !Array.isArray(value[0])));
    const lines = [], tables = [];
    for (const [key, value] of Object.entries(content)) {
      if (!isTable(value)) lines.push(`${key} = ${written(key, value)}`);
      else for (const one of [value].flat()) tables.push(`\n${Array.isArray(value) ? `[[${path}${key}]]` : `[${path}${key}]`}\n${toToml(one, `${path}${key}.`)}`);
    }
    return [...lines, ...tables].join("\n");
  }
  function toData({ id, r, m, x, u, w }, title) {
    const [low, high] = [0, 1].map((k) => x.filter((_, i) => i % 2 === k)).reduce(([a, b], all) => [[...a, least(all) - 200], [...b, 200 - least(all.map((v) => -v))]], [[], []]);
    const half = 2 * most(r);
    const box = ["x", "y"].map((name, k) => `${low[k].toFixed(1)} ${high[k].toFixed(1)} ${name}lo ${name}hi`);
    const atoms = id.map((one, i) => `${one} 1 ${2 * r[i]} ${m[i] / volume(r[i])} ${x[2 * i]} ${x[2 * i + 1]} 0.0`);
    const moving = id.map((one, i) => `${one} ${u[2 * i]} ${u[2 * i + 1]} 0.0 0.0 0.0 ${w[i]}`);
    return [`${title} (SI units, density is that of the sphere, as read_data takes it)`, "", `${id.length} atoms`, "1 atom types", "", ...box,
      `${-half.toFixed(3)} ${half.toFixed(3)} zlo zhi`, "", "Atoms # sphere", "", ...atoms, "", "Velocities", "", ...moving, ""].join("\n");
  }
  // A room from rings of points (m): the first is the outline, the others are pillars. The door stands for its ends.
  function roomOf(rings, [a, b], name) {
    const sides = rings.flatMap((ring) => ring.map((p, i) => [p, ring[(i + 1) % ring.length]]));
    const at = sides.reduce((best, side) => (Math.max(away(a, ...side), away(b, ...side)) < Math.max(away(a, ...best), away(b, ...best)) ? side : best));
    const [p, q] = at, length = gap(p, q), along = [(q[0] - p[0]) / length, (q[1] - p[1]) / length];
    const [s, e] = [a, b].map((one) => Math.min(length, Math.max(0, (one[0] - p[0]) * along[0] + (one[1] - p[1]) * along[1]))).sort((m, n) => m - n);
    if (e - s < 0.1) throw Error("the door needs two places on one wall, at least 0.1 m apart");
    const on = (far) => [p[0] + far * along[0], p[1] + far * along[1]], [start, stop, middle] = [on(s), on(e), on(0.5 * (s + e))];
    const outward = [along[1], -along[0]].map((v) => v * (inRing([middle[0] + 1e-6 * along[1], middle[1] - 1e-6 * along[0]], rings[0]) ? -1 : 1));
    const left = sides.flatMap((side) => (side === at ? [[p, start], [stop, q]] : [side])).filter(([m, n]) => !same(m, n));
    return {
      title: `${name}, drawn`, source: "percussions explore",
      walls: left.map(([m, n], i) => ({ name: `wall_${i + 1}`, start_m: m, end_m: n })),
      drive: { speed_m_per_s: 1, relaxation_time_s: 0.5, door_start_m: start, door_end_m: stop, outward, aim: "nearest" },
      contact: { law: "hooke", stiffness_N_per_m: 1e6, restitution: 0.1, friction: 0, tangential_ratio: 2 / 7 },
      run: { duration_s: 10, frames: 100, drive_interval_steps: 10 },
      analysis: { kind: "driven", time_s: 10, contact_tolerance_m: 1e-6 },
    };
  }
  const rings = (text) => [...text.matchAll(/\(([^()]+)\)/g)].map(([, ring]) => ring.trim().split(",").map((one) => one.trim().split(/\s+/).slice(0, 2).map(Number)).filter((p, i, all) => i < all.length - 1 || !same(p, all[0])));
  async function open(list) {
    const { bytes } = RULES, files = [...list], large = files.find((one) => one.size > bytes);
    if (!files.length) return undefined;
    if (large) return say(`Not opened: ${large.name}: ${large.size} bytes. This page takes at most ${bytes}.`);
    try { return openTexts(await Promise.all(files.map(async (file) => [file.name, new TextDecoder("utf-8", { fatal: !/\.data$/.test(file.name) }).decode(await file.arrayBuffer())]))); }
    catch (error) { return say(`Not opened: ${error instanceof TypeError ? "not UTF-8 text" : error.message}.`); }
  }
  // Of texts, [name, text] each; whether that went well.
  function openTexts(texts) {
    const plain = (name) => name.replace(/\.\w+$/, "").replace(/\W/g, "_");
    return trying(() => {
      let used = texts.slice(0, 1).map(([name]) => name), unused = [];
      if (!texts.some(([name]) => name.endsWith(".toml"))) sketch(texts[0][1].split(/\(\s*\(/).length === 2 ? rings(texts[0][1]) : [], texts[0][0]);
      else {
        const found = fromFiles(texts, [asked().radius, 75]);
        ({ used, unused } = found), take({ name: plain(found.name), notes: "", content: found.content, disks: found.disks, way: wayOf(found.content) });
      }
      const left = [...texts.map(([name]) => name).filter((name) => !used.includes(name)), ...unused];
      if (left.length) say(`${$("said").textContent} Not used: ${left.join(", ")}.`);
    }, "Not opened: ");
  }
  // The way round walls of a scene of this page that has the same walls and doors, or of the one it was made of.
  function wayOf(content, own) {
    if (!content.drive || !has(content.drive, "clearance_m")) return undefined;
    const key = ({ walls, drive }) => JSON.stringify([(walls || []).map((one) => [one.start_m, one.end_m]), drive.clearance_m, exits({ drive }).map((one) => [one.door_start_m, one.door_end_m, one.outward])]);
    const of = known.scenes.find((one) => one.way && key(one.content) === key(content)) || (own && own.way && own.way.next.length === exits(content).length && own);
    return of ? of.way : wrong("drive.clearance_m: this page finds no way round walls. Leave it out, or use percussions run");
  }
  function take(next) {
    if (next.disks) load(next), check(), placed = null, begin(next);
    else {
      for (let { count, ...rest } = asked(), most = count; ; count = Math.floor(0.8 * count)) try {
        place({ count, ...rest }, next);
        if (count < most) say(`Room for ${count} people.`);
        break;
      } catch (error) { if (count < 2) throw error; }
      check();
    }
    base = "", origin = stamp(scene), heading();
  }
  function download(name, text) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text])), link.download = name, link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
  // The people now, without those `left` out.
  function stateNow(left = () => false) {
    const { id, r, m } = scene.disks, there = [...id.keys()].filter((i) => !left(i)), of = (list) => there.map((i) => list[i]);
    const both = (name) => { const list = part(name); return there.flatMap((i) => [list[2 * i], list[2 * i + 1]]); };
    return { id: of(id), r: of(r), m: of(m), x: both("position"), u: both("velocity"), w: of(part("spin")) };
  }
  const saves = {
    scene: () => {
      const { title: _, source, period_x_m, reconciliation, drive, ...rest } = copy(scene.content), name = `${nameOf(scene)}_now`, doors = exits(scene.content), now = stateNow((i) => beyond(i, doors));
      const there = ({ people: [a, b] }) => now.id.some((one) => a <= one && one <= b), time = run.step * run.h;
      if (!now.id.length) throw Error("nobody is left before the door");
      if (drive) for (const key of ["goals", "stops", "pushers"]) if (drive[key]) drive[key] = drive[key].filter(there).map((one) => (one.time_s ? { ...one, time_s: Math.max(1e-9, one.time_s - time) } : one));
      const title = titleOf(scene, now.id.length, time), head = { title, source, ...(period_x_m ? { period_x_m } : {}), disks: { data: `${name}.data` } };
      return [[`${name}.toml`, `${toToml({ ...head, ...(drive && { drive }), ...rest })}\n`], [`${name}.data`, toData(now, title)]];
    },
    dump: () => {
      const { id, r, m } = scene.disks;
      const text = run.frames.map((frame) => {
        const box = [0, 1].map((k) => frame.x.filter((_, i) => i % 2 === k)).map((all) => `${least(all) - 1} ${1 - least(all.map((v) => -v))}`);
        const rows = id.map((one, i) => [one, 1, frame.x[2 * i], frame.x[2 * i + 1], 0, r[i], m[i], frame.u[2 * i], frame.u[2 * i + 1], 0, frame.w[i], frame.f[2 * i], frame.f[2 * i + 1]].join(" "));
        return `ITEM: TIMESTEP\n${frame.step}\nITEM: NUMBER OF ATOMS\n${id.length}\nITEM: BOX BOUNDS ff ff pp\n${box.join("\n")}\n-1 1\nITEM: ATOMS id type x y z radius mass vx vy vz omegaz fx fy\n${rows.join("\n")}\n`;
      });
      return [[`${scene.name}.dump`, text.join("")]];
    },
    csv: () => [[`${scene.name}.csv`, ["id,frame,time,x,y", ...run.frames.flatMap((frame, k) => scene.disks.id.map((one, i) => [one, k, +frame.t.toPrecision(12), frame.x[2 * i], frame.x[2 * i + 1]].join(",")))].join("\n") + "\n"]],
  };

  // ---- a link: the scene by name and what was changed, or all of it
  async function share() {
    const own = known.scenes.find((one) => one.name === base), now = { ...run.began, content: scene.content };  // with doors and walls where they were pulled to
    const changed = JSON.stringify(now.content) !== JSON.stringify(own && own.content);
    const again = placed && !placed.moved, whole = own && JSON.stringify(run.began.disks) === JSON.stringify(own.disks);
    const content = changed || !own ? { ...now.content, title: titleOf(now) } : null;
    shared = await hashOf({ base, placed: again ? placed : null, content, disks: again || whole ? null : run.began.disks });
    location.hash = shared, say("The address of this page now holds this scene.");
  }
  async function fromAddress() {
    const hash = location.hash.slice(1);
    let said;
    try { said = hash.startsWith("s=") ? await fromLink(hash.slice(2)) : decodeURIComponent(hash); }
    catch (error) { return refusedLink(error instanceof Wrong ? error.message : "link: it is damaged"); }
    if (typeof said !== "string") return follow(said);
    return said && !known.scenes.some((one) => one.name === said) ? refusedLink(`base: this page has no scene ${said.slice(0, 40)}`) : byName(said);
  }
  const refusedLink = (words) => { if (!scene) byName(""); say(`Not opened: ${words}.`); };
  function follow(said) {
    const own = known.scenes.find((one) => one.name === said.base);
    if (!own && said.base) return refusedLink(`base: this page has no scene ${said.base.slice(0, 40)}`);
    if (!scene) byName("");
    return trying(() => {
      const next = copy({ name: "linked", notes: "", ...own, ...(said.content ? { content: said.content } : {}), ...(said.disks ? { disks: said.disks } : {}) });
      base = own ? own.name : "", placed = null, next.way = said.content ? wayOf(said.content, own) : next.way;
      origin = own && !said.content ? stamp(own) : "";
      if (said.from) {  // of a film: people at rest where they are
        const at = new Map(said.from.id.map((one, i) => [one, said.from.x.slice(2 * i, 2 * i + 2)])), { id, r, m } = next.disks;
        const nobody = said.from.id.find((one) => !id.includes(one));
        if (nobody) wrong(`from.id: ${own.name} has nobody with id ${nobody}`);
        const of = (list) => list.filter((_, i) => at.has(id[i])), x = of(id).flatMap((one) => at.get(one));
        next.disks = { id: of(id), x, u: x.map(() => 0), r: of(r), m: of(m), w: of(id).map(() => 0) };
      }
      if (said.placed) place(said.placed, next), check();
      else if (said.from) begin(next), check();
      else load(next), check(), begin(next);
      if (said.content) origin = stamp(scene);
      heading();
    }, "Not opened: ");
  }
  function byName(name) {
    const own = known.scenes.find((one) => one.name === name) || known.scenes[0];
    base = own.name, placed = null, origin = stamp(own), begin(copy(own));
  }

  // ---- pictures
  const canvas = $("canvas"), scenes = $("scene");
  let chosen = -1, view, timer = 0, pace = 1, budget = STEPS_MS, drawing = null, shared = "";  // `pace`: crowd's time over the clock's, of late
  function fit() {
    const x = scene.disks.x, r = most(scene.disks.r), points = x.flatMap((v, i) => (i % 2 ? [] : [[v, x[i + 1]]]));
    const doors = exits(scene.content).filter((one) => !one.ahead).flatMap((one) => [one.door_start_m, one.door_end_m].map((p) => p.map((v, k) => v + one.outward[k])));
    frameIn(boxOf([...points, ...doors], (scene.content.walls || []).flatMap((one) => [one.start_m, one.end_m]), 1.3, 1.5 * r));
  }
  const frameIn = (box) => { view = fitted(canvas, box, [0.42, 0.54]); };
  function draw() {
    if (drawing && drawing.kind !== "pillar") return outline();
    if (run.moved) heading();
    const pen = cleared(canvas, view), { scale, to } = view, x = part("position"), frame = run.frames.at(-1), { r, id } = scene.disks;
    canvas.classList.toggle("alarm", run.ended !== "");
    stroke(pen, INK, 3, (scene.content.walls || []).map((one) => [to(one.start_m), to(one.end_m)]));
    for (const one of exits(scene.content)) if (!one.ahead) stroke(pen, "#666", 1, [[to(one.door_start_m), to(one.door_end_m)]], [4, 4]);
    const place = (i) => [x[2 * i], x[2 * i + 1]], loads = new Float64Array(id.length), lines = [];
    let largest = 0;
    each(frame, ({ first, second, wall, normal, across }) => {
      const size = long(normal, across);
      for (const one of wall ? [first] : [first, second]) loads[one] = Math.max(loads[one], size);
      largest = Math.max(largest, size), lines.push([first, second, wall, size]);
    });
    id.forEach((one, i) => ["stroke", "fill"].forEach((paint) => disk(pen, paint, to(place(i)), scale * r[i], tint(loads[i], known), one === chosen)));
    const period = scene.content.period_x_m ? scene.content.period_x_m[1] - scene.content.period_x_m[0] : 0;
    const widest = Math.min(10, 1.2 * scale * mean(r)), groups = [1, 2, 3, 4, 5, 6, 7, 8].map(() => []), heaviest = Math.max(largest, known.limits[0]);
    for (const [first, second, wall, size] of lines) {
      const from = place(first), hit = wall && scene.content.walls[second];
      const end = hit ? nearest(from, hit.start_m, hit.end_m) : across(place(second), from, period);
      if (size > 0) groups[Math.min(7, Math.floor(8 * size / heaviest))].push([to(from), to(end)]);
    }
    for (const [colour, more] of [["#fff", widest / 6], ["#000", 0]]) groups.forEach((group, k) => { if (group.length) stroke(pen, colour, widest * (k + 1) / 8 + more, group); });
    marks(pen);
    $("now").textContent = `${(run.step * run.h).toFixed(2)} s: largest force ${number(rounded(largest))} N, ${run.flow.at(-1)[1]} of ${id.length} beyond the door.${timer && pace < 0.9 ? ` Slowed to ${pace.toFixed(1)} of real time.` : ""} ${run.ended}`;
    $("now").classList.toggle("alarm", run.ended !== "");
    if (run.shown !== run.frames.length) run.shown = run.frames.length, curve($("load"), run.load, "load on all walls (N)", rounded), curve($("flow"), run.flow, "people beyond the door"), tell(), list();
  }
  // Flow (per metre and second) and largest contact of late, in words, beside what was measured.
  function tell() {
    const gates = new Map(exits(scene.content).filter((one) => !one.ahead).map((one) => [`${one.door_start_m} ${one.door_end_m}`, gap(one.door_start_m, one.door_end_m)]));
    const widths = [...gates.values()], [t, now] = run.flow.at(-1), [from, then] = run.flow.find(([one]) => one >= Math.max(run.since, t - FLOW_S) - 1e-9) || [t, now];
    const peak = most(run.peak.filter(([one]) => one > t - 1 + 1e-9).map((one) => one[1])), over = widths.reduce((sum, one) => sum + one, 0) * (t - from), count = now - then;
    const known = t - from > 1 - 1e-9 && now > 0 && now < scene.disks.id.length, [low, high] = MEASURED;
    // one person more or less makes no verdict
    const verdict = !known || least(widths) < WIDE_M - 1e-9 ? "" : (count - 1) / over > high ? " No measured crowd flows so fast." : (count + 1) / over < low ? " This one flows less." : " <b>This one flows so.</b>";
    const flow = `Flow <b>${known ? (count / over).toFixed(1) : "–"} people per metre and second</b>, largest`, load = `contact of the last second <b>${number(rounded(peak))} N</b>.`;
    $("crowd").innerHTML = widths.length ? `${flow} ${load} Measured crowds: ${low} to ${high} through doors from ${WIDE_M} m.${verdict}` : `Largest ${load}`;
  }
  function curve(on, points, title, told = (one) => one) {
    const sharp = devicePixelRatio || 1, [wide, high] = [on.clientWidth, on.clientHeight], pen = on.getContext("2d");
    on.width = wide * sharp, on.height = high * sharp, pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    const top = most(points.map((one) => one[1])) || 1, last = points.at(-1)[0] || 1;
    const to = ([t, v]) => [6 + (wide - 12) * t / last, high - 14 - (high - 32) * v / top];
    stroke(pen, "#bbb", 1, [[[6, high - 14], [wide - 6, high - 14]]]);
    stroke(pen, "#0072b2", 1.5, points.slice(1).map((one, k) => [to(points[k]), to(one)]));
    pen.fillStyle = INK, pen.font = "12px system-ui, sans-serif";
    pen.fillText(`${title}: now ${number(told(points.at(-1)[1]))}, largest ${number(told(most(points.map((one) => one[1]))))}`, 6, 12);
    pen.textAlign = "right", pen.fillText(`${last.toFixed(2)} s`, wide - 6, high - 2), pen.textAlign = "left";
  }
  function list() {
    const table = $("contacts"), { id } = scene.disks, rows = [], mine = id.indexOf(chosen);
    table.replaceChildren();
    if (mine < 0) { if (chosen > 0) table.textContent = `Nobody here has the id ${chosen}.`; return; }
    let sum = 0;
    const { friction, arm_reach_m: arms } = scene.content.contact, row = new Map(), key = ({ first, second, wall }) => `${first} ${second} ${wall}`;
    if (!timer && !friction && !arms) core.closed(), each({ contacts: part("resting"), over: run.h }, (one) => row.set(key(one), row.size));
    // without friction what a mean force has across the normal is the turn of the normal meanwhile
    const columns = ["with", "normal", ...(row.size ? ["range in the last step"] : friction ? ["friction"] : [])];
    const range = (k) => (k === undefined ? ["0"] : [...new Set([-1, 1].map((sign) => number(Math.abs(core.extreme(k, sign)) / run.h).replace("Infinity", "∞")))]);
    each(run.frames.at(-1), (one) => {
      const { first, second, wall, normal, across } = one;
      if (first !== mine && (wall || second !== mine)) return;
      const size = long(normal, across);
      sum += size;
      rows.push([wall ? `wall ${scene.content.walls[second].name}` : `${id[first === mine ? second : first]}`, `${number(normal)} N`, row.size ? `${range(row.get(key(one))).join(" to ")} N` : `${number(Math.abs(across))} N`].slice(0, columns.length));
    });
    table.append(tableOf(`Person ${chosen}: contacts ${rows.length}, sum ${number(sum)} N`, columns, rows));
  }
  function say(words) { $("said").textContent = words; }

  // ---- steering
  const push = ({ content: { drive }, disks } = scene) => (drive ? mean(disks.m) * drive.speed_m_per_s / drive.relaxation_time_s : 0);
  const width = () => { const one = exits(scene.content)[0]; return one && !one.ahead ? gap(one.door_start_m, one.door_end_m) : 0; };
  function fill() {
    const { disks, content } = scene, is = { people: disks.id.length, radius: placed ? placed.radius : +mean(disks.r).toFixed(3), seed: placed ? placed.seed : 1, push: +push().toPrecision(4),
      friction: content.contact.friction || 0, restitution: content.contact.restitution, door: +width().toFixed(3), pushing: shareOf(content.drive) };
    for (const [name, value] of Object.entries(is)) $(name).value = value;
    for (const name of ["people", "radius", "seed", "door"]) $(name).disabled = !width();
    for (const name of ["push", "pushing"]) $(name).disabled = !content.drive;
  }
  // Steps as far as the clock, but no longer than leaves time for 30 pictures a second: then the crowd is slower than the clock.
  function loop(last, late) {
    return (now) => {
      if (!timer) return;
      const passed = (now - last) / 1000;
      budget = passed > PICTURE_S ? Math.max(4, 0.8 * budget) : Math.min(STEPS_MS, budget + 1);
      let time = Math.min(0.05, passed) + late, from = performance.now(), cost = 0, made = 0;
      for (const until = from + budget; time >= run.h && from + cost < until && advance(); made += run.h, time -= run.h) cost = performance.now() - from, from += cost;
      pace += 0.05 * (made / Math.max(passed, 1e-3) - pace);
      if (!still.matches || run.shown !== run.frames.length) draw();
      if (timer) timer = requestAnimationFrame(loop(now, Math.min(time, run.h)));
    };
  }
  function pause() { cancelAnimationFrame(timer); timer = 0; $("play").textContent = "Press"; }
  function play() {
    if (timer) { pause(); return list(); }
    undrawn();
    if (run.ended) return undefined;
    $("play").textContent = "Pause", pace = 1, timer = requestAnimationFrame(loop(performance.now(), 0));
  }
  function stepOnce() { pause(), undrawn(); const frames = run.frames.length, until = performance.now() + 1000; while (advance() && run.frames.length === frames && performance.now() < until); draw(); }
  function again() { const held = chosen; pause(); begin(run.began); chosen = held; }
  const shareOf = (drive) => (drive && has(drive, "push_share") ? drive.push_share : 1);
  // Push with a share. Where everybody pushes and nothing else is said of distances, they are left out.
  function sharing(drive, value) {
    const usual = Math.max(RULES.time_gap_s, drive.relaxation_time_s), plain = { ...RULES.distance, time_gap_s: usual, push_share: shareOf(drive) };
    if (value < 1 || Object.keys(plain).some((key) => has(drive, key) && drive[key] !== plain[key])) Object.assign(drive, { time_gap_s: drive.time_gap_s || usual, push_share: value });
    else delete drive.time_gap_s, delete drive.push_share;
  }
  // What changes the law begins the record anew, since the time step changes with it.
  function changed(name, value) {
    const act = ({ drive, contact }) => {
      if (name === "pushing") sharing(drive, value);
      else if (name === "push") drive.speed_m_per_s = value * drive.relaxation_time_s / mean(scene.disks.m);
      else contact[name] = value;
    };
    const then = copy(scene.content);
    act(then), limited(then, []), timing({ ...scene, content: then });
    act(scene.content), act(run.began.content);
    const [h] = timing(scene);
    run.since = h === run.h ? run.step * h : 0, run.shown = -1;
    if (h !== run.h) run.step = 0, run.frames = [], run.load = [], run.flow = [], run.peak = [];
    law(), accepted(core.reconnect());
    if (!run.frames.length) accepted(core.begin(0)), write();
    heading(), draw();
  }
  function widen(value) {
    const door = exits(scene.content)[0], half = 0.5 * (value - width());
    const moved = (one, far) => ({ ...one, left: one.along.map((v) => far * v), held: false });
    pulls.push(moved(edge(door, "door_start_m"), -half), moved(edge(door, "door_end_m"), half));
    if (run.step) return;
    while (pulls.length) pull();
    if (placed) placed = { ...placed, moved: true };
    begin({ ...scene, disks: stateNow() });
  }
  function sketch(parts, name) {
    if (!parts.length || !parts[0] || parts[0].length < 3 || !parts.flat(2).every(Number.isFinite)) throw Error("no TOML, and no WKT of one polygon");
    if (parts.flat().length > RULES.most.walls) throw Error(`walls: ${parts.flat().length}. This page takes at most ${RULES.most.walls}`);
    if (Math.max(...parts.flat(2).map(Math.abs)) > RULES.most.start_m) throw Error(`coordinates in m within ±${RULES.most.start_m} are needed`);
    pause();
    drawing = { parts, name, points: [], kind: "door" };
    frame(), say("Tap both ends of the door on a wall.");
  }
  function frame() { frameIn(drawing.parts.length ? boxOf(drawing.parts[0], [], 1, 0.5) : [-8, 8, -6, 6]), draw(), canvas.focus(); }
  function outline() {
    const pen = cleared(canvas, view);
    const { parts, points } = drawing, closed = parts.flatMap((ring) => ring.map((p, i) => [p, ring[(i + 1) % ring.length]]));
    stroke(pen, INK, 3, [...closed, ...points.slice(1).map((p, i) => [points[i], p])].map(([a, b]) => [view.to(a), view.to(b)]));
    return marks(pen);
  }
  function marks(pen) {  // the points that are drawn, and the cross of the keys
    pen.fillStyle = "#0072b2";
    for (const [x, y] of drawing ? drawing.points.map(view.to) : []) pen.fillRect(x - 3, y - 3, 6, 6);
    const [x, y] = cross ? view.to(cross) : [];
    if (cross) stroke(pen, "#0072b2", 2, [[[x - 9, y], [x + 9, y]], [[x, y - 9], [x, y + 9]]]);
  }
  function undrawn() { if (drawing) drawing = null, fit(), say(""), draw(); }
  function tap(point) {
    const at = point.map((v) => Math.round(20 * v) / 20), { points, kind } = drawing;
    if (kind === "pillar") {
      points.push(at);
      if (points.length < 2) return draw();
      const [[a, b], [c, d]] = points, corners = [[a, b], [c, b], [c, d], [a, d]], old = scene.content.walls || [], count = old.length;
      drawing = null;
      if (a === c || b === d) return say("A pillar needs two opposite corners.");
      const walls = [...old, ...corners.map((p, i) => ({ name: `pillar_${count + i + 1}`, start_m: p, end_m: corners[(i + 1) % 4] }))];
      return trying(() => place(asked(), { ...scene, content: { ...scene.content, walls } }));
    }
    if (kind === "room" && points.length > 2 && long(point[0] - points[0][0], point[1] - points[0][1]) < 14 / view.scale) return sketch([points], "room");
    points.push(kind === "room" ? at : point);
    if (kind === "room" || points.length < 2) return draw();
    const ask = drawing, name = ask.name.replace(/\.\w+$/, "");
    const made = trying(() => take({ name: name.replace(/\W/g, "_"), notes: "", content: read(roomOf(ask.parts, points, name), "room"), disks: null }));
    if (!made) drawing = { ...ask, points: [] }, frame();
    return undefined;
  }

  for (const one of known.scenes) scenes.add(new Option(one.content.title, one.name));
  scenes.onchange = () => { pause(); chosen = -1; byName(scenes.value); };
  $("play").onclick = play, $("step").onclick = stepOnce, $("again").onclick = again;
  for (const name of ["people", "radius", "seed", "push", "friction", "restitution", "door"]) $(name).onchange = (event) => {
    const input = event.target;
    if (!input.checkValidity() || input.value === "") { say(`${name}: ${input.validationMessage || "a number is needed"}`); return; }
    if (["people", "radius", "seed"].includes(name)) { pause(); trying(() => place(asked())); } else if (name === "door") trying(() => widen(+input.value));
    else trying(() => changed(name, +input.value));
  };
  $("pushing").oninput = () => trying(() => changed("pushing", +$("pushing").value));
  $("person").oninput = () => { chosen = +$("person").value; draw(); list(); };
  $("room").onclick = () => { pause(); drawing = { parts: [], points: [], kind: "room" }; frame(); say("Tap the corners of the room, the first one again at the end: the picture is 16 m wide."); };
  $("pillar").onclick = () => { pause(); drawing = { parts: [], points: [], kind: "pillar" }; canvas.focus(); say("Tap two opposite corners of the pillar."); };
  $("share").onclick = share;
  for (const one of root.querySelectorAll(".save")) one.onclick = () => trying(() => saves[one.value]().forEach(([name, text]) => download(name, text)));
  $("open").onchange = (event) => { pause(); open(event.target.files); };
  root.ondragover = (event) => event.preventDefault();
  root.ondrop = (event) => { event.preventDefault(); pause(); open(event.dataTransfer.files); };
  let held = null, cross = null;  // what is pulled; the place (m) of the keys' cross
  function down(point) {
    if (drawing) return tap(point);
    held = grip(point, 10 / view.scale);
    if (held) return pulls.push(Object.assign(held, { from: point, gone: [0, 0] }));
    const x = part("position"), found = scene.disks.r.findIndex((r, i) => gap(x.subarray(2 * i), point) <= r);
    chosen = found < 0 ? -1 : scene.disks.id[found], $("person").value = found < 0 ? "" : chosen;
    return list();
  }
  function move(point) {
    if (!held) return;
    const { along, from, gone, left } = held, all = point.map((v, k) => v - from[k]), far = along && all[0] * along[0] + all[1] * along[1];
    held.gone = along ? along.map((v) => far * v) : all, held.left = left.map((v, k) => v + held.gone[k] - gone[k]);
    if (!timer) say("It follows when people press.");
  }
  const up = canvas.onpointerup = canvas.onpointercancel = () => { if (held) held.held = false; held = null; };
  canvas.onpointerdown = (event) => {
    cross = null, down(view.from(event)), draw();
    if (held) canvas.setPointerCapture(event.pointerId), event.preventDefault();
  };
  canvas.onpointermove = (event) => move(view.from(event));
  canvas.addEventListener("touchmove", (event) => { if (held) event.preventDefault(); }, { passive: false });  // no scrolling then
  canvas.onkeydown = (event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] }[event.key], size = event.shiftKey ? 0.05 : 0.25;
    const steer = () => move(cross = cross.map((v, k) => v + size * way[k]));
    const at = canvas.getBoundingClientRect(), middle = () => view.from({ clientX: at.x + at.width / 2, clientY: at.y + at.height / 2 }).map((v) => Math.round(4 * v) / 4);
    const press = () => { if (!cross) cross = middle(); else if (held) up(); else down(cross); };
    const act = cross && way ? steer : { " ": play, ArrowRight: stepOnce, r: again, Enter: press, Escape: () => { up(), cross = null, undrawn(); } }[event.key];
    if (act) event.preventDefault(), act(), draw();
  };
  onresize = () => { if (!drawing) { fit(); run.shown = -1; draw(); } };
  onhashchange = () => { if (location.hash !== shared) { pause(); fromAddress(); } };
  $("key").innerHTML = `Largest force on a person: ${keyOf(known, "N").join(" ")}`;
  window.explore = { advance, core, part, saves, open, openTexts, follow, fromAddress, read, place, timing: () => [run.h, run.interval], to: (point) => view.to(point), get run() { return run; }, get scene() { return scene; } };  // for tests and consoles
  await fromAddress();
  if (!still.matches) play();
})();
