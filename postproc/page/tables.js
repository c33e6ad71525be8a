// Everything of the report that is words and numbers.
const nameOf = (d) => d.file.replace(/\\/g, "/").split("/").pop(), inCl = (d) => nameOf(d) === report.cl_file;
const lineOf = (run) => `${run.machine}, ${run.controller}`;

function verdict(k, box) {
  const run = report.runs[k], found = run.conversion.diagnostics, count = (s) => found.filter((d) => d.severity === s).length;
  box.className = !run.converted ? "bad" : !run.proved || count("warning") ? "warn" : "good";
  const word = !run.converted ? "NOT CONVERTED" : run.proved ? "PROVED" : "CHECKED, NOT PROVED";
  box.replaceChildren(make("b", {}, word), " ", (run.statement || "").replace(/^proved: /, "") || "No program was written: the errors below say why.");
  if (run.converted) {
    box.append(make("div", {}, "Allowed: ", figure(`runs.${k}.tolerance_mm`, 4, "mm"), ", ", figure(`runs.${k}.axis_tolerance_deg`, 4, "degrees"),
      "; bound: ", figure(`runs.${k}.conversion.worst_tip_deviation_mm`, 6, "mm"), ", ", figure(`runs.${k}.conversion.worst_axis_deviation_deg`, 6, "degrees")));
  }
}

// A message with its lines: those of the CL file lead there and to the block that moves for them, those of other files are said.
function messageItems(list, jump) {
  const to = (text, line, block) => make("button", {type: "button", class: "jump", onclick: () => jump(line, block)}, text);
  return make("ul", {class: "messages"}, ...list.map((d) => {
    const lines = [...new Set(d.lines || [])].slice(0, 8), blockOf = (line) => (d.blocks || []).find((one) => one.cl_line === line);
    const elsewhere = d.file && lines.length && !inCl(d) ? ` ${nameOf(d)}, line ${lines.join(", ")}` : null;
    return make("li", {}, make("span", {class: d.severity}, d.severity), ` [${d.code}] ${d.message}`,
      d.count > 1 ? ` (${d.count} times)` : "", d.hint ? make("div", {class: "note"}, "What to do: " + d.hint) : null, elsewhere,
      ...(inCl(d) ? lines.flatMap((line) => { const block = blockOf(line); return [to("line " + line, line, null), block ? to("program line " + block.nc_line, line, block) : null]; }) : []));
  }));
}

function timeCell(k) {
  const base = `runs.${k}.conversion`, run = report.runs[k].conversion;
  if (run.cycle_time_s === null) return "-";
  return run.cycle_time_s < 60 ? figure(base + ".cycle_time_s", 2, "s") : make("span", {}, clockText(run.cycle_time_s) + " (", figure(base + ".cycle_time_s", 2, "s"), ")");
}

function bandCell(k) {
  const base = `runs.${k}.conversion`, run = report.runs[k].conversion;
  if (run.cycle_time_s === null) return "-";
  return run.band_s ? make("span", {}, figure(base + ".band_s.0", 2, ""), " to ", figure(base + ".band_s.1", 2, "s")) : "not counted for long programs";
}

function compareTable(pick) {
  if (report.runs.length < 2) return null;
  const rows = report.runs.map((run, k) => [make("button", {type: "button", class: "name", onclick: () => pick(k)}, lineOf(run)),
    !run.converted ? "not converted" : run.proved ? "proved" : "checked", figure(`runs.${k}.conversion.worst_tip_deviation_mm`, 5, "mm"), timeCell(k), bandCell(k),
    run.conversion.cycle_time_s === null ? "-" : figure(`runs.${k}.conversion.lower_bound_s`, 2, "s"), figure(`runs.${k}.conversion.blocks_out`, 0, ""),
    make("span", {}, ...run.axes.flatMap((axis, j) => (axis.used_percent === null ? [] : [axis.letter + " ", figure(`runs.${k}.axes.${j}.used_percent`, 0, "%  ")]))),
    ["error", "warning"].map((severity) => run.conversion.diagnostics.filter((d) => d.severity === severity).length).join(", ")]);
  return make("div", {}, make("h3", {}, "Machines and controls side by side"),
    table(["Machine, control", "State", "Bound", "Time", "95 % of runs", "Lower bound", "Blocks", "Travel used", "Errors, warnings"], rows, [2, 3, 4, 5, 6, 8]));
}

