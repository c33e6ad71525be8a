"""Hints on error models and measurements."""

from __future__ import annotations

from pathlib import Path

from tests.hints.case import Edit, HintCase

SAMPLES = Path(__file__).parents[2] / "samples"
TABLE = '[components.EXX]\ntable = "x.csv"\n'
CSV = "X [mm],EXX [um]\n-300,0\n0,1\n300,2\n"
MAP = '[map]\ntable = "x.csv"\n'
COVARIANCE = '[covariance]\ntable = "x.csv"\n[location]\nEC0Y = 1\nEB0Z = 1\n'


def _model(code: str, model: str, table: str, says: str, *does: Edit, machine: str = "mikron-ucp710") -> HintCase:
    return HintCase(code, f"errors check e.toml -m {machine}", {"e.toml": model, "x.csv": table}, says, does)


def _csv(old: str, new: str) -> Edit:
    return Edit("x.csv", old, new)


def _toml(old: str, new: str) -> Edit:
    return Edit("e.toml", old, new)


_ERRORS = [
    _model(
        "error-table.header",
        TABLE,
        "-300,0\n0,1\n300,2\n",
        r"write a header line first, e\.g\. (X \[mm\]), (EXX \[um\])",
        _csv("-300,0", r"\1,\2\n-300,0"),
    ),
    _model(
        "error-table.header",
        TABLE,
        CSV.replace("EXX [um]", "X [mm]"),
        "name every column once",
        _csv("X [mm],X [mm]", "X [mm],EXX [um]"),
    ),
    _model(
        "error-table.row",
        TABLE,
        CSV.replace("0,1\n", "0,\n"),
        "take the row out where nothing was measured",
        _csv("0,\n", ""),
    ),
    _model("error-table.unit", TABLE, CSV.replace("[um]", "[furlong]"), "known: .*(um)", _csv("furlong", r"\1")),
    _model("error-table.empty", TABLE, "X [mm],EXX [um]\n", "then a row per position", _csv("", "-300,0\n300,2\n")),
    _model(
        "error-table.not-found", TABLE.replace("x.csv", "y.csv"), CSV, "looked in|write the name", _toml("y.csv", "x.csv")
    ),
    _model(
        "error-table.covariance",
        COVARIANCE,
        "p,EC0Y,EB0Z\nEC0Y,1,0.5\nEB0Z,0.1,1\n",
        "write the same number in both",
        _csv("0.1", "0.5"),
    ),
    _model(
        "error-table.covariance",
        COVARIANCE.replace("EB0Z = 1\n", ""),
        "p,EC0Y\nEC0Y,-1\n",
        "a variance is 0 or more",
        _csv("-1", "1"),
    ),
    _model(
        "error-model.order",
        TABLE,
        CSV.replace("300,2", "-100,2"),
        "sort the rows by position",
        _csv("0,1\n-100,2\n", "-100,2\n0,1\n"),
    ),
    _model("error-model.unit", TABLE, CSV.replace("[um]", "[arcsec]"), "with one of mm, (um),", _csv("arcsec", r"\1")),
    _model("error-model.axis", "[components.EXB]\nmean = 1\n", "", "it has X, Y, Z, A, (C)", _toml("EXB", r"EX\1")),
    _model(
        "error-model.large",
        'length_unit = "mm"\n[location]\nEX0C = 25\n',
        "",
        "most likely a wrong unit: (length_unit)",
        _toml('length_unit = "mm"', r'\1 = "um"'),
    ),
    _model(
        "error-model.period",
        TABLE + "repeats = 100\n",
        CSV,
        "give one period",
        _csv("-300,0\n0,1\n300,2\n", "0,1\n50,0.5\n100,1\n"),
    ),
    _model("error-model.spline", TABLE + 'interpolation = "spline"\n', CSV, "write (linear)", _toml("spline", r"\1")),
    _model("error-model.empty", "", "", r"write \[components\], (\[location\])", _toml("", r"\1\nEC0Y = 1\n")),
    _model(
        "error-model.machine",
        'machine = "trunnion-bc"\n[location]\nEX0C = 1\n',
        "",
        "the key out where the machine is a copy",
        _toml('machine = "trunnion-bc"\n', ""),
    ),
    _model(
        "error-model.legs",
        "[legs.K]\nrail = [0.016, 0.0, 0.0]\n",
        "",
        "its legs are (X)",
        _toml("legs.K", r"legs.\1"),
        machine="uranesx",
    ),
    _model(
        "error-model.legs",
        "[legs.X]\nrail = [0.016, 0.0, 0.0]\n",
        "",
        r"take (\[legs\]) out",
        _toml("[legs.X]\nrail = [0.016, 0.0, 0.0]\n", "[location]\nEX0C = 1\n"),
    ),
    _model(
        "error-map.column",
        MAP,
        "dx [um],dy [um],dz [um]\n1,2,3\n",
        "write .*X",
        _csv("dx [um],dy [um],dz [um]\n1,2,3\n", "X [mm],dx [um],dy [um],dz [um]\n0,0,0,0\n9,1,2,3\n"),
    ),
    _model(
        "error-map.unit",
        MAP,
        "X [mm],dx [um],dy [um],dz [um],rx [um]\n0,0,0,0,0\n9,1,2,3,4\n",
        "write (?:one of )?.*(arcsec)",
        _csv("rx [um]", r"rx [\1]"),
    ),
    _model(
        "error-map.twice",
        MAP,
        "X [mm],dx [um],dy [um],dz [um]\n0,0,0,0\n9,1,2,3\n9,1,2,4\n",
        "once|--average",
        _csv("9,1,2,4\n", ""),
    ),
    _model(
        "error-map.missing",
        MAP,
        "X [mm],Y [mm],dx [um],dy [um],dz [um]\n0,0,0,0,0\n9,0,1,2,3\n0,9,1,2,3\n",
        "every",
        _csv("0,9,1,2,3\n", "0,9,1,2,3\n9,9,1,2,3\n"),
    ),
]


