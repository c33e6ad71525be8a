"""At the points of the CL file corrected programs come to the rounding of their words, lost motion included."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.correction.compensation import unstated
from postproc.pipeline.convert import verify
from postproc.pipeline.result import PostResult
from postproc.setup.model import load_setup
from postproc.verification.proof_text import statement
from postproc.verification.residual_errors import after_formatting, beyond_bound
from tests.postproc.kit import few_sides
from tests.postproc.readback.test_deviation_bound import NEAR, dense
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Severity
from toolpaths.units import DEG

SAMPLES = Path("samples")
CASES = [("five_faces.cls", "mikron-ucp710", "fanuc-30i", "tools"),
         ("five_faces.cls", "mikron-ucp710", "siemens-840d", "tools"),
         ("five_faces.cls", "mikron-ucp710", "linuxcnc", "tools"), ("five_faces.cls", "mikron-ucp710", "haas-ngc", "tools"),
         ("five_tilted.cls", "mikron-ucp710", "heidenhain-tnc640", "tools"),
         ("tool_axis_tour.apt", "mikron-ucp710", "fanuc-30i", "tools"),
         ("five_faces.cls", "linuxcnc-xyzac-trt", "linuxcnc", "tools"),
         ("pocket.cls", "mikron-ucp710", "linuxcnc", "tools"), ("inch_plate.apt", "uranesx", "linuxcnc", "delta"),
         ("h4a_indexed.cls", "h4a-c-table", "linuxcnc", "h4a")]


TWO = (0, 1)
"""operations of samples with many sides alike, the tool turned between them"""


@cache
def converted(sample: str, machine: str, controller: str, setup: str) -> PostResult:
    options = Options(setup=str(SAMPLES / f"{setup}.setup.toml"),
                      error_model=str(SAMPLES / f"errors/{machine}.toml"))
    sides = (0, 4, 5) if "h4a" in sample else (0, 1) if sample == "five_faces.cls" else None
    return postproc.convert(few_sides(sample, sides), machine, controller, options=options)


@pytest.mark.covering(of=("machine",))
@pytest.mark.parametrize(("sample", "machine", "controller", "setup"), CASES)
def test_points_are_inside_the_rounding_of_their_words(sample: str, machine: str, controller: str,
                                                       setup: str) -> None:
    result = converted(sample, machine, controller, setup)
    found = after_formatting(result)
    assert result.ok and found is not None and result.job is not None and len(found.points) > 8
    assert found.tip.max() <= min(1.1 * result.job.rounding.tip, found.tip_bound)
    assert found.axis.max() <= found.axis_bound
    assert np.median(found.tip) > 0.1 * result.job.rounding.tip


@pytest.mark.covering(of=("machine",))
@pytest.mark.parametrize(("sample", "machine", "controller", "setup"), CASES)
def test_corrected_programs_are_proved_on_the_machine_with_errors(sample: str, machine: str, controller: str,
                                                                  setup: str) -> None:
    result = converted(sample, machine, controller, setup)
    assert result.ok, [str(d) for d in result.diagnostics]
    found, comparison = result.compensation, result.comparison
    assert found is not None and comparison is not None
    assert found.tip_before > 0.02 and found.tip_after < 1e-4
    assert comparison.tip_bound < 0.01 and comparison.axis_bound < 0.05 * DEG
    assert comparison.unbounded == 0
    assert found.axis_after < found.axis_before or machine == "uranesx"


@pytest.mark.parametrize("case", [case for case in CASES if case[3] != "tools"])
def test_rods_with_errors_are_bounded(case: tuple[str, str, str, str]) -> None:
    """Dimensions of rods, joints, slides, and tables of the rotary axis: no place of any block is farther off."""
    result = converted(*case)
    tip, axis = dense(result, tuple(NEAR))
    comparison = result.comparison
    assert comparison is not None and comparison.unbounded == 0 and comparison.bounded_cuts == comparison.cuts
    assert tip <= comparison.tip_bound <= 1.12 * tip and axis <= comparison.axis_bound <= max(1.12 * axis, 1e-7)
    assert "checked, not proved" not in statement(comparison, result.witness)


@pytest.mark.parametrize("sample", [pytest.param("blade.cls", marks=pytest.mark.slow), "tool_axis_tour.apt"])
def test_between_points_the_tool_stays_where_lost_motion_is_taken_up(sample: str) -> None:
    """Joints bow a little at every point of a program by the tip: that is no turning back, which would be 6 to 10 um off."""
    result = converted(sample, "mikron-ucp710", "fanuc-30i", "tools")
    assert result.ok and result.comparison is not None and result.comparison.worst_tip < 1e-3


def test_an_axis_led_past_a_singular_direction_is_no_error_left() -> None:
    path, found = toolpaths.read(SAMPLES / "joints" / "singular_pass.cls")
    result = postproc.convert(path, "mikron-ucp710", "fanuc-30i", diagnostics=found,
                              options=Options(error_model=str(SAMPLES / "errors/mikron-ucp710.toml")))
    codes = {d.code for d in result.diagnostics}
    assert result.ok and "singular.led" in codes and "geometric_errors.bound" not in codes
    left = after_formatting(result)
    assert left is not None and left.axis.max() <= left.axis_bound < 36.0 * DEG / 3600.0


def test_the_figures_stand_in_the_json_and_in_the_text(tmp_path: Path) -> None:
    common = ["convert", "samples/inch_plate.apt", "-m", "uranesx", "-c", "linuxcnc", "--setup",
              "samples/delta.setup.toml", "--error-model", "samples/errors/uranesx.toml", "-o", str(tmp_path / "a.ngc")]
    run = CliRunner().invoke(app, [*common, "--json", str(tmp_path / "a.json")])
    figures = json.loads((tmp_path / "a.json").read_text())["geometric_errors"]
    assert figures["tip_before_mm"] > 0.02 > 100.0 * figures["tip_after_mm"] > 0.0
    assert figures["tip_after_mm"] <= figures["tip_bound_mm"] and figures["axis_after_deg"] <= figures["axis_bound_deg"]
    assert re.search(r"after formatting, at \d+ CL points: tip 0\.\d\d um", run.stdout)


PLAIN = """UNITS/MM
LOADTL/1
SPINDL/1000, CLW
FEDRAT/300, MMPM
RAPID
GOTO/0, 0, 50
GOTO/-40, -40, 0
GOTO/40, -40, 0
GOTO/40, 40, -1
GOTO/40, -10, -1
GOTO/41, -10, -1
GOTO/40.5, 12, -2
GOTO/40.5, 12, -3
GOTO/40.5, 12, -2
GOTO/-13, 12, -2
FINI
"""


def axis_words(text: str) -> Floats:
    """(N, 3) X Y Z after each block of a program of G0 and G1 in G90."""
    rows, now = [], np.zeros(3)
    for line in text.splitlines():
        words = dict(re.findall(r"([XYZ])(-?[\d.]+)", "" if line[:1] in "(%" or "G53" in line else line))
        if words:
            now = np.array([float(words.get(k, v)) for k, v in zip("XYZ", now, strict=True)])
            rows.append(now)
    return np.array(rows)


def test_the_sign_of_the_last_written_motion_reports_the_error_at_every_point(tmp_path: Path) -> None:
    """A second reading: words by a pattern, approach directions by the plain sign of the last change of each word."""
    (tmp_path / "s.apt").write_text(PLAIN)
    rows = [f"{x}, {0.05 * x}, {0.05 * x + 4}, {0.01 * x * x / 10}" for x in (-60, -20, 0, 30, 60)]
    (tmp_path / "x.csv").write_text("\n".join(["X [mm], EXX+ [um], EXX- [um], EYX [um]", *rows]))
    (tmp_path / "y.csv").write_text("Y [mm], EYY+ [um], EYY- [um], EZY [um]\n-60, 0, 3, 0\n60, 6, 9, 12\n")
    (tmp_path / "e.toml").write_text("".join(f'[components.{name}]\ntable = "{name[2].lower()}.csv"\n'
                                             for name in ("EXX", "EYX", "EYY", "EZY")))
    path, found = toolpaths.read(tmp_path / "s.apt")
    result = postproc.convert(path, "mill-3axis", "linuxcnc", load_setup(None)[0],
                              Options(error_model=str(tmp_path / "e.toml")), found)
    assert result.ok, [str(d) for d in result.diagnostics]
    q = axis_words(result.text)
    approach = np.zeros(3)
    tips = []
    x, y = np.array([-60.0, -20.0, 0.0, 30.0, 60.0]), np.array([-60.0, 60.0])
    for before, here in zip(np.concatenate([np.zeros((1, 3)), q[:-1]]), q, strict=True):
        approach = np.where(here != before, np.sign(here - before), approach)
        tips.append(here + 1e-3 * np.array([np.interp(here[0], x, 0.05 * x + (4.0 if approach[0] < 0 else 0.0)),
                                            np.interp(here[0], x, 1e-3 * x * x)
                                            + np.interp(here[1], y, [0.0, 6.0]) + (3.0 if approach[1] < 0 else 0.0),
                                            np.interp(here[1], y, [0.0, 12.0])]))
    wanted = np.array([list(map(float, line[5:].split(","))) for line in PLAIN.splitlines() if line.startswith("GOTO")])
    off = np.array([np.linalg.norm(np.array(tips) - point, axis=1).min() for point in wanted[1:]])
    assert off.max() < 1e-4


def both_directions_of_all(folder: Path, machine: str, seed: int) -> Path:
    """Models in which slides lose motion in place and in lean: by the approach direction EXX, EYY, EZZ and EBX, EBY, EBZ."""
    rng = np.random.default_rng(seed)
    text = ""
    for axis in "XYZ":
        x, own, lean = np.linspace(-1000.0, 1000.0, 11), 10.0 * rng.normal(size=11), 2.5 * rng.normal(size=11)
        play, rock = 1.0 + 3.0 * rng.random(), 0.5
        rows = np.stack([x, own - play, own + play, lean - rock, lean + rock], axis=1)
        (folder / f"{axis}.csv").write_text("\n".join([
            f"{axis} [mm], E{axis}{axis}+ [um], E{axis}{axis}- [um], EB{axis}+ [arcsec], EB{axis}- [arcsec]",
            *(",".join(f"{v:.5f}" for v in row) for row in rows)]))
        text += f'[components.E{axis}{axis}]\ntable = "{axis}.csv"\n[components.EB{axis}]\ntable = "{axis}.csv"\n'
    (folder / f"{machine}.toml").write_text(f'machine = "{machine}"\n{text}')
    return folder / f"{machine}.toml"


def turning_back(result: PostResult) -> int:
    """Axis words that turn back by one last decimal; arcs and home apart."""
    count, approach, before = 0, np.zeros(3), np.zeros(3)
    for line in result.text.splitlines():
        words = dict(re.findall(r"([XYZ])(-?[\d.]+)", "" if line[:1] in "(%" or "G53" in line else line))
        here = np.array([float(words.get(k, v)) for k, v in zip("XYZ", before, strict=True)])
        step = np.round((here - before) * 1e4)
        if not ({"G2", "G3", "G43"} & set(line.split())):
            count += int((approach * step == -1.0).sum())
        approach, before = np.where(step != 0.0, np.sign(step), approach), here
    return count


@pytest.mark.parametrize(("sample", "machine", "seed"), [
    ("five_faces.cls", "head-table", 1),
    ("indexed_4axis.cls", "mill-4axis", 2)])
def test_axes_with_lost_motion_never_turn_back_by_a_last_decimal(sample: str, machine: str, seed: int,
                                                                 tmp_path: Path) -> None:
    model = both_directions_of_all(tmp_path, machine, seed)
    options = Options(setup=str(SAMPLES / "tools.setup.toml"), error_model=str(model), output="axes")
    result = postproc.convert(few_sides(sample, TWO), machine, "linuxcnc", options=options)
    left = after_formatting(result)
    assert result.ok and left is not None, [str(d) for d in result.diagnostics]
    assert turning_back(result) == 0
    assert left.tip.max() <= left.tip_bound and left.axis.max() <= left.axis_bound


def test_points_beyond_the_bound_are_reported() -> None:
    result = converted("h4a_indexed.cls", "h4a-c-table", "linuxcnc", "h4a")
    found = after_formatting(result)
    assert result.compensation is not None and found is not None and result.job is not None
    assert not beyond_bound(found, result.job)
    assert "geometric_errors.bound" not in {d.code for d in result.diagnostics}
    nearer = 0.5 * found.tip.max()
    less = replace(result.compensation, tip_after=result.compensation.tip_after + float(nearer) - found.tip_bound)
    [noted] = beyond_bound(after_formatting(replace(result, compensation=less)), result.job)
    assert result.job is not None and noted.severity == Severity.WARNING and noted.code == "geometric_errors.bound"
    assert int(result.job.moves.line[found.points[np.argmax(found.tip)]]) in noted.lines
    assert noted.count == int((found.tip > nearer).sum())
    assert f"tip {1e3 * found.tip.max():.2f} um of {1e3 * nearer:.2f} um" in noted.message


def test_holes_have_their_own_depth_and_stay_cycles() -> None:
    result = converted("five_faces.cls", "mikron-ucp710", "fanuc-30i", "tools")
    depths = [float(z) for z in re.findall(r"^[^(\n]*G8[123][^\n]* Z(-?[\d.]+)", result.text, re.M)]
    assert result.program is not None and len(result.program.holes) == 10
    deepest = sorted(round(hole.bottom, 4) for hole in result.program.holes)
    assert len(set(deepest)) > 7 and set(depths) <= set(deepest)


def test_blocks_that_name_their_axes_write_no_others() -> None:
    result = converted("five_faces.cls", "mikron-ucp710", "fanuc-30i", "tools")
    path, nominal = result.path, result.nominal
    assert path is not None and nominal is not None
    named = np.flatnonzero(path.state.any(axis=1) & (np.arange(len(path)) > 0))
    assert len(named) > 5 and not (path.q[named] != path.q[named - 1])[~path.state[named]].any()
    np.testing.assert_array_equal(unstated(path.q, path), path.q)


def test_a_tool_is_changed_at_home_but_for_what_the_model_corrects_there(tmp_path: Path) -> None:
    result = converted("five_faces.cls", "mikron-ucp710", "linuxcnc", "tools")
    path, found = toolpaths.read(SAMPLES / "five_faces.cls")
    for away, good in ((0.0, True), (0.03, True), (0.3, False)):
        (tmp_path / "a.ngc").write_text(result.text.replace("G53 G0 Z250\n", f"G53 G0 Z{250.0 - away:g}\n"))
        noted = verify(tmp_path / "a.ngc", path, "mikron-ucp710", "linuxcnc", options=result.options,
                       diagnostics=found)
        assert ("verify.tool_change" not in {d.code for d in noted.diagnostics}) == good