function collisionText(found) {
  if (!found.checked) return "not checked: the set-up has no [bodies]";
  if (found.errors) return `${found.errors} found, see messages`;
  return "none with part, table and fixtures of the set-up" + (found.warnings ? "; not all was checked, see the warnings" : "");
}

const spindleText = (rpm) => rpm.map((v) => number(Math.abs(v), 0) + (v < 0 ? " CCLW" : " CLW")).join(", ") || "off";

function spindleRange(tools) {
  if (tools.length < 4) return tools.map((t) => `T${t.number}: ${spindleText(t.spindle_rpm)}`).join("; ") || "-";
  const every = tools.flatMap((t) => t.spindle_rpm.map(Math.abs));
  return `${tools.length} tools, ` + (every.length ? `${number(Math.min(...every), 0)} to ${number(Math.max(...every), 0)} rpm` : "spindle off");
}

// The three limits of axes that hold the program longest.
function slowest(k) {
  const time = report.runs[k].conversion.time;
  if (!time) return "-";
  const held = Object.entries(time.limiting).flatMap(([axis, by]) => Object.entries(by).map(([key, seconds]) => ({axis, key, seconds}))).filter((one) => one.seconds > 0.005);
  const most = held.sort((a, b) => b.seconds - a.seconds).slice(0, 3);
  return most.length ? make("span", {}, ...most.flatMap((one, n) => [(n ? ", " : "") + `${one.axis} ${one.key.replace("_s", "")} `, figure(`runs.${k}.conversion.time.limiting.${one.axis}.${one.key}`, 2, "s")])) : "none";
}

function headParts(k) {
  const run = report.runs[k], base = `runs.${k}`, c = run.conversion, witness = c.witness;
  const axes = run.axes.map((axis, j) => [axis.letter, axis.used ? make("span", {}, figure(`${base}.axes.${j}.used.0`, 3, ""), " to ", figure(`${base}.axes.${j}.used.1`, 3, axis.unit)) : "-",
    axis.travel.every((v) => v === null) ? "no ends" : axis.travel.map((v) => (v === null ? "no end" : v)).join(" to "), axis.used_percent === null ? "-" : figure(`${base}.axes.${j}.used_percent`, 1, "%"),
    axis.margin === null ? "-" : figure(`${base}.axes.${j}.margin`, 3, axis.unit)]);
  const feeds = run.feeds || {};
  const facts = [["Time", timeCell(k)], ["95 % of runs", c.cycle_time_s === null ? "-" : bandCell(k)], ["Lower bound", figure(base + ".conversion.lower_bound_s", 2, "s")],
    ["Time model", c.time ? c.time.model : "-"], ["Blocks", figure(base + ".conversion.blocks_out", 0, "")], ["CL points", figure(base + ".conversion.points_in", 0, "")],
    ["Axes that hold longest", slowest(k)], ["Feeds of cuts", run.feeds ? make("span", {}, figure(base + ".feeds.least_mm_per_min", 0, ""), " to ", figure(base + ".feeds.greatest_mm_per_min", 0, "mm/min")) : "-"],
    ["Blocks slowed for an axis", run.feeds ? figure(base + ".feeds.reduced_blocks", 0, "") : "-"],
    ["Spindle", spindleRange(c.tools)],
    ["Collisions", collisionText(run.collisions)],
    ["Rewinds", figure(base + ".conversion.rewinds", 0, "")], ["Singular directions passed", figure(base + ".conversion.singular_events", 0, "")]];
  const proof = witness ? make("div", {}, make("h3", {}, "What the proof covers"), make("p", {}, "Compared a second time, by other code: " + (witness.compared.join(", ") || "nothing") + "."),
    make("p", {}, witness.not_compared.length ? "Not compared: " + witness.not_compared.join("; ") + "." : "Nothing was left out."),
    make("p", {class: "note"}, "The proof is about the program, the CL file and the machine as its files describe it; not about deflection, heat, wear or following error.")) : null;
  const files = make("div", {}, make("h3", {}, "What it rests on (SHA-256)"), table(["What", "File", "SHA-256"], run.files.map((f) => [f.role.replace("_", " "), f.file, f.sha256]), []));
  files.querySelectorAll("td:last-child").forEach((cell) => cell.classList.add("hash"));
  const band = c.time && c.band_s ? make("p", {class: "note"}, "95 % of runs on a machine as its files describe it take a time within that band, stops by hand not counted. What no document states of machine and control widens it"
    + (c.time.assumed.length ? ", here " + c.time.assumed.map((name) => name.replaceAll("_", " ")).join(", ") : "") + ".") : null;
  return [make("div", {}, make("h3", {}, "Figures"), table(["", ""], facts, []), band), make("div", {}, make("h3", {}, "Travel used"), table(["Axis", "Used", "Travel", "Share", "Margin"], axes, [1, 2, 3, 4]), proof), files].filter(Boolean);
}

