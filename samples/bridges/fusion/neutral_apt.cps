/**
 * Neutral APT text from Fusion: tip and tool axis of every point in the work coordinate system, for postproc.
 * It does nothing to the path: no linearising of its own, no rewinds, no machine. Without a machine configuration
 * the last three numbers of onRapid5D and onLinear5D are the tool axis.
 */
description = "Neutral APT for postproc";
vendor = "postproc";
legal = "MIT licence";
certificationLevel = 2;
minimumRevision = 45917;
extension = "apt";
setCodePage("ascii");
capabilities = CAPABILITY_MILLING;
tolerance = spatial(0.002, MM);
minimumChordLength = spatial(0.01, MM);
minimumCircularRadius = spatial(0.01, MM);
maximumCircularRadius = spatial(1000, MM);
minimumCircularSweep = toRad(0.01);
maximumCircularSweep = toRad(180);
allowHelicalMoves = true;
allowedCircularPlanes = undefined;

var plain = createFormat({decimals: 6, forceDecimal: false});
var fine = createFormat({decimals: 9, forceDecimal: false});
var lastFeed, lastTool, lastSpindle, lastCoolant;
var COOLANTS = {};

function word(text) {
  return String(text).replace(/[^A-Za-z0-9 ._+-]/g, " ").trim();
}

function onOpen() {
  COOLANTS[COOLANT_OFF] = "OFF";
  COOLANTS[COOLANT_FLOOD] = "FLOOD";
  COOLANTS[COOLANT_MIST] = "MIST";
  COOLANTS[COOLANT_THROUGH_TOOL] = "THRU";
  writeln("PARTNO " + word(programName || "PART"));
  writeln("UNITS/" + (unit == MM ? "MM" : "INCHES"));
  writeln("MULTAX/ON");
}

function onComment(text) {
  writeln("PPRINT/" + word(text));
}

function onSection() {
  writeln("OPNAME/" + word(hasParameter("operation-comment") ? getParameter("operation-comment") : "OP " + (getCurrentSectionId() + 1)));
  if (lastTool !== tool.number) {
    if (lastTool !== undefined) {
      writeln("SPINDL/OFF");
      lastSpindle = undefined;
    }
    writeln("CUTTER/" + plain.format(tool.diameter) + "," + plain.format(tool.cornerRadius));
    writeln("LOADTL/" + tool.number);
    lastTool = tool.number;
  }
  onSpindleSpeed(spindleSpeed);
  var kind = COOLANTS[tool.coolant];
  if (kind === undefined) {
    error("This coolant has no word in APT: choose off, flood, mist or through the tool.");
    return;
  }
  if (kind !== lastCoolant) {
    writeln("COOLNT/" + kind);
    lastCoolant = kind;
  }
  var first = getFramePosition(currentSection.getInitialPosition());
  writeln("RAPID");
  goTo(first.x, first.y, first.z, axisOfSection());
}

function onSpindleSpeed(speed) {
  var text = speed > 0 ? "SPINDL/RPM," + plain.format(speed) + "," + (tool.clockwise ? "CLW" : "CCLW") : "SPINDL/OFF";
  if (text !== lastSpindle) {
    writeln(text);
    lastSpindle = text;
  }
}

// The tool axis of a section with a fixed one, in the work coordinate system.
function axisOfSection() {
  return currentSection.isMultiAxis() ? currentSection.getGlobalInitialToolAxis() : currentSection.workPlane.forward;
}

// From the frame of the section to the work coordinate system; sections that turn the axis are in it already.
function inPart(x, y, z) {
  if (currentSection.isMultiAxis()) {
    return new Vector(x, y, z);
  }
  return Vector.sum(currentSection.workPlane.multiply(new Vector(x, y, z)), currentSection.workOrigin);
}

function goTo(x, y, z, axis) {
  var p = inPart(x, y, z);
  writeln("GOTO/" + [p.x, p.y, p.z].map(function (v) {return plain.format(v);}).join(",") + ","
    + [axis.x, axis.y, axis.z].map(function (v) {return fine.format(v);}).join(","));
}

function feedOf(feed) {
  var text = "FEDRAT/" + (unit == MM ? "MMPM," : "IPM,") + plain.format(feed);
  if (text !== lastFeed) {
    writeln(text);
    lastFeed = text;
  }
}

function onRadiusCompensation() {
  if (radiusCompensation != RADIUS_COMPENSATION_OFF) {
    error("Compensation in the control is not written: choose 'In computer'.");
  }
}

function onRapid(x, y, z) {
  writeln("RAPID");
  goTo(x, y, z, axisOfSection());
}

function onLinear(x, y, z, feed) {
  feedOf(feed);
  goTo(x, y, z, axisOfSection());
}

function onRapid5D(x, y, z, i, j, k) {
  writeln("RAPID");
  goTo(x, y, z, new Vector(i, j, k));
}

function onLinear5D(x, y, z, i, j, k, feed, feedMode) {
  feedOf(feed);
  goTo(x, y, z, new Vector(i, j, k));
}

function onCircular(clockwise, cx, cy, cz, x, y, z, feed) {
  var normals = {};
  normals[PLANE_XY] = new Vector(0, 0, 1);
  normals[PLANE_ZX] = new Vector(0, 1, 0);
  normals[PLANE_YZ] = new Vector(1, 0, 0);
  var normal = normals[getCircularPlane()];
  if (normal === undefined || currentSection.isMultiAxis()) {
    linearize(tolerance);
    return;
  }
  feedOf(feed);
  var sense = clockwise ? -1 : 1;
  var n = currentSection.workPlane.multiply(new Vector(sense * normal.x, sense * normal.y, sense * normal.z));
  var c = inPart(cx, cy, cz);
  writeln("CIRCLE/" + [c.x, c.y, c.z].map(function (v) {return plain.format(v);}).join(",") + ","
    + [n.x, n.y, n.z].map(function (v) {return fine.format(v);}).join(",") + "," + plain.format(getCircularRadius()));
  goTo(x, y, z, axisOfSection());
}

function onCyclePoint(x, y, z) {
  expandCyclePoint(x, y, z);
}

function onDwell(seconds) {
  writeln("DELAY/" + plain.format(seconds));
}

function onCommand(command) {
  var words = {};
  words[COMMAND_STOP] = "STOP";
  words[COMMAND_OPTIONAL_STOP] = "OPSTOP";
  words[COMMAND_COOLANT_OFF] = "COOLNT/OFF";
  words[COMMAND_STOP_SPINDLE] = "SPINDL/OFF";
  if (words[command] !== undefined) {
    writeln(words[command]);
    if (command == COMMAND_COOLANT_OFF) {
      lastCoolant = "OFF";
    } else if (command == COMMAND_STOP_SPINDLE) {
      lastSpindle = "SPINDL/OFF";
    }
  }
}

function onPassThrough(text) {
  error("Text for one control (" + text + ") has no place in APT: give it as [hooks] of the set-up.");
}

function onClose() {
  writeln("SPINDL/OFF");
  writeln("COOLNT/OFF");
  writeln("FINI");
}
