"""A file in other spellings that APT allows means the same: blanks and tabs, case, line ends, encodings, remarks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import Severity

FOLDER = Path(__file__).parents[3] / "samples" / "dialects"
FILES = ("nx.cls", "creo.ncl", "solidworks.apt", "solidworks.clt", "catia.aptsource", "ncl.as")
CATIA = """\
$$     CATIA APT VERSION 1.0
PARTNO PLATE
MULTAX
CUTTER/ 10.000000,  0.000000,  5.000000,  5.000000, 45.000000,$
         0.000000, 50.000000
LOADTL/2,1
SPINDL/ 2546.4790,RPM,CLW
RAPID
GOTO  /   98.00000,  100.00000,   35.00000, 0.000000, 0.000000, 1.000000
FEDRAT/  300.0000,MMPM
GOTO  /   98.00000,  100.00000,   25.00000, 0.000000, 0.000000, 1.000000
CYCLE/DRILL,    3.000000,    5.000000
GOTO  /   98.00000,  100.00000,   20.00000, 0.000000, 0.000000, 1.000000
CYCLE/OFF
RAPID
GOTO  /   98.00000,  100.00000,   40.00000, 0.000000, 0.000000, 1.000000
SPINDL/OFF
END
"""
"""a cycle whose second number is the start plane, as the point before it and the hole show"""
RECORDS = ("GOTO", "CYCLE", "FEDRAT", "RAPID", "SPINDL", "LOADTL", "LOAD/", "COOLNT", "CIRCLE")


def lower(text: str) -> str:
    return "\n".join(line.lower() if line.startswith(RECORDS) else line for line in text.split("\n"))


def remarked(text: str) -> str:
    """A remark before each record and behind each GOTO."""
    return "\n".join(f"$$ remark\n{line} $$ remark" if line.startswith(RECORDS) and not line.rstrip().endswith("$")
                     else line for line in text.split("\n"))


SPELLINGS: dict[str, Callable[[str], bytes]] = {
    "indented": lambda t: "\n".join(f"  {line}" for line in t.split("\n")).encode(),
    "tabs": lambda t: "\n".join(f"\t{line}\t" for line in t.split("\n")).encode(),
    "lower": lambda t: lower(t).encode(),
    "remarks": lambda t: remarked(t).encode(),
    "crlf": lambda t: t.replace("\n", "\r\n").encode(),
    "cr": lambda t: t.replace("\n", "\r").encode(),
    "bom": lambda t: b"\xef\xbb\xbf" + t.encode(),
    "utf-16": lambda t: t.encode("utf-16"),
    "end of file": lambda t: t.encode() + b"\x1a",
}


def meaning(result: ReadResult) -> list[object]:
    """All of a path but lines and names."""
    assert not [str(d) for d in result.diagnostics if d.severity is Severity.ERROR]
    p = result.toolpath
    columns = [np.nan_to_num(np.asarray(c, float)).tolist() for c in (
        p.tip, p.axis, p.feed, p.feed_mode, p.kind, p.role, p.arc, p.cycle, p.tool, p.arcs.center, p.arcs.sweep)]
    cycles = [(c.kind, c.depth, c.clearance, c.retract, c.feed, c.steps) for c in p.cycles]
    events = [(e.index, e.word, [str(v).upper() for v in e.values]) for e in p.events]
    return [*columns, cycles, events, [(t.number, t.diameter, t.cutter) for t in p.tools], len(p.operations), result.dialect]


@pytest.mark.covering
@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize("name", [*FILES, "cycle"])
def test_the_meaning_is_the_same(name: str, spelling: str) -> None:
    text = CATIA if name == "cycle" else (FOLDER / name).read_text(encoding="utf-8")
    assert meaning(read_bytes(SPELLINGS[spelling](text), units="mm")) == meaning(read_bytes(text, units="mm"))


def test_the_start_plane_of_a_catia_cycle_is_seen_in_every_spelling() -> None:
    cycle, = read_bytes(CATIA).toolpath.cycles
    assert (cycle.depth, cycle.clearance, cycle.feed) == (3.0, 5.0, 5.0)
