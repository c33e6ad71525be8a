// The path in colours, the place in time, the point that was chosen.
const CATEGORY = [[0, 114, 178], [213, 94, 0], [0, 128, 96], [140, 60, 130], [120, 94, 0], [30, 140, 190], [90, 70, 160], [110, 110, 110]];
const VIRIDIS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [190, 200, 40]];
const NO_FIGURE = [150, 150, 150];
const ORDERS = ["velocity", "acceleration", "jerk"];

function scaleColour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1), k = Math.min(Math.floor(at), VIRIDIS.length - 2);
  return VIRIDIS[k].map((v, i) => v + (at - k) * (VIRIDIS[k + 1][i] - v));
}

function limitName(info, value) {
  if (value < 0) return "programmed feed";
  return info.axes[Math.floor(value / 3)].letter + " " + ORDERS[value % 3];
}

// The tool axis at a point, seen from the part.
function toolAxis(run, i) {
  if (run.columns["axis i"]) return [run.columns["axis i"][i], run.columns["axis j"][i], run.columns["axis k"][i]];
  const frames = framesOf(run.info.skeleton, (letter) => run.columns[letter][i]);
  return turned(frames[frames.length - 1], run.info.skeleton.tool_axis);
}

function tilts(run) {
  if (!run.tilt) {
    run.tilt = new Float32Array(run.count);
    for (let i = 0; i < run.count; i++) run.tilt[i] = Math.acos(Math.min(1, Math.max(-1, toolAxis(run, i)[2]))) * 180 / Math.PI;
  }
  return run.tilt;
}

const COLOURINGS = {
  operation: {title: "operation", named: (run, v) => { const op = run.info.conversion.time.operations[v]; return op && op.operation ? short(op.operation, 60) : "operation " + (v + 1); }},
  feed: {title: "feed reached", column: "feed reached", unit: "mm/min", cutsOnly: true},
  limit: {title: "limiting axis", named: (run, v) => limitName(run.info, v)},
  cause: {title: "cause of the time", named: (run, v) => run.info.causes[v].replace("_", " ")},
  deviation: {title: "deviation from the CL file", column: "deviation", unit: "um"},
  correction: {title: "geometric error corrected", column: "correction", unit: "um"},
  tilt: {title: "tilt of the tool against z of the part", values: tilts, unit: "deg"},
};

function colouringsOf(run) {
  return Object.keys(COLOURINGS).filter((name) => name !== "correction" || run.columns.correction);
}

// Colours (RGBA bytes) of all points, and the rows of the legend.
function coloured(run, name, showRapids) {
  const rule = COLOURINGS[name], n = run.count, out = new Uint8Array(4 * n), kind = run.columns.kind;
  const values = rule.values ? rule.values(run) : run.columns[rule.column || name];
  const legend = [];
  let paint;
  if (rule.named) {
    const seen = new Map();
    for (let i = 1; i < n; i++) if (kind[i] !== 0) seen.set(values[i], (seen.get(values[i]) || 0) + 1);
    [...seen.keys()].sort((a, b) => a - b).forEach((v, k) => {
      seen.set(v, CATEGORY[k % CATEGORY.length]);
      legend.push({colour: CATEGORY[k % CATEGORY.length], text: rule.named(run, v)});
    });
    paint = (v) => seen.get(v) || NO_FIGURE;
  } else {
    let low = Infinity, high = -Infinity;
    for (let i = 1; i < n; i++) {
      const v = values[i];
      if (v === v && kind[i] !== 0) { if (v < low) low = v; if (v > high) high = v; }
    }
    if (low > high) { low = 0; high = 0; }
    const table = Array.from({length: 256}, (_, k) => scaleColour(k / 255)), span = high - low || 1;
    paint = (v) => (v === v ? table[Math.min(255, Math.max(0, Math.round(255 * (v - low) / span)))] : NO_FIGURE);
    legend.push({low, high, unit: rule.unit});
  }
  for (let i = 0; i < n; i++) {
    const rapid = kind[i] === 0, c = rapid ? NO_FIGURE : paint(values[i]);
    out[4 * i] = c[0]; out[4 * i + 1] = c[1]; out[4 * i + 2] = c[2]; out[4 * i + 3] = rapid ? (showRapids ? 110 : 0) : 255;
  }
  if (showRapids) legend.push({colour: NO_FIGURE, text: "rapids and linking moves"});
  return {colours: out, legend};
}

