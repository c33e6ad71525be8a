"""Reviewed programs, byte for byte.

After a wanted change: `GOLDEN=renew pytest tests/postproc/writing/test_golden_programs.py`, then read the difference (`git
diff tests/golden`) block by block as if it went to the machine, and commit it with the change that caused it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

import pytest

import toolpaths
from postproc.pipeline.result import PostResult
from tests.postproc.kit import SAMPLES, convert, good, tool_setup
from toolpaths.diagnostics import has_errors

GOLDEN = Path(__file__).parents[2] / "golden"
SUFFIX = {"fanuc-30i": "nc", "haas-ngc": "nc", "siemens-840d": "mpf", "heidenhain-tnc640": "h"}
"""of the files of a controller; ngc elsewhere"""
LAWS = [("fanuc-30i", "mikron-ucp710"), ("haas-ngc", "trunnion-bc"), ("siemens-840d", "mikron-ucp710"),
        ("heidenhain-tnc640", "mikron-ucp710")]
"""three_laws.cls in each output mode: one flat and one tilted operation, one that turns the tool axis"""
PIECES = [
    *((GOLDEN / "every_cycle.cls", machine, controller) for controller, machine in LAWS),
    (SAMPLES / "pocket.cls", "mill-3axis", "linuxcnc"),
    (SAMPLES / "pocket.cls", "mill-3axis", "generic-iso"),
    (SAMPLES / "inch_plate.apt", "mill-3axis", "linuxcnc"),
    (SAMPLES / "five_faces.cls", "mikron-ucp710", "linuxcnc"),
    (GOLDEN / "short_five_axis.apt", "mikron-ucp710", "linuxcnc"),
    (GOLDEN / "short_five_axis.apt", "head-table", "generic-iso"),
]


def made(source: Path, machine: str, controller: str, mode: str = "auto", units: Literal["mm", "inch"] = "mm") -> PostResult:
    path, found = toolpaths.read(source)
    assert not has_errors(found)
    setup = tool_setup()
    if units == "inch":
        setup = setup.model_copy(update={"output": setup.output.model_copy(update={"units": units})})
    return good(convert(path, machine, controller, setup, output=mode))


def name_of(source: Path, machine: str, controller: str, mode: str = "") -> str:
    parts = [source.stem, machine, controller, mode]
    return "-".join(part for part in parts if part) + "." + SUFFIX.get(controller, "ngc")


CHANGED = "see the docstring of this file"


def reviewed(file: Path, text: str) -> bool:
    """True where the program is byte for byte the reviewed one, which GOLDEN=renew replaces."""
    if os.environ.get("GOLDEN") == "renew":
        file.write_text(text, encoding="ascii", newline="\n")
    return file.read_bytes() == text.encode("ascii")


@pytest.mark.parametrize("piece", PIECES, ids=lambda p: f"{p[0].stem}-{p[1]}-{p[2]}")
def test_written_as_reviewed(piece: tuple[Path, str, str]) -> None:
    assert reviewed(GOLDEN / name_of(*piece), made(*piece).text), CHANGED


@pytest.mark.parametrize("mode", ["auto", "axes", "tcp"])
@pytest.mark.parametrize(("controller", "machine"), LAWS)
def test_each_mode_is_written_as_reviewed(controller: str, machine: str, mode: str) -> None:
    piece = GOLDEN / "three_laws.cls", machine, controller, mode
    assert reviewed(GOLDEN / name_of(*piece), made(*piece).text), CHANGED


def test_no_file_is_left_over() -> None:
    known = {name_of(*piece) for piece in PIECES}
    known |= {name_of(GOLDEN / "three_laws.cls", m, c, mode) for c, m in LAWS for mode in ("auto", "axes", "tcp")}
    known |= {name_of(GOLDEN / "every_cycle.cls", m, c, "inch") for c, m in LAWS}
    assert {p.name for p in GOLDEN.iterdir() if p.suffix not in (".apt", ".cls")} == known


@pytest.mark.parametrize(("controller", "machine"), LAWS)
def test_written_in_inches_as_reviewed(controller: str, machine: str) -> None:
    """Every cycle, taps, arcs and a helix in inches."""
    name = name_of(GOLDEN / "every_cycle.cls", machine, controller, "inch")
    assert reviewed(GOLDEN / name, made(GOLDEN / "every_cycle.cls", machine, controller, units="inch").text), CHANGED
