"""Macro language of each control: where short programs go, by hand from the maker's rules, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.readback.macros.held import most_blocks
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, TNC, executed, faults, good, words

LINUXCNC = "linuxcnc"
HEAD = "%\nO0001\nG17 G21 G40 G49 G80 G90 G94 G98\nG54\nG0 X0. Y0. Z0.\n"
SINUMERIK = "G17 G40 G90 G94 G54 G71\nG0 X0 Y0 Z0\n"
ROTATION = "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 "
SCALE = "CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 "
MIRROR = "CYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1 "
DRILL = ("CYCL DEF 200 DRILLING Q200=+2 Q201=-20 Q206=+100 Q202=+5 Q210=+0 Q203=+0 Q204=+10 Q211=+0\n")


def track(control: str, body: str, **others: bytes) -> list[list[float]]:
    """Where the axes go, behind a first block at zero."""
    head, end = (SINUMERIK, "M30\n") if control == SIEMENS else (HEAD, "M30\n%\n")
    if control == TNC:
        head, end = "BEGIN PGM A MM\nL X+0 Y+0 Z+0 R0 FMAX\n", "L M30\nEND PGM A MM\n"
    subprograms = body.partition("@")[2].lstrip("\n")
    text = head + body.partition("@")[0] + ((subprograms and end.replace("%\n", "") + subprograms) or end)
    files = {name.replace("_", "."): data for name, data in others.items()}
    return words(good(control, text, others=files))[1:]


@pytest.mark.parametrize(("body", "ends"), [
    ("#1=2.\nWHILE[#1GT0]DO1\nG0 X#1 Y[#1*#1]\n#1=#1-1\nEND1\n", [[2, 4, 0], [1, 1, 0]]),
    ("#1=3\nIF[#1NE#0]GOTO20\nX9.\nN20 G0 Y#1 Z-#1\n", [[0, 3, -3]]),
    ("#2=7\nIF[#9EQ#0]THEN#2=8\nG0 X#2 Y#9\n", [[8, 0, 0]]),
    ("#1=ATAN[-1]/[1]\nG0 X#1 Y[1+2*3-6/2] Z[FUP[1.2]+FIX[-1.8]+ROUND[2.5]]\n", [[315, 4, 4]]),
    ("G65 P9000 A1. B2. I3. J4. I5. L2\n@O9000\nG91 G0 X#1 Y#7 Z[#4+#5]\nG90\nM99\n", [[1, 5, 7], [2, 10, 14]]),
    ("G66 P9000 A5.\nG0 X1.\nX2.\nG67\nX3.\n@O9000\nG0 Z#1\nG0 Z0.\nM99\n",
     [[1, 0, 0], [1, 0, 5], [1, 0, 0], [2, 0, 0], [2, 0, 5], [2, 0, 0], [3, 0, 0]]),
    ("#100=1\nM98 P20077\nG0 X9.\n@O77\nG91 X#100\nG90\n#100=#100+1\nM99\n", [[1, 0, 0], [3, 0, 0], [9, 0, 0]]),
    ("M98 P77 L1\nG0 X9.\nN50 G0 Y1.\n@O77\nIF[1EQ1]THEN#101=0\nM99 P50\n", [[0, 1, 0]]),
    ("G52 X10.\nG0 X1.\nG91 X1.\nG90\nG52 X0.\nX1.\nG92 X5. Y2.\nX6. Y2.\n", [[11, 0, 0], [12, 0, 0], [1, 0, 0], [2, 0, 0]]),
    ("G0 X4. Y3.\n#1=#5001 #2=#4001\nG0 Y[#1*2+#2]\n", [[4, 3, 0], [4, 8, 0]]),
    ("#1=#0\nG0 X1.\nX-#1 Y[POW[2.,3.]]\n", [[1, 0, 0], [1, 8, 0]]),
    ("G15 G50\nG90 G16\nG0 X100. Y90.\nG91 Y90.\nG90 X50.\nG15\nG0 X1. Y2.\n",
     [[0, 100, 0], [-100, 0, 0], [-50, 0, 0], [1, 2, 0]]),
    ("G68 X10. Y10. R90.\nG0 X20. Y10.\nY20.\nG1 X30. F100.\nG2 X40. Y20. I5. J0.\nG69\nG0 X1. Y1.\n",
     [[10, 20, 0], [0, 20, 0], [0, 30, 0], [0, 40, 0], [1, 1, 0]]),
    ("#1=2.\nPOPEN\nDPRNT[X#1[32]]\nPCLOS\nSETVN #100[LAST]\nG0 X#1\n", [[2, 0, 0]])])
@pytest.mark.parametrize("control", [FANUC, HAAS])
def test_custom_macro_b(control: str, body: str, ends: list[list[float]]) -> None:
    if control == HAAS:
        body = body.replace("P20077", "P77 L2")
    if control == HAAS and "G16" in body:
        assert faults(HAAS, f"{HEAD}{body}M30\n%\n") == {"gcode.unknown_code": [6]}
        return
    assert track(control, body) == [pytest.approx(end, abs=1e-12) for end in ends]


def test_a_bolt_hole_circle_by_radius_and_angle() -> None:
    """The example of Fanuc's manual (16/18, 9.2): holes at 30, 150 and 270 degrees on a radius of 100."""
    body = "G90 G16\nG81 X100. Y30. Z-20. R5. F200\nY150.\nY270.\nG15 G80\nG0 X5. Y5.\n"
    holes = [end for end in track(FANUC, body) if end[2] == -20.0]
    assert holes == [pytest.approx([x, y, -20.0]) for x, y in ((86.60254, 50.0), (-86.60254, 50.0), (0.0, -100.0))]


