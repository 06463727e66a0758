// What explore.js takes of links and files: the product's schemas (`RULES`, by explore/taken.py), and what its validators say beyond
// them, by the same names. What comes from outside is made anew, key by key; what is wrong is an Error that names the key.
let RULES;
class Float { constructor(value) { this.value = value; } }  // a number that TOML writes with a point
class Wrong extends Error { constructor(words, path = []) { super(words), this.path = path; } }
const wrong = (words, ...path) => { throw new Wrong(words, path); };
const has = (table, key) => Object.hasOwn(table, key), bareOf = (value) => (value instanceof Float ? value.value : value);
const isTable = (value) => value !== null && typeof value === "object" && !Array.isArray(value) && !(value instanceof Float);
const samePoint = ([x, y], [u, v]) => x === u && y === v, hasDoor = (one) => has(one, "door_start_m");
const aheadOf = ([x, y]) => [1, -1].map((s) => [RULES.ahead * (x - 0.5 * s * y), RULES.ahead * (y + 0.5 * s * x)]);  // a door where there is none
const isUnit = ([x, y]) => Math.abs(Math.hypot(x, y) - 1) <= 1e-9;
const BOUNDS = [["maximum", (v, m) => v <= m, "less than or equal to"], ["exclusiveMaximum", (v, m) => v < m, "less than"],
  ["minimum", (v, m) => v >= m, "greater than or equal to"], ["exclusiveMinimum", (v, m) => v > m, "greater than"]];
const POSITIVE = { type: "number", exclusiveMinimum: 0 };
const PLAIN = {  // what a type takes, and how pydantic names it
  number: [(value) => typeof value === "number", "a valid number"], integer: [(value) => Number.isInteger(value), "a valid integer"],
  string: [(value) => typeof value === "string", "a valid string"], boolean: [(value) => typeof value === "boolean", "a valid boolean"],
  array: [Array.isArray, "a valid tuple"], object: [isTable, "a valid dictionary"],
};
const positive = (table, keys) => Object.fromEntries(keys.map((key) => {
  const found = [], value = taken(has(table, key) ? table[key] : null, POSITIVE, [], found);
  return found.length ? wrong(found[0][1], key) : [key, value];
}));

