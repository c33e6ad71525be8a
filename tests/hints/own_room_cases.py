"""Hints on files that are written, cutters, tool tables, chosen axes, proofs and the shop's own blocks."""

from __future__ import annotations

from pathlib import Path

from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.convert_cases import ARC, CUT, LEFT, LENGTH, START, TAP, convert, nx, option, part, sheet
from tests.hints.file_cases import BODY, GOOD_BOX, SHAPE
from tests.hints.verify_cases import edited

FILES = {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}
ON = "-m mill-3axis -c fanuc-30i --setup s.toml"
ON_LINUXCNC = ON.replace("fanuc-30i", "linuxcnc")
ON_HEAD = "-m head-table -c generic-iso --setup s.toml"
NAMED = LENGTH + 'called = "EM10"\n'
SIDEWAYS = START + "RAPID\nGOTO/0,0,60,0,0,1\nGOTO/0,0,0,0,0.5,0.866025404\nGOTO/9,0,0\nRAPID\nGOTO/9,20,34.641016\n"
NORMAL = START.replace("LOADTL/1\n", "CUTTER/10,5\nLOADTL/1\n") + "MULTAX/ON\n" + (
    "RAPID\nGOTO/0,0,50,0,0,1,0,0,1\nGOTO/0,0,5,0,0,1,0,0,1\nGOTO/0,0,0,0,0,1,0,0,1\nGOTO/9,0,0,0,0,1,0,0,1\n"
    "RAPID\nGOTO/9,0,50,0,0,1,0,0,1\n")
ROOT = Path(__file__).parents[2]
LAWS = (ROOT / "tests" / "golden" / "three_laws.cls").read_text("utf-8")
TOOLS = (ROOT / "samples" / "tools.setup.toml").read_text("utf-8")
ISO_HOLE = "MODE/MILL\nPARTNO/'plate'\nPPRINT/'plate'\nUNITS/MM\nMULTAX/OFF\nLOADTL/3, 0, 60.0, 8\nRAPID\n" + (
    "GOTO/10.0, 20.0, 35.0\nCYCLE/DRILL, 12.0, MMPM, 300.0, 3.0, RAPTO, 1.0\nGOTO/10.0, 20.0, 8.0\nCYCLE/OFF\nEND\nFINI\n")
"""Autodesk's ISO 4343 with the tool at 35 mm before a cycle whose clearance height is 3 mm"""
BALL = START.replace("LOADTL/1\n", "CUTTER/10,5\nLOADTL/1\n") + CUT


def _own(code: str, command: str, says: str, *does: Edit, first: tuple[str, ...] = (), harm: tuple[Edit, ...] = (),
         stops: tuple[str, ...] = (), **files: str) -> HintCase:
    given = {name.replace("_", "."): text for name, text in files.items()}
    return HintCase(code, command, {**FILES, **given}, says, does, first=first, harm=harm, stops=stops)


def _body(code: str, says: str, *does: Edit, cutter: str = "CUTTER/10,0", tool: str = LENGTH) -> HintCase:
    """A cutter that is looked at against the part."""
    return HintCase(code, f"convert part.apt {ON} -o p.nc",
                    {"part.apt": SHAPE.replace("CUTTER/10,0", cutter) + "FINI\n", "s.toml": tool + BODY,
                     "part.off": GOOD_BOX}, says, does)


