"""Machines of the catalogue from a small part to a verified and timed program: one of each structure, a small one too."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from postproc.cli.app import app

PART = """TOOL PATH/FACE,TOOL,EM6
TLDATA/MILL,6.0,0.0,40.0,0.0,0.0
LOAD/TOOL,1,ADJUST,1
SPINDL/RPM,5000,CLW
FEDRAT/MMPM,200.0
RAPID
GOTO/-6.0,0.0,12.0,0.0,0.0,1.0
GOTO/-6.0,0.0,-0.5
GOTO/6.0,0.0,-0.5
GOTO/6.0,3.0,-0.5
GOTO/-6.0,3.0,-0.5
RAPID
GOTO/-6.0,3.0,12.0
{tilted}END-OF-PATH
"""
_ACROSS = """RAPID
GOTO/0.0,-6.0,12.0,0.0,-0.5,0.8660254
GOTO/0.0,-6.0,-0.5
GOTO/3.0,-6.0,-0.5
RAPID
GOTO/3.0,-12.0,12.0
"""
_ALONG = """RAPID
GOTO/12.0,0.0,9.8923048,0.5,0.0,0.8660254
GOTO/6.0,0.0,-0.5
GOTO/6.0,3.0,-0.5
RAPID
GOTO/12.0,3.0,9.8923048
"""
TILTED = {"BC": _ALONG, "AB": _ACROSS, "A": _ACROSS}


def called(*words: str) -> dict:
    result = CliRunner().invoke(app, [*words, "--json", "-"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.mark.parametrize(("name", "turns", "controller"), [
    ("haas-umc-750", "BC", "haas-ngc"), ("pocket-nc-v2-revr", "AB", "linuxcnc"), ("tormach-440", "A", "linuxcnc"),
])
def test_from_a_small_part_to_a_timed_program(name: str, turns: str, controller: str, tmp_path: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("part.cls").write_text(PART.format(tilted=TILTED[turns]))
    on = ("-m", name, "-c", controller)
    called("setup", "new", "part.cls", *on, "--yes", "-o", "s.toml", "--gauge-length", "60")
    made = called("convert", "part.cls", *on, "--setup", "s.toml", "-o", "part.nc")
    assert made["worst_tip_deviation_mm"] < 0.01
    assert called("verify", "part.nc", "part.cls", *on, "--setup", "s.toml")["ok"]
    low, high = called("time", "part.nc", *on, "--setup", "s.toml")["band_s"]
    assert 0.0 < low < high
