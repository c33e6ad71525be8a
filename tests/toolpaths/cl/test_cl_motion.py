"""Points, axes, feeds, arcs, splines and frames against numbers worked out by hand."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.cl.spline_chords import de_boor, spline_points
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import FeedMode, Kind, Role, Toolpath

NX = "TOOL PATH/A,TOOL,T1\nTLDATA/MILL,10,0,50,0,0\nMSYS/0,0,0,1,0,0,0,1,0\nFEDRAT/MMPM,600\n"


def read(text: str, dialect: str | None = None) -> Toolpath:
    result = read_bytes(text, dialect=dialect, units=None if "UNIT" in text else "mm")
    assert not [str(d) for d in result.diagnostics if d.severity is Severity.ERROR]
    return result.toolpath


def test_modal_axis_of_nx_starts_again_with_each_operation() -> None:
    p = read(NX + "GOTO/0,0,0,1,0,0\nGOTO/1,0,0\nGOTO/2,0,0,0,1,0\nGOTO/3,0,0\nEND-OF-PATH\n" + NX + "GOTO/4,0,0\n")
    assert p.axis.tolist() == [[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]]
    assert p.operation.tolist() == [0, 0, 0, 0, 1]
    assert [op.name for op in p.operations] == ["A", "A"]


def test_axes_off_by_rounding_are_normalised() -> None:
    p = read(NX + "GOTO/0,0,0,0.5773503,0.5773503,0.5773503\n")
    assert np.linalg.norm(p.axis[0]) == pytest.approx(1.0, abs=1e-15)


def test_nine_numbers() -> None:
    p = read("UNITS/MM\nFEDRAT/1\nGOTO/1,2,3,0,0,1,0.6,0,0.8\nGOTO/1,2,3\nGOTO/4,5,6,0,0,1,7,8,9\n")
    assert p.normal is not None and p.contact is not None
    assert p.normal[0].tolist() == [0.6, 0.0, 0.8]
    assert np.isnan(p.normal[1:]).all()
    assert p.contact[2].tolist() == [7.0, 8.0, 9.0]


@pytest.mark.parametrize(("record", "feed", "mode"), [
    ("FEDRAT/MMPM,600", 10.0, FeedMode.PER_TIME), ("FEDRAT/600.,MMPM", 10.0, FeedMode.PER_TIME),
    ("FEDRAT / 60.0,  IPM", 25.4, FeedMode.PER_TIME), ("FEDRAT/600", 10.0, FeedMode.PER_TIME),
    ("FEDRAT/PERMIN,600", 10.0, FeedMode.PER_TIME), ("FEDRAT/.25,MMPR", 0.25, FeedMode.PER_REVOLUTION),
    ("FEDRAT/IPR,.01", 0.254, FeedMode.PER_REVOLUTION), ("FEDRAT/PERREV,.5", 0.5, FeedMode.PER_REVOLUTION),
    ("FEDRAT/1,FPM", 5.08, FeedMode.PER_TIME), ("FEDRAT/INVERS,30", 0.5, FeedMode.INVERSE_TIME),
    ("FEDRAT/FPR,1", 304.8, FeedMode.PER_REVOLUTION),
])
def test_feed_units(record: str, feed: float, mode: FeedMode) -> None:
    p = read(f"UNITS/MM\n{record}\nGOTO/1,2,3\n")
    assert p.feed[0] == pytest.approx(feed, rel=1e-15)
    assert p.feed_mode[0] == mode


def test_bare_feed_of_an_inch_file_and_inch_points() -> None:
    p = read("UNITS/INCHES\nFEDRAT/60\nGOTO/1,-2,.5\n")
    assert p.feed[0] == pytest.approx(25.4)
    assert p.tip.tolist() == [[1 * 25.4, -2 * 25.4, 0.5 * 25.4]]
    assert p.units == "inch"


def test_rapid_holds_for_one_move_and_the_feed_returns() -> None:
    p = read("UNITS/MM\nFEDRAT/600\nGOTO/0,0,0\nRAPID\nRAPID\nGOTO/1,0,0\nGOTO/2,0,0\nRAPID/\nFROM/9,9,9\nGOTO/3,0,0\n")
    assert p.kind.tolist() == [Kind.FEED, Kind.RAPID, Kind.FEED, Kind.RAPID, Kind.RAPID]
    assert p.role[3] == Role.START
    assert np.isnan(p.feed[[1, 3, 4]]).all()
    assert p.feed[2] == 10.0
    assert p.pass_.tolist() == [0, 1, 1, 2, 2]


def test_goto_of_two_numbers_with_zsurf() -> None:
    p = read("UNITS/MM\nFEDRAT/60\nZSURF/7\nGOTO/1,2\nGOTO/1,2,4\n")
    assert p.tip.tolist() == [[1, 2, 7], [1, 2, 4]]


@pytest.mark.parametrize("numbers", ["1,2,3,600", "1,2,3,0,0,1,600"])
def test_a_number_too_many_is_no_feed(numbers: str) -> None:
    """A comma or a blank within a number leaves the same; the remedy is a FEDRAT before the GOTO."""
    found = read_bytes(f"UNITS/MM\nGOTO/{numbers}\n")
    assert "cl.goto-feed" in [d.code for d in found.diagnostics if d.severity is Severity.ERROR and "FEDRAT" in d.hint]
    assert read(f"UNITS/MM\nFEDRAT/600\nGOTO/{numbers.removesuffix(',600')}\n").feed.tolist() == [10.0]


def test_godlta() -> None:
    p = read("UNITS/MM\nFEDRAT/60\nGOTO/1,2,3,0,1,0\nGODLTA/1,1,1\nGODLTA/5\nGODLTA/0,0,1,0,0,1\nGOTO/0,0,0\n")
    assert p.tip.tolist() == [[1, 2, 3], [2, 3, 4], [2, 8, 4], [2, 8, 5], [0, 0, 0]]
    assert p.axis[3].tolist() == [0, 0, 1]


def test_gohome() -> None:
    p = read("UNITS/MM\nFEDRAT/60\nGOTO/1,2,3\nGOHOME/0,0,100\nGOHOME\n")
    assert (p.kind[1], p.role[1]) == (Kind.RAPID, Role.HOME)
    assert [(e.word, e.index) for e in p.events] == [("GOHOME", 2)]


def arc(text: str, dialect: str | None = None) -> tuple[float, list[float], list[float], float]:
    p = read(text, dialect)
    assert p.kind[p.arc == 0].tolist() == [Kind.ARC]
    a = p.arcs
    return float(a.sweep[0]), a.normal[0].tolist(), a.center[0].tolist(), float(a.radius[0])


def test_nx_circle_is_left_hand() -> None:
    sweep, normal, center, radius = arc(NX + "GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1,10,.03,.5,10,0\nGOTO/0,-10,0\n")
    assert (sweep, normal, center, radius) == (pytest.approx(math.pi / 2), [0, 0, -1], [0, 0, 0], 10.0)
    sweep, normal, _, _ = arc(NX + "GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,-1,10,.03,.5,10,0\nGOTO/0,-10,0\n")
    assert (sweep, normal) == (pytest.approx(1.5 * math.pi), [0, 0, 1])


def test_nx_helix_center_goes_to_the_start_and_times_adds_turns() -> None:
    text = NX + "GOTO/10,0,9,0,0,1\nCIRCLE/0,0,5,0,0,-1,10,.03,.5,10,0,TIMES,2\nGOTO/-10,0,5\n"
    assert arc(text) == (pytest.approx(5 * math.pi), [0, 0, 1], [0, 0, 9], 10.0)


def test_nx_whole_turns_that_end_a_rounding_behind_the_start() -> None:
    text = NX + "GOTO/10,0,0,0,0,1\nCIRCLE/0,0,-5,0,0,-1,10,.03,.5,10,0,TIMES,3\nGOTO/10,-0.0001,-5\n"
    assert arc(text)[0] == pytest.approx(6 * math.pi, abs=1e-4)


def test_the_coremill_trap() -> None:
    """An arc of NX that ends 0.0001 mm ahead of its start is tiny, not a whole circle."""
    text = NX + "GOTO/68.9,0,0,0,0,1\nCIRCLE/0,0,0,0,0,-1,68.9,.03,.5,10,0\nGOTO/68.9,0.0001,0\n"
    assert arc(text)[0] == pytest.approx(0.0001 / 68.9, rel=1e-6)


@pytest.mark.parametrize("head", ["$$-> MFGNO / X\nUNITS/MM\nFEDRAT/60\n", "TRNTYP/WORLD,0,0,0\nUNIT/MM\nFEDRAT/60\n",
                                  "UNITS/MM\nFEDRAT/60\n"])
def test_right_hand_dialects_and_full_circles(head: str) -> None:
    assert arc(head + "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\n")[:2] == (pytest.approx(math.pi / 2), [0, 0, 1])
    full = arc(head + "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,-1,10\nGOTO/10,0,0\n")
    assert full[:2] == (pytest.approx(2 * math.pi), [0, 0, -1])
    helix = arc(head + "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/10,0,-4\n")
    assert helix[0] == pytest.approx(2 * math.pi)


@pytest.mark.parametrize(("word", "sweep", "normal"), [("COUNTERCLOCKWISE", 0.5, [0, 0, 1]),
                                                       ("CLOCKWISE", 1.5, [0, 0, -1])])
def test_clt_word_decides_the_sense(word: str, sweep: float, normal: list[float]) -> None:
    text = f"UNITS/MM\nFEDRAT/60\nGOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10,{word}\nGOTO/0,10,0\n"
    assert arc(text)[:2] == (pytest.approx(sweep * math.pi), normal)


def test_movarc() -> None:
    text = "UNITS/MM\nFEDRAT/60\nGOTO/10,0,0\nMOVARC/0,0,0,0,0,1,10,ANGLE,{}\nGOTO/{}\n"
    assert arc(text.format(450, "0,10,0"))[:2] == (pytest.approx(2.5 * math.pi), [0, 0, 1])
    assert arc(text.format(-90, "0,-10,0"))[:2] == (pytest.approx(0.5 * math.pi), [0, 0, -1])


def test_arc_in_an_inch_file_and_a_turned_frame() -> None:
    text = ("TOOL PATH/A,TOOL,T\nUNITS/INCHES\nMSYS/1,2,3,0,1,0,0,0,1\nFEDRAT/10\nGOTO/1,0,0,0,0,1\n"
            "CIRCLE/0,0,0,0,0,-1,1,.03,.5,1,0\nGOTO/0,1,0\n")
    sweep, normal, center, radius = arc(text)
    assert sweep == pytest.approx(math.pi / 2)
    assert normal == pytest.approx([1, 0, 0])
    assert center == pytest.approx([25.4, 50.8, 76.2])
    assert radius == pytest.approx(25.4)
    assert read(text).tip == pytest.approx(25.4 * np.array([[1, 3, 3], [1, 2, 4]]))


def test_catia_arcs_by_direction() -> None:
    head = "$$ CATIA\nFEDRAT/60\nGOTO/10,0,0\nAUTOPS\nINDIRV/0,{},0\nTLON,GOFWD/ (CIRCLE/0,0,0,$\n10),ON,"
    p = read(head.format(1) + "(LINE/0,0,0,$\n0,10,0)\nGOTO/0,0,0\n")
    assert p.tip.tolist() == [[10, 0, 0], [0, 10, 0], [0, 0, 0]]
    assert p.arcs.sweep[0] == pytest.approx(math.pi / 2)
    p = read(head.format(-1) + "2,INTOF,(LINE/0,0,0,0,10,0)\n")
    assert p.arcs.sweep[0] == pytest.approx(1.5 * math.pi)
    assert p.arcs.normal[0].tolist() == [0, 0, -1]


def test_catia_cylinder_arc() -> None:
    text = ("$$ CATIA\nFEDRAT/60\nGOTO/0,10,0\nPSIS/(PLANE/(POINT/0,0,0),PERPTO,(VECTOR/1,0,0))\nINDIRV/0,0,1\n"
            "TLON,GOFWD/(CYLNDR/0,0,0,1,0,0,10),ON,(PLANE/PERPTO,(PLANE/(POINT/0,0,0),PERPTO,$\n(VECTOR/1,0,0)),"
            "(POINT/0,0,0),(POINT/0,0,10))\n")
    assert arc(text)[:2] == (pytest.approx(math.pi / 2), [1, 0, 0])


def test_nurbs() -> None:
    control = [[0, 0, 0], [0, 10, 0], [10, 10, 0], [10, 0, 0], [20, 0, 5]]
    text = NX + "GOTO/0,0,0,0,0,1\nNURBS/\nKNOT/0.5, $\n1\n" + "".join(
        f"CNTRL/{x},{y},{z}\n" for x, y, z in control[1:]) + "GOTO/30,0,0\n"
    p = read(text)
    assert (p.role == Role.POINT).sum() == 3
    assert p.tip[p.role == Role.POINT].tolist() == [[0, 0, 0], [20, 0, 5], [30, 0, 0]]
    knots = np.array([0, 0, 0, 0, 0.5, 1, 1, 1, 1.0])
    dense = de_boor(np.array(control, float), knots, np.linspace(0, 1, 5000), 3)
    chain = p.tip[:-1]
    gap = max(min(_gap(q, a, b) for a, b in pairwise(chain)) for q in dense[::50])
    assert 1e-5 < gap < 0.0011
    assert len(chain) < 200


def _gap(q: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    t = np.clip((q - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return float(np.linalg.norm(a + t * (b - a) - q))


def test_a_bezier_span_equals_its_polynomial() -> None:
    control = np.array([[0, 0, 0], [1, 3, 0], [4, 1, 2], [6, 0, 1.0]])
    points = spline_points(control, np.array([1.0]), 1e-3)
    t = np.array([next(r.real for r in np.roots([x3, x2, 3.0, -x]) if abs(r.imag) < 1e-9 and -1e-9 < r.real < 1.0 + 1e-9)
                  for x3, x2, x in ((-3.0, 6.0, x) for x in points[:, 0].tolist())])[:, None]  # x = 3 t + 6 t2 - 3 t3
    want = (1 - t) ** 3 * control[0] + 3 * t * (1 - t) ** 2 * control[1] + 3 * t ** 2 * (1 - t) * control[2] \
        + t ** 3 * control[3]
    assert points == pytest.approx(want, abs=1e-9) and (np.diff(t[:, 0]) > 0.0).all()


def test_frames_of_nx() -> None:
    text = ("TOOL PATH/A,TOOL,T\nMSYS/10,0,0,0,1,0,1,0,0\nFEDRAT/MMPM,1\nGOTO/1,2,3\nEND-OF-PATH\n"
            "TOOL PATH/B,TOOL,T\nMSYS/0,0,0,1,0,0,0,1,0\nFEDRAT/MMPM,1\nGOTO/1.1,2.2,3.3\nEND-OF-PATH\n"
            "TOOL PATH/C,TOOL,T\nMSYS/10,0,0,0,1,0,1,0,0\nFEDRAT/MMPM,1\nGOTO/0,0,0\n")
    p = read(text)
    assert p.tip.tolist() == [[12, 1, -3], [1.1, 2.2, 3.3], [10, 0, 0]]
    assert p.axis.tolist() == [[0, 0, -1], [0, 0, 1], [0, 0, -1]]
    assert len(p.frames) == 2
    assert [op.frame for op in p.operations] == [0, 1, 0]
    assert p.frames[0].origin == (10.0, 0.0, 0.0)


def test_creo_points_of_six_numbers_are_in_the_common_frame() -> None:
    frame = "$$-> CSYS / 1,0,0,5, $\n0,0,-1,0, $\n0,1,0,7\n"
    p = read("UNITS/MM\nFEDRAT/1\n" + frame + "GOTO/1,2,3\nMULTAX / ON\nGOTO/1,2,3,0,-1,0\n")
    assert p.tip.tolist() == [[6, -3, 9], [1, 2, 3]]
    assert p.axis.tolist() == [[0, -1, 0], [0, -1, 0]]


def test_creo_rotate_turns_the_points_unless_a_system_follows() -> None:
    head = "$$-> MFGNO / A\nUNITS/MM\nFEDRAT/1\nGOTO/0,0,1\nROTATE / AAXIS, INCR, -90, CCLW\nRAPID\n"
    p = read(head + "GOTO/0,0,1\nROTATE / AAXIS, INCR, 90, CCLW\nRAPID\nGOTO/0,0,1\n")
    assert p.tip == pytest.approx(np.array([[0, 0, 1], [0, -1, 0], [0, 0, 1]]), abs=1e-15)
    assert [e.word for e in p.events] == ["ROTATE", "ROTATE"]
    p = read(head + "$$-> CSYS / 1,0,0,0, $\n0,0,-1,0, $\n0,1,0,0\nGOTO/0,0,1\n")
    assert p.tip[1].tolist() == [0, -1, 0]


def test_trans_and_subprograms_under_changing_frames() -> None:
    text = ("$$-> MFGNO / A\nUNITS/MM\nFEDRAT/1\nDEFSUB / 1\nGOTO/1,0,0\nRAPID\nGOTO/2,0,0\nENDSUB\n"
            "GOTO/9,9,9\nTRANS / 0, 0, 5\nCALSUB / 1\nTRANS / 0, 0, 0\nGOTO/8,8,8\n"
            "$$-> CSYS / 0,-1,0,0, $\n1,0,0,0, $\n0,0,1,100\nCALSUB / 1\n")
    p = read(text)
    assert p.tip.tolist() == [[9, 9, 9], [1, 0, 5], [2, 0, 5], [8, 8, 8], [0, 1, 100], [0, 2, 100]]
    assert p.kind.tolist() == [1, 1, 0, 1, 1, 0]
    assert p.line.tolist() == [9, 5, 7, 13, 5, 7]


def test_subprograms_bear_numbers_or_names() -> None:
    head = "UNITS/MM\nFEDRAT/1\nDEFSUB/7\nGOTO/7,0,0\nENDSUB\nDEFSUB/Hole-7\nGOTO/1,0,0\nENDSUB\n"
    p = read(head + "CALSUB/HOLE-7\nDEFSUB/hole-7\nGOTO/2,0,0\nCALSUB/LATER\nENDSUB\nCALSUB / hole-7\n"
             "DEFSUB/LATER\nGOTO/3,0,0\nENDSUB\nCALSUB/7\n")
    assert p.tip[:, 0].tolist() == [1, 2, 3, 7]
    for call, said in (("HOLE", "HOLE: the subprogram is not defined; the file defines 7, HOLE-7; else"),
                       ("", "is not defined"), ("8", "8: the subprogram is not defined")):
        found = read_bytes(f"{head}CALSUB/{call}\n").diagnostics
        assert sum(said in str(d) for d in found if d.code == "cl.subprogram") == 1
    assert any("no CALSUB runs subroutine HOLE-7" in str(d) for d in read_bytes(head).diagnostics)
    found = read_bytes("UNITS/MM\nFEDRAT/1\nDEFSUB\nGOTO/7,0,0\nENDSUB\nGOTO/1,1,1\n").diagnostics
    assert [str(d) for d in found if "DEFSUB without the number or name of its subprogram; write DEFSUB/1" in str(d)]


def test_points_of_subprograms_are_local_even_with_six_numbers() -> None:
    text = ("$$-> MFGNO / A\nUNITS/MM\nFEDRAT/1\nMULTAX / ON\nDEFSUB / 1\nGOTO/1,0,0,0,0,1\nENDSUB\n"
            "$$-> CSYS / 1,0,0,10, $\n0,1,0,0, $\n0,0,1,0\nCALSUB / 1\nGOTO/1,0,0,0,0,1\n"
            "$$-> CSYS / 1,0,0,20, $\n0,1,0,0, $\n0,0,1,0\nCALSUB / 1\n")
    assert read(text).tip[:, 0].tolist() == [11, 1, 21]


def test_catia_axis_system_and_operation_names() -> None:
    text = ("$$*CATIA0\n$$ Manufacturing Program.1\n$$    1.00000    0.00000    0.00000   10.00000\n"
            "$$    0.00000   -1.00000    0.00000    0.00000\n$$    0.00000    0.00000   -1.00000    5.00000\n"
            "$$ OPERATION NAME : Pocketing.1\nFEDRAT/100,MMPM\nGOTO  / 1.0, 2.0, 3.0\n")
    p = read(text)
    assert p.tip.tolist() == [[11, -2, 2]]
    assert p.operations[0].name == "Pocketing.1"


def test_clt_rotabl_is_in_radians() -> None:
    p = read("MOVE_ATTRIB/LEADIN\nUNIT/MM\nFEDRAT/1,MMPM\nGOTO/0,0,1\nROTABL/ 1.570796326794897,AAXIS,TABLE,CCLW\n"
             "GOTO/0,0,1\n")
    assert p.tip[1] == pytest.approx([0, -1, 0], abs=1e-12)


@pytest.mark.parametrize(("text", "dialect", "evidence"), [
    ("TOOL PATH/A,TOOL,B\n", "nx", "TOOL PATH in line 1"), ("$$\n$$-> FEATNO / 3\n", "creo", "$$->FEATNO in line 2"),
    ("TRNTYP/WORLD,0,0,0\n", "solidworks", "TRNTYP in line 1"), ("MOVE_ATTRIB/LEADIN,1\n", "solidworks-clt", "line 1"),
    ("CIRCLE/0,0,0,0,0,1,5,CLOCKWISE\n", "solidworks-clt", "sense word in line 1"),
    ("$$*CATIA0\n", "catia", "CATIA0"), ("PARTNO/MAKINO-FF\n", "makino", "MAKINO"), ("$$ CATIA APT\n", "catia", "CATIA"),
    ("PPRINT/NCL V10\n", "ncl", "NCL"), ("GOTO/1,2,3\n", "generic", "no word"),
])
def test_dialects_are_recognised(text: str, dialect: str, evidence: str) -> None:
    result = read_bytes(text)
    assert result.dialect == dialect
    assert evidence in result.evidence


def test_the_dialect_can_be_given() -> None:
    text = "UNITS/MM\nFEDRAT/1\nGOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,-10,0\n"
    assert arc(text, "nx")[0] == pytest.approx(math.pi / 2)
    assert arc(text)[0] == pytest.approx(1.5 * math.pi)


def units(text: str, **options: str) -> tuple[str, list[tuple[str, str]]]:
    result: ReadResult = read_bytes(text, **options)
    return result.toolpath.units, [(d.code, d.severity.name) for d in result.diagnostics if "unit" in d.code]


def test_where_units_come_from() -> None:
    assert units("UNITS/MM \nGOTO/1,2,3\nFEDRAT/1,IPM\n") == ("mm", [])
    assert units("GOTO/1,2,3\nFEDRAT/1,MMPM\n") == ("mm", [("cl.no-units", "INFO")])
    assert units("GOTO/1,2,3\nFEDRAT/1,IPM\n") == ("inch", [("cl.no-units", "WARNING")])
    assert units("GOTO/1,2,3\n") == ("mm", [("cl.no-units", "WARNING")])
    assert units("GOTO/1,2,3\n", units="inch") == ("inch", [])
    assert units("UNITS/MM\nGOTO/1,2,3\n", units="inch") == ("inch", [("cl.units", "WARNING")])


def test_axis_starts_again_even_without_a_system() -> None:
    p = read("TOOL PATH/A,TOOL,T\nFEDRAT/MMPM,1\nGOTO/0,0,0,1,0,0\nEND-OF-PATH\nTOOL PATH/B,TOOL,T\nGOTO/1,0,0\n")
    assert p.axis.tolist() == [[1, 0, 0], [0, 0, 1]]


def test_a_new_operation_begins_a_pass_without_a_rapid() -> None:
    p = read("TOOL PATH/A,TOOL,T\nFEDRAT/MMPM,1\nGOTO/0,0,0\nGOTO/1,0,0\nEND-OF-PATH\nTOOL PATH/B,TOOL,T\nGOTO/2,0,0\n"
             "LOADTL/2\nGOTO/3,0,0\n")
    assert p.pass_.tolist() == [0, 0, 1, 2]