const MOST_NAMED = 16;

function showLegend(legend) {
  const named = legend.slice(0, MOST_NAMED), more = legend.length - named.length;
  if (more) named.push({text: `and ${more} more: their colours repeat`});
  byId("legend").replaceChildren(...named.map((one) => {
    if (!one.colour && one.text !== undefined) return make("span", {}, one.text);
    if (one.text !== undefined) return make("span", {}, swatch(`rgb(${one.colour.join(",")})`), one.text);
    const stops = VIRIDIS.map((c) => `rgb(${c.join(",")})`).join(",");
    const bar = make("i", {class: "scale"});
    bar.style.background = `linear-gradient(to right, ${stops})`;
    return make("span", {}, one.low.toPrecision(4) + " ", bar, " " + one.high.toPrecision(4) + " " + one.unit);
  }));
}

function swatch(colour) {
  const made = make("i", {});
  made.style.background = colour;
  return made;
}

// Shares of the limits of each axis within the block of a point, by the time model: [velocity, acceleration, jerk] by axis.
function usage(run, i) {
  const info = run.info, before = Math.max(i - 1, 0), limits = info.axes;
  const steps = limits.map((axis) => Math.abs(run.columns[axis.letter][i] - run.columns[axis.letter][before]));
  const active = [run.columns["of velocity"][i], run.columns.ramps[i], run.columns["builds up"][i]];
  return ORDERS.map((order, k) => {
    const ratio = steps.map((step, j) => (limits[j][order] ? step / limits[j][order] : 0)), most = Math.max(...ratio, 1e-30);
    return ratio.map((r) => active[k] * r / most);
  });
}

function meter(share, label) {
  const inner = make("span", share > 0.995 ? {class: "full"} : {});
  inner.style.width = Math.min(100, 100 * share).toFixed(1) + "%";
  return make("div", {class: "meter", role: "meter", "aria-valuemin": "0", "aria-valuemax": "100",
    "aria-valuenow": (100 * share).toFixed(0), "aria-label": label}, inner);
}

const feedText = (asked, reached) => (asked === asked ? number(asked, 0) + " mm/min programmed" : "none of the CL file") + (reached === reached ? ", " + number(reached, 0) + " mm/min reached in the mean" : "");

// What is known of a point, next to the picture.
function showPoint(run, i, jump) {
  const c = run.columns, info = run.info, used = usage(run, i);
  const go = (kind, line) => (line > 0 ? make("button", {type: "button", class: "jump", id: "jump-" + kind, onclick: () => jump(kind, line, c["NC file"][i])}, "line " + line) : "-");
  const cause = info.causes[c.cause[i]].replace("_", " ");
  const kind = ["rapid or linking move", "feed", "arc"][c.kind[i]];
  const why = c.limit[i] < 0 ? "runs at the programmed feed" : "held by " + limitName(info, c.limit[i]);
  const rows = [["Program", go("nc", c["NC line"][i])], ["CL file", go("cl", c["CL line"][i])],
    ["Operation", COLOURINGS.operation.named(run, c.operation[i])], ["Tool", "T" + c.tool[i]], ["Motion", kind], ["Time", clockText(run.time[i])],
    ["Part x, y, z", ["part x", "part y", "part z"].map((n) => number(c[n][i], 3)).join(", ") + " mm"],
    ["Feed", feedText(c["feed programmed"][i], c["feed reached"][i])],
    ["Time goes to", cause + "; " + why], ["Tilt", number(Math.acos(Math.max(-1, Math.min(1, toolAxis(run, i)[2]))) * 180 / Math.PI, 2) + " deg"],
    ["Deviation", c.deviation[i] === c.deviation[i] ? number(c.deviation[i], 2) + " um at the end of the block" : "not on a move of the CL file"]];
  const axes = info.axes.map((axis, j) => [axis.letter, number(c[axis.letter][i], 3) + " " + axis.unit,
    ...ORDERS.map((order, k) => meter(used[k][j], `${axis.letter} ${order}, percent of its limit`))]);
  byId("point").replaceChildren(make("h3", {}, "Point " + (i + 1) + " of " + run.count), table(["", ""], rows, []),
    table(["Axis", "Position", "Velocity", "Acceleration", "Jerk"], axes, [1]),
    make("p", {class: "note"}, "Bars: largest share of each limit within the block, by the time model; a full bar is the limit."));
}
