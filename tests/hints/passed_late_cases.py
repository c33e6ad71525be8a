"""Hints that are passed by a name: readings, CL records, hooks, proofs, smoothing, kinds of machines."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import numpy as np

from machines.kinds import _of_file
from tests.hints.align_cases import EDGES, HEAD, SPARE, csv, plane, readings
from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.convert_cases import CUT, LENGTH, START, convert, nx, option, part, sheet
from tests.hints.error_cases import measured, sample
from tests.hints.own_room_cases import INDEXED
from tests.hints.rare_cases import TURNED
from tests.machines.own_kinds import OWN, SAMPLE

LOUD = "\n0,5,-11", "\n0,5,-1"
RODS = '[legs.X]\nrail = [0.0, 0.0, 0.0]\n'
PLACES = [(x, y, z) for x in (-200, 0, 200) for y in (-200, 0, 200) for z in (-50, 0, 50)]
STANDS = "X [mm],Y [mm],Z [mm],dx [um],dy [um],dz [um]\n" + "".join(
    f"{x},{y},{z},{7 * k % 3 - 1},{k % 3 - 1},{k // 3 % 3 - 1}\n" for k, (x, y, z) in enumerate(PLACES))


def _noisy(text: str, size: float) -> str:
    """Readings of balls with noise of `size` um on each."""
    title, head, *rows = text.splitlines()
    noise = size * np.random.default_rng(3).normal(size=(len(rows), 3))
    lines = [row.split(",") for row in rows]
    made = [[*cells[:-3], *(f"{float(x) + e:.3f}" for x, e in zip(cells[-3:], off, strict=True))]
            for cells, off in zip(lines, noise.tolist(), strict=True)]
    return "\n".join([title, head, *map(",".join, made), ""])


_READINGS = [
    readings("align.misfit", HEAD + plane().replace("-40,-30,0.053\n", "-40,-30,0.353\n") + "".join(EDGES) + SPARE,
             "that of line 2 left out", csv("-40,-30,0,0,0,1,-40,-30,0.353\n", ""), machine="mikron-ucp710"),
    replace(measured("calibrate.parameter", "near it are (EC0Y)", "probe.csv", "", "", Edit("probe.toml", "EC0X", r"\1"),
             harm=(Edit("start.toml", 'base = "axis.toml"', ""), Edit("probe.toml", "EC0Y", "EC0X"))),
            stops=("calibrate.residual",)),
    measured("calibrate.residual", r"outliers \((robust = true)\)", "reversal.csv", *LOUD,
             Edit("reversal.toml", "description =", r"\1\ndescription =")),
    measured("calibrate.unexplained", r"write (sigma_um = [0-9.]+);", "probe.csv", sample("probe.csv"),
             _noisy(sample("probe.csv"), 200.0), Edit("probe.toml", "sigma_um = 0.3", r"\1"),
             harm=(Edit("start.toml", 'base = "axis.toml"', ""),)),
    HintCase("calibrate.row", "calibrate d.toml -o out.toml",
             {"d.csv": STANDS.replace("200,200,50,", "9000,200,-9000,", 1), "rods.toml": RODS,
              "d.toml": 'machine = "uranesx"\nmodel = "rods.toml"\nparameters = ["X.rail.x"]\n[poses]\ntable = "d.csv"\n'
                        "sigma_um = 1\n"},
             "look at the units", (Edit("d.csv", "9000,200,-9000", "200,200,50"),)),
    HintCase("error-model.sigma", "errors check e.toml -m mikron-ucp710",
             {"e.toml": "[location]\nEC0Y = 1.0\n[sigma]\nEC0Z = 1.0\n"}, "(EC0Y)", (Edit("e.toml", "EC0Z", r"\1"),)),
]
SCREW = '[components.EXX]\npolynomial = [0.0, 0.01]\nrange = [-355, 355]\n'
OUT = "errors to-linuxcnc e.toml -m mikron-ucp710 -o comp"
_ERRORS = [
    HintCase("error-export.control", OUT, {"e.toml": SCREW}, "with (--rest)", (option(r" \1 rest.toml"),)),
    HintCase("error-export.rest", f"{OUT} --rest rest.toml", {"e.toml": SCREW, "part.apt": START + CUT + "FINI\n",
                                                                  "s.toml": LENGTH},
             "convert with (--error-model) (rest.toml)",
             (Edit(COMMAND, f"{OUT} --rest rest.toml",
                   r"convert part.apt -m mikron-ucp710 -c linuxcnc --setup s.toml \1 \2 -o p.ngc"),)),
]
CONTRADICTED = "TRANS / 0.0000000000, 0.0000000000, 56.66", "TRANS / 0.0000000000, 0.0000000000, 59.66"
INDEXES = ("$$-> MFGNO/X\nUNITS/MM\nFEDRAT/100,MMPM\nROTATE/AAXIS,INCR,-30\nRAPID\nGOTO/0,0,50\nGOTO/9,0,40\n"
           "ROTATE/AAXIS,-45\nRAPID\nGOTO/0,0,50\nFINI\n")
COARSE = 'base = "fanuc-30i"\n[format]\nlinear_decimals = 2\n'
PECKED = "RAPID\nGOTO/0,0,50\nCYCLE/DEEP,DEPTH,5,MMPM,60,CLEAR,3,STEP,2,0.001\nGOTO/5,5,0\nCYCLE/OFF\n"
SPOKEN = "SPINDL/RPM,1000,CLW"
_RECORDS = [
    HintCase("cl.index-frame", "inspect part.ncl", {"part.ncl": INDEXED.replace(*CONTRADICTED)},
             "correct ROTATE, (TRANS)", (Edit("part.ncl", *reversed(CONTRADICTED)),)),
    HintCase("cl.index-frame", "inspect part.ncl", {"part.ncl": INDEXES}, "state the angle with (INCR)",
             (Edit("part.ncl", "-45", r"\1,-45"),)),
    HintCase("cl.index-frame", "inspect part.ncl", {"part.ncl": INDEXES}, "or a (CSYS) remark behind it",
             (Edit("part.ncl", "-45\n", r"-45\n$$-> \1/1,0,0,0,0,0.258819,-0.965926,0,0,0.965926,0.258819,0\n"),)),
    convert("cycle.peck", START + PECKED, "state a larger (STEP)", part("STEP,2,0.001", r"\1,2,0.5"),
            c=COARSE, more=" --tolerance 0.05"),
    convert("cycle.peck", START + PECKED, r"in one go \((CYCLE/DRILL)\)",
            part("CYCLE/DEEP,DEPTH,5,MMPM,60,CLEAR,3,STEP,2,0.001", r"\1,DEPTH,5,MMPM,60,CLEAR,3"),
            c=COARSE, more=" --tolerance 0.05"),
    convert("spindle.limit", START.replace(SPOKEN, "SPINDL/RPM,1200,CLW,MAXRPM,1000") + CUT, "state a speed below it",
            part("RPM,1200", "RPM,900"), code_left=True),
    convert("spindle.surface_speed", "UNITS/MM\n" + nx("A", 1, 5).replace("RPM,1000", "SMM,200") + nx("B", 1, 5),
            r"\(SPINDL/(RPM),n,CLW\)", part("SMM,200", r"\1,2000"), stops=()),
    convert("spindle.surface_speed", "UNITS/MM\n" + nx("A", 1, 5).replace("RPM,1000", "SMM,200"),
            r"add the speed to the set-up: \[tools.N\], or for all tools (\[output\]), (spindle = {.*})",
            sheet("", r"\1\nspindle = { rpm = 900, direction = 'clockwise' }\n")),
    HintCase("trace.no_point", "trace part.apt --line 3 -m mill-3axis -c linuxcnc --setup s.toml",
             {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}, r"stand at lines ([0-9]+)",
             (option(r"--line \1", "--line 3"),)),
]
HOOK = LENGTH + '[hooks]\nbefore_tool = ["{}"]\n'
_HOOKS = [
    convert("hooks.code", START + CUT, r"named in \[hooks\] (passive)", sheet("", r'\1 = ["M34"]\n'),
            setup=HOOK.format("M34"), control="fanuc-30i"),
    convert("hooks.code", START + CUT, "switches the spindle or coolant, stops or moves is a record of the CL file",
            sheet('before_tool = ["M8"]\n', ""), part("FEDRAT", "COOLNT/FLOOD\nFEDRAT"), setup=HOOK.format("M8"),
            control="fanuc-30i"),
]
GIVEN = "-m m.toml -c c.toml --setup s.toml --error-model e.toml"


def _changed(what: str, file: str, old: str, new: str) -> HintCase:
    """A proved program, verified with another input."""
    return HintCase(f"proof.{what}", f"verify p.ngc part.apt {GIVEN}",
                    {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH, "m.toml": 'base = "mill-3axis"\n',
                     "c.toml": 'base = "linuxcnc"\n', "e.toml": "[location]\nEC0Y = 6.0\n"},
                    "give the one of the proof", (Edit(file, new, old),),
                    first=(f"convert part.apt {GIVEN} -o p.ngc --proof",), harm=(Edit(file, old, new),))


_PROOFS = [
    _changed("machine", "m.toml", "mill-3axis\"\n", "mill-3axis\"\ndescription = \"other\"\n"),
    _changed("controller", "c.toml", "linuxcnc\"\n", "linuxcnc\"\ndescription = \"other\"\n"),
    _changed("error_model", "e.toml", "6.0\n", "6.0\nEA0Z = 0.0\n"),
]
ALONE = "[output]\nsmoothing = { FINE = %s }\n"


def _smooth(control: str, old: str, new: str, says: str, asked: str = "") -> HintCase:
    """The control's smoothing in a program, changed, and put back as the post writes it."""
    on = f"-m mill-3axis -c {control} --setup s.toml"
    return HintCase("verify.smoothing", f"verify p.nc part.cls {on}",
                    {"part.cls": LEVELS_3, "s.toml": LENGTH + (ALONE % asked if asked else "")}, says,
                    (Edit("p.nc", new, old),), first=(f"convert part.cls {on} -o p.nc",), harm=(Edit("p.nc", old, new),))


