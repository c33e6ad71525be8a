"""The header of programs: the tools that move, and for which place and lengths a program is."""

from __future__ import annotations

from pathlib import Path

import pytest

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.pipeline.program_header import header_lines

PART = """PARTNO TOOLS
UNITS/MM
TOOL PATH/A,TOOL,EM_10
TLDATA/MILL,10.0,0.0,75.0,0.0,0.0
LOADTL/7
SPINDL/3000,RPM,CLW
RAPID
GOTO/0,0,20
FEDRAT/400,MMPM
GOTO/0,0,0
END-OF-PATH
LOADTL/3
SPINDL/3000,RPM,CLW
RAPID
GOTO/0,9,20
GOTO/0,9,5
LOADTL/7
SPINDL/3000,RPM,CLW
RAPID
GOTO/9,9,20
FINI
"""


def header(tmp_path: Path, error_model: str = "") -> list[str]:
    (tmp_path / "s.toml").write_text("[tools.7]\ngauge_length = 120.5\n")
    path, found = toolpaths.read_bytes(PART)
    options = Options(setup=str(tmp_path / "s.toml"), error_model=error_model)
    result = postproc.convert(path, "mill-3axis", diagnostics=found, options=options)
    assert result.ok, [str(d) for d in result.diagnostics]
    return header_lines(result)


def test_tools_stand_once_in_order_of_use(tmp_path: Path) -> None:
    assert [line for line in header(tmp_path) if line.startswith("tool T")] == [
        "tool T7 EM_10, diameter 10 mm, gauge length 120.5000 mm", "tool T3, gauge length not stated"]


@pytest.mark.parametrize("by_post", [True, False])
def test_a_corrected_program_says_what_it_is_for(by_post: bool, tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text('machine = "mill-3axis"\n' + ("" if by_post else 'corrected_by = "control"\n')
                                     + "[components.EXX]\npolynomial = [3.0]\nrange = [-500, 500]\n")
    lines = header(tmp_path, error_model=str(tmp_path / "e.toml"))
    assert any("for this work offset and these gauge lengths" in line for line in lines) == by_post
