"""Error model files as people send them: every fault is reported with its file and line, what is there, and what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.fingerprint import fingerprint
from machines.geometric_error.files.loader import load_checked
from machines.geometric_error.tables.csv_table import UNITS, read_csv
from machines.geometric_error.tables.lattice_file import map_from_csv
from toolpaths.diagnostics import Severity

TABLE = '[components.EXX]\ntable = "x.csv"\n'
CSV = "X [mm],EXX [um]\n-300,0\n0,1\n300,2\n"
MAP = '[map]\ntable = "x.csv"\n'
COVARIANCE = '[covariance]\ntable = "x.csv"\n[location]\nEC0Y = 1\nEB0Z = 1\n'

GOOD = {"byte order mark and CRLF": b"\xef\xbb\xbf" + CSV.replace("\n", "\r\n").encode(),
        "micro sign": CSV.replace("[um]", "[\u00b5m]").encode(), "greek mu": CSV.replace("[um]", "[\u03bcm]").encode(),
        "decimal commas": b"X [mm];EXX [um]\n-300,0;0,00\n0;1,0\n300;2\n", "tabs": CSV.replace(",", "\t").encode(),
        "quotes": b'"X [mm]","EXX [um]"\n"-300","0"\n0,"1"\n300,2\n',
        "comments and blank lines": b"# laser\n\nX [mm],EXX [um]\n-300,0\n# again\n0,1\n\n300,2\n",
        "UTF-16": CSV.encode("utf-16"), "Windows-1252": CSV.replace("[um]", "[\u00b5m]").encode("cp1252"),
        "separators behind the last column": b"X [mm];EXX [um];;\n-300;0;;\n0;1;\n300;2;;\n;;;\n",
        "a row of units": b"X;EXX\nmm;\xb5m\n-300;0\n0;1\n300;2\n",
        "units in brackets below": b"X,EXX\n[mm],(um)\n-300,0\n0,1\n300,2\n",
        "round brackets": CSV.replace("[", "(").replace("]", ")").encode(),
        "a line for the spreadsheet": b"sep=;\n" + CSV.replace(",", ";").encode(),
        "targets on the return": b"X [mm],EXX [um]\n300,2\n0,1\n-300,0\n",
        "titles above the header": b"Laser, XL-80, 2026\nMachine: DMU\nRuns,1\nAxis,X\n\n" + CSV.encode(),
        "titles of a sheet": b"Machine;DMU\r\nTemperature;20,1\r\nX;EXX\r\nmm;\xb5m\r\n-300;0\r\n0;1\r\n300;2\r\n",
        "metres and inches": b"X [m],EXX [in]\n-0.3,0\n0,3.937007874015748e-05\n0.3,7.874015748031496e-05\n"}


@pytest.mark.parametrize("text", GOOD.values(), ids=GOOD)
def test_tables_as_programs_save_them(tmp_path: Path, text: bytes) -> None:
    (tmp_path / "e.toml").write_text(TABLE)
    (tmp_path / "x.csv").write_bytes(text)
    found, faults = load_checked(tmp_path / "e.toml", machines.load("mikron-ucp710"))
    assert found is not None and not faults
    assert found.values == pytest.approx([0.0, 0.001, 0.002]) and found.axes.components[0].curve.range == (-300.0, 300.0)


BAD = [
    ("UTF-16 without a mark", TABLE, CSV.encode("utf-16-le"), "error-table.unreadable", "e.toml", 2, "x.csv is not text"),
    ("binary", TABLE, bytes(range(256)), "error-table.unreadable", "e.toml", 2, "not text"),
    ("zeros", TABLE, bytes(9), "error-table.unreadable", "e.toml", 2, "not text"),
    ("half a letter", TABLE, b"\xff\xfeX", "error-table.unreadable", "e.toml", 2, "not text"),
    ("no letter", TABLE, b"X [mm],EXX [\x81m]\n0,1\n", "error-table.unreadable", "e.toml", 2, "not text"),
    ("empty", TABLE, b"", "error-table.empty", "x.csv", 0, "nothing"),
    ("header alone", TABLE, b"X [mm],EXX [um]\n\n", "error-table.empty", "x.csv", 1, "header alone"),
    ("no header", TABLE, b"-300,0\n300,2\n", "error-table.header", "x.csv", 1, "holds numbers"),
    ("no header below words", TABLE, b"Machine: DMU\n0,1\n9,1\n", "error-table.header", "x.csv", 1,
     "'Machine: DMU' is one column"),
    ("a word in the first row", TABLE, b"X [mm],EXX [um]\na,b\n0,1\n9,1\n", "error-table.row", "x.csv", 2, "'a'"),
    ("titles that are too many", TABLE, b"Machine\n" * 60 + b"X [mm],EXX [um]\n0,1\n9,1\n", "error-table.header", "x.csv", 1,
     "one column"),
    ("a file of LinuxCNC", TABLE, b"0 0.001 0\n9 9.001 9\n", "error-table.header", "x.csv", 1, "without commas"),
    ("words in a column", TABLE, b"X [mm],EXX [um],note\n0,1,ok\n9,1,warm\n", "error-table.row", "x.csv", 2, "'ok'"),
    ("column without a name", TABLE, b"X [mm];;EXX [um]\n0;1;2\n", "error-table.header", "x.csv", 1, "'' is not a column"),
    ("value without a name", TABLE, b"X [mm];EXX [um];\n0;1;2\n", "error-table.row", "x.csv", 2, "3 values, 2 columns"),
    ("units alone", TABLE, b"X;EXX\nmm;um\n", "error-table.row", "x.csv", 2, "'mm'"),
    ("commas between and within", TABLE, b"X [mm],EXX [um]\n-300,5,0,2\n300,0,1,0\n", "error-table.row", "x.csv", 2,
     "4 values, 2 columns"),
    ("point and comma", TABLE, b"X [mm];EXX [um]\n-300,5;0.2\n300;1\n", "error-table.row", "x.csv", 2, "'-300,5'"),
    ("thousands", TABLE, b"X [mm];EXX [um]\n-1,300;0\n1,300;2\n", "error-table.row", "x.csv", 2, "thousands"),
    ("hole", TABLE, b"X [mm],EXX [um]\n-300,0\n0,\n300,2\n", "error-table.row", "x.csv", 3, "no number in column EXX"),
    ("nan", TABLE, b"X [mm],EXX [um]\n-300,0\n0,NaN\n", "error-table.row", "x.csv", 3, "not finite"),
    ("overflow", TABLE, b"X [mm],EXX [um]\n-300,1e999\n0,1\n", "error-table.row", "x.csv", 2, "not finite"),
    ("underscore", TABLE, b"X [mm],EXX [um]\n-3_00,1\n0,1\n", "error-table.row", "x.csv", 2, "'-3_00'"),
    ("repeated", TABLE, b"X [mm],EXX [um]\n0,1\n0,1\n9,2\n", "error-model.order", "x.csv", 3, "0 after 0"),
    ("to and fro", TABLE, b"X [mm],EXX [um]\n0,1\n9,1\n5,1\n", "error-model.order", "x.csv", 4, "5 after 9"),
    ("one row", TABLE, b"X [mm],EXX [um]\n9,1\n", "error-model.rows", "x.csv", 2, "one row"),
    ("angle for a length", TABLE, CSV.replace("[um]", "[arcsec]").encode(), "error-model.unit", "x.csv", 1, "'arcsec'"),
    ("degrees of a slide", TABLE, CSV.replace("[mm]", "[deg]").encode(), "error-model.unit", "x.csv", 1, "'deg'"),
    ("folder", TABLE.replace("x.csv", "."), b"", "error-table.unreadable", "e.toml", 2, "no regular file"),
    ("device", TABLE.replace("x.csv", "/dev/zero"), b"", "error-table.unreadable", "e.toml", 2, "no regular file"),
    ("outside", TABLE.replace("x.csv", "../../no/such.csv"), b"", "error-table.not-found", "e.toml", 2, "'such.csv'"),
    ("null in the name", TABLE.replace("x.csv", "a\\u0000b"), b"", "error-table.unreadable", "e.toml", 2, "cannot read"),
    ("long name", TABLE.replace("x.csv", "a" * 5000), b"", "error-table.unreadable", "e.toml", 2, "cannot read 'aaa"),
    ("no such axis", "[components.EXB]\nmean = 1\n", b"", "error-model.axis", "e.toml", 1, "no axis 'B'"),
    ("no such axis moved", "[location]\nEC0B = 3\n", b"", "error-model.axis", "e.toml", 2, "no axis 'B'"),
    ("not a number", "[components.EXX]\npolynomial = [nan]\nrange = [0, 1]\n", b"", "file.range", "e.toml", 2, "NaN"),
    ("huge", "[location]\nEX0C = 1e12\n", b"", "error-model.large", "e.toml", 2, "1e+09 mm"),
    ("sigma next to covariance", COVARIANCE + "[sigma]\nEC0Y = 1\n", b"", "file.value", "e.toml", 1, "not both"),
    ("negative sigma", "[location]\nEC0Y = 1\n[sigma]\nEC0Y = -1\n", b"", "file.range", "e.toml", 4, "-1"),
    ("negative variance", COVARIANCE, b"p,EC0Y\nEC0Y,-1\n", "error-table.covariance", "x.csv", 0, "variance of EC0Y is -1"),
    ("not positive", COVARIANCE, b"p,EC0Y,EB0Z\nEC0Y,1,2\nEB0Z,2,1\n", "error-table.covariance", "x.csv", 0, "eigenvalue"),
    ("not symmetric", COVARIANCE, b"p,EC0Y,EB0Z\nEC0Y,1,0.5\nEB0Z,0.1,1\n", "error-table.covariance", "x.csv", 0,
     "EC0Y with EB0Z is 0.5, reversed 0.1"),
    ("covariance of nothing", COVARIANCE, b"p,EC0X\nEC0X,1\n", "error-table.row", "x.csv", 1, "no parameter 'EC0X'"),
    ("covariance twice", COVARIANCE, b"p,EC0Y,EC0Y\nEC0Y,1,1\nEC0Y,1,1\n", "error-table.row", "x.csv", 1, "twice"),
    ("covariance not square", COVARIANCE, b"p,EC0Y,EB0Z\nEC0Y,1,0\n", "error-table.row", "x.csv", 1, "1 rows for 2"),
    ("covariance shuffled", COVARIANCE, b"p,EC0Y,EB0Z\nEB0Z,1,0\nEC0Y,0,1\n", "error-table.row", "x.csv", 2, "'EB0Z'"),
    ("covariance not finite", COVARIANCE, b"p,EC0Y\nEC0Y,inf\n", "error-table.row", "x.csv", 2, "not finite"),
    ("covariance in words", COVARIANCE, b"p,EC0Y\nEC0Y,one\n", "error-table.row", "x.csv", 2, "one"),
    ("covariance missing", COVARIANCE.replace("x.csv", "y.csv"), b"", "error-table.not-found", "e.toml", 2, "'y.csv'"),
    ("map and more", MAP + "[location]\nEC0Y = 1\n", b"", "file.value", "e.toml", 1, "stands alone"),
    ("map of nowhere", MAP, b"dx [um],dy [um],dz [um]\n1,2,3\n", "error-map.column", "x.csv", 1, "needs coordinates"),
    ("map with turns in um", MAP, b"X [mm],dx [um],dy [um],dz [um],rx [um]\n0,1,2,3,4\n", "error-map.unit", "x.csv", 1,
     "'rx'"),
    ("map of another axis", MAP, b"B [deg],dx [um],dy [um],dz [um]\n0,1,2,3\n", "error-model.machine", "e.toml", 1, "'B'"),
    ("too long a period", TABLE + "repeats = 100\n", CSV.encode(), "error-model.period", "x.csv", 4, "spans 600"),
    ("short spline", TABLE + 'interpolation = "spline"\n', CSV.encode(), "error-model.spline", "e.toml", 2, "4 rows"),
]


@pytest.mark.parametrize(("toml", "csv", "code", "file", "line", "word"), [b[1:] for b in BAD],
                         ids=[b[0] for b in BAD])
def test_what_is_wrong_is_reported(tmp_path: Path, toml: str, csv: bytes, code: str, file: str, line: int,
                                   word: str) -> None:
    (tmp_path / "e.toml").write_text(toml)
    (tmp_path / "x.csv").write_bytes(csv)
    found, faults = load_checked(tmp_path / "e.toml", machines.load("mikron-ucp710"))
    assert found is None and len(faults) == 1, faults
    first = faults[0]
    assert (first.code, Path(first.file).name, first.lines[:1]) == (code, file, (line,) if line else ())
    assert word in first.message and len(str(first)) < 400 + len(str(tmp_path))
    assert first.hint or first.code.startswith("file.")


@pytest.mark.parametrize("text", ['parameter,EC0Y,EB0Z\nEC0Y,4,1\nEB0Z,1,9\n',
                                  '# probe\n"parameter";"EB0Z";"EC0Y"\n"EB0Z";9;1\n"EC0Y";1;4\n'])
def test_a_covariance_as_programs_save_it(text: str, tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text(COVARIANCE)
    (tmp_path / "x.csv").write_text(text)
    found, faults = load_checked(tmp_path / "e.toml", machines.load("mikron-ucp710"))
    assert found is not None and found.covariance is not None and not faults
    assert found.covariance / UNITS["arcsec"] ** 2 == pytest.approx(np.array([[4.0, 1.0], [1.0, 9.0]]))


def test_a_thousand_faults_are_one_message(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("X [mm],EXX [um]\n" + "a,b\n" * 1000)
    table, faults = read_csv(tmp_path / "x.csv")
    assert table is None and len(faults) == 1 and faults[0].count == 1000 and faults[0].lines == (2, 3, 4, 5, 6, 7)


def test_no_errors_at_all_are_a_warning(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text("")
    found, faults = load_checked(tmp_path / "e.toml", machines.load("mikron-ucp710"))
    assert found is not None and [d.severity for d in faults] == [Severity.WARNING]
    assert "no errors" in faults[0].message and faults[0].hint


@pytest.mark.parametrize(("toml", "machine", "line", "said"), [
    ('length_unit = "mm"\n[location]\nEX0C = 25\n', "mikron-ucp710", 3,
     "EX0C is up to 25 mm; errors above 1 mm are refused"),
    ("[components.ECC]\ncosine = [2500]\n", "mikron-ucp710", 1,
     "ECC is up to 0.6944 degrees; errors above 0.5 degrees are refused"),
    (TABLE, "mikron-ucp710", 1, "EXX is up to 2 mm"), (MAP, "mikron-ucp710", 2, "dy is up to 3 mm"),
    ('length_unit = "mm"\n[legs.X]\nrail = [16.0, 0.0, 0.0]\n', "uranesx", 2, "X.rail.x is up to 16 mm")])
def test_a_wrong_unit_is_refused_unless_the_file_says_that_it_is_right(toml: str, machine: str, line: int, said: str,
                                                                      tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text(toml)
    (tmp_path / "x.csv").write_text(CSV.replace("[um]", "[mm]") if toml == TABLE else
                                    "X [mm],dx [um],dy [mm],dz [um]\n0,1,2,3\n9,1,3,3\n")
    found, faults = load_checked(tmp_path / "e.toml", machines.load(machine))
    assert found is None and len(faults) == 1 and faults[0].code == "error-model.large" and faults[0].lines == (line,)
    assert said in faults[0].message and "large = true" in faults[0].hint and "a wrong unit" in faults[0].hint
    (tmp_path / "e.toml").write_text("large = true\n" + toml)
    found, faults = load_checked(tmp_path / "e.toml", machines.load(machine))
    assert found is not None and [(d.code, d.severity) for d in faults] == [("error-model.large", Severity.WARNING)]
    save(replace(found, name="again"), tmp_path)
    again, faults = load_checked(tmp_path / "again.toml", machines.load(machine))
    assert again is not None and again.large and fingerprint(again) == fingerprint(found)


def test_no_machine_has_errors_of_decimetres(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text('large = true\nlength_unit = "mm"\n[location]\nEX0C = 101\n')
    found, faults = load_checked(tmp_path / "e.toml", machines.load("mikron-ucp710"))
    assert found is None and "errors above 100 mm are refused" in faults[0].message and "large" not in faults[0].hint


def test_legs_of_a_machine_on_rods_are_no_axes(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text("[components.EXX]\npolynomial = [1]\nrange = [0, 1]\n")
    found, faults = load_checked(tmp_path / "e.toml", machines.load("uranesx"))
    assert found is None and faults[0].code == "error-model.axis" and "[legs]" in faults[0].hint


def test_a_large_lattice_in_any_order_is_read(tmp_path: Path) -> None:
    mesh = np.stack([m.ravel() for m in np.meshgrid(*(np.linspace(0, 300, 31),) * 3, indexing="ij")], axis=1)
    rows = np.random.default_rng(0).permutation(np.column_stack([mesh, 0.1 * mesh]))
    np.savetxt(tmp_path / "x.csv", rows, "%.6g", ",", header="X [mm],Y [mm],Z [mm],dx [um],dy [um],dz [um]",
               comments="")
    table, _ = read_csv(tmp_path / "x.csv")
    assert table is not None and len(table) == 31**3
    found, faults = map_from_csv(table)
    assert found is not None and not faults
    assert found.at(np.array([[10.0, 55.0, 120.0]]))[0, :3] == pytest.approx([0.001, 0.0055, 0.012], abs=1e-9)
