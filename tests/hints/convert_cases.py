"""Hints of conversions: what the CL file, the set-up, the machine and the control do not give together."""

from __future__ import annotations

from typing import Any

from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.machine_cases import machine_text

START = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\n"
CUT = "RAPID\nGOTO/0,0,5\nGOTO/0,0,0\nGOTO/9,0,0\nRAPID\nGOTO/9,0,5\n"
LENGTH = "[tools.1]\ngauge_length = 110.0\n"
PLACES = """[[places]]
name = "left"
work_offset_code = "G54"
[[places]]
name = "right"
work_offset_code = "G55"
origin = [60.0, 0.0, 40.0]
"""
OVER = "RAPID\nGOTO/0,0,50\nGOTO/0,0,5\n"
TAP = "RAPID\nGOTO/0,0,50\nCYCLE/TAP,DEPTH,5,MMPR,1,CLEAR,3\nGOTO/5,5,0\nCYCLE/OFF\n"
TURNING = "RAPID\nGOTO/0,0,50\nGOTO/0,0,5\nGOTO/10,0,5,0.1,0,0.994987437\nGOTO/20,0,5,0.2,0,0.979795897\n"
FAST = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,9000,CLW\nFEDRAT/MMPM,600\n"


def convert(
    code: str,
    text: str,
    says: str,
    *does: Edit,
    setup: str = LENGTH,
    machine: str = "mill-3axis",
    control: str = "linuxcnc",
    more: str = "",
    stops: tuple[str, ...] = (),
    code_left: bool = False,
    stands_in: tuple[tuple[str, Any], ...] = (),
    **files: str,
) -> HintCase:
    """A conversion of part.apt with s.toml; files of `files` end in .toml."""
    others = {f"{name}.toml": body for name, body in files.items()}
    machine = "m.toml" if "m" in files else machine
    control = "c.toml" if "c" in files else control
    return HintCase(
        code,
        f"convert part.apt -m {machine} -c {control} --setup s.toml -o p.ngc{more}",
        {"part.apt": text + "FINI\n", "s.toml": setup, **others},
        says,
        does,
        stops=stops,
        code_left=code_left,
        stands_in=stands_in,
    )


def part(old: str, new: str) -> Edit:
    """An edit of the CL file."""
    return Edit("part.apt", old, new)


def sheet(old: str, new: str) -> Edit:
    """An edit of the set-up."""
    return Edit("s.toml", old, new)


def option(new: str, old: str = "") -> Edit:
    """An edit of the command line."""
    return Edit(COMMAND, old, new)


def nx(name: str, number: int, size: float) -> str:
    """An operation of NX with a tool."""
    return (
        f"TOOL PATH/OP_{name},TOOL,{name}\nTLDATA/MILL,{size},0,75,0,0\nLOAD/TOOL,{number}\nSPINDL/RPM,1000,CLW\n"
        f"FEDRAT/MMPM,600\n{CUT}END-OF-PATH\n"
    )


