"""FreeCAD post (CAM workbench): the commands of a job as APT text for postproc.

Copy it into FreeCAD's folder of macros and choose `postproc_apt` as post of the job; `postproc.FCMacro` does that and calls
postproc. Commands are those of FreeCAD's own form: mm, X Y Z absolute, I J from the last point, F in mm/s. What is not known
is refused: nothing is left out in silence.
"""

import math
from pathlib import Path

TOOLTIP = "APT text (CL data) for postproc"
SILENT = {"G17", "G21", "G40", "G43", "G49", "G54", "G80", "G90", "G91.1", "G94"}
RAPID, FEED, HOLES = {"G0", "G00"}, {"G1", "G01"}, {"G73", "G81", "G82", "G83"}
ARCS = {"G2": -1, "G02": -1, "G3": 1, "G03": 1}
PLAIN = {"M0": "STOP", "M00": "STOP", "M1": "OPSTOP", "M01": "OPSTOP", "M5": "SPINDL/OFF", "M05": "SPINDL/OFF",
         "M7": "COOLNT/MIST", "M07": "COOLNT/MIST", "M8": "COOLNT/FLOOD", "M08": "COOLNT/FLOOD", "M9": "COOLNT/OFF",
         "M09": "COOLNT/OFF"}
TAKEN = {**dict.fromkeys(RAPID | FEED, "XYZF"), **dict.fromkeys(ARCS, "XYZIJKF"), **dict.fromkeys(HOLES, "XYZRPQFL")}


class Refused(ValueError):
    """A command that cannot be said in APT, by operation and number."""


class Apt:
    """APT text of commands, one after the other; positions in mm, None before any is stated."""

    def __init__(self, name):
        self.lines, self.at, self.where = [f"PARTNO {words(name)}", "UNITS/MM"], [None, None, None], ""
        self.feed, self.back, self.loaded = None, "G98", None

    def operation(self, label, commands, placement=None):
        """One operation; `placement` must be the identity, since its commands would stand elsewhere."""
        self.where = label
        self.lines.append(f"OPNAME/{words(label)}")
        if placement is not None and not placement.isIdentity():
            raise Refused(f"{label}: its placement is not the identity; set it to zero, and move the stock instead")
        for number, command in enumerate(commands, 1):
            self.where = f"{label}, command {number} ({command.Name})"
            self.command(command.Name.upper(), {key.upper(): float(value) for key, value in command.Parameters.items()})

    def command(self, name, given):
        if name.startswith("("):
            self.lines.append(f"PPRINT/{words(name)}")
            return
        if name in SILENT or not name:
            return
        if any(given.get(letter) for letter in "ABC"):
            raise Refused(f"{self.where}: A, B and C are positions of a machine, which postproc chooses itself")
        idle = set(given) - set(TAKEN.get(name, "SPTXYZABC")) - set("ABC")
        if idle:
            raise Refused(f"{self.where}: nothing takes {', '.join(sorted(idle))}")
        if name in RAPID | FEED or name in ARCS:
            self.move(name, given)
        elif name in HOLES:
            self.hole(name, given)
        elif name in ("M3", "M03", "M4", "M04"):
            self.lines.append(f"SPINDL/RPM,{number_text(given['S'])},{'CLW' if name[-1] == '3' else 'CCLW'}")
        elif name in ("G4", "G04"):
            self.lines.append(f"DELAY/{number_text(given['P'])}")
        elif name in ("G98", "G99"):
            self.back = name
        elif name in ("M6", "M06"):
            self.load(int(given["T"]))
        elif name in PLAIN:
            self.lines.append(PLAIN[name])
        else:
            raise Refused(f"{self.where}: this command is not known")

    def load(self, number):
        if number != self.loaded:
            self.lines.append(f"LOADTL/{number}")
            self.loaded = number

    def to(self, given):
        """Where a command goes: coordinates that it does not state stay."""
        at = [given.get(letter, before) for letter, before in zip("XYZ", self.at, strict=True)]
        return at if None not in at else None

    def move(self, name, given):
        before, at = self.at, self.to(given)
        if at is None:  # a first move may state its height alone: nothing is known of where it goes
            self.at = [given.get(letter, old) for letter, old in zip("XYZ", before, strict=True)]
            if name not in RAPID:
                raise Refused(f"{self.where}: it cuts before X, Y and Z are stated")
            return
        if name in RAPID:
            self.lines.append("RAPID")
        elif given.get("F", self.feed) is None:
            raise Refused(f"{self.where}: it cuts without a feed")
        else:
            self.fed(given)
        if name in ARCS:
            self.arc(ARCS[name], before, given)
        self.at = at
        self.goto(at)

    def fed(self, given):
        feed = given.get("F", self.feed)
        if feed != self.feed:
            self.lines.append(f"FEDRAT/MMPM,{number_text(60.0 * feed)}")
            self.feed = feed

    def arc(self, sense, before, given):
        if None in before:
            raise Refused(f"{self.where}: it begins nowhere")
        if given.get("K"):
            raise Refused(f"{self.where}: arcs lie in XY")
        i, j = given.get("I", 0.0), given.get("J", 0.0)
        centre = (before[0] + i, before[1] + j, before[2])
        self.lines.append("CIRCLE/" + ",".join(map(number_text, (*centre, 0.0, 0.0, sense, math.hypot(i, j)))))

    def hole(self, name, given):
        """A hole as the moves that it is: down from R, pecks with Q, a dwell, back to R or to where it came from."""
        x, y, initial = given.get("X", self.at[0]), given.get("Y", self.at[1]), self.at[2]
        if None in (x, y, initial) or not {"R", "Z"} <= given.keys() or given.get("F", self.feed) is None:
            raise Refused(f"{self.where}: a hole needs X, Y, Z, R, F and a height that it is reached at")
        top, bottom, step = given["R"], given["Z"], given.get("Q", 0.0)
        if name in ("G73", "G83") and step <= 0.0:
            raise Refused(f"{self.where}: pecks need Q above 0")
        self.rapid([x, y, max(initial, top)])
        self.rapid([x, y, top])
        self.fed(given)
        depth = top
        while depth > bottom:
            depth = max(bottom, depth - step) if name in ("G73", "G83") else bottom
            self.goto([x, y, depth])
            if name == "G83" and depth > bottom:
                self.rapid([x, y, top])
                self.rapid([x, y, depth + min(1.0, 0.5 * step)])
        if given.get("P"):
            self.lines.append(f"DELAY/{number_text(given['P'])}")
        self.rapid([x, y, max(initial, top) if self.back == "G98" else top])

    def rapid(self, at):
        if at != self.at:
            self.lines.append("RAPID")
            self.goto(at)

    def goto(self, at):
        self.at = list(at)
        self.lines.append("GOTO/" + ",".join(map(number_text, at)))

    def text(self):
        return "\n".join([*self.lines, "FINI", ""])


