"use strict";
// The viewers of a page: each unpacks the numbers that film/page.py packed, and draws them. Nothing is loaded.
document.querySelectorAll(".film").forEach(async (root) => {
  const $ = (name) => root.querySelector(`.${name}`);
  const [play, slider, views, colours, person, now, canvas, table] =
    ["play", "frame", "view", "colour", "person", "now", "canvas", "contacts"].map($);
  const NOBODY = "#f2f2f2", key = $("key"), still = matchMedia("(prefers-reduced-motion: reduce)");
  if (!("DecompressionStream" in window)) {
    root.hidden = false;
    now.textContent = "This browser cannot unpack the film. Its pictures and tables are below.";
    return;
  }
  const scales = {};
  const film = await unpacked($("packed").innerHTML.trim());
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
  // opens where a contact carries most: in the first model in which any does
  const peaks = ({ reel, place }) => reel.frames.map(({ f }) => (f ? f[place] : []).reduce((most, force) => Math.max(most, force), -1));
  const loaded = [middle, ...shown.keys()].find((i) => shown[i].kind === "force" && Math.max(...peaks(shown[i])) > 0);
  views.value = loaded === undefined ? middle : loaded;
  const view = () => shown[views.value];
  slider.value = peaks(view()).indexOf(Math.max(...peaks(view())));

  let chosen = -1;  // a person's place among the ids of the reel
  let timer = 0, box;

  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).json();
  }

  function decode(reel) {
    const last = new Map();
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

  // of a person: forces by the limits that they exceed, percussions in shades
  function tint(most, unit) {
    return unit === "N" ? film.above[film.limits.filter((limit) => most > limit.number).length] : shade(most / scales[unit]);
  }

  function number(value, unit) {
    if (value === null) return "–";
    const digits = value && Math.abs(value) < 10 ? 1 : 0;
    const text = value.toFixed(digits).replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f").replace("-", "−");
    return unit ? `${text} ${unit}` : text;
  }

  function fit() {
    const { reel } = view();
    // where people are in any frame, and the door; the whole room where it is not far larger
    const places = reel.frames.flatMap((frame) => (frame.at ? [...frame.at.values()] : []));
    const door = reel.doors.flatMap(one => [one.slice(0, 2), one.slice(2)]);
    const near = places.concat(door, places.length ? [] : [[0, 0], [1, 1]]);
    const margin = 1.5 * film.place * Math.max(...reel.radius, 1);
    const about = (all) => [0, 1].flatMap((k) => [Math.min, Math.max].map((pick) => all.reduce((best, one) => pick(best, one[k]), all[0][k])));
    const whole = about(near.concat(reel.walls.flatMap((one) => [one.slice(0, 2), one.slice(2)])));
    const size = ([x0, x1, y0, y1]) => Math.max(x1 - x0, y1 - y0);
    const [x0, x1, y0, y1] = size(whole) <= 1.5 * size(about(near)) ? whole : about(near);
    const width = canvas.clientWidth, across = x1 - x0 + 2 * margin, up = y1 - y0 + 2 * margin;
    const tall = (width < 480 ? 0.24 : 0.58) * Math.max(innerHeight, 560);
    const scale = Math.min(width / across, tall / up), sharp = devicePixelRatio || 1;
    canvas.style.height = `${scale * up}px`;
    canvas.width = width * sharp;
    canvas.height = scale * up * sharp;
    const left = (width - scale * across) / 2;
    box = { scale, sharp, to: ([x, y]) => [left + scale * (x - x0 + margin), scale * (y1 + margin - y)] };
  }

  function end(reel, frame, i) {  // of the line of a contact: the other person, or the nearest of the wall
    const b = frame.b[i];
    if (b >= 0) {
      // across the end of a period, out of it
      const [x, y] = frame.at.get(b), far = x - frame.at.get(frame.a[i])[0];
      return [reel.period && Math.abs(far) > reel.period / 2 ? x - Math.sign(far) * reel.period : x, y];
    }
    const [x, y] = frame.at.get(frame.a[i]), [x0, y0, x1, y1] = reel.walls[-b - 1];
    const [dx, dy] = [x1 - x0, y1 - y0];
    const along = Math.min(1, Math.max(0, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy)));
    return [x0 + along * dx, y0 + along * dy];
  }

  function largestOf(frame) {
    const most = new Map();
    frame.a.forEach((a, i) => {
      const size = Math.abs(carried(frame, i) || 0);
      for (const one of frame.b[i] < 0 ? [a] : [a, frame.b[i]]) most.set(one, Math.max(most.get(one) || 0, size));
    });
    return most;
  }

  function draw() {
    const { reel, kind, unit } = view(), frame = frameOf(), pen = canvas.getContext("2d");
    const { scale, sharp, to } = box, by = kind === "difference" ? "difference" : colours.value;
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    canvas.classList.toggle("alarm", frame.s !== "solved" && (kind === "difference" || isRigid()));
    stroke(pen, "#000", 3, reel.walls.map(([a, b, c, d]) => [to([a, b]), to([c, d])]));
    for (const one of reel.doors) stroke(pen, "#666", 1, [[to(one.slice(0, 2)), to(one.slice(2))]], [4, 4]);
    if (frame.at) {
      const most = largestOf(frame);
      frame.p.forEach((one, i) => {
        const [x, y] = to(frame.at.get(one));
        pen.beginPath();
        pen.arc(x, y, scale * film.place * reel.radius[one], 0, 2 * Math.PI);
        pen.fillStyle = by === "force" && most.get(one) ? tint(most.get(one), unit) : NOBODY;
        pen.fill();
        pen.lineWidth = one === chosen ? 4 : Math.min(0.8, 0.1 * scale * film.place * reel.radius[one]);
        pen.strokeStyle = one === chosen ? "#000" : "#666";
        pen.stroke();
      });
      frame.a.forEach((a, i) => {
        const size = carried(frame, i);
        if (!size) return;
        const line = [[to(frame.at.get(a)), to(end(reel, frame, i))]];
        const widest = Math.min(10, 1.2 * scale * film.place * reel.radius[a]);
        const width = Math.max(widest / 10, widest * Math.min(1, Math.abs(size) / scales[unit]));
        if (by === "force") stroke(pen, "#fff", width + widest / 6, line);
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
    say(frame);
    list(frame);
  }

  function look(by, frame, i, size) {
    if (by === "difference") return size > 0 ? { colour: film.colours.more } : { colour: film.colours.less, dash: [5, 3] };
    if (by === "force") return { colour: "#000" };
    return [{ colour: "#666", dash: [2, 3] }, { colour: film.colours.open, dash: [5, 3] }, { colour: film.colours.known }][frame.d[i] + 1];
  }

  function stroke(pen, colour, width, lines, dash = []) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    for (const [from, to] of lines) { pen.moveTo(...from); pen.lineTo(...to); }
    pen.stroke();
    pen.setLineDash([]);
  }

  function say(frame) {
    const { reel, unit } = view();
    let most = 0;
    if (frame.a) frame.a.forEach((_, i) => { most = Math.max(most, Math.abs(carried(frame, i) || 0)); });
    const rigid = reel.units.percussions && (view().kind === "difference" || isRigid());
    const solved = frame.s !== "solved" ? `, percussions ${frame.s}: ${frame.why}` : rigid ? ", solved" : "";
    const jump = reel.jumps.includes(frame.n) ? ", a number jumps since the frame before" : "";
    const what = view().kind === "difference" ? "largest difference" : unit === "N" ? "largest force" : "largest percussion";
    now.textContent = `${frame.t.toFixed(2)} s, frame ${frame.n}: `
      + `${what} ${number(+most.toPrecision(3), unit)}${reel.units.percussions ? solved : ""}${jump}.`;
    now.classList.toggle("alarm", frame.s !== "solved" && "percussions" in reel.units);
    slider.setAttribute("aria-valuetext", now.textContent);
  }

  function list(frame) {
    const { reel, unit, kind } = view();
    table.replaceChildren();
    if (chosen < 0 || !frame.at || !frame.at.has(chosen)) {
      table.textContent = chosen < 0 ? (person.value && `Nobody here has the id ${person.value}. `)
        + "Point at a person, or give an id, to see its contacts."
        : `Person ${reel.ids[chosen]} is not in this frame.`;
      return;
    }
    const head = kind === "difference" ? ["with", "soft", "rigid", "difference"]
      : isRigid() ? ["with", "force", "can be", "determined"] : ["with", "force"];
    if (unit !== "N") head[head.indexOf("force")] = "percussion";
    let sum = 0;
    const rows = [];
    frame.a.forEach((a, i) => {
      const b = frame.b[i], size = carried(frame, i);
      if ((a !== chosen && b !== chosen) || size === null) return;
      sum += size;
      const other = b < 0 ? `wall ${reel.names[-b - 1]}` : `${reel.ids[a === chosen ? b : a]}`;
      const part = (k) => number(frame.f[k][i] < 0 ? null : frame.f[k][i] * reel.step, unit);
      const ends = [frame.lo[i], frame.hi[i]].map((v) => (v < 0 ? "?" : number(v * reel.step)));
      const known = ["not known", "no", "yes"][frame.d[i] + 1];
      rows.push(kind === "difference" ? [other, part(0), part(1), number(size, unit)]
        : isRigid() ? [other, number(size, unit), `${ends.join(" – ")} ${unit}`, known] : [other, number(size, unit)]);
    });
    const made = document.createElement("table");
    made.createCaption().textContent = `Person ${reel.ids[chosen]}: contacts ${rows.length}, sum ${number(sum, unit)}`;
    const top = made.createTHead().insertRow();
    head.forEach((text) => { const cell = document.createElement("th"); cell.textContent = text; top.append(cell); });
    const body = made.createTBody();
    rows.forEach((row) => {
      const line = body.insertRow();
      row.forEach((text, k) => { const cell = line.insertCell(); cell.textContent = text; cell.dataset.head = head[k]; });
    });
    table.append(made);
  }

  function explain() {
    const { reel, unit, kind } = view(), by = kind === "difference" ? kind : colours.value;
    const of = film.colours;
    const line = (colour, dash, text) => `<span><b class="line" style="border-color:${colour};border-top-style:${dash ? "dashed" : "solid"}"></b> ${text}</span>`;
    const dot = (colour, text, size = "") => `<span><i style="background:${colour};${size}"></i> ${text}</span>`;
    const parts = {
      difference: () => [line(of.more, false, "more in soft bodies"), line(of.less, true, "more in rigid bodies")],
      open: () => [line(of.known, false, "fixed by equilibrium"), line(of.open, true, "not unique: within the range of the table"), line("#666", true, "not known")],
      force: () => unit === "N" ? [dot(NOBODY, "0"), ...film.limits.map((limit, k) => dot(film.above[k], `&lt; ${number(limit.number)}`)),
        dot(film.above[film.limits.length], `&gt; ${number(film.limits.at(-1).number)}`)]
        : [dot(NOBODY, "0"), `<i style="background:linear-gradient(to right, ${film.shades.join(",")});width:6rem"></i>`],
    }[by]();
    if (by !== "open") parts.push(`<span><b class="wedge"></b> ${number(+scales[unit].toPrecision(2), unit)}</span>`);
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
  function renew() { fit(); explain(); draw(); }
  function choose(event) {
    const { left, top } = canvas.getBoundingClientRect(), { reel } = view(), frame = frameOf();
    const near = (one) => { const [x, y] = box.to(frame.at.get(one)); return Math.hypot(x - event.clientX + left, y - event.clientY + top); };
    const found = frame.at ? frame.p.find((one) => near(one) <= box.scale * film.place * reel.radius[one]) : undefined;
    if (found === undefined || found === chosen) return;
    chosen = found;
    person.value = reel.ids[found];
    draw();
  }
  play.onclick = toggle;
  slider.oninput = () => { pause(); draw(); };
  views.onchange = () => { chosen = view().reel.ids.indexOf(+person.value || NaN); renew(); };
  colours.onchange = renew;
  person.oninput = () => { chosen = person.value === "" ? -1 : view().reel.ids.indexOf(+person.value); draw(); };
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
