"use strict";
// What film.js and explore.js share: html.py writes it before each.
const dark = matchMedia("screen and (prefers-color-scheme: dark)").matches, INK = dark ? "#eaeaea" : "#1b1b1b";  // of walls and words
const NOBODY = "#f2f2f2", still = matchMedia("(prefers-reduced-motion: reduce)");

function unpacked(text) {  // base64 of a gzip
  const bytes = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
}
async function hashOf(said) {  // what explore.html reads from its address
  const bytes = new Uint8Array(await new Response(new Blob([JSON.stringify(said)]).stream().pipeThrough(new CompressionStream("gzip"))).arrayBuffer());
  return "#s=" + btoa(bytes.reduce((text, one) => text + String.fromCharCode(one), "")).replace(/\+/g, "-").replace(/\//g, "_").replace(/=/g, "");
}
function number(value, unit) {
  if (value === null) return "–";
  const text = value.toFixed(Math.abs(value) < 10 && !Number.isInteger(value) ? 1 : 0).replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f").replace("-", "−");
  return unit ? `${text} ${unit}` : text;
}
const rounded = (value) => +value.toPrecision(2);
// of a person: by the limits that the largest force exceeds
const tint = (most, { above, limits }) => most > 0 ? above[limits.filter((one) => most > one).length] : NOBODY;
const dot = (colour, text, size = "") => `<span><i style="background:${colour};${size}"></i> ${text}</span>`;
const keyOf = ({ above, limits }, unit) => [dot(NOBODY, "0"), ...limits.map((one, k) => dot(above[k], `&lt; ${number(one)}`)), dot(above.at(-1), `&gt; ${number(limits.at(-1), unit)}`)];

// The box [x0, x1, y0, y1] of points; of walls too, where it is then at most so many times as large.
function boxOf(near, walls, times, margin) {
  const about = (all) => [0, 1].flatMap((k) => [Math.min, Math.max].map((pick) => all.reduce((best, one) => pick(best, one[k]), all[0][k])));
  const size = ([x0, x1, y0, y1]) => Math.max(x1 - x0, y1 - y0), [whole, close] = [near.concat(walls), near].map(about);
  const outer = (end, out, k) => (walls.map((one) => one[k >> 1]).find((wall) => Math.abs(wall - end - out) < margin / 2) ?? end) + out;  // no wall lies half in
  return (size(whole) <= times * size(close) ? whole : close).map((end, k) => outer(end, k % 2 ? margin : -margin, k));
}
// Give a canvas the shape of a box, with at most a share of the window's height; how places in m and pixels go over.
function fitted(canvas, [x0, x1, y0, y1], shares) {
  const width = canvas.clientWidth, tall = shares[width < 480 ? 0 : 1] * Math.max(innerHeight, 560), sharp = devicePixelRatio || 1;
  const scale = Math.min(width / (x1 - x0), tall / (y1 - y0)), high = scale * (y1 - y0), left = 0.5 * (width - scale * (x1 - x0));
  canvas.style.height = `${high}px`, canvas.width = width * sharp, canvas.height = high * sharp;
  const from = (event) => { const at = canvas.getBoundingClientRect(); return [x0 + (event.clientX - at.left - left) / scale, y1 - (event.clientY - at.top) / scale]; };
  return { scale, sharp, from, to: ([x, y]) => [left + scale * (x - x0), scale * (y1 - y)] };
}
function cleared(canvas, { sharp }) {
  const pen = canvas.getContext("2d");
  pen.setTransform(sharp, 0, 0, sharp, 0, 0), pen.clearRect(0, 0, canvas.width, canvas.height);
  return pen;
}
function stroke(pen, colour, width, lines, dash = []) {
  pen.strokeStyle = colour, pen.lineWidth = width, pen.setLineDash(dash), pen.beginPath();
  for (const [from, to] of lines) { pen.moveTo(...from); pen.lineTo(...to); }
  pen.stroke(), pen.setLineDash([]);
}
// The outline or the area of a disk, in pixels: half of the outline is below the area.
function disk(pen, paint, [x, y], radius, fill, chosen) {
  pen.beginPath(), pen.arc(x, y, radius, 0, 2 * Math.PI), pen.fillStyle = fill;
  pen.lineWidth = chosen ? 6 : Math.min(1.6, 0.2 * radius), pen.strokeStyle = chosen ? "#000" : "#666", pen[paint]();
}
function nearest([x, y], [a, b], [c, d]) {  // to a point, of a wall
  const [dx, dy] = [c - a, d - b], share = Math.min(1, Math.max(0, ((x - a) * dx + (y - b) * dy) / (dx * dx + dy * dy || 1)));
  return [a + share * dx, b + share * dy];
}
// Across the end of a period (0: none), out of it.
const across = ([x, y], [from], period) => [period && Math.abs(x - from) > period / 2 ? x - Math.sign(x - from) * period : x, y];
function tableOf(caption, head, rows) {
  const made = document.createElement("table");
  made.createCaption().textContent = caption;
  const top = made.createTHead().insertRow(), body = made.createTBody();
  for (const text of head) { const cell = document.createElement("th"); cell.textContent = text; top.append(cell); }
  for (const row of rows) { const line = body.insertRow(); row.forEach((text, k) => { const cell = line.insertCell(); cell.textContent = text; cell.dataset.head = head[k]; }); }
  return made;
}
