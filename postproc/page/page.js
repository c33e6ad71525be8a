// Puts the parts together: one run, one time, one point are shown everywhere.
const shown = {run: null, time: 0, point: 0, playing: 0, fade: false, texts: null, lanes: null, view: null};

// All that is said in words and numbers.
function words(k, info) {
  verdict(k, byId("verdict"));
  const sorted = info.conversion.diagnostics.map((d, n) => ({...d, blocks: info.message_lines[n]})).sort((a, b) => WEIGHT[a.severity] - WEIGHT[b.severity]);
  const found = sorted.filter((d) => d.severity !== "info");
  byId("first").replaceChildren(...(found.length ? [messageItems(found, jumpTo)] : [make("p", {class: "note"}, "No warnings.")]));
  byId("compare").replaceChildren(...[compareTable(pickRun)].filter(Boolean));
  byId("head").replaceChildren(...headParts(k));
  byId("causes").replaceChildren(...(info.conversion.time ? [waterfall(k)] : []));
  byId("what-if").replaceChildren(whatIf(k));
  byId("operations").replaceChildren(...[operationTable(k)].filter(Boolean));
  byId("sheet-body").replaceChildren(...sheetParts(k));
  byId("orientation-body").replaceChildren(...orientationParts(k));
  byId("errors-body").replaceChildren(...errorParts(k, openText));
  byId("tabs").replaceChildren(...tabParts(k));
  byId("tab-links").replaceChildren(...(info.tabs || []).flatMap((tab, n) => [make("a", {href: "#tab-" + n}, short(tab.title, 60)), " "]));
  byId("messages-body").replaceChildren(sorted.length ? messageItems(sorted, jumpTo) : "None.");
}

const WEIGHT = {error: 0, warning: 1, info: 2};

async function pickRun(k) {
  stop();
  const run = shown.run = await loaded(k);
  byId("run").value = String(k);
  words(k, run.info);
  pathParts(run);
}

function pathParts(run) {
  byId("time").hidden = document.querySelector(".stage").hidden = byId("point").hidden = !run.count;
  textChoices(run);
  if (!run.count) { openFirst(0); return; } // its messages still lead to the CL file
  const colour = byId("colour"), wanted = colour.value;
  colour.replaceChildren(...colouringsOf(run).map((name) => make("option", {value: name}, COLOURINGS[name].title)));
  if (colouringsOf(run).includes(wanted)) colour.value = wanted;
  byId("slider").max = run.end;
  shown.view.setPath(run.columns["part x"], run.columns["part y"], run.columns["part z"]);
  recolour(); fit();
  byId("vectors").parentElement.hidden = !run.info.errors;
  byId("machine").disabled = byId("bed").disabled = !run.info.skeleton && !run.legs;
  byId("bed").disabled = !run.info.skeleton;
  byId("view-note").textContent = "Drag to turn, with Shift to move, wheel to zoom, click a point. " + (run.info.skeleton || run.legs ? "Machine: axes as grey lines and circles, not its covers; x, y, z are those of the part." : "The machine is not drawn: its parts are not known as lines.");
  shown.lanes.set(run);
  setPoint(Math.max(run.columns.kind.findIndex((kind, i) => i > 0 && kind !== 0), 0));
  openFirst(run.columns["CL line"][shown.point]);
}

function recolour() {
  const {colours, legend} = coloured(shown.run, byId("colour").value, byId("rapids").checked);
  shown.view.setColours(colours); if (shown.run.solids.length) legend.push({colour: SOLID_COLOUR, text: "part, table, fixtures"});
  if (byId("vectors").checked && shown.run.info.errors) legend.push(...errorLegend(shown.run.info.errors));
  showLegend(legend); draw();
}

const cutCorners = (run) => {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], names = ["part x", "part y", "part z"];
  for (let i = 1; i < run.count; i++) if (run.columns.kind[i] !== 0) names.forEach((n, k) => { const v = run.columns[n][i]; if (v < low[k]) low[k] = v; if (v > high[k]) high[k] = v; });
  return low[0] > high[0] ? shown.view.bounds : [low, high];
};

function fit() {
  const [low, high] = cutCorners(shown.run), size = Math.hypot(...low.map((v, k) => high[k] - v)) || 10;
  const room = byId("machine").checked && (shown.run.info.skeleton || shown.run.legs) ? 0.14 * size : 0.05 * size;
  shown.view.fit(low.map((v) => v - room), high.map((v) => v + room));
  if (byId("bed").checked && shown.run.info.skeleton) shown.view.middle = moved(back(bedAt()), shown.view.middle);
  draw();
}