@pytest.mark.parametrize(("control", "body", "ends"), [
    (FANUC, "G51 X10. Y10. Z0. P2.\nG0 X20. Y10.\nG91 X1.\nG90 G50\nG0 X1. Y1.\n", [[30, 10, 0], [32, 10, 0], [1, 1, 0]]),
    (HAAS, "G51 X10. Y10. P2.\nG0 X20. Y10. Z5.\nG50\nG0 X1.\n", [[30, 10, 10], [1, 10, 10]]),
    (FANUC, "G51 X0. Y0. Z0. I2. J1. K1.\nG0 X2. Y3. Z4.\nG50\n", [[4, 3, 4]]),
    (FANUC, "G51.1 X10.\nG0 Y1.\nX0.\nG51.1 Y5.\nX1. Y1.\nG50.1 X0. Y0.\nX2.\n",
     [[0, 1, 0], [20, 1, 0], [19, 9, 0], [2, 9, 0]])])
def test_scaled_and_mirrored_points(control: str, body: str, ends: list[list[float]]) -> None:
    assert track(control, body) == [pytest.approx(end, abs=1e-12) for end in ends]


@pytest.mark.parametrize(("body", "plain"), [
    ("G0 X0. Y5.\nG51.1 X10.\nG0 X20. Y5.\nG2 X30. Y5. I5. J0. F100.\nX40. Y5. R5.\nG50.1 X0.\nX-30. Y5. R5.\n",
     "G0 X0. Y5.\nG0 X0. Y5.\nG3 X-10. Y5. I-5. J0. F100.\nX-20. Y5. R5.\nG2 X-30. Y5. R5.\n"),
    ("G51 X0. Y0. Z0. P2.\nG1 X5. Y0. F100.\nG3 X0. Y5. I-5. J0.\nG2 X5. Y0. R5.\nG50\nX0. Y10. R10.\n",
     "G1 X10. Y0. F100.\nG3 X0. Y10. I-10. J0.\nG2 X10. Y0. R10.\nX0. Y10. R10.\n"),
    ("G51.1 Y0.\nG41 D1 G1 X9. Y1. F100.\nX20.\nG2 X30. Y11. R10.\nG40 G1 Y30.\nG50.1 Y0.\n",
     "G42 D1 G1 X9. Y-1. F100.\nX20.\nG3 X30. Y-11. R10.\nG40 G1 Y-30.\n"),
    ("G51.1 X0.\nG98 G81 X10. Y10. Z-5. R2. F100.\nX20.\nG80\nG50.1 X0.\n",
     "G98 G81 X-10. Y10. Z-5. R2. F100.\nX-20.\nG80\n")])
