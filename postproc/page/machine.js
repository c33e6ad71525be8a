// The machine as lines: axes of a chain by their motions one after the other, legs between their joints, the tool.
const AXIS_COLOUR = [120, 125, 130]; // none of the colours of the path
const TOOL_COLOUR = [40, 40, 40];

const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross3 = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const moved = (frame, p) => frame.r.map((row, k) => dot3(row, p) + frame.o[k]);
const turned = (frame, v) => frame.r.map((row) => dot3(row, v));
const times = (a, b) => ({r: a.r.map((row) => [0, 1, 2].map((k) => row[0] * b.r[0][k] + row[1] * b.r[1][k] + row[2] * b.r[2][k])),
  o: moved(a, b.o)});
const back = (a) => { const r = [0, 1, 2].map((k) => a.r.map((row) => row[k])); return {r, o: r.map((row) => -dot3(row, a.o))}; };
const STILL = {r: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], o: [0, 0, 0]};

// The motion of an axis at a position, mm or degrees.
function motionOf(axis, value) {
  if (!axis.turns) return {r: STILL.r, o: axis.direction.map((d) => d * value)};
  const a = value * Math.PI / 180, c = Math.cos(a), s = Math.sin(a), u = axis.direction;
  const r = [0, 1, 2].map((i) => [0, 1, 2].map((j) => (i === j ? c : 0) + (1 - c) * u[i] * u[j]
    + s * (i === j ? 0 : ((j - i + 3) % 3 === 1 ? -1 : 1) * u[3 - i - j])));
  const p = axis.point;
  return {r, o: p.map((v, k) => v - dot3(r[k], p))};
}

// Frames behind each axis, the first that of the workpiece, seen from the part.
function framesOf(skeleton, position) {
  const placed = back({r: skeleton.table_from_part.rotation, o: skeleton.table_from_part.origin});
  const frames = [placed];
  for (const axis of skeleton.axes) frames.push(times(frames[frames.length - 1], motionOf(axis, position(axis.letter))));
  return frames;
}

// The frame of the bed seen from the part: behind the axes that carry the part.
function bedOf(skeleton, position) {
  const frames = framesOf(skeleton, position);
  return frames[skeleton.axes.filter((axis) => axis.carries_part).length];
}

function circle(lines, centre, u, v, radius, colour, count) {
  let last = null;
  for (let k = 0; k <= count; k++) {
    const a = 2 * Math.PI * k / count;
    const p = centre.map((c, i) => c + radius * (u[i] * Math.cos(a) + v[i] * Math.sin(a)));
    if (last) lines.push([...last, ...p, ...colour]);
    last = p;
  }
}

function across(axis) {
  const u = cross3(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]), size = Math.hypot(...u) || 1;
  return u.map((x) => x / size);
}

// Lines of the machine at one place in time, and the letters of its axes; `size` is that of what is seen, mm. A linear axis
// has its letter on the side to which the tool moves against the part where its position rises, next to `middle` of what is seen.
function chainLines(skeleton, position, size, lines, named, middle) {
  const frames = framesOf(skeleton, position);
  let joint = null;
  skeleton.axes.forEach((axis, k) => {
    const frame = frames[k], colour = AXIS_COLOUR;
    const at = axis.turns ? moved(frame, axis.point) : moved(frames[k + 1], [0, 0, 0]);
    const along = turned(frame, axis.direction);
    const far = axis.turns ? 0.45 * size : 0.62 * size + dot3(along, middle.map((v, i) => v - at[i]));
    named.push([axis.letter + (axis.turns ? "" : "+"), at.map((v, i) => v + far * along[i])]);
    if (axis.turns) {
      const radius = 0.3 * size, u = across(axis.direction), behind = frames[k + 1];
      lines.push([...at.map((v, i) => v - 0.4 * size * along[i]), ...at.map((v, i) => v + 0.4 * size * along[i]), ...colour]);
      circle(lines, at, turned(frame, u), turned(frame, cross3(axis.direction, u)), radius, colour, 48);
      lines.push([...at, ...at.map((v, i) => v + radius * turned(behind, u)[i]), ...colour]);
    } else {
      const ends = axis.travel.map((end, e) => (end === null ? (e ? 0.5 : -0.5) * size : end));
      const [from, to] = ends.map((end) => moved(frame, axis.direction.map((d) => d * end)));
      lines.push([...from, ...to, ...colour]);
      const mark = 0.02 * size, u = turned(frame, across(axis.direction)), v = cross3(along, u);
      circle(lines, at, u, v, mark, colour, 4);
    }
    if (joint) lines.push([...joint, ...at, 150, 150, 150]);
    joint = at;
  });
  return frames;
}

