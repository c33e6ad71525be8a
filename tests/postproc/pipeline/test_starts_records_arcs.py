"""Faults that a hostile reading found in the road, as tests: where cuts begin, trailing records, arcs off the planes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.setup.model import SetupFile
from toolpaths.diagnostics import Severity

HEAD = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\n"
TOOLS = SetupFile.model_validate({"tools": {"1": {"gauge_length": 100.0}, "2": {"gauge_length": 80.0}}})


def converted(text: str, machine: str = "mill-3axis", controller: str | Path = "linuxcnc",
              tolerance: float = 0.01) -> postproc.PostResult:
    path, found = toolpaths.read_bytes(HEAD + text + "FINI\n", file="t.apt")
    options = postproc.Options(tolerance=tolerance)
    return postproc.convert(path, machines.load(machine), controller, setup=TOOLS, options=options,
                            diagnostics=found)


def blocks(result: postproc.PostResult) -> list[str]:
    assert result.ok, [str(d) for d in result.diagnostics if d.severity is Severity.ERROR]
    return result.text.splitlines()


def test_a_cut_that_begins_at_from_begins_there() -> None:
    lines = blocks(converted("FROM/0,0,0\nFEDRAT/250,MMPM\nGOTO/100,0,0\nGOTO/100,50,0\n"))
    cut = lines.index("G1 X100 F250")
    assert lines[cut - 1] == "Z0" and "G0 X0 Y0" in lines and lines[cut + 1] == "Y50"


def test_an_arc_after_from_keeps_its_start() -> None:
    text = "RAPID\nGOTO/0,0,50\nFEDRAT/250,MMPM\nGOTO/0,0,0\nFROM/10,0,0\nMOVARC/0,0,0,0,0,1,10,ANGLE,180\nGOTO/-10,0,0\n"
    lines = blocks(converted(text))
    arc = next(k for k, block in enumerate(lines) if block.startswith("G3"))
    assert "X-10" in lines[arc] and "I-10" in lines[arc] and "X10" in " ".join(lines[arc - 2:arc])


def test_a_cut_after_a_tool_change_begins_where_the_last_one_ended() -> None:
    text = "RAPID\nGOTO/5,5,20\nFEDRAT/250,MMPM\nGOTO/5,5,0\nLOADTL/2\nSPINDL/RPM,1000,CLW\nGOTO/40,5,0\n"
    lines = blocks(converted(text))
    change = lines.index("T2 M6")
    cut = next(k for k in range(change, len(lines)) if lines[k].startswith("X40"))
    assert "G0 X5 Y5" in lines[change:cut] and lines[cut - 1].startswith("G1 Z0")


def test_an_arc_without_a_start_is_refused() -> None:
    result = converted("FEDRAT/250,MMPM\nMOVARC/0,0,0,0,0,1,10,ANGLE,90\nGOTO/0,10,0\n")
    assert {"arc.no_start", "cl.arc-start"} & {d.code for d in result.diagnostics} and not result.text


def test_trailing_records_act_after_the_retract() -> None:
    text = "RAPID\nGOTO/10,0,50\nFEDRAT/250,MMPM\nGOTO/10,0,-1\nLOADTL/2\n"
    lines = blocks(converted(text))
    change, home = lines.index("T2 M6"), max(k for k, block in enumerate(lines) if block.startswith("G53"))
    assert home < change and not [block for block in lines[change:] if block[:1] in "XYZ"]


TILTED = ",0,0.5,0.866025404"


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("machine", ["linuxcnc-xyzac-trt", "fork-head-ab", "head-table", "nutating-head", "mikron-ucp710"])
def test_a_full_circle_on_a_tilted_face(machine: str) -> None:
    text = (f"MULTAX/ON\nRAPID\nGOTO/10,0,20{TILTED}\nFEDRAT/250,MMPM\nGOTO/10,0,0{TILTED}\n"
            f"MOVARC/0,0,0{TILTED},10,ANGLE,360\nGOTO/10,0,0{TILTED}\nRAPID\nGOTO/10,0,20{TILTED}\n")
    result = converted(text, machine)
    blocks(result)
    assert result.comparison.worst_tip < 0.01
    tips = result.comparison.tip
    around = tips[np.abs(np.linalg.norm(tips, axis=1) - 10.0) < 0.02]
    assert machine == "mikron-ucp710" or (around[:, 0].min() < -9.9 and len(around) > 40)


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("machine", ["linuxcnc-xyzac-trt", "fork-head-ab", "head-table", "mikron-ucp710"])
def test_a_helix_of_several_turns_on_a_tilted_face(machine: str) -> None:
    text = ("TOOL PATH/A,TOOL,T\nTLDATA/MILL,10.0,0.0,75.0,0.0,0.0\nMSYS/0,0,0,1,0,0,0,0.866025404,-0.5\nLOAD/TOOL,1\n"
            "SPINDL/RPM,1000,CLW\nRAPID\nGOTO/10,0,20,0,0,1\nFEDRAT/MMPM,200\nGOTO/10,0,0\n"
            "CIRCLE/0,0,-4,0,0,1,10,0.01,0.5,10,0,TIMES,2\nGOTO/0,10,-4\nRAPID\nGOTO/0,10,20\nEND-OF-PATH\n")
    path, found = toolpaths.read_bytes(text, file="t.cls")
    result = postproc.convert(path, machines.load(machine), setup=TOOLS, diagnostics=found)
    blocks(result)
    assert path.arcs.sweep[0] == pytest.approx(2.75 * 2.0 * np.pi, rel=0.01) or path.arcs.sweep[0] > 4.0 * np.pi
    assert result.comparison.worst_tip < 0.01


def test_points_closer_than_the_words_can_say(tmp_path: Path) -> None:
    shop = tmp_path / "coarse.toml"
    shop.write_text('base = "linuxcnc"\n[format]\nlinear_decimals = 2\n')
    points = "".join(f"GOTO/{0.004 * k:.4f},{0.003 * (k % 3):.4f},0\n" for k in range(1, 300))
    result = converted("RAPID\nGOTO/0,0,5\nFEDRAT/100,MMPM\nGOTO/0,0,0\n" + points, controller=shop,
                       tolerance=0.05)
    blocks(result)
    assert result.comparison.worst_tip < 0.02