function operationTable(k) {
  const time = report.runs[k].conversion.time;
  if (!time) return null;
  const base = `runs.${k}.conversion.time.operations`;
  return make("div", {}, make("h3", {}, "Operations"), table(["Operation", "Time", "Cutting", "Rapids", "Tool changes"], time.operations.map((op, n) => [short(op.operation || "without a name", 80),
    figure(`${base}.${n}.time_s`, 2, "s"), figure(`${base}.${n}.cutting_s`, 2, "s"), figure(`${base}.${n}.rapids_s`, 2, "s"), figure(`${base}.${n}.tool_change_s`, 2, "s")]), [1, 2, 3, 4]));
}

function sheetParts(k) {
  const run = report.runs[k], base = `runs.${k}`, position = (values) => (values ? make("span", {}, ...Object.entries(values).flatMap(([a, v]) => [make("span", {class: "whole"}, a + " " + number(v, 3)), " "])) : "-");
  const tools = run.tools.map((t, n) => ["T" + t.number, short(t.name || "-", 60), spindleText(t.spindle_rpm), t.gauge_length_mm === null ? "not stated" : figure(`${base}.tools.${n}.gauge_length_mm`, 4, "mm"),
    t.length_register === null ? "-" : "H" + t.length_register, make("span", {}, figure(`${base}.tools.${n}.time_s`, 1, "s"), " (" + number(t.time_s / 60, 1) + " min)"),
    figure(`${base}.tools.${n}.cutting_m`, 3, "m"), position(t.first_axes)]);
  const offset = run.work_offset, part = short(report.part, 120);
  if (!run.converted) return [make("p", {}, `${part} on ${lineOf(run)}: no program was written, so there is nothing to set up.`)];
  return [make("p", {}, `${part} on ${lineOf(run)}; program ${run.files.filter((f) => f.role === "program").map((f) => f.file).join(", ")}`),
    make("h3", {}, "Tools in the order of use"), table(["Tool", "Name", "Spindle, rpm", "Gauge length", "Register", "Time", "At feed", "First position (machine coordinates, mm and degrees)"], tools, [3, 5, 6]), make("figure", {id: "printed"}),
    offset ? make("div", {}, make("h3", {}, "Work offset"), make("p", {}, offset.register + ": ", position(offset.values))) : null,
    run.conversion.places.length ? table(["Place", "Work offset", "Offset"], run.conversion.places.map((p) => [p.place, p.work_offset, position(p.offset)]), []) : null,
    make("h3", {}, "What the header of the program says: offsets, lengths, pivots, what is relied on"), make("div", {class: "header-lines"}, run.header.join("\n") || "-"),
    operationTable(k)].filter(Boolean);
}

