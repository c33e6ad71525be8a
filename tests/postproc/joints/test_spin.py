"""Tools held about their own axes: the free rotary joint stands where it is asked to, and the read-back knows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import postproc
import toolpaths
from machines.kinematics.frames import reference_x, spin_about, tool_x
from postproc.base.options import Options, OutputMode
from postproc.joints.spin import free_joint, held_joints, spin_of
from postproc.setup.model import PartPlacement, Placement, SetupFile, load_setup
from tests.postproc.kit import SAMPLES, TOOLS, codes, machine, toolpath
from toolpaths.arrays import Floats
from toolpaths.toolpath import Toolpath

Z = np.array([0.0, 0.0, 1.0])
LINES = [text for k in range(3) for text in (
    "RAPID", f"GOTO/0,{k},30", "RAPID", f"GOTO/0,{k},0", f"GOTO/40,{k},0", f"GOTO/80,{k},5", "RAPID", f"GOTO/80,{k},30")]


def held(*spins: float, lines: list[str] | None = None) -> Toolpath:
    """Three level passes, each held at a spin (rad)."""
    path = toolpath(*(lines or LINES))
    return replace(path, spin=np.repeat(spins, 5))


def setup_of(name: str) -> SetupFile:
    setup, _ = load_setup(SAMPLES / "h4a.setup.toml" if "h4a" in name else TOOLS)
    assert setup is not None
    return setup


def rotary(result: postproc.PostResult, letter: str) -> Floats:
    """Degrees of an axis at the end of every block of a run."""
    assert result.path is not None
    return np.degrees(result.path.q[np.isfinite(result.path.u), result.machine.axis_names.index(letter)])


def test_tool_x_undoes_spin_about() -> None:
    rng = np.random.default_rng(2)
    axis = rng.normal(size=(50, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    spin = rng.uniform(-np.pi, np.pi, 50)
    np.testing.assert_allclose(spin_about(axis, tool_x(axis, spin)), spin, atol=1e-12)
    np.testing.assert_allclose(tool_x(axis, np.zeros(50)), reference_x(axis), atol=1e-15)


@pytest.mark.parametrize("name", ["mikron-ucp710", "trunnion-bc", "head-table", "h4a-c-table", "linuxcnc-xyzac-trt"])
def test_the_free_joint_takes_the_spin(name: str) -> None:
    m = machine(name)
    kin, tip = m.kinematics.with_tool(60.0), np.array([10.0, 20.0, -900.0 if "h4a" in name else 0.0])
    joint = free_joint(kin, tip, Z, m.home)
    assert m.axis_names[joint] == "C"
    for spin in (-2.0, 0.3, 3.0):
        near = held_joints(kin, tip, Z, spin, m.home)
        assert near is not None
        assert [spin_of(kin, q) for q in kin.inverse(tip[None], Z[None], near=near)[:, 0]] == pytest.approx([spin, spin])
    leaning = np.array([0.1, 0.0, 1.0]) / np.sqrt(1.01)
    assert free_joint(kin, tip, leaning, m.home) == -1 and held_joints(kin, tip, leaning, 0.3, m.home) is None


@pytest.mark.covering
@pytest.mark.parametrize(("name", "controller", "mode"), [
    ("mikron-ucp710", "linuxcnc", "axes"), ("mikron-ucp710", "siemens-840d", "tilted"),
    ("trunnion-bc", "fanuc-30i", "tilted"),
    ("mikron-ucp710", "heidenhain-tnc640", "tilted"), ("mikron-ucp710", "heidenhain-tnc640", "tcp"),
    ("mikron-ucp710", "haas-ngc", "auto"), ("head-table", "siemens-840d", "auto"), ("h4a-c-table", "linuxcnc", "auto"),
    ("linuxcnc-xyzac-trt", "linuxcnc", "auto")])
def test_passes_stand_where_they_are_held(name: str, controller: str, mode: OutputMode) -> None:
    """At 40 degrees, where they like, and at -75: on every path of writing it, proved by the read-back."""
    path = held(np.radians(40.0), np.nan, np.radians(-75.0))
    result = postproc.convert(path, machine(name), controller, setup_of(name), Options(output=mode))
    assert result.ok and result.comparison is not None, [str(d) for d in result.diagnostics]
    sign = -1.0 if name == "linuxcnc-xyzac-trt" else 1.0
    c = sign * rotary(result, "C")
    assert set(np.round(c[:3], 3)) == {40.0} and set(np.round(c[-3:], 3)) == {-75.0}


def test_between_passes_held_otherwise_the_tool_is_drawn_back() -> None:
    """C never turns while the tool is at the part; passes held alike are one run."""
    apart = postproc.convert(held(0.5, 1.5, 1.5), machine("mikron-ucp710"), "linuxcnc", setup_of(""))
    assert apart.job is not None and np.flatnonzero(apart.job.moves.link).tolist() == [0, 5]
    assert np.ptp(rotary(apart, "C")[:4]) < 1e-9
    alike = postproc.convert(held(0.5, 0.5, 0.5), machine("mikron-ucp710"), "linuxcnc", setup_of(""))
    assert alike.job is not None and np.flatnonzero(alike.job.moves.link).tolist() == [0]


def test_a_part_that_stands_turned_keeps_its_spin() -> None:
    """Turned by 30 degrees on the table the part needs C 30 degrees less for the same direction of the tool's x in it."""
    c, s = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    setup = setup_of("").model_copy(update={"part": PartPlacement(x_axis=(c, s, 0.0), y_axis=(-s, c, 0.0))})
    result = postproc.convert(held(0.5, 0.5, 0.5), machine("mikron-ucp710"), "linuxcnc", setup)
    assert result.ok and result.job is not None
    np.testing.assert_allclose(rotary(result, "C"), np.degrees(0.5) + 30.0, atol=1e-6)
    job = result.job
    back = job.moves.placed(Placement(job.placement.rotation.T, np.zeros(3)))
    np.testing.assert_allclose(back.spin, 0.5, atol=1e-12)