_OUTPUT = [
    _own("setup.unanswered", "setup new part.apt -m mikron-ucp710 -c linuxcnc -o new.toml", "or (--yes) to write",
         Edit(COMMAND, "", r" \1")),
    _own("place.limits", "place part.apt -m mill-3axis --setup s.toml -o o.toml",
         r"(\[placement\]) (x = \[-100, 100\]), (y = \[-100, 100\])", sheet("", r"\1\n\2\n\3\nstep = 100\n")),
    _own("proof.older", f"convert part.apt {ON} -o p.nc", "convert with (--proof)", Edit(COMMAND, "", r" \1"),
         first=(f"convert part.apt {ON} -o p.nc --proof",)),
    _own("orient.no_motion", "orient part.apt -m mikron-ucp710 --setup s.toml", "it needs (GOTO) records",
         part("FINI", "CUTTER/10,5\nFEDRAT/MMPM,600\nRAPID\n\\1/0,0,5\n\\1/0,0,0\n\\1/9,0,0\nFINI"),
         part_apt="UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFROM/0,0,50\nFINI\n"),
]
INDEXED = (ROOT / "samples" / "indexing" / "creo_rotate.ncl").read_text("utf-8")
NEXT = "18.7138783386\nRAPID\n"
"""behind the second position of the table"""
TWO_NUMBERS = "LOADTL/1,ADJUST,2", "LOADTL/2,ADJUST,2"
TWO_REGISTERS = START.replace("LOADTL/1", "LOADTL/1,ADJUST,1") + CUT + "LOADTL/1,ADJUST,2\n" + CUT + "FINI\n"
_CAM = [
    _own("cl.index-cut", "inspect part.ncl", "put (RAPID) and an approach point after ROTATE",
         Edit("part.ncl", NEXT.removesuffix("RAPID\n"), NEXT.replace("RAPID", r"\1")),
         part_ncl=INDEXED.replace(NEXT, NEXT.removesuffix("RAPID\n"), 1)),
    _own("tool-table.apart", f"verify p.nc part.apt {ON} --tool-table t.csv", "give each length a tool number of its own",
         Edit("part.apt", *TWO_NUMBERS), Edit(COMMAND, "p.nc", "q.nc"), part_apt=TWO_REGISTERS,
         again_apt=TWO_REGISTERS.replace(*TWO_NUMBERS), t_csv="register,length\n1,110\n2,110.01\n",
         s_toml=LENGTH + "[tools.2]\ngauge_length = 110.01\n",
         first=(f"convert part.apt {ON} -o p.nc", f"convert again.apt {ON} -o q.nc")),
]
CLAMPED = (ROOT / "machines" / "data" / "mikron-ucp710.toml").read_text("utf-8").replace(
    "[axes.C]\n", '[axes.C]\nclamp = "M10"\nunclamp = "M11"\n')
_PROOFS = [
    _own("verify.not_compared", "verify p.nc part.apt -m m.toml -c fanuc-30i --setup s.toml --require-proof",
         "leave (--require-proof) out", Edit(COMMAND, " --require-proof", ""),
         first=("convert part.apt -m m.toml -c fanuc-30i --setup s.toml -o p.nc",),
         harm=(Edit("p.nc", "F600.", "F[300.*2]"),), m_toml=CLAMPED),
]
_CUTTERS = [
    _body("collision.corner", r"add (corner_radius = )\.\.\. to \[tools\.1\]", sheet("110.0\n", "110.0\n\\g<1>0.0\n"),
          tool=LENGTH + "diameter = 10.0\n", cutter="REMARK"),
    _body("collision.cutter", r"write (diameter = 10) to \[tools\.1\]", sheet("diameter = 12.0", r"\1"),
          tool=LENGTH + "diameter = 12.0\n"),
]
TURNING = BALL.replace("FEDRAT", "MULTAX\nFEDRAT").replace("GOTO/0,0,0\nGOTO/9,0,0\n", (
    "GOTO/0,0,0,0.3,0,0.954\nGOTO/3,0,0,0.25,0.1,0.963\nGOTO/6,0,0,0.1,0.25,0.963\nGOTO/9,0,0,0,0.3,0.954\n"))