// All lines that are drawn, the machine among them.
function fitWhole() {
  if (!shown.lines || !shown.lines.length) return;
  const low = [...shown.view.bounds[0]], high = [...shown.view.bounds[1]];
  for (const line of shown.lines) for (let k = 0; k < 6; k++) { low[k % 3] = Math.min(low[k % 3], line[k]); high[k % 3] = Math.max(high[k % 3], line[k]); }
  shown.view.fit(low, high);
  if (shown.view.model) shown.view.middle = moved(shown.view.model, shown.view.middle);
  draw();
}

const bedAt = () => { const now = between(shown.run, shown.time); return bedOf(shown.run.info.skeleton, now.at); };

const OPENED_AT_ONCE = 200000; // characters of a packed text up to which it is shown without being asked for
const SOLID_COLOUR = [170, 140, 95];
let asked = false;
function draw() { if (!asked) { asked = true; requestAnimationFrame(drawNow); } }

function drawNow() {
  asked = false;
  const run = shown.run, view = shown.view, lines = [], named = [];
  if (!run || !run.count) return;
  const now = between(run, shown.time), size = view.span / 1.05, withMachine = byId("machine").checked;
  const tip = ["part x", "part y", "part z"].map(now.at);
  let axis = run.columns["axis i"] ? ["axis i", "axis j", "axis k"].map(now.at) : null;
  view.model = null;
  if (run.info.skeleton) {
    if (byId("bed").checked) view.model = back(bedOf(run.info.skeleton, now.at));
    const part = 0.55 * size, middle = view.model ? moved(back(view.model), view.middle) : view.middle;
    const frames = withMachine ? chainLines(run.info.skeleton, now.at, part, lines, named, middle) : framesOf(run.info.skeleton, now.at);
    axis = turned(frames[frames.length - 1], run.info.skeleton.tool_axis);
  }
  if (withMachine && run.legs) legLines(run, now.i + now.share, lines);
  for (const solid of run.solids) for (let k = 0; k < solid["edge 0"].length; k++) lines.push([0, 1, 2, 3, 4, 5].map((j) => solid["edge " + j][k]).concat(SOLID_COLOUR));
  if (byId("vectors").checked && run.info.errors) errorLines(run.info.errors, 0.12 * size, lines);
  const form = toolAt(run, now.next).form || [];
  if (axis && form.length) formLines(tip, axis, form, toolAt(run, now.next).gauge_length_mm || 0, lines);
  else if (axis) toolLines(tip, axis, toolLength(run, now.next), 0.012 * size, lines);
  const p = ["part x", "part y", "part z"].map((n) => run.columns[n][shown.point]), r = 0.015 * size;
  for (let k = 0; k < 3; k++) lines.push([...p.map((v, i) => v - (i === k ? r : 0)), ...p.map((v, i) => v + (i === k ? r : 0)), 156, 28, 18]);
  shown.lines = lines;
  view.done = shown.fade ? now.i + 1 : 1e9; // what is still to come is pale while time runs
  view.draw(lines);
  const sheet = cleared(view, byId("labels"));
  if (!view.gl) drawFlat(view, sheet, lines);
  drawLabels(view, sheet, named);
}

// The tool that runs at a point.
const toolAt = (run, i) => run.info.tools.find((t) => t.number === run.columns.tool[i]) || {};

// Its gauge length, mm; where none is stated something that can be seen.
const toolLength = (run, i) => toolAt(run, i).gauge_length_mm || 0.3 * shown.view.span;

function setTime(seconds, follow) {
  shown.time = Math.min(Math.max(seconds, 0), shown.run.end);
  byId("slider").value = shown.time; byId("clock").textContent = clockText(shown.time);
  byId("slider").setAttribute("aria-valuetext", clockText(shown.time));
  shown.lanes.cursor = shown.time; shown.lanes.draw();
  if (follow !== false) { shown.point = between(shown.run, shown.time).next; if (!shown.playing) showPoint(shown.run, shown.point, openText); }
  draw();
}

function setPoint(i) {
  shown.point = Math.min(Math.max(i, 0), shown.run.count - 1); shown.fade = false;
  setTime(shown.run.time[shown.point], false);
  showPoint(shown.run, shown.point, openText);
}

function stop() { cancelAnimationFrame(shown.playing); shown.playing = 0; byId("play").textContent = "Play"; if (shown.view) shown.view.coarse = false; }

function play() {
  if (shown.playing) { stop(); setTime(shown.time); return; }
  const end = shown.run.end;
  if (shown.time >= end) setTime(0);
  let last = performance.now();
  shown.fade = true;
  byId("play").textContent = "Pause";
  const step = (at) => {
    const next = shown.time + (at - last) / 1000 * Number(byId("speed").value);
    last = at;
    if (next >= end) { stop(); setTime(end); return; }
    setTime(next); shown.playing = requestAnimationFrame(step);
  };
  shown.playing = requestAnimationFrame(step);
}

