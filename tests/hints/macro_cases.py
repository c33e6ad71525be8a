"""Hints on programs with variables, loops and calls: `time` executes them as the control would."""

from __future__ import annotations

from tests.hints.case import HintCase
from tests.hints.gcode_cases import FANUC, HEIDENHAIN, LINUXCNC, SIEMENS, of

SHORT = "time p.nc -m mill-3axis -c {} --max-blocks 200"


def _endless(control: str, wrong: str, right: str, says: str) -> HintCase:
    return of("gcode.endless", control, "", wrong, right, says, command=SHORT.format(control))


MACROS = [
    _endless(FANUC, "#1=3\nWHILE[#1GT0]DO1\nEND1\n", "#1=3\nWHILE[#1GT0]DO1\n#1=#1-1\nEND1\n",
             "a loop whose condition never fails"),
    of("gcode.endless", SIEMENS, "M30\n", "GOTOS\n", r"\1\n", "write (M30)"),
    of("gcode.alarm", FANUC, "", "#100=0\nIF[#100EQ0]THEN#3000=1(STATE THE DEPTH)\n",
       "#100=5.\nIF[#100EQ0]THEN#3000=1(STATE THE DEPTH)\n", "state what it asks for"),
    of("gcode.alarm", HEIDENHAIN, "", "FN 0: Q1 = +0\nFN 9: IF +Q1 NE +0 GOTO LBL 5\nFN 14: ERROR = 1000\nLBL 5\n",
       "FN 0: Q1 = +5\nFN 10: IF +Q1 NE +0 GOTO LBL 5\nFN 14: ERROR = 1000\nLBL 5\n", "state what it asks for"),
    of("gcode.variable", FANUC, "", "G0 X#500\n", r"\1=3.\nG0 X#500\n", "in a copy of the program: (#500)="),
    of("gcode.variable", FANUC, "", "G0 X#2000\n", "G0 X3.\n", "put the figure"),
    of("gcode.variable", LINUXCNC, "", "G0 X#<deep>\n", r"\1=3\nG0 X#<deep>\n", "(#<deep>) ="),
    of("gcode.variable", SIEMENS, "", "G0 X=R7\n", r"\1=3\nG0 X=R7\n", "(R7)="),
    of("gcode.variable", SIEMENS, "", "R1=$P_DEPTH\n", "R1=4\n", "declare it: .*put its figure"),
    of("gcode.variable", HEIDENHAIN, "", "L X+Q5 FMAX\n", r"Q5 = 3\nL X+Q5 FMAX\n", "(Q5) ="),
    of("gcode.jump", FANUC, "", "#1=1\nGOTO10\n", "#1=1\nGOTO10\nN10\n", "number the block that is meant"),
    of("gcode.jump", FANUC, "", "#1=1\nWHILE[#1LT1]DO1\n", "#1=1\nWHILE[#1LT1]DO1\nEND1\n", "every DO m has its END m"),
    of("gcode.jump", HEIDENHAIN, "", "FN 9: IF +1 EQU +1 GOTO LBL 7\n",
       "FN 9: IF +1 EQU +1 GOTO LBL 7\nLBL 7\n", "labels stand in the program"),
    of("gcode.jump", SIEMENS, "", "GOTOB ENDE\nENDE: R1=1\n", "GOTOF ENDE\nENDE: R1=1\n", "GOTOF looks ahead"),
    of("gcode.jump", LINUXCNC, "", "o1 endwhile\n", "#1=1\no1 while [#1 lt 1]\no1 endwhile\n", "begin it with while"),
    of("gcode.expression", FANUC, "", "#1=0\nG0 X[1/#1]\n", "#1=2\nG0 X[1/#1]\n", "test the divisor before"),
    of("gcode.expression", FANUC, "", "#1=SQRT[-4]\n", "#1=SQRT[4]\n", "test .* before|control's manual"),
    of("gcode.expression", LINUXCNC, "", "#1=[1 + ]\n", "#1=[1 + 2]\n", "as the control's manual has it"),
    of("gcode.expression", SIEMENS, "", "FOR R1\nENDFOR\n", "FOR R1=1 TO 2\nENDFOR\n", "as the control's manual has it"),
    of("gcode.frame_turned", SIEMENS, "", "ROTS X10 Y20\n", r"\1 Z30\nROT\n", "(ROT) with X, Y"),
    of("gcode.frame_turned", SIEMENS, "", "SCALE X2\nG1 X5 F100\nG3 X0 Y5 I-5 J0\nSCALE\n",
       "G1 X10 F100\nG3 X0 Y5 CR=10\n", "coordinates of the work offset"),
    of("gcode.cycle", SIEMENS, "", "F100\nMCALL CYCLE81(5,0,2,-3)\nHOLES1(0,0,0,5)\nMCALL\n",
       "F100\nMCALL CYCLE81(5,0,2,-3)\nX5 Y0\nMCALL\n", "places one by one, in blocks under MCALL"),
    of("gcode.comparison", FANUC, "", "#1=0.1+0.2\nIF[#1GT0.3]GOTO9\nN9\n", "#1=0.1+0.2\nIF[#1GT0.3001]GOTO9\nN9\n",
       "with a margin"),
    of("gcode.skip", FANUC, "", "G31 X5. F100.\n", r"\1 X5. F100.\n", "write (G1)"),
    of("gcode.offset_unstated", FANUC, "", "#1=#5241\n", "G10 L2 P2 X5. Y0. Z0.\n#1=#5241\n", "or G10 L2"),
    of("gcode.jump", LINUXCNC, "", "o1 if [1]\no2 repeat [2]\no1 endif\no2 endrepeat\n",
       "o1 if [1]\no2 repeat [2]\no2 endrepeat\no1 endif\n", "end o2 first"),
    of("gcode.jump", LINUXCNC, "", "o1 endif\n", r"o1 \1 [1]\no1 endif\n", "begin it with (if)"),
    of("gcode.variable", HEIDENHAIN, "", "CALL LBL QS5\nLBL 9\n", r'QS5 = "9"\nCALL LBL QS5\nLBL 9\nLBL 0\n', "(QS5) ="),
    of("gcode.variable", HEIDENHAIN, "", "FN 18: SYSREAD Q1 = ID270 NR1 IDX1\n", "Q1 = 5\n", "put the figure"),
    of("gcode.variable", HEIDENHAIN, "", "FN 17: SYSWRITE ID50 NR1 IDX1 = +5\n", "", "allowed are"),
    of("gcode.position_unknown", FANUC, "G0 X1. Y2.\nG43 H1 Z50.\n", "#1=#5003\nG0 X1. Y2.\nG43 H1 Z50.\n",
       "G0 X1. Y2.\nG43 H1 Z50.\n#1=#5003\n", "state"),
    of("gcode.data_setting", FANUC, "", "G10 L50\n", "", "allowed are"),
    of("gcode.data_setting", LINUXCNC, "", "G92.3\n", "G92 X1\nG92.1\n", "state G92 with its words"),
    of("gcode.data_setting", HEIDENHAIN, "", "TRANS DATUM TABLE TABLINE5\n", "TRANS DATUM AXIS X+0 Y+0 Z+0\n",
       "by its axes"),
    of("gcode.mode", FANUC, "", "G16\nG0 X10.\nG15\n", "G16\nG0 X10. Y0.\nG15\n", "state X and Y"),
    of("gcode.mode", FANUC, "", "G68 R30.\nG69\n", "G68 X1. Y1. R30.\nG69\n", "write G90 G68 X Y R"),
    of("gcode.subprogram", HEIDENHAIN, "", "CALL LBL 7 REP 2\n", "LBL 7\nCALL LBL 7 REP 2\n", "known are"),
    of("gcode.subprogram", FANUC, "", "G65 A1.\n", "", "G65 P9000"),
    of("gcode.subprogram", FANUC, "", "#1=1\nG66.1 P9000\n", "", "write G66, or"),
]
