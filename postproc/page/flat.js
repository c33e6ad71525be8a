// The picture on a plain canvas: at once, before WebGL is there, and for good where there is none.
const FLAT_MOST = 20000; // pieces of the path at most

// What leads a place of the part to pixels of the page: (x, y, z) to [right, down].
function pixelsOf(view) {
  const m = view.matrix(), w = view.canvas.clientWidth / 2, h = view.canvas.clientHeight / 2;
  return (x, y, z) => [(m[0] * x + m[4] * y + m[8] * z + m[12] + 1) * w, (1 - (m[1] * x + m[5] * y + m[9] * z + m[13])) * h];
}

// Every n-th point of the path and all other lines, those of one colour by one stroke.
function drawFlat(view, g, lines) {
  if (!view.centre) return;
  const at = pixelsOf(view), strokes = new Map(), {places: p, colours: c, centre, count} = view, stride = Math.max(1, Math.ceil(count / FLAT_MOST));
  const add = (style, a, b) => {
    let path = strokes.get(style);
    if (!path) strokes.set(style, path = new Path2D());
    path.moveTo(...a); path.lineTo(...b);
  };
  let last = count ? at(p[0], p[1], p[2]) : null;
  for (let i = stride; i < count; i += stride) {
    const here = at(p[3 * i], p[3 * i + 1], p[3 * i + 2]), k = 4 * i;
    if (c[k + 3]) add(`rgba(${c[k]},${c[k + 1]},${c[k + 2]},${(c[k + 3] / 255 * (i > view.done ? 0.22 : 1)).toFixed(2)})`, last, here);
    last = here;
  }
  const onTop = (q, j) => at(q[j] - centre[0], q[j + 1] - centre[1], q[j + 2] - centre[2]);
  g.lineWidth = 1;
  for (const [style, path] of strokes) { g.strokeStyle = style; g.stroke(path); }
  strokes.clear();
  for (const line of lines) add(`rgb(${line[6]},${line[7]},${line[8]})`, onTop(line, 0), onTop(line, 3));
  for (const [style, path] of strokes) { g.strokeStyle = style; g.stroke(path); }
}
