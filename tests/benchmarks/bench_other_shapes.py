"""Set-ups by `setup new --yes` for files in the shapes of sixteen systems: plane, five axes, from the side, far off.

    python tests/benchmarks/bench_other_shapes.py [MACHINE CONTROLLER]

Of nine of these systems (PowerMILL to RhinoCAM) no file was at hand: their words are those of ISO 4343 in several spellings.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import machines
import postproc
import toolpaths
from postproc.base.options import Options
from postproc.setup_sheet.make import new_setup
from postproc.setup_sheet.questions import GivenAnswers

Row = tuple[float, ...]


@dataclass(frozen=True)
class Spelling:
    """How a system writes a file; lines of `head` and `end` are parted by |."""

    name: str
    head: str
    tool: str
    spindle: str
    coolant: str
    feed: str
    goto: str = "GOTO/"
    end: str = "FINI"


_CATIA = ("$$*CATIA0|$$ Program.1|$$ 1.0 0.0 0.0 0.0|$$ 0.0 1.0 0.0 0.0|$$ 0.0 0.0 1.0 0.0|PARTNO Part|"
          "$$ OPERATION NAME : M.1|MULTAX")
_CREO = "$$-> MFGNO / MFG0001|PARTNO / MFG0001|$$-> FEATNO / 42|MACHIN / UNCX01, 1|UNITS / MM"
_NX = ("TOOL PATH/MILL,TOOL,MILL_10|TLDATA/MILL,10.0,1.0,75.0,0.0,0.0|"
       "MSYS/0.0,0.0,0.0,1.0,0.0,0.0,0.0,1.0,0.0|$$ centerline data|PAINT/PATH|PAINT/SPEED,10")
_MM = "|UNITS/MM|MULTAX/ON"
SPELLINGS = (
    Spelling("powermill", "PARTNO/P" + _MM, "LOADTL/3,LENGTH,120.0", "SPINDL/RPM,6000,CLW", "COOLNT/FLOOD",
             "FEDRAT/MMPM,1200"),
    Spelling("hypermill", "PARTNO/J" + _MM, "LOADTL/5", "SPINDL/8000,RPM,CLW", "COOLNT/ON", "FEDRAT/900,MMPM", "GOTO/ "),
    Spelling("cimatron", "PARTNO C" + _MM, "LOADTL/ 2", "SPINDL/ 5000, CLW", "COOLNT/ ON", "FEDRAT/ 800", "GOTO/ "),
    Spelling("topsolid", "PARTNO/T" + _MM, "LOADTL/7,1", "SPINDL/RPM,4500,CLW", "COOLNT/FLOOD", "FEDRAT/MMPM,750"),
    Spelling("solidcam", "PARTNO/S" + _MM, "LOADTL/1", "SPINDL/RPM,3000,CLW", "COOLNT/ON", "FEDRAT/500,MMPM", "GOTO / "),
    Spelling("esprit", "MACHIN/E,1" + _MM, "LOADTL/4,ADJUST,4", "SPINDL/RPM,7000,CLW", "COOLNT/FLOOD", "FEDRAT/MMPM,600"),
    Spelling("gibbscam", "PARTNO/G" + _MM, "LOADTL/6,LENGTH,6", "SPINDL/RPM,5500,CLW", "COOLNT/MIST", "FEDRAT/MMPM,450"),
    Spelling("bobcad", "PARTNO B" + _MM, "LOADTL/9", "SPINDL/RPM,3500,CLW", "COOLNT/FLOOD", "FEDRAT/MMPM,500"),
    Spelling("rhinocam", "PARTNO/R" + _MM, "LOADTL/1,OSETNO,1", "SPINDL/9000,RPM,CLW", "COOLNT/OFF", "FEDRAT/2000,MMPM"),
    Spelling("nx", _NX, "LOADTL/1", "SPINDL/RPM,4000,CLW", "COOLNT/ON", "FEDRAT/MMPM,250.0",
             end="PAINT/TOOL,NOMORE|END-OF-PATH"),
    Spelling("creo", _CREO, "LOADTL / 1", "SPINDL / RPM, 2500.0,  CLW", "COOLNT / ON", "FEDRAT / 300.0,  MMPM", "GOTO / "),
    Spelling("catia", _CATIA, "LOADTL/2,1", "SPINDL/ 3000.0,RPM,CLW", "COOLNT/ON", "FEDRAT/ 1000.0,MMPM", "GOTO  / "),
    Spelling("mastercam", "MACHIN/MILL,1" + _MM, "LOADTL/239,LENGTH,0,OSETNO,239", "SPINDL/1069.,RPM,CLW", "COOLNT/OFF",
             "FEDRAT/64.2,MMPM"),
    Spelling("surfcam", "PARTNO/S" + _MM, "LOADTL/8", "SPINDL/RPM,2000,CLW", "COOLNT/ON", "FEDRAT/200.0,MMPM"),
    Spelling("ncl", "PARTNO N" + _MM, "LOADTL/1,LENGTH,100.0", "SPINDL/RPM,3000.0,CLW", "COOLNT/FLOOD", "FEDRAT/MMPM,400.0"),
    Spelling("iso4343", "PARTNO I" + _MM, "LOADTL/10", "SPINDL/RPM,1500,CLW", "COOLNT/FLOOD", "FEDRAT/PERMIN,350"),
)


def _arc() -> list[Row]:
    """Half a ring about z, the tool leant outwards by 25 degrees."""
    lean, turns = math.radians(25.0), [math.pi * k / 8 for k in range(9)]
    return [(25.0 * math.cos(a), 25.0 * math.sin(a), 20.0, math.sin(lean) * math.cos(a), math.sin(lean) * math.sin(a),
             math.cos(lean)) for a in turns]


def _above(row: Row) -> Row:
    return (*(row[k] + 30.0 * row[k + 3] for k in range(3)), *row[3:])


_ARC = _arc()
KINDS: dict[str, tuple[tuple[str, ...], list[Row], list[Row], list[Row]]] = {
    "plane": ((), [(0, 0, 50), (0, 0, 12)], [(0, 0, 10), (40, 0, 10), (40, 30, 10), (0, 30, 10), (0, 0, 10)],
              [(0, 0, 50)]),
    "five axes, bare": (("tool", "spindle", "coolant", "units"), [(0, 0, 80, 0, 0, 1), _above(_ARC[0])], _ARC,
                        [_above(_ARC[-1])]),
    "from the side": (("spindle",), [(0, -80, 10, 0, -1, 0)],
                      [(x, -20, z, 0, -1, 0) for x, z in ((0, 10), (30, 10), (30, 20))], [(30, -80, 20, 0, -1, 0)]),
    "far off": (("feed", "coolant"), [(812.5, -333, 190)], [(812.5, -333, 140), (862.5, -333, 140), (862.5, -313, 140)],
                [(812.5, -333, 190)]),
}
"""what the file lacks, rapids, cuts, rapids behind them: mm, and tool axes"""


def lines(one: Spelling, kind: str) -> Iterator[str]:
    """The file of a system."""
    lacks, before, cuts, after = KINDS[kind]
    yield from (text for text in one.head.split("|") if "units" not in lacks or not text.startswith("UNITS"))
    for name, text in (("tool", one.tool), ("spindle", one.spindle), ("coolant", one.coolant)):
        if name not in lacks:
            yield text
    for rows, feed in ((before, False), (cuts, True), (after, False)):
        if feed and "feed" not in lacks:
            yield one.feed
        for row in rows:
            yield from [] if feed else ["RAPID"]
            yield one.goto + ",".join(f" {v:.5f}" for v in row)
    yield from one.end.split("|")


def main() -> None:
    name, controller = sys.argv[1:3] if len(sys.argv) > 2 else ("mikron-ucp710", "fanuc-30i")
    machine, before, after, questions = machines.load(name), 0, 0, 0
    for one in SPELLINGS:
        for kind in KINDS:
            path, found = toolpaths.read_bytes("\n".join([*lines(one, kind), ""]), file=f"{one.name}.apt")
            before += postproc.convert(path, machine, controller, diagnostics=list(found)).ok
            sheet = new_setup(path, machine, controller, Options(), GivenAnswers(), None, True, found)
            after, questions = after + bool(sheet.text), questions + len(sheet.questions)
            if not sheet.text:
                print(f"{one.name}, {kind}: {next(str(d) for d in sheet.diagnostics if d.severity.name == 'ERROR')}")
    print(f"{len(SPELLINGS) * len(KINDS)} files on {name}, {controller}: {before} at first, {after} with setup new --yes; "
          f"{questions} questions")


if __name__ == "__main__":
    main()
