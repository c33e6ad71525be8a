"""The conversions in which planted faults act: small files, the part off the rotary axes, tools of different lengths."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
GOLDEN, SAMPLES = ROOT / "tests" / "golden", ROOT / "samples"
LENGTHS = {"1": {"gauge_length": 120.0}, "2": {"gauge_length": 95.5}, "3": {"gauge_length": 133.25}}
TURNED: dict[str, Any] = {"tools": LENGTHS, "part": {
    "origin": (37.0, -23.0, 11.0), "x_axis": (0.9563047559630355, 0.29237170472273677, 0.0),
    "y_axis": (-0.29237170472273677, 0.9563047559630355, 0.0)}}
LEANING: dict[str, Any] = {"tools": LENGTHS, "part": {
    "origin": (13.0, -20.0, 15.0), "x_axis": (0.96, 0.0, -0.28), "y_axis": (0.0, 1.0, 0.0)}}
ON_RODS: dict[str, Any] = {"tools": {"1": {"gauge_length": 60.0}, "2": {"gauge_length": 47.5}},
                           "part": {"origin": (12.0, -7.0, -900.0)}}
ON_DELTA: dict[str, Any] = {"tools": {"1": {"gauge_length": 120.0}, "2": {"gauge_length": 95.5}},
                            "part": {"origin": (12.0, -7.0, -270.0)}}
HEAD = """TOOL PATH/ONE,TOOL,MILL_10
TLDATA/MILL,10.0000,0.0000,80.0000,0.0000,0.0000
MSYS/20.0,5.0,3.0,0.0,1.0,0.0,-1.0,0.0,0.0
LOAD/TOOL,1
SPINDL/RPM,3000,CLW
COOLNT/FLOOD
RAPID
GOTO/10,0,50,0,0,1
RAPID
GOTO/10,0,2
FEDRAT/MMPM,250
GOTO/10,0,-3
CIRCLE/0,0,-3,0,0,-1,10,0.03,0.5,10,0
GOTO/0,10,-3
FEDRAT/MMPM,600
GOTO/-20,14,-3
GODLTA/-6,3,0
GOTO/-30,30,-3
"""
AWAY = "RAPID\nGOTO/-30,30,50\n"
HOLES = """CYCLE/DRILL,DEEP,FEDTO,-12,RAPTO,3,RTRCTO,20,STEP,4,MMPM,120
GOTO/30,5,0
GOTO/40,5,0
CYCLE/OFF
RAPID
GOTO/40,5,50
"""
SECOND = """END-OF-PATH
TOOL PATH/TWO,TOOL,DRILL_6
TLDATA/DRILL,MILL,6.0000,0.0000,80.0000,118.0000,60.0000
MSYS/20.0,5.0,3.0,0.0,1.0,0.0,-1.0,0.0,0.0
LOAD/TOOL,2
SPINDL/RPM,1500,CLW
COOLNT/MIST
RAPID
GOTO/5,5,50,0,0,1
CYCLE/DRILL,FEDTO,-8,RAPTO,2,RTRCTO,AUTO,MMPM,90,DWELL,0.5
GOTO/5,15,0
GOTO/15,15,0
CYCLE/OFF
RAPID
GOTO/15,15,50
"""
NX = HEAD + AWAY + HOLES + SECOND + "END-OF-PATH\n"
MILLED = HEAD + AWAY + "END-OF-PATH\n"
HELIX = HEAD + """CIRCLE/-30,40,-3,0,0,-1,10,0.03,0.5,10,0,TIMES,2
GOTO/-30,30,-8
DELAY/0.75
STOP
GOTO/-40,30,-8
""" + AWAY + "END-OF-PATH\n"
PER_TURN = MILLED.replace("MMPM,250", "MMPR,0.1").replace("END-OF-PATH", "SPINDL/OFF\nEND-OF-PATH")
TIMED = MILLED.replace("FEDRAT/MMPM,600", "FEDRAT/INVERS,20")
INCH = """PARTNO INCH
UNITS/INCHES
LOADTL/1,2
SPINDL/RPM,3000,CLW
COOLNT/ON
RAPID
GOTO/1,0,2
RAPID
GOTO/1,0,.1
FEDRAT/10,IPM
GOTO/1,0,-.1
GOTO/3,1,-.1
CIRCLE/3,2,-.1,0,0,1,1
GOTO/4,2,-.1
CYCLE/DRILL,DEPTH,.5,IPM,4,CLEAR,.1
GOTO/2,3,0
CYCLE/OFF
RAPID
GOTO/2,3,2
FINI
"""
CREO = """$$-> MFGNO / OP
$$-> FEATNO / 1
UNITS / MM
LOADTL / 1
$$-> CSYS / 1.0, 0.0, 0.0, 25.0, $
 0.0, 0.8, -0.6, 4.0, $
 0.0, 0.6, 0.8, 7.0
