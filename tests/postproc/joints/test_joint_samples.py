"""The samples of joints/ through the whole road: rewinds clear of the part, singular directions within the axes' speeds."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.report.summary import as_dict
from postproc.setup.model import SetupFile, load_setup
from postproc.verification.read_back import read_back

FOLDER = Path(__file__).parents[3] / "samples"
JOINTS = FOLDER / "joints"
LIMITED = JOINTS / "limited_c.toml"


@cache
def converted(name: str, machine: str, setup: str, controller: str = "linuxcnc") -> PostResult:
    path, _ = toolpaths.read(JOINTS / f"{name}.cls")
    return postproc.convert(path, machines.load(machine), controller, setup=loaded(setup))


def loaded(setup: str) -> SetupFile:
    found, faults = load_setup(FOLDER / setup)
    assert found is not None and not faults
    return found


def good(result: PostResult) -> PostResult:
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


def rewound(controller: str = "linuxcnc") -> PostResult:
    return good(converted("forced_rewind", str(LIMITED), "joints/forced_rewind.setup.toml", controller))


def test_script_reproduces_the_files(tmp_path: Path) -> None:
    subprocess.run([sys.executable, FOLDER / "make_joints.py", tmp_path], check=True, timeout=60)
    names = sorted(p.name for p in JOINTS.iterdir())
    assert names == sorted(p.name for p in (tmp_path / "joints").iterdir())
    readme = (FOLDER / "README.md").read_text()
    for name in names:
        assert (tmp_path / "joints" / name).read_bytes() == (JOINTS / name).read_bytes()
        assert f"`{name}`" in readme


@pytest.mark.covering(count=3)
@pytest.mark.parametrize(("name", "machine", "setup", "rewinds"), [
    ("singular_pass", "mikron-ucp710", "tools.setup.toml", 0), ("full_sphere", "mikron-ucp710", "tools.setup.toml", 0),
    ("turned_over", "mikron-ucp710", "joints/turned_over.setup.toml", 0),
    ("spiral_50", "mikron-ucp710", "tools.setup.toml", 0), ("spiral_50", str(LIMITED), "tools.setup.toml", 25)])
def test_sample_reads_back_and_the_bound_covers_what_is_read(name: str, machine: str, setup: str,
                                                             rewinds: int) -> None:
    result = good(converted(name, machine, setup))
    noted = as_dict(result, "")
    assert noted["rewinds"] == rewinds
    bound = noted["linearising_bound"]
    assert bound["tip_mm"] <= result.shares["linearising"] + 1e-9
    led = sum(1 for d in result.diagnostics if d.code == "singular.led")
    if not led:
        slack = result.shares["rounding"] + 1e-6
        assert noted["worst_tip_deviation_mm"] <= bound["tip_mm"] + slack


def test_turned_over_part_lies_on_its_back() -> None:
    result = good(converted("turned_over", "mikron-ucp710", "joints/turned_over.setup.toml"))
    assert result.job.moves.axis[:, 2].min() > 0.9
    flat = converted("turned_over", "mikron-ucp710", "tools.setup.toml")
    assert not flat.ok


# ---- rewinds -----------------------------------------------------------------------------------------------


def linking_poses(result: PostResult) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(tip, axis, turning) at 41 places of every linking block, by the machine's kinematics."""
    path, kin = result.path, result.job.kinematics(int(result.job.moves.tool[0]))
    rows = np.flatnonzero(np.isnan(path.u))[1:]
    a, b = path.q[rows - 1], path.q[rows]
    t = np.linspace(0, 1, 41)[:, None, None]
    q = (a + t * (b - a)).reshape(-1, a.shape[1])
    turning = np.tile(np.abs((b - a)[:, 3:]).max(axis=1) > 1e-9, 41)
    return *kin.forward(q), turning


def test_the_part_never_turns_under_a_tool_in_the_material() -> None:
    """Wherever a rotary axis turns in a linking move, the tool's axis is beyond its radius from all that is cut."""
    result = rewound()
    moves = result.job.moves
    tip, axis, turning = linking_poses(result)
    cut = moves.tip[moves.kind == 1]
    offset = cut[None] - tip[turning][:, None]
    along = np.maximum((offset * axis[turning][:, None]).sum(axis=2), 0.0)
    away = np.linalg.norm(offset - along[..., None] * axis[turning][:, None], axis=2)
    assert turning.sum() > 100
    assert away.min() > 3.0 + 5.0


