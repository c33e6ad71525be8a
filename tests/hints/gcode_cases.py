"""Hints on programs of controls: `time` reads one as the control would run it."""

from __future__ import annotations

from tests.hints.case import Edit, HintCase
from tests.hints.machine_cases import machine_text

ISO = "%\nO1000\nG21 G90 G17 G40 G49 G80 G94 G98 G54\nT1 M6\nS900 M3\nG0 X1. Y2.\nG43 H1 Z50.\nG1 X5. F200.\nM30\n%\n"
EMC = "G21 G90 G17 G40 G49 G80 G94 G98 G54\nT1 M6\nS900 M3\nG43 H1\nG0 X1 Y2\nG0 Z50\nG1 X5 F200\nM2\n"
SIN = "G710 G90 G17 G40 G94 G54\nT1\nM6\nD1\nS900 M3\nG0 X1 Y2\nG0 Z50\nG1 X5 F200\nM30\n"
TNC = "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S900\n2 L X+1 Y+2 Z+50 R0 FMAX M3\n3 L X+5 F200\n4 M30\n5 END PGM A MM\n"
PROGRAMS = {"fanuc-30i": ISO, "haas-ngc": ISO, "linuxcnc": EMC, "siemens-840d": SIN, "heidenhain-tnc640": TNC}


def of(
    code: str,
    control: str,
    good: str,
    wrong: str,
    right: str,
    says: str,
    *,
    machine: str = "mill-3axis",
    command: str = "",
    stops: tuple[str, ...] = (),
) -> HintCase:
    """The usual program of a control with `wrong` in the place of `good`, then `right`; `good` "" puts it before the
    block with F."""
    text = PROGRAMS[control]
    feed = next(line for line in text.splitlines(keepends=True) if "F200" in line)
    old = good or feed
    assert old in text
    bad = text.replace(old, wrong + ("" if good else feed), 1)
    return HintCase(
        code,
        command or f"time p.nc -m {machine} -c {control}",
        {"p.nc": bad},
        says,
        (Edit("p.nc", wrong, right),),
        stops=stops,
    )