// Reasons in words that differ by their numbers alone stand once, with how many candidates they hold for and the first.
function grouped(rejected) {
  const kinds = new Map();
  for (const one of rejected) {
    const key = one.reason.replace(/-?\d[\d.]*/g, "#").replace(/\b(about|at least) /, "");
    if (!kinds.has(key)) kinds.set(key, []);
    kinds.get(key).push(one);
  }
  const angles = (one) => Object.entries(one.orientation_deg || {}).map(([a, v]) => `${a} ${number(v, 2)}`).join(" ");
  return [...kinds.values()].sort((a, b) => b.length - a.length).map((all) => make("div", {}, (all.length > 1 ? `${all.length} candidates, the first ` : "") + `${angles(all[0])}: ${all[0].reason}`));
}

const PLAN_TEXT = {keep: "keep: the axes of the CL file", per_pass: "per pass: each pass under its own fastest axis", whole_part: "whole part: one axis for all passes",
  auto: "auto: the least of all, turning between passes counted", paper_per_pass: "vertex-aligned: each pass with a corner of its polytope (above) turned into the cut, for comparison"};

// Cuts along which the axis turns, or may: how far, within which limits, and the times of the control's model.
function turningParts(k) {
  const chosen = report.runs[k].conversion.orientation, base = `runs.${k}.conversion.orientation.turning`, found = chosen && chosen.turning;
  if (!found || !found.cuts.length) return [];
  const range = (ends) => (ends ? `${number(ends[0], 2)} to ${number(ends[1], 2)}` : "-"), now = found.on_the_control, time = report.runs[k].conversion.time;
  const shown = found.cuts.map((c, n) => [c, n]).filter(([c]) => c.turned).slice(0, 40), kept = new Map();
  for (const c of found.cuts) if (!c.turned) kept.set(c.fixed || "no other axes are faster", (kept.get(c.fixed || "no other axes are faster") || 0) + 1);
  const rows = shown.map(([c, n]) => [`${c.first_line} to ${c.last_line}`, figure(`${base}.cuts.${n}.turned_deg`, 2, "deg"), c.cone_deg === null ? "-" : figure(`${base}.cuts.${n}.cone_deg`, 2, "deg"),
    range(c.lead_deg), range(c.tilt_deg), figure(`${base}.cuts.${n}.off_path_mm`, 5, "mm"), ...(c.control_s === null ? ["time_s", "reference_time_s"] : ["control_s", "reference_control_s"]).map((key) => figure(`${base}.cuts.${n}.${key}`, 3, "s"))]);
  return [make("h3", {}, "Axes that turn along the cuts"),
    make("p", {}, `The tool axis is turned along ${found.turned} of ${found.cuts.length} cuts; the centre of the ball stays on its path.` + (shown.length < found.turned ? ` The first ${shown.length} are shown.` : "")),
    rows.length ? table(["CL lines", "Turned by at most", "Allowed", "Lead, deg", "Tilt, deg", "Ball off its path", "Time", "With the CL file's axes"], rows, [1, 2, 3, 4, 5, 6, 7]) : null,
    found.turned && now && now.keep && now.turned ? make("p", {}, `Whole program by the model by which they were chosen (${now.model.replace(/^model /, "")}${time && now.model !== "model " + time.model ? `; the time in the summary is by another, ${time.model}` : ""}): `, figure(`${base}.on_the_control.turned.time_s`, 2, "s"), " turned, ",
      figure(`${base}.on_the_control.keep.time_s`, 2, "s"), " with the axes of the CL file, ", figure(`${base}.on_the_control.gain_percent`, 1, "%"), " less.") : null,
    kept.size ? make("ul", {}, ...[...kept].map(([why, n]) => make("li", {}, `${n} ${n === 1 ? "cut keeps its" : "cuts keep their"} axes: ${why}`))) : null].filter(Boolean);
}