SPINDL / RPM, 3000, CLW
COOLNT / ON
RAPID
GOTO / 10, 0, 30
FEDRAT / 250, MMPM
GOTO / 10, 0, -3
DEFSUB / 1
GOTO / 20, 4, -3
GOTO / 24, 8, -3
ENDSUB
CALSUB / 1
CIRCLE / 14, 8, -3, 0, 0, 1, 10
GOTO / 14, 18, -3
GOTO / 10, 9, -3
RAPID
GOTO / 10, 9, 30
FINI
"""
FIVE = """UNITS/MM
LOADTL/1
SPINDL/RPM,3000,CLW
COOLNT/ON
MULTAX/ON
RAPID
GOTO/10,3,40,0,0,1
FEDRAT/400,MMPM
GOTO/10,3,0,0,0,1
GOTO/20,5,2,0.0995037,0.0995037,0.9900496
GOTO/30,12,4,0.1960784,0.0980392,0.9756747
GOTO/35,20,4,0.28,0.0,0.96
RAPID
GOTO/35,20,40,0.28,0.0,0.96
LOADTL/2
SPINDL/RPM,5000,CLW
RAPID
GOTO/-35,20,40,-0.28,0.0,0.96
FEDRAT/600,MMPM
GOTO/-35,20,4,-0.28,0.0,0.96
GOTO/-15,10,4,-0.28,0.0,0.96
GOTO/-5,10,4,-0.1960784,0.0980392,0.9756747
RAPID
GOTO/-5,10,50,-0.1960784,0.0980392,0.9756747
FINI
"""
FACES = """UNITS/MM
LOADTL/1
SPINDL/RPM,3000,CLW
MULTAX/ON
RAPID
GOTO/8,0,10,0,0,1
FEDRAT/400,MMPM
GOTO/8,0,8,0,0,1
GOTO/-8,0,8,0,0,1
RAPID
GOTO/8,0,8,0.6,0,0.8
GOTO/8,0,-8,0.6,0,0.8
GOTO/8,4,-8,0.6,0,0.8
RAPID
GOTO/8,4,9,0.6,0,0.8
LOADTL/2
SPINDL/RPM,2000,CLW
RAPID
GOTO/-8,4,20,-0.6,0,0.8
GOTO/-8,4,-6,-0.6,0,0.8
GOTO/-8,-4,-6,-0.6,0,0.8
FINI
"""
CATIA = """PARTNO CATIA V5
$$*CATIA0
$$ Manufacturing Program.1
$$ 1.00000 0.00000 0.00000 6.00000
$$ 0.00000 0.80000 -0.60000 4.00000
$$ 0.00000 0.60000 0.80000 -2.00000
CUTTER/ 10.000000, 2.000000
TOOLNO/1, MILL, 10.000000
LOADTL/1,1
SPINDL/ 3000.0000,RPM,CLW
RAPID
GOTO / 10.0, 0.0, 30.0
FEDRAT/ 300.0000,MMPM
GOTO / 10.0, 0.0, -2.0
INDIRV/ 0.0, 1.0, 0.0
TLON,GOFWD/ (CIRCLE/ 0.0, 0.0, -2.0, 10.0),ON,(LINE/ 0.0, 0.0, -2.0, 0.0, 10.0, -2.0)
GOTO / -10.0, 12.0, -2.0
CYCLE/DRILL, 5.0, 100.0, MMPM, 2.0
GOTO / 20.0, 12.0, 0.0
CYCLE/OFF
RAPID
GOTO / 20.0, 12.0, 30.0
FINI
"""
CONTACT = """UNITS/MM
LOADTL/1
SPINDL/RPM,3000,CCLW
COOLNT/THRU
FROM/0,0,100
RAPID
GOTO/10,3,40
FEDRAT/400,MMPM
GOTO/10,3,0
GOTO/20,5,2
RAPID
GOHOME
LOADTL/2,ADJUST,7
SPINDL/RPM,900,CLW
COOLNT/OFF
RAPID
GOTO/20,5,30
FEDRAT/0.5,MMPR
GOTO/20,5,1
GOTO/0,5,1
RAPID
GOTO/0,5,40
FINI
"""
BARE = MILLED.replace("SPINDL/RPM,3000,CLW\n", "").replace("COOLNT/FLOOD\n", "").replace("FEDRAT/MMPM,250\n", "")
RESTS = MILLED.replace("GOTO/-30,30,-3\n", """GOTO/-30,30,-3
DELAY/1.5
GOTO/-34,30,-3
DELAY/20,REV
STOP
GOTO/-34,40,-3
OPSTOP
GOTO/-30,40,-3
""").replace("END-OF-PATH", """SPINDL/RPM,1200,CCLW
CYCLE/TAP,FEDTO,-9,RAPTO,3,RTRCTO,20,MMPR,1.25
GOTO/30,5,0
CYCLE/OFF
CYCLE/BRKCHP,FEDTO,-12,RAPTO,3,RTRCTO,20,STEP,4,MMPM,120
GOTO/20,25,0
CYCLE/OFF
CYCLE/BORE,FEDTO,-6,RAPTO,3,RTRCTO,20,MMPM,120,DWELL,REV,10
GOTO/10,25,0
CYCLE/OFF
RAPID
GOTO/10,25,50
END-OF-PATH""")
WETTED = MILLED.replace("COOLNT/FLOOD\n", "").replace("GOTO/-20,14,-3\n", "COOLNT/FLOOD\nGOTO/-20,14,-3\n")
SIDE = MILLED.replace("GOTO/-20,14,-3\n", "CUTCOM/LEFT,7\nGOTO/-20,14,-3\n").replace(
    "RAPID\nGOTO/-30,30,50", "CUTCOM/OFF\nGOTO/-34,34,-3\nRAPID\nGOTO/-30,30,50")
ROUNDED = """UNITS/MM
CUTTER/10
LOADTL/1
SPINDL/RPM,3000,CLW
RAPID
GOTO/-60,0,20
FEDRAT/400,MMPM
GOTO/-60,0,2
CUTCOM/LEFT
GOTO/-40,-15,2
CIRCLE/-40,0,2,0,0,1,15
GOTO/-25,0,2
GOTO/-25,10,2
CIRCLE/-20,10,2,0,0,-1,5
GOTO/-20,15,2
GOTO/20,15,2
CUTCOM/OFF
GOTO/20,40,2
RAPID
GOTO/20,40,20
FINI
"""
COOLED = NX.replace("COOLNT/FLOOD", "COOLNT/THRU").replace("COOLNT/MIST", "COOLNT/AIR")
BALLS = """UNITS/MM
CUTTER/10,5
LOADTL/1
SPINDL/RPM,3000,CLW
COOLNT/ON
RAPID
GOTO/0,0,60,0.2955202,0,0.9553365
FEDRAT/400,MMPM
GOTO/0,0,0
GOTO/20,0,0
GOTO/40,30,0
RAPID
GOTO/40,30,60
CUTTER/6,3
LOADTL/2
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,50,60,0,0.5,0.8660254
FEDRAT/300,MMPM
GOTO/0,50,0
GOTO/30,50,3
RAPID
GOTO/30,50,60
FINI
"""
FAST = FIVE.replace("FEDRAT/400", "FEDRAT/20000").replace("FEDRAT/600", "FEDRAT/30000")
ROUND = FAST[:FAST.index("GOTO/20,5,2")] + "".join(
    f"GOTO/{10 + 5 * np.sin(a):.4f},{8 - 5 * np.cos(a):.4f},0,0,0,1\n" for a in np.linspace(0.0, 3.0, 40)) + """RAPID
