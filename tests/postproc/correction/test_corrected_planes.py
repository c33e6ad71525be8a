"""Tilted planes of corrected programs: tilts of some arcsec on a turned table are stated exactly to the words."""

from __future__ import annotations

from pathlib import Path

import pytest

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.verification.residual_errors import after_formatting

PART = """PARTNO P
UNITS/MM
LOADTL/1
SPINDL/3000,RPM,CLW
MULTAX/ON
RAPID
GOTO/0,0,60,0,0,1
FEDRAT/500,MMPM
GOTO/0,0,0
GOTO/30,0,0
RAPID
GOTO/30,0,60
RAPID
GOTO/50,60,60,0.3,0.4,0.866025404
FEDRAT/500,MMPM
GOTO/20,20,0
GOTO/20,30,0
RAPID
GOTO/50,70,60
FINI
"""
"""along Z first: its table stands at the C of what follows, so that no C is turned twice"""
ERRORS = "[location]\nEA0S = 10\nEB0S = 8\n"
TILTED = ("siemens-840d", "heidenhain-tnc640", "fanuc-30i")


@pytest.mark.covering
@pytest.mark.parametrize("controller", TILTED)
@pytest.mark.parametrize("machine", ["trunnion-bc", "mikron-ucp710"])
def test_small_tilts_on_a_turned_table_are_exact(machine: str, controller: str, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(f'machine = "{machine}"\n{ERRORS}')
    (tmp_path / "s.toml").write_text("[tools.1]\ngauge_length = 120.0\n")
    path, found = toolpaths.read_bytes(PART)
    result = postproc.convert(path, machine, controller, diagnostics=found, options=Options(
        error_model=str(tmp_path / "m.toml"), setup=str(tmp_path / "s.toml")))
    assert result.ok, [str(d) for d in result.diagnostics]
    assert {s.law for s in result.program.sections} >= {"tilted"}
    left = after_formatting(result)
    assert left is not None and left.tip.max() < 1e-4
