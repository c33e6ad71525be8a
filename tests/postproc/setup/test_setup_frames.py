"""Where the part stands and which system is the work offset: moved frames move the answer and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.setup.model import Placement, SetupFile, load_setup, part_placement
from tests.postproc.kit import (
    SAMPLES,
    angle,
    codes,
    convert,
    execute,
    good,
    goto,
    machine,
    tilted,
    tool_poses,
    tool_setup,
    toolpath,
    unit,
)
from toolpaths.toolpath import Frame

TOOLS = tool_setup().model_dump()["tools"]


def setup(**values: object) -> SetupFile:
    if "part" in values:
        values["part"] = {k: tuple(map(float, v)) for k, v in values["part"].items()}
    return SetupFile.model_validate({"tools": TOOLS, **values})


def spiral(turned: float = 0.0) -> list[str]:
    """Twenty points on a cone of axes, away from the pole."""
    phi = np.linspace(0, 120, 20) + turned
    tips = np.array([[30 * np.cos(np.radians(p)), 30 * np.sin(np.radians(p)), k] for k, p in enumerate(phi)])
    axes = np.array([tilted(25 + k, p + 10) for k, p in enumerate(phi)])
    return ["RAPID", *goto(tips[:1] + 20 * axes[:1], axes[:1]), *goto(tips, axes)]


def cuts(result: PostResult) -> np.ndarray:
    return np.array([s.end for s in execute(result) if s.kind != "rapid"])


@pytest.mark.covering
@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table"])
@pytest.mark.parametrize("turn", [20.0, -35.0])
def test_turning_the_part_about_c_changes_only_c(name: str, turn: float) -> None:
    """The table's C line is the z axis of the table frame: C goes in the other direction by the same angle."""
    a = np.radians(turn)
    turned = setup(part={"x_axis": [np.cos(a), np.sin(a), 0], "y_axis": [-np.sin(a), np.cos(a), 0]})
    straight, moved = (cuts(good(convert(toolpath(*spiral()), name, setup=s))) for s in (setup(), turned))
    assert straight.shape == moved.shape
    assert np.abs(moved[:, :4] - straight[:, :4]).max() < 3e-4
    steps = moved[:, 4] - straight[:, 4]
    assert np.abs(np.abs(steps) - abs(turn)).max() < 3e-4 and np.ptp(steps) < 6e-4


def test_turning_the_part_is_turning_the_path() -> None:
    """A part turned in the set-up is the same as a CL file turned by hand, machine positions and all."""
    a = np.radians(30)
    turned = setup(part={"x_axis": [np.cos(a), np.sin(a), 0], "y_axis": [-np.sin(a), np.cos(a), 0]})
    first = cuts(good(convert(toolpath(*spiral()), "trunnion-bc", setup=turned)))
    second = cuts(good(convert(toolpath(*spiral(30.0)), "trunnion-bc", setup=setup())))
    assert np.abs(first - second).max() < 3e-4


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("name", ["mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab"])
def test_any_placement_brings_the_tool_to_the_part(name: str) -> None:
    """Turned about a slanting line and shifted: own forward kinematics against own matrices."""
    x = unit(np.array([0.9, 0.3, 0.1]))
    y = unit(np.cross([0, -0.1, 1.0], x))
    r = np.stack([x, y, np.cross(x, y)], axis=1)
    shift = np.array([15.0, -25.0, 40.0])
    path = toolpath(*spiral())
    result = good(convert(path, name, setup=setup(part={"origin": list(shift), "x_axis": list(x), "y_axis": list(y)})))
    steps = execute(result)
    poses = [p for s, p in zip(steps, tool_poses(result, steps), strict=True) if s.kind != "rapid"]
    tips, axes = np.concatenate([p[0] for p in poses]), np.concatenate([p[1] for p in poses])
    for tip, axis in zip(path.tip[1:] @ r.T + shift, path.axis[1:] @ r.T, strict=True):
        near = np.linalg.norm(tips - tip, axis=1).argmin()
        assert np.linalg.norm(tips[near] - tip) < 1e-3
        assert angle(axes[near], axis) < 1e-4


def test_shift_moves_the_work_offset_not_the_words() -> None:
    path, _ = toolpaths.read(SAMPLES / "pocket.cls")
    here = good(convert(path, "mill-3axis", setup=setup()))
    there = good(convert(path, "mill-3axis", setup=setup(part={"origin": [100, -50, -60]})))
    assert np.allclose(cuts(there) - cuts(here), [100, -50, -60], atol=1e-9)
    for text in ("G1 Y-4 F900\nX13\n", "G3 X14 Y-3 I0 J1\n", "G98 G81 X-40 Y-30 Z-12 R3 F220\n"):
        assert text in here.text and text in there.text
    assert "(work offset G54 in machine coordinates: X100.0000 Y-50.0000 Z-60.0000)" in there.text


def two_systems() -> toolpaths.toolpath.Toolpath:
    path = toolpath("RAPID", "GOTO/110,20,50", "GOTO/110,25,0")
    return replace(path, frames=(Frame("first"), Frame("FIXTURE", (100.0, 20.0, -10.0))))