function textChoices(run) {
  const kinds = [...document.querySelectorAll("script[id^=text-]")].map((e) => [e.id.slice(5), e.dataset.name]).filter(([kind]) => kind === "cl" || kind.startsWith(`nc${run.k}-`));
  byId("texts").hidden = !kinds.length;
  if (shown.texts.kind && !kinds.some(([kind]) => kind === shown.texts.kind)) shown.texts.close(); // that of another program
  byId("text-file").replaceChildren(...kinds.map(([kind, name]) => make("option", {value: kind}, (kind === "cl" ? "CL file " : "program ") + name)));
}

// The CL file at a line without being asked for, where that costs nothing.
function openFirst(line) {
  const packed = byId("text-cl");
  if (packed && packed.textContent.length < OPENED_AT_ONCE && !shown.texts.kind) openText("cl", line, 0);
  else if (shown.texts.kind) byId("text-file").value = shown.texts.kind;
}

async function openText(kind, line, file) {
  const name = kind === "cl" || kind.startsWith("nc" + shown.run.k) ? kind : `nc${shown.run.k}-${file || 0}`;
  if (!await shown.texts.open(name)) { byId("found").textContent = "This page was written without its texts."; return; }
  byId("text-file").value = name;
  if (line > 0) shown.texts.show(Math.min(line, shown.texts.lines.length));
}

// From a message to a line of the CL file, or to the block that moves for it.
function jumpTo(line, block) {
  if (block) openText(`nc${shown.run.k}-${block.nc_file}`, block.nc_line, block.nc_file); else openText("cl", line, 0);
  pointOfLine("cl", line);
  byId("texts").scrollIntoView({block: "nearest"});
}

// The first point of a line, of the nearest line behind it where it moves nothing.
function pointOfLine(kind, line) {
  if (!shown.run.count) return;
  const c = shown.run.columns, column = kind === "cl" ? c["CL line"] : c["NC line"], file = kind === "cl" ? -1 : Number(kind.split("-")[1] || 0);
  let best = -1, far = Infinity;
  for (let i = 1; i < shown.run.count; i++) {
    const off = column[i] - line;
    if (off >= 0 && off < far && (file < 0 || c["NC file"][i] === file)) { far = off; best = i; if (!off) break; }
  }
  byId("found").textContent = best < 0 ? `No motion at line ${line} or behind it.` : far ? `Line ${line} moves nothing; the next that does is ${line + far}.` : "";
  if (best >= 0) { stop(); setPoint(best); }
}

function search(direction) {
  const line = shown.texts.find(byId("search").value, direction);
  byId("found").textContent = line ? `Line ${line}.` : "Not found.";
  if (line) shown.texts.show(line);
}

function turnBy(dx, dy) {
  shown.view.turn[0] -= dx; shown.view.turn[1] = Math.min(Math.max(shown.view.turn[1] - dy, 0), Math.PI);
  draw();
}

function pan(dx, dy) {
  const view = shown.view, d = view.directions(), mm = view.span / Math.min(view.canvas.clientWidth, view.canvas.clientHeight);
  view.middle = view.middle.map((v, k) => v + mm * (-dx * d[0][k] + dy * d[1][k]));
  draw();
}

const zoom = (factor) => { shown.view.span *= factor; draw(); };

function handleCanvas(canvas) {
  let held = null, settle = 0;
  canvas.addEventListener("pointerdown", (e) => { held = {x: e.clientX, y: e.clientY, far: 0}; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointermove", (e) => {
    if (!held) return;
    const dx = e.clientX - held.x, dy = e.clientY - held.y;
    Object.assign(held, {x: e.clientX, y: e.clientY, far: held.far + Math.abs(dx) + Math.abs(dy)});
    shown.view.coarse = true;
    if (e.shiftKey || e.buttons === 4 || e.buttons === 2) pan(dx, dy); else turnBy(dx * 0.008, dy * 0.008);
  });
  canvas.addEventListener("pointerup", (e) => {
    shown.view.coarse = false;
    if (held && held.far < 4) {
      const at = shown.view.nearest(e.offsetX, e.offsetY, 14, byId("rapids").checked ? null : shown.run.columns.kind);
      if (at >= 0) { stop(); setPoint(at); }
    }
    held = null; draw();
  });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault(); shown.view.coarse = true; zoom(Math.exp(e.deltaY * 0.001));
    clearTimeout(settle); settle = setTimeout(() => { shown.view.coarse = false; draw(); }, 200);
  }, {passive: false});
  canvas.addEventListener("keydown", (e) => {
    const turns = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]}[e.key];
    if (turns) turnBy(...turns);
    else if (e.key === "+") zoom(0.85); else if (e.key === "-") zoom(1.18);
    else if (e.key === ".") setPoint(shown.point + 1); else if (e.key === ",") setPoint(shown.point - 1); else return;
    e.preventDefault();
  });
}

