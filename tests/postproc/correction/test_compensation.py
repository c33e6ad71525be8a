"""Programs with geometric errors corrected: proved on the machine with errors, and what they keep and refuse."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
import postproc
import toolpaths
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.correction.compensation import SHARE
from postproc.correction.error_context import one_orientation
from postproc.correction.reversals import LOOSE
from postproc.pipeline.convert import verify
from postproc.pipeline.result import PostResult
from postproc.setup.model import load_setup
from tests.postproc.kit import codes, convert, few_sides, good, setup_of, toolpath
from toolpaths.diagnostics import Severity
from toolpaths.units import DEG

SAMPLES = Path("samples")
TURNS = 7
"""into how many parts the spiral is cut, of which the first is converted"""
ERRORS = SAMPLES / "errors"
MIKRON = str(ERRORS / "mikron-ucp710.toml")


@cache
def converted(sample: str | Path, machine: str, controller: str = "linuxcnc", setup: str = "tools", model: str = "",
              beyond: bool = False) -> PostResult:
    path, found = toolpaths.read(SAMPLES / sample)
    options = Options(setup=str(SAMPLES / f"{setup}.setup.toml"), error_model=model, error_beyond=beyond)
    return postproc.convert(path, machine, controller, options=options, diagnostics=found)


def blocks(result: PostResult) -> list[str]:
    """The text without comments."""
    return [line for line in result.text.splitlines() if line and line[0] not in "(;"]


def test_arcs_are_cut_where_an_axis_loses_motion_and_stay_arcs() -> None:
    result = converted("pocket.cls", "mikron-ucp710", model=MIKRON)
    assert result.ok and result.path is not None and result.nominal is not None and result.compensation is not None
    assert result.compensation.resolved == 0
    assert (result.path.code == 2).sum() > (result.nominal.code == 2).sum()
    assert len(result.path) < 2 * len(result.nominal)


def cycles(result: PostResult) -> int:
    assert result.program is not None, [str(d) for d in result.diagnostics]
    return len(result.program.holes)


@pytest.mark.parametrize("sample", ["five_faces.cls", "pocket.cls"])
def test_cycles_survive_where_one_correction_of_the_hole_is_near_enough(sample: str, tmp_path: Path) -> None:
    kept = converted(sample, "mikron-ucp710", model=MIKRON)
    plain = converted(sample, "mikron-ucp710")
    assert kept.ok and 4 <= cycles(kept) <= cycles(plain)
    assert sample == "pocket.cls" or cycles(kept) == cycles(plain)
    leaning = written(tmp_path, ErrorModel(SerialErrors(constants={"EA0Z": 200.0 * DEG / 3600.0})))
    assert cycles(converted(sample, "mikron-ucp710", model=leaning)) < cycles(plain)


@pytest.mark.parametrize("corrected", [True, False])
def test_what_is_right_on_one_machine_is_wrong_on_the_other(corrected: bool, tmp_path: Path) -> None:
    """The corrected program on the nominal machine and the nominal program on the machine with errors both fail."""
    model = MIKRON if corrected else ""
    result = converted("five_faces.cls", "mikron-ucp710", model=model)
    (tmp_path / "a.ngc").write_text(result.text)
    path, found = toolpaths.read(SAMPLES / "five_faces.cls")
    options = Options(setup=str(SAMPLES / "tools.setup.toml"), error_model="" if corrected else MIKRON)
    crossed = verify(tmp_path / "a.ngc", path, "mikron-ucp710", "linuxcnc", options=options,
                     diagnostics=found)
    assert not crossed.ok and any(d.code.startswith("verify.") for d in crossed.diagnostics)
    same = verify(tmp_path / "a.ngc", path, "mikron-ucp710", "linuxcnc", None,
                  replace(options, error_model=model), found)
    assert same.ok


def written(folder: Path, model: ErrorModel) -> str:
    return str(save(replace(model, name="m"), folder)[0])


def test_zero_errors_leave_the_blocks_as_they_are(tmp_path: Path) -> None:
    machine = machines.load("mikron-ucp710")
    zero = written(tmp_path, replace(load(MIKRON, machine).zero(), covariance=None))
    assert blocks(converted("five_faces.cls", "mikron-ucp710", model=zero)) == blocks(
        converted("five_faces.cls", "mikron-ucp710"))


def test_the_place_of_correction_stands_in_the_output(tmp_path: Path) -> None:
    by_post = converted("five_faces.cls", "mikron-ucp710", model=MIKRON)
    assert "corrected in this program; the control must not correct them again" in by_post.text
    model = load(MIKRON, machines.load("mikron-ucp710"))
    control = written(tmp_path, replace(model, corrected_by="control", covariance=None))
    by_control = converted("five_faces.cls", "mikron-ucp710", model=control)
    assert by_control.ok and "corrected by the control, not in this program" in by_control.text
    assert blocks(by_control) == blocks(converted("five_faces.cls", "mikron-ucp710"))


def test_rotary_axes_stand_still_where_they_did() -> None:
    result = converted("five_faces.cls", "mikron-ucp710", model=MIKRON)
    path, nominal = result.path, result.nominal
    assert path is not None and nominal is not None
    tools = np.zeros(len(nominal), dtype=np.int64)
    stands = np.append(False, (np.abs(np.diff(nominal.q[:, 3:], axis=0)) <= 1e-9).all(axis=1))
    runs = one_orientation(stands, tools, nominal.home)
    assert runs.max() >= 4
    for k in np.unique(nominal.move[np.isfinite(nominal.u)]):
        assert np.ptp(path.q[(path.move == k) & np.isfinite(path.u), 3:], axis=0).max() == 0.0
    assert np.abs(path.q[-1] - nominal.q[-1]).max() == 0.0  # home is the machine's own


def test_points_are_added_only_where_they_are_needed_and_keep_time_and_order() -> None:
    result = converted("tool_axis_tour.apt", "mikron-ucp710", model=MIKRON)
    path, nominal = result.path, result.nominal
    assert path is not None and nominal is not None and result.compensation is not None
    assert len(path) == len(nominal) + result.compensation.added
    assert result.compensation.added < len(nominal)
    for k in np.unique(nominal.move):
        before, after = nominal.seconds[nominal.move == k], path.seconds[path.move == k]
        assert np.nansum(after) == pytest.approx(np.nansum(before), rel=1e-12)
        u = path.u[(path.move == k) & np.isfinite(path.u)]
        assert (np.diff(u) >= 0.0).all()
    assert (np.diff(path.begin) >= 0).all() and path.begin[-1] == len(path)


def test_planned_feeds_go_with_corrected_blocks() -> None:
    options = Options(setup=str(SAMPLES / "tools.setup.toml"), error_model=MIKRON, feed="planned")
    result = postproc.convert(few_sides("tool_axis_tour.apt", lines=60), "mikron-ucp710", "linuxcnc", options=options)
    assert result.ok and result.path is not None and result.compensation is not None and result.nominal is not None
    owner, part = result.compensation.owner, result.compensation.part
    assert len(owner) == len(part) == len(result.path)
    assert np.bincount(owner, part) == pytest.approx(np.ones(len(result.nominal)))
    assert np.array_equal(result.path.move, result.nominal.move[owner])


SQUARE = """PARTNO/SQUARE
UNITS/MM
LOADTL/1
SPINDL/RPM,5000,CLW
RAPID
GOTO/-40,0,20
FEDRAT/500,MMPM
GOTO/-40,0,0
GOTO/40,0,0
GOTO/-40,0,0
CIRCLE/0,0,0,0,0,1,40
GOTO/40,0,0
RAPID
GOTO/40,0,20
FINI
"""


def mill(tmp_path: Path, toml: str, table: str = "", part: str = "") -> PostResult:
    (tmp_path / "x.csv").write_text(table)
    (tmp_path / "e.toml").write_text(toml)
    (tmp_path / "s.apt").write_text(SQUARE)
    path, found = toolpaths.read(tmp_path / "s.apt")
    (tmp_path / "part.toml").write_text(part)
    setup, _ = load_setup(str(tmp_path / "part.toml"))
    return postproc.convert(path, "mill-3axis", "linuxcnc", setup,
                            Options(error_model=str(tmp_path / "e.toml")), found)


def test_lost_motion_is_taken_up_where_the_axis_turns_back(tmp_path: Path) -> None:
    result = mill(tmp_path, '[components.EXX]\ntable = "x.csv"\n',
                  "X [mm], EXX+ [um], EXX- [um]\n-500, 0, 10\n500, 0, 10\n")
    assert result.ok, [str(d) for d in result.diagnostics]
    x = [float(w[1:]) for line in blocks(result) for w in line.split() if w[0] == "X"]
    assert 40.0 in x and 39.99 in x and -40.01 in x


def test_arcs_survive_a_squareness_error_and_not_a_wavy_guide(tmp_path: Path) -> None:
    square = mill(tmp_path, "[location]\nEA0Z = 20\n")
    assert square.ok and square.compensation is not None and square.compensation.resolved == 0
    assert any(line.startswith(("G2", "G3")) or " G2 " in line or " G3 " in line for line in blocks(square))
    wavy = mill(tmp_path, '[components.EYX]\ntable = "x.csv"\n',
                "X [mm], EYX [um]\n-500, 0\n-20, 0\n0, 15\n20, 0\n500, 0\n")
    assert wavy.ok and wavy.compensation is not None and wavy.compensation.resolved == 1
    assert wavy.comparison is not None and wavy.comparison.worst_tip < LOOSE * SHARE * 0.01 + 1e-4


def test_rewinds_are_proved_on_the_machine_with_errors(tmp_path: Path) -> None:
    """Several rewinds in one cut: on its approach direction out the correction turns the tool by an arc
    second, no unwinding in the cut."""
    machine = str(SAMPLES / "joints" / "limited_c.toml")
    model = written(tmp_path, replace(load(MIKRON, machines.load("mikron-ucp710")), machine=""))
    lines = (SAMPLES / "joints" / "spiral_50.cls").read_text().splitlines()
    spiral = tmp_path.resolve() / "spiral.cls"
    spiral.write_text("\n".join(lines[:len(lines) // TURNS] + lines[-5:]) + "\n")
    result = converted(spiral, machine, model=model)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.compensation is not None and result.compensation.tip_before > 0.02
    assert result.comparison is not None and result.comparison.worst_tip < 0.01


def words_of_arc(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(start, centre, end) in x, y of the first arc of a program."""
    at = {"X": 0.0, "Y": 0.0}
    for line in text.splitlines():
        words = {w[0]: float(w[1:]) for w in line.split() if w[0] in "XYIJ" and w[1:].replace(".", "").lstrip("-").isdigit()}
        start, at = np.array([at["X"], at["Y"]]), at | {k: v for k, v in words.items() if k in at}
        if words.keys() & {"I", "J"}:
            return start, start + np.array([words.get("I", 0.0), words.get("J", 0.0)]), np.array([at["X"], at["Y"]])
    raise AssertionError("no arc")


