"""Splines by as few lines as the tolerance allows: what their arcs and chords take is off it, and counts in the proof."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BSpline
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.cli.app import app
from postproc.pipeline.result import PostResult
from postproc.readback.execution.poses import arc_sweeps
from postproc.verification.read_back import read_back
from tests.postproc.kit import good, machine, tool_setup
from toolpaths.cl.read import read_bytes
from toolpaths.diagnostics import Severity

ANGLE = np.linspace(0.0, 4.0, 14)
KNOTS = np.linspace(0.0, 1.0, 12)[1:]


def control(rise: float) -> np.ndarray:
    return np.stack([30.0 * np.cos(ANGLE), 30.0 * np.sin(ANGLE), -5.0 + rise * np.sin(3.0 * ANGLE)], axis=1)


def text(rise: float) -> str:
    first, *rest = (",".join(f"{v:.6f}" for v in p) for p in control(rise))
    return ("TOOL PATH/A,TOOL,MILL_10\nUNITS/MM\nTLDATA/MILL,10,0,80,0,0\nLOAD/TOOL,1\nSPINDL/RPM,3000,CLW\n"
            f"RAPID\nGOTO/30,0,50,0,0,1\nFEDRAT/MMPM,600\nGOTO/{first}\nNURBS/\nKNOT/"
            + ",$\n".join(f"{k:.9f}" for k in KNOTS) + "\n" + "".join(f"CNTRL/{p}\n" for p in rest)
            + f"RAPID\nGOTO/{rest[-1].rsplit(',', 1)[0]},50\nEND-OF-PATH\n")


@cache
def made(rise: float, tolerance: float) -> PostResult:
    path = read_bytes(text(rise).encode(), tolerance=tolerance).toolpath
    return good(postproc.convert(path, machine("mill-3axis"), controller="linuxcnc", setup=tool_setup(),
                                 options=postproc.Options(tolerance)))


def off(curve: np.ndarray, tip: np.ndarray) -> float:
    """mm from dense places of a curve, by the lines between those next to the nearest one."""
    k = int(np.clip(np.argmin(np.linalg.norm(curve - tip, axis=1)), 1, len(curve) - 2))
    chord = curve[k + 1] - curve[k - 1]
    return float(np.linalg.norm(np.cross(tip - curve[k], chord)) / np.linalg.norm(chord))


@pytest.mark.parametrize("rise", [0.0, 2.0])
def test_fewer_lines_within_what_is_proved(rise: float) -> None:
    """Off the curve itself, by scipy, no program is more than what its proof says."""
    knots = np.concatenate([np.zeros(4), KNOTS, np.ones(3)])
    curve = BSpline(knots, control(rise), 3)(np.linspace(0.0, 1.0, 5_001))
    count = []
    for tolerance in (0.0005, 0.03, 0.1):
        result = made(rise, tolerance)
        found = result.comparison
        assert found is not None and result.job is not None and result.witness is not None and not result.witness.findings
        motion, control_ = found.executed[1], result.job.control
        rows = np.flatnonzero((motion.code > 0) & (np.arange(len(motion)) > np.argmax(motion.code > 0)))
        poses = found.poses
        away = max(off(curve, tip) for tip in poses.poses(motion, rows[::4], 0.5)[0] - result.job.control.origin)
        assert 0.05 * tolerance < away <= found.tip_bound + 1e-7 <= tolerance
        assert (rise == 0.0) == bool(np.isfinite(arc_sweeps(motion, control_)).any())
        count.append(len(rows))
    assert count[2] < count[1] < len(read_bytes(text(rise).encode()).toolpath) < count[0]


def test_what_splines_take_is_counted_however_they_are_read(tmp_path: Path) -> None:
    """Without a tolerance, from text of our own, by `verify` with another tolerance than that of the program."""
    path, run = read_bytes(text(2.0).encode()).toolpath, CliRunner()
    assert path.spline_slack == 0.001 and read_bytes(toolpaths.write(path)).toolpath.spline_slack == 0.001
    result = postproc.convert(path, machine("mill-3axis"), "linuxcnc", tool_setup(), postproc.Options(0.0005))
    assert [d.code for d in result.diagnostics if d.severity is Severity.ERROR] == ["tolerance.splines"]
    (tmp_path / "p.cls").write_text(text(2.0))
    (tmp_path / "p.nc").write_text(made(2.0, 0.1).text)
    files = [str(tmp_path / "p.nc"), str(tmp_path / "p.cls"), "-m", "mill-3axis", "-c", "linuxcnc"]
    for tolerance, code in (("0.5", 0), ("0.1", 0), ("0.01", 1)):
        assert run.invoke(app, ["verify", *files, "--tolerance", tolerance]).exit_code == code


def test_the_program_keeps_the_rest_of_the_tolerance() -> None:
    result = made(2.0, 0.1)
    assert result.job is not None and result.job.options.tolerance == pytest.approx(0.06)
    lines = result.text.splitlines()
    k = next(n for n, line in enumerate(lines) if line.startswith("X") and n > len(lines) // 2)
    word = lines[k].split()[0]
    for by, bad in ((0.045, False), (0.07, True)):
        lines[k] = lines[k].replace(word, f"X{float(word[1:]) + by:.4f}")
        found = read_back("\n".join(lines).encode(), result.job, "")[1]
        assert bool([d for d in found if d.code == "verify.tip"]) == bad
        lines[k] = result.text.splitlines()[k]
