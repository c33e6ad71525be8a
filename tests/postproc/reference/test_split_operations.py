"""Programs in parts: operations cut at rapids, and in files of their own, read back as the part."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import toolpaths
from postproc.pipeline.convert import convert, verify
from postproc.reference.split_operations import cut_operations
from postproc.setup.model import SetupFile
from tests.postproc.kit import tool_setup
from toolpaths.toolpath import Kind, Toolpath

SAMPLES = Path(__file__).parents[3] / "samples"
CONTROLLERS = ("fanuc-30i", "haas-ngc", "heidenhain-tnc640", "siemens-840d")


def read(name: str) -> Toolpath:
    path, _ = toolpaths.read(SAMPLES / name)
    return path


def divided(**keys: object) -> SetupFile:
    usual = tool_setup()
    return usual.model_copy(update={"output": usual.output.model_copy(update=keys)})


@pytest.mark.parametrize("longest", [1, 7, 30, 100])
def test_parts_begin_at_rapids_and_keep_the_length_where_rapids_allow(longest: int) -> None:
    path = read("bicubic.cls")
    cut, found = cut_operations(path, longest)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(cut.operation) != 0]))
    new = np.setdiff1d(starts, np.flatnonzero(np.concatenate([[True], np.diff(path.operation) != 0])))
    assert (path.kind[new] == Kind.RAPID).all()
    size = np.diff([*starts, len(cut)])
    long = starts[size > longest]
    for first, count in zip(long.tolist(), size[size > longest].tolist(), strict=True):
        assert not (path.kind[first + 1:first + 1 + min(longest, count - 1)] == Kind.RAPID).any()
    assert bool(len(long)) == bool(found)
    names = [path.operations[k].name for k in path.operation]
    assert [cut.operations[k].name for k in cut.operation] == names


def test_short_operations_stay_whole() -> None:
    path = read("five_faces.cls")
    assert cut_operations(path, len(path))[0] is path
    assert cut_operations(path, 0)[0] is path


def test_no_cut_under_cutter_compensation(tmp_path: Path) -> None:
    body = "".join(f"RAPID\nGOTO/{x},0,5\nFEDRAT/200,MMPM\nGOTO/{x},0,0\nGOTO/{x},9,0\n" for x in range(6))
    file = tmp_path / "cut.apt"
    file.write_text(f"UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nCUTCOM/LEFT,1\n{body}CUTCOM/OFF\n{body}END\nFINI\n")
    path, _ = toolpaths.read(file)
    cut, found = cut_operations(path, 4)
    starts = np.flatnonzero(np.diff(cut.operation) != 0) + 1
    assert len(starts) and (starts >= 18).all()
    assert [d.code for d in found] == ["output.longest"]


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_parts_in_files_read_back_as_the_part(controller: str, tmp_path: Path) -> None:
    setup = divided(files=True, longest=12)
    result = convert(read("five_faces.cls"), "mikron-ucp710", controller, setup)
    assert result.ok, [d.message for d in result.diagnostics]
    assert result.files is not None and len(result.files) > 5
    assert result.comparison is not None and result.comparison.worst_tip < 1e-3
    assert max(len(text.splitlines()) for text in result.files.values()) < 80
    main = tmp_path / "main.nc"
    main.write_text(result.text)
    for name, text in result.files.items():
        (tmp_path / name).write_text(text)
    file = tmp_path / "setup.toml"
    file.write_text((SAMPLES / "tools.setup.toml").read_text() + "\n[output]\nfiles = true\nlongest = 12\n")
    options = result.options.__class__(setup=str(file))
    assert verify(main, read("five_faces.cls"), "mikron-ucp710", controller, options=options).ok
    last = sorted(result.files)[-1]
    (tmp_path / last).write_text(result.files[last].replace("17", "16", 1).replace("18", "13"))
    assert not verify(main, read("five_faces.cls"), "mikron-ucp710", controller, options=options).ok


def test_restart_parts_in_one_program() -> None:
    whole = convert(read("pocket.cls"), "mill-3axis", "linuxcnc", tool_setup())
    made = convert(read("pocket.cls"), "mill-3axis", "linuxcnc", divided(longest=60))
    assert whole.ok and made.ok, [d.message for d in made.diagnostics]
    assert made.text.count("M6") > whole.text.count("M6")


def test_files_are_refused_where_there_are_none() -> None:
    result = convert(read("five_faces.cls"), "mikron-ucp710", "linuxcnc", divided(files=True))
    assert "output.subprograms" in {d.code for d in result.diagnostics if d.severity.name == "ERROR"}