FACED = (
    "TOOL PATH/FACE_TURN,TOOL,OD_80_L\nTLDATA/TURN,INSERT,80,0\nMSYS/0,0,0,0,0,1,1,0,0\nLOAD/TOOL,1\n"
    "SPINDL/SMM,200,CLW\nRAPID\nGOTO/10,0,0\nFEDRAT/MMPR,0.2\nGOTO/5,0,0\nEND-OF-PATH\n"
)
LEFT = "CUTTER/10\nRAPID\nGOTO/20,-30,20\nGOTO/20,-30,2\nCUTCOM/LEFT\nGOTO/20,0,2\n"
ARC = "CIRCLE/0,0,2,0,0,1,20\nGOTO/-20,0,2\n"
_PATH = [
    convert(
        "arc.behind_hole",
        START + "RAPID\nGOTO/0,0,50\nCYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3,RETURN,10\nGOTO/20,0,5\nCYCLE/OFF\n"
        "CIRCLE/20,5,5,0,0,1,5\nGOTO/25,5,5\n",
        "put a (GOTO) to the start of the arc between CYCLE/OFF and the arc",
        part("CYCLE/OFF\n", r"CYCLE/OFF\n\1/20,0,5\n"),
        control="fanuc-30i",
    ),
    convert(
        "axis.opposite",
        START + "RAPID\nGOTO/0,0,5,0,0,1\nGOTO/9,0,5,0,0,-1\n",
        "put a point between",
        part("GOTO/9", "GOTO/4,0,5,0,1,0\nGOTO/9"),
        machine="mikron-ucp710",
        stops=("reach.axis", "travel.exceeded", "path.jump", "link.blocked"),
    ),
    convert(
        "convert.no_motion",
        "UNITS/MM\nFROM/0,0,5\n",
        "it needs (GOTO) records",
        part("FINI", r"\1/0,0,2\nFINI"),
        stops=("tool.number", "spindle.not_started", "feed.missing"),
    ),
    convert(
        "convert.turning",
        FACED + nx("A", 1, 5),
        "take turning operations out of the CL file",
        part(
            FACED,
            "",
        ),
    ),
    convert(
        "convert.turning",
        START + "SPINDL/SMM,120,CLW\n" + CUT,
        "a surface speed .* of a mill is stated by (RPM)",
        part("SMM,120", r"\1,3000"),
    ),
    convert(
        "cutcom.arc",
        START
        + "CUTTER/10\nRAPID\nGOTO/20,0,20\nGOTO/20,0,2\nCUTCOM/LEFT\n"
        + ARC
        + "GOTO/-20,20,2\nCUTCOM/OFF\nGOTO/-20,40,2\nRAPID\nGOTO/0,0,20\n",
        "straight move that leads to",
        part(
            "RAPID\nGOTO/20,0,20\nGOTO/20,0,2\nCUTCOM/LEFT\n",
            "RAPID\nGOTO/20,-30,20\nGOTO/20,-30,2\nCUTCOM/LEFT\nGOTO/20,0,2\n",
        ),
        control="fanuc-30i",
        code_left=True,
    ),
    convert(
        "cutcom.offset_back",
        START + LEFT + ARC + "GOTO/-20,-20,2\nCUTCOM/OFF\nGOTO/0,-20,2\nRAPID\nGOTO/0,0,20\n",
        r"compensation = \"(wear)\": the words",
        sheet('"radius"', r'"\1"'),
        setup=LENGTH + 'compensation = "radius"\n',
    ),
    convert(
        "cutcom.left_on",
        START
        + LEFT
        + "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3\nGOTO/30,0,0\nCYCLE/OFF\n"
        "GOTO/40,0,5\nGOTO/50,0,5\nCUTCOM/OFF\nRAPID\nGOTO/50,0,20\n",
        "write (CUTCOM/OFF) before the retract and (CUTCOM/LEFT) or RIGHT after",
        part("GOTO/20,0,2\nCYCLE", r"GOTO/20,0,2\n\1\nGOTO/20,30,2\nCYCLE"),
        part("GOTO/40,0,5\nGOTO/50,0,5\n", r"GOTO/40,0,5\n\2\nGOTO/50,0,5\nGOTO/50,10,5\n"),
        control="fanuc-30i",
    ),
    convert(
        "cutcom.mode",
        START + OVER + "CUTCOM/LEFT,1\nGOTO/9,0,5\nCUTCOM/OFF\nGOTO/9,9,5\n",
        "in machine coordinates or in a tilted plane .(--output-mode).",
        option(r"\1 axes", "--output-mode tcp"),
        machine="mikron-ucp710",
        control="fanuc-30i",
        more=" --output-mode tcp",
    ),
    convert(
        "cutcom.arc_plane",
        START
        + LEFT
        + "GOTO/0,0,2\nCIRCLE/0,0,12,0,1,0,10\nGOTO/-10,0,12\nCUTCOM/OFF\n"
        "GOTO/-20,20,12\nRAPID\nGOTO/0,0,20\n",
        "write (CUTCOM/OFF) before it",
        part("GOTO/-10,0,12\nCUTCOM/OFF\n", "GOTO/-10,0,12\n"),
        part("GOTO/20,0,2\nGOTO/0,0,2\n", r"GOTO/20,0,2\nGOTO/10,0,2\n\1\nGOTO/0,0,2\n"),
    ),
]
_OUTPUT = [
    convert(
        "write.axis_letters",
        START + CUT,
        "take a controller that has the letter",
        Edit(COMMAND, "linuxcnc", "siemens-840d"),
        m=machine_text("macro-micro").replace('"A", "B"', '"Q", "B"').replace("axes.A]", "axes.Q]"),
        setup=LENGTH + "[part]\norigin = [0.0, 0.0, -250.0]\n",
    ),
    convert(
        "output.mode",
        START + OVER,
        "have: (axes)",
        option(r"--output-mode \1", "--output-mode tcp"),
        control="generic-iso",
        more=" --output-mode tcp",
        machine="mikron-ucp710",
    ),
    convert(
        "output.option",
        START + TURNING,
        "without it this controller and machine have: (axes)",
        option(r"--output-mode \1", "--output-mode tcp"),
        m=machine_text("mikron-ucp710") + "\n[control]\ntip_control = false\n",
        control="fanuc-30i",
        more=" --output-mode tcp",
    ),
    convert(
        "output.option",
        START + TURNING,
        r"state (true) where it is fitted",
        Edit("m.toml", "tip_control = false", r"tip_control = \1"),
        m=machine_text("mikron-ucp710") + "\n[control]\ntip_control = false\n",
        control="fanuc-30i",
        more=" --output-mode tcp",
    ),
    convert(
        "output.turning",
        START + TURNING,
        "use (auto) or (tcp)",
        option(r"--output-mode \1", "--output-mode tilted"),
        control="fanuc-30i",
        more=" --output-mode tilted",
        machine="mikron-ucp710",
    ),
    convert(
        "output.subprograms",
        "UNITS/MM\n" + nx("A", 1, 5),
        "(restart = true)",
        sheet("subprograms = true", r"\1"),
        control="generic-iso",
        setup=LENGTH + "[output]\nsubprograms = true\n",
    ),
    convert(
        "output.tables_at_zero",
        START + TURNING,
        r'(frame = "table") in (\[modes\.tcp\]) of the controller file',
        Edit("c.toml", "", r"\2\n\1\n"),
        c='base = "fanuc-30i"\n',
        machine="mikron-ucp710",
        more=" --output-mode tcp",
    ),
    convert(
        "output.units",
        START + CUT,
        r'or \[output\] (units = "mm") in the set-up',
        sheet('units = "inch"', r"\1"),
        setup=LENGTH + '[output]\nunits = "inch"\n',
        c='base = "fanuc-30i"\n[program]\npreamble = ["G17 G21 G40 G49 G80 G90 G94 G98", "{work_offset}"]\n',
    ),
    convert(
        "output.units",
        START + CUT,
        r"write (\{units\}) in the place of (G21)",
        Edit("c.toml", "G21", r"\1"),
        setup=LENGTH + '[output]\nunits = "inch"\n',
        c='base = "fanuc-30i"\n[program]\npreamble = ["G17 G21 G40 G49 G80 G90 G94 G98", "{work_offset}"]\n',
    ),
    convert(
        "output.units",
        START + CUT,
        r'write \[output\] (units = "mm") in the set-up',
        sheet('units = "inch"', r"\1"),
        setup=LENGTH + '[part]\norigin = [0, 0, -270]\n[output]\nunits = "inch"\n',
        machine="h4-rotary",
    ),
    convert(
        "splines.no_word",
        START + "RAPID\nGOTO/0,0,5\nGOTO/0,0,0\nNURBS/\nKNOT/1.0\nCNTRL/5,9,0\nCNTRL/9,-4,0\nCNTRL/12,0,0\n"
        "RAPID\nGOTO/12,0,5\n",
        r'state (splines = "poly")',
        Edit("m.toml", 'splines = "bspline"', r"\1"),
        control="heidenhain-tnc640",
        m='base = "mill-3axis"\n[control]\nsplines = "bspline"\n',
    ),
    convert(
        "output.longest",
        "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nCUTCOM/LEFT,1\n"
        + "".join(f"RAPID\nGOTO/{x},0,5\nFEDRAT/200,MMPM\nGOTO/{x},0,0\nGOTO/{x},9,0\n" for x in range(6))
        + "CUTCOM/OFF\nRAPID\nGOTO/0,0,20\n",
        r"\[output\] longest of the set-up",
        sheet("longest = 4", "longest = 40"),
        setup=LENGTH + "[output]\nlongest = 4\n",
    ),
    convert(
        "tolerance.rounding",
        START + "RAPID\nGOTO/0,0,5\nGOTO/1.26,0,5\n",
        "or a wider (--tolerance)",
        option(r" \1 0.2"),
        c='base = "generic-iso"\n[format]\nlinear_decimals = 1\n',
    ),
    convert(
        "tolerance.rounding",
        START + "RAPID\nGOTO/0,0,5\nGOTO/1.26,0,5\n",
        r"more decimals in the controller's \[format\]",
        Edit("c.toml", "= 1", "= 3"),
        c='base = "generic-iso"\n[format]\nlinear_decimals = 1\n',
    ),
    convert(
        "tolerance.smoothing",
        START + CUT,
        r"a wider (--tolerance)",
        option(r" \1 0.02"),
        c='base = "generic-iso"\n[kinematics]\nsmoothing_fixed = 0.004\n',
        more=" --tolerance 0.003",
    ),
    convert(
        "write.line_length",
        START + TURNING.replace("10,0,5", "10.1234,11.2345,5.4321"),
        r"(format)\.(line_length) of the controller file",
        Edit("c.toml", "line_length = 40", "line_length = 120"),
        c='base = "generic-iso"\n[format]\nline_length = 40\n',
        machine="mikron-ucp710",
        more=" --output-mode axes",
    ),
    convert(
        "hooks.passive",
        START + CUT,
        r"take (G91) out of passive",
        sheet('passive = ["G91"]\n', ""),
        setup=LENGTH + '[hooks]\nbefore_tool = ["G91"]\npassive = ["G91"]\n',
        control="fanuc-30i",
        stops=("hooks.code",),
    ),
    convert(
        "places.turn",
        START + CUT,
        r"its tables are (A)",
        sheet("turn = { B = 90 }", r"turn = { \1 = 90 }"),
        setup=LENGTH + PLACES + "turn = { B = 90 }\n",
        machine="mill-4axis",
    ),
    convert(
        "places.centre",
        START + CUT,
        r"take it out",
        sheet("[clearance]\ncentre = [0.0, 0.0, 0.0]\n", ""),
        setup=LENGTH + "[clearance]\ncentre = [0.0, 0.0, 0.0]\n" + PLACES,
    ),
    convert(
        "places.measured",
        START + CUT,
        r"(measured = \"zero\")",
        sheet('measured = "turned"', r"\1"),
        setup=LENGTH + PLACES + 'turn = { A = 90 }\nmeasured = "turned"\n',
        machine="mill-4axis",
        control="fanuc-30i",
        more=" --output-mode tcp",
    ),
    convert(
        "places.one",
        "CUTTER/10,5\n" + START + CUT,
        r"take \[\[places\]\] out of the set-up",
        sheet(PLACES, ""),
        setup=LENGTH + PLACES,
        more=" --orient auto",
    ),
    convert(
        "travel.exceeded",
        START + "RAPID\nGOTO/0,0,390,0,0,1\nGOTO/1,0,390\n",
        "(?s).*",
        sheet("", "[part]\norigin = [0.0, 0.0, -300.0]\n"),
    ),
]
_STOCK = """0 BEGIN PGM P MM
1 BLK FORM 0.1 Z X-9 Y-9 Z-9
2 BLK FORM 0.2 X+20 Y+9 Z+0
3 CYCL DEF 247 DATUM SETTING ~
Q339=+1 ;DATUM NUMBER
4 CYCL DEF 32.0 TOLERANCE
5 CYCL DEF 32.1 T0.003
6 CYCL DEF 32.2 HSC-MODE:0 TA0.015
7 L Z+400 R0 FMAX M91
8 TOOL CALL 1 Z S1000
9 M3
10 L X+0 Y+0 FMAX
11 L Z+67.6478 FMAX
12 L Z+5 FMAX
13 L Z+0 F600
14 L X+9
15 L Z+5 FMAX
16 L Z+67.6478 FMAX
17 L Z+400 FMAX M91
18 L X+0 Y+0 FMAX M91
19 M9
20 M5
21 M30
22 END PGM P MM
"""
_VERIFY = [
    HintCase(
        "verify.stock",
        "verify p.h part.apt -m mill-3axis -c heidenhain-tnc640 --setup s.toml",
        {
            "part.apt": START + CUT + "FINI\n",
            "s.toml": LENGTH + "[rewind.stock]\nlow = [-9.0, -9.0, -9.0]\nhigh = [12.0, 9.0, 0.0]\n",
            "p.h": _STOCK,
        },
        r"correct \[rewind.stock\] of the set-up",
        (sheet("12.0", "20.0"),),
    )
]
CONVERT = [*_PATH, *_OUTPUT, *_VERIFY]
