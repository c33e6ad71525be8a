"""`auto` takes the next output mode where one cannot be written or proved for an operation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import machines
import postproc
import postproc.readback.execution.frames as frames
import toolpaths
from postproc.base.options import Options
from postproc.control.control import MODE_NAMES, tool_frames
from postproc.job.job import prepare
from postproc.pipeline import convert, stages
from postproc.pipeline.next_modes import COARSER
from postproc.pipeline.result import PostResult
from postproc.readback.execution.frames import tool_frame
from postproc.report.summary import output_modes
from postproc.verification.read_back import read_back
from tests.hard.run import Task, failures, files_of, table, worked
from tests.postproc.correction.test_compensation_holes import HEIGHTS, PLACES
from tests.postproc.correction.test_compensation_points import both_directions_of_all
from tests.postproc.kit import toolpath
from toolpaths.diagnostics import Severity, error, has_errors
from toolpaths.rotations import rotation

SAMPLES = Path(__file__).parents[3] / "samples"
CASTING = SAMPLES / "casting"
CONTROLS = ("fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "linuxcnc", "generic-iso")
WITH_PLANES = CONTROLS[:4]
MODES = ("axes", "tcp", "tilted")
BOTTOM = ("FEATNO 204", "FEATNO 304")


@cache
def read(name: str) -> toolpaths.Toolpath:
    path, found = toolpaths.read(SAMPLES / name)
    assert not has_errors(found)
    return path


def casting(controller: str, output: str = "auto", setup: str = "casting.setup.toml") -> PostResult:
    return postproc.convert(read("casting/casting.ncl"), machines.load(CASTING / "trunnion_over.toml"), controller,
                            CASTING / setup, Options(output=output))


def errors_of(result: PostResult) -> set[str]:
    return {d.code for d in result.diagnostics if d.severity is Severity.ERROR}


def refusing(monkeypatch: pytest.MonkeyPatch, bad: Callable[[frames.Law, np.ndarray], bool]) -> None:
    """The read-back refuses the tilted planes that `bad` names by their law and the joints that they are entered at."""
    whole = frames._wrong_pose

    def wrong(law, rotation, *rest):
        _, _, q, file, line = rest
        if bad(law, q):
            return [error("gcode.plane_pose", "planted", file=file, lines=[line])]
        return whole(law, rotation, *rest)
    monkeypatch.setattr(frames, "_wrong_pose", wrong)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", CONTROLS)
def test_a_part_that_is_turned_over_converts_on_every_control(controller: str) -> None:
    result = casting(controller)
    assert result.ok, errors_of(result)
    assert "output.next_mode" not in {d.code for d in result.diagnostics}
    assert result.extents is not None and result.extents["A"][1] > 179.9
    laws = {law for laws in output_modes(result).values() for law in laws}
    assert laws == ({"tilted"} if controller in WITH_PLANES else {"axes"})
    assert result.witness is not None and not result.witness.findings and result.witness.worst_tip < 0.01


@pytest.mark.parametrize("name", ["mikron-ucp710", "linuxcnc-xyzac-trt", "trunnion-bc", "head-table", "fork-head-ab",
                                  "nutating-head", "mill-4axis"])
def test_frame_of_the_tool_is_that_of_its_axes_in_every_pose(name: str) -> None:
    """Writer's and reader's frames of the tool against turns about the lines of the machine, poles and near them too."""
    kin = machines.load(name).kinematics.with_tool(100.0)
    rotary = np.flatnonzero(kin.rotary)
    special = [0.0, 90.0, -90.0, 180.0, -180.0, 179.9999, 179.99999, -179.999999, 1e-7, 37.123, 200.5]
    for first in special:
        for second in special[:: 1 if len(rotary) > 1 else len(special)]:
            q = np.zeros(kin.joints)
            q[rotary] = np.radians([first, second][:len(rotary)])
            seen = np.eye(3)
            for joint in kin.chain:
                if joint.rotary:
                    turn = rotation(joint.direction, np.array([q[kin.axis_names.index(joint.name)]]))[0]
                    seen = seen @ turn
            assert np.abs(tool_frame(kin, q) - seen).max() < 1e-9, (first, second)
            assert np.abs(tool_frames(kin, q[None])[0] - seen).max() < 1e-9, (first, second)


@pytest.mark.parametrize("controller", ["siemens-840d", "fanuc-30i"])
def test_one_operation_takes_the_next_mode_and_the_warning_names_it(controller: str,
                                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    refusing(monkeypatch, lambda law, q: law.rotation is not None and law.rotation[2, 2] < -0.999)
    result = casting(controller)
    assert result.ok, errors_of(result)
    modes = output_modes(result)
    assert {name for name, laws in modes.items() if laws == ["axes"]} == set(BOTTOM)
    assert all(laws == ["tilted"] for name, laws in modes.items() if name not in BOTTOM)
    said = [d for d in result.diagnostics if d.code == "output.next_mode"]
    assert len(said) == 1 and said[0].severity is Severity.WARNING and said[0].count == 2
    assert all(name in said[0].message for name in BOTTOM) and "planted" in said[0].message
    assert f"written in {MODE_NAMES['axes']}, since in {MODE_NAMES['tilted']} [" in said[0].message
    assert len(said[0].lines) == 2


def test_each_operation_is_named_with_its_own_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, planted = frames._wrong_pose, list[int]()

    def wrong(law, rotation, *rest):
        *_, file, line = rest
        if rotation[2, 2] < -0.999:
            planted.append(line)
            return [error(f"planted.{len(planted)}", f"planted in block {line}", file=file, lines=[line])]
        return whole(law, rotation, *rest)
    monkeypatch.setattr(frames, "_wrong_pose", wrong)
    result = casting("siemens-840d")
    assert result.ok, errors_of(result)
    said = {d.message.partition(":")[0]: d for d in result.diagnostics if d.code == "output.next_mode"}
    assert set(said) == set(BOTTOM) and len(planted) == 2
    for k, name in enumerate(BOTTOM):
        assert f"[planted.{k + 1}] planted in block {planted[k]} " in said[name].message


def test_all_operations_take_the_next_mode_where_none_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.pipeline.stages.cl_lines", lambda *rest: ())
    refusing(monkeypatch, lambda law, q: True)
    result = casting("siemens-840d")
    assert result.ok and set(map(tuple, output_modes(result).values())) == {("axes",)}
    said = [d for d in result.diagnostics if d.code == "output.next_mode"]
    assert len(said) == 1 and said[0].count == 10 and "and 4 more" in said[0].message


def test_an_error_of_the_read_back_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    refusing(monkeypatch, lambda law, q: law.rotation is not None and law.rotation[2, 2] < -0.999)
    asked = casting("siemens-840d", "tilted")
    assert not asked.ok and asked.text == ""
    bad = [d for d in asked.diagnostics if d.severity is Severity.ERROR]
    assert bad and all("--output-mode auto" in d.hint and d.lines for d in bad)
    assert casting("siemens-840d", "auto").ok  # the hint, followed


def test_what_no_mode_converts_fails_once_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*rest: object, **more: object) -> list[object]:
        return [error("verify.path", "planted", file="x")]
    monkeypatch.setattr("postproc.verification.read_back.check_stops", nothing)
    result = casting("siemens-840d")
    bad = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert not result.ok and result.text == "" and {d.code for d in bad} == {"verify.path"}
    assert all(d.hint.endswith(COARSER) for d in bad)
    assert "output.next_mode" not in {d.code for d in result.diagnostics}


def test_a_place_outside_travel_is_looked_at_once_in_each_mode(monkeypatch: pytest.MonkeyPatch) -> None:
    """Words of another mode lead to the same place, and each mode alone says so. Where it is another place in each
    conversion, all combinations are tried."""
    path, setup = toolpath("RAPID", "GOTO/0,0,20", "GOTO/5,0,0", "GOTO/900,0,0"), SAMPLES / "tools.setup.toml"
    def conversions(elsewhere: bool) -> int:
        made: list[PostResult] = []

        def counted(*given: Any) -> PostResult:
            made.append(stages.staged(*given))
            return replace(made[-1], diagnostics=tuple(
                replace(d, message=f"{d.message} {elsewhere * len(made)}") for d in made[-1].diagnostics))
        monkeypatch.setattr(convert, "staged", counted)
        assert not postproc.convert(path, "mikron-ucp710", "siemens-840d", setup).ok
        return len(made)
    assert conversions(elsewhere=False) == len(MODES) < conversions(elsewhere=True)
    alone = [postproc.convert(path, "mikron-ucp710", "siemens-840d", setup, Options(output=mode)) for mode in MODES]
    assert all("axis X goes to 900.0000 mm" in "".join(d.message for d in one.diagnostics) for one in alone)


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["fanuc-30i", "heidenhain-tnc640", "haas-ngc"])
@pytest.mark.parametrize(("sample", "machine"), [
    ("five_faces.cls", "trunnion-bc"), ("joints/singular_pass.cls", "head-table")])
def test_auto_converts_what_another_mode_converts(sample: str, machine: str, controller: str) -> None:
    path, setup = read(sample), SAMPLES / "tools.setup.toml"
    auto = postproc.convert(path, machine, controller, setup)
    assert auto.ok or not any(postproc.convert(path, machine, controller, setup, Options(output=mode)).ok for mode in MODES)
    if sample == "joints/singular_pass.cls":
        assert auto.ok and auto.comparison is not None and auto.comparison.worst_tip < 0.006  # of 0.01


@pytest.mark.slow
@pytest.mark.parametrize("controller", WITH_PLANES)
@pytest.mark.parametrize("machine", [*machines.names(), *machines.catalogued(), "casting/trunnion_over.toml"])
def test_auto_converts_all_samples_that_another_mode_converts(machine: str, controller: str) -> None:
    name = str(SAMPLES / machine) if machine.endswith("toml") else machine
    for file in files_of(None):
        found = worked(Task(file, name, (controller,), None, law=True))
        assert not failures(found), table(found)


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc"])
def test_a_program_in_the_next_mode_is_verified_in_it(controller: str, tmp_path: Path) -> None:
    """In a plane the slides of a head go down aslant, so that dog-legs leave the line; `verify` reads off the program in
    which mode it is, and the room of lengths follows."""
    y, z = np.array([0.0, 0.5 * np.sqrt(3.0), 0.5]), np.array([0.0, -0.5, 0.5 * np.sqrt(3.0)])
    at = [",".join(f"{v:.6f}" for v in (*(x * np.eye(3)[0] + u * y + h * z), *z)) for x, u, h in (
        (0, 0, 60), *zip(*zip(*PLACES, strict=True), HEIGHTS, strict=True))]
    lines = ["UNITS/MM", "LOADTL/1", "SPINDL/1000,CLW", "MULTAX/ON", "RAPID", f"GOTO/{at[0]}", "RAPID",
             "GOTO/30,20,90," + ",".join(f"{v:.6f}" for v in z), "RAPID", f"GOTO/{at[0]}",
             "CYCLE/DRILL,DEPTH,3,CLEAR,2,RETURN,2,MMPM,250", *(f"GOTO/{p}" for p in at[1:]), "CYCLE/OFF", "RAPID",
             f"GOTO/{at[0]}", "FINI", ""]
    path, _ = toolpaths.read_bytes("\n".join(lines))
    options, setup = Options(error_model=str(both_directions_of_all(tmp_path, "head-table", 2))), tmp_path / "setup.toml"
    setup.write_text("[tools.1]\ngauge_length = 100.0\n")
    result = postproc.convert(path, "head-table", controller, setup, options)
    assert not errors_of(result) and "output.next_mode" in {d.code for d in result.diagnostics}
    program = tmp_path / "p.nc"
    program.write_text(result.text)
    verified = postproc.verify(program, path, "head-table", controller, setup, options)
    assert not has_errors(verified.diagnostics), [str(d) for d in verified.diagnostics]
    job, _ = prepare(path, result.machine, result.controller, result.setup, result.options)
    assert job is not None and result.comparison is not None and result.comparison.lengths
    again, _ = read_back(result.text, job, path.file, gcode=str(program), margins=True)
    assert again is not None and again.lengths == result.comparison.lengths
