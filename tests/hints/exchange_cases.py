"""Hints on tables of errors that are imported, and on maps."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.error_cases import CSV, MAP, SAMPLES, TABLE

AXIS = "X [mm],EXX [um],EYX [um]\n0,1,2\n100,3,4\n"
LATTICE = "X [mm],dx [um],dy [um],dz [um]\n0,0,0,0\n9,1,2,3\n"
CROWD = "".join(f"{k * 1.37},{k * k * 0.71},{k**3 * 0.01},0,0,0\n" for k in range(120))
LASER = '[laser]\ntable = "laser.csv"\nsigma_um = 0.3\ntoward = [1.0, 0.0, 0.0]\ntool_length = 90.0\n'
NOTED = "# error map: tip of a tool of 80 mm, in the directions of the machine\n"


def _import(code: str, says: str, table: str, *does: Edit, given: str = "a.csv", **more: str) -> HintCase:
    """Tables of an import for the 3-axis mill."""
    return HintCase(code, f"errors import {given} -m mill-3axis -o new/model.toml",
                    {"a.csv": table, **{f"{name}.csv": text for name, text in more.items()}}, says, does)


def _a(old: str, new: str) -> Edit:
    return Edit("a.csv", old, new)


def _check(code: str, says: str, model: str, table: str, *does: Edit) -> HintCase:
    return HintCase(code, "errors check e.toml -m mill-3axis", {"e.toml": model, "x.csv": table}, says, does)


_IMPORTS = [
    _import("error-import.axis", "write a table for each axis", AXIS.replace("EXX [um]", "Y [mm]"),
            _a("X [mm],Y [mm],EYX [um]\n0,1,2\n100,3,4", "X [mm],EYX [um]\n0,2\n100,4")),
    _import("error-import.column", "call it (X) or target", "run 1+ [um],run 1- [um],run 7+ [mm]\n0,0,0\n1,0,9\n",
            _a("run 7+ [mm]", r"\1 [mm]"), Edit(COMMAND, " -o", " --average -o"), given="EXX=a.csv"),
    _import("error-import.column", "take others out", "X [mm],EXX+ [um],mean [um]\n0,0,1\n9,1,1\n",
            _a(",mean [um]\n0,0,1\n9,1,1", ",EXX- [um]\n0,0,1\n9,1,1"), given="EXX=a.csv"),
    _import("error-import.columns", r"write e\.g\. (X \[mm\], EXX \[um\]);", "foo [um],bar [um]\n1,2\n2,3\n",
            _a("foo [um],bar [um]", r"\1")),
    _import("error-import.map", "import it without the other 1 sources", AXIS, Edit(COMMAND, "a.csv b.csv", "b.csv"),
            given="a.csv b.csv", b=LATTICE),
    _import("error-import.name", r"write e\.g\. (EXX)=x\.csv", "X [mm],EXX [um]\n0,1\n100,3\n",
            Edit(COMMAND, "EQX", r"\1"), given="EQX=a.csv"),
    _import("error-import.runs", "import with (--average)",
            "X [mm],EXX+1 [um],EXX-1 [um],EXX+2 [um],EXX-2 [um]\n0,1,1,2,2\n9,3,4,5,4\n",
            Edit(COMMAND, " -o", r" \1 -o")),
    _import("error-import.twice", "give every error once", AXIS, Edit("b.csv", "EXX", "EZX"), Edit("b.csv", "EYX", "EAX"),
            Edit("b.csv", "EAX [um]", "EAX [arcsec]"), given="a.csv b.csv", b=AXIS),
    _import("error-import.rows", "keep one row", "EC0Y [arcsec]\n1\n2\n", _a("2\n", "")),
    _import("error-import.unused", "leave it out", AXIS, Edit(COMMAND, " --tool-length 80", ""),
            given="a.csv --tool-length 80"),
    _import("error-import.reading", "take the rows of that place out",
            "X [mm],EXX+ [um],EXX- [um]\n0,1,2\n9,,3\n9,,4\n18,1,2\n",
            _a("9,,3\n9,,4\n", ""), given="a.csv --average"),
    _import("error-import.near", "take less with (--near)", "X [mm],EXX [um]\n0,1\n0.01,2\n0.02,3\n9,1\n",
            Edit(COMMAND, "X=0.011", "X=0.001"), given="a.csv --average --near X=0.011"),
    _import("error-model.column", "write columns .*(EXX).*", "X [mm]\n0\n1\n",
            _a("X [mm]\n0\n1\n", "X [mm],\\1 [um]\n0,1\n1,2\n")),
    _import("error-model.column", "else (EXX) alone", AXIS.replace("EYX", "EXX+"), _a(",EXX+ [um]\n0,1,2\n100,3,4",
                                                                                     "\n0,1\n100,3")),
    _import("error-model.rows", "write two rows or more", "X [mm],EXX [um]\n0,1\n", _a("", "9,1\n")),
    _import("error-import.directions", "import with (--directions machine)", NOTED + LATTICE,
            Edit(COMMAND, " -o", r" \1 -o"), given="a.csv --tool-length 80"),
    _import("error-import.tool_length", "import with (--tool-length 80)", NOTED + LATTICE, Edit(COMMAND, " -o", r" \1 -o"),
            given="a.csv --directions machine"),
]
_MODELS = [
    _check("error-map.period", r"its coordinates are (X)", MAP + "repeats = { Y = 9 }\n", LATTICE,
           Edit("e.toml", "repeats = { Y", r"repeats = { \1"), Edit("x.csv", "9,1,2,3", "9,0,0,0")),
    _check("error-map.period", "write the same values in both", MAP + "repeats = { X = 9 }\n", LATTICE,
           Edit("x.csv", "9,1,2,3", "9,0,0,0")),
    _check("error-map.scattered", "the same levels of each coordinate in every row", MAP,
           "X [mm],Y [mm],Z [mm],dx [um],dy [um],dz [um]\n" + CROWD,
           Edit("x.csv", ",Z [mm]", ""), Edit("x.csv", CROWD, "".join(f"{x},{y},0,0,0\n" for x in (0, 9) for y in (0, 9)))),
    _check("error-model.series", r"write repeats = pitch in mm and (range) = \[lower, upper\]",
           "[components.EXX]\ncosine = [0.001]\n", "", Edit("e.toml", "", "repeats = 10.0\n\\1 = [-300.0, 300.0]\n")),
    _check("error-model.travel", "in the unit that their column says", TABLE, CSV.replace("300,", "300000,"),
           Edit("x.csv", "300000,2", "300,2"), Edit("x.csv", "-300000,0", "-300,0")),
    _check("error-table.unreadable", "save it as CSV, UTF-8", TABLE, "\udcff\udcfeX", Edit("x.csv", "\udcff\udcfeX", CSV)),
]



def _sample(code: str, says: str, name: str, harm: Edit, *does: Edit) -> HintCase:
    """A sample of `calibrate`, one of its files changed."""
    names = (f"{name}.toml", f"{name}.csv", "start.toml", "screw-start.toml", "screw-start-X.csv")
    files = {n: (SAMPLES / "calibration" / n).read_text("utf-8") for n in names}
    assert harm.old in files[harm.file]
    text = files[harm.file].replace(harm.old, harm.new) if harm.old else files[harm.file] + harm.new
    return HintCase(code, f"calibrate {name}.toml -o out.toml", {**files, harm.file: text}, says, does)


def _sheet(old: str, new: str) -> Edit:
    return Edit("rotary.toml", old, new)


_CALIBRATION = [
    _sample("calibrate.axis", r"it has .*(C)$", "rotary", _sheet('axis = "C"', 'axis = "B"'), _sheet('"B"', r'"\1"')),
    _sample("calibrate.harmonics", "ask for fewer", "rotary", _sheet("harmonics = 2", "harmonics = 9"),
            _sheet("harmonics = 9", "harmonics = 2")),
    _sample("calibrate.shifts", "write one per set-up", "reversal", Edit("reversal.toml", "", "shifts = [0]\n"),
            Edit("reversal.toml", "shifts = [0]", "shifts = [0, 1, 2, 3]")),
    _sample("calibrate.kind", r"write one of .*(\[laser\])", "laser", Edit("laser.toml", LASER, ""),
            Edit("laser.toml", "", LASER.replace("[laser]", r"\1"))),
    _sample("calibrate.model", 'write (model = )"start.toml"', "laser",
            Edit("laser.toml", 'model = "screw-start.toml"\n', ""),
            Edit("laser.toml", "[laser]", '\\1"screw-start.toml"\n[laser]')),
    _sample("calibrate.unused", r"columns are .*", "laser", Edit("laser.csv", "X way,", "X wae,"),
            Edit("laser.csv", "X wae,", "X way,")),
]
_MORE = [
    _sample("calibrate.setup", "number the set-ups 0, 1, ... without a gap", "reversal",
            Edit("reversal.csv", "\n3,", "\n5,"),
            Edit("reversal.csv", "\n5,", "\n3,")),
    _sample("calibrate.ways", "add a column (X way)", "laser", Edit("laser.csv", "X way", "spare"),
            Edit("laser.csv", "spare", r"\1")),
    HintCase("error-export.input", "errors import model-X.csv -m mill-3axis -o model.toml", {"model-X.csv": AXIS},
             "write into another folder, or under another name", (Edit(COMMAND, "model.toml", "other.toml"),)),
    _check("error-model.no-effect", r"belongs into (\[components\.\w+\]): (polynomial = \[6\]) and its (range)",
           "[location]\nEX0Y = 6.0\n", "",
           Edit("e.toml", "[location]\nEX0Y = 6.0\n", r"\1\n\2\n\3 = [-500, 500]\n")),
    HintCase("error-model.range", "errors check e.toml -m mikron-ucp710", {
        "e.toml": '[components.EXC]\ntable = "x.csv"\n', "x.csv": "C [deg],EXC [um]\n0,0\n180,1\n360,0\n"},
        "write (repeats = 360) where it closes after a turn", (Edit("e.toml", "", r"\1\n"),)),
]
EXCHANGE = [*_MORE, *_CALIBRATION, *_IMPORTS, *_MODELS]