// Validators: before a table is walked they return it, changed; afterwards they only refuse.
const CHECKS = {
  _rising: ([low, high]) => low < high || wrong(`from ${low} to ${high} m. The first must be less`),
  _in_order: ([first, last]) => first <= last || wrong(`${first} to ${last}. The first comes first`),
  _file_name: (name) => /^[^./\\\x00-\x1f][^/\\\x00-\x1f]{0,99}$/u.test(name) || wrong(`${JSON.stringify(name)} is not the name of a file in one folder`),
  _ahead(given) {
    const out = given.outward;
    if (hasDoor(given) || has(given, "door_end_m") || !Array.isArray(out) || out.length !== 2) return given;
    const [x, y] = out.map(bareOf).map((one) => (one === null || one === "" || typeof one === "object" || (typeof one !== "number" && Number.isNaN(Number(one))) ? null : Number(one)));
    if (x === null || y === null) return given;
    const [door_start_m, door_end_m] = aheadOf([x, y]);
    return { ...given, door_start_m, door_end_m };
  },
  _of_push(given, means) {
    if (!has(given, "push_N")) return given;
    const { push_N: push } = positive(given, ["push_N"]), { push_N: _, ...rest } = given, known = means();
    if (!known) wrong("push_N: only where the mass of the disks is known");
    if (has(rest, "speed_m_per_s") && has(rest, "relaxation_time_s")) wrong("push_N: instead of speed_m_per_s, relaxation_time_s, or both");
    if (has(rest, "speed_m_per_s")) return { ...rest, relaxation_time_s: known[1] * positive(rest, ["speed_m_per_s"]).speed_m_per_s / push };
    const { relaxation_time_s: time } = positive({ relaxation_time_s: RULES.relaxation_s, ...rest }, ["relaxation_time_s"]);
    return { ...rest, relaxation_time_s: time, speed_m_per_s: push * time / known[1] };
  },
  _with_a_gap(given) {
    const late = (key) => has(given, key) && bareOf(given[key]) !== RULES.distance[key];
    const key = has(given, "time_gap_s") && given.time_gap_s !== null ? "" : Object.keys(RULES.distance).find(late);
    return key ? wrong(`${key}: only for people who keep their distance. Give time_gap_s`) : given;
  },
  _check_door(made) {
    if (!isUnit(made.outward)) wrong("outward must be a unit vector");
    if (samePoint(made.door_start_m, made.door_end_m)) wrong("door_start_m and door_end_m are the same point");
    const [start, end] = aheadOf(made.outward);
    if (samePoint(made.door_start_m, start) && samePoint(made.door_end_m, end)) delete made.door_start_m, delete made.door_end_m;
  },
  _one_goal_each(made) {
    if (has(made, "clearance_m") && ![made, ...(made.goals || [])].every(hasDoor)) wrong("clearance_m: a way leads to a door. Give door_start_m and door_end_m");
    for (const name of ["goals", "stops", "pushers"]) {
      const ranges = (made[name] || []).map((one) => one.people).sort(([a, b], [c, d]) => a - c || b - d);
      ranges.slice(1).forEach(([first], k) => { if (first <= ranges[k][1]) wrong(`${name}: person ${first} has two`); });
    }
  },
  _both_or_none(made) {
    const keys = ["arm_reach_m", "arm_force_N"], missing = keys.filter((key) => !has(made, key));
    if (missing.length === 1) wrong(`${missing[0]}: arms need both arm_reach_m and arm_force_N`);
  },
  _of_bodies(given) {
    if (typeof given.law !== "string" || !has(RULES.laws, given.law)) return given;
    const [rubs, own] = RULES.laws[given.law], bare = (key) => (has(given, key) ? bareOf(given[key]) : null);
    if (!rubs && bare("friction")) wrong(`friction: law = ${given.law} has none. Take law = ${RULES.rubbing_law}`);
    if (!own) return given;
    for (const key of ["stiffness_N_per_m", "wall_stiffness_N_per_m"]) if (![null, RULES.nominal].includes(bare(key))) wrong(`${key}: law = ${given.law} has a stiffness of its own`);
    return { ...given, stiffness_N_per_m: RULES.nominal, wall_stiffness_N_per_m: null };
  },
  _of_material(given, means) {
    const keys = ["young_modulus_Pa", "poisson_ratio"], [young, poisson] = keys;
    if (!keys.some((key) => has(given, key))) return given;
    const rest = Object.fromEntries(Object.entries(given).filter(([key]) => !keys.includes(key)));
    if (has(rest, "stiffness_N_per_m") || rest.law !== "hertz") wrong(`${young}: only for law = hertz, and instead of stiffness_N_per_m`);
    const { [young]: modulus } = positive(given, [young]), ratio = bareOf(has(given, poisson) ? given[poisson] : null), found = [];
    taken(ratio, { type: "number", exclusiveMinimum: -1, maximum: 0.5 }, [], found);
    if (found.length) wrong(found[0][1], poisson);
    const known = means() || wrong(`${young}: only where the radius of the disks is known`);
    return { ...rest, stiffness_N_per_m: RULES.per_young_modulus * known[0] * modulus / (1 - ratio ** 2) };
  },
  _is_whole(made) {
    if (samePoint(made.start_m, made.end_m)) wrong("start_m and end_m are the same point");
    for (const key of ["stiffness_N_per_m", "damping_N_s_per_m"]) if (has(made, key) && !has(made, "mass_kg")) wrong(`${key}: a wall that gives needs a mass: give mass_kg`);
  },
  _one_way(made) {
    const [straight, slope, downhill] = ["acceleration_m_per_s2", "slope_deg", "downhill"].map((key) => has(made, key));
    if (straight === slope || slope !== downhill) wrong("acceleration_m_per_s2, or slope_deg and downhill, are needed");
    if (downhill && !isUnit(made.downhill)) wrong("downhill must be a unit vector");
  },
  _a_door_ahead({ drive, period_x_m: period }) {
    const ends = drive ? [drive, ...(drive.goals || [])] : [];
    if (drive && has(drive, "time_gap_s") && !period && !ends.every(hasDoor)) wrong("drive.time_gap_s: who has no door ahead keeps no distance. Give door_start_m");
  },
  _whole_impact: (made) => made.kind !== "impact" || !made.time_s || wrong("time_s: an impact is compared over its whole run. Leave it out"),
  _one_of_each: ({ frames, after_s, data }) => (frames.length === after_s.length && after_s.length === data.length) || wrong("frames, after_s and data need one entry per frame"),
  _of_one_crowd(made) {
    const n = made.id.length;
    if (new Set(made.id).size < n) wrong("id: one distinct integer per disk is needed");
    for (const [key, value] of Object.entries(made)) if (value.length !== n * ("xu".includes(key) ? 2 : 1)) wrong(`${key}: ${value.length} numbers for ${n} people`);
  },
  _one_crowd(made) {
    if (["placed", "disks", "from"].filter((key) => has(made, key)).length > 1) wrong("disks: only one of placed, disks and from");
    if (!made.base && !(has(made, "content") && (has(made, "placed") || has(made, "disks")))) wrong("base: a scene is needed, or a content with placed or disks");
  },
};