function listen() {
  const on = (id, kind, what) => byId(id).addEventListener(kind, what);
  on("colour", "change", recolour); on("rapids", "change", recolour); on("vectors", "change", recolour); on("machine", "change", () => { recolour(); fit(); }); on("bed", "change", fit);
  on("fit", "click", fit); on("whole", "click", fitWhole); on("play", "click", play); on("slider", "input", () => { shown.fade = true; setTime(Number(byId("slider").value)); });
  on("run", "change", () => pickRun(Number(byId("run").value)));
  on("text-file", "change", async () => { await openText(byId("text-file").value, 0, 0); });
  on("search", "keydown", async (e) => { if (e.key === "Enter") { await openText(byId("text-file").value, 0, 0); search(e.shiftKey ? -1 : 1); } });
  for (const [id, direction] of [["next", 1], ["previous", -1]]) on(id, "click", async () => { await openText(byId("text-file").value, 0, 0); search(direction); });
  on("line", "change", async () => { const kind = byId("text-file").value; await openText(kind, Number(byId("line").value), 0); pointOfLine(kind, Number(byId("line").value)); });
  on("lane-kind", "change", () => { shown.lanes.kind = byId("lane-kind").value; shown.lanes.drawn = null; shown.lanes.draw(); });
  on("lane-in", "click", () => shown.lanes.zoom(0.5)); on("lane-out", "click", () => shown.lanes.zoom(2));
  on("print", "click", () => { document.body.classList.add("sheet-only"); window.print(); document.body.classList.remove("sheet-only"); });
  const turns = {top: [0, 0], front: [0, Math.PI / 2], iso: [-0.7, 0.95]};
  document.querySelectorAll("[data-view]").forEach((b) => b.addEventListener("click", () => { shown.view.turn = [...turns[b.dataset.view]]; draw(); }));
  window.addEventListener("resize", () => { draw(); shown.lanes.drawn = null; shown.lanes.draw(); });
  window.addEventListener("beforeprint", () => {
    if (!shown.run.count) return;
    drawNow();
    byId("printed").replaceChildren(make("img", {src: pictureOf(shown.view, byId("labels")), alt: "Picture of the path on the machine"}), byId("legend").cloneNode(true));
    byId("printed").lastChild.removeAttribute("id");
  });
}

async function begin() {
  byId("title").textContent = short(visible(report.part), 300);
  byId("subtitle").textContent = `${report.cl_file}, ${report.runs.map(lineOf).join("; ")}`;
  byId("foot").textContent = `postproc ${report.postproc}, report version ${report.report_version}. This page loads nothing from anywhere.`;
  byId("run").replaceChildren(...report.runs.map((run, k) => make("option", {value: k}, lineOf(run))));
  byId("run-choice").hidden = report.runs.length < 2;
  words(0, report.runs[0]);
  await new Promise((after) => requestAnimationFrame(() => setTimeout(after)));  // words first: a picture may take a moment
  shown.view = new View(byId("view"));
  shown.lanes = new Lanes(byId("lanes"), (t) => { stop(); setTime(t); });
  shown.texts = new Texts(byId("text"), (kind, line) => pointOfLine(kind, line));
  listen(); handleCanvas(byId("view"));
  await pickRun(0);
  requestAnimationFrame(() => setTimeout(() => { document.documentElement.dataset.ready = String(Math.round(performance.mark("ready").startTime)); whenSeen(byId("view"), attach); }));
}

// WebGL draws from when the picture is first in sight: in a browser that was just begun, its graphics process starts for that.
function attach() {
  const canvas = byId("view"), picture = document.documentElement.dataset;
  canvas.addEventListener("webglcontextlost", () => { shown.view.gl = null; picture.picture = "flat"; draw(); });
  picture.picture = shown.view.attach() ? "webgl" : "flat";
  performance.mark(picture.picture);
  if (!shown.view.gl) byId("view-note").append(` This browser has no WebGL2: of long paths ${FLAT_MOST} points are drawn.`);
  drawNow();
}

function whenSeen(element, what) {
  const seen = new IntersectionObserver((found) => {
    if (!found.some((one) => one.isIntersecting)) return;
    seen.disconnect(); setTimeout(what);
  });
  seen.observe(element);
}

begin().catch((fault) => { document.documentElement.dataset.ready = "failed"; byId("verdict").className = "bad"; byId("verdict").textContent = "This page cannot be shown: " + fault.message; throw fault; });
