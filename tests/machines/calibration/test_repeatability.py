"""Repeatability of 42 readings (Oueslati 2004, 3.2) and of positions approached from both sides (ISO 230-2)."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from machines.calibration.repeatability import read_repeated
from postproc.cli.app import app


def test_42_readings_of_one_position(tmp_path: Path) -> None:
    """Interval, s with n - 1, root mean square with n, by hand; the printed 1.81 arcsec is such an interval."""
    readings = np.random.default_rng(0).normal(3.0, 0.4, 42)
    readings = (readings - readings.min()) / np.ptp(readings) * 1.81
    file = tmp_path / "c.csv"
    file.write_text("reading [arcsec]\n" + "\n".join(map(repr, readings.tolist())) + "\n", encoding="utf-8")
    done = CliRunner().invoke(app, ["errors", "repeatability", str(file), "--figure", str(tmp_path / "c.png"), "--json",
                                    "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    s = np.sqrt(((readings - readings.mean()) ** 2).sum() / 41)
    assert found["readings"] == 42 and found["interval_arcsec"] == pytest.approx(1.81)
    assert found["standard_deviation_arcsec"] == pytest.approx(s)
    assert found["rms_arcsec"] == pytest.approx(s * np.sqrt(41 / 42))
    assert found["unidirectional_repeatability_arcsec"] == pytest.approx(4.0 * s) and "reversal_arcsec" not in found
    assert (tmp_path / "c.png").stat().st_size > 1000


def test_both_sides_of_two_positions(tmp_path: Path) -> None:
    """s of (a, b) is |a - b| / sqrt 2; reversal 5 um at 100 mm, bi-directional 2 s + 2 s + 5."""
    file = tmp_path / "x.csv"
    file.write_text("position [mm],approach,reading [um]\n0,1,1\n0,1,2\n0,-1,1\n0,-1,2\n100,1,6\n100,1,8\n"
                    "100,-1,1\n100,-1,3\n", encoding="utf-8")
    found, diagnostics = read_repeated(file)
    assert found is not None and not diagnostics
    figures, s = found.figures, np.sqrt(2.0)
    assert figures["reversal_um"] == pytest.approx(5.0) and figures["mean_reversal_um"] == pytest.approx(2.5)
    assert figures["bidirectional_repeatability_um"] == pytest.approx(4.0 * s + 5.0)
    assert figures["unidirectional_repeatability_um"] == pytest.approx(4.0 * s)


@pytest.mark.parametrize(("text", "code"), [
    ("value [um]\n1\n2\n", "repeatability.column"), ("reading\n1\n2\n", "repeatability.column"),
    ("reading [um],approach\n1,3\n2,1\n", "repeatability.approach"),
    ("reading [um],position [mm]\n1,0\n2,0\n3,5\n", "repeatability.few"), ("reading [um]\n", "error-table.empty")])
def test_what_is_no_run_is_refused(text: str, code: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(text, encoding="utf-8")
    done = CliRunner().invoke(app, ["errors", "repeatability", str(file)])
    assert done.exit_code == 1 and code in done.stderr