def test_circles_contours_and_holes_run_as_the_same_program_written_out(body: str, plain: str) -> None:
    """G2 and G3, G41 and G42 interchanged where one axis of the plane is mirrored, radii scaled."""
    one, other = (good(FANUC, f"{HEAD}{text}M30\n%\n") for text in (body, plain))
    columns = [np.nan_to_num(np.asarray(getattr(m, name), dtype=float))
               for name in ("code", "ccw", "center", "hole", "compensation") for m in (one, other)]
    assert all(a == pytest.approx(b, abs=1e-9) for a, b in zip(columns[::2], columns[1::2], strict=True))
    assert words(one) == [pytest.approx(row, abs=1e-9) for row in words(other)]


def test_a_mirror_image_of_klartext_is_the_same_program_written_out() -> None:
    """About the datum in force; DR and the side of the tool turn round where one axis of the plane is mirrored."""
    for body, plain in (
            (f"TRANS DATUM AXIS X+10\n{MIRROR}X\nL X+5 Y+3 RL F100\nL IX+2\nCC X+0 Y+0\nC X+7 Y-3 DR+\nL X+0 R0\n"
             f"{MIRROR}\nL X+1\n",
             "L X+5 Y+3 RR F100\nL X+3\nCC X+10 Y+0\nC X+3 Y-3 DR-\nL X+10 R0\nL X+11\n"),
            (f"{MIRROR}X Y\nL X+5 Y+3 F100\nCR X+7 Y+3 R+1 DR-\n", "L X-5 Y-3 F100\nCR X-7 Y-3 R+1 DR-\n")):
        one, other = (good(TNC, f"BEGIN PGM A MM\nL X+0 Y+0 Z+0 R0 FMAX\n{text}L M30\nEND PGM A MM\n")
                      for text in (body, plain))
        assert (one.ccw == other.ccw).all() and (one.compensation == other.compensation).all()
        np.testing.assert_allclose(words(one), words(other), atol=1e-9)


def test_a_scale_of_klartext_is_the_same_program_written_out() -> None:
    """About the datum in force: ends, increments, poles and radii, along the tool too; not the axes that turn, nor M91."""
    for body, plain in (
            (f"TRANS DATUM AXIS X+10\n{SCALE}SCL0.5\nL X+4 Y+6 Z-2 F100\nL IX+2 IZ-4\nCC X+6 Y+3\nC X+3 Y+3 DR+\n"
             f"CR X+5 Y+3 R+1 DR-\nL Z+8 R0 FMAX M91\nL Z+7 FMAXM 091\nL Z+8 M91\n{SCALE}SCL 1\nL X+1\n",
             "L X+12 Y+3 Z-1 F100\nL X+13 Z-3\nCC X+13 Y+1.5\nC X+11.5 Y+1.5 DR+\nCR X+12.5 Y+1.5 R+0.5 DR-\n"
             "L Z+8 FMAX M91\nL Z+7 FMAX M91\nL Z+8 M91\nL X+11\n"),
            (f"{SCALE}SCL2\nCR X+4 Y+0 R+2 DR- F100\n", "CR X+8 Y+0 R+4 DR- F100\n")):
        one, other = (good(TNC, f"BEGIN PGM A MM\nL X+0 Y+0 Z+0 R0 FMAX\n{text}L M30\nEND PGM A MM\n")
                      for text in (body, plain))
        assert (one.ccw == other.ccw).all()
        np.testing.assert_allclose(words(one), words(other), atol=1e-9)


