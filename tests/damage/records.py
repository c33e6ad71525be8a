"""Files of every dialect with one record to damage, and what became of each damaged file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import has_errors
from toolpaths.toolpath import Arcs, Toolpath

NX = ("TOOL PATH/A,TOOL,M10\nTLDATA/MILL,10.0000,0.0000,75.0000,0.0000,0.0000\nMSYS/0.0000,0.0000,5.0000,1.0,0.0,0.0,0.0,1.0,0.0\n"
      "$$ centerline data\nPAINT/PATH\nLOAD/TOOL,1,ADJUST,1\nSPINDL/RPM,3000,CLW\nCOOLNT/FLOOD\nFEDRAT/MMPM,250.0000\nRAPID\n"
      "GOTO/0.0000,0.0000,5.0000,0.0,0.0,1.0\nCUTCOM/LEFT,XYPLAN\nGOTO/10.0000,0.0000,-1.0000\nPAINT/COLOR,31\n"
      "CIRCLE/0.0,0.0,-1.0,0.0,0.0,-1.0,10.0,0.03,0.5,10.0,0.0\nGOTO/0.0000,10.0000,-1.0000\nCUTCOM/OFF\nDELAY/2.5\nSTOP\n"
      "GOTO/0.0000,12.0000,-1.0000\nPAINT/TOOL,NOMORE\nEND-OF-PATH\n")
APT = ("PARTNO PLATE\nUNITS/MM\nLOADTL/12\nCUTTER/10.0,1.0\nSPINDL/3000,RPM,CLW\nCOOLNT/ON\nFEDRAT/250.0,MMPM\nFROM/0.0,0.0,50.0\n"
       "RAPID\nGOTO/0.0,0.0,5.0\nGOTO/10.0,0.0,-1.0\nGODLTA/0.0,0.0,-5.0\nGODLTA/7.5\nCYCLE/DRILL,FEDTO,12.0,MMPM,120.0,RAPTO,3.0,"
       "RTRCTO,20.0\nGOTO/30.0,5.0,0.0\nCYCLE/OFF\nOPSTOP\nAUXFUN/8\nGOTO/31.0,6.0,9.0\nFINI\n")
CREO = ("$$-> MFGNO / P\nPARTNO / P\nMACHIN / UNCX01, 1\nUNITS / MM\n$$-> FEATNO / 10\nLOADTL / 1, OSETNO, 1\n$$-> CUTTER / 10.500000\n"
        "$$-> CSYS / 1.0, 0.0, 0.0, 0.0,  $\n 0.0, 1.0, 0.0, 0.0,  $\n 0.0, 0.0, 1.0, 7.0\nSPINDL / RPM, 3000.0,  CLW\nMULTAX / ON\n"
        "FEDRAT / 250.0,  MMPM\nRAPID\nGOTO / 10.0, 0.0, 50.0, $\n 0.0, 0.0, 1.0\nGOTO / 10.0, 0.0, 5.0, $\n 0.0, 0.0, 1.0\n"
        "CIRCLE / 0.0, 0.0, 5.0, $\n0.0, 0.0, 1.0, 10.0\nGOTO / 0.0, 10.0, 5.0, $\n 0.0, 0.0, 1.0\n$$-> END /\nFINI\n")
INDEXED = ("$$-> MFGNO / P\nUNITS / MM\nDEFSUB / 1\nFEDRAT / 250.0,  MMPM\nGOTO / 0.0, 0.0, 2.0\nENDSUB\nLOADTL / 1\n"
           "ROTATE / AAXIS, INCR, -90.000, CCLW\nRAPID\nGOTO / 0.0, 0.0, 9.0\nTRANS / 0.0, 0.0, 20.0\nCALSUB / 1\nTRANS / 0.0, 0.0, 0.0\n"
           "FINI\n")
SOLIDWORKS = ("PARTNO/1\nMACHIN/PWORKS,0\nUNIT/MM\nSETUP/START,1\nCUTTER/10.,0,5.,0,0,0,75.\nLOAD/TOOL,1\nTRNTYP/WORLD,0,0,0\n"
              "CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0\nSPINDL/3000,RPM,CLW\nRAPID/\nGOTO/10.,0,50.\nFEDRAT/250.,MMPM\nGOTO/10.,0,-3.\n"
              "CIRCLE/0,0,-3.,0,0,1.\nGOTO/0,10.,-3.\nCUTCOM/OFF\nFINI\n")
CATIA = ("$$*CATIA0\n$$ Program.1\n$$     1.00000    0.00000    0.00000   10.00000\n$$     0.00000    1.00000    0.00000    0.00000\n"
         "$$     0.00000    0.00000    1.00000    0.00000\nPARTNO SAMPLE\n$$ OPERATION NAME : POCKET\nTPRINT/MILL,MILL,MILL\nLOADTL/1\n"
         "MULTAX\nSPINDL/ 3000.0,RPM,CLW\nFEDRAT/ 250.0,MMPM\nRAPID\nGOTO  /    10.00000,    0.00000,   50.00000, 0.0, 0.0, 1.0\n"
         "TLAXIS/ 0.0,0.0,1.0\nGOTO  /    20.00000,    0.00000,   -3.00000\nFINI\n")
FILES = {"nx": NX, "apt": APT, "creo": CREO, "indexed": INDEXED, "solidworks": SOLIDWORKS, "catia": CATIA}
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
            yield Record(f"{name}: {first[:24]}", text.encode(), at, at + len(record), first.startswith(LEFT_OUT))
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
    """All of a toolpath but its numbers and names."""
    return (len(p), p.kind.tolist(), p.role.tolist(), p.arc.tolist(), p.pass_.tolist(), np.isfinite(p.feed).tolist(),
            p.feed_mode.tolist(), _arcs(p.arcs), [(e.index, e.word, tuple(v if isinstance(v, str) else 0.0 for v in e.values))
                                                  for e in p.events if e.word not in ("PPRINT", "INSERT")],
            [(c.kind, c.retract is None, len(c.steps)) for c in p.cycles], len(p.operations), len(p.tools),
            [(t.shape, t.diameter is None, t.corner_radius is None, len(t.cutter), t.length_register is None) for t in p.tools],
            len(p.frames), p.units)


def _arcs(a: Arcs) -> list[object]:
    return [bool(s > np.pi) for s in a.sweep]


def read(data: bytes) -> ReadResult:
    """The file read, as from a disk."""
    return read_bytes(data, file="damaged.cl")
