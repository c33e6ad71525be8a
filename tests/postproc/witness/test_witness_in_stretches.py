"""What the second witness reads and compares does not depend on how many rows it looks at at once."""

from __future__ import annotations

import pytest

import postproc
import postproc.witness.loops as loops
import postproc.witness.text as text
from postproc.witness.text import ClText
from tests.postproc.kit import TOOLS, few_lines
from toolpaths import read_bytes

TEXTS = {"six and three numbers": b"GOTO/1.0,2.0,3.0\nRAPID\nGOTO/4.0,5.0,6.0,0.0,0.0,1.0\n",
         "a line longer than a stretch": b"RAPID\nGOTO/1,2,3" + b" " * 300 + b"\nGOTO/4,5,6",
         "continued lines": b"GOTO/1.0,2.0,$\n3.0\nGOTO/1,2,3\n" * 7,
         "empty lines": b"\n\nGOTO/1.0,2.0,3.0\n\n\nFINI\n",
         "records between all points": b"RAPID\nGOTO/1.0,2.0,3.0\n" * 50,
         "subroutines": b"DEFSUB/A\nGOTO/1,2,3\nENDSUB\nCALSUB/A\nGOTO/4,5,6\nCALSUB/A\n",
         "numbers in every form": b"GOTO/-.5,+1.,2E1\n \tGOTO / 1.5e-3 ,-2.25E+2,\t-0.0\nGOTO/1,2,3,.1,0.3,1e-22\n",
         "lines that begin alike": b"GOTO/1,2\nGOTO/1,2,3,4\nGOTO/A,1,2\nGOTO/1,2,3 4\nGOTO/1,2,3,\nGOTO/1.2.3,4,5\n"
                                   b"GOTO/1E,2,3\ngoto/1,2,3\nGOTO/1,2,3,4,5,6,7\nGOTO/,2,3\nGODLTA/1,2,3\nGOTO/-,2,3\nGOTO",
         "more digits than one rounding takes": b"GOTO/1.1234567890123456789,2,3\nGOTO/1e30,1,1e-30\n"
                                                b"GOTO/9007199254740993,0.30000000000000004,2\n",
         "nothing": b""}


def said(read: ClText) -> tuple[object, ...]:
    return str(read.points.tolist()), read.line.tolist(), read.records, read.before, read.lines


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_is_read_alike_in_stretches_of_any_size(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = said(text.read(TEXTS[name]))
    for size in (16, 20, 33, 100):
        monkeypatch.setattr(text, "_CHUNK", size)
        assert said(text.read(TEXTS[name])) == whole, size
    monkeypatch.setattr(loops, "compiled", lambda helpers, name, *signature: vars(loops)[name])  # interpreted
    monkeypatch.setattr(text, "COMPILED_FROM", 0)
    assert said(text.read(TEXTS[name])) == whole


def test_a_program_is_compared_alike_in_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    path, found = read_bytes(few_lines("blade.cls"), file="blade.cls")

    def testimony() -> tuple[object, ...]:
        heard = postproc.convert(path, "mikron-ucp710", "linuxcnc", TOOLS, diagnostics=found).witness
        assert heard is not None
        return heard.compared, heard.not_compared, heard.findings, heard.points, heard.worst_tip, heard.worst_axis
    whole = testimony()
    for module, name in (("motion", "CHUNK"), ("place", "CHUNK"), ("block_times", "_CHUNK"), ("rows", "_CHUNK"),
                         ("states", "CHUNK"), ("text", "_CHUNK")):
        monkeypatch.setattr(f"postproc.witness.{module}.{name}", 50)
    assert testimony() == whole