def test_a_rotation_of_klartext_is_the_same_program_written_out() -> None:
    """About the datum in force, also of axes that a block leaves out, of poles and of increments; ends of circles alike."""
    for body, plain in (
            (f"TRANS DATUM AXIS X+10\n{ROTATION}ROT+90\nL X+5 Y+3 F100\nL Z-2\nL X+7\nL IY+2\nCC X+0 Y+5\nC X-7 Y+5 DR-\n"
             f"{ROTATION}ROT+0\nL X+1\n",
             "L X+7 Y+5 F100\nL Z-2\nL X+7 Y+7\nL X+5 Y+7\nCC X+5 Y+0\nC X+5 Y-7 DR-\nL X+11\n"),
            (f"{ROTATION}ROT+60\n{ROTATION}IROT+30\nL Y+1 X+2 R0 FMAX\nCR X+4 Y+1 R+1 DR+ F100\n",
             "L X-1 Y+2 R0 FMAX\nCR X-1 Y+4 R+1 DR+ F100\n")):
        one, other = (good(TNC, f"BEGIN PGM A MM\nL X+0 Y+0 Z+0 R0 FMAX\n{text}L M30\nEND PGM A MM\n")
                      for text in (body, plain))
        assert (one.ccw == other.ccw).all() and (one.code == other.code).all()
        np.testing.assert_allclose(words(one), words(other), atol=1e-9)