GOTO/10,3,40,0,0,1
FINI
"""
CURVE = HEAD + """NURBS/
KNOT/0.1,0.4,0.5,0.8,1.0
CNTRL/14,12,-3
CNTRL/-5,25,-3
CNTRL/-30,14,-3
CNTRL/-34,-20,-3
CNTRL/-4,-40,-3
CNTRL/25,-24,-3
CNTRL/-30,30,-3
""" + AWAY + "END-OF-PATH\n"
TALL = """UNITS/MM
LOADTL/1
SPINDL/RPM,3000,CLW
COOLNT/ON
RAPID
GOTO/0,0,40
RAPID
GOTO/0,0,12
FEDRAT/400,MMPM
GOTO/0,0,10
CIRCLE/10,0,10,0,1,0,10
GOTO/10,0,20
CIRCLE/10,10,20,1,0,0,10
GOTO/10,20,20
CIRCLE/10,20,10,0,-1,0,10
GOTO/0,20,10
RAPID
GOTO/0,20,50
FINI
"""


@dataclass(frozen=True)
class Case:
    """A CL text, or a file of the project, on a machine with a control, by a set-up and options."""

    cl: str | Path
    machine: str
    controller: str
    setup: dict[str, Any] = field(default_factory=lambda: TURNED)
    options: dict[str, Any] = field(default_factory=dict)


LAWS, CYCLES, SHORT = GOLDEN / "three_laws.cls", GOLDEN / "every_cycle.cls", GOLDEN / "short_five_axis.apt"
SIX = {"fanuc": "fanuc-30i", "siemens": "siemens-840d", "heidenhain": "heidenhain-tnc640", "haas": "haas-ngc",
       "linuxcnc": "linuxcnc", "iso": "generic-iso"}
MODES = ("fanuc", "siemens", "heidenhain", "haas")
ERRORS = {"error_model": str(SAMPLES / "errors" / "mikron-ucp710.toml")}
PLACES: dict[str, Any] = {"places": [
    {"name": "left", "work_offset_code": "G54"},
    {"name": "right", "work_offset_code": "G56", "origin": (-61.0, 33.0, 4.0), "x_axis": (0.0, 1.0, 0.0),
     "y_axis": (-1.0, 0.0, 0.0)}]}
SIDES = [{"name": f"side {k}", "work_offset_code": f"G5{5 + k}", "origin": (-20.0, 7.0, 40.0), "turn": {"A": 90.0 * k},
          "measured": "turned" if k else "zero"} for k in range(2)]
CASES: dict[str, Case] = {
    **{f"flat {name}": Case(NX, "mill-3axis", c) for name, c in SIX.items()},
    **{f"helix {name}": Case(HELIX, "mill-3axis", c) for name, c in SIX.items()},
    **{f"laws {name}": Case(LAWS, "trunnion-bc", c) for name, c in SIX.items()},
    **{f"axes {name}": Case(LAWS, "trunnion-bc", c, options={"output": "axes"}) for name, c in SIX.items()},
    **{f"tip {name}": Case(FIVE, "trunnion-bc", SIX[name], options={"output": "tcp"}) for name in MODES},
    **{f"cycles {name}": Case(CYCLES, "trunnion-bc", SIX[name]) for name in MODES},
    **{f"five {name}": Case(FIVE, "mikron-ucp710", c) for name, c in SIX.items()},
    **{f"faces {name}": Case(FACES, "trunnion-bc", c) for name, c in SIX.items()},
    **{f"tall {name}": Case(TALL, "mill-3axis", SIX[name], {"tools": LENGTHS, "part": {"origin": (37.0, -23.0, 11.0)}})
       for name in ("linuxcnc", "iso", "fanuc", "heidenhain")},
    **{f"rests {name}": Case(RESTS, "mill-3axis", c) for name, c in SIX.items()},
    **{f"side {name}": Case(SIDE, "mill-3axis", c) for name, c in SIX.items()},
    **{f"contour {name}": Case(ROUNDED, "mill-3axis", SIX[name],
                               {"tools": {"1": {"gauge_length": 90.0, "compensation": "radius"}}})
       for name in ("siemens", "heidenhain")},
    **{f"cooled {name}": Case(COOLED, "mill-3axis", SIX[name]) for name in ("haas", "siemens", "linuxcnc")},
    "chosen axes": Case(BALLS, "mikron-ucp710", "fanuc-30i", options={"orient": "auto"}),
    "measured": Case(MILLED, "mikron-ucp710", "linuxcnc", {**TURNED, "output": {"tool_call": False}}),
    "offset": Case(NX, "mill-3axis", "fanuc-30i", {**TURNED, "work_offset_code": "G56"}),
    "long link": Case(SAMPLES / "five_faces.cls", "mikron-ucp710", "linuxcnc"),
    "far": Case(NX, "mill-3axis", "linuxcnc", {"tools": LENGTHS, "part": {"origin": (-492.0, 0.0, 0.0)}}),
    "far arc": Case(HELIX, "mill-3axis", "linuxcnc", {"tools": LENGTHS, "part": {"origin": (-475.0, 0.0, 0.0)}}),
    "far tip": Case(FIVE, "trunnion-bc", "siemens-840d", {"tools": LENGTHS, "part": {"origin": (495.0, 0.0, 0.0)}},
                    {"output": "tcp"}),
    "far rods": Case(MILLED, "uranesx", "linuxcnc", {**ON_DELTA, "part": {"origin": (12.0, -7.0, -560.0)}}),
    "milled": Case(MILLED, "mill-3axis", "linuxcnc"),
    "per turn": Case(PER_TURN, "mill-3axis", "fanuc-30i"),
    "timed": Case(TIMED, "mill-3axis", "linuxcnc"),
    "inch": Case(INCH, "mill-3axis", "linuxcnc"),
    "inch siemens": Case(INCH.replace("LOADTL/1,2", "LOADTL/1"), "mill-3axis", "siemens-840d"),
    "creo": Case(CREO, "mikron-ucp710", "linuxcnc"),
    "creo fanuc": Case(CREO, "trunnion-bc", "fanuc-30i"),
    "catia": Case(CATIA, "mikron-ucp710", "linuxcnc"),
    "contact": Case(CONTACT, "mill-3axis", "fanuc-30i"),
    "contact linuxcnc": Case(CONTACT, "mill-3axis", "linuxcnc"),
    "solidworks": Case(SAMPLES / "dialects" / "solidworks.apt", "mikron-ucp710", "linuxcnc"),
    "ncl": Case(SAMPLES / "dialects" / "ncl.as", "mikron-ucp710", "linuxcnc"),
    "leaning": Case(MILLED, "mikron-ucp710", "linuxcnc", LEANING),
    "system": Case(NX, "mikron-ucp710", "linuxcnc", {"tools": LENGTHS, "part": {
        "system": True, "origin": (13.0, -20.0, 15.0), "x_axis": (0.6, 0.8, 0.0), "y_axis": (-0.8, 0.6, 0.0)}}),
    "head-table": Case(FIVE, "head-table", "generic-iso"),
    "fork": Case(FIVE, "fork-head-ab", "linuxcnc"),
    "nutating": Case(FIVE, "nutating-head", "linuxcnc"),
    "four axes": Case(SAMPLES / "indexed_4axis.cls", "mill-4axis", "fanuc-30i", {"tools": {
        **LENGTHS, "4": {"gauge_length": 111.0}, "5": {"gauge_length": 77.0}}, "part": {"origin": (3.0, 0.0, 0.0)}}),
    "delta": Case(MILLED, "uranesx", "linuxcnc", ON_DELTA),
    "rods": Case(MILLED, "h4a-c-table", "linuxcnc", ON_RODS),
    "rods leaning": Case(FIVE, "h4a-c-table", "linuxcnc", ON_RODS),
    "hexapod": Case(FIVE, "hexapod", "linuxcnc", ON_DELTA),
    "hexaslide": Case(MILLED, "hexaslide-cone", "linuxcnc", ON_DELTA),
    "planar": Case(MILLED, "planar-delta-z", "linuxcnc", ON_DELTA),
    "errors": Case(SHORT, "mikron-ucp710", "linuxcnc", options=ERRORS),
    "errors flat": Case(NX, "mikron-ucp710", "siemens-840d", options=ERRORS),
    "errors laws": Case(LAWS, "mikron-ucp710", "siemens-840d", options=ERRORS),
    "per minute": Case(FIVE, "mikron-ucp710", "linuxcnc", options={"feed_mode": "per-minute"}),
    "fast": Case(FAST, "mikron-ucp710", "linuxcnc"),
    "fast planned": Case(FAST, "mikron-ucp710", "linuxcnc", options={"feed": "planned"}),
    "round planned": Case(ROUND, "mikron-ucp710", "linuxcnc", options={"feed": "planned"}),
    "plane spline": Case(CURVE, "mill-3axis", "linuxcnc", TURNED),
    "points siemens": Case(CURVE, str(Path(__file__).with_name("curves_by_points.toml")), SIX["siemens"], TURNED),
    **{f"curves {name}": Case(CURVE, str(Path(__file__).with_name("curves_bought.toml")), SIX[name], TURNED)
       for name in ("siemens", "heidenhain")},
    "loose": Case(FIVE, "mikron-ucp710", "linuxcnc", options={"tolerance": 0.5}),
    "whole circle": Case(HELIX.replace("GOTO/-40,30,-8\n", ""), "mill-3axis", "linuxcnc"),
    "kept spindle": Case(FACES.replace("SPINDL/RPM,2000,CLW\n", ""), "trunnion-bc", "linuxcnc"),
    "planned": Case(FIVE, "mikron-ucp710", "linuxcnc", options={"feed": "planned"}),
    "smooth": Case(SHORT, "mikron-ucp710", "linuxcnc", options={"smooth": True}),
    **{f"{kind} {name}": Case(text, "mill-3axis", c, {**TURNED, "output": output}) for name, c in SIX.items()
       for kind, text, output in (("spline", CURVE, {}), ("inches", NX, {"units": "inch"}), ("again", NX, {"restart": True}),
                                  ("homing", CONTACT.replace(",ADJUST,7", ""), {}))},
    **{f"bare {name}": Case(text, str(Path(__file__).with_name("bare_control.toml")), SIX[name])
       for name, text in (("siemens", LAWS), ("haas", HELIX), ("fanuc", RESTS), ("heidenhain", FIVE))},
    "places fanuc": Case(MILLED + SECOND, "mill-3axis", "fanuc-30i", {**TURNED, **PLACES}),
    "places siemens": Case(FACES, "trunnion-bc", "siemens-840d", {**TURNED, **PLACES, "order": "part"}),
    "places order": Case(MILLED + SECOND, "mill-3axis", "linuxcnc", {**TURNED, **PLACES, "order": "part"}),
    "places haas": Case(WETTED, "mill-4axis", "haas-ngc", {"tools": LENGTHS, "places": SIDES}),
    "places errors": Case(FACES, "mikron-ucp710", "fanuc-30i", {**TURNED, **PLACES}, ERRORS),
    "restart": Case(NX, "mill-3axis", "fanuc-30i", {**TURNED, "output": {"restart": True}}),
    "rewind": Case(SAMPLES / "joints" / "forced_rewind.cls", "mikron-ucp710", "linuxcnc",
                   {"file": str(SAMPLES / "joints" / "forced_rewind.setup.toml")}),
    "set-up": Case(BARE, "mill-3axis", "linuxcnc", {**TURNED, "output": {
                       "spindle": {"rpm": 2500.0}, "coolant": "flood", "feed": 180.0}}),
}
LONG = 60.0
"""s that a conversion of the battery may take before it counts as endless"""