function orientationParts(k) {
  const found = report.runs[k].orientation, base = `runs.${k}.orientation`;
  if (!found) return [make("p", {}, "The tool axes are those of the CL file (--orient keep): none were chosen.")];
  const angles = (values) => Object.entries(values || {}).map(([a, v]) => `${a} ${number(v, 2)}`).join("  "), free = found.passes.some((p) => !p.fixed), turning = turningParts(k);
  return [...turning, turning.length ? make("h3", {}, "Passes with one axis") : null, make("p", {}, free ? "A pass with one tool axis (3+2) may be given another. The table gives the chosen rotary positions, the time with them and with the axes of the CL file, and why other directions lost."
    : "No pass could be given another fixed axis (3+2); the last column says why."),
    table(["Pass", "Rotary position, deg", "Time", "With the CL file's axes", "Held by", "Rejected candidates"], found.passes.map((p, n) => [String(p.pass), p.fixed ? "as in the CL file" : angles(p.orientation_deg),
      figure(`${base}.passes.${n}.time_s`, 3, "s"), figure(`${base}.passes.${n}.reference_time_s`, 3, "s"), p.limiting_axis || "-",
      p.fixed ? "keeps its axes: " + p.fixed : p.rejected && p.rejected.length ? make("div", {}, ...grouped(p.rejected)) : "-"]), [2, 3]), ...(free ? polytopeParts(found) : []),
    free ? table(["Plan", "Time"], Object.keys(found.plans).filter((name) => found.plans[name]).map((name) => [PLAN_TEXT[name] || name.replaceAll("_", " "), figure(`${base}.plans.${name}.time_s`, 3, "s")]), [1])
      : null].filter(Boolean);
}

function errorParts(k, jump) {
  const found = report.runs[k].errors, base = `runs.${k}.errors`;
  if (!found) return [make("p", {}, "No geometric errors were corrected: no --error-model was given, or the control corrects them.")];
  return [make("p", {}, found.title + ": worst before ", figure(base + ".worst_before_um", 2, "um"), ", after ", figure(base + ".worst_after_um", 3, "um"), ", bound ",
    figure(base + ".bound_um", 3, "um"), ", uncertainty (k = 2) ", found.uncertainty_k2_um === null ? "not known" : figure(base + ".uncertainty_k2_um", 2, "um")),
  table(["CL line", "Part x, y, z, mm", "Error x, y, z before, um", "after, um", "Size before", "after", "Uncertainty of both (k = 2)"], found.worst.map((p, n) => [make("button", {type: "button", class: "jump", onclick: () => jump("cl", p.cl_line, 0)}, "line " + p.cl_line),
    p.part_mm.map((v) => number(v, 3)).join(", "), p.vector_um.map((v) => number(v, 2)).join(", "), p.vector_after_um.map((v) => number(v, 3)).join(", "), figure(`${base}.worst.${n}.before_um`, 2, "um"), figure(`${base}.worst.${n}.after_um`, 3, "um"),
    p.uncertainty_k2_um === null ? "not known" : figure(`${base}.worst.${n}.uncertainty_k2_um`, 2, "um")]), [4, 5, 6]),
  make("p", {class: "note"}, `These are the ten worst; "error vectors" under Path draws them at ${found.places.length} places, before and after` + (found.uncertainty_k2_um === null ? "." : ", with a cross at each end: twice the standard deviation to either side."))];
}

// Sections of installed packages: texts and tables, as plain values.
function tabParts(k) {
  return (report.runs[k].tabs || []).map((tab, n) => make("section", {id: "tab-" + n}, make("h2", {}, short(tab.title, 120)),
    ...tab.blocks.map((block, b) => (typeof block === "string" ? make("p", {}, block) : table(block.heads, block.rows.map((row, i) => row.map((cell, j) => (typeof cell === "number" ? figure(`runs.${k}.tabs.${n}.blocks.${b}.rows.${i}.${j}`, 4, "") : cell === null ? "-" : cell))),
      block.heads.map((_, j) => j).filter((j) => block.rows.every((row) => typeof row[j] !== "string"))))),
    make("p", {class: "note"}, `Of the package ${tab.package} ${tab.version} (${tab.name}; code ${tab.sha256.slice(0, 12)}), not of postproc.`)));
}