@pytest.mark.parametrize(("control", "text"), [
    (TNC, ROTATION + "ROT+9\nL X+1 FMAX\n"), (TNC, ROTATION + "ROT+9\nL X+1 Y+1 FMAX\nCC X+1\nC X+2 Y+1 DR+ F9\n"),
    (TNC, ROTATION + "ROT+9\nTRANS DATUM AXIS X+1\n"), (TNC, ROTATION + "ROT+9\nTRANS DATUM RESET\n"),
    (TNC, "CC X+1 Y+1\n" + ROTATION + "ROT+9\nL X+1 Y+1 FMAX\nC X+1 Y+1 DR+ F9\n"),
    (TNC, ROTATION + "ROT+9\n" + MIRROR + "X\n"), (TNC, "L X+1 Y+1 RL F100\n" + ROTATION + "ROT+9\n"),
    (TNC, ROTATION + "ROT+9\nL X+1 Y+1 F100 M128\n"), (TNC, MIRROR + "Z\n"), (TNC, MIRROR + "X\nLP PR+10 PA+0 FMAX\n"),
    (TNC, MIRROR + "X\nTRANS DATUM AXIS X+1\n"), (TNC, ROTATION + "ROT+9\nL X+1 Y+1 FMAX\nL X+1 Y+1 FMAX M91\nL X+2 FMAX\n"),
    (TNC, MIRROR + "X\nL X+1 F100 M128\n"), (TNC, "L X+1 Y+1 RL F100\n" + MIRROR + "X\n"),
    (TNC, MIRROR + "X\nCYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+9\n"),
    (TNC, MIRROR + "X\nCYCL CALL POS X+1 Y+1 Z+0 FMAX\n"),
    (TNC, SCALE + "SCL2\n" + DRILL), (TNC, DRILL + SCALE + "SCL2\nL X+1 FMAX M99\n"),
    (TNC, DRILL + SCALE + "SCL2\nL X+1 FMAX M 099\n"), (TNC, MIRROR + "X\nL X+1 F100M0128\n"),
    (TNC, SCALE + "SCL2\n" + MIRROR + "X\n"), (TNC, SCALE + "SCL2\nTRANS DATUM RESET\n"),
    (TNC, SCALE + "SCL2\nCC X+0 Y+0\nLP PR+1 PA+0 FMAX\n"),
    (TNC, "CC X+1 Y+1\n" + SCALE + "SCL2\nL X+2 Y+1 FMAX\nC X+2 Y+1 DR+ F9\n"), (TNC, SCALE + "SCL2\nPLANE RESET STAY\n"),
    (FANUC, "G51 X0. Y0. P2000\n"), (FANUC, "G51 X0. Y0. Z0. P2.\nG81 X1. Y1. Z-1. R1. F9.\n"), (FANUC, "G51.1 X0.\nG55\n"),
    (FANUC, "G51.1 X0.\nG68 X0. Y0. R9.\n"), (FANUC, "G68 X0. Y0. R9.\nG51.1 X0.\n"), (FANUC, "G51.1 X0.\nG50.1\n"),
    (FANUC, "G51 X0. Y0. Z0. I1. J2. K1.\nG2 X4. Y0. R2. F9.\n"), (FANUC, "G41 D1 G1 X5. F9.\nG51.1 X0.\n"),
    (FANUC, "G51.1 X0.\n#1=#5041\n"), (FANUC, "G51.1 X0.\nG51 X0. Y0. Z0. P2.\n"), (FANUC, "G51 X0. Y0. Z0.\n"),
    (FANUC, "G51 X0. Y0. Z0. P2. I2. J2. K2.\n"), (FANUC, "G51 X0. P0.\n"), (FANUC, "G91\nG51 X0. Y0. Z0. P2.\n"),
    (FANUC, "G0 X1. G51.1 X0.\n"), (FANUC, "G51.1 X0.\nG0 X10\n"), (FANUC, "G51.1 X0.\nG18\n"),
    (FANUC, "G51.1 X0.\nG28 Z0.\n"),
    (FANUC, "G51.1 X0.\nG50\n"), (FANUC, "G51.1 Z0.\nG81 X1. Y1. Z-1. R1. F9.\n"), (FANUC, "G43.4 H1\nG51.1 X0.\n"),
    (HAAS, "G51.1 X0.\n"), (HAAS, "G51 X0. Y0. P2\n"),
    (FANUC, "G16\nG0 X10.\n"), (FANUC, "G16\nG1 X9. Y0. F9\nG2 X9. Y90. I-9. J0.\n"), (HAAS, "G16\nG91 G0 X9. Y9.\n"),
    (FANUC, "G68 R30.\n"), (FANUC, "G68 X1. Y1. R30.\nG0 X4.\n"), (FANUC, "G68 X1. Y1. R30.\nG0 X4. Y4.\nG91 X1.\n"),
    (FANUC, "G68 X1. Y1. R30.\nG28 Z0.\n"), (FANUC, "G68 X1. Y1. R30\nG69\n"), (FANUC, "G16\nG0 X10 Y30.\n"),
    (FANUC, "G52 X5.\nG0 X10\n"), (FANUC, "G68 X0. Y0. Z5. R30.\n"), (FANUC, "G68 X0. Y0. Z0. I0. J0. K1. R30.\n"),
    (FANUC, "G68 X0. Y0. R9.\nG0 X1. Y0.\n#1=#5001\n"), (FANUC, "G16\nG0 X1. Y0.\n#1=#5041\n"),
    (FANUC, "G50.1 X0 Y0\n"), (FANUC, "G50 X0\n"), (FANUC, "G68 X0. Y0. R9.\nG16\n"), (HAAS, "G234 H1\nG68 X0. Y0. R9.\n"),
    (FANUC, "G68 X0. Y0. R9.\nG0 X1. Y0.\nG55\nX2. Y2.\n"), (FANUC, "G68 X0. Y0. R9.\nG0 X1. Y0.\nG69\nG91 X5.\n"),
    (HAAS, "G254\nG68 X0. Y0. R9.\n"), (FANUC, "G43.4 H1\nG68 X0. Y0. R9.\n"),
    (FANUC, "G68.2 X0 Y0 Z0 I0 J9. K0\nG68 X0. Y0. R9.\n"),
    (FANUC, "G16\nG1 X9. Y0. F9\nG2 X9. Y90. R9.\nX9. Y180. I-9. J0.\n"),
    (HAAS, "G68 X0. Y0. R90.\nG83 X10. Y0. Z-10. R2. I5. J1. K2. F100.\n"),
    (FANUC, "G16\nG81 X10. Y0. Z-5. R2. F100.\nG91 Y30. L3\n"),
    (TNC, "TRANS DATUM AXIS X+1\nL X+1 F100 M128\n"), (TNC, "L M128\nTRANS DATUM AXIS X+1\nL X+1 F100\n"),
    (TNC, "CC X+0 Y+0\nTRANS DATUM AXIS X+5\nLP PR+10 PA+0 FMAX\n"), (TNC, DRILL + "TRANS DATUM AXIS Z+5\nL X+1 FMAX M99\n"),
    (TNC, "TRANS DATUM AXIS Z+5\n" + DRILL + "TRANS DATUM RESET\nL X+1 FMAX M99\n"),
    (TNC, "TRANS DATUM TABLE TABLINE5\n"), (TNC, "CYCL DEF 7.1 #5\n"),
    (TNC, "TRANS DATUM AXIS X+1\nPLANE SPATIAL SPA+0 SPB+0 SPC+0 STAY\n")])
