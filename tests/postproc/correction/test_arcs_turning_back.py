"""Axes that turn back just before the end of an arc: the last look at it, a sixteenth of it before, sees none of that."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.readback.execution.actual import _turning
from postproc.verification.residual_errors import after_formatting

RADIUS = 50.0
PLAY = "[components.EYY]\ntable = 'y.csv'\n"
ROWS = "Y [mm],EYY+ [um],EYY- [um]\n-400,0,5\n400,0,5\n"


def arc(folder: Path, degrees: float) -> PostResult:
    end = RADIUS * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    (folder / "a.apt").write_text(
        f"UNITS/MM\nLOADTL/1\nSPINDL/3000,CLW\nRAPID\nGOTO/{RADIUS},0,40\nFEDRAT/500,MMPM\nGOTO/{RADIUS},-5,0\n"
        f"GOTO/{RADIUS},0,0\nCIRCLE/0,0,0,0,0,1,{RADIUS}\nGOTO/{end[0]:.6f},{end[1]:.6f},0\n"
        f"GOTO/{end[0] - 10.0:.6f},{end[1]:.6f},0\nRAPID\nGOTO/0,0,40\nFINI\n")
    (folder / "y.csv").write_text(ROWS)
    (folder / "e.toml").write_text(PLAY)
    path, found = toolpaths.read(folder / "a.apt")
    return postproc.convert(path, "mill-3axis", "linuxcnc", options=Options(error_model=str(folder / "e.toml")),
                            diagnostics=found)


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("degrees", [90.5, 91.0, 92.0, 95.0])
def test_an_arc_that_ends_behind_its_summit_ends_by_the_new_way(tmp_path: Path, degrees: float) -> None:
    """At 92 degrees of a radius of 50 mm Y has come back by 30 um, six times its play."""
    result = arc(tmp_path, degrees)
    assert result.ok and not [d for d in result.diagnostics if d.code == "geometric_errors.bound"]
    wanted = RADIUS * np.sin(np.radians(degrees)) - 0.005
    ends = [float(y) for y in re.findall(r"Y(-?[\d.]+) I", result.text)]
    assert ends[-1] == pytest.approx(wanted, abs=1e-4)
    found = after_formatting(result)
    assert found is not None and found.tip.max() <= found.tip_bound


def test_the_proof_sees_where_joints_turn_back_between_its_looks() -> None:
    at = np.radians([86.25, 89.125, 92.0])
    places = [np.array([[np.sin(a), np.cos(a), 0.0]]) for a in at]
    np.testing.assert_allclose(_turning(*places), [[1.0, np.cos(at[1]), 0.0]], atol=2e-7)