HALF, QUARTER = "CIRCLE/0,0,0,0,0,1,40\nGOTO/40,0,0\nRAPID\nGOTO/40,0,20", \
    "CIRCLE/0,0,0,0,0,-1,40\nGOTO/0,40,0\nRAPID\nGOTO/0,40,20"
SHIFT, SLOPE = "-500, 3\n500, 3\n", "-500, -37.5\n500, 37.5\n"
"""3 um everywhere; 3 um at x = 40, -3 um at x = -40"""


@pytest.mark.parametrize(("name", "table", "start", "centre", "end"), [
    ("EXX", SHIFT, (-40.003, 0.0), (-0.003, 0.0), (39.997, 0.0)),   # moved along the chord
    ("EYX", SHIFT, (-40.0, -0.003), (0.0, -0.003), (40.0, -0.003)),  # and across it
    ("EXX", SLOPE, (-39.997, 0.0), (0.0, 0.0), (39.997, 0.0)),      # smaller
    ("EYX", SLOPE, (-40.0, 0.003), (0.0, 0.0), (40.0, -0.003))])    # turned about the centre
def test_the_centre_of_an_arc_goes_with_its_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, table: str,
                                                 start: tuple[float, float], centre: tuple[float, float],
                                                 end: tuple[float, float]) -> None:
    """Half a circle about the origin from x = -40, on a mill with one straight error."""
    monkeypatch.setitem(globals(), "SQUARE", SQUARE.replace("GOTO/40,0,0\nGOTO/-40,0,0\nCIRCLE", "CIRCLE"))
    result = mill(tmp_path, f'[components.{name}]\ntable = "x.csv"\n', f"X [mm], {name} [um]\n{table}")
    assert result.ok and result.compensation is not None and result.compensation.resolved == 0
    for got, wanted in zip(words_of_arc(result.text), (start, centre, end), strict=True):
        assert got == pytest.approx(wanted, abs=2e-5)


