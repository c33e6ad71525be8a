"""Run LinuxCNC's interpreter on a program and write its canonical moves as doubles.

A script for Debian's own Python, which has the `gcode` module: exact.py JOB_FOLDER. The folder holds
program.ngc and tool.tbl (mm) and receives rows.f64 (one row of `WIDTH` numbers per move) and result.json.
$HOME must be a folder of
this run alone: LinuxCNC keeps its tool data in a file there.
"""

from __future__ import annotations

import ctypes
import json
import sys
from array import array
from pathlib import Path

import gcode

MM = 25.4
TRAVERSE, FEED, ARC, PROBE, TAP, DWELL = range(6)
AXES = 9
WIDTH = 11 + 2 * AXES
LAST_GOOD = 3
"""The interpreter's codes up to this are kinds of success."""
NO_TOOL = (-1,) + (0.0,) * 12 + (0,)


def load_tools(table: Path) -> list[tuple[float, ...]]:
    """Tool rows as the interpreter asks for them, row 0 the spindle; also fills the shared tool data it relies on."""
    library = ctypes.CDLL("libtooldata.so.0")
    library._Z17tool_mmap_creatorPK13EMC_TOOL_STATi(None, 0)
    library._Z13tooldata_loadPKcPPc(str(table).encode(), None)
    rows = [NO_TOOL]
    for line in table.read_text().splitlines():
        words = {word[0]: float(word[1:]) for word in line.split()}
        rows.append((int(words["T"]), 0.0, 0.0, words["Z"], *(0.0,) * 6, words["D"], 0.0, 0.0, 0))
    return rows


class Recorder:
    """What the interpreter calls; the machine is one in millimetres with the axes X Y Z A B C U V W."""

    def __init__(self, folder: Path) -> None:
        self.parameter_file = str(folder / "parameters")
        Path(self.parameter_file).touch()
        self.tools = load_tools(folder / "tool.tbl")
        self.rows = array("d")
        self.at = [0.0] * AXES
        self.g5x, self.g92, self.length = [0.0] * AXES, [0.0] * AXES, [0.0] * AXES
        self.feed, self.inverse, self.plane, self.line, self.tool, self.rotation = 0.0, False, 1, 0, 0, 0.0

    def record(self, kind, at, first=0.0, second=0.0, turn=0, dwell=0.0):
        offset = [sum(v) for v in zip(self.g5x, self.g92, self.length, strict=True)]
        self.rows.extend([kind, *at, *offset, self.feed, self.inverse, self.line, self.tool, self.plane, first, second,
                          turn, dwell, self.rotation])
        self.at = at

    def straight_traverse(self, *v):
        self.record(TRAVERSE, pose(v))

    def straight_feed(self, *v):
        self.record(FEED, pose(v))

    def straight_probe(self, *v):
        self.record(PROBE, pose(v))

    def rigid_tap(self, x, y, z):
        """The tool comes back to where it was."""
        before = self.at
        self.record(TAP, [x * MM, y * MM, z * MM, *before[3:]])
        self.at = before

    def arc_feed(self, first, second, center1, center2, turn, height, *angles):
        by_plane = {1: (first, second, height), 2: (height, first, second), 3: (second, height, first)}
        self.record(ARC, pose((*by_plane[self.plane], *angles)), center1 * MM, center2 * MM, turn)

    def dwell(self, seconds):
        self.record(DWELL, self.at, dwell=seconds)

    def next_line(self, state):
        self.line = state.sequence_number

    def set_feed_rate(self, rate):
        self.feed = rate * MM

    def set_plane(self, plane):
        self.plane = plane

    def set_g5x_offset(self, _index, *v):
        self.g5x = pose(v)

    def set_g92_offset(self, *v):
        self.g92 = pose(v)

    def tool_offset(self, *v):
        self.length = pose(v)

    def set_xy_rotation(self, angle):
        self.rotation = angle

    def comment(self, text):
        """G93 and G94 only show in the interpreter's own remarks."""
        if text.startswith("interpreter: feed mode set to"):
            self.inverse = "inverse" in text

    def change_tool(self, row):
        self.tools[0] = self.tools[row]
        self.tool = self.tools[row][0]

    def get_tool(self, row):
        return self.tools[row] if 0 <= row < len(self.tools) else NO_TOOL

    def get_external_length_units(self):
        return 1.0

    def get_external_angular_units(self):
        return 1.0

    def get_axis_mask(self):
        return 0b111111111

    def get_block_delete(self):
        return False

    def check_abort(self):
        return False

    def message(self, _text):
        """Nothing to record."""

    def set_traverse_rate(self, _rate):
        """Nothing to record."""

    def user_defined_function(self, _number, _p, _q):
        """Nothing to record."""


def pose(v) -> list[float]:
    """x y z in mm, a b c in degrees, u v w in mm, of the interpreter's nine values in inch and degrees."""
    return [v[0] * MM, v[1] * MM, v[2] * MM, v[3], v[4], v[5], v[6] * MM, v[7] * MM, v[8] * MM]


def main() -> None:
    folder = Path(sys.argv[1])
    recorder = Recorder(folder)
    code, line = gcode.parse(str(folder / "program.ngc"), recorder, "G21", "")
    error = f"line {line}: {gcode.strerror(code)}" if code > LAST_GOOD else ""
    (folder / "rows.f64").write_bytes(recorder.rows.tobytes())
    (folder / "result.json").write_text(json.dumps({"error": error, "width": WIDTH}))


if __name__ == "__main__":
    main()
