"""A part that stands by a system of its CL file: the same words as where the file has that system as its only one."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.cli.app import app
from postproc.placement.write import placed_text
from postproc.setup.model import PartPlacement, SetupFile, load_setup, part_placement, work_frame
from postproc.setup.system import placed, standing
from tests.postproc.kit import NX, SAMPLES, codes, convert, good, machine, tool_setup, toolpath
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

FOLDER = SAMPLES / "systems"
TOOLS = tool_setup().model_dump()["tools"]
MSYS = "MSYS/393,-297,3,0,1,0,1,0,0"
LINES = ["UNITS/MM", "TOOL PATH/A,TOOL,T", MSYS, "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/-40,-20,10,0,0,1",
         "FEDRAT/MMPM,400", "GOTO/-40,-20,0", "GOTO/36,-20,0", "CIRCLE/36,-16,0,0,0,-1,4,0.03,0.5,10,0", "GOTO/40,-16,0",
         "GOTO/40,10,0", "GOTO/40,20,-3,0,0.4226183,0.9063078", "END-OF-PATH"]
UPRIGHT = [MSYS.replace("393,-297,3,0,1,0,1,0,0", "0,0,0,1,0,0,0,1,0") if line == MSYS else line for line in LINES]


def setup(**part: object) -> SetupFile:
    values = {k: tuple(map(float, v)) if isinstance(v, list) else v for k, v in part.items()}
    return SetupFile.model_validate({"tools": TOOLS, "part": values})


def path(lines: list[str]) -> Toolpath:
    return toolpath(*lines, head=[])


def body(text: str) -> list[str]:
    return [row for row in text.splitlines() if not row.startswith("(") and "fingerprint of the set-up" not in row]


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i", "heidenhain-tnc640"])
@pytest.mark.parametrize("system", [True, "MSYS 1", "msys 1"])
def test_the_words_are_those_of_the_system_alone(controller: str, system: bool | str) -> None:
    where: dict[str, object] = {"origin": [20, -10, 0], "x_axis": [0, 1, 0], "y_axis": [-1, 0, 0]}
    turned = good(convert(path(LINES), "mikron-ucp710", controller, setup(system=system, **where)))
    plain = good(convert(path(UPRIGHT), "mikron-ucp710", controller, setup(**where)))
    assert body(turned.text) == body(plain.text)
    assert [d.severity for d in turned.diagnostics if d.code == "setup.system"] == [Severity.INFO]
    assert "setup.system" not in codes(plain.diagnostics)


def test_without_it_the_hints_of_travel_errors_name_it() -> None:
    result = convert(path(LINES), "mikron-ucp710", "linuxcnc", setup())
    noted = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert noted and all(d.code.startswith(("travel.", "reach.")) for d in noted)
    assert all('MSYS 1 leans by 180 degrees' in d.hint and '[part] system = "MSYS 1"' in d.hint for d in noted)


@pytest.mark.parametrize(("part", "named"), [
    ({}, True), ({"origin": [0, 0, 50]}, True), ({"origin": [-2000, 0, 0]}, False),
    ({"system": True, "origin": [2000, 0, 0]}, False)])
def test_a_system_far_away_is_named_where_part_does_nothing_about_it(part: dict[str, object],
                                                                     named: bool) -> None:
    lines = [line.replace(MSYS, "MSYS/1500,0,0,1,0,0,0,1,0") for line in LINES]
    result = convert(path(lines), "mikron-ucp710", "linuxcnc", setup(**part))
    noted = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert noted and all(("lies 15" in d.hint and 'system = "MSYS 1"' in d.hint) == named for d in noted)


def test_files_without_a_system_of_their_own_are_left_alone() -> None:
    upright = path(["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,400", "GOTO/5000,0,0", "GOTO/5000,9,0"])
    result = convert(upright, "mikron-ucp710", "linuxcnc", setup())
    assert not any("system" in d.hint for d in result.diagnostics) and not result.ok
    low = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,400", "GOTO/5,0,0", "GOTO/5,9,0"]
    by_system, plain = (good(convert(path(low), "mikron-ucp710", "linuxcnc", setup(system=s))) for s in (True, False))
    assert body(by_system.text) == body(plain.text) and "setup.system" not in codes(by_system.diagnostics)


def test_placements_compose() -> None:
    """The system's own points stand where [part] says, however both are turned."""
    a, b = np.radians(31.0), np.radians(-17.0)
    x = np.array([np.cos(a), np.sin(a), 0.0])
    y = np.array([-np.sin(a) * np.cos(b), np.cos(a) * np.cos(b), np.sin(b)])
    text = "MSYS/" + ",".join(f"{v:.15f}" for v in (7.0, -8.0, 9.0, *x, *y))
    made = path([line.replace(MSYS, text) for line in LINES])
    part = {"origin": [1, 2, 3], "x_axis": [0, 0, 1], "y_axis": [0.6, 0.8, 0]}
    resolved, found = standing(setup(system=True, **part), made)
    assert not [d for d in found if d.severity is Severity.ERROR] and resolved.part.system is False
    stands, _ = part_placement(resolved)
    wanted, _ = part_placement(setup(**part))
    frame, _ = work_frame(resolved, made)
    assert stands is not None and wanted is not None and frame is not None
    points = np.random.default_rng(5).normal(size=(9, 3)) * 100.0
    assert np.abs(stands.points(placed(frame).points(points)) - wanted.points(points)).max() < 1e-11
    assert standing(resolved, made) == (resolved, [])


