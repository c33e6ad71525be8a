"""Header of a program on a control with short blocks: figures stand whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.pipeline.program_header import header_lines
from tests.postproc.kit import convert, good, toolpath


@pytest.mark.covering
@pytest.mark.parametrize("length", [60, 72])
@pytest.mark.parametrize("base", ["linuxcnc", "fanuc-30i", "heidenhain-tnc640"])
def test_no_word_of_the_head_is_lost_where_blocks_are_short(base: str, length: int, tmp_path: Path) -> None:
    """`Z0` in the place of `Z0.0000` of the work offset, a gauge length without its last digits."""
    shop = tmp_path / "short.toml"
    shop.write_text(f'base = "{base}"\n[format]\nline_length = {length}\n')
    result = good(convert(toolpath("RAPID", "GOTO/0,0,5", "GOTO/9,0,5"), "mikron-ucp710", shop))
    words = result.text.lower().replace(";", " ").replace("(", " ").replace(")", " ").split()
    for line in header_lines(result):
        if "pending" not in line:
            assert set(line.lower().replace("(", " ").replace(")", " ").split()) <= set(words), line
