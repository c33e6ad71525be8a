"""Hints of the CL reader on single words, cycles, frames and options."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase


def _whole(code: str, text: str, says: str, *does: Edit, stops: tuple[str, ...] = ()) -> HintCase:
    return HintCase(code, "inspect part.apt", {"part.apt": text}, says, does, stops=stops)


def _left_out(code: str, text: str, word: str) -> HintCase:
    """--allow-unknown makes a note of the error."""
    return HintCase(
        code,
        "inspect part.apt",
        {"part.apt": text},
        f"(--allow-unknown {word})",
        (Edit(COMMAND, "", r" \1"),),
        code_left=True,
    )


def _in(old: str, new: str) -> Edit:
    return Edit("part.apt", old, new)


NX = "UNITS/MM\nTOOL PATH/A,TOOL,T\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\nFEDRAT/MMPM,100\n"
ARCS = "".join(f"GOTO/{x},0,0\nCIRCLE/{x},5,0,0,0,1,5\nGOTO/{x - 5},5,0\n" for x in range(0, 200, 20))
STEP = (
    "ISO-10303-21;\nDATA;\n#1=PROJECT('P',#2,(),$,$,$);\n#2=WORKPLAN('W',(#3),$,$,$);\n"
    "#3=MACHINING_WORKINGSTEP('S',#20,#4,#5,$);\n#4=TOOLPATH_FEATURE('F',$,(#5),$,$);\n#5=F(#6,$,'O',$,$,#8,#9,#10,$,$,$,$);\n"
    "#6=TOOLPATH_LIST((#7));\n#7=CUTTER_LOCATION_TRAJECTORY(.T.,.TRAJECTORY_PATH.,$,$,$,.T.,#11,$,$);\n"
    "#8=MILLING_CUTTING_TOOL('EM10',#14,(),$,$,$);\n#14=TAPERED_ENDMILL(#15,4,.RIGHT.,.F.,$,$);\n"
    "#15=MILLING_TOOL_DIMENSION(10.,$,$,$,$,$,$);\n#9=MILLING_TECHNOLOGY(0.01,.TCP.,$,-50.,$,.F.,.F.,.F.,$);\n"
    "#10=MILLING_MACHINE_FUNCTIONS(.F.,$,$,.F.,$,(),.F.,$,$,());\n#11=POLYLINE('',(#12,#13));\n"
    "#12=CARTESIAN_POINT('',(0.,0.,5.));\n#13=CARTESIAN_POINT('',(9.,0.,5.));\n#20=PLANE('',#21);\n"
    "#21=AXIS2_PLACEMENT_3D('',#22,$,$);\n#22=CARTESIAN_POINT('',(0.,0.,40.));\nENDSEC;\nEND-ISO-10303-21;\n")
GENERIC = "UNITS/MM\nFEDRAT/100,MMPM\nGOTO/0,0,0\n"
CATIA = "$$ CATIA APT\nUNITS/MM\nFEDRAT/600\n"
HOLE = "GOTO/1,2,3\nCYCLE/OFF\n"
CL_WORDS = [
    _whole(
        "cl.arc-ends",
        NX + "GOTO/0,0,0,0,0,1\nCIRCLE/5,0,0,0,0,1,5,0.03,0.5,10,0\nGOTO/0,0,0\nEND-OF-PATH\n",
        "(TIMES),n",
        _in("0.5,10,0\n", r"0.5,10,0,\1,1\n"),
    ),
    _whole(
        "cl.arc-back",
        NX + "GOTO/68.9,0,0,0,0,1\nCIRCLE/0,0,0,0,0,-1,68.9,.03,.5,10,0\nGOTO/68.9,-0.0001,0\nEND-OF-PATH\n",
        "(TIMES),n",
        _in("68.9,-0.0001,0", "68.9,0,0"),
        _in(".5,10,0\n", r".5,10,0,\1,1\n"),
    ),
    _whole(
        "cl.arc-rapid",
        GENERIC + "RAPID\nCIRCLE/5,0,0,0,0,1,5\nGOTO/10,0,0\n",
        "put RAPID before a GOTO",
        _in("RAPID\n", "RAPID\nGOTO/0,0,0\n"),
    ),
    _whole("cl.arc-sense", GENERIC + ARCS, "(--dialect)", Edit(COMMAND, "", r" \1 nx")),
    _whole("cl.axis", GENERIC + "GOTO/1,2,3,0,45,90\n", "of length 1", _in("0,45,90", "0,0.7071,0.7071")),
    _whole("cl.continuation", GENERIC + "FEDRAT/MMPM,100,$\nGOTO/1,2,3\n", "remove the mark", _in("100,$", "100")),
    _whole(
        "cl.continuation",
        GENERIC + "SPINDL/RPM,$\nCOOLNT/ON\nGOTO/1,2,3\n",
        "put the missing rest on the next line",
        _in("$\n", "$\n1000,CLW\n"),
    ),
    _whole("cl.cut-off", GENERIC + "GOTO/1,0,0\nGOTO/1 2 3.", "write the file again", _in("3.", "3.5\nFINI\n")),
    _whole(
        "cl.cycle-depth", GENERIC + "CYCLE/DRILL,DEPTH,-5,CLEAR,2,MMPM,50\n" + HOLE, "writes depths positive", _in("-5", "5")
    ),
    _whole(
        "cl.cycle-depth",
        NX + "CYCLE/DRILL,FEDTO,5,RAPTO,2,RTRCTO,AUTO,MMPM,50\n" + HOLE + "END-OF-PATH\n",
        "writes depths negative",
        _in("FEDTO,5", "FEDTO,-5"),
    ),
    _whole(
        "cl.cycle-depth",
        GENERIC + "CYCLE/DRILL,DEPTH,0,CLEAR,2,MMPM,50\n" + HOLE,
        r"\(FEDTO or (DEPTH) of the CYCLE record\)",
        _in("DEPTH,0", r"\1,5"),
    ),
    _whole(
        "cl.cycle-depth",
        GENERIC + "CYCLE/DRILL,DEPTH,0,CLEAR,2,MMPM,50\n" + HOLE,
        "take the hole out",
        _in("CYCLE/DRILL,DEPTH,0,CLEAR,2,MMPM,50\n" + HOLE, ""),
    ),
    _whole(
        "cl.cycle-peck",
        GENERIC + "CYCLE/DEEP,DEPTH,10,CLEAR,2,STEP,0,MMPM,50\n" + HOLE,
        "with (STEP)",
        _in("STEP,0", r"\1,3"),
    ),
    _whole(
        "cl.cycle-peck",
        GENERIC + "CYCLE/DEEP,DEPTH,10,CLEAR,2,STEP,0,MMPM,50\n" + HOLE,
        "write (CYCLE/DRILL)",
        _in("CYCLE/DEEP,DEPTH,10,CLEAR,2,STEP,0", r"\1,DEPTH,10,CLEAR,2"),
    ),
    _whole(
        "cl.cycle-start",
        CATIA + "RAPID\nGOTO/0,0,26\nCYCLE/DRILL,    3.000000,    120.0\nGOTO  /0,0,20\nCYCLE/OFF\n",
        "state one",
        _in("CYCLE/DRILL,    3.000000,    120.0", "CYCLE/DRILL,DEPTH,3,CLEAR,2,MMPM,120"),
    ),
    _whole(
        "cl.cycle-value",
        GENERIC + "CYCLE/DRILL,DEPTH,5,MMPM,50\n" + HOLE,
        "write it with (CLEAR)",
        _in("MMPM,50", r"\1,2,MMPM,50"),
    ),
    _whole(
        "cl.cycle-value",
        GENERIC + "CYCLE/DRILL,CLEAR,2,MMPM,50\n" + HOLE,
        "write it with (DEPTH)",
        _in("MMPM,50", r"\1,9,MMPM,50"),
    ),
    _whole(
        "cl.cycle-value",
        GENERIC + "CYCLE/DRILL,DEPTH,5,CLEAR,2,MMPM\n" + HOLE,
        "write the number behind it",
        _in("2,MMPM", "2,MMPM,50"),
    ),
    _whole(
        "cl.cycle-value",
        GENERIC + "CYCLE/FACE,DEPTH,2,DWELL,-1,MMPM,60,CLEAR,2\n" + HOLE,
        "write (0) or more",
        _in("DWELL,-1", r"DWELL,\1"),
    ),
    _whole(
        "cl.cycle-value",
        GENERIC + "CYCLE/DEEP,DEPTH,20,STEP,-5,MMPM,60,CLEAR,2\n" + HOLE,
        "at least ([0-9.]+)",
        _in("STEP,-5", r"STEP,\1"),
    ),
    _whole(
        "cl.cycle-value",
        "UNITS/MM\nRAPID\nCYCLE/TAP,DEPTH,5,CLEAR,2\n" + HOLE,
        "write it with (PITCH)",
        _in("CLEAR,2", r"CLEAR,2,\1,1.5"),
    ),
    _whole("cl.dollar", GENERIC + "SPINDL/RPM,3000$CLW\n", "end the line behind \\$", _in("$CLW", ",$\nCLW")),
    _whole("cl.dollar", GENERIC + "$OTO/10.0,0.0,-1.0\n", "write (\\$\\$) before a comment", _in("$OTO", r"\1 OTO")),
    _whole("cl.empty", "UNITS/MM\n$$ nothing here\n", "has (GOTO) records", _in("$$ nothing here", r"\1/1,2,3")),
    _whole(
        "cl.feed-option",
        GENERIC + "FEDRAT/100,MMPM,LENGTH,5\nGOTO/1,0,0\n",
        "have the CAM system write the feed itself",
        _in(",LENGTH,5", ""),
    ),
    _whole("cl.form", GENERIC + "SPINDL/100,200,CLW\n", "(--allow-unknown SPINDL)", Edit(COMMAND, "", r" \1")),
    _whole(
        "cl.goto-feed",
        GENERIC + "GOTO/1,2,3,250.\n",
        "(FEDRAT) before the GOTO",
        _in("GOTO/1,2,3,250.", r"\1/250,MMPM\nGOTO/1,2,3"),
    ),
    _whole(
        "cl.length-register",
        GENERIC + "LOADTL/4,0\nGOTO/1,0,0\n",
        "state (ADJUST) with the register",
        _in("LOADTL/4,0", r"LOADTL/4,\1,4"),
    ),
    _whole("cl.length-register", GENERIC + "LOADTL/4,120.5\nGOTO/1,0,0\n", "whole numbers from 1", _in("120.5", "12")),
    _whole(
        "cl.multax-off",
        "UNITS/MM\nFEDRAT/600,MMPM\nMULTAX/ON\nGOTO/0,0,0,0,.6,.8\nMULTAX/OFF\nGOTO/1,0,0\n",
        "state (TLAXIS/0,0,1)",
        _in("MULTAX/OFF\n", r"MULTAX/OFF\n\1\n"),
    ),
    _whole(
        "cl.no-end-of-path",
        "UNITS/MM\nTOOL PATH/A,TOOL,T1\nFEDRAT/MMPM,9\nGOTO/1,2,3\nTOOL PATH/B,TOOL,T1\nGOTO/1,2,4\nEND-OF-PATH\n",
        "write the file again",
        _in("1,2,3\n", "1,2,3\nEND-OF-PATH\n"),
    ),
    _whole("cl.no-units", "FEDRAT/100\nGOTO/0,0,0\nGOTO/1,0,0\n", "(--units)", Edit(COMMAND, "", r" \1 mm")),
    _whole("cl.number", GENERIC + "GOTO/1,,3\n", "3, 6 or 9 numbers", _in("1,,3", "1,2,3")),
    _whole("cl.number", GENERIC + "GOTO/9;0;0\n", "put commas between the numbers: (GOTO/9,0,0)", _in("GOTO/9;0;0", r"\1")),
    _whole("cl.axis", GENERIC + "GOTO/1,25,2,5,3,75\n", "points for decimal commas",
           _in("1,25,2,5,3,75", "1.25,2.5,3.75")),
    _whole("cl.goto-feed", GENERIC + "GOTO/1,25,2,3\n", "points for decimal commas: 10.25", _in("1,25,2,3", "1.25,2,3")),
    _whole("cl.form", GENERIC + "FEDRAT/1500,5,MMPM\nGOTO/1,2,3\n", "a point for a decimal comma", _in("1500,5", "1500.5")),
    _whole("cl.number", GENERIC + "GOTO/P1\n", "3, 6 or 9 numbers", _in("P1", "1,2,3")),
    _whole(
        "cl.rapid-below",
        GENERIC + "GOTO/0,0,5\nGOTO/0,0,-1\nRAPID\nGOTO/5,0,-2\nGOTO/5,0,0\n",
        "look at the point",
        _in("5,0,-2", "5,0,2"),
    ),
    _whole(
        "cl.select",
        GENERIC + "RAPID\nGOTO/1,2,30\nSELECT/1\nSELECT/2\nGOTO/1,2,4\n",
        "(--allow-unknown SELECT)",
        Edit(COMMAND, "", r" \1"),
    ),
    _whole(
        "cl.select",
        GENERIC + "RAPID\nGOTO/1,2,30\nSELECT/1\nSELECT/2\nGOTO/1,2,4\n",
        "write (SELECT/TOOL)",
        _in("SELECT/1", r"\1,1"),
        _in("SELECT/2", r"\1,2"),
    ),
    _whole("cl.slash", GENERIC + "GOTO 1,2,3\n", "write (GOTO/)", _in("GOTO 1", r"\g<1>1")),
    _whole("cl.slash", GENERIC + "FEDRAT 100\nGOTO/1,0,0\n", "write (FEDRAT/)", _in("FEDRAT 1", r"\g<1>1")),
    _whole(
        "cl.subprogram",
        GENERIC + "DEFSUB/1\nGOTO/1,2,3\n",
        "write (ENDSUB) after its last record",
        _in("1,2,3\n", r"1,2,3\n\1\nCALSUB/1\n"),
    ),
    _whole(
        "cl.subprogram",
        GENERIC + "DEFSUB/1\nGOTO/1,2,3\nENDSUB\nCALSUB/7\n",
        "the file defines (1);",
        _in("CALSUB/7", r"CALSUB/\1"),
    ),
    _whole(
        "cl.subprogram", GENERIC + "DEFSUB/1\nGOTO/1,2,3\nENDSUB\n", "(--allow-unknown DEFSUB)", Edit(COMMAND, "", r" \1")
    ),
    _whole(
        "cl.subprogram",
        GENERIC + "DEFSUB\nGOTO/1,2,3\nENDSUB\n",
        "write (DEFSUB/1) and (CALSUB/1)",
        _in("DEFSUB\n", r"\1\n"),
        _in("ENDSUB\n", r"ENDSUB\n\2\n"),
    ),
    _whole(
        "cl.subprogram",
        GENERIC + "CALSUB/7\n",
        "(DEFSUB/7) and (ENDSUB)",
        _in("CALSUB/7\n", r"\1\nGOTO/1,2,3\n\2\nCALSUB/7\n"),
    ),
    _whole(
        "cl.rotabl-open",
        "UNITS/ MM\nCUTTER/ 6,0,3,0,0,0,80,\nFEDRAT/ MMPM,100\nTLAXIS/ 0,-1,0\nOPFEATSTART/A\n"
        "ROTABL/ 1.570796,AAXIS,TABLE,CCLW\nGOTO/ 1,2,3\n"
        "OPFEATEND/A\nTLAXIS/ 0,0,1\nOPFEATSTART/B\nGOTO/ 4,5,6\nOPFEATEND/B\nFINI\n",
        "(--axis-from tlaxis)",
        Edit(COMMAND, "", r" \1"),
    ),
    HintCase(
        "cl.step-nc",
        "inspect part.stp",
        {"part.stp": STEP.replace("#5=F(#6,", "#5=F($,")},
        r"explicit tool paths \(CUTTER_LOCATION_TRAJECTORY\)",
        (Edit("part.stp", "#5=F($,", "#5=F(#6,"),),
    ),
    _whole(
        "cl.subprogram",
        GENERIC + "DEFSUB/1\nCALSUB/1\nENDSUB\nCALSUB/1\n",
        "take CALSUB/1 out of the records",
        _in("DEFSUB/1\nCALSUB/1\n", "DEFSUB/1\nGOTO/1,2,3\n"),
    ),
    _whole(
        "cl.table",
        GENERIC + "ROTABL/ATANGL,90,CLW\nGOTO/1,2,3\n",
        "points must be in the part's frame",
        _in("ROTABL/ATANGL,90,CLW\nGOTO/1,2,3", "GOTO/1,2,3,0,1,0"),
    ),
    _whole("cl.text", GENERIC + "@@@ ???\nGOTO/1,2,3\n", r"write (\$\$) before a comment", _in("@@@", r"\1 @@@")),
    _whole(
        "cl.text",
        GENERIC + "@@@ ???\nGOTO/1,2,3\n",
        r"--allow-unknown ('\(TEXT\)')",
        Edit(COMMAND, "", r" --allow-unknown \1"),
    ),
    _whole("cl.unknown-motion", GENERIC + "GOTOO/1,2,3\nGOTO/1,2,3\n", "write (GOTO),", _in("GOTOO", r"\1")),
    _left_out("cl.unknown-motion", GENERIC + "MOVEXYZ/1,2,3\nGOTO/1,2,3\n", "MOVEXYZ"),
    _whole("cl.unknown-word", GENERIC + "RAPIX\nGOTO/1,0,0\n", "write (RAPID),", _in("RAPIX", r"\1")),
    _left_out("cl.unknown-word", GENERIC + "FLUBBER/ON\n", "FLUBBER"),
    _whole(
        "cl.units",
        "UNITS/MM\nFEDRAT/100,MMPM\nUNITS/INCHES\nGOTO/0,0,0\n",
        "give them with (--units)",
        Edit(COMMAND, "", r" \1 mm"),
    ),
    _whole(
        "cl.unsupported-motion", GENERIC + "COPY/1,TRANSL,10,0,0,3\n", "(--allow-unknown COPY)", Edit(COMMAND, "", r" \1")
    ),
    _whole(
        "cl.unsupported-motion",
        GENERIC + "GOFWD/L1,PAST,L2\n",
        "write out the points it makes",
        _in("GOFWD/L1,PAST,L2", "GOTO/5,0,0\nGOTO/5,5,0"),
    ),
    _whole(
        "cl.work-offset",
        GENERIC + "ZERO/1\nGOTO/0,0,1\nZERO/2\nGOTO/0,0,2\n",
        "one file for each work offset",
        _in("ZERO/2\nGOTO/0,0,2\n", ""),
    ),
    HintCase(
        "cl.open", "inspect part.cls", {"part.apt": GENERIC}, "name a CL file", (Edit(COMMAND, "part.cls", "part.apt"),)
    ),
    _whole(
        "cl.format",
        "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('INTEGRATED_CNC_SCHEMA'));\n",
        r"APT or CL text \((GOTO) records\)",
        _in("ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('INTEGRATED_CNC_SCHEMA'));\n", r"UNITS/MM\nFEDRAT/MMPM,100\n\1/1,2,3\n"),
    ),
]
