// The report and its columns: read once, kept by run.
const report = JSON.parse(document.getElementById("report").textContent);
const byId = (id) => document.getElementById(id);
const SOFT = {willReadFrequently: true}; // plain canvases are painted without the graphics process, which a browser just begun has to start

// A text of a file as it can be read: what turns the direction of writing, and control characters, show as a mark.
const HIDDEN = /[\u0000-\u0008\u000b\u000c\u000e-\u001f\u007f-\u009f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/g;
const visible = (text) => text.replace(HIDDEN, "\ufffd");
const short = (text, most) => (text.length > most ? text.slice(0, most) + "\u2026" : text);

// An element; texts are put in as texts, never as markup.
function make(tag, attributes, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes || {})) {
    if (name === "class") made.className = value;
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value);
  }
  for (const child of children) if (child !== null && child !== undefined) made.append(typeof child === "string" ? visible(child) : child);
  return made;
}

const valueAt = (path) => path.split(".").reduce((v, key) => (v === null || v === undefined ? v : v[key]), report);

function number(value, digits) {
  if (value === null || value === undefined || Number.isNaN(value)) return "-";
  const text = Number(value).toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text;
}

// A number of the report as the page shows it, with the key that it stands under in the JSON.
function figure(path, digits, unit) {
  return make("span", {"data-key": path, "data-digits": digits}, number(valueAt(path), digits) + (unit && typeof valueAt(path) === "number" ? " " + unit : ""));
}

function clockText(seconds) {
  if (seconds < 60) return seconds.toFixed(2) + " s";
  const whole = Math.round(seconds), two = (v) => String(v).padStart(2, "0");
  return Math.floor(whole / 3600) + ":" + two(Math.floor(whole / 60) % 60) + ":" + two(whole % 60);
}

function table(heads, rows, numeric) {
  const right = (k) => (numeric.includes(k) ? {class: "n"} : {});
  return make("div", {class: "scroll"}, make("table", {},
    heads.some((h) => h) ? make("thead", {}, make("tr", {}, ...heads.map((h, k) => (h ? make("th", {scope: "col", ...right(k)}, h) : make("td", {}))))) : null,
    make("tbody", {}, ...rows.map((row) => make("tr", {}, ...row.map((cell, k) => make("td", right(k), cell)))))));
}

async function inflated(base64) {
  let bytes;
  if (Uint8Array.fromBase64) bytes = Uint8Array.fromBase64(base64);
  else {
    const text = atob(base64);
    bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  }
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Columns as postproc/page/columns.py packs them: byte planes of differences.
function readColumns(bytes, heads) {
  const found = {};
  let at = 0;
  for (const {name, step, count, planes} of heads) {
    const out = new Float32Array(count);
    const scale = step >= 1 ? step : 1 / Math.round(1 / step);
    let whole = 0;
    for (let i = 0; i < count; i++) {
      let zigzag = bytes[at + i];
      for (let p = 1; p < planes; p++) zigzag |= bytes[at + p * count + i] << (8 * p);
      whole = (whole + ((zigzag >>> 1) ^ -(zigzag & 1))) | 0;
      out[i] = whole === -2147483648 ? NaN : whole * scale;
    }
    at += count * planes;
    found[name] = out;
  }
  return found;
}

const runs = new Map();

// The run of a number with its columns; null where it was not converted.
async function loaded(k) {
  const info = report.runs[k];
  if (!info.points) return {k, info, count: 0, columns: {}, time: new Float64Array(0)};
  if (runs.has(k)) return runs.get(k);
  const columns = readColumns(await inflated(byId("points-" + k).textContent), info.points.columns);
  const count = info.points.count, time = new Float64Array(count);
  let total = 0;
  for (let i = 0; i < count; i++) { total += columns["time step"][i] / 1000; time[i] = total; }
  const end = Math.max(total, info.conversion.cycle_time_s || 0); // the machine may rest behind its last block
  const run = {k, info, count, columns, time, end, legs: null, solids: []};
  if (info.points.legs) run.legs = readColumns(await inflated(info.points.legs.data), info.points.legs.columns);
  for (const solid of info.solids) run.solids.push(readColumns(await inflated(solid.data), solid.columns));
  runs.set(k, run);
  return run;
}

// The last point at or before a time.
function pointAt(run, seconds) {
  let low = 0, high = run.count - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (run.time[middle] <= seconds) low = middle; else high = middle - 1;
  }
  return low;
}

// Where the machine is at a time: the point that it leaves, the next one, the share of the way; it rests first, then moves.
function between(run, seconds) {
  const i = pointAt(run, seconds), next = Math.min(i + 1, run.count - 1);
  const rest = run.columns.rest[next] / 1000, span = run.time[next] - run.time[i] - rest;
  const share = next === i || span <= 0 ? (next === i ? 0 : 1) : Math.min(Math.max((seconds - run.time[i] - rest) / span, 0), 1);
  return {i, next, share, at: (name) => run.columns[name][i] + share * (run.columns[name][next] - run.columns[name][i])};
}
