"""Hints on recorded runs, meshes, tools, proofs and output files."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.convert_cases import CUT, LENGTH, START, nx

GOOD = "".join(f"{n},{n}\n" for n in range(5, 18))
PROGRAM = (
    "G21 G90 G17 G40 G49 G80 G94 G98 G54\nT1 M6\nS900 M3\nG43 H1\nG0 X1 Y2\nG0 Z50\n"
    + "".join(f"G1 X{5 * k} F{200 + k}\n" for k in range(12))
    + "M2\n"
)


def _log(code: str, text: str, says: str, *does: Edit) -> HintCase:
    return HintCase(
        code,
        "time p.nc -m mill-3axis -c linuxcnc --calibrate log.csv -o model.toml",
        {"p.nc": PROGRAM, "log.csv": text},
        says,
        does,
        stops=("log.fit",),
    )


_LOGS = [
    _log(
        "log.columns", "time_s,X\n" + GOOD, "the first line names the columns", Edit("log.csv", "time_s,X", "nc_line,time_s")
    ),
    _log("log.numbers", "nc_line,time_s\n" + GOOD + "18,ten\n", "one sample a line", Edit("log.csv", "18,ten", "18,18")),
    _log("log.line", "nc_line,time_s\n" + GOOD + "18.5,18\n", "whole numbers from 1", Edit("log.csv", "18.5", "18")),
    _log("log.time", "nc_line,time_s\n" + GOOD + "18,3\n", "in the order of the run", Edit("log.csv", "18,3", "18,18")),
    _log("log.short", "nc_line,time_s\n1,1\n2,2\n", "log every change", Edit("log.csv", "1,1\n2,2\n", GOOD)),
    _log(
        "log.lines",
        "nc_line,time_s\n" + "".join(f"{n * 1000},{n}\n" for n in range(1, 12)),
        "counts the lines of the file",
        Edit("log.csv", "".join(f"{n * 1000},{n}\n" for n in range(1, 12)), GOOD),
    ),
]

TIP = (
    "G21 G90 G17 G40 G49 G80 G94 G98 G54\nT1 M6\nS900 M3\nG43.4 H1\nG0 X1. Y2. Z50.\nG1 X5. A10. F500.\n"
    "G1 X9. A20.\nG1 X20.\nG49\nM2\n"
)
_WHAT_IF = [
    HintCase(
        "time.test",
        "time p.nc -m mill-3axis -c generic-iso --plan-calibration t.nc --plan-seconds 5",
        {"p.nc": PROGRAM},
        "more time with --plan-seconds",
        (Edit(COMMAND, "--plan-seconds 5", "--plan-seconds 60"),),
    ),
    HintCase(
        "time.what_if",
        "time p.nc -m mill-3axis -c linuxcnc --what-if X.speed=1.3",
        {"p.nc": PROGRAM},
        "of the (velocity), acceleration",
        (Edit(COMMAND, "X.speed", r"X.\1"),),
    ),
    HintCase(
        "time.length",
        "time p.nc -m mikron-ucp710 -c fanuc-30i",
        {"p.nc": TIP, "s.toml": "[tools.1]\ngauge_length = 120\n"},
        "give it with --setup",
        (Edit(COMMAND, "", " --setup s.toml"),),
    ),
]


def _box(x: float, y: float, z: float, low: float = 0.0) -> str:
    """A box as OFF, from the origin up."""
    corners = [(a, b, c) for a in (0.0, x) for b in (0.0, y) for c in (low, z)]
    faces = (
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
        (1, 5, 7),
        (1, 7, 3),
    )
    return (
        "OFF\n8 12 0\n" + "".join(f"{a} {b} {c}\n" for a, b, c in corners) + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)
    )


BODY = '[bodies]\npart = "part.off"\n'
GOOD_BOX = _box(30, 30, -10, -40)
SHAPE = START.replace("LOADTL/1\n", "CUTTER/10,0\nLOADTL/1\n") + CUT


def _mesh(
    code: str,
    mesh: str,
    says: str,
    *does: Edit,
    setup: str = LENGTH + BODY,
    text: str = SHAPE,
    file: str = "part.off",
    code_left: bool = False,
) -> HintCase:
    return HintCase(
        code,
        "convert part.apt -m mill-3axis -c linuxcnc --setup s.toml -o p.ngc",
        {"part.apt": text + "FINI\n", "s.toml": setup, file: mesh},
        says,
        does,
        code_left=code_left,
    )


_MESHES = [
    _mesh("mesh.empty", "OFF\n0 0 0\n", "export the solid as a triangle mesh", Edit("part.off", "OFF\n0 0 0\n", GOOD_BOX)),
    _mesh(
        "mesh.open_surface",
        GOOD_BOX.replace("8 12 0", "8 11 0").replace("3 1 7 3\n", ""),
        "close the holes",
        Edit("part.off", "8 11 0", "8 12 0"),
        Edit("part.off", "", "3 1 7 3\n"),
    ),
    _mesh(
        "mesh.sides",
        GOOD_BOX.replace("3 1 7 3\n", "3 1 3 7\n"),
        "export the body as a solid",
        Edit("part.off", "3 1 3 7\n", "3 1 7 3\n"),
    ),
    _mesh(
        "mesh.number",
        GOOD_BOX.replace("30.0 30.0 -10.0", "nan 30.0 -10.0")
        if "30.0" in GOOD_BOX
        else GOOD_BOX.replace("30 30 -10", "nan 30 -10"),
        "export it again",
        Edit("part.off", "nan", "30"),
    ),
    _mesh(
        "mesh.format",
        "solid",
        "export the solid as STL, PLY, OBJ or (OFF)",
        Edit("s.toml", "part.3mf", "part.off"),
        Edit("part.off", "", GOOD_BOX),
        setup=LENGTH + BODY.replace("part.off", "part.3mf"),
        file="part.3mf",
    ),
    _mesh(
        "mesh.size",
        _box(0.5, 0.5, -0.1, -0.4),
        r'state (units = )"mm" or "inch"',
        Edit("s.toml", "[bodies]\n", r'[bodies]\n\1"inch"\n'),
        code_left=True,
    ),
    _mesh(
        "mesh.open",
        GOOD_BOX,
        "paths are relative to the set-up file",
        Edit("s.toml", "there/part.off", "part.off"),
        setup=LENGTH + BODY.replace("part.off", "there/part.off"),
    ),
    _mesh(
        "collision.no_bodies",
        GOOD_BOX,
        r'(part = "part.stl")',
        Edit("s.toml", "", r"\1\n"),
        Edit("s.toml", "part.stl", "part.off"),
        setup=LENGTH + "[bodies]\n",
    ),
    _mesh(
        "collision.unchecked",
        GOOD_BOX,
        r"state (.*) in \[tools\.1\]",
        Edit("s.toml", "[bodies]", "diameter = 10.0\ncorner_radius = 0.0\n[bodies]"),
        text=START + CUT,
        code_left=True,
    ),
    _mesh(
        "collision.shank",
        GOOD_BOX,
        r"state (shank = )\[\.\.\.\] in (\[tools\.1\])",
        Edit("s.toml", "[bodies]", r"\1[{ diameter = 8.0, length = 80.0 }]" + "\n[bodies]"),
        setup=LENGTH + "flute_length = 20.0\nholder = [{ diameter = 40.0, length = 10.0 }]\n" + BODY,
    ),
    _mesh(
        "collision.stack",
        GOOD_BOX,
        "or correct gauge_length",
        Edit("s.toml", "gauge_length = 60.0", "gauge_length = 130.0"),
        setup="[tools.1]\ngauge_length = 60.0\nflute_length = 20.0\nshank = [{ diameter = 8.0, length = 60.0 }]\n"
        "holder = [{ diameter = 40.0, length = 30.0 }]\n"
        + BODY,
    ),
]
FILES = {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}
MADE = "convert part.apt -m mill-3axis -c linuxcnc --setup s.toml -o p.ngc --proof"
LOOK = "verify p.ngc part.apt -m mill-3axis -c linuxcnc --setup s.toml"


def _verify(
    code: str,
    says: str,
    *does: Edit,
    first: tuple[str, ...] = (MADE,),
    harm: tuple[Edit, ...] = (),
    command: str = LOOK,
    files: dict[str, str] | None = None,
    code_left: bool = False,
    stops: tuple[str, ...] = (),
) -> HintCase:
    return HintCase(code, command, files or FILES, says, does, first=first, harm=harm, code_left=code_left, stops=stops)


_AGAIN = "convert part.apt -m mill-3axis -c linuxcnc --setup s.toml -o p.ngc"
_PROOFS = [
    _verify(
        "proof.damaged",
        "or verify without this file|--proof",
        Edit(COMMAND, LOOK, MADE),
        harm=(Edit("p.ngc.proof.json", '"schema', '"skema'),),
    ),
    _verify(
        "proof.open",
        "name the file that convert --proof has written",
        Edit(COMMAND, "q.json", "p.ngc.proof.json"),
        command=LOOK + " --proof q.json",
    ),
    _verify(
        "verify.setup",
        "convert again|verify with|verify without",
        Edit(COMMAND, "--setup t.toml", "--setup s.toml"),
        command=LOOK.replace("s.toml", "t.toml"),
        files=FILES | {"t.toml": LENGTH + "[clearance]\nmargin = 49.0\n"},
    ),
    _verify(
        "verify.stop",
        "remove the stops",
        Edit("p.ngc", "M1\n", ""),
        harm=(Edit("p.ngc", "\nX9\n", "\nM1\nX9\n"),),
        stops=("proof.program",),
    ),
    _verify(
        "verify.rest", "remove the dwell", Edit("p.ngc", "G4 P0.5\n", ""), harm=(Edit("p.ngc", "\nX9\n", "\nG4 P0.5\nX9\n"),)
    ),
    _verify("verify.slow", "correct the F word", Edit("p.ngc", "F60\n", "F600\n"), harm=(Edit("p.ngc", "F600", "F60"),)),
    _verify(
        "verify.feed_missing",
        "state (F) in this block",
        Edit("p.ngc", "G1 Z0\n", r"G1 Z0 \g<1>600\n"),
        harm=(Edit("p.ngc", " F600", ""),),
    ),
    _verify(
        "verify.not_reached",
        "a block behind this line is missing",
        Edit("p.ngc", "\nX8\n", "\nX9\n"),
        harm=(Edit("p.ngc", "\nX9\n", "\nX8\n"),),
    ),
    _verify(
        "verify.error_model",
        "verify with --error-model",
        Edit(COMMAND, "", " --error-model e.toml"),
        files=FILES | {"e.toml": 'corrected_by = "post"\n[location]\nEC0Y = 1\n'},
        first=(MADE + " --error-model e.toml",),
    ),
    _verify(
        "residuals.none",
        "leave (--residuals) out",
        Edit(COMMAND, " --residuals r.csv", ""),
        first=(),
        command=_AGAIN + " --error-model e.toml --residuals r.csv",
        files=FILES | {"e.toml": 'corrected_by = "control"\n[location]\nEC0Y = 1\n'},
    ),
    _verify(
        "compensation.control",
        '(corrected_by = "post")',
        Edit("e.toml", 'corrected_by = "control"', r"\1"),
        first=(),
        command=_AGAIN + " --error-model e.toml",
        files=FILES | {"e.toml": 'corrected_by = "control"\n[location]\nEC0Y = 1\n'},
    ),
]


def _sheet(code: str, says: str, *does: Edit, more: str, **files: str) -> HintCase:
    return HintCase(
        code,
        "setup new part.apt -m mill-3axis -c linuxcnc -o new.toml --force" + more,
        {"part.apt": START.replace("FEDRAT/MMPM,600\n", "") + CUT + "FINI\n", **files},
        says,
        does,
    )


_SHEETS = [
    _sheet("setup.no_such_tool", "it cuts with T(1)", Edit(COMMAND, "9=120", r"\1=120"), more=" --yes --gauge-length 9=120"),
    _sheet("setup.assumed", "state it by (--feed) MM/MIN, or in the file", Edit(COMMAND, "", r" \1 300"), more=" --yes"),
    HintCase(
        "setup.short_tool",
        "setup new part.apt -m mill-3axis -c linuxcnc -o new.toml --force --yes --gauge-length 20",
        {"part.apt": START.replace("LOADTL/1\n", "TLDATA/MILL,10,0,75,0,0\nLOADTL/1\n") + CUT + "FINI\n"},
        "in mm from the gauge point",
        (Edit(COMMAND, "--gauge-length 20", "--gauge-length 120"),),
    ),
    HintCase(
        "setup.offered",
        "convert part.apt -m mill-3axis -c linuxcnc -o p.ngc",
        {"part.apt": START.replace("FEDRAT/MMPM,600\n", "") + CUT + "FINI\n"},
        r"postproc (setup new .* -o part\.setup\.toml)",
        (Edit(COMMAND, "convert part.apt -m mill-3axis -c linuxcnc -o p.ngc", r"\1 --yes"),),
    ),
    HintCase(
        "file.program",
        "inspect p.ngc",
        {"p.ngc": "%\n(part)\nG21 G90\nG0 X1 Y2\nM2\n%\n", "part.apt": START + CUT},
        "name the CL file",
        (Edit(COMMAND, "p.ngc", "part.apt"),),
    ),
]
_NUMBERS = [
    HintCase("file.syntax", "convert part.apt -m mill-3axis -c linuxcnc --setup part.apt -o p.nc",
             {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}, "name the TOML file of the set-up",
             (Edit(COMMAND, "--setup part.apt", "--setup s.toml"),)),
    HintCase("file.syntax", "convert part.apt -m p.ngc -c linuxcnc --setup s.toml -o q.nc",
             {"part.apt": START + CUT + "FINI\n", "p.ngc": "G21 G90\nG0 X1\nM2\n", "s.toml": LENGTH},
             "name the TOML file of the machine", (Edit(COMMAND, "-m p.ngc", "-m mill-3axis"),)),
    HintCase("file.program", "verify part.igs part.apt -m mill-3axis -c linuxcnc --setup s.toml",
             {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH,
              "part.igs": f"{'part':<72}S      1\n{'1H,,1H;':<72}G      1\n"},
             "name the program first", (Edit(COMMAND, "part.igs", "p.ngc"),),
             first=("convert part.apt -m mill-3axis -c linuxcnc --setup s.toml -o p.ngc",)),
    HintCase("setup.number_taken", "setup new part.cls -m mill-3axis -o new.toml --force --yes --tool-number EM6=2",
             {"part.cls": "UNITS/MM\n" + nx("EM12", 2, 12) + nx("EM6", 2, 6)}, "(--tool-number EM6=[0-9]+)",
             (Edit(COMMAND, "--tool-number EM6=2", r"\1"),)),
    HintCase("setup.no_such_name", "setup new part.cls -m mill-3axis -o new.toml --force --yes --tool-number EM7=3",
             {"part.cls": "UNITS/MM\n" + nx("EM12", 2, 12) + nx("EM6", 2, 6)}, "tools that need one: (EM6)",
             (Edit(COMMAND, "EM7", r"\1"),)),
]
FILE = [*_NUMBERS, *_LOGS, *_WHAT_IF, *_MESHES, *_PROOFS, *_SHEETS]