def test_the_read_back_sees_another_angle(tmp_path: Path) -> None:
    """The same program for a path that asks for 5 degrees more."""
    path, file = held(0.5, 0.5, 0.5), tmp_path / "p.ngc"
    result = postproc.convert(path, machine("mikron-ucp710"), "linuxcnc", options=Options(setup=str(TOOLS)))
    assert result.ok, [str(d) for d in result.diagnostics]
    file.write_text(result.text)
    same = postproc.pipeline.convert.verify(file, path, machine("mikron-ucp710"), "linuxcnc", TOOLS)
    assert same.ok, [str(d) for d in same.diagnostics]
    spin = path.spin
    assert spin is not None
    other = postproc.pipeline.convert.verify(file, replace(path, spin=spin + np.radians(5.0)), machine("mikron-ucp710"),
                                             "linuxcnc",
                                     TOOLS)
    noted = [d for d in other.diagnostics if d.code == "verify.spin"]
    assert len(noted) == 1 and "5.0000 degrees turned about its axis" in noted[0].message


def test_what_no_axis_can_hold_is_refused() -> None:
    """A leaning tool leaves no joint free, a machine of three axes has none, limited travel may not reach it."""
    lines = ["MULTAX", *(line + ",0,0.6,0.8" if line.startswith("GOTO") else line for line in LINES)]
    result = postproc.convert(held(0.5, 0.5, 0.5, lines=lines), machine("mikron-ucp710"), "linuxcnc",
                              setup_of(""))
    assert "axis.spin" in codes(result.diagnostics) and not result.ok
    result = postproc.convert(held(0.5, 0.5, 0.5), machine("mill-3axis"), "linuxcnc", setup_of(""))
    assert codes(d for d in result.diagnostics if d.severity >= 2) == {"axis.spin"}
    m = machine("mikron-ucp710")
    limits = replace(m.limits, lower=np.where([*[False] * 4, True], -0.1, m.limits.lower),
                     upper=np.where([*[False] * 4, True], 0.1, m.limits.upper))
    narrow = postproc.convert(held(0.5, 0.5, 0.5), replace(m, limits=limits), "linuxcnc", setup_of(""))
    assert not narrow.ok and any("travel" in code for code in codes(narrow.diagnostics))


def test_no_cl_file_says_it() -> None:
    with pytest.raises(ValueError, match="held about its own axis"):
        toolpaths.write(held(0.5, 0.5, 0.5), "x.apt")
    assert not held(0.5, np.nan, 0.5).equals(held(0.5, 0.5, 0.5))
    assert not toolpath(*LINES).equals(held(0.5, 0.5, 0.5)) and held(0.5, np.nan, 0.5).equals(held(0.5, np.nan, 0.5))
