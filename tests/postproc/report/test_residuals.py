"""The residual field: at every CL point what errors do before and after correction, as a table and drawn."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import postproc
from machines.geometric_error import load
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.pipeline.result import PostResult
from postproc.report.residual_files import contents
from postproc.report.residuals import ARCSEC, UM, Residuals, residuals
from postproc.setup.model import SetupFile, load_setup
from postproc.verification.residual_errors import after_formatting
from tests.postproc.kit import few_sides
from toolpaths.arrays import Floats
from toolpaths.units import DEG

TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""part to table, of `turned`"""


def turned(name: str) -> SetupFile:
    """A set-up with the part a quarter of a turn about z."""
    setup, _ = load_setup(f"samples/{name}.setup.toml")
    assert setup is not None
    return setup.model_copy(update={"part": setup.part.model_copy(update={"x_axis": (0.0, 1.0, 0.0),
                                                                         "y_axis": (-1.0, 0.0, 0.0)})})


@cache
def plate() -> tuple[PostResult, Residuals]:
    """A sample on a parallel machine, turned."""
    return field("inch_plate.apt", "uranesx", turned("delta"))


def field(sample: str, machine: str, setup: SetupFile, **options: object) -> tuple[PostResult, Residuals]:
    result = postproc.convert(few_sides(sample), machine, "linuxcnc", setup=setup,
                              options=Options(error_model=f"samples/errors/{machine}.toml", **options))
    noted = residuals(result)
    assert result.ok and noted is not None, [str(d) for d in result.diagnostics]
    return result, noted


def deviation(result: PostResult, q: Floats, machine: str, length: float) -> Floats:
    """(N, 6) of the machine with errors at joints from the nominal one, by mean paths, in the frame of the part."""
    kinematics = result.machine.kinematics.with_tool(length)
    actual, wanted = load(f"samples/errors/{machine}.toml", result.machine).on(kinematics), np.hstack(kinematics.forward(q))
    off = np.hstack(actual.aim(actual.coordinates(q, wanted), np.zeros(q.shape))) - wanted
    return np.hstack([off[:, :3] @ TURNED, off[:, 3:] @ TURNED])


def test_the_field_is_that_of_the_machine_in_the_frame_of_the_part() -> None:
    result, noted = plate()
    lengths = {tool.gauge_length for tool in result.setup.tools.values()}
    off = np.min([np.abs(deviation(result, noted.q, "uranesx", float(x or 0.0)) - noted.before).max(axis=1)
                  for x in lengths], axis=0)
    assert off.max() < 1e-9
    assert np.abs(noted.before[:, :2]).min(axis=0).max() > 2e-3  # along both: a turn left out would show
    left = noted.before[:, 3:] - noted.after[:, 3:]
    assert np.linalg.norm(noted.after[:, 3:], axis=1).min() > 15.0 * ARCSEC > 20.0 * np.abs(left).max()
    assert result.toolpath is not None
    assert np.allclose(noted.tip[:, :2], result.toolpath.tip[np.searchsorted(result.toolpath.line, noted.line), :2])


def test_the_worst_are_those_of_the_summary() -> None:
    setup, _ = load_setup("samples/tools.setup.toml")
    assert setup is not None
    result, noted = field("tool_axis_tour.apt", "mikron-ucp710", setup)
    proof = after_formatting(result)
    assert proof is not None and result.compensation is not None and len(noted.line) == len(proof.points)
    assert np.allclose(np.linalg.norm(noted.after[:, :3], axis=1), proof.tip, atol=1e-12)
    assert np.allclose(np.linalg.norm(noted.after[:, 3:], axis=1), proof.axis, rtol=1e-3, atol=1e-8)
    assert np.linalg.norm(noted.before[:, :3], axis=1).max() == pytest.approx(result.compensation.tip_before, rel=0.02)


def test_smoothed_points_are_the_wanted_ones() -> None:
    setup, _ = load_setup("samples/tools.setup.toml")
    assert setup is not None
    result, noted = field("bicubic.cls", "mikron-ucp710", setup, smooth=True)
    assert np.linalg.norm(noted.after[:, :3], axis=1).max() <= noted.tip_bound < 6e-4
    assert "geometric_errors.bound" not in {d.code for d in result.diagnostics}


def test_table_and_drawing_are_written_next_to_the_program(tmp_path: Path) -> None:
    names = [tmp_path / "r.csv", tmp_path / "r.svg", tmp_path / "r.png"]
    run = CliRunner().invoke(app, ["convert", "samples/tool_axis_tour.apt", "-m", "mikron-ucp710", "-c", "fanuc-30i", "-o",
                                   str(tmp_path / "a.nc"), "--error-model", "samples/errors/mikron-ucp710.toml",
                                   *(x for name in names for x in ("--residuals", str(name)))])
    assert run.exit_code == 0, run.output
    head, *rows = [line for line in names[0].read_text().splitlines() if not line.startswith("#")]
    assert head.startswith("line,x [mm],y [mm],z [mm],i,j,k,X [mm],Y [mm],Z [mm],A [deg],C [deg],before dx [um]")
    values = np.array([[float(x) for x in row.split(",")] for row in rows])
    assert values.shape == (99, 24) and 30.0 < np.linalg.norm(values[:, 12:15], axis=1).max() < 90.0
    assert np.linalg.norm(values[:, 18:21], axis=1).max() < 0.4
    assert names[1].read_bytes().startswith(b"<?xml") and names[2].read_bytes().startswith(b"\x89PNG")


def test_without_a_field_nothing_is_written(tmp_path: Path) -> None:
    model = tmp_path / "control.toml"
    text = Path("samples/errors/uranesx.toml").read_text()
    model.write_text('corrected_by = "control"\n' + "\n".join(x for x in text.splitlines() if "corrected_by" not in x))
    common = ["convert", "samples/inch_plate.apt", "-m", "uranesx", "-c", "linuxcnc", "--setup", "samples/delta.setup.toml",
              "-o", str(tmp_path / "a.ngc")]
    run = CliRunner().invoke(app, [*common, "--error-model", str(model), "--residuals", str(tmp_path / "r.csv")])
    assert run.exit_code == 1 and "residuals.none" in run.output
    assert not (tmp_path / "a.ngc").exists() and not (tmp_path / "r.csv").exists()


@pytest.mark.parametrize(("more", "noted"), [
    (["--residuals", "r.csv"], "residuals need --error-model"),
    (["--error-model", "samples/errors/uranesx.toml", "--residuals", "r.csv", "--residuals", "r.txt"], "neither")])
def test_wrong_use(more: list[str], noted: str) -> None:
    run = CliRunner().invoke(app, ["convert", "samples/pocket.cls", "-m", "uranesx", "-c", "linuxcnc", "-o", "a.ngc", *more])
    assert run.exit_code == 2 and noted in " ".join(run.output.split())


def test_a_residual_file_replaces_no_other(tmp_path: Path) -> None:
    output = str(tmp_path / "a.csv")
    run = CliRunner().invoke(app, ["convert", "samples/pocket.cls", "-m", "uranesx", "-c", "linuxcnc", "-o", output,
                                   "--error-model", "samples/errors/uranesx.toml", "--residuals", output])
    assert run.exit_code == 2


def test_an_ending_that_is_none() -> None:
    result, noted = plate()
    with pytest.raises(ValueError, match="figure format"):
        contents(result, [".pdf"])
    assert UM < noted.tip_bound * 10.0 < 10.0 * UM and noted.axis_bound > DEG / 3600.0
