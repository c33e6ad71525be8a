// A stand-in of Fusion's post engine: the names that the post uses, one part of three sections, what is written to standard output.
"use strict";
const fs = require("fs"), vm = require("vm");
class Vector { constructor(x, y, z) { this.x = x; this.y = y; this.z = z; } static sum(a, b) { return new Vector(a.x + b.x, a.y + b.y, a.z + b.z); } }
class Matrix { // columns right, up, forward
  constructor(right, up, forward) { Object.assign(this, {right, up, forward}); }
  multiply(v) { const [r, u, f] = [this.right, this.up, this.forward]; return new Vector(r.x * v.x + u.x * v.y + f.x * v.z, r.y * v.x + u.y * v.y + f.y * v.z, r.z * v.x + u.z * v.y + f.z * v.z); }
}
const out = [], faults = [], level = new Matrix(new Vector(1, 0, 0), new Vector(0, 1, 0), new Vector(0, 0, 1));
const c = Math.cos(Math.PI / 6), s = 0.5, tilted = new Matrix(new Vector(1, 0, 0), new Vector(0, c, s), new Vector(0, -s, c));
let linearized = 0, plane = 0, radius = 0, current = 0;
const sections = [[level, new Vector(0, 0, 0), false], [tilted, new Vector(5, 6, 7), false], [level, new Vector(0, 0, 0), true]].map(([workPlane, workOrigin, many]) => ({
  workPlane, workOrigin, isMultiAxis: () => many, getInitialPosition: () => new Vector(0, 0, 40), getGlobalInitialToolAxis: () => new Vector(0, 0, 1)}));
const world = {
  console, Vector, MM: 1, IN: 0, unit: process.argv[3] === "inch" ? 0 : 1, EOL: "\n", programName: "PART 7", spindleSpeed: 4000, PLANE_XY: 0, PLANE_ZX: 1, PLANE_YZ: 2,
  COOLANT_OFF: 0, COOLANT_FLOOD: 1, COOLANT_MIST: 2, COOLANT_THROUGH_TOOL: 3, CAPABILITY_MILLING: 1, RADIUS_COMPENSATION_OFF: 0, radiusCompensation: 0,
  COMMAND_STOP: 1, COMMAND_OPTIONAL_STOP: 2, COMMAND_COOLANT_OFF: 3, COMMAND_STOP_SPINDLE: 4, tool: {number: 1, diameter: 10, cornerRadius: 0, clockwise: true, coolant: 1},
  spatial: (v) => v, toRad: (v) => v * Math.PI / 180, setCodePage: () => 0, writeln: (line) => out.push(line), error: (text) => faults.push(text),
  createFormat: ({decimals}) => ({format: (v) => { const text = Number(v).toFixed(decimals).replace(/\.?0+$/, ""); return text === "-0" ? "0" : text; }}),
  hasParameter: () => true, getParameter: () => "Face " + current, getCurrentSectionId: () => current, getFramePosition: (p) => p,
  getCircularPlane: () => plane, getCircularRadius: () => radius, linearize: () => { linearized++; }, expandCyclePoint: (x, y, z) => { world.onRapid(x, y, z + 5); world.onLinear(x, y, z, 200); world.onRapid(x, y, z + 5); }};
vm.createContext(world);
vm.runInContext(fs.readFileSync(process.argv[2], "utf8"), world);
const begin = (k) => { current = k; world.currentSection = sections[k]; world.onSection(); };
world.onOpen();
begin(0);
world.onRapid(0, 0, 3); world.onLinear(0, 0, -2, 300); world.onLinear(20, 0, -2, 900);
plane = 0; radius = 5; world.onCircular(false, 20, 5, -2, 25, 5, -2, 900); world.onLinear(25, 20, -2, 900);
world.onCircular(true, 20, 20, -2, 20, 15, -3, 900); world.onDwell(0.5); world.onRapid(20, 15, 40); world.onCyclePoint(10, 10, -2); world.onRapid(10, 10, 40);
begin(1);
world.onRapid(0, 0, 3); world.onLinear(0, 0, 0, 500); world.onLinear(15, 0, 0, 500); radius = 4; world.onCircular(false, 15, 4, 0, 19, 4, 0, 500); world.onRapid(19, 4, 40);
begin(2);
world.onRapid5D(0, 0, 40, 0, 0, 1); world.onLinear5D(0, 0, 5, 0, 0, 1, 600); world.onLinear5D(10, 0, 5, 0, Math.sin(0.1), Math.cos(0.1), 600); world.onRapid5D(10, 0, 45, 0, Math.sin(0.1), Math.cos(0.1));
if (process.argv[3] === "faults") { world.radiusCompensation = 1; world.onRadiusCompensation(); world.onPassThrough("M98"); world.tool.coolant = 9; world.onSection(); plane = -1; world.currentSection = sections[0]; world.onCircular(true, 0, 0, 0, 1, 1, 0, 1); faults.push("linearized " + linearized); }
world.onCommand(world.COMMAND_STOP); world.onClose();
process.stdout.write(faults.length ? "FAULTS\n" + faults.join("\n") + "\n" : out.join("\n") + "\n");
