// Where the time goes; axes over time with the cursor of the picture; limits changed one at a time.
const CAUSE_TEXT = {feed: "programmed feed", limits: "limits of axes", corners: "corners", stops: "stops", rapids: "rapids",
  indexing: "clamping, indexing", tool_change: "tool changes", spindle: "spindle", dwell: "dwells", commands: "commands"};

function svg(tag, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

// A waterfall: each cause begins where the one before ended.
function waterfall(k) {
  const base = `runs.${k}.conversion.time.causes`, causes = Object.entries(valueAt(base)).filter((one) => one[1] > 0.0005);
  const total = causes.reduce((s, one) => s + one[1], 0) || 1, high = 24, wide = 640, left = 220;
  const drawn = svg("svg", {viewBox: `0 0 ${wide + left + 4} ${high * (causes.length + 1) + 6}`, role: "img", width: "100%",
    "aria-label": "Waterfall of the time by cause", style: "max-width: 900px; min-width: 500px"});
  let at = 0;
  causes.forEach(([name, seconds], row) => {
    const key = name.replace(/_s$/, ""), x = left + wide * at / total, w = Math.max(wide * seconds / total, 1);
    drawn.append(svg("text", {x: 4, y: row * high + 17}, CAUSE_TEXT[key] || key),
      svg("rect", {x, y: row * high + 4, width: w, height: high - 8, fill: `rgb(${CATEGORY[row % CATEGORY.length].join(",")})`}),
      svg("text", {x: left - 10, y: row * high + 17, "text-anchor": "end", "data-key": `${base}.${name}`, "data-digits": 2}, number(seconds, 2) + " s"));
    at += seconds;
  });
  drawn.append(svg("text", {x: 4, y: causes.length * high + 17, "font-weight": 700}, "all"),
    svg("rect", {x: left, y: causes.length * high + 4, width: wide, height: high - 8, fill: "#50575f"}),
    svg("text", {x: left - 10, y: causes.length * high + 17, "text-anchor": "end", "font-weight": 700}, number(total, 2) + " s"));
  return make("div", {class: "scroll"}, drawn);
}

const plainNumber = (v) => String(Number(v.toPrecision(4)));

class Lanes {
  constructor(canvas, picked) {
    this.canvas = canvas; this.from = 0; this.to = 1; this.kind = "position"; this.cursor = 0;
    canvas.addEventListener("click", (e) => { if (this.run) picked(this.from + (e.offsetX - this.left) / (canvas.clientWidth - this.left - 10) * (this.to - this.from)); });
    this.left = 96;
  }

  set(run) { this.run = run; this.from = 0; this.to = run.count ? run.end : 1; this.drawn = null; this.draw(); }

  zoom(factor) {
    const end = this.run.end, half = Math.min((this.to - this.from) * factor, end) / 2;
    const middle = Math.min(Math.max(this.cursor, half), end - half);
    this.from = middle - half; this.to = middle + half; this.drawn = null; this.draw();
  }

  // [name, unit, low, high, value of a point] of each lane.
  lanes() {
    const run = this.run, c = run.columns, rows = run.info.axes.map((axis) => {
      const values = c[axis.letter];
      if (this.kind === "velocity") {
        const v = (i) => {
          const span = run.time[i] - run.time[i - 1] - c.rest[i] / 1000;
          return i > 0 && span > 0.0015 ? (values[i] - values[i - 1]) / span : (i > 0 && values[i] === values[i - 1] ? 0 : NaN);
        };
        return [axis.letter, axis.unit + "/s", -axis.velocity, axis.velocity, v];
      }
      const [low, high] = axis.travel, used = axis.used || [0, 1];
      return [axis.letter, axis.unit, low === null ? used[0] : low, high === null ? used[1] : high, (i) => values[i]];
    });
    let most = 0;
    for (let i = 1; i < run.count; i++) for (const n of ["feed programmed", "feed reached"]) if (c.kind[i] !== 0 && c[n][i] > most) most = c[n][i];
    return [...rows, ["feed", "mm/min", 0, most || 1, (i) => (c.kind[i] ? c["feed reached"][i] : NaN), (i) => (c.kind[i] ? c["feed programmed"][i] : NaN)]];
  }

  draw() {
    const canvas = this.canvas, run = this.run, ratio = Math.min(window.devicePixelRatio || 1, 2);
    const w = canvas.clientWidth, h = canvas.clientHeight;
    if (!run || !run.count || !w) return;
    if (!this.drawn || this.drawn.width !== Math.round(w * ratio)) this.paint(w, h, ratio);
    const context = canvas.getContext("2d", SOFT);
    context.setTransform(1, 0, 0, 1, 0, 0);
    canvas.width = this.drawn.width; canvas.height = this.drawn.height;
    context.drawImage(this.drawn, 0, 0);
    context.scale(ratio, ratio);
    const x = this.left + (this.cursor - this.from) / (this.to - this.from) * (w - this.left - 10);
    if (x >= this.left) { context.strokeStyle = "#9c1c12"; context.lineWidth = 1.5; context.beginPath(); context.moveTo(x, 0); context.lineTo(x, h - 18); context.stroke(); }
  }

  paint(w, h, ratio) {
    const run = this.run, drawn = this.drawn = document.createElement("canvas");
    drawn.width = Math.round(w * ratio); drawn.height = Math.round(h * ratio);
    const g = drawn.getContext("2d", SOFT), lanes = this.lanes(), high = (h - 20) / lanes.length, wide = w - this.left - 10;
    g.scale(ratio, ratio); g.fillStyle = "#fff"; g.fillRect(0, 0, w, h); g.font = "12px sans-serif"; g.textBaseline = "middle";
    const first = pointAt(run, this.from), last = Math.min(pointAt(run, this.to) + 1, run.count - 1);
    lanes.forEach(([name, unit, low, top, ...curves], k) => {
      const y0 = k * high + 4, tall = high - 8, y = (v) => y0 + tall * (1 - (v - low) / (top - low || 1));
      g.strokeStyle = "#c4cad1"; g.lineWidth = 1; g.strokeRect(this.left, y0, wide, tall);
      g.fillStyle = "#1b1f24"; g.textAlign = "left"; g.fillText(`${name}, ${unit}`, 4, y0 + tall / 2);
      g.textAlign = "right"; g.fillStyle = "#50575f"; g.fillText(plainNumber(top), this.left - 4, y0 + 6);
      g.fillText(plainNumber(low), this.left - 4, y0 + tall - 5);
      g.save(); g.beginPath(); g.rect(this.left, y0 - 1, wide, tall + 2); g.clip();
      [...curves].reverse().forEach((value, n) => this.curve(g, value, first, last, wide, y, curves.length === 2 && n === 0 ? "#d55e00" : "#0072b2"));
      g.restore();
    });
    g.fillStyle = "#1b1f24"; g.textAlign = "center";
    const ticks = Math.min(5, Math.max(1, Math.floor(wide / 80)));
    for (let t = 0; t <= ticks; t++) g.fillText(clockText(this.from + (this.to - this.from) * t / ticks), Math.min(this.left + wide * t / ticks, w - 34), h - 8);
  }

  // Least and greatest value of each column of pixels.
  curve(g, value, first, last, wide, y, colour) {
    g.strokeStyle = colour; g.lineWidth = 1.3; g.beginPath();
    const scale = wide / (this.to - this.from || 1);
    let column = 0, low = 0, high = 0, pen = false;
    const flush = () => { const x = this.left + column; if (pen) g.lineTo(x, y(low)); else g.moveTo(x, y(low)); g.lineTo(x, y(high)); pen = true; };
    let empty = true;
    const add = (seconds, v) => {
      if (v !== v) { if (!empty) flush(); empty = true; pen = false; return; }
      const x = Math.round((seconds - this.from) * scale);
      if (x === column && !empty) { if (v < low) low = v; if (v > high) high = v; return; }
      if (!empty) flush();
      column = x; low = high = v; empty = false;
    };
    const {time, columns: {rest}} = this.run, stays = this.kind === "position";
    if (first === 0) add(0, value(0)); // it stands where it begins until it moves
    for (let i = first; i <= last; i++) {
      if (stays && i > 0 && rest[i] > 0) add(time[i - 1] + rest[i] / 1000, value(i - 1));
      add(time[i], value(i));
    }
    if (!empty) flush();
    g.stroke();
  }
}

// Sliders of limits: between two factors that were counted the time is interpolated.
function whatIf(k) {
  const found = report.runs[k].what_if, made = make("div", {}, make("h3", {}, "What if one limit were another?"));
  if (!found) return made;
  if (!found.counted) { made.append(make("p", {class: "note"}, `Not counted for programs of more than ${found.largest_program_blocks} blocks.`)); return made; }
  if (!found.limits.length) { made.append(make("p", {}, "No limit of an axis holds this program for long: other limits would not change its time.")); return made; }
  const rows = found.limits.map((one, n) => {
    const out = make("output", {}), slider = make("input", {type: "range", min: 0, max: found.factors.length - 1, step: "any", value: found.factors.indexOf(1),
      "aria-label": `factor of ${one.axis} ${one.limit}`});
    const update = () => {
      const at = Number(slider.value), low = Math.min(Math.floor(at), found.factors.length - 2), share = at - low;
      const mix = (v) => v[low] + share * (v[low + 1] - v[low]);
      out.textContent = `x ${mix(found.factors).toFixed(2)}: ${clockText(mix(one.seconds))} (${(mix(one.seconds) - one.seconds[found.factors.indexOf(1)]).toFixed(2)} s)`;
    };
    slider.addEventListener("input", update); update();
    return [`${one.axis} ${one.limit}`, figure(`runs.${k}.what_if.limits.${n}.held_s`, 2, "s"), slider, out];
  });
  made.append(table(["Limit", "Holds for", "Factor 0.5 to 2", "Time"], rows, [1]),
    make("p", {class: "note"}, `Times at factors ${found.factors.join(", ")} are counted by the time model; between them interpolated. One limit at a time.`));
  return made;
}
