"""What verify takes from the header of a program and from its folder: no comments of the CL file, no other programs."""

from __future__ import annotations

from pathlib import Path

import pytest

import postproc
import toolpaths
from postproc.base.header_words import header_of
from postproc.base.options import Options
from postproc.pipeline.convert import verify
from postproc.pipeline.result import PostResult
from toolpaths.toolpath import Toolpath

ALL = ("linuxcnc", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640", "generic-iso")
CUT = "RAPID\nGOTO/0,0,50\nFEDRAT/300,MMPM\nGOTO/0,0,0\nGOTO/10,0,0\nRAPID\nGOTO/0,0,50\nFINI\n"
SAID = ("FEED PLANNED BY JOE", "GEOMETRIC ERRORS OF M1: CORRECTED IN THIS PROGRAM",
        "TOOL AXES CHOSEN: ORIENT AUTO, MAX TILT 5 DEGREES", "SETUP S.TOML, FINGERPRINT 01234567")


def written(more: str, controller: str, part: str = "T", **options: object) -> tuple[Toolpath, PostResult]:
    path, found = toolpaths.read_bytes(f"PARTNO/{part}\nUNITS/MM\n{more}LOADTL/1\nSPINDL/RPM,3000,CLW\n{CUT}")
    result = postproc.convert(path, "mill-3axis", controller, diagnostics=found,
                              options=Options(**options))
    assert result.ok, [str(d) for d in result.diagnostics]
    return path, result


@pytest.mark.parametrize("controller", ALL)
def test_comments_of_the_cl_file_are_not_of_the_head(controller: str, tmp_path: Path) -> None:
    path, result = written("".join(f"PPRINT/{said}\n" for said in SAID), controller)
    assert all(said in result.text.upper().replace("  ", " ") for said in SAID[:1])
    header = header_of(result.text.encode()).upper()
    assert b"TOOL T1" in header and not any(said.encode() in header for said in SAID)
    (tmp_path / "a.ngc").write_text(result.text)
    again = verify(tmp_path / "a.ngc", path, "mill-3axis", controller)
    assert again.ok and "verify.setup" not in {d.code for d in again.diagnostics}


@pytest.mark.parametrize("feed", ["programmed", "planned"])
def test_a_part_named_by_dashes_keeps_its_name(feed: str, tmp_path: Path) -> None:
    path, result = written("", "linuxcnc", part="--------", feed=feed)
    assert "(part --------)" in result.text
    (tmp_path / "a.ngc").write_text(result.text)
    assert verify(tmp_path / "a.ngc", path, "mill-3axis").ok


@pytest.mark.parametrize("files", [False, True])
def test_planned_feeds_are_those_of_the_program_whatever_else_its_folder_holds(files: bool, tmp_path: Path) -> None:
    """Its proof, the figures, other programs; an F word of its own subprogram is still seen."""
    setup = tmp_path / "s.toml"
    setup.write_text(f"[output]\nsubprograms = {str(files).lower()}\nfiles = {str(files).lower()}\n")
    path, result = written("", "siemens-840d", feed="planned", setup=str(setup))
    for name, text in {"a.mpf": result.text, **(result.files or {}), "b.mpf": "G1 X1 F777\n", "c.json": '"9f3 F12"'}.items():
        (tmp_path / name).write_text(text)
    options = Options(setup=str(setup))
    again = verify(tmp_path / "a.mpf", path, "mill-3axis", "siemens-840d", options=options)
    assert again.ok, [str(d) for d in again.diagnostics]
    (name, *_) = (name for name, text in {"a.mpf": result.text, **(result.files or {})}.items() if "F300" in text)
    (tmp_path / name).write_text((tmp_path / name).read_text().replace("F300", "F200", 1))
    assert files == (name != "a.mpf")
    again = verify(tmp_path / "a.mpf", path, "mill-3axis", "siemens-840d", options=options)
    assert "verify.slow" in {d.code for d in again.diagnostics}