def test_a_rewind_leaves_and_returns_along_the_tool_axis_to_the_same_pose() -> None:
    result = rewound()
    path, kin = result.path, result.job.kinematics(int(result.job.moves.tool[0]))
    tip, axis = kin.forward(path.q)
    assert len(path.rewinds) == 2
    for m in path.rewinds:
        rows = np.flatnonzero((path.move == m) & np.isnan(path.u))
        first = rows[0] - 1
        assert np.linalg.norm(tip[rows[-1]] - tip[first]) < 1e-7 and np.linalg.norm(axis[rows[-1]] - axis[first]) < 1e-9
        for block in (rows[0], rows[-1] - 1):
            travel = tip[block] - tip[first]
            assert np.linalg.norm(travel - (travel @ axis[first]) * axis[first]) < 1e-6 and travel @ axis[first] > 10.0
        assert np.abs(path.q[rows[-1]] - path.q[first])[4] > np.pi


def test_rewinds_stand_where_the_tool_does_not_cut_if_they_can_and_return_at_the_stated_feed() -> None:
    result = rewound()
    noted = [d for d in result.diagnostics if d.code == "rewind.made"]
    assert sorted(d.severity.name for d in noted) == ["INFO", "WARNING"]
    path, kin = result.path, result.job.kinematics(int(result.job.moves.tool[0]))
    cuts = [np.flatnonzero((path.move == m) & np.isnan(path.u) & (path.code == 1)) for m in path.rewinds]
    assert [len(c) > 0 for c in cuts] == [False, True]
    rows = cuts[1]
    tip, _ = kin.forward(path.q[rows[0] - 1:rows[-1] + 1])
    feed = np.linalg.norm(np.diff(tip, axis=0), axis=1).sum() / path.seconds[rows].sum()
    assert feed * 60.0 == pytest.approx(400.0, rel=1e-3)


def test_a_rewind_that_is_forbidden_is_refused_with_axis_limit_and_lines() -> None:
    path, _ = toolpaths.read(JOINTS / "forced_rewind.cls")
    setup = loaded("joints/forced_rewind.setup.toml")
    setup = setup.model_copy(update={"rewind": setup.rewind.model_copy(update={"allowed": False})})
    result = postproc.convert(path, machines.load(LIMITED), setup=setup)
    (d,) = [d for d in result.diagnostics if d.code == "travel.exceeded"]
    assert "axis C" in d.message and "-400.0000 to 400.0000 degrees" in d.message and d.lines and not result.text


@pytest.mark.parametrize("controller", ["fanuc-30i", "siemens-840d", "heidenhain-tnc640"])
def test_rewinds_under_the_controls_own_kinematics(controller: str) -> None:
    result = rewound(controller)
    assert len(result.path.rewinds) == 2 and result.comparison.worst_tip < 0.01


@pytest.mark.parametrize("height", ["114.0161", "20", "2", ""])
def test_the_reader_accepts_a_rewind_only_clear_of_the_part(height: str) -> None:
    """The retract as it is, too short, and left out."""
    result = rewound()
    lines = result.text.splitlines()
    at = next(k for k, n in enumerate(lines) if n.endswith(" C-396")) - 1
    assert lines[at] == "G0 Z114.0161"
    lines[at:at + 2] = [f"G0 Z{height}", lines[at + 1]] if height else [f"G0 {lines[at + 1]}"]
    _, found = read_back("\n".join(lines).encode(), result.job, "x.cls")
    codes = {d.code for d in found if d.severity.name == "ERROR"}
    assert codes == set() if height == "114.0161" else codes >= {"verify.rewind"} if height else codes


# ---- singular directions -----------------------------------------------------------------------------------


@pytest.mark.parametrize("machine", ["mikron-ucp710", "trunnion-bc", "head-table"])
def test_no_axis_is_faster_than_its_limit_by_a_singular_direction(machine: str) -> None:
    result = good(converted("singular_pass", machine, "tools.setup.toml"))
    path, limits = result.path, result.machine.limits
    events = [e for _, _, e in path.events]
    assert len(events) == 2 and events[0].before / events[0].after > 1000.0
    assert all(np.degrees(e.deviation) < 0.022 for e in events)
    motion = result.program
    step = np.abs(np.diff(path.q, axis=0, prepend=path.q[:1]))
    cutting = (path.code == 1) & ~np.isnan(path.u)
    seconds = result.feeds.seconds
    assert (step[cutting] / seconds[cutting, None] <= limits.velocity * (1 + 1e-3)).all()
    assert len(motion) > 0