// A value as a schema takes it; what is wrong is appended to `found` as [path, words], in pydantic's order.
function taken(given, schema, path, found, means = () => null) {
  const at = schema.anyOf ? schema.anyOf[0] : schema, node = at.$ref ? RULES.$defs[at.$ref.slice(8)] : at, before = found.length;
  const no = (words, ...more) => { found.push([[...path, ...more], words]); };
  if (schema.anyOf && given === null) return null;
  if (node.enum) return node.enum.includes(given) ? given : no(`Input should be ${node.enum.map((one) => `'${one}'`).join(", ").replace(/, ([^,]*)$/, " or $1")}`);
  const value = node.type === "integer" ? given : bareOf(given), [is, named] = PLAIN[node.type];
  if (!is(value)) return no(`Input should be ${named}`);
  if (node.type === "object") return table(value, node, path, found, means);
  if (node.type === "array") {
    if (node.prefixItems && value.length > node.maxItems) return no(`Tuple should have at most ${node.maxItems} items after validation, not ${value.length}`);
    if (value.length > node.maxItems) return no(`${value.length}. This page takes at most ${node.maxItems}`);
    if (node.prefixItems) for (let k = value.length; k < node.minItems; ++k) no("Field required", k);
    else if (value.length < node.minItems) no(`At least ${node.minItems} are needed`);
    const made = value.map((one, k) => taken(one, node.prefixItems ? node.prefixItems[k] : node.items, [...path, k], found, means));
    return checked(made, node.check, before, found, no);
  }
  if (typeof value === "number") {
    if (!Number.isFinite(value)) return no("Input should be a finite number");
    if (node.type === "integer" && !Number.isSafeInteger(value)) return no(`${value}. This page takes at most ${Number.MAX_SAFE_INTEGER}`);
    const [key, , words] = BOUNDS.find(([key, holds]) => has(node, key) && !holds(value, node[key])) || [];
    if (key) return no(`${value}. Input should be ${words} ${node[key]}`);
  }
  if (node.pattern && !new RegExp(node.pattern, "u").test(value)) return no("String should match pattern: a letter, then letters, digits and _, 100 at most");
  return checked(value, node.check, before, found, no);
}
function checked(made, names, before, found, no) {
  if (found.length === before) guarded(() => [names || []].flat().forEach((name) => CHECKS[name](made)), no);
  return made;
}
function guarded(act, no) {
  try { act(); } catch (error) { if (error instanceof Wrong) no(error.message, ...error.path); else throw error; }
}
function table(given, node, path, found, means) {
  const no = (words, ...more) => { found.push([[...path, ...more], words]); }, start = found.length, made = {};
  guarded(() => { for (const name of node.before) given = CHECKS[name](given, means); }, no);
  if (found.length > start) return undefined;
  for (const [key, one] of Object.entries(node.properties)) {
    if (!has(given, key)) { if ((node.required || []).includes(key)) no("Field required", key); continue; }
    const count = found.length, value = taken(given[key], one, [...path, key], found, means);
    const tiny = found.length > count ? undefined : [value].flat().find((part) => typeof part === "number" && part !== 0 && Math.abs(part) < RULES.smallest);
    if (tiny !== undefined) no(`${tiny} is nearer to 0 than ${RULES.smallest}. Write 0`, key);
    if (value !== null) made[key] = value;
  }
  for (const key of Object.keys(given)) if (!has(node.properties, key)) no("unknown key", key.slice(0, 60));
  return checked(made, node.after, start, found, no);
}
// What is wrong in words: a key that is not known first; of what is missing, all.
function said(found) {
  const [first] = found.filter(([, words]) => words === "unknown key").concat(found), [, words] = first;
  const alike = words === "Field required" ? found.filter((one) => one[1] === words) : [first];
  const where = alike.slice(0, 9).map(([path]) => path.join(".")).join(", ");
  return where ? `${where}: ${words}` : words;
}
function read(given, kind, means) {
  const found = [], made = taken(given, RULES[kind], [], found, means);
  if (found.length) wrong(said(found));
  limited(made, []);
  return made;
}
function limited(value, path) {  // by this page
  for (const [key, one] of Object.entries(value)) {
    const most = has(RULES.most, key) ? RULES.most[key] : Infinity, parts = [one].flat(2).filter((part) => typeof part === "number");
    const size = parts.length ? parts.reduce((far, part) => Math.max(far, Math.abs(part)), 0) : typeof one === "object" && !Array.isArray(one) ? 0 : one.length;
    if (size > most) wrong(`${[...path, key].join(".")}: ${size}. This page takes at most ${most}`);
    if (typeof one === "object") limited(one, [...path, key]);
  }
}