function toolLines(tip, axis, length, radius, lines) {
  const u = across(axis), v = cross3(axis, u), top = tip.map((t, i) => t + length * axis[i]);
  for (const share of [0, 0.04, 0.25, 1]) {
    const r = share === 0 ? radius * 0.4 : share === 1 ? radius * 1.8 : radius;
    circle(lines, tip.map((t, i) => t + share * length * axis[i]), u, v, r, TOOL_COLOUR, 20);
  }
  for (const [a, b] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    const side = u.map((x, i) => a * x + b * v[i]);
    lines.push([...tip.map((t, i) => t + radius * side[i]), ...top.map((t, i) => t + radius * 1.8 * side[i]), ...TOOL_COLOUR]);
  }
  lines.push([...tip, ...top, ...TOOL_COLOUR]);
}

// A tool whose form is known, with its axis as far as the gauge length: rings at the corners of its pieces, and lines along their sides.
const FORM_COLOURS = {cutter: [40, 40, 40], shank: [90, 90, 90], holder: [120, 60, 120]};
const SIDES = 8, RING = 24;

function formLines(tip, axis, form, length, lines) {
  const u = across(axis), v = cross3(axis, u);
  const at = ([r, z], a) => tip.map((t, i) => t + z * axis[i] + r * (u[i] * Math.cos(a) + v[i] * Math.sin(a)));
  lines.push([...tip, ...tip.map((t, i) => t + length * axis[i]), ...TOOL_COLOUR]); // to the spindle
  for (const {part, radius_height_mm: side} of form) {
    const colour = FORM_COLOURS[part];
    for (const k of new Set([0, Math.floor(side.length / 2), side.length - 1])) circle(lines, at([0, side[k][1]], 0), u, v, side[k][0], colour, RING);
    for (let j = 0; j < SIDES; j++) {
      const a = 2 * Math.PI * j / SIDES;
      for (let k = 1; k < side.length; k++) lines.push([...at(side[k - 1], a), ...at(side[k], a), ...colour]);
    }
  }
}

// Legs at the place in time that lies between two that are known.
function legLines(run, index, lines) {
  const known = run.legs.point, legs = run.info.points.legs.legs;
  let k = 0;
  while (k < known.length - 2 && known[k + 1] <= index) k++;
  const next = Math.min(k + 1, known.length - 1);
  const share = next === k ? 0 : Math.min(1, (index - known[k]) / (known[next] - known[k]));
  const value = (j) => run.legs["joint " + j][k] + share * (run.legs["joint " + j][next] - run.legs["joint " + j][k]);
  const parts = 12; // numbers of a leg: its drive joint and platform joint, two ends of what it moves on
  let last = null, first = null;
  for (let leg = 0; leg < legs; leg++) {
    const p = [0, 1, 2, 3, 4, 5].map((i) => value(parts * leg + i)), drive = [6, 7, 8, 9, 10, 11].map((i) => value(parts * leg + i));
    if (drive.some((v, i) => i < 3 && v !== drive[i + 3])) lines.push([...drive, ...AXIS_COLOUR]);
    lines.push([...p, 0, 114, 178]);
    if (last) lines.push([...last, ...p.slice(3), 213, 94, 0]); else first = p.slice(3);
    last = p.slice(3);
  }
  if (last && first) lines.push([...last, ...first, 213, 94, 0]);
}