def test_what_of_planes_and_datums_is_not_executed_is_said(control: str, text: str) -> None:
    tnc = f"BEGIN PGM A MM\nL X+0 Y+0 Z+0 R0 FMAX\n{text}L M30\nEND PGM A MM\n"
    found = set(faults(control, tnc if control == TNC else f"{HEAD}{text}M30\n%\n"))
    assert found and found <= {"gcode.mode", "gcode.decimal_point", "gcode.data_setting", "gcode.unknown_code",
                               "gcode.not_executed"}


@pytest.mark.parametrize(("body", "ends"), [
    ("DEF REAL _HOME=4, LIST[2,2]=SET(1,2,3,4)\nDEF INT II\nR1=3\nX=_HOME+R1*2 Y=LIST[1,0]\n", [[10, 3, 0]]),
    ("DEF INT II\nFOR II=1 TO 3\nX=II\nENDFOR\n", [[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
    ("R1=0\nTOP: R1=R1+1\nIF R1<3 GOTOB TOP\nX=R1\n", [[3, 0, 0]]),
    ("R1=1\nIF (R1==1) AND (R1<>2)\nX1\nELSE\nX2\nENDIF\n", [[1, 0, 0]]),
    ("R1=2\nCASE R1 OF 1 GOTOF AA 2 GOTOF BB DEFAULT GOTOF CC\nAA: X1\nBB: X2\nCC: Y=IC(R1)\n", [[2, 0, 0], [2, 2, 0]]),
    ("R1=0\nREPEAT\nR1=R1+1\nUNTIL R1>=4\nWHILE R1>3\nX=R1\nR1=R1-1\nENDWHILE\n", [[4, 0, 0]]),
    ("G91\nPART: X1\nG90\nG91\nREPEAT PART P2\nG90\n", [[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
    ("DEF REAL _LIST[2,2]\n_LIST[0,1]=SET(7,8)\nX=_LIST[0,1] Y=_LIST[1,0]\n_LIST[0,0]=REP(5)\nX=_LIST[1,1]\n",
     [[7, 8, 0], [5, 8, 0]]),
    ("TRANS X10\nATRANS Y=2*3\nX1 Y1\nTRANS\nX1\n", [[11, 7, 0], [1, 7, 0]])])
def test_sinumerik(body: str, ends: list[list[float]]) -> None:
    assert track(SIEMENS, body) == ends


def test_sinumerik_calls_with_values() -> None:
    called = b"PROC HOLE(REAL DEEP, VAR REAL LAST, INT NN=2) SAVE\nG1 Z=-DEEP F100\nLAST=DEEP*NN\nRET\n"
    body = "DEF REAL BACK\nHOLE(3, BACK)\nX=BACK\nHOLE(1, BACK, 5)\nX=BACK\n"
    assert track(SIEMENS, body, HOLE_SPF=called) == [[0, 0, -3], [6, 0, -3], [6, 0, -1], [5, 0, -1]]


@pytest.mark.parametrize(("body", "ends"), [
    ("Q1 = 2 * (3 + 4) - SQRT 16\nL X+Q1 Y-Q1 FMAX\n", [[10, -10, 0]]),
    ("FN 0: Q1 = +3\nLBL 1\nL IX+1 FMAX\nFN 2: Q1 = +Q1 - +1\nFN 11: IF +Q1 GT +0 GOTO LBL 1\n",
     [[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
    ("Q5 = 1\nLBL 1\nL IX+Q5 FMAX\nCALL LBL 1 REP 2\n", [[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
    ("FN 8: Q1 = +3 LEN +4\nFN 13: Q2 = +1 ANG +1\nFN 4: Q3 = +9 DIV +2\nL X+Q1 Y+Q2 Z+Q3 FMAX\n", [[5, 45, 4.5]]),
    ("CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+60\nCYCL DEF 7.2 Y+40\nL X+1 Y+2 FMAX\nL IX+5 FMAX\n"
     "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 IX+10\nL X+1 Y+2 FMAX\n"
     "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+0\nCYCL DEF 7.2 Y+0\nL X+1 Y+2 FMAX\n",
     [[61, 42, 0], [66, 42, 0], [71, 42, 0], [1, 2, 0]]),
    ("Q1 = 3\nTRANS DATUM AXIS X+10 Y+Q1\nL X+Q1 Y+0 FMAX\nCC X+8 Y+0\nC X+13 Y+0 DR+ F500\nTRANS DATUM RESET\nL X+0 FMAX\n",
     [[13, 3, 0], [23, 3, 0], [0, 3, 0]])])
def test_klartext(body: str, ends: list[list[float]]) -> None:
    assert track(TNC, body)[:len(ends)] == ends


def test_o_words_and_a_file_beside() -> None:
    body = "O<step> CALL [3]\nG0 X#<_value>\nO1 REPEAT [2]\nG91 G0 Y1\nG90\nO1 ENDREPEAT\n"
    beside = b"o<step> sub\ng0 z[#1 ** 2]\no<step> endsub [#1 + 0.5]\n"
    assert track(LINUXCNC, body, step_ngc=beside) == [[0, 0, 9], [3.5, 0, 9], [3.5, 1, 9], [3.5, 2, 9]]


def test_faults_stand_at_the_line_that_was_written() -> None:
    text = HEAD + "#1=1.\nWHILE[#1LT3]DO1\nG2 X#1 R.1 F9\n#1=#1+1\nEND1\nM30\n%\n"
    assert faults(FANUC, text).get("gcode.arc") == [8]
    assert faults(FANUC, text.replace("G2 ", "G51 "))["gcode.mode"] == [8]
    _, found = executed(FANUC, HEAD + "G65 P9000\nM30\n%\n", others={"O9000.nc": b"O9000\n\nG0 X#500\nM99\n"})
    assert [(d.code, d.file, d.lines) for d in found] == [("gcode.variable", "O9000.nc", (3,))]


def test_a_continue_of_a_do_before_a_break_is_refused_as_linuxcnc_leaves_the_loop_there() -> None:
    """rs274 of LinuxCNC 2.9 goes on behind the do, and runs the next repeat twice as often."""
    inside = ["#1=[#1+1]", "O2 IF [#1 EQ 2]", "O1 CONTINUE", "O2 ENDIF", "O3 IF [#1 GE 5]", "O1 BREAK", "O3 ENDIF", "G0 X#1"]
    text = "\n".join(["#1=0", "O1 DO", *inside, "O1 WHILE [#1 LT 10]"]) + "\n"
    assert list(faults(LINUXCNC, HEAD + text + "M2\n")) == ["gcode.jump"]
    first = "\n".join(["#1=0", "O1 DO", *inside[:1], *inside[4:7], *inside[1:4], *inside[7:], "O1 WHILE [#1 LT 10]"]) + "\n"
    assert [x for x, _, _ in track(LINUXCNC, first)] == [1, 3, 4]


@pytest.mark.parametrize("name", ["Q2", "PLATE-Q17", "QL3"])
def test_names_of_klartext_hold_no_parameters(name: str) -> None:
    """The name of a program is that of its file, which a user chooses."""
    text = f"BEGIN PGM {name} MM\nTOOL CALL \"MILL Q2\" Z S1000\nL X+0 Y+0 Z+0 R0 FMAX\n"
    text += f"L X+1 R0 FMAX M30\nEND PGM {name} MM\n"
    assert not [one for one in executed(TNC, text)[1] if one.code == "gcode.variable"]


@pytest.mark.parametrize(("control", "text"), [
    (FANUC, HEAD + "N1 #1=0\nGOTO1\nM30\n"), (LINUXCNC, HEAD + "O1 WHILE [1]\nO1 ENDWHILE\nM2\n"),
    (SIEMENS, SINUMERIK + "AA: R1=1\nGOTOB AA\nM30\n"), (TNC, "BEGIN PGM A MM\nLBL 1\n"
     "FN 9: IF +1 EQU +1 GOTO LBL 1\nEND PGM A MM\n")])
def test_a_program_without_an_end_is_refused(control: str, text: str) -> None:
    with most_blocks(500):
        assert set(faults(control, text)) == {"gcode.endless"}


@pytest.mark.parametrize(("control", "text", "code"), [
    (FANUC, HEAD + "#1=EXP[700.]*EXP[700.]\n#2=#1AND1\nM30\n%\n", "gcode.expression"),
    (FANUC, HEAD + "#1=EXP[700.]\nM98 P[#1*#1]\nM30\n%\n", "gcode.expression"),
    (FANUC, HEAD + "#1=485\n#2=BIN[#1]\nM30\n%\n", "gcode.expression"),
    (LINUXCNC, HEAD + "#1=[10**300]\nO1 REPEAT [#1*#1]\nO1 ENDREPEAT\nM2\n", "gcode.expression"),
    (SIEMENS, SINUMERIK + "R1=1EX300\nR2=B_NOT(R1*R1)\nM30\n", "gcode.expression"),
    (SIEMENS, SINUMERIK + "R1=2\nR=3\nM30\n", "gcode.variable"),
    (SIEMENS, "G17 G40 G90 G94 G54 G71\nGOTOF INSIDE\nFOR R1=1 TO 2\nINSIDE: ENDFOR\nM30\n", "gcode.jump"),
    (SIEMENS, SINUMERIK + "R1=1\nIF R1==1\nM30\n", "gcode.jump"),
    (SIEMENS, SINUMERIK + "DEF REAL _LIST[2]\n_LIST[1]=SET(7,8)\nM30\n", "gcode.variable"),
    (TNC, "BEGIN PGM A MM\nQ1 = 0\nQ2 = Q1 ^ -1\nEND PGM A MM\n", "gcode.expression")])
def test_numbers_and_rows_that_no_control_takes_are_faults_of_their_line(control: str, text: str, code: str) -> None:
    last = {FANUC: 7, LINUXCNC: 7, SIEMENS: 4, TNC: 3}[control]
    assert faults(control, text) == {code: [last]}


@pytest.mark.parametrize("call", ["M98 P50000005", "M98 P5 L90000000"])
def test_repeats_without_macro_language_are_bounded_as_well(call: str) -> None:
    program = HEAD + f"{call}\nM30\nO0005\nG91 G0 X1.\nG90\nM99\n%\n"
    with most_blocks(500):
        assert faults(FANUC, program) == {"gcode.endless": [6]}
    assert not faults(FANUC, program.replace(call, "M98 P90005"))
