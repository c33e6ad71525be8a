"""Cycles, tools, events, operations, and the figures of inspect."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import toolpaths
from toolpaths.cl.inspect import inspect, summary
from toolpaths.cl.read import read_bytes, read_file
from toolpaths.diagnostics import Severity, has_errors
from toolpaths.toolpath import Cycle, FeedMode, Kind, Role, Toolpath

SAMPLES = Path(__file__).parents[3] / "samples"
EXPECTED = json.loads((SAMPLES / "expected_counts.json").read_text(encoding="utf-8"))


def read(text: str) -> Toolpath:
    result = read_bytes(text)
    assert not [str(d) for d in result.diagnostics if d.severity is Severity.ERROR]
    return result.toolpath


def one(record: str, head: str = "UNITS/MM\nFEDRAT/60\n") -> Cycle:
    p = read(f"{head}RAPID\nGOTO/0,0,50\n{record}\nGOTO/1,2,3\nGOTO/4,5,6\nCYCLE/OFF\nGOTO/4,5,50\n")
    assert p.role.tolist() == [Role.POINT, Role.HOLE, Role.HOLE, Role.POINT]
    assert p.cycle.tolist() == [-1, 0, 0, -1]
    assert p.kind.tolist() == [Kind.RAPID, Kind.RAPID, Kind.RAPID, Kind.FEED]
    assert p.tip[1].tolist() == pytest.approx([25.4, 50.8, 76.2] if p.units == "inch" else [1, 2, 3])
    return p.cycles[0]


NX = "TOOL PATH/A,TOOL,D\nMSYS/0,0,0,1,0,0,0,1,0\nFEDRAT/MMPM,60\n"
SW = "TRNTYP/WORLD,0,0,0\nUNIT/MM\nFEDRAT/60,MMPM\n"


@pytest.mark.parametrize(("head", "record", "values"), [
    (NX, "CYCLE/DRILL,FEDTO,-33.0,RAPTO,3,RTRCTO,AUTO,MMPM,600", ("DRILL", 33, 3, None, 10, 0)),
    (NX, "CYCLE/DRILL,DEEP,FEDTO,-20,RAPTO,3,RTRCTO,25,MANUAL,STEP,5,MMPM,60", ("DEEP", 20, 3, 25, 1, 0)),
    (NX, "CYCLE/BORE,FEDTO,-8,RAPTO,2,AUTO,MMPR,.1", ("BORE", 8, 2, None, 0.1, 1)),
    (SW, "CYCLE/DEEP2,FEDTO,12.88,MMPM,60.,RAPTO,3,RTRCTO,25,1STPECK,5,SUBPECK,3,DWELL,0", ("DEEP", 12.88, 3, 25, 1, 0)),
    ("$$-> MFGNO / A\nUNITS/MM\nFEDRAT/1\n", "CYCLE / DRILL, DEPTH, 1.76, IPM, 60, CLEAR, .25",
     ("DRILL", 1.76, 0.25, 0.25, 25.4, 0)),
    ("$$-> MFGNO / A\nUNITS/MM\nFEDRAT/1\n", "CYCLE / CSINK, DIAMET, 10, TLANGL, 90, MMPM, 60, CLEAR, 2, RETURN, 5",
     ("CSINK", 5, 2, 5, 1, 0)),
    ("UNITS/MM\nFEDRAT/60\n", "CYCLE/DRILL,12.5,60,MMPM,3,20,0", ("DRILL", 12.5, 3, 20, 1, 0)),
    ("UNITS/MM\nFEDRAT/60\n", "CYCLE/DRILL,12.5,MMPM,60,3,DWELL,1", ("DRILL", 12.5, 3, 3, 1, 0)),
    ("UNITS/MM\nFEDRAT/60\n", "CYCLE/DEEP,FEDTO,9,MMPM,60,RAPTO,2,STEP,3,1,RTRCTO,8", ("DEEP", 9, 2, 8, 1, 0)),
    ("MOVE_ATTRIB/X\nUNITS/MM\nFEDRAT/60\n", "CYCLE/DRILL,G98,12.37,PECKING,5,2,MMPM,60,3,46.9 46.9 DWELL,0",
     ("DEEP", 12.37, 3, 46.9, 1, 0)),
    ("UNITS/INCHES\nFEDRAT/60\n", "CYCLE/FACE,DEPTH,.5,IPM,60,CLEAR,.1,RETURN,1", ("FACE", 12.7, 2.54, 25.4, 25.4, 0)),
    ("UNITS/MM\nFEDRAT/60\n", "CYCLE/THRU,DEPTH,9,CLEAR,2,RETURN,3", ("THRU", 9, 2, 3, 1, 0)),
])
def test_cycles_of_each_system(head: str, record: str, values: tuple[object, ...]) -> None:
    c = one(record, head)
    found = (c.kind, c.depth, c.clearance, c.retract, c.feed, int(c.feed_mode))
    assert found[:1] == values[:1]
    for got, want in zip(found[1:], values[1:], strict=True):
        assert got == (None if want is None else pytest.approx(want))


def cycle_diagnostics(words: str) -> list[str]:
    text = f"UNITS/MM\nRAPID\nGOTO/0,0,50\nCYCLE/{words}\nGOTO/1,2,3\nCYCLE/OFF\n"
    return [d.message for d in read_bytes(text).diagnostics if d.code == "cl.cycle-option"]


def test_what_a_cycle_says_and_nothing_does_is_reported() -> None:
    words = "DRILL,DEPTH,9,MMPM,60,CLEAR,3,RETURN,5"
    assert cycle_diagnostics(words) == []
    for word in ("REPEAT,3", "OFFSET,1,2", "ORIENT,90", "PLUNGE,4", "PARAMS,1,2,3"):
        noted, = cycle_diagnostics(f"{words},{word}")
        assert noted.startswith(f"CYCLE/DRILL: {word.split(',')[0]} ")
    assert cycle_diagnostics("DRILL,9,60,MMPM,3,20,0") == []
    assert cycle_diagnostics("DEEP,9,60,MMPM,3,20,4") == ["CYCLE/DEEP: 4 is not used"]


def test_taps_pecks_and_dwells() -> None:
    assert one("CYCLE/DEEP,DEPTH,10,MMPM,60,CLEAR,3,STEP,4,0,0,RETURN,5").steps == (4.0,)
    assert one("CYCLE/DRILL,DEPTH,10,MMPM,60,CLEAR,3,STEP,0,RETURN,5").steps == ()
    tap = one("CYCLE/TAP,DEPTH,10,TPI,20,CLEAR,3,RETURN,5")
    assert (tap.pitch, tap.feed, tap.feed_mode) == (pytest.approx(1.27), pytest.approx(1.27),
                                                    FeedMode.PER_REVOLUTION)
    assert one("CYCLE/TAP,DEPTH,10,MMPR,1.5,CLEAR,3,RETURN,5").pitch == 1.5
    assert one("CYCLE/DEEP,DEPTH,10,MMPM,60,CLEAR,3,STEP,4,2,RETURN,5").steps == (4.0, 2.0)
    assert one("CYCLE/BRKCHP,DEPTH,10,MMPM,60,CLEAR,3,INCR,4,RETURN,5").kind == "BRKCHP"
    assert one("CYCLE/FACE,DEPTH,10,MMPM,60,CLEAR,3,RETURN,5,DWELL,.5").dwell == 0.5
    assert one("CYCLE/FACE,DEPTH,10,MMPM,60,CLEAR,3,RETURN,5,DWELL,3,REV").dwell_revolutions == 3.0


@pytest.mark.parametrize(("record", "severity"), [
    ("CYCLE/BORE,BACK,RAPTO,3,FEDTO,-5,MMPM,60", Severity.ERROR),
    ("CYCLE/DRILL,BORE,BACK,RAPTO,3,FEDTO,-5,MMPM,60", Severity.ERROR),
    ("CYCLE/DRILL,TAP,DEEP,RAPTO,3,FEDTO,-5,STEP,2,MMPR,1", Severity.ERROR),
    ("CYCLE/TAP,BRKCHP,RAPTO,3,FEDTO,-5,STEP,2,MMPR,1", Severity.ERROR),
    ("CYCLE/BORE,NODRAG,RAPTO,3,FEDTO,-5,MMPM,60", Severity.WARNING),
    ("CYCLE/BORE,DRAG,RAPTO,3,FEDTO,-5,MMPM,60", Severity.WARNING),
    ("CYCLE/BORE,MANUAL,RAPTO,3,FEDTO,-5,RTRCTO,9,MANUAL,MMPM,60", Severity.WARNING),
    ("CYCLE/FACE,RAPTO,3,FEDTO,-5,MMPM,60,DWELL,ON", Severity.WARNING),
    ("CYCLE/BORE,RAPTO,3,FEDTO,-5,RTRCTO,9,MANUAL,MMPM,60", None),
    ("CYCLE/DRILL,BRKCHP,RAPTO,3,FEDTO,-5,STEP,2,MMPM,60", None),
    ("CYCLE/FACE,RAPTO,3,FEDTO,-5,MMPM,60,DWELL,REV,4", None),
])
def test_variants_of_cycles_are_carried_out_reported_or_refused(record: str,
                                                                severity: Severity | None) -> None:
    found = read_bytes(NX + f"RAPID\nGOTO/0,0,9\n{record}\nGOTO/0,0,0\nCYCLE/OFF\nEND-OF-PATH\n")
    noted = [(d.severity, d.code) for d in found.diagnostics if d.severity is not Severity.INFO]
    code = "cl.cycle" if severity is Severity.ERROR else "cl.cycle-option"
    assert noted == ([(severity, code)] if severity else [])
    assert (found.toolpath.cycles[0].depth, found.toolpath.cycles[0].clearance) == (5, 3)


@pytest.mark.parametrize("record", ["CYCLE81/10,0,2,-25,0", "CALLSUB/1001", "CYCLE83 / 10"])
@pytest.mark.parametrize("end", ["", "GOTO/1,0,0\n"])
def test_words_that_begin_as_a_cycle_or_a_call_are_never_left_out(record: str, end: str) -> None:
    found = read_bytes(f"UNITS/MM\nFEDRAT/60\nGOTO/0,0,0\n{record}\n{end}FINI\n")
    assert [d.code for d in found.diagnostics if d.severity is Severity.ERROR] == ["cl.unknown-motion"]


def test_cycle_on_takes_the_last_values_and_the_changed_ones() -> None:
    p = read(NX + "CYCLE/DRILL,FEDTO,-33,RAPTO,3,RTRCTO,20,MMPM,60\nGOTO/0,0,0\nCYCLE/OFF\nRAPID\nGOTO/9,9,9\n"
             "CYCLE/ON,FEDTO,-74.5,RTRCTO,AUTO\nGOTO/1,0,0\nCYCLE/OFF\n")
    assert [(c.depth, c.retract, c.clearance) for c in p.cycles] == [(33, 20, 3), (74.5, None, 3)]
    assert p.cycle.tolist() == [0, -1, 1]


def test_tilted_holes_keep_their_axes() -> None:
    p = read(NX + "CYCLE/DRILL,FEDTO,-3,RAPTO,3,RTRCTO,AUTO,MMPM,60\nGOTO/0,0,0,1,0,0\nGOTO/5,0,0\nCYCLE/OFF\n")
    assert p.axis.tolist() == [[1, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize("record", ["LOADTL/3,5", "LOADTL / 3, OSETNO, 5", "LOAD/TOOL,3,ADJUST,5",
                                    "TURRET/3,OSETNO,5,SETOOL,0,0,1", "LOADTL/3,5,1", "LOADTL/3,7,99.5,5",
                                    "LOADTL/3, IN, 7, LENGTH, 99.5, OSETNO, 5"])
def test_every_tool_change_is_one_event(record: str) -> None:
    p = read(f"UNITS/MM\nFEDRAT/60\n{record}\nGOTO/1,2,3\n")
    assert [(e.word, e.values) for e in p.events] == [("LOADTL", (3.0, 5.0))]
    assert (p.tools[0].number, p.tools[0].length_register, p.tool.tolist()) == (3, 5, [0])


def test_tools_of_nx() -> None:
    p = read("TOOL PATH/A,TOOL,MILL_10\nTLDATA/MILL,10,1,75,3,0\nLOAD/TOOL,4,ADJUST,9\nFEDRAT/MMPM,9\nGOTO/0,0,0\n"
             "TOOL PATH/B,TOOL,MILL_10\nTLDATA/MILL,10,1,75,3,0\nGOTO/0,0,1\n"
             "TOOL PATH/C,TOOL,DR\nTLDATA/DRILL,MILL,6.8,0,80,118,60\nLOAD/TOOL,5\nGOTO/0,0,2\n")
    assert p.tool.tolist() == [0, 0, 1]
    mill, drill = p.tools
    assert (mill.number, mill.name, mill.diameter, mill.corner_radius, mill.length) == (4, "MILL_10", 10, 1, 75)
    assert mill.taper == pytest.approx(math.radians(3))
    assert (drill.number, drill.shape, drill.flute_length, drill.length_register) == (5, "DRILL", 60, None)
    assert drill.tip_angle == pytest.approx(math.radians(118))


def test_tools_of_other_systems() -> None:
    p = read("$$-> MFGNO / X\nUNITS/INCHES\nFEDRAT/9\n$$-> CUTTER / .5\nLOADTL / 1\nGOTO/0,0,0\n"
             "LOADTL / 2\n$$-> CUTTER / 1.\nGOTO/0,0,1\nLOADTL / 1\nGOTO/0,0,2\n")
    assert p.tool.tolist() == [0, 1, 0]
    assert [t.diameter for t in p.tools] == [12.7, 25.4]
    p = read("TRNTYP/WORLD,0,0,0\nUNIT/MM\nFEDRAT/9\nLOAD/TOOL,7\nCUTTER/20.,0,10.,6.008606,31.,0,215.\n"
             "CSI_SET_FLUTE_LENGTH/40\nINSERT/[x] note\nGOTO/0,0,0\n")
    assert p.tools[0].cutter == (20.0, 0.0, 10.0, 6.008606, 31.0, 0.0, 215.0)
    assert p.tools[0].flute_length == 40.0
    assert [(e.word, e.values) for e in p.events] == [("LOADTL", (7.0,)), ("PPRINT", ("[x] note",))]
    p = read("$$ CATIA\nTPRINT/T1 End Mill D 10,T1\nTOOLNO/1,MILL,10.0,2.0,100\nLOADTL/1,1\nFEDRAT/1\nGOTO/0,0,0\n")
    assert (p.tools[0].name, p.tools[0].diameter, p.tools[0].corner_radius) == ("T1 End Mill D 10", 10, 2)


def test_events_keep_their_words() -> None:
    p = read("UNITS/INCHES\nFEDRAT/9\nSPINDL/500.,RPM,CLW\nCOOLNT/FLOOD\nCUTCOM/LEFT,XYPLAN,3\nGOTO/0,0,0\nDELAY/2.5\n"
             "STOP\nOPSTOP\nSELECT/TOOL,5\nRETRCT/2\nAUXFUN/8,NOW\nFEDRAT/INVERS,AUTO\nEND\nFINI\n")
    assert [(e.index, e.word, e.values) for e in p.events] == [
        (0, "SPINDL", (500.0, "RPM", "CLW")), (0, "COOLNT", ("FLOOD",)), (0, "CUTCOM", ("LEFT", "XYPLAN", 3.0)),
        (1, "DELAY", (2.5,)), (1, "STOP", ()), (1, "OPSTOP", ()), (1, "SELECT", (5.0,)), (1, "RETRCT", (50.8,)),
        (1, "AUXFUN", (8.0, "NOW")), (1, "FEDRAT", ("INVERS", "AUTO")), (1, "END", ())]


@pytest.mark.parametrize("text", ["TOOL PATH/A,TOOL,T\nTLDATA/TURN,0.8,1,2,3\nGOTO/1,2,3\n",
                                  "UNITS/MM\nSPINDL/ 500.0,SFM,CCLW\nGOTO/1,2,3\n",
                                  "TOOLNO/1,TURN,,,80.,$\n5.,ON,0.0,NOTE\nGOTO/1,2,3\n",
                                  "LOADTL/3,ADJUST,9,TURN\nGOTO/1,2,3\n"])
def test_turning_is_reported(text: str) -> None:
    assert [op.turning for op in read(text).operations] == [True]


def test_a_mill_at_a_surface_speed_is_no_turning() -> None:
    p = read("TOOL PATH/A,TOOL,T\nTLDATA/MILL,10,0,75,0,0\nLOAD/TOOL,1\nSPINDL/SMM,200,CLW\nGOTO/1,2,3\n")
    assert [op.turning for op in p.operations] == [False]


def test_a_leaning_tool_axis_at_a_surface_speed_is_no_turning() -> None:
    p = read("MULTAX/ON\nSPINDL/200.0,SMM,CLW\nGOTO/1,2,3,0,0.6,0.8\n")
    assert [op.turning for op in p.operations] == [False]


@pytest.mark.parametrize(("ends", "turning"), [(("20,0,-3", "20,15,-3"), [False]), (("20,0,-3", "35,0,-3"), [True]),
                                               (("20,0,-3", "20,0.001,-3"), [True])])
def test_points_in_no_plane_at_a_surface_speed_are_no_turning(ends: tuple[str, str], turning: list[bool]) -> None:
    """What a lathe cuts lies in the plane of its spindle and the tip."""
    p = read("UNITS/MM\nCUTTER/12,0\nSPINDL/SFM,300,CLW\nRAPID\nGOTO/0,0,40\nGOTO/0,0,-3\n" +
             "".join(f"GOTO/{end}\n" for end in ends))
    assert [op.turning for op in p.operations] == turning


@pytest.mark.parametrize("text", ["SPINDL/ 500.0,SMM,CCLW\nTRNTYP/WORLD,0,0,0\nGOTO/1,2,3\n",
                                  "$$*CATIA0\nSPINDL/ 500.0,SMM,CCLW\n$$ OPERATION NAME : Face.1\nGOTO/1,2,3\n"])
def test_turning_reported_before_its_operation_begins_is_of_that_operation(text: str) -> None:
    assert [op.turning for op in read(text).operations] == [True]


def test_turning_reported_after_the_last_point_is_of_the_last_operation() -> None:
    p = read("TRNTYP/WORLD,0,0,0\nGOTO/1,2,3\nTRNTYP/WORLD,0,0,0\nGOTO/1,2,3\nSPINDL/ 500.0,SMM,CCLW\nFINI\n")
    assert [op.turning for op in p.operations] == [False, True]


def test_each_operation_of_solidworks_begins_at_its_trntyp() -> None:
    p = read("UNIT/MM\nCUTTER/12\nLOAD/TOOL,3\nSPINDL/900,RPM,CLW\nTRNTYP/WORLD,0,0,0\nCSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0\n"
             "FEDRAT/80,MMPM\nGOTO/0,0,1\nGOTO/4,0,1\nSPINDL/700,RPM,CLW\nTRNTYP/WORLD,0,0,0\n"
             "CSYS/1.,0,0,0,0,0,1.,0,0,-1.,0,7.\nGOTO/0,0,1\nFINI\n")
    assert [op.name for op in p.operations] == ["OP 1", "OP 2"]
    assert p.operation.tolist() == [0, 0, 1]
    assert [p.frames[op.frame].origin for op in p.operations] == [(0, 0, 0), (0, 0, 7)]
    assert [(e.index, e.word) for e in p.events] == [(0, "LOADTL"), (0, "SPINDL"), (2, "SPINDL")]


def test_trntyp_means_nothing_outside_solidworks() -> None:
    p = read("CSI_TOOL_PATH/A\nMCS/1,0,0,0,1,0,0,0,1,0,0,0\nTRNTYP/WORLD,0,0,0\nGOTO/0,0,1\n")
    assert [op.name for op in p.operations] == ["A"]


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_samples(name: str) -> None:
    want = EXPECTED[name]
    result = read_file(SAMPLES / name)
    assert not has_errors(result.diagnostics)
    found = inspect(result)
    for key in ("points", "rapids", "arcs", "cycles", "holes", "units"):
        assert found[key] == want[key], key
    assert len(found["operations"]) == want["operations"]
    assert found["length_mm"] == pytest.approx(want["feed_length_mm"], abs=2e-3)
    for letter, limits in want["extents_mm"].items():
        assert found["extents"][letter] == pytest.approx(limits, abs=1e-4)
    json.dumps(found)
    assert toolpaths.read_bytes(toolpaths.write(result.toolpath))[0].equals(result.toolpath)


def test_inspect_counts_and_summary() -> None:
    result = read_bytes("UNITS/MM\nFROM/0,0,9\nFLUB/1\nFEDRAT/60\nRAPID\nGOTO/0,0,0\nGODLTA/0,0,-1\n"
                        "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0,0,1,0\nGOHOME/0,0,9\n")
    found = inspect(result)
    assert (found["points"], found["rapids"], found["arcs"], found["cycles"]) == (4, 1, 1, 0)
    assert found["length_mm"] == pytest.approx(1 + math.hypot(10, 1) + 5 * math.pi)
    assert (found["five_axis"], found["axis_motion"]) == (True, "continuous")
    assert found["unknown_words"] == {"FLUB": 1}
    assert "4 points (1 rapid, 1 arcs" in summary(result)
    assert "FLUB (1)" in summary(result)


def test_a_missing_file_is_a_diagnostic(tmp_path: Path) -> None:
    toolpath, diagnostics = toolpaths.read(tmp_path / "none.cls")
    assert len(toolpath) == 0
    assert [d.code for d in diagnostics] == ["cl.open"]
    assert inspect(read_file(tmp_path / "none.cls"))["points"] == 0
    assert summary(read_file(tmp_path / "none.cls"))


def test_write_to_a_file_and_refusals(tmp_path: Path) -> None:
    p = read("UNITS/MM\nFEDRAT/60\nGOTO/1,2,3\n")
    text = toolpaths.write(p, tmp_path / "a.apt")
    assert (tmp_path / "a.apt").read_text(encoding="utf-8") == text
    assert toolpaths.read(tmp_path / "a.apt")[0].equals(p)


def test_progress_is_reported() -> None:
    seen: list[tuple[int, int]] = []
    read_bytes("GOTO/1,2,3\n" * 10, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(110, 110)]


def test_what_cannot_be_written_is_refused() -> None:
    p = read("UNITS/MM\nFEDRAT/60\nGOTO/1,2,3\nGOTO/2,2,3\n")
    nan = np.array([1.0, math.nan])
    with pytest.raises(ValueError, match="unknown"):
        toolpaths.write(replace(p, feed=nan))
    with pytest.raises(ValueError, match="finite"):
        toolpaths.write(replace(p, tip=p.tip * nan[:, None]))
    vectors = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="both"):
        toolpaths.write(replace(p, normal=vectors, contact=vectors))


@pytest.mark.parametrize(("system", "title"), [
    ("CAMWorks 2023", "SolidWorks CAM .apt"), ("CATIA V5", "CATIA"), ("", "CATIA")])
def test_a_depth_that_points_away_is_answered_in_the_words_of_the_file(system: str, title: str) -> None:
    """TOOLNO is a word of ISO 4343: it says CATIA where the file names no other system."""
    said = read_bytes(f"PPRINT/{system}\nUNITS/MM\nTOOLNO/1,MILL,10\nLOADTL/1\nRAPID\nGOTO/0,0,50\n"
                                "CYCLE/DRILL,DEPTH,-5,MMPM,60,CLEAR,3\nGOTO/5,5,0\nCYCLE/OFF\nFINI\n".encode()).diagnostics
    [hint] = [d.hint for d in said if d.code == "cl.cycle-depth"]
    assert hint.startswith(f"{title} writes depths positive"), hint