// Push shares of people with these ids, as in scene/distance.py: who of them pushes is the first number of numpy's SeedSequence([seed, id]).
function pushShares(drive, ids) {
  const { push_share: share, pushing_people: some, pushers, seed } = { ...RULES.distance, ...drive };
  const stirred = (value) => (value ^ (value >>> 16)) >>> 0, mix = (x, y) => stirred(Math.imul(0xca01f9dd, x) - Math.imul(0x4973f715, y));
  const hashing = (by, factor) => (value) => { const now = value ^ by; return stirred(Math.imul(now, by = Math.imul(by, factor))); };
  const uniform = (id) => {
    const hash = hashing(0x43b0d7e5, 0x931e8875), pool = [seed, id >>> 0, Math.floor(id / 2 ** 32), 0].map(hash);
    for (let from = 0; from < 4; ++from) for (let to = 0; to < 4; ++to) if (from !== to) pool[to] = mix(pool[to], hash(pool[from]));
    return hashing(0x8b51f9dd, 0x58f38ded)(pool[0]) / 2 ** 32;
  };
  return ids.map((id) => {
    const own = pushers.find(({ people: [a, b] }) => a <= id && id <= b);
    return own ? own.push_share : uniform(id) < some ? share : 0;
  });
}

// ---- a scene as a whole: what Scene.check and the rigid engine refuse, and what this page does not have
// `deepest`: the deepest contact of all with gaps of at most so many m, [first, second, is_wall, gap] or nothing.
function checkScene({ content, disks }, deepest) {
  const { walls = [], drive = {}, period_x_m: period } = content, { id, r, x } = disks, gates = [drive, ...(drive.goals || [])].filter(hasDoor);
  if (new Set(walls.map((one) => one.name)).size < walls.length) wrong("walls: two walls have the same name");
  for (const name of ["goals", "stops", "pushers"]) (drive[name] || []).forEach(({ people: [a, b] }, k) => {
    if (!id.some((one) => a <= one && one <= b)) wrong(`drive.${name}: number ${k + 1}: nobody has an id from ${a} to ${b}`);
  });
  const giving = walls.find((one) => has(one, "mass_kg"));
  if (giving) wrong(`walls.mass_kg: ${giving.name} gives. This page takes walls that stand. Use percussions run`);
  if (period) checkPeriod(content, disks, gates.length);
  const slack = RULES.overlap * Math.min(...r), [one, other, isWall, depth] = deepest(slack);
  if (depth < -slack) wrong(`disk ${id[one]} and ${isWall ? `wall ${other + 1}` : `disk ${id[other]}`} overlap by ${(-depth).toPrecision(3)} m`);
  const out = outsider({ content, disks });
  if (out >= 0) wrong(`disk ${id[out]} at (${x[2 * out]}, ${x[2 * out + 1]}) m is outside the walls`);
}
// The first of the people of a scene who is outside its rooms, −1: nobody.
function outsider({ content: { walls = [], drive = {}, period_x_m: period }, disks: { id, x } }) {
  const lines = walls.map((wall) => [wall.start_m, wall.end_m]), doors = [drive, ...(drive.goals || [])].filter(hasDoor).map((gate) => [gate.door_start_m, gate.door_end_m]);
  for (const end of period || []) {  // a room is shut where a period ends
    const there = [...new Set(lines.flat().filter(([at]) => at === end).map(([, y]) => y))].sort((a, b) => a - b);
    there.slice(1).forEach((y, k) => lines.push([[end, there[k]], [end, y]]));
  }
  return outside(id.map((_, i) => [x[2 * i], x[2 * i + 1]]), [...lines, ...doors], doors);
}
function checkPeriod({ walls = [], period_x_m: [low, high], contact }, { id, x, r }, gates) {
  const reach = 2 * Math.max(...r) + (contact.arm_reach_m || 0), ends = new Set(walls.flatMap((wall) => [wall.start_m, wall.end_m].map(String)));
  if (!(high - low > 2 * reach)) wrong(`period_x_m: ${high - low} m. More than two diameters and reaches of arms, ${2 * reach} m, is needed`);
  const out = id.findIndex((_, i) => x[2 * i] < low || x[2 * i] >= high);
  if (out >= 0) wrong(`period_x_m: disk ${id[out]} is not in it, from ${low} to ${high} m`);
  if (gates) wrong("period_x_m: a corridor without end has no door. Leave out door_start_m");
  for (const { name, start_m, end_m } of walls) {
    const [[x0, y0], [x1, y1]] = [start_m, end_m].sort(([a, b], [c, d]) => a - c || b - d);
    for (const [at, end, other] of [[x0, low, high], [x1, high, low]]) {
      if (at === end && y0 === y1 && ends.has(String([other, y0]))) continue;
      if ((at - end) * (other - end) < reach * (high - low)) wrong(`period_x_m: wall ${name} comes within ${reach} m of x = ${end} m. It must keep away, or be level there and go on at the other end`);
    }
  }
}
// Rings of points around the areas that lines bound which meet at their ends (turning left), and around all (turning right).
function ringsOf(lines) {
  const at = new Map(), node = (p) => { const key = String(p); if (!at.has(key)) at.set(key, { p, to: [] }); return at.get(key); };
  for (const [a, b] of lines) { const [m, n] = [node(a), node(b)]; if (m !== n && !m.to.includes(n)) m.to.push(n), n.to.push(m); }
  const cut = (m, n) => { m.to = m.to.filter((one) => one !== n), n.to = n.to.filter((one) => one !== m); };
  for (const one of at.values()) for (let m = one; m.to.length === 1;) { const [n] = m.to; cut(m, n), m = n; }
  for (;;) {
    const ring = new Map(), rings = [], bridges = [], edge = (m, n) => `${m.p} ${n.p}`;
    const angle = (m, n) => Math.atan2(n.p[1] - m.p[1], n.p[0] - m.p[0]);
    for (const m of at.values()) m.to.sort((n, o) => angle(m, n) - angle(m, o));
    for (const m of at.values()) for (const n of m.to) {
      if (ring.has(edge(m, n))) continue;
      const found = [];
      for (let [a, b] = [m, n]; !ring.has(edge(a, b));) {
        ring.set(edge(a, b), rings.length), found.push(a.p);
        if (ring.get(edge(b, a)) === rings.length) bridges.push([a, b]);
        const k = b.to.indexOf(a);
        [a, b] = [b, b.to[(k + b.to.length - 1) % b.to.length]];
      }
      rings.push(found);
    }
    if (!bridges.length) return rings;
    for (const [m, n] of bridges) cut(m, n);
  }
}
const inRing = ([x, y], ring) => ring.reduce((odd, [px, py], i) => { const [qx, qy] = ring[(i + 1) % ring.length]; return (py > y) !== (qy > y) && x < px + (y - py) / (qy - py) * (qx - px) ? !odd : odd; }, false);
// The first of some people who is outside the rooms that walls and doors bound, as in scene/placement.py; −1: nobody, or no room.
function outside(people, lines, doors) {
  const area = (ring) => ring.reduce((sum, [x, y], i) => { const [u, v] = ring[(i + 1) % ring.length]; return sum + x * v - y * u; }, 0);
  const rings = ringsOf(lines), shells = rings.filter((one) => area(one) > 0), round = rings.filter((one) => area(one) < 0);
  const holds = (outer, ring) => { const own = new Set(outer.map(String)); return ring.every((p) => !own.has(String(p)) && inRing(p, outer)); };
  const onRing = (ring, door) => ring.some((p, i) => [p, ring[(i + 1) % ring.length]].map(String).sort().join() === door.map(String).sort().join());
  const rooms = shells.filter((shell) => !shells.some((other) => other !== shell && holds(other, shell))).map((shell) => [shell, ...round.filter((one) => holds(shell, one))]);
  const inRoom = (p) => rooms.some(([shell, ...holes]) => inRing(p, shell) && !holes.some((hole) => inRing(p, hole)));
  const inside = people.map(inRoom), used = inside.some(Boolean) || rooms.some((room) => room.some((ring) => doors.some((door) => onRing(ring, door))));
  return used ? inside.indexOf(false) : -1;
}

