"""Readings as measuring programs deliver them: runs in columns and files, blank cells, positions that differ by little."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.exchange.imports import ImportOptions, read_sources
from toolpaths.diagnostics import Diagnostic

MILL = machines.load("mill-3axis")
DIRECTIONS = "X [mm],EXX+ [um],EXX- [um]\n"
ROWS = DIRECTIONS + "0,1,5\n0,3,7\n0,2,6\n100,11,14\n100,13,18\n100,12,16\n"
"""three runs, both directions"""
SPREAD = [[1.0, 3.0, 2.0], [11.0, 13.0, 12.0], [5.0, 7.0, 6.0], [14.0, 18.0, 16.0]]


def read(folder: Path, files: dict[str, str], how: ImportOptions,
         *sources: str) -> tuple[ErrorModel | None, list[Diagnostic]]:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    named = sources or tuple(files)
    return read_sources([str(folder / s) if "=" not in s else s.replace("=", f"={folder}/") for s in named], MILL, how)


def means(model: ErrorModel | None) -> list[float]:
    """um"""
    assert model is not None
    return [round(1e3 * v, 9) for v in model.values.tolist()]


def sigmas(model: ErrorModel | None) -> list[float]:
    assert model is not None and model.covariance is not None
    assert np.count_nonzero(model.covariance - np.diag(np.diag(model.covariance))) == 0
    return (1e3 * np.sqrt(np.diag(model.covariance))).tolist()


def pooled(readings: list[list[float]]) -> float:
    """Standard deviation of one reading."""
    squares = sum(float(np.sum((np.array(r) - np.mean(r)) ** 2)) for r in readings)
    return float(np.sqrt(squares / sum(len(r) - 1 for r in readings)))


SAME = {
    "rows": {"a.csv": ROWS},
    "columns of runs": {"a.csv": "X [mm],EXX+1 [um],EXX-1 [um],EXX+2 [um],EXX-2 [um],EXX+3 [um],EXX-3 [um]\n"
                                 "0,1,5,3,7,2,6\n100,11,14,13,18,12,16\n"},
    "other names of runs": {"a.csv": "EXX 1+ [um];EXX1- [mm];EXX_2+ [um];EXX2\u2193 [um];EXX 3 \u2191 [um];EXX-03 [um];"
                                     "X [m]\n11;0,014;13;18;12;16;0,1\n1;0,005;3;7;2;6;0\n"},
    "a run next to those without a number": {"a.csv": DIRECTIONS.replace("\n",
                                                                         ",EXX+2 [um],EXX-2 [um],EXX+3 [um],EXX-3 [um]\n")
                                            + "0,1,5,3,7,2,6\n100,11,14,13,18,12,16\n"},
    "in the order of the laser": {"a.csv": DIRECTIONS + "0,1,\n100,11,\n100,,14\n0,,5\n0,3,\n100,13,\n100,,18\n0,,7\n0,2,\n"
                                                  "100,12,\n100,,16\n0,,6\n"},
    "a file for each run": {"a.csv": DIRECTIONS + "0,1,5\n100,11,14\n", "b.csv": DIRECTIONS + "100,13,18\n0,3,7\n",
                            "c.csv": DIRECTIONS + "0,2,6\n100,12,16\n"},
    "a file for each approach direction": {"up.csv": "X [mm],EXX+ [um]\n0,1\n100,11\n0,3\n100,13\n0,2\n100,12\n",
                            "down.csv": "X [mm],EXX- [um]\n100,14\n0,5\n100,18\n0,7\n100,16\n0,6\n"}}


@pytest.mark.parametrize("files", SAME.values(), ids=SAME)
def test_readings_in_any_layout_are_the_same_means_and_uncertainty(files: dict[str, str],
                                                                   tmp_path: Path) -> None:
    model, noted = read(tmp_path, files, ImportOptions(average=True))
    assert means(model) == [2.0, 12.0, 6.0, 16.0]
    up, down = pooled(SPREAD[:2]), pooled(SPREAD[2:])
    assert sigmas(model) == pytest.approx(np.repeat([up, down], 2) / np.sqrt(3.0))
    assert [d.code for d in noted] == ["error-import.averaged"]


def test_ways_in_words_are_those_of_the_component(tmp_path: Path) -> None:
    text = DIRECTIONS.replace("+", " up").replace("-", "\u2193") + "0,1,5\n100,11,14\n"
    model, noted = read(tmp_path, {"a.csv": text}, ImportOptions())
    assert means(model) == [1.0, 11.0, 5.0, 14.0] and not noted


def test_a_reading_that_is_missing_counts_less_and_its_place_has_more_uncertainty(tmp_path: Path) -> None:
    model, _ = read(tmp_path, {"a.csv": ROWS.replace("0,2,6\n1", "0,,6\n1").replace("100,12,16", "100,12,")},
                    ImportOptions(average=True))
    assert means(model) == [2.0, 12.0, 6.0, 16.0]
    up, down = pooled([[1.0, 3.0], SPREAD[1]]), pooled([SPREAD[2], [14.0, 18.0]])
    assert sigmas(model) == pytest.approx([up / 2**0.5, up / 3**0.5, down / 3**0.5, down / 2**0.5])


TARGETS = "target [mm];run 1+ [um];run 1- [um];run 2+ [um];run 2- [um]\n0;1;5;3;7\n100;11;14;13;18\n"


@pytest.mark.parametrize(("old", "new"), [
    ("", ""), ("run", "Lauf"), ("+", " Forward"), ("-", " down"), ("target", "Sollposition"),
    ("target", "Position"), ("target", "Y"), ("run ", ""), ("run ", "Error "), ("run ", "EYY"),
    ("+", "\u2191"), ("0;1;5;3;7\n100;11;14;13;18\n", "100;11;14;13;18\n0;1;5;3;7\n")])
def test_targets_and_runs_are_of_the_component_that_is_named(old: str, new: str, tmp_path: Path) -> None:
    model, noted = read(tmp_path, {"laser.csv": TARGETS.replace(old, new)}, ImportOptions(average=True),
                        "EYY=laser.csv")
    assert means(model) == [2.0, 12.0, 6.0, 16.0], noted
    assert model is not None and [str(c.name) for c in model.axes.components] == ["EYY"]


def test_one_run_of_a_component_needs_no_average(tmp_path: Path) -> None:
    model, noted = read(tmp_path, {"laser.csv": "target [mm],error [um]\n0,1\n100,2\n"}, ImportOptions(),
                        "EYX=laser.csv")
    assert means(model) == [1.0, 2.0] and not noted
    assert model is not None and str(model.axes.components[0].name) == "EYX"


def test_two_ways_in_files_of_their_own_are_one_table(tmp_path: Path) -> None:
    files = {"up.csv": "X [mm],EXX+ [um]\n0,1\n100,11\n", "down.csv": "X [mm],EXX- [um]\n100,14\n0,5\n"}
    model, noted = read(tmp_path, files, ImportOptions())
    assert means(model) == [1.0, 11.0, 5.0, 14.0] and not noted
    assert model is not None and model.covariance is None


def test_positions_that_differ_by_little_are_one_place(tmp_path: Path) -> None:
    text = ROWS.replace("\n0,3", "\n0.0003,3").replace("\n100,11", "\n100.0002,11").replace("\n100,12", "\n99.9997,12")
    model, _ = read(tmp_path, {"a.csv": text}, ImportOptions(average=True, near={"X": 0.01}))
    assert means(model) == [2.0, 12.0, 6.0, 16.0]
    assert model is not None and model.axes.components[0].curve.range == pytest.approx((0.0, 100.0), abs=1e-12)
    exact, _ = read(tmp_path, {"a.csv": text}, ImportOptions(average=True))
    assert exact is not None and len(exact.values) == 10  # five places


def test_nodes_of_a_map_are_met_as_nearly(tmp_path: Path) -> None:
    rng, nodes = np.random.default_rng(4), [(x, y) for x in (0.0, 50.0) for y in (0.0, 20.0, 45.0)]
    rows = [f"{x + a:.4f},{y + b:.4f},{x + y:.3f},1,2" for x, y in nodes for a, b in rng.uniform(-0.002, 0.002, (3, 2))]
    files = {"m.csv": "\n".join(["X [mm],Y [mm],dx [um],dy [um],dz [um]", *rows]) + "\n"}
    model, _ = read(tmp_path, files, ImportOptions(average=True, near={"X": 0.01, "Y": 0.01}))
    assert model is not None and model.map is not None and model.map.table.shape == (2, 3, 6)
    assert model.map.nodes[1] == pytest.approx([0.0, 20.0, 45.0], abs=1e-9)
    assert 1e3 * model.map.table[..., 0].ravel() == pytest.approx([x + y for x, y in nodes])
    plain, faults = read(tmp_path, files, ImportOptions(average=True))
    assert plain is None and faults[0].code.startswith("error-map.")


@pytest.mark.parametrize("text", ["C [deg],ECC [arcsec]\n0,1\n120,4\n240,5\n360,2\n",
                                  "C [deg],ECC [arcsec]\n360.004,2\n240,5\n120,4\n0,1\n",
                                  "C [deg],ECC [arcsec]\n-240,4\n-120,5\n0,2\n119.996,4\n240,5\n360,1\n"])
def test_readings_a_turn_apart_are_of_one_place(text: str, tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(text)
    how = ImportOptions(average=True, periods={"C": 2 * np.pi}, near={"C": np.radians(0.01)})
    machine, arcsec = machines.load("mikron-ucp710"), np.radians(1.0 / 3600.0)
    model, _ = read_sources([str(tmp_path / "c.csv")], machine, how)
    assert model is not None and np.sort(model.values) / arcsec == pytest.approx([1.5, 4.0, 5.0])
    assert model.covariance is not None
    readings = text.count("\n") - 1  # s^2 = (0.5^2 + 0.5^2) / (readings - places), the mean of two has half of it
    variance = np.sort(np.diag(model.covariance) / arcsec**2) * (readings - 3)
    assert variance == pytest.approx([0.25, 0.5, 0.5] if readings == 4 else [0.25, 0.25, 0.25])
    plain, faults = read_sources([str(tmp_path / "c.csv")], machine, ImportOptions(periods={"C": 2 * np.pi}))
    assert plain is None and ("--average" in faults[0].hint or "spans" in faults[0].message)


RUNS = SAME["columns of runs"]
FAULTS = [
    ("rows without --average", {"a.csv": ROWS}, ImportOptions(), "error-model.order", "a.csv:3", "import --average"),
    ("files without --average", SAME["a file for each run"], ImportOptions(), "error-import.twice", "b.csv", "--average"),
    ("columns without --average", RUNS, ImportOptions(), "error-import.runs", "a.csv:1", "EXX+1, EXX-1"),
    ("approach directions without --average", SAME["a file for each approach direction"], ImportOptions(),
     "error-import.runs", "up.csv", "--average"),
    ("blank without --average", {"a.csv": DIRECTIONS + "0,1,2\n9,,3\n"}, ImportOptions(), "error-table.row", "a.csv:3",
     "column EXX+"),
    ("blank position", {"a.csv": DIRECTIONS + "0,1,2\n,1,3\n9,2,2\n"}, ImportOptions(average=True), "error-table.row",
     "a.csv:3",
     "no number in column X"),
    ("never read", {"a.csv": DIRECTIONS + "0,1,2\n9,,3\n9,,4\n"}, ImportOptions(average=True), "error-import.reading",
     "a.csv",
     "no reading of EXX+ at X 9"),
    ("approach directions at other places", {"u.csv": "X [mm],EXX+ [um]\n0,1\n9,2\n",
                                             "d.csv": "X [mm],EXX- [um]\n0,1\n9.001,2\n"},
     ImportOptions(),
     "error-import.reading", "u.csv", "--near"),
    ("near and near", {"a.csv": DIRECTIONS + "0,1,2\n0.01,1,3\n0.02,1,2\n9,1,1\n"},
     ImportOptions(average=True, near={"X": 0.015}),
     "error-import.near", "a.csv", "X from 0 to 0.02"),
    ("near of another axis", {"a.csv": ROWS}, ImportOptions(average=True, near={"Y": 0.1}), "error-import.unused", "",
     "near positions of Y"),
    ("near of no readings", {"a.csv": DIRECTIONS + "0,1,2\n9,1,3\n"}, ImportOptions(near={"X": 0.1}), "error-import.unused",
     "",
     "give --average too"),
    ("a laser without a name", {"a.csv": "Position [mm],run 1 [um],run 2 [um]\n0,1,2\n9,1,2\n"}, ImportOptions(average=True),
     "error-import.columns", "a.csv:1", "imported as e.g. EXX=a.csv"),
    ("one run twice", {"a.csv": "X [mm],EXX+1 [um],EXX 1+ [um]\n0,1,2\n9,1,3\n"}, ImportOptions(average=True),
     "error-import.column",
     "a.csv:1", "'EXX 1+' is EXX+1 again"),
    ("blank constant", {"a.csv": "EC0Y [arcsec],EA0Y [arcsec]\n1,\n"}, ImportOptions(average=True), "error-table.row",
     "a.csv:2",
     "EA0Y")]


@pytest.mark.parametrize(("files", "how", "code", "place", "word"), [f[1:] for f in FAULTS],
                         ids=[f[0] for f in FAULTS])
def test_what_is_wrong_with_readings(files: dict[str, str], how: ImportOptions, code: str, place: str, word: str,
                                     tmp_path: Path) -> None:
    model, faults = read(tmp_path, files, how)
    assert model is None
    first = next(d for d in faults if d.code == code)
    assert word in str(first) and place in str(first)


@pytest.mark.parametrize(("source", "old", "new", "code", "word"), [
    ("EQX=laser.csv", "", "", "error-import.name", "EXX=x.csv"), ("EYY=laser.csv", "run 2-", "mean", "error-import.column",
                                                                 "'mean'"),
    ("EYY=laser.csv", "run 2-", "EXX2-", "error-import.column", "'EXX2-'"),
    ("EYY=laser.csv", "run 2", "run 1", "error-table.header", "twice"),
    ("EYY=laser.csv", "run 2+ [um]", "run 2+", "error-model.unit", "'run 2+' has no unit"),
    ("EYY=laser.csv", "run 2+ [um]", "run [um]", "error-import.column", "'run' is neither"),
    ("EYY=laser.csv", "run 2+", "position", "error-import.column", "'position' is Y again"),
    ("EYY=laser.csv", "run 2+", "EYY+1", "error-import.column", "EYY+1 again"),
    ("EYY=laser.csv", "target", "run 7+", "error-import.column", "no column holds positions")])
def test_what_is_wrong_with_the_columns_of_a_component(source: str, old: str, new: str, code: str, word: str,
                                                       tmp_path: Path) -> None:
    model, faults = read(tmp_path, {"laser.csv": TARGETS.replace(old, new)},
                         ImportOptions(average=True), source)
    assert model is None
    assert faults[0].code == code and word in str(faults[0])


@pytest.mark.parametrize(("unit", "large", "severity"), [
    ("mm", False, "ERROR"), ("mm", True, "WARNING"), ("m", True, "ERROR"), ("um", False, ""), ("um", True, "")])
def test_a_wrong_unit_is_noticed_when_it_comes_in(unit: str, large: bool, severity: str,
                                                  tmp_path: Path) -> None:
    model, noted = read(tmp_path, {"a.csv": f"X [mm],EXX [{unit}]\n-500,0\n500,2.5\n"},
                        ImportOptions(large=large))
    assert (model is None) == (severity == "ERROR")
    assert [(d.code, d.severity.name) for d in noted] == ([("error-model.large", severity)] if severity else [])
    assert model is None or model.large == large
    assert all("EXX is up to" in d.message and "a.csv" in d.file for d in noted)
