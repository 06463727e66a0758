// The viewers of a page: each unpacks the numbers that film/page.py packed, and draws them. Nothing is loaded.
document.querySelectorAll(".film").forEach(async (root) => {
  const $ = (name) => root.querySelector(`.${name}`);
  const [play, slider, views, colours, person, now, canvas, table] =
    ["play", "frame", "view", "colour", "person", "now", "canvas", "contacts"].map($);
  const key = $("key");
  if (!("DecompressionStream" in window)) {
    root.hidden = false;
    now.textContent = "This browser cannot unpack the film. Its pictures and tables are below.";
    return;
  }
  const scales = {};
  const film = await unpacked($("packed").innerHTML).json();
  root.previousElementSibling.remove();
  root.hidden = false;
  // what can be shown: each model of each reel and, where their units are the same, the difference
  const shown = [];
  film.reels.forEach((reel, number) => {
    decode(reel);
    const of = reel.engine && film.reels.length > 1 ? `, positions of ${reel.engine}` : "";
    const soft = reel.units.percussions ? `${reel.bodies} (${reel.engine})` : "rigid";
    Object.keys(reel.units).forEach((model, place) => {
      const title = model === "engine" ? soft : reel.engine ? `rigid (percussions)${of}` : reel.title;
      shown.push({ reel, number, kind: "force", place, title, unit: reel.units[model] });
    });
    if (reel.units.engine && reel.units.engine === reel.units.percussions)
      shown.push({ reel, number, kind: "difference", title: `${reel.bodies} − rigid${of}`, unit: "N" });
  });
  shown.forEach((one, i) => views.add(new Option(one.title, i)));
  const middle = shown.findIndex((one) => one.number === (film.reels[0].engine ? 0 : film.reels.length >> 1));
  slider.max = film.reels[0].frames.length - 1;
  // opens on a typical frame, near the dot of the largest force: in the first model in which any carries
  const peaks = ({ reel, place }) => reel.frames.map(({ f, t }) => (f && t >= reel.since ? f[place] : []).reduce((most, force) => Math.max(most, force), -1));
  const loaded = [middle, ...shown.keys()].find((i) => shown[i].kind === "force" && Math.max(...peaks(shown[i])) > 0);
  views.value = loaded === undefined ? middle : loaded;
  const view = () => shown[views.value];
  const sorted = peaks(view()).filter((one) => one > 0).sort((a, b) => a - b);
  slider.value = peaks(view()).indexOf(sorted[sorted.length >> 1]);

  let chosen = -1;  // the place of a person's first disk among the ids of the reel
  let timer = 0, box;

  function decode(reel) {
    const last = new Map(), members = new Map(reel.person.map((who) => [who, []]));
    reel.person.forEach((who, one) => members.get(who).push(one));
    reel.members = [...members];
    const summed = (steps) => { let sum = 0; return steps.map((step) => (sum += step)); };
    for (const frame of reel.frames) {
      if (!frame.p) continue;
      frame.p = summed(frame.p);
      frame.a = summed(frame.a);
      frame.at = new Map();
      frame.p.forEach((one, i) => {
        const [x, y] = last.get(one) || [0, 0];
        last.set(one, [x + frame.x[2 * i], y + frame.x[2 * i + 1]]);
        frame.at.set(one, last.get(one).map((value) => value * film.place));
      });
    }
    // one scale for all that has one unit
    Object.values(reel.units).forEach((unit, model) => reel.frames.forEach((frame) => (frame.f ? frame.f[model] : [])
      .forEach((force) => { scales[unit] = Math.max(scales[unit] || reel.step, force * reel.step); })));
  }

  const frameOf = () => view().reel.frames[slider.value];
  // what a contact carries in this view: null where the model has no such contact
  function carried(frame, i) {
    const { kind, place, reel } = view();
    if (kind === "force") return frame.f[place][i] < 0 ? null : frame.f[place][i] * reel.step;
    return (Math.max(0, frame.f[0][i]) - Math.max(0, frame.f[1][i])) * reel.step;
  }
  const isRigid = () => Object.keys(view().reel.units)[view().place] === "percussions";

  function shade(share) {
    const place = Math.min(1, Math.max(0, share)) * (film.shades.length - 1);
    const low = Math.min(Math.floor(place), film.shades.length - 2);
    const part = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
    const [from, to] = [part(film.shades[low]), part(film.shades[low + 1])];
    return `rgb(${from.map((value, k) => Math.round(value + (place - low) * (to[k] - value)))})`;
  }

  function fit() {
    const { reel } = view();
    // where people are in any frame, and the door; the whole room where it is not far larger
    const places = reel.frames.flatMap((frame) => (frame.at ? [...frame.at.values()] : []));
    const door = reel.doors.flatMap(one => [one.slice(0, 2), one.slice(2)]);
    const margin = 1.5 * film.place * Math.max(...reel.radius, 1);
    const walls = reel.walls.flatMap((one) => [one.slice(0, 2), one.slice(2)]);
    // not those who left, where most are between walls
    const [left, right, low, high] = walls.length ? boxOf(walls, [], 1, margin) : [];
    const inside = places.filter(([x, y]) => left <= x && x <= right && low <= y && y <= high);
    const near = (2 * inside.length > places.length ? inside : places).concat(door, places.length ? [] : [[0, 0], [1, 1]]);
    box = fitted(canvas, boxOf(near, walls, 1.2, margin), [0.24, 0.58]);
  }

  function end(reel, frame, i) {  // of the line of a contact: the other person, or the nearest of the wall
    const b = frame.b[i], from = frame.at.get(frame.a[i]);
    if (b >= 0) return across(frame.at.get(b), from, reel.period);
    const wall = reel.walls[-b - 1];
    return nearest(from, wall.slice(0, 2), wall.slice(2));
  }

  function largestOf(frame) {
    const most = new Map(), { person } = view().reel;
    frame.a.forEach((a, i) => {
      const size = Math.abs(carried(frame, i) || 0);
      for (const one of frame.b[i] < 0 ? [a] : [a, frame.b[i]]) most.set(person[one], Math.max(most.get(person[one]) || 0, size));
    });
    return most;
  }

  function draw() {
    const { reel, kind, unit } = view(), frame = frameOf(), pen = cleared(canvas, box);
    const { scale, to } = box, by = kind === "difference" ? "difference" : colours.value;
    canvas.classList.toggle("alarm", frame.s !== "solved" && (kind === "difference" || isRigid()));
    stroke(pen, INK, 3, reel.walls.map(([a, b, c, d]) => [to([a, b]), to([c, d])]));
    for (const one of reel.doors) stroke(pen, "#666", 1, [[to(one.slice(0, 2)), to(one.slice(2))]], [4, 4]);
    if (frame.at) {
      const most = largestOf(frame);
      // of a person with several disks what they cover together: all outlines before all areas
      for (const [who, members] of reel.members) for (const paint of ["stroke", "fill"]) for (const one of members) {
        if (!frame.at.has(one)) continue;
        const force = by === "force" && most.get(who) || 0, fill = unit === "N" || !force ? tint(force, film) : shade(force / scales[unit]);
        disk(pen, paint, to(frame.at.get(one)), scale * film.place * reel.radius[one], fill, who === chosen);
      }
      frame.a.forEach((a, i) => {
        const size = carried(frame, i);
        if (!size) return;
        const line = [[to(frame.at.get(a)), to(end(reel, frame, i))]];
        const widest = Math.min(10, 1.2 * scale * film.place * reel.radius[a]);
        const width = Math.max(widest / 10, widest * Math.min(1, Math.abs(size) / scales[unit]));
        if (by === "force" && width > widest / 10) stroke(pen, "#fff", width + widest / 6, line);
        const { colour, dash } = look(by, frame, i, size);
        stroke(pen, colour, width, line, dash);
      });
      pen.fillStyle = film.colours.head;
      if (frame.h) frame.p.forEach((one, i) => {
        const [x, y] = to(frame.at.get(one)), away = scale * film.place;
        pen.beginPath();
        pen.arc(x + away * frame.h[2 * i], y - away * frame.h[2 * i + 1], 2, 0, 2 * Math.PI);
        pen.fill();
      });
    }
    $("live").disabled = !frame.p || !frame.p.length;
    say(frame);
    list(frame);
  }

  function look(by, frame, i, size) {
    if (by === "difference") return size > 0 ? { colour: film.colours.more } : { colour: film.colours.less, dash: [5, 3] };
    if (by === "force") return { colour: "#000" };
    return [{ colour: "#666", dash: [2, 3] }, { colour: film.colours.open, dash: [5, 3] }, { colour: film.colours.known }][frame.d[i] + 1];
  }

  function say(frame) {
    const { reel, unit } = view();
    let most = 0;
    if (frame.a) frame.a.forEach((_, i) => { most = Math.max(most, Math.abs(carried(frame, i) || 0)); });
    const rigid = reel.units.percussions && (view().kind === "difference" || isRigid());
    const solved = frame.s !== "solved" ? `, percussions ${frame.s}: ${frame.why}` : rigid ? ", solved" : "";
    const jump = reel.jumps.includes(frame.n) ? ", but a jump since the frame before: doubt it" : "";
    const what = view().kind === "difference" ? "largest difference" : unit === "N" ? "largest force" : "largest percussion";
    now.textContent = `${frame.t.toFixed(2)} s: `
      + `${what} ${number(rounded(most), unit)}${reel.units.percussions ? solved : ""}${jump}.`;
    now.classList.toggle("alarm", frame.s !== "solved" && "percussions" in reel.units);
    slider.setAttribute("aria-valuetext", now.textContent);
  }

  function list(frame) {
    const { reel, unit, kind } = view();
    table.replaceChildren();
    if (chosen < 0 || !frame.at || !frame.at.has(chosen)) {
      table.textContent = chosen < 0 ? `Frame ${frame.n}. ${person.value && `Nobody here has the id ${person.value}. `}`
        + "Point at a person, or give an id, to see its contacts."
        : `Person ${reel.ids[chosen]} is not in this frame.`;
      return;
    }
    const head = kind === "difference" ? ["with", "soft", "rigid", "difference"]
      : isRigid() ? ["with", "force", "can be", "determined"] : ["with", "force"];
    if (unit !== "N") head[head.indexOf("force")] = "percussion";
    let sum = 0;
    const rows = [];
    frame.a.forEach((_, i) => {
      const [a, b] = [frame.a[i], frame.b[i]].map((one) => reel.person[one] ?? one), size = carried(frame, i);
      if ((a !== chosen && b !== chosen) || size === null) return;
      sum += size;
      const other = b < 0 ? `wall ${reel.names[-b - 1]}` : `${reel.ids[a === chosen ? b : a]}`;
      const part = (k) => number(frame.f[k][i] < 0 ? null : frame.f[k][i] * reel.step, unit);
      const ends = [frame.lo[i], frame.hi[i]].map((v) => (v < 0 ? "?" : number(v * reel.step)));
      const known = ["not known", "no", "yes"][frame.d[i] + 1];
      rows.push(kind === "difference" ? [other, part(0), part(1), number(size, unit)]
        : isRigid() ? [other, number(size, unit), `${ends.join(" – ")} ${unit}`, known] : [other, number(size, unit)]);
    });
    table.append(tableOf(`Person ${reel.ids[chosen]}: contacts ${rows.length}, sum ${number(sum, unit)}`, head, rows));
  }

  function explain() {
    const { reel, unit, kind } = view(), by = kind === "difference" ? kind : colours.value;
    const of = film.colours;
    const line = (colour, dash, text) => `<span><b class="line" style="border-color:${colour};border-top-style:${dash ? "dashed" : "solid"}"></b> ${text}</span>`;
    const parts = {
      difference: () => [line(of.more, false, "more in soft bodies"), line(of.less, true, "more in rigid bodies")],
      open: () => [line(of.known, false, "fixed by equilibrium"), line(of.open, true, "not unique: within the range of the table"), line("#666", true, "not known")],
      force: () => unit === "N" ? keyOf(film, scales[unit] > 0 ? "" : unit) : [dot(NOBODY, "0"), `<i style="background:linear-gradient(to right, ${film.shades.join(",")});width:6rem;border-radius:0"></i>`],
    }[by]();
    if (by !== "open" && scales[unit] > 0) parts.push(`<span><b class="wedge"></b> 0–${number(rounded(scales[unit]), unit)}</span>`);
    if (reel.frames.some((frame) => frame.h)) parts.push(dot(of.head, "head, as filmed", "width:.4rem;height:.4rem"));
    key.innerHTML = parts.join(" ");
  }

  function pause() { clearInterval(timer); timer = 0; play.textContent = "Play"; }
  function go(step) {
    const count = +slider.max + 1;
    slider.value = (+slider.value + step + count) % count;
    draw();
  }
  function toggle() {
    if (timer) return pause();
    const frames = view().reel.frames, apart = frames.length > 1 ? 1000 * (frames[1].t - frames[0].t) : 500;
    timer = setInterval(() => go(1), still.matches ? 1000 : Math.min(500, Math.max(100, apart)));
    play.textContent = "Pause";
  }
  // The page explore.html goes on with these people from where they are, at rest.
  async function goOn() {
    const { reel } = view(), frame = frameOf(), x = frame.p.flatMap((one) => frame.at.get(one));
    location.href = `explore.html${await hashOf({ base: film.live, from: { id: frame.p.map((one) => reel.ids[one]), x } })}`;
  }
  $("live").hidden = !film.live;
  $("live").onclick = goOn;
  function renew() { fit(); explain(); draw(); }
  function choose(event) {
    const { reel } = view(), frame = frameOf(), [x, y] = box.from(event);
    const far = (one) => Math.hypot(frame.at.get(one)[0] - x, frame.at.get(one)[1] - y);
    const found = frame.at ? reel.person[frame.p.find((one) => far(one) <= film.place * reel.radius[one])] : undefined;
    if (found === undefined || found === chosen) return;
    chosen = found;
    person.value = reel.ids[found];
    draw();
  }
  play.onclick = toggle;
  slider.oninput = () => { pause(); draw(); };
  const asked = () => view().reel.person[view().reel.ids.indexOf(+person.value || NaN)] ?? -1;
  views.onchange = () => { chosen = asked(); renew(); };
  colours.onchange = renew;
  person.oninput = () => { chosen = asked(); draw(); };
  canvas.onpointermove = canvas.onpointerdown = choose;
  window.onresize = renew;
  canvas.onkeydown = (event) => {
    const next = () => { views.value = (+views.value + 1) % shown.length; views.onchange(); };
    const other = () => { colours.selectedIndex ^= 1; renew(); };
    const act = { " ": toggle, ArrowRight: () => go(1), ArrowLeft: () => go(-1), m: next, c: other,
      Home: () => go(-slider.value), End: () => go(slider.max - slider.value) }[event.key];
    if (act) { event.preventDefault(); act(); }
  };
  renew();
});
