// Letters on the picture: axes of the part in a corner, axes of the machine where they are drawn.
const PART_AXES = [["x", "#b33c00", 0], ["y", "#006b50", 1], ["z", "#0b5cad", 2]];
const ARROW = 34; // pixels

// Directions of x, y, z of the part on the screen: to the right and down, each of length 1 where it lies in the screen.
function partDirections(view) {
  const d = view.directions();
  return [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((unit) => {
    const v = view.model ? turned(view.model, unit) : unit;
    return [dot3(d[0], v), -dot3(d[1], v)];
  });
}

// An empty sheet over the picture, in pixels of the page.
function cleared(view, canvas) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2), g = canvas.getContext("2d", SOFT);
  canvas.width = Math.round(view.canvas.clientWidth * ratio); canvas.height = Math.round(view.canvas.clientHeight * ratio);
  g.scale(ratio, ratio);
  return g;
}

// `named`: [letters, place in the part] of what has a name.
function drawLabels(view, g, named) {
  const w = view.canvas.clientWidth, h = view.canvas.clientHeight, from = [ARROW + 18, h - ARROW - 18];
  g.font = "bold 13px sans-serif"; g.textAlign = "center"; g.textBaseline = "middle"; g.lineWidth = 2.5;
  const word = (text, x, y, colour) => { g.strokeStyle = "#fff"; g.strokeText(text, x, y); g.fillStyle = colour; g.fillText(text, x, y); };
  const way = partDirections(view);
  for (const [name, colour, k] of PART_AXES) {
    const [x, y] = way[k];
    g.strokeStyle = colour; g.beginPath(); g.moveTo(...from); g.lineTo(from[0] + ARROW * x, from[1] + ARROW * y); g.stroke();
    word(name, from[0] + (ARROW + 10) * x, from[1] + (ARROW + 10) * y, colour);
  }
  for (const [text, place] of named) {
    const [x, y] = view.project(place);
    if (x > 0 && x < w && y > 0 && y < h) word(text, x, y, "#333333");
  }
}

// The picture with its letters, for paper.
function pictureOf(view, labels) {
  const made = document.createElement("canvas");
  made.width = view.canvas.width; made.height = view.canvas.height;
  const g = made.getContext("2d", SOFT);
  g.fillStyle = "#fff"; g.fillRect(0, 0, made.width, made.height);
  g.drawImage(view.canvas, 0, 0);
  g.drawImage(labels, 0, 0, made.width, made.height);
  return made.toDataURL("image/png");
}
