"""Linking moves of a machine that cannot lift the tool: straight in its plane, where the set-up says so."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import postproc
from postproc.pipeline.result import PostResult
from postproc.report.summary import as_text
from postproc.verification.second_witness import machine_tables
from postproc.witness.machine import Rods, kinematics_of, merged
from tests.postproc.kit import codes, convert, good, machine, setup_of, toolpath
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

TOOL = "[tools.1]\ngauge_length = 110.0\n[part]\norigin = [0.0, 0.0, -110.0]\n"
IN_PLANE = TOOL + "[clearance]\nin_plane = true\n"


@cache
def path() -> Toolpath:
    return toolpath("RAPID", "GOTO/-50,-40,0", "GOTO/-46,-40,0", "RAPID", "GOTO/-46,-36,0", "GOTO/-50,-36,0")


@cache
def planar() -> PostResult:
    return good(convert(path(), "planar-delta", setup=setup_of(IN_PLANE)))


def test_links_go_straight_in_the_plane_and_the_proof_names_them() -> None:
    """From home to the first point and back: within LEG_TOLERANCE of the line between, never out of the workspace."""
    result, kin = planar(), machine("planar-delta").kinematics.with_tool(110.0)
    blocks = result.path
    home = kin.forward(machine("planar-delta").home[None])[0][0]
    links = np.flatnonzero(np.isnan(blocks.u))
    first = links[links < blocks.begin[1]]
    tips, _ = kin.forward(blocks.q[first])
    ends = np.array([home, [-50.0, -40.0, -110.0]])
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    off = tips - ends[0]
    off -= (off @ along)[:, None] * along
    assert len(first) > 2 and np.abs(off).max() < 0.02 and np.abs(tips[:, 2] + 110.0).max() < 1e-9
    np.testing.assert_allclose(tips[[0, -1]], ends, atol=1e-6)
    assert result.comparison.worst_tip < 0.01 and "not compared" not in as_text(result, "p.ngc")


def test_a_link_that_leaves_its_line_is_found_by_the_second_witness(tmp_path: Path) -> None:
    """One crank 0.4 degrees off in the middle of the way from home."""
    lines = planar().text.splitlines()
    k = next(i for i, line in enumerate(lines) if line.startswith("S")) + 3
    a, b = (float(word[1:]) for word in lines[k].split())
    lines[k] = f"A{a + 0.4:.4f} B{b:.4f}"
    (tmp_path / "p.ngc").write_text("\n".join(lines) + "\n")
    result = postproc.verify(tmp_path / "p.ngc", path(), machine("planar-delta"), "linuxcnc", setup=setup_of(IN_PLANE))
    found = result.diagnostics
    assert any(d.code == "witness.clearance" and "straight line" in d.message for d in found), [str(d) for d in found]


def test_tools_of_their_own_lengths_each_work_in_their_own_plane() -> None:
    """The tip of a tool that is 10 mm longer stands 10 mm lower; between them the tool goes home in its own plane."""
    two = ("LOADTL/1", "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/-50,-40,0", "FEDRAT/MMPM,600", "GOTO/-46,-40,0", "LOADTL/2",
           "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/-46,-36,-10", "FEDRAT/MMPM,600", "GOTO/-50,-36,-10")
    setup = setup_of(IN_PLANE.replace("110.0\n", "110.0\n[tools.2]\ngauge_length = 120.0\n", 1))
    result = good(convert(toolpath(*two), "planar-delta", setup=setup))
    assert result.witness is not None and not result.witness.findings and result.comparison.worst_tip < 0.01
    level = toolpath(*(line.replace(",-10", ",0") for line in two))
    refused = convert(level, "planar-delta", setup=setup)
    assert "reach.plane" in codes(refused.diagnostics)
    assert good(convert(level, "planar-delta-z", setup=setup_of(
        TOOL.replace("110.0\n", "110.0\n[tools.2]\ngauge_length = 120.0\n", 1)))).witness is not None


def test_without_the_key_the_program_is_refused_and_its_links_are_found(tmp_path: Path) -> None:
    """By the planner, and in a program made with the key by the second witness."""
    refused = convert(path(), "planar-delta", setup=setup_of(TOOL))
    assert "link.in_plane" in codes(refused.diagnostics) and not refused.text
    file = tmp_path / "p.ngc"
    file.write_text(planar().text)
    result = postproc.verify(file, path(), machine("planar-delta"), "linuxcnc", setup=setup_of(TOOL))
    assert {"witness.clearance"} <= codes(result.diagnostics)


@pytest.mark.parametrize("name", ["planar-delta", "planar-delta-z", "rotary-delta", "delta-star", "hexapod", "h4a-c-table"])
def test_the_witness_knows_by_itself_which_machines_stay_in_a_plane(name: str) -> None:
    plane = machine(name).kinematics.plane
    rods = kinematics_of(merged(machine_tables(machine(name))))
    assert isinstance(rods, Rods) and rods.flat == (plane is not None) == (name == "planar-delta")


def test_on_controls_with_dog_leg_rapids_they_are_fed_where_the_set_up_asks_for_it(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    file.write_text('base = "planar-delta"\n[control]\nrapids = "dog-leg"\n')
    result = postproc.convert(path(), file, "fanuc-30i", setup_of(IN_PLANE + "[output]\nrapids_as_feed = true\n"))
    assert not [str(d) for d in result.diagnostics if d.severity is Severity.ERROR] and result.text