def test_the_centre_of_an_arc_is_as_far_from_both_ends(tmp_path: Path,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter whose ends move unlike: halfway with both, the centre would be 1.5 um farther from one of them."""
    quarter = SQUARE.replace("GOTO/40,0,0\nGOTO/-40,0,0\nCIRCLE", "CIRCLE").replace(HALF, QUARTER)
    monkeypatch.setitem(globals(), "SQUARE", quarter)
    result = mill(tmp_path, '[components.EXX]\ntable = "x.csv"\n', f"X [mm], EXX [um]\n{SLOPE}")
    assert result.ok and result.compensation is not None and result.compensation.resolved == 0
    start, centre, end = words_of_arc(result.text)
    assert start == pytest.approx([-39.997, 0.0]) and end == pytest.approx([0.0, 40.0])
    assert np.linalg.norm(start - centre) == pytest.approx(np.linalg.norm(end - centre), abs=5e-5)


def test_beyond_the_measured_range_is_refused_unless_asked_for(tmp_path: Path) -> None:
    toml = "[components.EYX]\npolynomial = [3.0]\nrange = [-30, 30]\n"
    refused = mill(tmp_path, toml)
    fault = next(d for d in refused.diagnostics if d.code == "compensation.range")
    assert not refused.ok and refused.text == "" and fault.lines and "-40 to 40" in fault.message
    path, found = toolpaths.read(tmp_path / "s.apt")
    asked = postproc.convert(path, "mill-3axis", "linuxcnc", None,
                             Options(error_model=str(tmp_path / "e.toml"), error_beyond=True), found)
    assert asked.ok and any(d.code == "compensation.range" for d in asked.diagnostics)


def test_a_faulty_model_stops_the_conversion(tmp_path: Path) -> None:
    result = mill(tmp_path, "[location]\nEX0Y = 20\n")
    assert not result.ok and any(d.code == "error-model.no-effect" and d.lines == (2,) for d in result.diagnostics)


def test_command_line_convert_verify_trace(tmp_path: Path) -> None:
    out, common = tmp_path / "a.ngc", ["-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", "samples/tools.setup.toml",
                                       "--error-model", MIKRON, "--json", "-"]
    run = CliRunner().invoke(app, ["convert", "samples/five_faces.cls", "-o", str(out), *common])
    assert run.exit_code == 0, run.stderr
    figures = json.loads(run.stdout)["geometric_errors"]
    assert figures["tip_before_mm"] > 0.02 and figures["tip_residual_mm"] < 1e-4
    assert 1e-4 < figures["tip_sigma_mm"] < 5e-3 and figures["axis_sigma_deg"] > 0.0
    assert "geometric_errors" in json.loads(run.stdout)["tolerance_shares"]
    run = CliRunner().invoke(app, ["verify", str(out), "samples/five_faces.cls", *common])
    verified = json.loads(run.stdout)
    assert run.exit_code == 0 and verified["blocks_without_bound"] == 0 and verified["proved"]
    run = CliRunner().invoke(app, ["trace", "samples/five_faces.cls", "--line", "28", *common])
    moves = [m for p in json.loads(run.stdout)["points"] for m in p["moves"]]
    nominal, corrected = moves[0]["nominal_joints"][-1], moves[0]["joints"][-1]
    assert 0.0 < max(abs(nominal[k] - corrected[k]) for k in nominal) < 0.2
    missing = CliRunner().invoke(app, ["convert", "samples/five_faces.cls", "-o", str(out), "-m", "mikron-ucp710", "-c",
                                       "linuxcnc", "--error-model", "nowhere.toml"])
    assert missing.exit_code == 1 and "file.not-found" in missing.stderr


def test_models_of_other_machines_are_refused() -> None:
    assert not converted("five_faces.cls", "trunnion-bc", model=MIKRON).ok
    assert ErrorModel(SerialErrors()).names == []


def test_a_tilt_that_no_axis_turns_back_is_said_and_a_tolerance_decides(tmp_path: Path) -> None:
    """The tip is corrected; of the axis post and `verify` say by how much it is off, not that points are missing."""
    model = written(tmp_path, ErrorModel(SerialErrors(constants={"EB0S": 600.0 * DEG / 3600.0})))
    path = toolpath("LOADTL/1", "SPINDL/RPM,800,CLW", "RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,1500", "GOTO/0,0,0", "GOTO/4,0,0")
    setup = setup_of("[tools.1]\ngauge_length = 80\n")
    refused = convert(path, "mill-3axis", setup=setup, error_model=model)
    assert [d.code for d in refused.diagnostics if d.severity is Severity.ERROR] == ["compensation.axis"]
    result = good(convert(path, "mill-3axis", setup=setup, error_model=model, axis_tolerance=0.19))
    assert result.comparison is not None and result.comparison.axis_bound == pytest.approx(600.0 * DEG / 3600.0)
    assert result.comparison.tip_bound < result.options.tolerance
    (tmp_path / "a.ngc").write_text(result.text)
    seen = verify(tmp_path / "a.ngc", path, "mill-3axis", "linuxcnc", setup, Options(error_model=model))
    assert "verify.axis" in codes(seen.diagnostics) and "verify.not_reached" not in codes(seen.diagnostics)
