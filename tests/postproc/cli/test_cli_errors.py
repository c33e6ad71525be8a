"""`postproc errors`: check, export, import from the command line; what it writes, says and refuses."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import machines
from machines.geometric_error.exchange import exports, survey
from machines.geometric_error.files.loader import load
from postproc.cli.app import app

SAMPLES = Path(__file__).parents[3] / "samples" / "errors"
MIKRON = SAMPLES / "mikron-ucp710.toml"


@pytest.fixture(autouse=True)
def few_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """Models are looked at in few places, the same in all commands."""
    monkeypatch.setattr(survey, "PLACES", 1000)
    monkeypatch.setattr(exports, "WORST_PLACES", 1000)


def run(*arguments: object, code: int = 0) -> Result:
    done = CliRunner().invoke(app, ["errors", *map(str, arguments)])
    assert done.exit_code == code, done.output
    assert done.exception is None or isinstance(done.exception, SystemExit)
    return done


def figures(*arguments: object, code: int = 0) -> dict:
    return json.loads(run(*arguments, "--json", "-", code=code).stdout)


def test_check_reports_what_a_model_holds_and_does() -> None:
    done = run("check", MIKRON, "-m", "mikron-ucp710", "--tool-length", 80)
    for word in ("OK: errors of mikron-ucp710, 339 parameters", "3.00", "EC0Y 6 arcsec", "spindle: EA0S 5 arcsec",
                 "independent parameters", "tool of 80 mm", "tip  worst"):
        assert word in done.stdout
    assert re.search(r"^EXX +linear table +30 +-355 to 355 ", done.stdout, re.MULTILINE)
    found = figures("check", SAMPLES / "h4a-c-table.toml", "-m", "h4a-c-table")
    assert found["components"] == {} and found["legs"]["rail"]["parameter"] == "X.rail.z" and found["diagnostics"] == []
    assert 50.0 < found["volume"]["tip_worst_um"] < 150.0 and found["volume"]["doubt_tip_um"] < 10.0


@pytest.mark.parametrize(("name", "words"), [
    ("mikron-ucp710", ["places; mean of both directions:", "left after correction: tip 0.000 um",
                       "(near a pole"]),
    ("uranesx", ["places:", "left after correction: tip 0.000 um", "(no rotary axis turns the tool)"])])
def test_check_reports_what_correction_leaves(name: str, words: list[str]) -> None:
    text = run("check", SAMPLES / f"{name}.toml", "-m", name).stdout
    assert all(word in text for word in words) and "cannot be reached" not in text


@pytest.mark.parametrize(("ending", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_check_draws_the_model(ending: str, start: bytes, tmp_path: Path) -> None:
    run("check", SAMPLES / "uranesx.toml", "-m", "uranesx", "--figure", tmp_path / f"new/f.{ending}")
    assert (tmp_path / f"new/f.{ending}").read_bytes().startswith(start)


@pytest.mark.parametrize("figure", ["f.pdf", "f", "e.svg"])
def test_a_figure_replaces_no_model_and_is_an_image(figure: str, tmp_path: Path) -> None:
    model = tmp_path / "e.svg"  # a model may be called anything
    model.write_text("[location]\nEC0Y = 5\n")
    run("check", model, "-m", "mill-3axis", "--figure", tmp_path / figure, code=2)
    assert model.read_text().startswith("[location]") and list(tmp_path.iterdir()) == [model]


def test_check_reports_where_a_model_ends(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text("[location]\nEC0C = 20\nEX0X = 5\n[components.EXX]\npolynomial = [3]\n"
                                     "range = [-100, 100]\n")
    done = run("check", tmp_path / "e.toml", "-m", "mikron-ucp710")
    assert "zero position: EC0C 20 arcsec, EX0X 5 um" in done.stdout and "not given, so 0: EYX, EZX" in done.stdout
    assert "the model holds from -100 to 100" in done.stderr and "no covariance: uncertainty unknown" in done.stdout


@pytest.mark.parametrize(("text", "machine", "word"), [
    ("[location]\nEC0B = 1\n", "mikron-ucp710", ":2: error [error-model.axis]"),
    ("[loc]\n", "mikron-ucp710", "file.unknown-key"), ("", "nonesuch", "no machine is called 'nonesuch'")])
def test_check_refuses_with_the_line(tmp_path: Path, text: str, machine: str, word: str) -> None:
    (tmp_path / "e.toml").write_text(text)
    done = run("check", tmp_path / "e.toml", "-m", machine, code=1)
    assert word in done.stderr and done.stdout == ""
    assert figures("check", tmp_path / "e.toml", "-m", machine, code=1)["diagnostics"][0]["severity"] == "error"


def test_tables_per_axis_go_out_and_come_back(tmp_path: Path) -> None:
    found = figures("to-tables", MIKRON, "-m", "mikron-ucp710", "-o", tmp_path, "--loss", 1,
                    "--angle-loss", 1)
    names = {Path(x).name for x in found["files"]}
    tables = {f"mikron-ucp710-{x}.csv" for x in ("X", "Y", "Z", "A", "C", "location", "covariance")}
    assert names == {*tables, "mikron-ucp710.toml"}
    assert Path(found["files"][-1]).name == "mikron-ucp710.toml"  # the model is there when its tables are
    assert max(found["losses"].values()) < 1.0 and "covariance kept" in found["told"]
    machine = machines.load("mikron-ucp710")
    made = load(tmp_path / "mikron-ucp710.toml", machine)
    sources = [tmp_path / f"mikron-ucp710-{x}.csv" for x in ("X", "Y", "Z", "A", "C", "location")]
    noted = run("import", *sources, "-m", "mikron-ucp710", "-o", tmp_path / "back.toml", "--repeats", "A=360", "--repeats",
                "C=360", "--covariance", tmp_path / "mikron-ucp710-covariance.csv").stdout
    assert f"{len(made.names)} parameters, {len(made.names)} with an uncertainty" in noted
    back = load(tmp_path / "back.toml", machine)
    assert back.names == made.names and back.values == pytest.approx(made.values, rel=1e-10, abs=1e-14)
    assert back.covariance == pytest.approx(made.covariance, rel=1e-9, abs=1e-22)


def test_linuxcnc_goes_out_with_the_rest_and_comes_back(tmp_path: Path) -> None:
    done = run("to-linuxcnc", MIKRON, "-m", "mikron-ucp710", "-o", tmp_path / "comp", "--rest",
               tmp_path / "rest.toml")
    assert "the post-processor must not do it again" in done.stderr and "rest.toml" in done.stderr
    assert "lost: the covariance of what these files hold, as they have no place for it" in done.stdout
    volume = figures("check", MIKRON, "-m", "mikron-ucp710")["volume"]
    assert (f"worst over the work volume, tool of 100 mm, mean of both directions: "
            f"tip {volume['tip_worst_um']:.2f} um, " in done.stdout)
    assert "[JOINT_4]\nCOMP_FILE = mikron-ucp710-C.comp\nCOMP_FILE_TYPE = 0" in done.stdout
    machine = machines.load("mikron-ucp710")
    full, rest = load(MIKRON, machine), load(tmp_path / "rest.toml", machine)
    assert {str(c.name) for c in full.axes.components} - {str(c.name) for c in rest.axes.components} == {
        "EXX", "EYY", "EZZ", "EAA"}  # that of C stays as zeros that end with the rows
    assert "C goes round, its table holds from -720 to 720 degrees" in done.stdout
    assert "[components.ECC]\npolynomial = [0.0]" in (tmp_path / "rest.toml").read_text()
    assert rest.covariance is not None and len(rest.covariance) == len(rest.names)
    screws = [f"{x}={tmp_path}/comp/mikron-ucp710-{x}.comp" for x in "XYZ"]
    run("import", *screws, "-m", "mikron-ucp710", "-o", tmp_path / "all.toml", "--into",
        tmp_path / "rest.toml")
    whole = load(tmp_path / "all.toml", machine)
    q = np.random.default_rng(0).uniform(-200.0, 200.0, (50, 5)) * [1, 1, 1, 0.002, 0.01]
    for name in ("EXX", "EYY", "EZZ"):
        one, two = (next(c.curve for c in m.axes.components if str(c.name) == name) for m in (full, whole))
        for travel in (1.0, -1.0):
            assert two.at(q[:, 0], travel) == pytest.approx(one.at(q[:, 0], travel), abs=2e-9)


def test_a_map_goes_out_and_comes_back(tmp_path: Path) -> None:
    found = figures("to-map", MIKRON, "-m", "mikron-ucp710", "-o", tmp_path / "m.toml", "--over", "XYC", "--step", "X=355",
                    "--step", "Y=275", "--step", "C=90", "--at", "Z=50", "--at", "A=20", "--tool-length", 100)
    assert found["nodes"] == {"X": 3, "Y": 3, "C": 4}
    assert 0.0 < found["lattice"]["tip_worst_um"] < found["volume"]["tip_worst_um"]
    assert {"lost: both approach directions of EXX, EYY, EZZ; a map holds their mean",
            "covariance kept"} < set(found["told"])
    machine = machines.load("mikron-ucp710")
    made = load(tmp_path / "m.toml", machine)
    assert made.map is not None and made.map.length == 100.0 and made.map.bed == ("C", "A") and made.covariance is not None
    kin = machine.kinematics.with_tool(100.0)
    q = np.array([[355.0, 0.0, 50.0, np.radians(20), np.radians(450.0)]])
    assert made.on(kin).place(q)[0] == pytest.approx(load(MIKRON, machine).on(kin).place(q)[0], abs=1e-9)
    run("import", tmp_path / "m-map.csv", "-m", "mikron-ucp710", "-o", tmp_path / "b.toml", "--repeats", "C=360",
        "--directions", "machine", "--tool-length", 100)
    back = load(tmp_path / "b.toml", machine)
    assert back.map is not None and back.map.table == pytest.approx(made.map.table, rel=1e-10, abs=1e-15)
    assert back.map.periods == pytest.approx(made.map.periods) and back.map.bed == made.map.bed


def test_a_loss_is_kept_or_refused(tmp_path: Path) -> None:
    found = figures("to-map", SAMPLES / "uranesx.toml", "-m", "uranesx", "-o", tmp_path / "u.toml",
                    "--loss", 0.5)
    assert 0.05 < found["lattice"]["tip_worst_um"] <= 0.5 and list(found["nodes"]) == ["x", "y", "z"]
    done = run("to-map", MIKRON, "-m", "mikron-ucp710", "-o", tmp_path / "n.toml", "--over", "XYZAC",
               "--loss", 0.01, code=1)
    assert "takes more than 200000 nodes" in done.stderr and not (tmp_path / "n.toml").exists()


def test_outputs_never_replace_inputs(tmp_path: Path) -> None:
    shutil.copytree(SAMPLES, tmp_path / "e")
    model = tmp_path / "e" / "mikron-ucp710.toml"
    before = {p: p.read_bytes() for p in (tmp_path / "e").iterdir()}
    done = run("to-tables", model, "-m", "mikron-ucp710", "-o", tmp_path / "e", code=1)
    assert "error-export.input" in done.stderr
    table = tmp_path / "e" / "mikron-ucp710-X.csv"
    run("import", table, "-m", "mikron-ucp710", "-o", tmp_path / "e" / "mikron-ucp710.toml", "--into",
        model, code=1)
    run("import", table, "-m", "mikron-ucp710", "-o", tmp_path / "e" / "other.toml", "--into", model)
    run("import", table, "-m", "mikron-ucp710", "-o", table, code=2)
    run("to-map", model, "-m", "mikron-ucp710", "-o", model, code=2)
    assert all(p.read_bytes() == text for p, text in before.items())


def test_a_fault_writes_nothing(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("X [mm],EXX [um]\n0,1\n0,2\n")
    done = run("import", tmp_path / "x.csv", "-m", "mill-3axis", "-o", tmp_path / "out" / "e.toml", code=1)
    assert "x.csv:3: error [error-model.order]" in done.stderr and not (tmp_path / "out").exists()
    (tmp_path / "out").write_text("a file")
    done = run("to-tables", MIKRON, "-m", "mikron-ucp710", "-o", tmp_path / "out", code=1)
    assert "cannot be written" in done.stderr


def test_errors_taken_in_keep_the_uncertainty_of_the_others_and_report_whose_is_gone(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("X [mm],EXX [um],EAX [arcsec]\n-355,1,2\n355,2,3\n")
    done = run("import", tmp_path / "x.csv", "-m", "mikron-ucp710", "-o", tmp_path / "e.toml",
               "--into", MIKRON)
    assert "uncertainty unknown of EAX, EXX" in done.stdout
    found = load(tmp_path / "e.toml", machines.load("mikron-ucp710"))
    assert found.covariance is not None
    sigma = dict(zip(found.names, np.sqrt(np.diag(found.covariance)), strict=True))
    assert sigma["EXX[0]"] == 0.0 and sigma["EYX[0]"] == pytest.approx(0.0005)


def test_measured_readings_become_means_with_their_uncertainty(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("X [mm],EXX [um]\n300,5\n-300,1\n300,7\n-300,1\n")
    done = run("import", tmp_path / "x.csv", "-m", "mill-3axis", "-o", tmp_path / "e.toml", "--average")
    assert "4 readings at 2 places; standard deviation of one: EXX 1" in done.stderr
    assert "2 with an uncertainty" in done.stdout
    found = load(tmp_path / "e.toml", machines.load("mill-3axis"))
    assert found.values == pytest.approx([0.001, 0.006]) and found.covariance is not None
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx([0.001 / np.sqrt(2)] * 2)


def test_large_errors_are_refused_everywhere_and_stay_meant(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("X [mm],EXX [mm]\n-500,0\n500,2.5\n")
    (tmp_path / "y.csv").write_text("Y [mm],EYY [um]\n-400,0\n400,2.5\n")
    source = ["import", tmp_path / "x.csv", "-m", "mill-3axis", "-o", tmp_path / "e.toml"]
    refused = run(*source, code=1)
    assert "errors above 1 mm are refused" in refused.stderr and "--large if it is so" in refused.stderr
    assert "--large says that it is so" in run(*source, "--large").stderr
    assert "EXX is up to 2.5 mm" in run("check", tmp_path / "e.toml", "-m", "mill-3axis").stderr
    run("import", tmp_path / "y.csv", "-m", "mill-3axis", "-o", tmp_path / "all.toml", "--into",
        tmp_path / "e.toml")
    run("to-map", tmp_path / "all.toml", "-m", "mill-3axis", "-o", tmp_path / "map.toml")
    run("to-tables", tmp_path / "all.toml", "-m", "mill-3axis", "-o", tmp_path / "t")
    for model in (tmp_path / "all.toml", tmp_path / "map.toml", tmp_path / "t/all.toml"):
        text = model.read_text()
        assert "large = true\n" in text
        run("check", model, "-m", "mill-3axis")
        model.write_text(text.replace("large = true\n", ""))
        run("check", model, "-m", "mill-3axis", code=1)


def test_a_range_outside_travel_holds_nowhere(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text("[components.EXX]\npolynomial = [1]\nrange = [2000, 3000]\n")
    done = run("check", tmp_path / "e.toml", "-m", "mikron-ucp710")
    assert "X travels from -355 to 355, the model holds nowhere there" in done.stderr
    assert "X was measured from 2000 to 3000" in done.stderr and "the model holds nowhere within travel" in done.stdout


def test_a_model_of_another_machine_is_one_fault() -> None:
    done = run("check", SAMPLES / "uranesx.toml", "-m", "h4a-c-table", code=1)
    assert [d.split("]")[0] for d in done.stderr.split("error [")[1:]] == ["error-model.machine"]


def test_import_reports_ranges_that_are_none_of_the_machine(tmp_path: Path) -> None:
    for text, noted in (("X [mm],EXX [um]\n-300000,0\n300000,5\n", "error-model.travel"),
                        ("X [mm],EXX [um]\n-0.3,0\n0.3,5\n", "the model holds from -0.3 to 0.3")):
        (tmp_path / "x.csv").write_text(text)
        for command in (["import", tmp_path / "x.csv", "-o", tmp_path / "e.toml"],
                        ["check", tmp_path / "e.toml"]):
            assert noted in run(*command, "-m", "mill-3axis").stderr


def test_a_covariance_that_is_given_counts_before_the_scatter(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("X [mm],EXX [um]\n-500,0\n-500,2\n500,4\n500,6\n")
    (tmp_path / "c.csv").write_text("p,EXX[0],EXX[1]\nEXX[0],9,1\nEXX[1],1,4\n")
    done = run("import", tmp_path / "x.csv", "-m", "mill-3axis", "-o", tmp_path / "e.toml", "--average", "--covariance",
               tmp_path / "c.csv")
    assert "uncertainty from c.csv, not from the scatter" in done.stdout
    model = load(tmp_path / "e.toml", machines.load("mill-3axis"))
    assert model.covariance is not None and model.covariance * 1e6 == pytest.approx(np.array([[9.0, 1.0], [1.0, 4.0]]))


def test_sample_readings_become_models(tmp_path: Path) -> None:
    run("import", SAMPLES / "runs-mill-3axis-X.csv", "-m", "mill-3axis", "-o", tmp_path / "x.toml",
        "--average")
    found = load(tmp_path / "x.toml", machines.load("mill-3axis"))
    assert found.covariance is not None and len(found.names) == 22
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(0.0005 / np.sqrt(5), rel=0.3)
    x = np.linspace(-500.0, 500.0, 11)
    truth = 0.012 * x / 500.0 + 0.004 * np.sin(x / 90.0)
    assert found.axes.components[0].curve.at(x, 1.0) == pytest.approx(truth, abs=0.0008)
    assert found.axes.components[0].curve.at(x, -1.0) == pytest.approx(truth - 0.003, abs=0.0008)
    run("import", SAMPLES / "map-mikron-ucp710.csv", "-m", "mikron-ucp710", "-o", tmp_path / "m.toml", "--tool-length", 120,
        "--directions", "machine", "--repeats", "C=360", "--zero", "X=0", "--zero", "Y=0", "--zero", "C=0")
    machine = machines.load("mikron-ucp710")
    kin = machine.kinematics.with_tool(120.0)
    q = np.array([[0.0, 0.0, 9.0, 0.0, 0.0], [0.0, 0.0, 9.0, 0.0, np.radians(-180.0)]])
    moved = load(tmp_path / "m.toml", machine).on(kin).place(q)[0] - kin.forward(q)[0]
    assert moved[0] == pytest.approx(np.zeros(3), abs=1e-12)
    assert moved[1] == pytest.approx([0.024, 0.0, 0.0], abs=0.0015)  # -24 um along the bed's x, seen from a table half round


REFUSED = [
    (("to-map", "-o", "m.toml", "--step", "A=30"), "a step is given for A; the map's coordinates are X, Y, Z"),
    (("to-map", "-o", "m.toml", "--at", "X=30"), "a place to stand is given for X"),
    (("to-map", "-o", "m.toml", "--at", "A=300"), "A cannot stand there"),
    (("to-map", "-o", "m.toml", "--step", "X=0.1"), "at most 200000"),
    (("to-linuxcnc", "-o", "t", "--step", "X=1"), "711 rows for X, 256 are held")]


@pytest.mark.parametrize(("arguments", "word"), REFUSED, ids=[" ".join(r[0]) for r in REFUSED])
def test_what_cannot_be_had_is_refused(tmp_path: Path, arguments: tuple[str, ...], word: str,
                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = run(arguments[0], MIKRON, "-m", "mikron-ucp710", *arguments[1:], code=1)
    assert word in done.stderr and "error-export.refused" in done.stderr and list(tmp_path.iterdir()) == []


def test_a_map_stays_within_what_was_measured(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text("[components.EXA]\npolynomial = [3, 1]\nrange = [0, 30]\n")
    done = run("to-map", tmp_path / "e.toml", "-m", "mikron-ucp710", "-o", tmp_path / "m.toml", "--at",
               "A=45", code=1)
    assert "beyond what was measured of A" in done.stderr
    run("to-map", tmp_path / "e.toml", "-m", "mikron-ucp710", "-o", tmp_path / "m.toml", "--over", "ZA",
        "--step", "A=10")
    found = load(tmp_path / "m.toml", machines.load("mikron-ucp710")).map
    assert found is not None and np.degrees(found.nodes[1]) == pytest.approx([0.0, 10.0, 20.0, 30.0])
    again = figures("to-map", tmp_path / "m.toml", "-m", "mikron-ucp710", "-o", tmp_path / "again.toml",
                    "--over", "ZA")
    assert again["nodes"] == {"Z": 2, "A": 4} and again["lattice"]["tip_worst_um"] < 1e-6  # the map's own nodes


def test_options_that_concern_no_source_are_reported(tmp_path: Path) -> None:
    done = run("import", SAMPLES / "mikron-ucp710-X.csv", "-m", "mikron-ucp710", "-o", tmp_path / "e.toml", "--repeats",
               "C=360", "--tool-length", 10, "--zero", "X=0", "--directions", "machine", code=1)
    for word in ("C repeats", "a map's tool length", "a map's zero", "a map's directions"):
        assert word in done.stderr
    assert list(tmp_path.iterdir()) == []


WRONG = [("to-map", "-o", "m.toml", "--over", "XQ"), ("to-map", "-o", "m.toml", "--over", "XX"),
         ("to-map", "-o", "m.toml", "--step", "X"), ("to-map", "-o", "m.toml", "--step", "X=0"),
         ("to-map", "-o", "m.toml", "--step", "X=1e99"), ("to-map", "-o", "m.toml", "--at", "Q=1"),
         ("to-map", "-o", "m.toml", "--directions", "bed"), ("to-tables", "-o", "t", "--loss", "-1"),
         ("to-tables", "-o", "t", "--step", "X=1", "--step", "X=2"), ("import", "-o", "m.toml", "--sign", "2"),
         ("import", "-o", "m.toml", "--type", "3"), ("import", "-o", "m.toml", "--interpolation", "cubic"), ("nothing",)]


@pytest.mark.parametrize("arguments", WRONG, ids=[" ".join(w) for w in WRONG])
def test_wrong_use_is_exit_code_2(tmp_path: Path, arguments: tuple[str, ...],
                                  monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(arguments[0], MIKRON, "-m", "mikron-ucp710", *arguments[1:], code=2)
    assert list(tmp_path.iterdir()) == []


def test_schema_and_help() -> None:
    assert "components" in json.loads(run("schema").stdout)["properties"]
    for command in ("check", "to-tables", "to-map", "to-linuxcnc", "import"):
        assert "Example: postproc errors" in run(command, "--help").stdout
    got = subprocess.run([sys.executable, "-X", "importtime", "-m", "postproc.cli.app", "errors", "--help"],
                         capture_output=True,
                         text=True, check=True, timeout=60)
    assert not {"numpy", "scipy", "numba"} & {line.split("|")[-1].strip() for line in got.stderr.splitlines()}