def test_a_system_that_the_file_has_not_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text('[part]\norigin = [1, 2, 3]\nsystem = "MSYS 7"\n')
    result = postproc.convert(path(LINES), machine("mikron-ucp710"), setup=str(file))
    noted = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert [(d.code, d.file, d.lines) for d in noted] == [("setup.system", str(file), (3,))]
    assert "MSYS 7" in noted[0].message and "MSYS 1" in noted[0].hint
    for bad in ('""', "3", "[1]"):
        file.write_text(f"[part]\nsystem = {bad}\n")
        assert load_setup(file)[0] is None


def test_it_is_the_system_that_is_the_work_offset() -> None:
    two = ["UNITS/MM", *NX, "RAPID", "GOTO/0,0,20", "END-OF-PATH", *LINES[1:]]
    resolved, _ = standing(setup(system=True), path(two))
    assert resolved.part == PartPlacement()
    other, _ = standing(setup(system=True).model_copy(update={"work_offset": "MSYS 2"}), path(two))
    assert other.part.origin == (297.0, -393.0, 3.0) and other.part.x_axis == (0.0, 1.0, 0.0)


# ---- commands ----------------------------------------------------------------------------------------------


def test_the_sample_is_converted_verified_and_timed(tmp_path: Path) -> None:
    run = CliRunner()
    out = tmp_path / "u.nc"
    both = ["-m", "mikron-ucp710", "-c", "fanuc-30i", "--setup", str(FOLDER / "upside_down.setup.toml")]
    for args in (["convert", str(FOLDER / "upside_down.cls"), "-o", str(out)],
                 ["verify", str(out), str(FOLDER / "upside_down.cls")], ["time", str(out)],
                 ["trace", str(FOLDER / "upside_down.cls"), "--line", "23"], ["orient", str(FOLDER / "upside_down.cls")]):
        mine = [a for a in both if args[0] != "orient" or a not in ("-c", "fanuc-30i")]
        result = run.invoke(app, [*args, *mine])
        assert result.exit_code == 0, result.output
    assert "upside" not in run.invoke(app, ["setup", "check", both[-1]]).stderr
    plain = run.invoke(app, ["convert", str(FOLDER / "upside_down.cls"), "-o", str(tmp_path / "n.nc"), *both[:4]])
    assert plain.exit_code == 1 and 'system = "MSYS 1"' in plain.stderr


def test_inspect_reports_the_systems() -> None:
    text = CliRunner().invoke(app, ["inspect", str(FOLDER / "upside_down.cls")]).stdout
    assert "system MSYS 1: origin (393, -297, 3) mm, rotation 180.00 degrees, Z tilted 180.00 degrees" in text
    text = CliRunner().invoke(app, ["inspect", str(SAMPLES / "pocket.cls")]).stdout
    assert "system MSYS 1: origin (0, 0, 0) mm\n" in text


def test_place_writes_the_absolute_frame(tmp_path: Path) -> None:
    source = tmp_path / "s.toml"
    source.write_text((FOLDER / "upside_down.setup.toml").read_text() + "\n[placement]\nx = [-20, 20]\nstep = 40\n")
    target = tmp_path / "t.toml"
    file = str(FOLDER / "upside_down.cls")
    result = CliRunner().invoke(app, ["place", file, "-m", "mikron-ucp710", "--setup", str(source), "-o", str(target)])
    assert result.exit_code == 0, result.output
    made = tomllib.loads(target.read_text())["part"]
    assert made["system"] is False and np.allclose(made["x_axis"], [0, 1, 0]) and np.allclose(made["y_axis"], [1, 0, 0])
    read, _ = toolpaths.read(FOLDER / "upside_down.cls")
    assert postproc.convert(read, machine("mikron-ucp710"), setup=str(target)).ok


def test_a_placed_setup_overrides_the_system_of_its_base(tmp_path: Path) -> None:
    (tmp_path / "base.toml").write_text('[part]\nsystem = true\n')
    source = tmp_path / "s.toml"
    source.write_text('base = "base.toml"\n')
    (tmp_path / "t.toml").write_text(placed_text(source, tmp_path / "t.toml", PartPlacement(origin=(1.0, 2.0, 3.0))))
    made, _ = load_setup(tmp_path / "t.toml")
    assert made is not None and made.part.system is False and made.part.origin == (1.0, 2.0, 3.0)


def test_the_committed_samples_are_what_the_script_writes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, SAMPLES / "make_systems.py", tmp_path], check=True, timeout=60)
    for file in sorted((tmp_path / "systems").iterdir()):
        assert file.read_bytes() == (FOLDER / file.name).read_bytes(), file.name
