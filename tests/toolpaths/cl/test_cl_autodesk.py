"""Files of Autodesk's posts for APT: work planes, cycles whose planes are heights, tools, operations."""

from __future__ import annotations

import pytest

import toolpaths
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind, Toolpath

ISO = "MODE/MILL\nPARTNO/'plate'\nPPRINT/'plate'\nUNITS/MM\nMULTAX/OFF\nLOADTL/3, 0, 60.0, 8\n"
CAMPLETE = "MODE/MILL\nPARTNO/'plate'\n"
PLANE = "MCS/1.0, 0.0, 0.0, $\n{}, $\n{}, $\n{}\n"
LEVEL = PLANE.format("0.0, 1.0, 0.0", "0.0, 0.0, 1.0", "0.0, 0.0, 0.0")
SIDE = PLANE.format("0.0, 0.0, 1.0", "0.0, -1.0, 0.0", "5.0, 0.0, 2.0")
MFG = "PARTNO/ 'plate'\nBEGIN\nUNITS/ MM\nMATERL/ TYPE, 5, COND, 6, XDIM, 100, YDIM, 80, ZDIM, 30\n"
MCSYS = "MCSYS/ NUM, {}, POINT, 5, 0, 2, VECTOR, 1, 0, 0, VECTOR, 0, 0, 1\n"
HSM = "PARTNO/'plate'\nUNITS/MM\nLOADTL/3, IN, 0, LENGTH, 60, OSETNO, 3\n"


def result(text: str, *codes: str) -> ReadResult:
    """The text read; `codes` are those of the warnings and errors that must come."""
    found = read_bytes(text)
    assert [d.code for d in found.diagnostics if d.severity is not Severity.INFO] == list(codes)
    return found


def read(text: str) -> Toolpath:
    return result(text).toolpath


def holes(p: Toolpath) -> list[list[float]]:
    return p.tip[p.cycle >= 0].round(9).tolist()


def planes(p: Toolpath) -> list[tuple[float, float, float | None]]:
    return [(round(c.depth, 9), round(c.clearance, 9), None if c.retract is None else round(c.retract, 9)) for c in p.cycles]


def test_points_of_the_iso_post_are_bottoms_of_holes_and_clearances_heights() -> None:
    found = result(ISO + "RAPID\nGOTO/10.0, 20.0, 35.0\n"
                   "CYCLE/DEEP, 12.0, INCR, 4.0, MMPM, 300.0, 35.0, RAPTO, 10.0, DWELL, 1.0\n"
                   "FEDRAT/300.0, MMPM\nGOTO/10.0, 20.0, 8.0\nFEDRAT/300.0, MMPM\nGOTO/30.0, 20.0, 8.0\nCYCLE/OFF\n"
                   "END\nFINI\n")
    p = found.toolpath
    assert found.dialect == "autodesk-iso"
    assert holes(p) == [[10, 20, 20], [30, 20, 20]]
    assert planes(p) == [(12, 5, 15)]
    assert (p.cycles[0].kind, p.cycles[0].steps, p.cycles[0].dwell, p.cycles[0].feed) == ("DEEP", (4.0,), 1.0, 5.0)
    assert (p.tools[0].number, p.tools[0].length_register) == (3, 8)


def test_heights_of_the_iso_post_are_along_the_tool_axis() -> None:
    """Without RAPTO the start plane is the clearance height; inches."""
    p = read(ISO.replace("MM", "INCHES").replace("OFF", "ON") + "RAPID\nGOTO/2.0, -3.0, 0.5, 0.0, -1.0, 0.0\n"
             "CYCLE/TAP, 0.5, IPM, 6.0, 3.0\nFEDRAT/6.0, IPM\nGOTO/2.0, -1.5, 0.5, 0.0, -1.0, 0.0\nCYCLE/OFF\nEND\nFINI\n")
    assert p.tip[1] / 25.4 == pytest.approx([2.0, -2.0, 0.5])
    assert planes(p) == [(12.7, 25.4, 25.4)]


