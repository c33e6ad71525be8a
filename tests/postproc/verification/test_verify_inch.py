"""Feeds of programs in inches: the same part in inches is proved, twice its feed is found."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.base.options import Options
from postproc.pipeline.convert import convert, verify
from tests.postproc.kit import TOOLS, toolpath

PART = ["RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,2", "FEDRAT/MMPM,200", "GOTO/0,0,-2", "FEDRAT/MMPM,600", "GOTO/20,0,-2",
        "MOVARC/20,10,-2,0,0,1,10,ANGLE,90", "GOTO/30,10,-2", "GOTO/30,20,-2", "RAPID", "GOTO/30,20,30",
        "CYCLE/DRILL,DEPTH,9,MMPM,100,CLEAR,3", "GOTO/5,5,0", "GOTO/15,5,0", "CYCLE/OFF", "RAPID", "GOTO/0,0,50"]


def in_inches(text: str, share: float) -> str:
    """The program with every length in inches, and `share` of its feeds."""
    def word(match: re.Match[str]) -> str:
        value = float(match[2]) / 25.4 * (share if match[1] == "F" else 1.0)
        return f"{match[1]}{value:.7f}"
    blocks = [b if b.startswith(("(", "G05.1")) else re.sub(r"([XYZIJKRQFE])([-+]?[0-9.]+)", word, b.replace("G21", "G20"))
              for b in text.split("\n")]
    return "\n".join(re.sub(r"P(0\.\d+)", lambda m: f"P{float(m[1]) / 25.4:.7f}", b) if "G64" in b else b for b in blocks)


@pytest.mark.parametrize("controller", ["linuxcnc", "generic-iso", "fanuc-30i"])
def test_feeds_in_inches(controller: str, tmp_path: Path) -> None:
    path = toolpath(*PART)
    options = Options(setup=str(TOOLS))
    made = convert(path, "mill-3axis", controller, options=options)
    assert made.ok
    found = {}
    for share in (0.5, 1.0, 2.0):
        file = tmp_path / "inch.nc"
        file.write_text(in_inches(made.text, share))
        result = verify(file, path, "mill-3axis", controller, options=options)
        found[share] = {d.code for d in result.diagnostics if d.code.startswith("verify.")}
    assert found[1.0] == set()
    assert "verify.slow" in found[0.5] and "verify.feed" in found[2.0]
