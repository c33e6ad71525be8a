// Lines in WebGL2: the path as one strip with a colour for each piece, other lines on top; parallel projection, z up.
const LINE_VERTEX = `#version 300 es
in vec3 place; in vec4 colour; uniform mat4 matrix; uniform float done; uniform float stride; flat out vec4 shade;
void main() { gl_Position = matrix * vec4(place, 1.0); shade = colour;
  if (float(gl_VertexID) * stride > done) shade.a *= 0.22; }`;
const LINE_PIXEL = `#version 300 es
precision mediump float; flat in vec4 shade; out vec4 pixel; void main() { if (shade.a < 0.01) discard; pixel = shade; }`;
const COARSE_FROM = 50000; // points from which only every n-th is drawn while the picture moves
const SMOOTH_TO = 200000; // points up to which edges are smoothed: without a graphics card that costs most of the time

class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.turn = [-0.7, 0.95]; this.middle = [0, 0, 0]; this.span = 100; this.count = 0; this.done = 0; this.coarse = false;
    this.model = null; this.gl = null; this.places = new Float32Array(0); this.colours = new Uint8Array(0);
  }

  // From here on WebGL draws; false where the browser has none. The first call of a browser starts its graphics process.
  attach() {
    const gl = this.canvas.getContext("webgl2", {antialias: report.runs.every((run) => !run.points || run.points.count <= SMOOTH_TO), preserveDrawingBuffer: true});
    if (!gl || gl.isContextLost()) return false;
    const program = this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, LINE_VERTEX], [gl.FRAGMENT_SHADER, LINE_PIXEL]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "place"); gl.bindAttribLocation(program, 1, "colour");
    gl.linkProgram(program);
    this.uniform = Object.fromEntries(["matrix", "done", "stride"].map((n) => [n, gl.getUniformLocation(program, n)]));
    this.buffers = {place: gl.createBuffer(), colour: gl.createBuffer(), linePlace: gl.createBuffer(), lineColour: gl.createBuffer()};
    this.gl = gl;
    this.fill("place", this.places); this.fill("colour", this.colours);
    return true;
  }

  fill(buffer, data, use) {
    if (!this.gl) return;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffers[buffer]);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, data, use || this.gl.STATIC_DRAW);
  }

  setPath(x, y, z) {
    const n = this.count = x.length, low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    [x, y, z].forEach((values, k) => {
      for (let i = 0; i < n; i++) { const v = values[i]; if (v < low[k]) low[k] = v; if (v > high[k]) high[k] = v; }
    });
    this.bounds = [low, high];
    this.centre = low.map((v, k) => (n ? (v + high[k]) / 2 : 0));
    const data = new Float32Array(3 * n);
    for (let i = 0; i < n; i++) {
      data[3 * i] = x[i] - this.centre[0]; data[3 * i + 1] = y[i] - this.centre[1]; data[3 * i + 2] = z[i] - this.centre[2];
    }
    this.places = data;
    this.fill("place", data);
  }

  setColours(rgba) { this.colours = rgba; this.fill("colour", rgba); }

  // Show all between two corners.
  fit(low, high) {
    this.middle = low.map((v, k) => (v + high[k]) / 2);
    this.span = Math.max(1e-3, Math.hypot(...low.map((v, k) => high[k] - v))) * 1.05;
  }

  // Rows: to the right, up, towards the eye.
  directions() {
    const [a, b] = this.turn, ca = Math.cos(a), sa = Math.sin(a), cb = Math.cos(b), sb = Math.sin(b);
    return [[ca, sa, 0], [-sa * cb, ca * cb, sb], [sa * sb, -ca * sb, cb]];
  }

  // From centred part coordinates to the screen, by columns; `model` (rotation rows, origin) from the part to what stands still.
  matrix() {
    const d = this.directions(), w = this.canvas.width, h = this.canvas.height, zoom = 2 / this.span;
    const size = w < h ? [zoom, zoom * w / h, zoom / 40] : [zoom * h / w, zoom, zoom / 40];
    const m = this.model, out = new Float32Array(16);
    out[15] = 1;
    for (let row = 0; row < 3; row++) {
      const v = d[row].map((x) => x * (row === 2 ? -1 : 1) * size[row]);
      const turned = m ? [0, 1, 2].map((k) => v[0] * m.r[0][k] + v[1] * m.r[1][k] + v[2] * m.r[2][k]) : v;
      const shift = m ? v[0] * m.o[0] + v[1] * m.o[1] + v[2] * m.o[2] : 0;
      for (let k = 0; k < 3; k++) out[4 * k + row] = turned[k];
      out[12 + row] = shift + turned.reduce((s, x, k) => s + x * this.centre[k], 0) - v.reduce((s, x, k) => s + x * this.middle[k], 0);
    }
    return out;
  }

  // Pixels of the page at which a place of the part is drawn.
  project(p) {
    const m = this.matrix(), c = p.map((v, k) => v - this.centre[k]), f = (k) => m[k] * c[0] + m[4 + k] * c[1] + m[8 + k] * c[2] + m[12 + k];
    return [(f(0) + 1) * this.canvas.clientWidth / 2, (1 - f(1)) * this.canvas.clientHeight / 2];
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const w = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), h = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== w || this.canvas.height !== h) { this.canvas.width = w; this.canvas.height = h; }
  }

  strip(places, colours, mode, count, stride) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[places]);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12 * stride, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[colours]);
    gl.enableVertexAttribArray(1); gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 4 * stride, 0);
    gl.uniform1f(this.uniform.stride, stride);
    gl.drawArrays(mode, 0, Math.floor((count - 1) / stride) + 1);
  }

  // Lines: [x0, y0, z0, x1, y1, z1, r, g, b] in part coordinates, bytes.
  draw(lines) {
    const gl = this.gl;
    this.resize();
    if (!gl || !this.centre) return;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(1, 1, 1, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.uniform.matrix, false, this.matrix());
    const stride = this.coarse && this.count > COARSE_FROM ? Math.min(Math.ceil(this.count / COARSE_FROM), 30) : 1;
    gl.uniform1f(this.uniform.done, this.done);
    if (this.count > 1) this.strip("place", "colour", gl.LINE_STRIP, this.count, stride);
    if (!lines.length) return;
    const places = new Float32Array(6 * lines.length), colours = new Uint8Array(8 * lines.length);
    lines.forEach((line, i) => {
      for (let k = 0; k < 6; k++) places[6 * i + k] = line[k] - this.centre[k % 3];
      for (const end of [0, 4]) colours.set([line[6], line[7], line[8], 255], 8 * i + end);
    });
    this.fill("linePlace", places, gl.STREAM_DRAW); this.fill("lineColour", colours, gl.STREAM_DRAW);
    gl.uniform1f(this.uniform.done, 1e9);
    this.strip("linePlace", "lineColour", gl.LINES, 2 * lines.length, 1);
  }

  // The point nearest to a place of the canvas (pixels of the page), -1 where none is within `reach`.
  nearest(px, py, reach, hidden) {
    const m = this.matrix(), w = this.canvas.clientWidth, h = this.canvas.clientHeight, p = this.places;
    let best = reach * reach, found = -1;
    for (let i = 0; i < this.count; i++) {
      const x = p[3 * i], y = p[3 * i + 1], z = p[3 * i + 2];
      const dx = (m[0] * x + m[4] * y + m[8] * z + m[12] + 1) * w / 2 - px;
      const dy = (1 - (m[1] * x + m[5] * y + m[9] * z + m[13])) * h / 2 - py;
      const far = dx * dx + dy * dy;
      if (far < best && !(hidden && hidden[i] === 0)) { best = far; found = i; }
    }
    return found;
  }
}
