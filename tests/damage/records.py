"""Files of every dialect with one record to damage, and what became of each damaged file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from toolpaths.arrays import Bools
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import has_errors
from toolpaths.toolpath import Role, Toolpath

NX = """\
TOOL PATH/A,TOOL,M10
TLDATA/MILL,10.0000,0.0000,75.0000,0.0000,0.0000
MSYS/0.0000,0.0000,5.0000,1.0,0.0,0.0,0.0,1.0,0.0
$$ centerline data
PAINT/PATH
LOAD/TOOL,1,ADJUST,1
SPINDL/RPM,3000,CLW
COOLNT/FLOOD
FEDRAT/MMPM,250.0000
RAPID
GOTO/0.0000,0.0000,5.0000,0.0,0.0,1.0
CUTCOM/LEFT,XYPLAN
GOTO/10.0000,0.0000,-1.0000
PAINT/COLOR,31
CIRCLE/0.0,0.0,-1.0,0.0,0.0,-1.0,10.0,0.03,0.5,10.0,0.0
GOTO/0.0000,10.0000,-1.0000
CUTCOM/OFF
DELAY/2.5
STOP
OPSTOP/CHECK THE BORE
GOTO/0.0000,12.0000,-1.0000
PAINT/TOOL,NOMORE
END-OF-PATH
"""
APT = """\
PARTNO PLATE
UNITS/MM
LOADTL/12
CUTTER/10.0,1.0
SPINDL/3000,RPM,CLW
COOLNT/ON
FEDRAT/250.0,MMPM
FROM/0.0,0.0,50.0
RAPID
GOTO/0.0,0.0,5.0
GOTO/10.0,0.0,-1.0
GODLTA/0.0,0.0,-5.0
GODLTA/7.5
CYCLE/DRILL,FEDTO,12.0,MMPM,120.0,RAPTO,3.0,RTRCTO,20.0
GOTO/30.0,5.0,0.0
CYCLE/OFF
OPSTOP
AUXFUN/8
GOTO/31.0,6.0,9.0
FINI
"""
CREO = """\
$$-> MFGNO / P
PARTNO / P
MACHIN / UNCX01, 1
UNITS / MM
$$-> FEATNO / 10
LOADTL / 1, OSETNO, 1
$$-> CUTTER / 10.500000
$$-> CSYS / 1.0, 0.0, 0.0, 0.0,  $
 0.0, 1.0, 0.0, 0.0,  $
 0.0, 0.0, 1.0, 7.0
SPINDL / RPM, 3000.0,  CLW
MULTAX / ON
FEDRAT / 250.0,  MMPM
RAPID
GOTO / 10.0, 0.0, 50.0, $
 0.0, 0.0, 1.0
GOTO / 10.0, 0.0, 5.0, $
 0.0, 0.0, 1.0
CIRCLE / 0.0, 0.0, 5.0, $
0.0, 0.0, 1.0, 10.0
GOTO / 0.0, 10.0, 5.0, $
 0.0, 0.0, 1.0
