"""Words that a control works out itself, and frames that the reader has not: refused by name, with what to do."""

from __future__ import annotations

import pytest

from machines.loader import load
from postproc.controllers.model import load_controller
from postproc.cycle_time.source import from_gcode
from postproc.setup.model import SetupFile

ISO = "%\nO1\nG21 G90 G17 G94\nG0 X0. Y0. Z50.\nG1 Z0. F500.\n{}\nX0. Y1.\nM30\n%\n"
SIN = "G17 G710 G90 G94\nG0 X0 Y0 Z50\nG1 Z0 F500\n{}\nY10\nM30\n"
TNC = "BEGIN PGM A MM\nTOOL CALL 1 Z S900\nL X+0 Y+0 Z+50 R0 FMAX M3\nL Z+0 F500\n{}\nL Y+10\nM30\nEND PGM A MM\n"
REFUSED = (
    ("siemens-840d", SIN, ("ANG=30", "X10 CHF=2", "X10 CHR=2", "X10 RND=2", "RNDM=2", "R1=$P_UIFR[1,X,TR]", "DEF FRAME M1",
                           "$P_UIFR[1]=CTRANS(X,1)", "$P_PFRAME=CROT(Z,45)", "SUBP(1)\nM30\nPROC SUBP(REAL A)")),
    ("fanuc-30i", ISO, ("X10. ,C2.", "X10. ,R2.", "X5. ,A30.")),
    ("haas-ngc", ISO, ("G101 X0.", "G47 P0 X0. Y0. J10.", "G112", "G12 I5.", "G150 X0. Y0. P5")),
    ("heidenhain-tnc640", TNC, ("CYCL DEF 26.0 AXIS-SPEC. SCALING", "RND R2",
                                "CHF 2", "APPR LT X+0 Y+0 LEN5 RL", "DEP LT LEN5", "FL X+5")))


@pytest.mark.parametrize(("controller", "program", "row"), [(c, p, row) for c, p, rows in REFUSED for row in rows])
def test_it_is_refused_by_its_name_with_what_to_do(controller: str, program: str, row: str) -> None:
    spec, _ = load_controller(controller)
    assert spec is not None
    made, found = from_gcode(program.format(row).encode(), load("mill-3axis"), spec, SetupFile(), "a.nc")
    [one] = [d for d in found if d.code == "gcode.not_executed"]
    line = program.format(row).splitlines().index(row.splitlines()[0]) + 1
    assert made is None and one.lines == (line,) and "is not executed" in one.message and one.hint


def test_a_comment_and_a_program_without_fault_are_left_alone() -> None:
    spec, _ = load_controller("fanuc-30i")
    assert spec is not None
    wrong, found = from_gcode(ISO.format("G99999 (G51 X0., ,C2.)").encode(), load("mill-3axis"), spec, SetupFile(), "a.nc")
    assert wrong is None and not [d for d in found if d.code == "gcode.not_executed"]
    right, found = from_gcode(ISO.format("X1. (RND, G51)").encode(), load("mill-3axis"), spec, SetupFile(), "a.nc")
    assert right is not None and not [d for d in found if d.code == "gcode.not_executed"]


def test_haas_has_no_polar_coordinates() -> None:
    spec, _ = load_controller("haas-ngc")
    assert spec is not None
    for code in ("G15", "G16"):
        made, found = from_gcode(ISO.format(code).encode(), load("mill-3axis"), spec, SetupFile(), "a.nc")
        assert made is None and any(f"{code} is no code of Haas" in d.message for d in found)