def test_a_height_that_the_tool_does_not_stand_at_is_refused() -> None:
    text = (ISO + "RAPID\nGOTO/10.0, 20.0, 35.0\nCYCLE/DRILL, 12.0, MMPM, 300.0, 3.0, RAPTO, 1.0\nGOTO/10.0, 20.0, 8.0\n"
            "CYCLE/OFF\nEND\nFINI\n")
    result(text, "cl.cycle-height")
    p = read_bytes(text, dialect="generic").toolpath
    assert holes(p) == [[10, 20, 8]] and planes(p) == [(12, 1, 3)]


def test_work_planes_of_camplete_and_one_cycle_per_height() -> None:
    found = result(CAMPLETE + "CSI_TOOL_PATH/Side holes\nUNITS/MM\nMULTAX/OFF\n" + SIDE + "MCS2/1,0,0,0,0,1,0,-1,0\n"
                   "CSI_SET_FLUTE_LENGTH/40.0\nLOADTL/3, 0, 60.0, 3\nZERO/1\nCSI_PATH_TOLERANCE/0.01\nRAPID\n"
                   "GOTO/10.0, 20.0, 25.0\n"
                   "CYCLE/DRILL, FEDTO, 12.0, MMPM, 300.0, CLEAR, 25.0, RTRCTO, 15.0, RETURN, 25.0, RAPTO, 5.0\n"
                   "GOTO/10.0, 20.0, 10.0\nGOTO/30.0, 20.0, 10.0\nGOTO/50.0, 20.0, 8.0\nCYCLE/OFF\nOPERATION/END\n"
                   "START/'OPERATION'\nCSI_TOOL_PATH/Top\nUNITS/MM\nMULTAX/ON\n" + LEVEL + "ZERO/1\nRAPID\n"
                   "GOTO/1.0, 2.0, 35.0, 0.0, 0.0, 1.0\nEND\nFINI\n")
    p = found.toolpath
    assert found.dialect == "camplete" and found.unknown_words == {}
    assert holes(p) == [[15, -10, 22], [35, -10, 22], [55, -8, 22]]
    assert p.axis[1].tolist() == [0, -1, 0]
    assert planes(p) == [(12, 5, 15), (12, 5, 17)] or planes(p) == [(12, 5, 17), (12, 5, 15)]
    assert [p.cycles[k].retract for k in p.cycle[1:4]] == [15, 15, 17]
    assert p.tip[-1].tolist() == [1, 2, 35]
    assert [op.name for op in p.operations if op.name] == ["Side holes", "Top"]


def test_cycles_of_camplete_without_a_start_plane_start_at_the_clearance_height() -> None:
    p = read(CAMPLETE + "UNITS/MM\n" + LEVEL + "RAPID\nGOTO/0,0,25\n"
             "CYCLE/RIGID, DEPTH, 12, PITCH, 1.5, CLEAR, 25, RETURN, 25\n"
             "GOTO/0,0,10\nCYCLE/OFF\nFINI\n")
    assert planes(p) == [(12, 15, 15)]


@pytest.mark.parametrize(("sense", "at"), [("0, 0, -1.0", 90), ("0, 0, 1.0", -270)])
def test_circles_of_camplete_are_left_hand(sense: str, at: float) -> None:
    p = read(CAMPLETE + "UNITS/MM\n" + LEVEL + "FEDRAT/500, MMPM\nGOTO/10,0,0\n"
             f"CIRCLE/0, 0, 0, {sense}, 10, {abs(at)}, 0.0, 0.0, 0.0\nGOTO/0,10,0\nFINI\n")
    assert (p.arcs.sweep * p.arcs.normal[:, 2])[0] * 57.29577951308232 == pytest.approx(at)


@pytest.mark.parametrize("record", ["MCS/1,0,0,0,1,0,0,0,1\n", "MCS/1,0,0,0,1,0,0,0,-1,0,0,0\n",
                                    "MCS/1,0,0,1,1,0,0,0,1,0,0,0\n"])
def test_what_is_no_work_plane_is_refused(record: str) -> None:
    result(CAMPLETE + "UNITS/MM\n" + record + "FEDRAT/1\nGOTO/0,0,0\nFINI\n", "cl.frame")


@pytest.mark.parametrize("record", ["MCSYS/ POINT, 0, 0, 0\n",
                                    "MCSYS/ NUM, 1, POINT, 0, 0, 0, VECTOR, 1, 0, 0, VECTOR, 1, 0, 0\n"])
def test_what_is_no_work_plane_of_mfgsuite_is_refused(record: str) -> None:
    result(MFG + record + "FEDRAT/1\nGOTO/0,0,0\nEND/\n", "cl.frame")