$$-> END /
FINI
"""
INDEXED = """\
$$-> MFGNO / P
UNITS / MM
DEFSUB / 1
FEDRAT / 250.0,  MMPM
GOTO / 0.0, 0.0, 2.0
ENDSUB
LOADTL / 1
ROTATE / AAXIS, INCR, -90.000, CCLW
RAPID
GOTO / 0.0, 0.0, 9.0
TRANS / 0.0, 0.0, 20.0
CALSUB / 1
TRANS / 0.0, 0.0, 0.0
FINI
"""
SOLIDWORKS = """\
PARTNO/1
MACHIN/PWORKS,0
UNIT/MM
SETUP/START,1
CUTTER/10.,0,5.,0,0,0,75.
LOAD/TOOL,1
TRNTYP/WORLD,0,0,0
CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0
SPINDL/3000,RPM,CLW
RAPID/
GOTO/10.,0,50.
FEDRAT/250.,MMPM
GOTO/10.,0,-3.
CIRCLE/0,0,-3.,0,0,1.
GOTO/0,10.,-3.
CUTCOM/OFF
FINI
"""
CATIA = """\
$$*CATIA0
$$ Program.1
$$     1.00000    0.00000    0.00000   10.00000
$$     0.00000    1.00000    0.00000    0.00000
$$     0.00000    0.00000    1.00000    0.00000
PARTNO SAMPLE
$$ OPERATION NAME : POCKET
TPRINT/MILL,MILL,MILL
LOADTL/1
MULTAX
SPINDL/ 3000.0,RPM,CLW
FEDRAT/ 250.0,MMPM
RAPID
GOTO  /    10.00000,    0.00000,   50.00000, 0.0, 0.0, 1.0
TLAXIS/ 0.0,0.0,1.0
GOTO  /    20.00000,    0.00000,   -3.00000
FINI
"""
ARCS = """\
$$*CATIA0
UNITS/MM
LOADTL/1
SPINDL/3000.0,RPM,CLW
FEDRAT/250.0,MMPM
GOTO/10.0,0.0,0.0
AUTOPS
INDIRV/0.0,1.0,0.0
TLON,GOFWD/ (CIRCLE/0.0,0.0,0.0,10.0),ON,(LINE/0.0,0.0,0.0,0.0,10.0,0.0)
GOTO/0.0,20.0,0.0
PSIS/(PLANE/(POINT/0.0,20.0,0.0),PERPTO,(VECTOR/1.0,0.0,0.0))
INDIRV/0.0,1.0,0.0
TLON,GOFWD/(CYLNDR/0.0,20.0,10.0,1.0,0.0,0.0,10.0),ON,$
(PLANE/PERPTO,(PLANE/(POINT/0.0,20.0,0.0),PERPTO,(VECTOR/1.0,0.0,0.0)),(POINT/0.0,20.0,10.0),(POINT/0.0,30.0,10.0))
GOTO/0.0,30.0,20.0
FINI
"""
SPLINE = """\
TOOL PATH/A,TOOL,M10
TLDATA/MILL,10.0000,0.0000,75.0000,0.0000,0.0000
MSYS/0.0000,0.0000,5.0000,1.0,0.0,0.0,0.0,1.0,0.0
LOAD/TOOL,1
SELECT/TOOL,2
SPINDL/RPM,3000,CLW
FEDRAT/MMPM,250.0000
GOTO/0.0000,0.0000,5.0000,0.0,0.0,1.0
NURBS/
KNOT/0.5,1.0
CNTRL/2.0,1.0,5.0
CNTRL/4.0,3.0,5.0
CNTRL/6.0,3.0,5.0
CNTRL/8.0,0.0,5.0
GOTO/9.0000,0.0000,5.0000
TLAXIS/0.6,0.0,0.8
GOTO/9.0000,3.0000,5.0000
SPINDL/OFF
GOHOME/0.0,0.0,90.0
END-OF-PATH
"""
TURNED = """\
PARTNO/ SAMPLE
UNITS/ MM
OPFEATSTART/ FACE
CUTTER/ 10.0,0.0,0.0,0.0,0.0,75.0,
TLAXIS/ 0.600000,0.000000,0.800000
LOAD/ TOOL,1
SPINDL/ 3000,RPM, CLW
COOLNT/ FLOOD
ROTABL/ 0.643501108793284,BAXIS,TABLE,CCLW
MOVE_ATTRIB/LEADIN,1
RAPID
GOTO/ 40.0,0.0,80.0
FEDRAT/ MMPM,250.0
GOTO/ 40.0,0.0,29.0
CIRCLE/ 40.0,5.0,29.0,0.0,0.0,1.0,5.0,COUNTERCLOCKWISE
GOTO/ 45.0,5.0,29.0
CYCLE/ ON
CYCLE/ DRILL,G98,12.0,MMPM,120.0,3.0,20.0 20.0 DWELL,0.0
GOTO/ 30.0,5.0,29.0
CYCLE/ OFF
ROTABL/ -0.643501108793284,BAXIS,TABLE,CCLW
OPFEATEND/
FINI
"""
FILES = {"arcs": ARCS, "spline": SPLINE, "turned": TURNED,
         "nx": NX, "apt": APT, "creo": CREO, "indexed": INDEXED, "solidworks": SOLIDWORKS, "catia": CATIA}
LEFT_OUT = ("PAINT", "$$ ", "PARTNO", "MACHIN", "SETUP", "$$-> END", "$$-> MFGNO", "TPRINT")
"""Lines that say nothing to the machine: names, display, comments."""


@dataclass(frozen=True)
class Record:
    """One record of a file: bytes `start` to `stop`, its line end included."""

    name: str
    data: bytes
    start: int
    stop: int
    free: bool


def records() -> Iterator[Record]:
    """Every record of every file, continued lines as one."""
    for name, text in FILES.items():
        at = 0
        for record in _joined(text):
            first = record.split("\n")[0]
            yield Record(f"{name}: {first[:24]}", text.encode(), at, at + len(record),
                         first.startswith(LEFT_OUT))
            at += len(record)


def _joined(text: str) -> list[str]:
    found: list[str] = []
    open_ = False
    for line in text.splitlines(keepends=True):
        if open_:
            found[-1] += line
        else:
            found.append(line)
        open_ = line.rstrip().endswith("$")
    return found


def damaged(record: Record, substitutes: bytes, inserted: bytes) -> Iterator[tuple[str, bytes]]:
    """Each single-byte change: (what was done, the file)."""
    data = record.data
    for at in range(record.start, record.stop):
        for byte in substitutes:
            if byte != data[at]:
                yield f"{at - record.start}={byte:#x}", data[:at] + bytes([byte]) + data[at + 1:]
        yield f"{at - record.start} deleted", data[:at] + data[at + 1:]
        for byte in inserted:
            yield f"{at - record.start}+{byte:#x}", data[:at] + bytes([byte]) + data[at:]


def outcome(result: ReadResult, whole: ReadResult) -> str:
    """`refused`, `same`, `value` (of the same shape), or `lost` with how it was reported."""
    if has_errors(result.diagnostics):
        return "refused"
    if result.toolpath.equals(whole.toolpath):
        return "same"
    if shape(result.toolpath) == shape(whole.toolpath):
        return "value"
    more = {str(d.code) for d in result.diagnostics} - {str(d.code) for d in whole.diagnostics}
    return "lost with a warning" if more else "lost in silence"


def shape(p: Toolpath) -> object:
    """All of a toolpath but its numbers and names; a spline is its end, however many pieces follow it."""
    within = np.isin(p.role, (Role.SPLINE, Role.CUBIC))
    kept = ~(within | np.append(False, within[:-1]))
    rows = [column[kept].tolist() for column in (p.kind, p.role, p.arc >= 0, p.pass_, np.isfinite(p.feed), p.feed_mode)]
    splines = int((within[:-1] > within[1:]).sum())
    number = np.cumsum(np.append(0, kept))
    events = [(int(number[e.index]), e.word, tuple(v if isinstance(v, str) else 0.0 for v in e.values)) for e in p.events
              if e.word not in ("PPRINT", "INSERT")]
    tools = [(t.shape, t.diameter is None, t.corner_radius is None, len(t.cutter), t.length_register is None)
             for t in p.tools]
    cycles = [(c.kind, c.retract is None, len(c.steps)) for c in p.cycles]
    return splines, rows, events, tools, cycles, _arcs(p, kept), len(p.operations), len(p.frames), p.units


def _arcs(p: Toolpath, kept: Bools) -> list[object]:
    return [bool(p.arcs.sweep[a] > np.pi) for a in p.arc[kept] if a >= 0]


def read(data: bytes) -> ReadResult:
    """The file read, as from a disk."""
    return read_bytes(data, file="damaged.cl")