// ---- files and links
// TOML as scene files have it, without dotted keys and strings of several lines: tables without prototype.
function fromToml(given) {
  const text = given.replace(/\r\n/g, "\n"), top = Object.create(null), kinds = new Map([[top, "head"]]);
  let at = 0, deep = 0, current = top;
  const fail = (where = at) => { const line = text.slice(0, where).split("\n").length; throw Error(`line ${line}: ${text.split("\n")[line - 1].trim().slice(0, 40)}`); };
  const eat = (pattern) => { pattern.lastIndex = at; const found = pattern.exec(text); if (found) at = pattern.lastIndex; return found; };
  const need = (pattern) => eat(pattern) || fail(), skip = () => { while (eat(/\s+|#.*/y)); };
  const made = (kind, one) => { kinds.set(one, kind); return one; };
  const list = () => {
    const found = [];
    if (++deep > 50) fail();
    for (skip(); !eat(/\]/y); skip()) { found.push(value()), skip(); if (!eat(/,/y) && text[at] !== "]") fail(); }
    --deep;
    return found;
  };
  const braces = () => {
    const one = Object.create(null);
    if (++deep > 50) fail();
    do {
      const [, key] = need(/[ \t]*([\w-]+)[ \t]*=[ \t]*/y);
      if (has(one, key)) fail();
      one[key] = value();
    } while (eat(/[ \t]*,/y));
    need(/[ \t]*\}/y), --deep;
    return one;
  };
  function value() {
    const from = at, quoted = eat(/"(?!"")(?:\\.|[^"\\\n])*"/y), literal = quoted || eat(/'(?!'')([^'\n]*)'/y);
    if (quoted && /\\(?:\/|u[dD][89a-fA-F])/.test(quoted[0])) fail(from);
    if (quoted) try { return JSON.parse(quoted[0].replace(/\t/g, "\\t")); } catch { fail(from); }
    if (literal) return literal[1];
    if (eat(/\[/y)) return list();
    if (eat(/\{[ \t]*\}/y)) return Object.create(null);
    if (eat(/\{/y)) return braces();
    const [word] = need(/[\w.+-]+/y), size = Number(word.replace(/_/g, "").replace(/inf$/, "Infinity"));
    if (word === "true" || word === "false") return word === "true";
    const [, part] = /^[-+]?(?:(?:0|[1-9](?:_?\d)*)((?:\.\d(?:_?\d)*)?(?:[eE][-+]?\d(?:_?\d)*)?)|inf|nan)$/.exec(word) || fail(from);
    return part === "" ? size : new Float(size);
  }
  const bad = text.search(/[\x00-\x08\x0b-\x1f\x7f]/);
  if (bad >= 0) fail(bad);
  for (skip(); at < text.length; skip()) {
    const from = at, head = eat(/\[\[[ \t]*([\w.-]+)[ \t]*\]\]|\[[ \t]*([\w.-]+)[ \t]*\]/y);
    if (head) {
      const path = (head[1] || head[2]).split("."), last = path.pop();
      let into = top;
      for (const key of path) {
        into = has(into, key) ? into[key] : (into[key] = made("implied", Object.create(null)));
        if (kinds.get(into) === "list") into = into.at(-1);
        if (!kinds.has(into)) fail(from);
      }
      const known = has(into, last) && kinds.get(into[last]);
      if (!last || path.includes("") || (has(into, last) && known !== (head[1] ? "list" : "implied"))) fail(from);
      current = made("head", known === "implied" ? into[last] : Object.create(null));
      if (!head[1]) into[last] = current;
      else (into[last] ||= made("list", [])).push(current);
    } else {
      const [key] = need(/[\w-]+/y);
      need(/[ \t]*=[ \t]*/y);
      if (has(current, key)) fail(from);
      current[key] = value();
    }
    need(/[ \t]*(?:#.*)?(?:\n|$)/y);
  }
  return top;
}
const volume = (radius) => 4 * Math.PI / 3 * (radius * radius * radius), OF_DISKS = { id: "ids", x: "positions", u: "velocities", r: "radii", m: "masses", w: "spins" };
function fromData(text, name) {
  const widths = { Atoms: [7, 10], Velocities: [7], Molecules: [2] }, rows = { Atoms: [], Velocities: [], Molecules: [] };
  let section = "", count = -1;
  text.split("\n").forEach((line, k) => {
    const where = `${name}, line ${k + 1}`, words = line.replace(/#.*/, "").trim().split(/\s+/), [first] = words;
    const whole = () => (/^\d{1,19}$/.test(first) && +first >= 1 && +first <= RULES.largest_id ? +first : wrong(`${where}: ${first.slice(0, 40)} where a whole number ≥ 1 is needed`));
    if (line.length > 65_535) wrong(`${where}: longer than 65535 characters`);
    if (!first || k === 0) return;
    if (/^\p{L}+$/u.test(first)) {
      if (!has(rows, first) || rows[first].length || words.length > 1) wrong(`${where}: ${line.trim().slice(0, 40)} where ${Object.keys(rows).join(" or ")} is expected`);
      section = first;
    } else if (section) {
      if (!widths[section].includes(words.length)) wrong(`${where}: ${section}: ${words.length} columns where ${widths[section].join(" or ")} are needed`);
      const bad = words.slice(1, 7).find((word) => !/^[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?$/.test(word) || !Number.isFinite(+word));
      if (bad !== undefined) wrong(`${where}: ${section}: ${bad.slice(0, 40)} is not a finite number`);
      if (rows[section].push([whole(), ...words.slice(1, 7).map(Number)]) > count) wrong(`${where}: ${section}: more rows than the ${count} atoms`);
    } else if (words.length === 2 && words[1] === "atoms") {
      count = whole();
      if (count > RULES.people) wrong(`${where}: ${count} atoms. This page takes at most ${RULES.people} people`);
    }
  });
  const { Atoms: a, Velocities: v, Molecules: joined } = rows;
  for (const [key, one] of Object.entries({ Atoms: a, Velocities: v })) if (one.length !== count || !count) wrong(`${name}: truncated: ${key}: ${one.length} rows for ${Math.max(count, 0)} atoms`);
  if (joined.length) wrong(`${name}: Molecules: bodies of several disks. This page takes disks. Use percussions run`);
  for (const one of [a, v]) one.sort(([p], [q]) => p - q);
  if (a.some(([one], i) => one !== v[i][0])) wrong(`${name}: Velocities: the ids differ from those of Atoms`);
  if (a.some((row) => row[6] !== a[0][6])) wrong(`${name}: Atoms: z differs between disks. A crowd is in one plane`);
  if (v.some((row) => row[3] || row[4] || row[5])) wrong(`${name}: Velocities: v_z, ω_x or ω_y is not 0. A crowd is in one plane`);
  const r = a.map((row) => 0.5 * row[2]), m = a.map((row, i) => +(row[3] * volume(r[i])).toPrecision(13)), found = [];
  const disks = { id: a.map((row) => row[0]), r, m, x: a.flatMap((row) => row.slice(4, 6)), u: v.flatMap((row) => row.slice(1, 3)), w: v.map((row) => row[6]) };
  const made = taken(disks, RULES.disks, [], found), [[key, k] = [], words] = found[0] || [];
  if (words && k !== undefined) wrong(`${name}: ${OF_DISKS[key]}: disk ${disks.id["xu".includes(key) ? k >> 1 : k]}: ${words}. This page takes no other`);
  return words ? wrong(`${name}: ${words}. This page takes no other`) : made;
}
// A scene of files, [name, text] each: {name, notes, content, disks}, and which files are not used. Without `disks` it is a room.
function fromFiles(files, room) {
  const find = (named) => files.find(([name]) => named(name)), toml = find((name) => name.endsWith(".toml")), given = fromToml(toml[1]);
  if (!has(given, "disks")) return { name: toml[0], content: read(given, "room", () => room), disks: null, used: [toml[0]], unused: [] };
  const data = isTable(given.disks) && typeof given.disks.data === "string" ? given.disks.data : "", file = find((name) => name === data);
  let disks;
  const crowd = () => (disks ||= file ? fromData(file[1], data) : wrong(`disks.data: open it together with ${data}`)), mean = (all) => all.reduce((sum, one) => sum + one, 0) / all.length;
  const made = read(given, "scene", () => [mean(crowd().r), mean(crowd().m)]), { disks: of, other_frames: _, ...content } = made;
  for (const key of ["bodies", "people"]) if (has(of, key)) throw Error(`disks.${key}: not on this page. This page takes people as data has them. Use percussions run`);
  return { name: toml[0], content, disks: crowd(), used: [toml[0], data], unused: has(made, "other_frames") ? ["other_frames"] : [] };
}
// The text of base64url of a gzip, inflated in pieces, so that nobody waits for what is too large.
async function fromLink(packed) {
  const { bytes: most } = RULES, large = () => wrong(`link: more than ${most / 1e6} MB. This page takes at most that`);
  if (packed.length > most) large();
  const bytes = Uint8Array.from(atob(packed.replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0)), parts = [];
  let at = 0, size = 0;
  const pieces = new ReadableStream({ pull(to) { if (at < bytes.length) to.enqueue(bytes.subarray(at, at += 1024)); else to.close(); } });
  const reader = pieces.pipeThrough(new DecompressionStream("gzip")).getReader();
  for (let one = await reader.read(); !one.done; one = await reader.read()) {
    parts.push(one.value), size += one.value.length;
    if (size > most) { reader.cancel().catch(() => {}); large(); }
  }
  return read(JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(await new Blob(parts).arrayBuffer())), "link");
}