_TABLES = [
    _own("tool-table.empty", f"verify p.nc part.apt {ON} --tool-table t.csv", "the columns (register) and (length)",
         Edit("t.csv", "nothing\n", "\\1,\\2\n1,110\n"), first=(f"convert part.apt {ON} -o p.nc",), t_csv="nothing\n"),
    _own("tool-table.open", f"verify p.nc part.apt {ON} --tool-table t.csv", "the columns (register) and (length)",
         Edit("t.csv", "", "\\1,\\2\n1,110\n"), first=(f"convert part.apt {ON} -o p.nc",)),
    _own("tool-table.missing", f"verify p.nc part.apt {ON} --tool-table t.csv", "measure these tools",
         Edit("t.csv", "7,110", "1,110"), first=(f"convert part.apt {ON} -o p.nc",), t_csv="register,length\n7,110\n"),
    _own("tool-table.aside", f"verify p.nc part.apt {ON_LINUXCNC} --tool-table t.tbl", "set these offsets to (0)",
         Edit("t.tbl", "X5", r"X\1"), t_tbl="T1 P1 X5 Z110\n", first=(f"convert part.apt {ON_LINUXCNC} -o p.nc",)),
    _own("tool-table.length", f"verify p.nc part.apt {ON} --tool-table t.csv", "measure the tool",
         Edit("t.csv", "1,0", "1,110"), first=(f"convert part.apt {ON} -o p.nc",), t_csv="register,length\n1,0\n2,90\n"),
    _own("tool-table.outside", f"verify p.nc part.apt {ON_HEAD} --tool-table t.csv", "set the tools to their gauge lengths",
         Edit("t.csv", "110.3", "110"), first=(f"convert part.apt {ON_HEAD} -o p.nc",), t_csv="register,length\n1,110.3\n",
         part_apt=TURNING + "FINI\n"),
    convert("tool.called", START + CUT, r"take `(called)` out of \[tools\.N\]", sheet('called = "EM10"\n', ""), setup=NAMED),
    convert("tool.called", "UNITS/MM\n" + nx("A", 1, 5) + nx("B", 2, 6), "give each tool a name of its own",
            sheet("em10", "em20"), setup=NAMED + '[tools.2]\ngauge_length = 80.0\ncalled = "em10"\n',
            control="siemens-840d"),
    edited("gcode.tool_name", CUT, '"EM10"', '"EM99"', r"\[tools\.N\] (called) = ", sheet("EM10", "EM99"),
           setup=NAMED, control="siemens-840d"),
]
_AXES = [
    convert("orient.fixed", TURNING, r"(\[orientation\]) (cone) of the set-up", sheet("", "\\1\n\\2 = 5.0\n"),
            machine="mikron-ucp710", more=" --orient auto"),
    convert("orient.cutter", START + CUT, r"keep the orientation \((--orient keep)\)", option(r"\1", "--orient auto"),
            machine="mikron-ucp710", more=" --orient auto"),
    convert("orient.normals", BALL, r"name the part mesh|\((--max-tilt)\)", sheet("[orientation]\noff_centre = 10.0\n", ""),
            machine="mikron-ucp710", setup=LENGTH + "[orientation]\noff_centre = 10.0\n", more=" --orient auto"),
    _own("verify.orient", f"verify p.nc part.apt {ON} --orient auto", "verify without (--orient)",
         option("", " --orient auto"), first=(f"convert part.apt {ON} -o p.nc",)),
    edited("verify.hook", CUT, "(OURS)\n", "", r"take it out of (\[hooks\])",
           sheet('[hooks]\nbefore_tool = ["(OURS)"]\n', ""), setup=LENGTH + '[hooks]\nbefore_tool = ["(OURS)"]\n'),
]
_MACHINES = [
    convert("cutcom.register", START + LEFT + ARC + "CUTCOM/OFF\nGOTO/-20,20,2\nRAPID\nGOTO/-20,20,20\n",
            r'\[tools\.N\] (compensation = "wear")', sheet("", r"\1\n"), control="fanuc-30i"),
    HintCase("tool-table.bodies", f"verify p.nc part.apt {ON} --tool-table t.csv", {
        "part.apt": SHAPE + "FINI\n", "part.off": GOOD_BOX, "s.toml": LENGTH + BODY, "t.csv": "register,length\n1,109\n"},
        r"write the lengths into the set-up", (sheet("110.0", "109.0"),), first=(f"convert part.apt {ON} -o p.nc",)),

    edited("verify.cutcom_arc", LEFT + ARC + "CUTCOM/OFF\nGOTO/-20,20,2\nRAPID\nGOTO/-20,20,20\n",
           "G41 D1\nY0.\nG3", "Y0.\nG41 D1\nG3", "a straight move must lead to the contour and away from it",
           Edit("p.nc", "Y0.\nG41 D1\nG3", "G41 D1\nY0.\nG3")),
    convert("rapid.off_line", SIDEWAYS, 'or (rapids_as_feed = true) under (\\[output\\])', sheet("", "\\2\\n\\1\\n"),
            machine="head-table", control="fanuc-30i", more=" --output-mode axes"),
    convert("orient.contact_radius", NORMAL, "or (off_centre) in degrees", sheet("contact_radius = 8.0", r"\1 = 10.0"),
            machine="mikron-ucp710", setup=LENGTH + "[orientation]\ncontact_radius = 8.0\n", more=" --orient auto"),
    convert("orient.max_tilt", NORMAL, r"(--max-tilt [0-9.]+) or more", Edit(COMMAND, "--max-tilt 5", r"\1"),
            machine="mikron-ucp710", setup=LENGTH + "[orientation]\noff_centre = 10.0\n",
            more=" --orient auto --max-tilt 5"),
    _own("verify.error_model_changed", f"verify p.nc part.apt {ON} --error-model e.toml",
         "or verify with the model as it was",
         Edit("e.toml", "6.5", "6.0"), first=(f"convert part.apt {ON} --error-model e.toml -o p.nc",),
         harm=(Edit("e.toml", "6.0", "6.5"),), e_toml="[location]\nEC0Y = 6.0\n"),
    _own("gcode.open", f"verify q.nc part.apt {ON}", "name the program that is checked", Edit(COMMAND, "q.nc", "p.nc"),
         first=(f"convert part.apt {ON} -o p.nc",)),
    _own("verify.hooks", f"verify p.nc part.apt {ON}", r"verify with (--hooks) HOOKS.TOML", option(r" \1 hooks.toml", ""),
         first=(f"convert part.apt {ON} --hooks hooks.toml -o p.nc",),
         hooks_toml='[hooks]\nbefore_tool = ["M34"]\npassive = ["M34"]\n'),
    HintCase("feed.slow", f"convert part.apt {ON} -o p.nc",
             {"part.apt": START + CUT.replace("GOTO/0,0,0\n", "FEDRAT/0.6,MMPM\nGOTO/0,0,0\n") + "FINI\n", "s.toml": LENGTH},
             "write (FEDRAT/600,MMPM)", (Edit("part.apt", "FEDRAT/0.6,MMPM", r"\1"),)),
    HintCase("orient.pass", "orient part.apt -m mikron-ucp710 --setup s.toml --max-tilt 5 --figure p.svg --pass 9",
             {"part.apt": BALL + "FINI\n", "s.toml": LENGTH}, "passes are numbered (0) to 0",
             (Edit(COMMAND, "--pass 9", r"--pass \1"),)),
    HintCase("verify.option", "verify p.nc part.apt -m m.toml -c fanuc-30i --setup s.toml",
             {"part.apt": START + TAP + "FINI\n", "s.toml": LENGTH,
              "m.toml": 'base = "mill-3axis"\n[control]\nrigid_tapping = true\n'},
             r"state the option under \[control\]", (Edit("m.toml", "false", "true"),),
             first=("convert part.apt -m m.toml -c fanuc-30i --setup s.toml -o p.nc",),
             harm=(Edit("m.toml", "true", "false"),)),
    _own("tool-table.far", f"verify p.nc part.apt {ON} --tool-table t.csv", "look at the tool and its register",
         Edit("t.csv", "1,180", "1,110"), first=(f"convert part.apt {ON} -o p.nc",), t_csv="register,length\n1,180\n"),
    HintCase("file.own_name", "convert part.cls -m mikron-ucp710 -c fanuc-30i --setup s.toml -o o1001",
             {"part.cls": LAWS, "s.toml": TOOLS + "\n[output]\nfiles = true\n"}, "give -o another name than",
             (Edit(COMMAND, "o1001", "right.nc"),)),
    HintCase("file.replaced", "convert part.cls -m mikron-ucp710 -c fanuc-30i --setup s.toml -o right.nc",
             {"part.cls": LAWS, "s.toml": TOOLS + "\n[output]\nfiles = true\n"}, "into folders of their own",
             (Edit(COMMAND, "right.nc", "own/right.nc"),),
             first=("convert part.cls -m mikron-ucp710 -c fanuc-30i --setup s.toml -o left.nc",)),
    HintCase("file.input", "convert O1002 -m mikron-ucp710 -c fanuc-30i --setup s.toml -o main.nc",
             {"O1002": LAWS, "s.toml": TOOLS + "\n[output]\nfiles = true\n"}, "write into another folder",
             (Edit(COMMAND, "main.nc", "other/main.nc"),)),
    HintCase("cl.cycle-height", "inspect part.apt", {"part.apt": ISO_HOLE}, "give the dialect: (--dialect generic)",
             (Edit(COMMAND, "", r" \1"),)),
]
OWN_ROOMS = [*_MACHINES, *_OUTPUT, *_CAM, *_PROOFS, *_CUTTERS, *_TABLES, *_AXES]
