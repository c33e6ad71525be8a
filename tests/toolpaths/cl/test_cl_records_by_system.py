"""What files of each system do besides the common: read without an error, counted record by record."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import toolpaths
from toolpaths.cl.inspect import inspect
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import Severity, has_errors
from toolpaths.toolpath import Role, Toolpath

NX = "TOOL PATH/A,TOOL,T1\nTLDATA/MILL,10,0,50,0,0\nMSYS/0,0,0,1,0,0,0,1,0\nFEDRAT/MMPM,600\n"
CREO = "$$-> MFGNO / X\nUNITS / MM\nFEDRAT / 600, MMPM\n"
CATIA = "$$ CATIA APT\nPARTNO X\nFEDRAT/600,MMPM\n"
ISO = "UNITS/MM\nFEDRAT/600\n"


def result(text: str, *codes: str) -> ReadResult:
    """The text read without an error; `codes` are the warnings that must come, and no other."""
    found = read_bytes(text, units=None if "UNIT" in text else "mm")
    noted = [d for d in found.diagnostics if d.severity is not Severity.INFO]
    assert not [str(d) for d in noted if d.severity is Severity.ERROR]
    assert sorted({d.code for d in noted}) == sorted(codes), [str(d) for d in noted]
    return found


def read(text: str, *codes: str) -> Toolpath:
    return result(text, *codes).toolpath


def counts(text: str, *codes: str) -> tuple[object, ...]:
    found = inspect(result(text, *codes))
    return found["points"], found["arcs"], found["cycles"], found["holes"]


def test_counts_of_an_nx_listing_with_text_around_it() -> None:
    text = ("=" * 60 + "\nInformation listing created by :  somebody\nDate              :  2/4/2013 9:17:44\n"
            "Current work part :  C:\\parts\\plate.prt\nNode name         :  pc7\n" + "=" * 60 + "\n" + NX
            + "FROM/0,0,99\nRAPID\nGOTO/0,0,50,0,0,1\nRAPID\nRAPID\nGOTO/10,0,0\n"
            "CIRCLE/0,0,0,0,0,-1,10,.03,.5,10,0\nGOTO/0,10,0\nPAINT/COLOR,37\n"
            "CYCLE/DRILL,RAPTO,3,FEDTO,-5,RTRCTO,AUTO,MMPM,90\nPAINT/COLOR,31\nGOTO/1,1,0\nGOTO/2,1,0\n"
            "CYCLE/ON,FEDTO,-7\nGOTO/3,1,0\nCYCLE/OFF\nGOHOME/0,0,99\nPAINT/TOOL,NOMORE\nEND-OF-PATH\n"
            "Tool Path Listing has 34 lines.\nIZLAZ\n")
    assert counts(text) == (6, 1, 1, 3)


def test_counts_of_expanded_subprograms() -> None:
    body = ("RAPID\nGOTO / 1,0,0\nCIRCLE / 0,0,0,0,0,1,1\nGOTO / 0,1,0\n"
            "CYCLE / DRILL, DEPTH, 1, MMPM, 10, CLEAR, 1\nGOTO / 0,2,0\nCYCLE / OFF\n")
    text = CREO + (f"DEFSUB / 1\n{body}ENDSUB\nTRANS / 0, 0, 5\nCALSUB / 1\nTRANS / 0, 0, -5\nCALSUB / 1\n"
                   "GOTO / 9,9,9\nFINI\n")
    assert counts(text) == (7, 2, 2, 2)
    assert read(text).tip[[0, 3], 2].tolist() == [5, -5]


def test_counts_of_catia_arcs_and_nx_splines_that_carry_their_ends() -> None:
    arc = "AUTOPS\nINDIRV/0,1,0\nTLON,GOFWD/ (CIRCLE/0,0,0,$\n 10),ON,(LINE/0,0,0,$\n 0,10,0)\n"
    assert counts(CATIA + "GOTO  / 10,0,0\n" + arc + "GOTO  / 0,20,0\nEND\nrubbish 1\n") == (3, 1, 0, 0)
    spline = "NURBS/\nKNOT/1\nCNTRL/1,1,0\nCNTRL/2,1,0\nCNTRL/3,0,0\n"
    two = spline + spline.replace("CNTRL/", "CNTRL/1")
    assert counts(NX + f"GOTO/0,0,0,0,0,1\n{two}GOTO/50,0,0\n") == (4, 0, 0, 0)


def test_data_comments_that_continue_are_no_points() -> None:
    text = CREO.replace("$$-> MFGNO", "$$ -> MFGNO") + ("$$-> CSYS / 1.0, 0.0, 0.0, 1.0,  $\n 0.0, 1.0, 0.0, 0.0,  $\n"
                                                        " 0.0, 0.0, 1.0, 0.0\nGOTO / 1, 2, 3\n")
    assert result(text).evidence == "$$->MFGNO in line 1"
    assert counts(text) == (1, 0, 0, 0)
    assert read(text).tip.tolist() == [[2, 2, 3]]


def test_several_points_after_a_creo_circle_are_points_of_the_arc() -> None:
    text = CREO + "GOTO / 10,0,0\nCIRCLE / 0,0,0,0,0,1,10\nGOTO / 7.0710678,7.0710678,0\nGOTO / 0,10,0\nFINI\n"
    assert counts(text) == (3, 1, 0, 0)
    assert read(text).arcs.sweep.tolist() == pytest.approx([math.pi / 4])


@pytest.mark.parametrize("between", ["FEDRAT/60", "PPRINT/here", "COOLNT/OFF", "CUTCOM/OFF", "REMARK x", "$$ n"])
def test_records_that_do_not_move_may_stand_between_an_arc_and_its_end(between: str) -> None:
    p = read(ISO + f"GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\n{between}\nGOTO/0,10,0\n")
    assert p.arcs.sweep.tolist() == pytest.approx([math.pi / 2])


@pytest.mark.parametrize(("end", "plane", "crossing", "sweep"), [
    ("10,1,5", "1,0,0,0", "ON", 90), ("10,-1,5", "1,0,0,0", "ON", 90), ("10,1,5", "0,-1,0,10", "TANTO", 270),
    ("10,1,5", "0.70710678,-0.70710678,0,0", "ON", 45), ("10,1,5", "0.0,1.0,0,0", "ON", 180),
])
def test_arcs_of_postworks_to_a_plane(end: str, plane: str, crossing: str, sweep: float) -> None:
    text = ISO + (f"GOTO/10,0,5\nPSIS / (PLANE/ 0,0,1,5)\nINDIRP/{end}\nTLON,GOFWD/(CIRCLE/CANON, 0,0,5,$\n 0,0,1, 10),"
                  f"{crossing},$\n (PLANE/{plane})\n")
    found = result(text)
    assert found.dialect == "ncl"
    assert np.degrees(found.toolpath.arcs.sweep) == pytest.approx([sweep])
    assert found.toolpath.tip[1, 2] == 5.0


def test_indirp_is_a_point_and_the_circle_may_lie_below_the_start() -> None:
    p = read(ISO + "GOTO/10,20,5\nINDIRP/9,15,5\nTLON,GOFWD/(CIRCLE/CANON,0,20,2,0,0,1,10),ON,(PLANE/1,0,0,0)\n")
    assert p.tip[1] == pytest.approx([0, 10, 5])
    assert p.arcs.normal.tolist() == [[0, 0, -1]]


def test_records_are_counted_even_where_they_cannot_be_carried_out() -> None:
    found = inspect(read_bytes(ISO + "GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\nRAPID\nGOTO/0,1,0\n"))
    assert (found["points"], found["arcs"]) == (2, 1)


def test_a_machine_called_makino_does_not_turn_the_arcs_of_creo() -> None:
    text = CREO + "MACHIN / MAKINO, 01\nGOTO / 10,0,0\nCIRCLE / 0,0,0,0,0,1,10\nGOTO / 0,10,0\nFINI\n"
    assert result(text).dialect == "creo"
    assert read(text).arcs.sweep.tolist() == pytest.approx([math.pi / 2])


def test_cycles_of_catia_by_place_say_how_they_were_read() -> None:
    p = read(CATIA + "GOTO  / 1,2,30\nCYCLE/TAP,50.786017,1.0\nGOTO  / 1,2,3\nCYCLE/OFF\n"
             "CYCLE/DRILL,  126.0,   85.0,    0.1,MMPR\nGOTO  / 0,0,0\nCYCLE/OFF\n", "cl.cycle-place", "cl.cycle-start")
    assert [(c.kind, c.depth, c.clearance, c.retract) for c in p.cycles] == [
        ("TAP", 50.786017, 0, 0), ("DRILL", 126, 85, 85)]
    assert (p.cycles[0].feed, p.cycles[1].feed) == (pytest.approx(1 / 60), 0.1)


@pytest.mark.parametrize("planes", ["CLEAR,15,RTRCTO,20,RAPTO,5", "RAPTO,5,CLEAR,15,RETURN,20"])
def test_rapto_is_the_start_plane_where_clear_stands_too(planes: str) -> None:
    c = read(ISO + f"GOTO/0,0,9\nCYCLE/DRILL, FEDTO, 10, MMPM, 60, {planes}\nGOTO/1,2,3\nCYCLE/OFF\n").cycles[0]
    assert (c.depth, c.clearance, c.retract) == (10, 5, 20)


def test_nx_pecking_repeated_with_other_depths() -> None:
    p = read(NX + "CYCLE/DRILL,DEEP,STEP,20.0,CLEAR,3.0,FEDTO,-72.0,RTRCTO,AUTO,MMPM,250.0\nGOTO/1,2,70\n"
             "CYCLE/ON,FEDTO,-74.5,RTRCTO,AUTO\nGOTO/3,2,70\nCYCLE/ON,FEDTO,-72,RTRCTO,AUTO\nGOTO/4,4,70\nCYCLE/OFF\n")
    assert [(c.kind, c.depth, c.clearance, c.retract, c.steps) for c in p.cycles] == [
        ("DEEP", d, 3, None, (20,)) for d in (72, 74.5, 72)]


def test_wire_and_programs_of_the_machine_are_reported() -> None:
    wire = NX.replace("MILL,10,0,50,0,0", "WEDM,0.2,25,0") + "SET/UPPER,25.0,LOWER,0.0\nLOAD/WIRE\nGOTO/1,2,3,0,0,1\n"
    assert len(read(wire, "cl.wire")) == 1
    assert len(read(CREO + "CALSUB/START_PROG\nGOTO / 1,2,3\n", "cl.subprogram")) == 1


def test_motion_that_is_switched_off_needs_no_carrying_out() -> None:
    assert len(read(ISO + "CUT\nTRACUT/NOMORE\nCOPY/NOMORE\nGOTO/1,2,3\n")) == 1


def test_the_long_form_of_toolno_leaves_the_sizes_to_cutter() -> None:
    p = read(CATIA + "CUTTER/ 10.0,  2.0,  3.0,  2.0,  0.0,$\n 0.0, 50.0\nTOOLNO/1,MILL,1,0,   14.1,  100.0,$\n  100.0,"
             "  100.0,   20.0,   15.0,,   40.0,$\n 1000.0,MMPM,   70.0,RPM,CLW,$\nON,,NOTE\nLOADTL/1,1,1\nGOTO  / 1,2,3\n"
             "TOOLNO/2,DRILL,5.0\nLOADTL/2\nGOTO  / 1,1,1\n")
    assert [(t.number, t.shape, t.diameter, t.corner_radius, t.length_register) for t in p.tools] == [
        (1, "MILL", 10, 2, 1), (2, "DRILL", 5, None, None)]


def test_modifiers_of_fedrat_are_no_feed() -> None:
    p = read(ISO + "FEDRAT/MAXRPM,2\nGOTO/1,1,1\nFEDRAT/OVPLOT,5,MMPM,60\nGOTO/2,2,2\n", "cl.feed-option")
    assert p.feed.tolist() == [10, 1]


@pytest.mark.parametrize(("record", "word", "feed"), [
    ("FEDRAT/MMPM,120,SCALE,0.5", "SCALE", 2), ("FEDRAT/SCALE,2", "SCALE", 10), ("FEDRAT/LENGTH,5,MMPM,60", "LENGTH", 1),
    ("FEDRAT/LOCK,ON", "LOCK", 10), ("FEDRAT/MMPM,120,MAXIPM,20", "MAXIPM", 2)])
def test_what_changes_the_feed_is_refused_and_left_out_as_the_hint_says(record: str, word: str,
                                                                        feed: float) -> None:
    text = f"{ISO}{record}\nGOTO/1,1,1\nFINI\n"
    found = [d for d in read_bytes(text).diagnostics if d.severity is Severity.ERROR]
    assert [(d.code, d.lines) for d in found] == [("cl.feed-option", (ISO.count("\n") + 1,))]
    assert f"--allow-unknown {word} takes the feed as it stands" in found[0].hint
    result = read_bytes(text, allow_unknown=[word])
    assert not has_errors(result.diagnostics) and "cl.feed-option" in {d.code for d in result.diagnostics}
    assert result.toolpath.feed.tolist() == [feed]


def test_dwell_is_delay() -> None:
    p = read(ISO + "GOTO/1,1,1\nDWELL/2\nDELAY/3,REV\n")
    assert [(e.word, e.values) for e in p.events] == [("DELAY", (2.0,)), ("DELAY", (3.0, "REV"))]


def test_text_that_begins_with_a_known_word_outside_the_program() -> None:
    assert len(read("FROM THE SHOP\n" + ISO + "GOTO/1,2,3\nFINI\nEND OF FILE\n")) == 1


def test_set_ups_turned_over() -> None:
    p = read("UNIT/MM\nTRNTYP/WORLD,0,0,0\nSETUP/START,1\nCSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0\nFEDRAT/10.,MMPM\nGOTO/1,2,3\n"
             "SETUP/END,1\nSETUP/START,2\nTRNTYP/WORLD,0,0,0\nCSYS/1.,0,0,0,0,-1.,0,0,0,0,-1.,-10.\nGOTO/1,2,3\nFINI\n")
    assert p.tip.tolist() == [[1, 2, 3], [1, -2, -13]]
    assert p.axis.tolist() == [[0, 0, 1], [0, 0, -1]]
    assert p.role.tolist() == [Role.POINT, Role.POINT]


@pytest.mark.parametrize("end", ["10,0,-2", "10,0.0003,-2", "9.9999999,-0.0003,-2"])
def test_a_helix_that_ends_below_its_start_makes_a_whole_turn(end: str) -> None:
    """On a tilted face rounding moves the end a hair ahead of the start: no tiny arc climbs that steeply."""
    p = read(ISO + f"GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/{end}\n")
    assert p.arcs.sweep.tolist() == pytest.approx([2 * math.pi], abs=1e-4)


def test_a_tiny_arc_in_the_plane_stays_tiny() -> None:
    p = read(ISO + "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/10,0.0003,0\n")
    assert p.arcs.sweep.tolist() == pytest.approx([3e-5])


def test_few_arcs_that_all_sweep_more_than_half_a_turn_are_reported() -> None:
    arcs = "".join(f"CIRCLE/0,0,0,0,0,-1,10\nGOTO/{end}\n" for end in ("0,10,0", "-10,0,0", "-6,-8,0"))
    found = result(ISO + "GOTO/10,0,0\n" + arcs.replace("-10,0,0", "-6,8,0"), "cl.arc-sense")
    assert inspect(found)["arcs_over_180_deg"] == 3
    assert inspect(read_bytes(ISO + "GOTO/10,0,0\n" + arcs, dialect="nx"))["arcs_over_180_deg"] == 0


@pytest.mark.parametrize(("record", "end", "sweep"), [
    ("MOVARC/ CENTER, 0, 0, 0, AXIS, 0, 0, 1, RADIUS, 10", "0, 10, 0", 90),
    ("ARCSLP/ -2\nMOVARC/ CENTER, 0, 0, 0, AXIS, 0, 0, -1, RADIUS, 10", "0, 10, -2", 270),
    ("MOVARC/CENTER,0,0,0,AXIS,0,0,1,RADIUS,10,TIMES,2", "0,10,-4", 810),
    ("MOVARC/CENTER,0,0,0,AXIS,0,0,1,RADIUS,10,ANGLE,450", "0,10,-4", 450),
    ("MOVARC/CENTER,0,0,0,AXIS,0,0,1,RADIUS,10", "10,0,0", 360),
])
def test_movarc_with_words_for_its_parts(record: str, end: str, sweep: float) -> None:
    p = read(ISO + f"GOTO/10,0,0\n{record}\nGOTO/{end}\n")
    assert np.degrees(p.arcs.sweep) == pytest.approx([sweep])
    assert p.arcs.radius.tolist() == [10]


@pytest.mark.parametrize("record", ["MOVARC/CENTER,0,0,0,AXIS,0,0,1", "MOVARC/CENTER,0,0,RADIUS,5,AXIS,0,0,1",
                                    "MOVARC/0,0,0,0,0,1,9"])
def test_movarc_without_one_of_its_parts(record: str) -> None:
    found = read_bytes(ISO + f"GOTO/10,0,0\n{record}\nGOTO/0,10,0\n")
    assert [d.code for d in found.diagnostics] == ["cl.circle"]


def test_eleven_numbers_of_a_circle_are_left_hand_where_the_system_writes_fewer() -> None:
    text = ("UNITS/MM\nCSI_SET_FLUTE_LENGTH/30\nLOADTL/1, 0, 75, 1\nFEDRAT/600, MMPM\nGOTO/10, 0, 0\n"
            "CIRCLE/0, 0, 0, 0, 0, -1, 10, 90.0, 0.0, 0.0, 0.0\nGOTO/0, 10, 0\n")
    assert read(text).arcs.sweep.tolist() == pytest.approx([math.pi / 2])
    assert read(text.replace("10, 90.0, 0.0, 0.0, 0.0", "10")).arcs.sweep.tolist() == pytest.approx([1.5 * math.pi])


def test_rigid_tapping_by_pitch() -> None:
    record = "CYCLE/RIGID, DEPTH, 12, PITCH, 1.25, CLEAR, 15, RETURN, 20, RAPTO, 3"
    c = read(ISO + f"GOTO/0,0,9\n{record}\nGOTO/1,2,3\n").cycles[0]
    assert (c.kind, c.depth, c.clearance, c.retract, c.pitch, c.feed, int(c.feed_mode)) == ("TAP", 12, 3, 20, 1.25, 1.25, 1)


def test_an_nx_arc_that_ends_a_hair_behind_its_start_goes_back_that_way() -> None:
    p = read(NX + "GOTO/68.9,0,0,0,0,1\nCIRCLE/0,0,0,0,0,-1,68.9,.03,.5,10,0\nGOTO/68.9,-0.0001,0\n",
             "cl.arc-back")
    assert p.arcs.sweep.tolist() == pytest.approx([0.0001 / 68.9], rel=1e-6)
    assert p.arcs.normal.tolist() == [[0, 0, -1]]


def test_an_operation_without_its_end_is_named_where_others_have_theirs(tmp_path: Path) -> None:
    whole = "TOOL PATH/A,TOOL,T1\nGOTO/1,2,3\nEND-OF-PATH\nTOOL PATH/B,TOOL,T1\nGOTO/1,2,4\nEND-OF-PATH\n"
    for text, found in ((whole, []), (whole[:-12], [("cl.no-end-of-path", (4,))]), (whole.replace("END-OF-PATH\n", ""), []),
                        (whole.replace("END-OF-PATH\n", "", 1), [("cl.no-end-of-path", (1,))]),
                        (whole[:-14], [("cl.cut-off", (5,)), ("cl.no-end-of-path", (4,))]), (whole[:-1], [])):
        file = tmp_path / "part.cls"
        file.write_text(text)
        _, diagnostics = toolpaths.read(file)
        assert sorted((d.code, d.lines) for d in diagnostics if d.code in ("cl.no-end-of-path", "cl.cut-off")) == found, text