def test_work_offset_by_name() -> None:
    first = good(convert(two_systems(), "mill-3axis", setup=setup()))
    second = good(convert(two_systems(), "mill-3axis", setup=setup(work_offset="fixture")))
    assert np.allclose(cuts(first), cuts(second), atol=1e-9), "the machine goes to the same places"
    assert "G1 Y25 Z0 F600" in first.text and "G1 Y5 Z10 F600" in second.text
    assert "X100.0000 Y20.0000 Z-10.0000)" in second.text
    result = convert(two_systems(), "mill-3axis", setup=setup(work_offset="fixtur"))
    (d,) = [d for d in result.diagnostics if d.code == "setup.work_offset"]
    assert "first, FIXTURE" in d.hint and not result.text


def test_work_offset_of_a_placed_part_on_a_rotary_table() -> None:
    """The register holds where the tip stands over the origin with the rotaries at zero."""
    result = good(convert(two_systems(), "trunnion-bc", setup=setup(work_offset="FIXTURE", part={"origin": [5, 6, 7]})))
    assert np.allclose(result.job.control.work_offset, [105, 26, -3, 0, 0], atol=1e-9)


def test_verify_uses_the_same_setup(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "samples" / "tools.setup.toml").read_text()
    file = tmp_path / "s.toml"
    file.write_text(f"{text}\n[part]\norigin = [1, 2, 3]\nx_axis = [0, 1, 0]\ny_axis = [-1, 0, 0]\n")
    path, _ = toolpaths.read(SAMPLES / "five_faces.cls")
    m = machine("mikron-ucp710")
    result = good(postproc.convert(path, m, options=postproc.Options(setup=str(file))))
    out = tmp_path / "p.ngc"
    out.write_text(result.text)
    assert postproc.verify(out, path, m, options=postproc.Options(setup=str(file))).ok
    other = tmp_path / "o.toml"
    other.write_text(f"{text}\n[part]\norigin = [1, 2, 3]\n")
    assert not postproc.verify(out, path, m, options=postproc.Options(setup=str(other))).ok


@pytest.mark.parametrize(("part", "angle_found"), [({"x_axis": [1, 0, 0], "y_axis": [0.01, 1, 0]}, "89.4271"),
                                                   ({"x_axis": [0, 0, 0]}, "x_axis is 0, 0, 0"),
                                                   ({"y_axis": [0, 0, 0]}, "y_axis is 0, 0, 0")])
def test_skew_placement_is_refused(part: dict[str, list[float]], angle_found: str) -> None:
    placement, found = part_placement(setup(part=part))
    assert placement is None and angle_found in found[0].message


@pytest.mark.parametrize(("text", "line"), [
    ("[part]\nx_axis = [0, 0, 0]", 2), ("[part]\nx_axis = [1, 0, 0]\ny_axis = [1, 1, 0]", 3),
    ("\nwork_offset_code = 'G60'", 2), ("[output.operations]\nNIX = 'axes'", 2), ("[output.smoothing]\nNIX = 'roughing'", 2),
    ("\n[control_pivots.B]\npoint = [0, 0, 0]", 2), ("[control_pivots.A]\npoint = [0, 1, 0]", 1),
    ("[[places]]\nname = 'a'\nwork_offset_code = 'G54'\n[[places]]\nname = 'b'\nwork_offset_code = 'G60'", 6)])
def test_what_a_set_up_has_wrong_is_said_with_its_line(text: str, line: int, tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text(text + "\n")
    options = postproc.Options(setup=str(file))
    found = postproc.convert(toolpath("GOTO/0,0,5"), machine("mikron-ucp710"), "linuxcnc", options=options).diagnostics
    assert {d.lines for d in found if d.file == str(file)} == {(line,)}, [str(d) for d in found]


def test_placement_and_back() -> None:
    r = np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])
    p = Placement(r, np.array([1.0, 2, 3]))
    points = np.random.default_rng(0).normal(size=(9, 3))
    assert np.allclose(p.inverse().points(p.points(points)), points)
    assert np.allclose(p.points(np.array([[1.0, 0, 0]])), [[1, 3, 3]])
    assert np.allclose(p.directions(np.array([[1.0, 0, 0]])), [[0, 1, 0]])
    same = Placement(np.eye(3), np.zeros(3))
    assert same.points(points) is points


def test_setup_file_names_wrong_keys(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text("[clearence]\nmargin = 5\n")
    got, found = load_setup(file)
    assert got is None and "clearance" in f"{found[0].message} {found[0].hint}"
    file.write_text("[tools.1]\ngauge_length = -5\n")
    got, found = load_setup(file)
    assert got is None and found[0].lines == (2,)


def test_missing_gauge_length_is_an_error_only_where_words_depend_on_it() -> None:
    path = toolpath(*spiral())
    assert "tool.length" in codes(d for d in convert(path, "fork-head-ab", setup=SetupFile()).diagnostics if d.severity == 2)
    table = convert(path, "mikron-ucp710", setup=SetupFile())
    assert table.ok and "tool.length" in codes(table.diagnostics)
    with_tool = good(convert(path, "mikron-ucp710", setup=setup()))
    assert [n for n in table.text.splitlines() if "A" in n and "F" in n] == [
        n for n in with_tool.text.splitlines() if "A" in n and "F" in n], "words do not depend on it"
