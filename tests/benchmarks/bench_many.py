"""How the time of a conversion grows with the number of records that are not points: tool changes, cycles, stops, frames.

    python tests/benchmarks/bench_many.py [N] [KIND ...]

Prints processor seconds for N and 4 N of each kind, and the exponent between them (1: in proportion). N is 5000.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import toolpaths
from postproc.pipeline.convert import convert
from postproc.setup.model import SetupFile

HEAD = "UNITS/MM\nLOAD/TOOL,1\nSPINDL/RPM,3000,CLW\nFEDRAT/MMPM,500\n"
CUT = "RAPID\nGOTO/{x},{y},20\nFEDRAT/MMPM,500\nGOTO/{x},{y},-1\nGOTO/{x1},{y},-1\nRAPID\nGOTO/{x},{y},20\n"
UP = "RAPID\nGOTO/{x},{y},20\n"
KINDS: dict[str, str] = {
    "tool changes": "LOAD/TOOL,{tool}\nSPINDL/RPM,3000,CLW\nCOOLNT/ON\n" + CUT,
    "operations": "TOOL PATH/OP_{k},TOOL,EM1\nTLDATA/MILL,10,0,75,0,0\nMSYS/0,0,0,1,0,0,0,1,0\n" + CUT + "END-OF-PATH\n",
    "cycles": UP + "CYCLE/DRILL,DEPTH,{deep},MMPM,200,CLEAR,3\nGOTO/{x},{y},0\nCYCLE/OFF\n" + UP,
    "stops": UP + "STOP\nSPINDL/RPM,3000,CLW\nGOTO/{x},{y},-1\n" + UP,
    "frames": "$$-> CSYS / 1, 0, 0, {deep}, $\n 0, 1, 0, 0, $\n 0, 0, 1, 0\n" + UP + "GOTO/{x},{y},1\n" + UP,
    "subprogram calls": UP + "CALSUB/PECK\n",
    "subprograms": "DEFSUB/S{k}\nGODLTA/0,0,-5\nGODLTA/0,0,5\nENDSUB\n" + UP + "CALSUB/S{k}\n",
    "comments": "PPRINT/LINE {k}\n$$ remark {k}\nGOTO/{x},{y},5\n",
}
PECK = "DEFSUB/PECK\nGODLTA/0,0,-5\nGODLTA/0,0,5\nENDSUB\n"


def text_of(kind: str, count: int) -> str:
    """A CL file with `count` records of a kind."""
    body = KINDS[kind]
    parts = [body.format(k=k, x=k * 37 % 1000 / 10, x1=k * 37 % 1000 / 10 + 1, y=k * 11 % 800 / 10, tool=1 + k % 20,
                         deep=3 + k % 5) for k in range(count)]
    return HEAD + (PECK if "PECK" in body else "") + "GOTO/0,0,20\n" + "".join(parts) + "FINI\n"


def seconds_of(kind: str, count: int, machine: str = "mill-3axis", controller: str = "linuxcnc") -> float:
    """Processor time of reading and converting a file."""
    text = text_of(kind, count)
    setup = SetupFile.model_validate({"tools": {str(k): {"gauge_length": 100.0} for k in range(1, 21)}})
    start = time.process_time()
    path, found = toolpaths.read_bytes(text)
    result = convert(path, machine, controller, setup, diagnostics=found)
    if not result.ok:
        raise SystemExit("\n".join(str(d) for d in result.diagnostics))
    return time.process_time() - start


def table(count: int, kinds: list[str], show: Callable[[str], None] = print) -> None:
    """A line for each kind."""
    for kind in kinds:
        seconds_of(kind, 50)  # compiled code is warm
        few, many = seconds_of(kind, count), seconds_of(kind, 4 * count)
        show(f"{kind:18} {count:7d}: {few:7.2f} s   {4 * count:7d}: {many:7.2f} s   exponent {math.log(many / few, 4):.2f}")


if __name__ == "__main__":
    numbers = [int(a) for a in sys.argv[1:] if a.isdigit()]
    table(numbers[0] if numbers else 5000, [a for a in sys.argv[1:] if not a.isdigit()] or list(KINDS))