def number_text(value):
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def words(text):
    return "".join(letter if letter.isascii() and (letter.isalnum() or letter in " ._-") else " " for letter in text).strip()


def plain(quantity):
    """A figure that FreeCAD may give with its unit."""
    return float(getattr(quantity, "Value", quantity))


def controller_lines(controller):
    """Cutter and spindle of a tool controller, the tool between them."""
    tool, lines = controller.Tool, []
    diameter = getattr(tool, "Diameter", None)
    if diameter is not None:
        corner = getattr(tool, "FlatRadius", None)
        ball = "ball" in str(getattr(tool, "ShapeName", "")).lower()
        radius = 0.5 * plain(diameter) if ball else plain(corner) if corner is not None else 0.0
        lines.append(f"CUTTER/{number_text(plain(diameter))},{number_text(radius)}")
    lines.append(f"LOADTL/{int(controller.ToolNumber)}")
    speed = plain(controller.SpindleSpeed)
    sense = "CCLW" if controller.SpindleDir == "Reverse" else "CLW"
    return lines + ([f"SPINDL/RPM,{number_text(speed)},{sense}"] if speed > 0.0 else ["SPINDL/OFF"])


def apt_of(objects, name):
    """APT text of operations in their order; those that are switched off are left out.

    Raises:
        Refused: where a command cannot be said.
    """
    apt, last = Apt(name), None
    for one in objects:
        if not hasattr(one, "Path") or not getattr(one, "Active", True) or hasattr(one, "ToolNumber"):
            continue
        controller = getattr(one, "ToolController", None)
        if controller is not None and controller is not last:
            apt.lines += controller_lines(controller)
            apt.loaded, last = int(controller.ToolNumber), controller
        apt.operation(one.Label, one.Path.Commands, getattr(one, "Placement", None))
    return apt.text()


def export(objectslist, filename, argstring=""):
    """What FreeCAD calls: the text, written to a file unless its name is "-"."""
    text = apt_of(objectslist, getattr(objectslist[0], "Label", "part") if objectslist else "part")
    if filename != "-":
        Path(filename).write_text(text, encoding="ascii", newline="\n")
    return text