FANUC, HAAS, LINUXCNC, SIEMENS, HEIDENHAIN = PROGRAMS
_ISO = [
    of("gcode.reference", FANUC, "", "G28\n", r"\1\n", "write (G91 G28 Z0.)", stops=()),
    of("gcode.after_end", LINUXCNC, "G1 X5 F200\n", "M2\nG1 X5 F200\n", "G1 X5 F200\n", "take the early end out"),
    of("gcode.after_end", LINUXCNC, "", "%\n", "", "% may only be the first and the last line"),
    of("gcode.no_end", LINUXCNC, "M2\n", "(end)\n", r"\1\n", "write (M30) in its last line"),
    of(
        "gcode.no_motion",
        LINUXCNC,
        "G0 X1 Y2\nG0 Z50\nG1 X5 F200\n",
        "(nothing)\n",
        r"\1 X1\n",
        "name a program that has moves: (G0)",
    ),
    of("gcode.no_motion", LINUXCNC, "", "G80 X3\n", r"\1 X3\n", "state (G0) or G1"),
    of("gcode.number", LINUXCNC, "", "G0 X99999999999\n", "G0 X9\n", "correct the number"),
    of("gcode.repeated", LINUXCNC, "", "G0 X1 X2\n", "G0 X1\n", "one of each in a block"),
    of("gcode.syntax", LINUXCNC, "", "G0 X\n", "G0 X3\n", "a block is letters with numbers"),
    of("gcode.unknown_code", LINUXCNC, "", "M123\n", "", "take it out"),
    of("gcode.decimal_point", FANUC, "", "G05.1 Q1 R5.\nG05.1 Q0\n", "G05.1 Q1 R5\nG05.1 Q0\n", "write a whole number"),
    of("gcode.not_executed", SIEMENS, "", "X1 RND=2\nX3\n", "X1\nX3\n", "write the contour with the end points"),
    of("gcode.not_executed", HAAS, "", "G101 X0.\n", "", "write the points as they are meant"),
    of("gcode.decimal_point", FANUC, "", "G51 X0. Y0. P2000\nG50\n", "", "write the decimal point"),
    of("gcode.not_executed", SIEMENS, "", "$P_PFRAME=CTRANS(X,5)\n", "TRANS X5\n", "write TRANS, ROT, SCALE or MIRROR"),
    of("gcode.not_executed", SIEMENS, "", "R1=$P_UIFR[1,X,TR]\n", "R1=0\n", "put the figures into the program"),
    of("gcode.unknown_word", LINUXCNC, "", "G0 B5\n", r"G0 \1 5\n", "its axes are (X)"),
    of("gcode.unknown_word", SIEMENS, "", "SHOPCALL(1)\n", "", "take it out|neither a function"),
    of("gcode.feed", LINUXCNC, "G1 X5 F200\n", "G1 X5\n", r"G1 X5 \g<1>200\n", "state (F) before them"),
    of("gcode.units", SIEMENS, "G710", "G70", r"\1", "write (G700) in the place of G70"),
    of("gcode.decimal_point", FANUC, "X1. Y2.", "X1 Y2.", "X1. Y2.", "write the decimal point"),
    of("gcode.decimal_point", FANUC, "S900 M3", "S900. M3", "S900 M3", "write a whole number"),
    of("gcode.dwell", FANUC, "", "G4\n", "G4 P500\n", "state the time: .*P"),
    of("gcode.dwell", SIEMENS, "", "G4\n", r"\1\n", "state the seconds: (G4 F0.5)"),
    of("gcode.cycle", LINUXCNC, "", "G81 X1 Y1 R2 F100\nG80\n", "G81 X1 Y1 Z-5 R2 F100\nG80\n", "state Z and R"),
    of(
        "gcode.cycle", LINUXCNC, "", "G81 X1 Y1 Z-5 R2 F100 L1.5\nG80\n", "G81 X1 Y1 Z-5 R2 F100 L2\nG80\n", "a whole number"
    ),
    of("gcode.offset", FANUC, "G54\n", "G54.1 P999\n", "G54.1 P9\n", "P1 to P"),
    of("gcode.smoothing", FANUC, "", "G05.1 Q3\n", "G05.1 Q1\nG05.1 Q0\n", "write G05.1 Q1, or (G05.1 Q0)"),
    of("gcode.smoothing", HAAS, "", "G187 E-1.\n", "G187 E0.02\n", "state 0 or more"),
    of(
        "gcode.mode",
        FANUC,
        "",
        "G68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\n",
        r"\1\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\n",
        "write (G49) before it",
        machine="mikron-ucp710",
    ),
    of(
        "gcode.mode",
        FANUC,
        "",
        "G49\nG53.1\nG69\n",
        "G49\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\n",
        "write G68.2 X Y Z I J K in the block before",
        machine="mikron-ucp710",
    ),
    of(
        "gcode.rigid_tap",
        FANUC,
        "",
        "G84 X1. Y1. Z-5. R2. F900.\nG80\n",
        r"\1 S900\nG84 X1. Y1. Z-5. R2. F900.\nG80\n",
        "write (M29) S in the block before",
    ),
    of("gcode.machine_position", FANUC, "", "G1 G53 Z0.\n", r"\1 Z0.\n", "write (G53 G0)|write (G0 G53)"),
    of("gcode.second_reference", FANUC, "", "G91 G30 Z0.\nG90\n", r"G91 \1 Z0.\nG90\n", "write (G28)", stops=()),
    of("gcode.iso_units", SIEMENS, "", "G21\n", r"\1\n", "write (G71)", stops=()),
    of("gcode.tool_name", SIEMENS, "", 'T="EM10"\n', "T1\n", "the number of the tool", stops=()),
    of("gcode.subprogram", FANUC, "M30\n", "M99\n", r"\1\n", "write (M30)"),
    of("gcode.subprogram", FANUC, "", "M98 P77\n", "", "known are"),
    of("gcode.tool", SIEMENS, "D1\n", "D3\n", r"\1\n", "(D1) or D0"),
    of("gcode.tool", FANUC, "T1 M6", "M6", "T1 M6", "state T with its number in the block"),
    of("gcode.machine_position", SIEMENS, "", "SUPA G0 Z0\n", r"SUPA \1 G0 Z0\n", "write (D0) next to SUPA"),
    of("gcode.block_delete", LINUXCNC, "", "/M1\n", "M1\n", "with that switch off"),
    of(
        "gcode.mode",
        FANUC,
        "",
        "G49\nG68.2 P1 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\n",
        "G49\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\n",
        "write G68.2 X Y Z I J K",
        machine="mikron-ucp710",
    ),
    of(
        "gcode.mode",
        FANUC,
        "",
        "G49\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG0 X1.\nG53.1\nG69\n",
        "G49\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG0 X1.\nG69\n",
        "G53.1 alone, right behind G68.2",
        machine="mikron-ucp710",
    ),
    of(
        "gcode.rotary_in_plane",
        FANUC,
        "",
        "G49\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG0 C9.\nG69\n",
        "G49\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\nG0 C9.\n",
        "leave the plane, index",
        machine="mikron-ucp710",
    ),
    of("gcode.arc", HAAS, "", "G2 X9. Y2. I5. J0. F100.\n", "G2 X9. Y2. I4. J0. F100.\n", "correct its centre"),
]
_KLARTEXT = [
    of("gcode.curve", SIEMENS, "", "POLY PO[X]=(2,1) PO[]=(2,1) F100\n", "G1 X2 F100\n", "as lines or arcs"),
    of("gcode.curve", HEIDENHAIN, "", "SPL X+9 K3X+1 K2X+1 F100\n", r"SPL X+9 K3X+1 K2X+1 \1X-10 F100\n",
       "K3, K2 and (K1) of each"),
    of("gcode.arc", HEIDENHAIN, "", "CR X+9 Y+9 F100\n", r"CR X+9 Y+9 \1+9 DR+ F100\n", "(R)\\+ up to half a turn"),
    of("gcode.pole", HEIDENHAIN, "", "C X+9 Y+9 DR+ F100\n", "CC X+5 Y+2\nC X+9 Y+2 DR+ F100\n", "CC before it"),
    of("gcode.pole", HEIDENHAIN, "", "LP PR+9 PA+0 F100\n", "CC X+5 Y+2\nLP PR+9 PA+0 F100\n", "CC X Y"),
    of(
        "gcode.compensation",
        HEIDENHAIN,
        "",
        "L X+3 RL F100\nTOOL CALL 2 Z S900\n",
        "L X+3 R0 F100\nTOOL CALL 2 Z S900\n",
        "R0 before it",
    ),
    of("gcode.tool", HEIDENHAIN, "TOOL CALL 1 Z S900", "TOOL CALL 1 X S900", "TOOL CALL 1 Z S900", "TOOL CALL n Z S"),
    of("gcode.cycle", HEIDENHAIN, "", "CYCL CALL\n", "", "CYCL DEF before it"),
    of(
        "gcode.dwell",
        HEIDENHAIN,
        "",
        "CYCL DEF 9.0 DWELL TIME\nCYCL DEF 9.1\n",
        r"CYCL DEF 9.0 DWELL TIME\n\1\n",
        "(CYCL DEF 9.1 DWELL 0.5)",
    ),
    of("gcode.syntax", HEIDENHAIN, "", "LINE X5\n", "", "allowed are L, C"),
    of("gcode.mode", HEIDENHAIN, "", "PLANE RESET MOVE\n", r"\1\n", "(PLANE RESET STAY)", machine="mikron-ucp710"),
]
_ASK = [
    HintCase("time.open", "time q.nc -m mill-3axis -c linuxcnc", {"p.nc": EMC}, "name", (Edit("", "q.nc", "p.nc"),)),
    HintCase(
        "gcode.rollover",
        f"time p.nc -m m.toml -c {SIEMENS}",
        {"p.nc": SIN.replace("G1 X5", "G0 C=DC(90)\nG1 X5"), "m.toml": machine_text("mikron-ucp710")},
        "(modulo = true) for the axis",
        (Edit("m.toml", '[axes.C]\ntravel = "unlimited"', r'[axes.C]\n\1\ntravel = "unlimited"'),),
    ),
]
GCODE = [*_ISO, *_KLARTEXT, *_ASK]
