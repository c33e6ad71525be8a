"""G43.4 by both readings of the maker's pages: entered with the tables at zero, proved under either frame."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import convert, good, pose_of, setup_of, shop_file, tilted, toolpath
from tests.postproc.reader_kit import FANUC
from toolpaths.diagnostics import Severity

SETUP = """\
[part]
origin = [37.0, -23.0, 11.0]
x_axis = [0.9563047559630355, 0.29237170472273677, 0.0]
y_axis = [-0.29237170472273677, 0.9563047559630355, 0.0]
[tools.1]
gauge_length = 120.0
"""
MACHINES = ("trunnion-bc", "mikron-ucp710", "head-table")


def swept(controller: str | Path, machine: str) -> PostResult:
    axes = [tilted(30 + 4 * k, 80 + 5 * k) for k in range(4)]
    lines = [f"GOTO/{10 * k},{3 * k},5,{a[0]:.9f},{a[1]:.9f},{a[2]:.9f}" for k, a in enumerate(axes)]
    return good(convert(toolpath("RAPID", lines[0], *lines[1:]), machine, controller, setup_of(SETUP)))


def errors(result: PostResult, text: str) -> set[str]:
    assert result.job is not None
    return {d.code for d in read_back(text.encode(), result.job, "f.cls")[1] if d.severity is Severity.ERROR}


def at_entry(result: PostResult) -> dict[str, float]:
    """The rotary words in force where G43.4 stands, read in plain text."""
    stated: dict[str, float] = {}
    for line in result.text.splitlines():
        if line.startswith("G43.4"):
            return stated
        stated |= {a: float(v) for a, v in re.findall(r"\b([ABC])(-?[\d.]+)", line.split("(")[0])}
    raise AssertionError("no G43.4")


@pytest.mark.parametrize(("machine", "tables"),
                         [("trunnion-bc", "BC"), ("mikron-ucp710", "AC"), ("head-table", "C")])
def test_the_tables_stand_at_zero_where_the_mode_is_entered(machine: str, tables: str) -> None:
    result = swept(FANUC, machine)
    entry = at_entry(result)
    assert all(entry[a] == 0.0 for a in tables)
    assert machine != "head-table" or abs(entry["B"]) > 5.0
    assert any(d.code == "output.tables_at_zero" and "s longer" in d.message for d in result.diagnostics)
    assert "SWITCHED ON WITH THE TABLES AT ZERO" in result.text


@pytest.mark.covering
@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("frame", ["table", "entry"])
def test_the_program_is_right_under_both_readings(tmp_path: Path, machine: str, frame: str) -> None:
    """Read by a control of either kind."""
    written = swept(FANUC, machine)
    other = swept(shop_file(tmp_path, f'[modes.tcp]\nframe = "{frame}"\n', FANUC), machine)
    assert not errors(other, written.text)


@pytest.mark.parametrize("machine", MACHINES)
def test_entered_with_turned_tables_the_readings_differ(tmp_path: Path, machine: str) -> None:
    """The usual entry: proved where the frame is known to be the table's, refused where it is not known, and
    wrong under the other reading."""
    usual = swept(shop_file(tmp_path, '[modes.tcp]\nframe = "table"\n', FANUC), machine)
    assert at_entry(usual)["C"] != 0.0
    either = swept(FANUC, machine)
    assert "gcode.tcp_frame" in errors(either, usual.text)
    entry = swept(shop_file(tmp_path, '[modes.tcp]\nframe = "entry"\n', FANUC), machine)
    assert errors(entry, usual.text) & {"verify.not_reached", "verify.tip", "verify.travel", "verify.link"}


def test_the_frame_of_the_other_reading_against_the_machine_in_plain_matrices() -> None:
    """A point of the work offset's frame, as it lies in the machine, seen from the table where the tables stand."""
    from postproc.readback.execution.frames import entered

    result = swept(FANUC, "trunnion-bc")
    assert result.job is not None
    control, q = result.job.control, np.array([10.0, 20.0, 30.0, np.radians(25.0), np.radians(-70.0)])
    rotation, origin = entered(control, control.kinematics.with_tool(50.0), q)
    words = np.array([4.0, -5.0, 6.0])
    machine_point = words + control.origin
    position = np.concatenate([machine_point, [0.0, 0.0]])
    tip, _ = pose_of("trunnion-bc", np.concatenate([machine_point, [25.0, -70.0]])[None], 0.0)
    flat, _ = pose_of("trunnion-bc", position[None], 0.0)
    assert np.allclose(flat[0], machine_point) and np.allclose(origin + rotation @ words, tip[0], atol=1e-9)


def test_heads_need_no_zero() -> None:
    result = swept(FANUC, "fork-head-ab")
    assert not any(d.code == "output.tables_at_zero" for d in result.diagnostics)