def test_files_of_mfgsuite() -> None:
    found = result(MFG + "OPNAME/ 'Side holes'\nAPPLY/ MILL\n" + MCSYS.format(1) + "TOOLNO/ 3, MILL, OSETNO, 7, 9\n"
                   "LOAD/ TOOL, 3, 'drill', NEXTTL, 1\nSPINDL/ RPM, 2500, CLW\nCUTCOM/ ON, LENGTH, 7\nRAPID\n"
                   "GOTO/ 10, 20, 15\n"
                   "CYCLE/ DRILL, DEPTH, 12, PERMIN, 300, CLEAR, 15, RETURN, 15, RAPTO, 11\nFEDRAT/ 300\nGOTO/ 10, 20, 0\n"
                   "CYCLE/ OFF\nTCP/ ON\nGOHOME/\nEND/\n")
    p = found.toolpath
    assert (found.dialect, p.operations[0].name) == ("mfgsuite", "Side holes")
    assert holes(p) == [[15, 0, 22]] and p.axis[1].tolist() == [0, -1, 0]
    assert planes(p) == [(12, 4, 15)]
    assert [(t.number, t.length_register, t.diameter) for t in p.tools] == [(3, 7, None)]
    assert [e.word for e in p.events if e.word == "CUTCOM"] == []


def test_turning_operations_of_mfgsuite_are_known() -> None:
    p = read(MFG + "OPNAME/ 'Face'\nAPPLY/ TURN\nFEDRAT/ 300\nGOTO/ 10, 0, 0\n" + MCSYS.format(1) + "END/\n")
    assert p.operations[0].turning


@pytest.mark.parametrize("records", ["ZERO/1\nGOTO/0,0,1\nZERO/2\nGOTO/0,0,2\n", MCSYS.format(1) + "GOTO/0,0,1\n"
                                     + MCSYS.format(2) + "GOTO/0,0,1\n"])
def test_points_in_two_work_offsets_are_refused(records: str) -> None:
    result("UNITS/MM\nFEDRAT/1\n" + records, "cl.work-offset")


def test_clearances_of_generative_machining_count_from_the_bottom() -> None:
    found = result(HSM + "RAPID\nGOTO/10, 20, 15\nCYCLE/BRKCHP, 12, INCR, 4, MMPM, 300, 27, RAPTO, 11\n"
                   "GOTO/10, 20, 0\nCYCLE/OFF\n"
                   "END\nFINI\n")
    assert found.dialect == "hsmworks"
    assert holes(found.toolpath) == [[10, 20, 0]] and planes(found.toolpath) == [(12, 4, 15)]


def test_half_turns_of_generative_machining_have_no_sense() -> None:
    text = HSM + "FEDRAT/300, MMPM\nGOTO/10,0,0\nMOVARC/0, 0, 0, 0, 0, 1, 10, ANGLE, {}\nGOTO/{}\nEND\nFINI\n"
    result(text.format(180, "-10,0,0"), "cl.circle")
    assert read(text.format(90, "0,10,0")).kind.tolist() == [Kind.FEED, Kind.ARC]
    result(text.format(90, "0,-10,0"), "cl.arc-sweep")


def test_compensation_that_is_on_before_its_side_is_one_event() -> None:
    p = read(ISO + "RAPID\nGOTO/0,0,5\nFEDRAT/300, MMPM\nCUTCOM/ON\nCUTCOM/LEFT, 1\nGOTO/1,0,0\nCUTCOM/OFF\n"
             "GOTO/2,0,0\nCUTCOM/ON\n"
             "GOTO/3,0,0\nFINI\n")
    assert [e.values for e in p.events if e.word == "CUTCOM"] == [("LEFT", 1.0), ("OFF",), ("ON",)]


def test_what_is_read_is_written_and_read_again() -> None:
    p = read(ISO + "RAPID\nGOTO/10.0, 20.0, 35.0\nCYCLE/DRILL, 12.0, MMPM, 300.0, 35.0, RAPTO, 10.0\nGOTO/10.0, 20.0, 8.0\n"
             "CYCLE/OFF\nEND\nFINI\n")
    assert toolpaths.read_bytes(toolpaths.write(p))[0].equals(p)
