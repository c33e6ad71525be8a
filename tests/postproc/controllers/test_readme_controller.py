"""The controller file that README.md prints: it works as it stands there, for a file with arcs and holes."""

from __future__ import annotations

from pathlib import Path

import postproc
import toolpaths
from tests.postproc.kit import machine

ROOT = Path(__file__).resolve().parents[3]


def test_the_controller_of_the_readme_converts_arcs_and_holes(tmp_path: Path) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    block, = (b for b in text.split("```toml\n")[1:] if b.startswith("# shop-linuxcnc.toml"))
    shop = tmp_path / "shop-linuxcnc.toml"
    shop.write_text(block.split("```")[0], encoding="utf-8")
    path, found = toolpaths.read(ROOT / "samples" / "pocket.cls")
    result = postproc.convert(path, machine("mill-3axis"), shop, diagnostics=found)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert "N30 G187 P1" in result.text and " I" in result.text
