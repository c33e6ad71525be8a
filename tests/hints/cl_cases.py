"""Hints of the CL reader: records as found, as the hint has them."""

from __future__ import annotations

import re

from tests.hints.case import Edit, HintCase

BEGIN = "GOTO/0,0,0\n"
AXES = "1,0,0,0,1,0"
AT_10 = "GOTO/10,0,0\n"
SPLINE = "NURBS/\nKNOT/1\nCNTRL/1,1,0\nCNTRL/2,1,0\nCNTRL/3,0,0"
OWN = """$$-> TOOLPATH / {"version": 1, "units": "mm"}
UNITS/MM
$$-> TOOL / {"number": 1}
$$-> OPERATION / {"name": "", "tool_name": "", "frame": 0, "turning": false}
$$-> USE / 0,0
LOADTL/1
FEDRAT/MMPM,500
GOTO/0,0,0
$$-> WORDS / ["DRILL", "DEPTH", 5.0]
CYCLE/DRILL,DEPTH,5,CLEAR,2,MMPM,100
GOTO/1,1,0
CYCLE/OFF"""
_ROWS = [  # code, records as found, as the hint has them, word of the hint
    ("cl.arc-axis", BEGIN + "CIRCLE/0,0,0,0,0,2,5\nGOTO/5,5,0", BEGIN + "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,5,0", "unit vector"),
    ("cl.arc-radius", BEGIN + "CIRCLE/0,0,0,0,0,1,5\nGOTO/5,5,0", BEGIN + "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,5,0", "centre"),
    ("cl.arc-radius", BEGIN + "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,9,0", BEGIN + "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,5,0", "the end"),
    ("cl.arc-start", "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,5,0", BEGIN + "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,5,0", "put a GOTO"),
    ("cl.indirv", BEGIN + "INDIRV/1,0", BEGIN + "INDIRV/1,0,0", "INDIRV/i,j,k"),
    ("cl.indirv", "INDIRP/1,0,0", BEGIN + "INDIRP/1,0,0", "GOTO, then INDIRP"),
    ("cl.cycle", BEGIN + "CYCLE/ON", BEGIN + "CYCLE/DRILL,DEPTH,5,CLEAR,2,MMPM,100\nCYCLE/OFF\nCYCLE/ON", "state the cycle"),
    ("cl.feed", "FEDRAT/MMPM", "FEDRAT/MMPM,250.0", "FEDRAT/MMPM,250.0"),
    ("cl.feed", "FEDRAT/MMPM,0", "FEDRAT/MMPM,60", "a feed above 0"),
    ("cl.feed", "FEDRAT/MMPM,0", "FEDRAT/MMPM,0\nRAPID", "RAPID where it cuts none"),
    ("cl.feed", "FEDRAT/MPM,250", "FEDRAT/MMPM,250", "write the feed in MMPM"),
    ("cl.feed", "FEDRAT/INVERS", "FEDRAT/INVERS,2.5", "INVERS,2.5"),
    ("cl.frame", f"MSYS/0,0,0,{AXES},1", f"MSYS/0,0,0,{AXES}", "9 numbers"),
    ("cl.frame", "MSYS/0,0,0,2,0,0,0,1,0", f"MSYS/0,0,0,{AXES}", "of length 1"),
    ("cl.frame", f"MCS/{AXES},0,0,1", f"MCS/{AXES},0,0,1,0,0,0", "12 numbers"),
    ("cl.frame", "MCS/1,0,0,0,2,0,0,0,1,0,0,0", f"MCS/{AXES},0,0,1,0,0,0", "Z = X x Y"),
    ("cl.frame", "MCSYS/NUM,1,POINT,0,0,0", f"MCSYS/NUM,1,POINT,0,0,0,VECTOR,{AXES[:5]},VECTOR,{AXES[6:]}", "NUM,1,POINT"),
    (
        "cl.frame",
        "MCSYS/NUM,1,POINT,0,0,0,VECTOR,3,0,0,VECTOR,0,1,0",
        "MCSYS/NUM,1,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,1,0",
        "at right angles",
    ),
    ("cl.frame", "ZERO/ALL", "ZERO/1", "ZERO/1"),
    ("cl.frame", "TRANS/1,2", "TRANS/1,2,0", "TRANS/x,y,z"),
    ("cl.frame", "ORIGIN/1,2", "ORIGIN/1,2,0", "ORIGIN/x,y,z"),
    ("cl.frame", "ORIGIN/1,2,0,2,0,0,0,1,0", f"ORIGIN/1,2,0,{AXES}", "at right angles"),
    ("cl.goto", "GOTO/1,2", "GOTO/1,2,0", "GOTO/x,y,z"),
    ("cl.godlta", BEGIN + "GODLTA/1,2", BEGIN + "GODLTA/1,2,0", "GODLTA/x,y,z"),
    ("cl.from", "FROM/1,2", "FROM/1,2,0", "FROM/x,y,z"),
    ("cl.tlaxis", "TLAXIS/0,1", "TLAXIS/0,0,1", "TLAXIS/i,j,k"),
    ("cl.motion-word", "ZSURF/1,2,3", "ZSURF/1", "ZSURF/z"),
    (
        "cl.circle-end",
        BEGIN + "CIRCLE/5,0,0,0,0,1,5\nSPINDL/OFF",
        BEGIN + "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,5,0",
        "behind CIRCLE",
    ),
    ("cl.circle", BEGIN + "CIRCLE/5,0,0\nGOTO/5,5,0", BEGIN + "CIRCLE/5,0,0,0,0,1,5\nGOTO/5,5,0", "axis i,j,k"),
    ("cl.circle", BEGIN + "MOVARC/5,0,0,0,0,1,5\nGOTO/5,5,0", BEGIN + "MOVARC/5,0,0,0,0,-1,5,ANGLE,90\nGOTO/5,5,0", "ANGLE"),
    (
        "cl.arc-sweep",
        BEGIN + "MOVARC/5,0,0,0,0,1,5,ANGLE,40\nGOTO/5,5,0",
        BEGIN + "MOVARC/5,0,0,0,0,-1,5,ANGLE,90\nGOTO/5,5,0",
        "correct the angle",
    ),
    (
        "cl.circle-end",
        BEGIN + "MOVARC/5,0,0,0,0,-1,5,ANGLE,90\nSPINDL/OFF",
        BEGIN + "MOVARC/5,0,0,0,0,-1,5,ANGLE,90\nGOTO/5,5,0",
        "behind MOVARC",
    ),
    ("cl.tool-number", "LOADTL/1.5", "LOADTL/3", "whole numbers"),
    ("cl.tool-number", "LOADTL/NEXT", "LOADTL/3", "LOADTL/3"),
    ("cl.tool-number", "LOAD/TOOL", "LOAD/TOOL,3", "LOAD/TOOL,3"),
    ("cl.tool-number", "TURRET/FACE", "TURRET/3", "TURRET/3"),
    ("cl.units", "UNITS/CM", "UNITS/MM", "UNITS/MM"),
    ("cl.turning", "THREAD/TURN,AT,1.5\nGOTO/10,5,0", "GOTO/10,5,0", "take turning operations out"),
    ("cl.from", "GOHOME/,1,2", "GOHOME/0,1,2", "GOHOME/x,y,z"),
    (
        "cl.circle-times",
        BEGIN + "CIRCLE/5,0,0,0,0,1,5,0,0,0,0,TIMES,1.5\nGOTO/5,5,0",
        BEGIN + "CIRCLE/5,0,0,0,0,1,5,0,0,0,0,TIMES,2\nGOTO/5,5,0",
        "TIMES,2",
    ),
    (
        "cl.circle-times",
        BEGIN + "CIRCLE/5,0,0,0,0,1,5,0,0,0,0,TIMES,99999999\nGOTO/5,5,0",
        BEGIN + "CIRCLE/5,0,0,0,0,1,5,0,0,0,0,TIMES,9\nGOTO/5,5,0",
        "divide the arc",
    ),
    (
        "cl.indirv",
        AT_10 + "TLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,10,0)",
        AT_10 + "INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,10,0)",
        "put INDIRV",
    ),
    (
        "cl.circle",
        AT_10 + "INDIRV/0,1,0\nTLON,GOFWD/(ELLIPS/0,0,0,10),ON,(LINE/0,0,0,0,10,0)",
        AT_10 + "GOTO/7.071,7.071,0\nGOTO/0,10,0",
        "as points (GOTO)",
    ),
    ("cl.circle", BEGIN + "HELICAL/CENTER,5,0,0", BEGIN + "GOTO/5,5,1", "write points"),
    ("cl.nurbs", SPLINE, BEGIN + SPLINE, "put a GOTO before the spline"),
    ("cl.nurbs", BEGIN + SPLINE + "\nKNOT/2", BEGIN + SPLINE, "as points"),
    ("cl.nurbs", BEGIN + SPLINE.replace("KNOT/1", "KNOT/-1"), BEGIN + SPLINE, "as points"),
    ("cl.nurbs", BEGIN + SPLINE.replace("1,1,0", "1,1"), BEGIN + SPLINE, "CNTRL/x,y,z"),
    ("cl.data-comment", OWN.replace('["DRILL", "DEPTH", 5.0]', "DRILL"), OWN, "correct the list"),
    ("cl.data-comment", OWN.replace('{"number": 1}', "1"), OWN, "correct the object"),
    ("cl.data-comment", OWN.replace('{"number": 1}', '{"number": "one"}'), OWN, "correct the object"),
    ("cl.data-comment", OWN.replace("USE / 0,0", "USE / 0,7"), OWN, "declare it"),
    ("cl.data-comment", OWN + "\n$$-> SPLINE / many", OWN + "\n$$-> SPLINE / 1", "SPLINE / 12"),
    ("cl.data-comment", OWN + "\n$$-> SPLINE / 6", OWN + "\n$$-> SPLINE / 1", "correct the count"),
]


def _file(text: str) -> str:
    """A file with these records, and a GOTO behind them unless they end with SPINDL."""
    head = "" if text.startswith("$$->") else "LOADTL/1\nFEDRAT/MMPM,500\n"
    units = "" if "UNITS" in text else "UNITS/MM\n"
    last = "" if text.endswith("SPINDL/OFF") else "GOTO/50,50,50\n"
    return f"{units}{head}{text}\n{last}FINI\n"


def _row(code: str, wrong: str, right: str, word: str) -> HintCase:
    return HintCase(
        code,
        "inspect part.apt",
        {"part.apt": _file(wrong)},
        re.escape(word),
        (Edit("part.apt", _file(wrong), _file(right)),),
    )


_FREECAD = "(Exported by FreeCAD)\n(Begin operation: Profile)\nG90 G21\nM6 T1\nM3 S1000\nG0 X0 Y0 Z5\nG1 Z-1{}\nG1 X9\nM2\n"
CL = [
    *(_row(*row) for row in _ROWS),
    HintCase("cl.feed", "inspect part.nc", {"part.nc": _FREECAD.format("")}, "write F with the first cut",
             (Edit("part.nc", "Z-1", "Z-1 F100"),)),
]
