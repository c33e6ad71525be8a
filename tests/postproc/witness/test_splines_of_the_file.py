"""Splines of the CL file are followed by the second witness with its own eyes: path, feed, where they end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

import postproc
from postproc.setup.model import SetupFile
from postproc.verification.second_witness import second_witness
from postproc.witness.splines import CHORD, goes_back, off_chords, points_of
from toolpaths.cl.read import read_bytes

FILE = """TOOL PATH/A,TOOL,MILL_10
UNITS/MM
TLDATA/MILL,10.0000,0.0000,80.0000,0.0000,0.0000
MSYS/20.0,5.0,3.0,0.0,1.0,0.0,-1.0,0.0,0.0
LOAD/TOOL,1
SPINDL/RPM,3000,CLW
COOLNT/FLOOD
RAPID
GOTO/10,0,50,0,0,1
FEDRAT/MMPM,250
GOTO/10,0,-3
FEDRAT/MMPM,600
NURBS/
KNOT/0.1,0.4,0.5, $
0.8,1.0
CNTRL/14,12,-3
CNTRL/-5,25,-3
CNTRL/-30,14,-3
$$ a remark
CNTRL/-34,-20,-3
CNTRL/-4,-40,-3
CNTRL/25,-24,-3
CNTRL/END,-3
NURBS/
KNOT/1
CNTRL/20,5,-3
CNTRL/25,10,-4
CNTRL/30,0,-3
RAPID
GOTO/30,0,50
END-OF-PATH
"""
ENDS = {"closed": "10,0", "open": "12,-9", "nearly closed": "10.005,0"}


@pytest.mark.covering
@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(("machine", "control"), [("mill-3axis", "fanuc-30i"), ("mikron-ucp710", "heidenhain-tnc640")])
def test_splines_are_compared(machine: str, control: str, end: str) -> None:
    read = read_bytes(FILE.replace("END,-3", f"{ENDS[end]},-3"))
    setup = {"tools": {"1": {"gauge_length": 120.0}}}
    made = postproc.convert(read.toolpath, machine, control, SetupFile.model_validate(setup), diagnostics=read.diagnostics)
    assert made.ok and made.witness is not None
    assert not made.witness.not_compared
    counts = {one.what: one.count for one in made.witness.compared}
    assert counts["positions"] == 5 and counts["feeds"] == 3


def test_a_spline_of_one_point_is_a_place_where_the_tool_stands() -> None:
    lines = FILE.replace("UNITS/MM", "UNITS/INCHES").replace("FEDRAT/MMPM,", "FEDRAT/IPM,").splitlines()
    begin, end = lines.index("NURBS/"), lines.index("RAPID", 10)
    point = "CNTRL/.3937008,0,-.1181102"
    lines[begin:end] = ["GOTO/.3937008,0,-.1181102", "NURBS/", "KNOT/1", *[point] * 3, "GOTO/1,0,-.1181102"]
    read = read_bytes("\n".join([*lines, ""]).replace("GOTO/10,0,", "GOTO/.4,0,").replace(",-3\n", ",-.1\n").replace(
        "50,0,0,1", "2,0,0,1").replace("MSYS/20.0,5.0,3.0", "MSYS/2.0,.5,.3").replace("30,0,50", "1,0,2"))
    made = postproc.convert(read.toolpath, "mill-3axis", "fanuc-30i", SetupFile.model_validate(
        {"tools": {"1": {"gauge_length": 120.0}}}), diagnostics=read.diagnostics)
    assert made.ok and made.witness is not None and not made.witness.not_compared


def test_points_are_those_of_scipy() -> None:
    random = np.random.default_rng(4)
    control, inner = random.normal(0.0, 20.0, (9, 3)), [0.1, 0.1, 0.3, 0.7, 0.8, 1.0]
    points = points_of(control, inner)
    true = BSpline(np.concatenate([np.zeros(4), inner, np.ones(3)]), control, 3)(np.linspace(0.0, 1.0, 301))
    assert off_chords(true, points).max() == 0.0
    assert off_chords(true + np.array([0.0, 0.0, 0.01]), points).max() > 0.01 - 0.001 - 2.0 * CHORD


@pytest.mark.parametrize("form", ["closed", "crossing"])
def test_the_way_along_a_spline_is_its_own(form: str) -> None:
    side = 20.0 if form == "crossing" else -20.0
    control = np.array([(0, 0, 0), (20, 20, 0), (40, side, 0), (40, -side, 0), (20, -20, 0), (0, 0, 0)], dtype=float)
    points = points_of(control, [0.3, 0.6, 1.0])
    some = points[::7]
    assert not goes_back(some, points, 0.01)
    assert goes_back(some[::-1], points, 0.01)
    assert goes_back(np.concatenate([some[:len(some) // 2], some[:len(some) // 2][::-1]]), points, 0.01)


def test_a_closed_spline_the_other_way_round_is_found() -> None:
    points = ["20,10", "25,20", "0,30", "-20,10", "-10,-10", "10,0"]
    knots = "KNOT/0.2,0.5,0.7,1.0"
    begin, end = FILE.index("KNOT/"), FILE.index("NURBS/\nKNOT/1\n")

    def text(order: list[str]) -> str:
        return FILE[:begin] + "\n".join([knots if order[0] == "20,10" else "KNOT/0.3,0.5,0.8,1.0",
                                         *(f"CNTRL/{p},-3" for p in order), ""]) + FILE[end:]

    read = read_bytes(text(points))
    made = postproc.convert(read.toolpath, "mill-3axis", "fanuc-30i", SetupFile.model_validate(
        {"tools": {"1": {"gauge_length": 120.0}}}), diagnostics=read.diagnostics)
    assert made.ok and made.job is not None and made.comparison is not None and made.source is not None
    other = replace(made.source, held=text([*points[-2::-1], points[-1]]).encode())
    _, found = second_witness(other, made.setup, made.options, made.job, made.comparison, made.text)
    assert {d.code for d in found} == {"witness.path"}
