"""What a second hostile reading found: pecks, dwells in place, tool changes, early ends, comments that a control obeys."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import machines
import postproc
import toolpaths
from postproc.setup.model import SetupFile

TOOLS = SetupFile.model_validate({"tools": {"1": {"gauge_length": 100.0}, "2": {"gauge_length": 80.0}}})
DEEP = ("LOADTL/1\nSPINDL/RPM,1000,CLW\nRAPID\nGOTO/0,0,20\nCYCLE/DEEP,DEPTH,22,STEP,5,MMPM,120,CLEAR,3,RETURN,20\n"
        "GOTO/0,0,0\nGOTO/10,0,0\nCYCLE/OFF\n")


def converted(text: str) -> postproc.PostResult:
    path, found = toolpaths.read_bytes("UNITS/MM\n" + text + "FINI\n", file="t.apt")
    result = postproc.convert(path, machines.load("mill-3axis"), setup=TOOLS, diagnostics=found)
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


def faults(result: postproc.PostResult, text: str, tmp_path: Path) -> set[str]:
    """Codes that verify finds in an edited program."""
    setup, program = tmp_path / "s.toml", tmp_path / "e.ngc"
    setup.write_text("".join(f"[tools.{n}]\ngauge_length = {t.gauge_length}\n" for n, t in TOOLS.tools.items()))
    program.write_text(text)
    options = postproc.Options(setup=str(setup))
    found = postproc.verify(program, result.toolpath, result.machine, options=options)
    assert postproc.verify(program.with_name("e.ngc"), result.toolpath, result.machine, options=options).ok is found.ok
    return {d.code for d in found.diagnostics if d.severity == 2}


@pytest.mark.parametrize(("pattern", "new", "code"), [
    ("Q5", "Q25", "verify.hole"), ("Q5", "Q6", "verify.hole"), ("G83", "G73", "verify.hole"),
    (r"G83(.*) Q5", r"G81\1", "verify.hole"), ("S1000 M3", "S1000 M3\n%", "gcode.after_end"),
    (r"(?m)^G54\n", "", "gcode.unstated"), ("(?m)^G80\n", "G80 X4\n", "gcode.no_motion"),
    (r"(?m)^M2\n", "", "gcode.no_end"), ("G43 H1", "G43 H2", "verify.not_reached"),
    ("S1000 M3\n", "S1000 M3\nM30\n", "gcode.after_end"),
])
def test_edits_that_verify_finds(pattern: str, new: str, code: str, tmp_path: Path) -> None:
    result = converted(DEEP)
    edited = re.sub(pattern, new, result.text, count=1)
    assert edited != result.text
    assert faults(result, result.text, tmp_path) == set()
    assert code in faults(result, edited, tmp_path)


def test_a_dwell_rests_where_it_was_asked_for() -> None:
    start = "LOADTL/1\nSPINDL/RPM,1000,CLW\nRAPID\nGOTO/0,0,50\nFEDRAT/250,MMPM\nGOTO/0,0,-5\nDELAY/2\n"
    for text in (start, start + "GOHOME\n", start + "LOADTL/2\nRAPID\nGOTO/0,0,50\nGOTO/0,0,-5\n"):
        lines = converted(text).text.splitlines()
        assert lines[lines.index("G4 P2") - 1] == "G1 Z-5 F250"


def test_another_tool_returns_to_the_cut_at_feed() -> None:
    text = ("LOADTL/1\nSPINDL/RPM,1000,CLW\nRAPID\nGOTO/0,0,50\nFEDRAT/250,MMPM\nGOTO/0,0,-5\nGOTO/50,0,-5\nLOADTL/2\n"
            "FEDRAT/100,MMPM\nGOTO/80,0,-5\n")
    lines = converted(text).text.splitlines()
    change = lines.index("T2 M6")
    down = next(k for k in range(change, len(lines)) if "Z-5" in lines[k])
    assert lines[down] == "G1 Z-5 F100" and lines[down + 1] == "X80"


def test_nothing_turns_before_the_first_tool_nor_after_the_last() -> None:
    text = ("SPINDL/RPM,1000,CLW\nLOADTL/1\nRAPID\nGOTO/0,0,50\nFEDRAT/250,MMPM\nGOTO/0,0,-5\nGOHOME\nLOADTL/0\n")
    lines = converted(text).text.splitlines()
    assert lines.index("T1 M6") < lines.index("S1000 M3")
    assert not [block for block in lines[lines.index("T0 M6"):] if "M3" in block or "G43" in block]


@pytest.mark.parametrize("text", ["ABORT,stop", "LOGOPEN,x.txt", " py,run"])
def test_comments_that_linuxcnc_would_obey_only_speak(text: str) -> None:
    result = converted(f"PPRINT/{text}\n" + DEEP)
    assert not re.search(r"\(\s*(ABORT|LOGOPEN|PY)", result.text, re.IGNORECASE)
    assert "(text:" in result.text


def test_tools_that_only_changed_their_name_are_one() -> None:
    part = ("TOOL PATH/{0},TOOL,{1}\nTLDATA/MILL,10.0,0.0,75.0,0.0,0.0\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\n"
            "SPINDL/RPM,1000,CLW\nRAPID\nGOTO/0,0,20,0,0,1\nFEDRAT/MMPM,100\nGOTO/0,0,0\nEND-OF-PATH\n")
    path, found = toolpaths.read_bytes(part.format("A", "EM10") + part.format("B", "em10_COPY"), file="t.cls")
    assert postproc.convert(path, machines.load("mill-3axis"), setup=TOOLS, diagnostics=found).ok