LEVELS_3 = "UNITS/MM\n" + "".join(
    f"TOOL PATH/{name},TOOL,T1\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\n{SPOKEN}\nFEDRAT/MMPM,600\n{CUT}END-OF-PATH\n"
    for name in ("ROUGH", "FINE"))
_FINE = "-m mill-3axis -c linuxcnc --setup s.toml"
_SMOOTHING = [
    HintCase("setup.smoothing", "convert part.cls -m mill-3axis -c fanuc-30i --setup s.toml -o p.nc",
             {"part.cls": LEVELS_3, "s.toml": LENGTH + ALONE % "0.0001"}, "(0.002) mm, or a level",
             (sheet("0.0001", r"\1"),)),
    _smooth("linuxcnc", "G64 P0.002", "G64 P0.5", "G64 P Q as the post writes it"),
    HintCase("verify.smoothing", f"verify p.nc part.cls {_FINE}", {"part.cls": LEVELS_3, "s.toml": LENGTH},
             "verify with (--tolerance 0.05), which the program was converted with",
             (option(r" \1", ""), Edit("p.nc", "", "")),
             first=(f"convert part.cls {_FINE} -o p.nc --tolerance 0.05",)),
    _smooth("fanuc-30i", "G05.1 Q1 R10", "G05.1 Q1 R9", "G05.1 Q1 as the post writes it", '"finishing"'),
    _smooth("haas-ngc", "E0.003", "E0.5", "G187 E as the post writes it"),
    _smooth("heidenhain-tnc640", "32.1 T0.003", "32.1 T0.5", "CYCL DEF 32.1 T and 32.2 TA as the post writes them"),
    _smooth("siemens-840d", "CYCLE832(0.003", "CYCLE832(0.5", "CYCLE832 as the post writes it"),
]
_ON = "-m mikron-ucp710 -c fanuc-30i --setup s.toml"
_INDEX = [
    HintCase("verify.index", f"verify p.nc part.apt {_ON}",
             {"part.apt": START + TURNED + "FINI\n", "s.toml": LENGTH + '[clearance]\nindex = "plane"\n'},
             r'write (index = "plane") under \[clearance\]', (sheet('index = "home"', r"\1"),),
             first=(f"convert part.apt {_ON} -o p.nc --output-mode axes",),
             harm=(Edit("s.toml", '"plane"', '"home"'),)),
    HintCase("verify.safe_plane", f"verify p.nc part.apt {_ON}",
             {"part.apt": START + TURNED + "FINI\n", "s.toml": LENGTH + "[clearance]\ndistance = 60\n"},
             r"write (distance = [\d.]+) under \[clearance\]", (sheet("distance = 80", r"\1"),),
             first=(f"convert part.apt {_ON} -o p.nc --output-mode axes",),
             harm=(Edit("s.toml", "= 60", "= 80"),)),
]
SAMPLE_KIND = SAMPLE.read_text("utf-8")
LONG = "tip[:, 2] + self.tool_length", "tip[:, 2] + 0.0"


def _fails(*_: Any) -> None:
    raise IndexError("planted")


_CODE = [
    HintCase("machine.contract", "machine check m.toml", {"m.toml": OWN["scissors"], "wrong.py": SAMPLE_KIND.replace(*LONG)},
             "correct the kind", (Edit("wrong.py", *reversed(LONG)),), stands_in=(
                 ("os.environ", {**os.environ, "POSTPROC_KINDS": "wrong.py"}),
                 ("machines.kinds._of_file", _of_file.__wrapped__))),
    convert("witness.failed", START + CUT, "leave (--require-proof) out", option("", " --require-proof"),
            more=" --require-proof", stands_in=(("postproc.verification.second_witness.testify", _fails),)),
]
PASSED_LATE = [*_READINGS, *_ERRORS, *_RECORDS, *_HOOKS, *_PROOFS, *_SMOOTHING, *_INDEX, *_CODE]