def sample(name: str) -> str:
    return (SAMPLES / "calibration" / name).read_text("utf-8")


def measured(code: str, says: str, table: str, old: str, new: str, *does: Edit, harm: tuple[Edit, ...] = ()) -> HintCase:
    """A calibration of the samples; what is wrong is in its table, or is done by `harm`."""
    name = table.removesuffix(".csv")
    starts = {n: sample(n) for n in ("start.toml", "screw-start.toml", "screw-start-X.csv", "bar-start.toml")}
    return HintCase(
        code,
        f"calibrate {name}.toml -o out.toml",
        {f"{name}.toml": sample(f"{name}.toml"), table: sample(table).replace(old, new, 1), **starts},
        says,
        does,
        harm=harm,
    )


_CALIBRATION = [
    measured(
        "calibrate.unit",
        "write reading .unit. with one of (?:.*, )?(arcsec)|write .* one of .*(arcsec)",
        "reversal.csv",
        "[arcsec]",
        "[um]",
        Edit("reversal.csv", "[um]", "[arcsec]"),
    ),
    measured(
        "calibrate.unit", "write (X way) alone", "laser.csv", "X way", "X way [mm]", Edit("laser.csv", "X way [mm]", r"\1")
    ),
    measured("calibrate.column", "write (X way)", "laser.csv", "X way", "x way", Edit("laser.csv", "x way", r"\1")),
    measured(
        "calibrate.slip",
        r"reading in (arcsec) \(write (\[arcsec\]) in the header\)",
        "reversal.csv",
        "[arcsec]",
        "[urad]",
        Edit("reversal.csv", "[urad]", r"\2"),
    ),
    measured(
        "calibrate.distance",
        r"write (distance \[mm\])",
        "ball_bar.csv",
        "distance [mm]",
        "distance [um]",
        Edit("ball_bar.csv", "distance [um]", r"\1"),
    ),
    measured(
        "calibrate.travel",
        "look at the unit of X",
        "ball_bar.csv",
        "X [mm]",
        "X [in]",
        Edit("ball_bar.csv", "X [in]", "X [mm]"),
    ),
]
ERRORS = [*_ERRORS, *_CALIBRATION]
