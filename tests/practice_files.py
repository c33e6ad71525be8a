"""Practice files: small CL files in the shape of each CAM system, each lacking what files of shops lack.

A file is a shape (how a system writes heads, tools, feeds, points) and what is left out or stands elsewhere. The path is
the same in all: a slot with a step down, in rapids and cuts, and back above the part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

CASES = {
    "complete": frozenset[str](),
    "no tool number": frozenset({"number"}),
    "no spindle": frozenset({"spindle"}),
    "no feed": frozenset({"feed"}),
    "no units": frozenset({"units"}),
    "nothing but points": frozenset({"number", "spindle", "feed", "units", "coolant"}),
    "far off": frozenset({"far"}),
    "far off and bare": frozenset({"far", "number", "spindle", "feed", "coolant"}),
    "two tools of one number": frozenset({"same"}),
    "from the side": frozenset({"side"}),
    "from below": frozenset({"below", "spindle"}),
}
"""what is missing or other than a machine takes as it is"""
_SLOT = ((True, 0.0, 0.0, 20.0), (True, 0.0, 0.0, 2.0), (False, 0.0, 0.0, -1.0), (False, 30.0, 0.0, -1.0),
         (False, 30.0, 20.0, -2.0), (False, 0.0, 20.0, -2.0), (True, 0.0, 20.0, 20.0))
"""(rapid, x, y, z), mm, the tool along z"""
FAR = np.array([900.0, -700.0, 400.0])
"""mm"""
_TURNS = {"side": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]), "below": np.diag([1.0, -1.0, -1.0])}


@dataclass(frozen=True)
class Shape:
    """How a system writes: each function gives lines; a number is None where the file leaves it out."""

    name: str
    ending: str
    units: list[str]
    head: list[str]
    tool: Callable[[str, int | None], list[str]]
    spindle: str
    feed: str
    coolant: str
    goto: str
    vector: bool
    """points carry their tool axis"""
    rapid: str = "RAPID"
    tail: list[str] = field(default_factory=lambda: ["FINI"])


def _size(name: str) -> str:
    """Diameter of a tool by its name, mm."""
    return "8" if name == "EM8" else "10"


def _points(form: str, vector: bool) -> Callable[[np.ndarray, np.ndarray], str]:
    count = 6 if vector else 3
    return lambda tip, axis: "GOTO" + form + ",".join(f"{v:.5f}" for v in (*tip, *axis)[:count])


SHAPES = (
    Shape("nx", "cls", ["UNITS/MM"], ["TOOL PATH/SLOT,TOOL,EM10"],
          lambda name, n: [f"TLDATA/MILL,{'8' if name == 'EM8' else '10'}.0000,0.0000,75.0000,0.0000,0.0000",
                           "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000",
                           "$$ centerline data", "PAINT/PATH", f"LOAD/TOOL,{n or 0}"],
          "SPINDL/RPM,3000,CLW", "FEDRAT/MMPM,250.0000", "COOLNT/FLOOD", "/", True,
          tail=["PAINT/TOOL,NOMORE", "END-OF-PATH"]),
    Shape("catia", "aptsource", ["UNITS/MM"], ["$$*CATIA0", "$$ Manufacturing Program.1",
          "$$     1.00000    0.00000    0.00000    0.00000", "$$     0.00000    1.00000    0.00000    0.00000",
          "$$     0.00000    0.00000    1.00000    0.00000", "PARTNO SLOT", "$$ OPERATION NAME : SLOT"],
          lambda name, n: [f"CUTTER/ {'8' if name == 'EM8' else '10'}.000000,0.000000,5.000000,0.000000,  0.000000,$",
                           "         0.000000, 75.000000", f"TPRINT/{name},{name},{name}", *([f"LOADTL/{n}"] if n else []),
                           "MULTAX"],
          "SPINDL/ 3000.0000,RPM,CLW", "FEDRAT/ 250.0000,MMPM", "COOLNT/FLOOD", "  / ", True),
    Shape("creo", "ncl", ["UNITS / MM"], ["$$-> MFGNO / SLOT", "PARTNO / SLOT", "MACHIN / UNCX01, 1", "$$-> FEATNO / 105"],
          lambda name, n: [*([f"LOADTL / {n}"] if n else []), f"$$-> CUTTER / {'8' if name == 'EM8' else '10'}.000000",
                           "$$-> CSYS / 1.0000000000, 0.0000000000, 0.0000000000, 0.0000000000,  $",
                           "	    0.0000000000, 1.0000000000, 0.0000000000, 0.0000000000,  $",
                           "	    0.0000000000, 0.0000000000, 1.0000000000, 0.0000000000", "MULTAX / ON"],
          "SPINDL / RPM, 3000.000000,  CLW", "FEDRAT / 250.000000,  MMPM", "COOLNT / FLOOD", " / ", True),
    Shape("solidworks", "apt", ["UNIT/MM"], ["PARTNO/1", "MACHIN/PWORKS,0", "SETUP/START,1"],
          lambda name, n: [f"CUTTER/{'8' if name == 'EM8' else '10'}.,0,5.,0,0,0,75.", "CSI_SET_FLUTE_LENGTH/75.",
                           *([f"LOAD/TOOL,{n}"] if n else []), "TRNTYP/WORLD,0,0,0", "CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0",
                           f"INSERT/[HOLDER=C40] {name}"],
          "SPINDL/3000,RPM,CLW", "FEDRAT/250.,MMPM", "COOLNT/FLOOD", "/", True, rapid="RAPID/",
          tail=["SETUP/END,1", "FINI"]),
    Shape("mastercam", "apt", ["UNITS/MM"], ["PARTNO SLOT", "PPRINT/SLOT", "MACHIN/MILL,1"],
          lambda name, n: [f"CUTTER/{'8' if name == 'EM8' else '10'}.,0.", *([f"LOADTL/{n}"] if n else []), "MULTAX/ON"],
          "SPINDL/3000.,RPM,CLW", "FEDRAT/250.,MMPM", "COOLNT/FLOOD", "/", True),
    Shape("ncl", "as", ["UNITS/MM"], ["PARTNO SLOT".ljust(72), "MULTAX/ON", "PPRINT SLOT"],
          lambda name, n: [*([f"LOADTL/{n},LENGTH,    75.0000"] if n else []),
                           f"CUTTER/    {'8' if name == 'EM8' else '10'}.0000,     0.0000,    75.0000"],
          "SPINDL/RPM,    3000.0000,CLW", "FEDRAT/MMPM,   250.0000", "COOLNT/FLOOD", "  / ", True),
    Shape("surfcam", "apt", ["UNITS/MM"], ["PARTNO/SLOT", "REMARK SLOT"],
          lambda name, n: [*([f"LOADTL/{n},OSETNO,{n}"] if n else []), f"CUTTER/{'8' if name == 'EM8' else '10'}.0,0.0"],
          "SPINDL/RPM,3000,CLW", "FEDRAT/250.0,MMPM", "COOLNT/ON", "/", True),
    Shape("fusion", "apt", ["UNITS/MM"], ["PARTNO/SLOT", "MULTAX/ON", "PPRINT/SLOT"],
          lambda name, n: [f"CUTTER/{'8' if name == 'EM8' else '10'},0,5,0,0,0,75",
                           *([f"LOADTL/{n},IN,1,LENGTH,75,OSETNO,{n}"] if n else [])],
          "SPINDL/RPM,3000,CLW", "FEDRAT/MMPM,250", "COOLNT/FLOOD", "/", True),
    Shape("makino", "cls", ["UNITS/MM"], ["PARTNO/MAKINO-FF", "MULTAX/ON"],
          lambda name, n: [f"TPRINT/{name}", f"TLDATA/MILL,{_size(name)}.0,0.0,75.0,0.0,0.0",
                           *([f"LOAD/TOOL,{n}"] if n else [])],
          "SPINDL/RPM,3000,CLW", "FEDRAT/MMPM,250.0", "COOLNT/FLOOD", "/", True),
    Shape("camplete", "apt", ["UNITS/MM"], ["PARTNO/'slot'", "MODE/MILL", "MCS/1,0,0,0,1,0,0,0,1,0,0,0", "MULTAX/ON"],
          lambda name, n: [f"CUTTER/{_size(name)}.0,0.0", "CSI_SET_FLUTE_LENGTH/40.0",
                           *([f"LOADTL/{n}, 0, 75.0, {n}"] if n else [])],
          "SPINDL/RPM, 3000, CLW", "FEDRAT/250.0, MMPM", "COOLNT/FLOOD", "/", True),
    Shape("mfgsuite", "apt", ["UNITS/ MM"], ["PARTNO/ 'slot'", "BEGIN", "OPNAME/ 'Slot'", "APPLY/ MILL",
                                             "MCSYS/ NUM, 1, POINT, 0, 0, 0, VECTOR, 1, 0, 0, VECTOR, 0, 1, 0",
                                             "MULTAX/ ON"],
          lambda name, n: [f"TPRINT/ {name}", f"CUTTER/ {_size(name)}.0, 0.0", *([f"TOOLNO/ {n}, MILL, OSETNO, {n}, 9",
                                                             f"LOAD/ TOOL, {n}, '{name}', NEXTTL, 1"] if n else [])],
          "SPINDL/ RPM, 3000, CLW", "FEDRAT/ 250, MMPM", "COOLNT/ FLOOD", "/ ", True, tail=["END/"]),
    Shape("autodesk-iso", "apt", ["UNITS/MM"], ["PARTNO/'slot'", "MODE/MILL", "PPRINT/'slot'", "MULTAX/ON"],
          lambda name, n: [f"CUTTER/{_size(name)}.0, 0.0", *([f"LOADTL/{n}, 0, 75.0, {n}"] if n else [])],
          "SPINDL/RPM, 3000, CLW", "FEDRAT/250.0, MMPM", "COOLNT/FLOOD", "/", True, tail=["END", "FINI"]),
    Shape("hsmworks", "apt", ["UNITS/MM"], ["PARTNO/'slot'", "MULTAX/ON"],
          lambda name, n: [f"CUTTER/{_size(name)}, 0", *([f"LOADTL/{n}, IN, 0, LENGTH, 75, OSETNO, {n}"] if n else [])],
          "SPINDL/RPM, 3000, CLW", "FEDRAT/250, MMPM", "COOLNT/FLOOD", "/", True, tail=["END", "FINI"]),
)


def practice_file(shape: Shape, lacks: frozenset[str]) -> str:
    """The text of a file."""
    turn = next((m for name, m in _TURNS.items() if name in lacks), np.eye(3))
    shift = FAR if "far" in lacks else np.zeros(3)
    point = _points(shape.goto, shape.vector)
    lines = [] if "units" in lacks else list(shape.units)
    lines = [*shape.head[:1], *lines, *shape.head[1:]] if shape.name != "nx" else [*lines, *shape.head]
    for name in ("EM10", "EM8") if "same" in lacks else ("EM10",):
        if name == "EM8" and shape.name == "nx":
            lines += ["END-OF-PATH", "TOOL PATH/FINISH,TOOL,EM8"]
        lines += shape.tool(name, None if "number" in lacks else 1)
        lines += [] if "spindle" in lacks else [shape.spindle]
        lines += [] if "coolant" in lacks else [shape.coolant]
        feed = "feed" not in lacks
        for rapid, *place in _SLOT:
            if rapid:
                lines.append(shape.rapid)
            elif feed:
                lines.append(shape.feed)
                feed = False
            lines.append(point(turn @ np.array(place) + shift, turn[:, 2]))
    return "\n".join([*lines, *shape.tail]) + "\n"
