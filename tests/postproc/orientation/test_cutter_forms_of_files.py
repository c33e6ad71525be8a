"""A second reading of the choice of orientations: forms of cutters that a CL file can give, files that set-ups name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
import toolpaths
from postproc.collision.form import CUTTER, tool_form
from postproc.collision.mesh import load_mesh
from postproc.orientation.plans.orient import orient
from postproc.orientation.report.text import as_text
from postproc.placement.write import placed_text
from postproc.reference.cutter import ball_radius
from postproc.setup.model import PartPlacement, SetupFile, ToolSetup, load_setup
from toolpaths.units import DEG

_LINES = "UNITS/MM\n{cutter}\nLOADTL/1\nRAPID\nGOTO/0,0,9,0,0,1\nFEDRAT/900,MMPM\nGOTO/9,0,9,0,0,1\nFINI\n"
_BASE = """[bodies]
part = "p.stl"
[[bodies.fixtures]]
name = "a"
file = "meshes/a.stl"
[tools.1]
gauge_length = 90.0
holder_mesh = "h.stl"
"""


@pytest.mark.parametrize(("cutter", "radius"), [
    ("CUTTER/16,8", 8.0),
    ("CUTTER/16,8,0,8,0,0,50", 8.0),
    ("CUTTER/14.6586,8,0,8,0,5,50", 8.0),   # tapered ball: side and tip plane meet inside the ball's radius
    ("CUTTER/16,8,0.67,8,0,5,50", 0.0),     # the same numbers with a flat end
    ("CUTTER/16,85,-77,85,0,0,50", 0.0),
    ("CUTTER/16,8,75,0", 8.0),              # diameter, corner, height
    ("CUTTER/16,2,6,2,0,0,50", 0.0),
    ("CUTTER/16,0", 0.0),
    ("CUTTER/0,0", 0.0),
])
def test_corner_centre_says_what_a_ball_is(cutter: str, radius: float) -> None:
    path, _ = toolpaths.read_bytes(_LINES.format(cutter=cutter).encode(), file="part.apt")
    assert ball_radius(path.tools[0]) == radius


def test_meshes_are_next_to_the_file_that_names_them(tmp_path: Path) -> None:
    for folder in ("shop", "job", "placed"):
        (tmp_path / folder).mkdir()
    (tmp_path / "shop/base.toml").write_text(_BASE)
    job = tmp_path / "job/setup.toml"
    job.write_text('base = "../shop/base.toml"\n[bodies]\npart = "own.stl"\n'
                   '[tools.2]\ngauge_length = 80.0\nholder_mesh = "/h2.stl"\n')
    placed = tmp_path / "placed/setup.toml"
    placed.write_text(placed_text(job, placed, PartPlacement(origin=(1.0, 2.0, 3.0))))
    for file in (job, placed):
        setup, found = load_setup(file)
        assert setup is not None and setup.bodies is not None, found
        named = [setup.bodies.part, setup.bodies.fixtures[0].file, *(setup.tools[n].holder_mesh for n in "12")]
        there = [(file.parent / str(name)).resolve() for name in named]
        wanted = [tmp_path / "job/own.stl", tmp_path / "shop/meshes/a.stl", tmp_path / "shop/h.stl", Path("/h2.stl")]
        assert there == [path.resolve() for path in wanted]


@pytest.mark.parametrize("cutter", ["CUTTER/6,3,0,3,0,10,60", "CUTTER/5.03,3,0,3,0,10,60", "TLDATA/MILL,6,3,75,10,0"])
def test_tapered_balls_are_as_wide_as_they_are(cutter: str) -> None:
    """Whatever the diameter means: a ball of 3 mm about the axis, and a side at 10 degrees that touches it."""
    path, _ = toolpaths.read_bytes(_LINES.format(cutter=cutter).encode(), file="part.apt")
    form, found = tool_form(1, path.tools[0], ToolSetup(gauge_length=150.0, flute_length=60.0), "setup.toml")
    ball, side = form.of(CUTTER)
    sin, cos = np.sin(10.0 * DEG), np.cos(10.0 * DEG)
    assert ball == pytest.approx([0.0, 3.0, 0.0, 3.0, 3.0], abs=1e-9)
    assert side == pytest.approx([3.0 * cos, 3.0 - 3.0 * sin, 3.0 * cos + (57.0 + 3.0 * sin) * sin / cos, 60.0, 0.0])
    assert "collision.corner" not in {d.code for d in found}


@pytest.mark.parametrize("cutter", ["CUTTER/16,85,-77,85,0,0,50", "CUTTER/16,9"])
def test_a_corner_that_does_not_fit_is_reported_and_nothing_is_cut_off(cutter: str) -> None:
    path, _ = toolpaths.read_bytes(_LINES.format(cutter=cutter).encode(), file="part.apt")
    form, found = tool_form(1, path.tools[0], ToolSetup(gauge_length=150.0, flute_length=60.0), "setup.toml")
    assert form.of(CUTTER) == pytest.approx(np.array([[8.0, 0.0, 8.0, 60.0, 0.0]]))
    assert ["does not fit a diameter of 16 mm" in d.message for d in found if d.code == "collision.corner"] == [True]


def test_why_a_pass_without_length_is_kept_is_reported() -> None:
    lines = _LINES.format(cutter="CUTTER/16,8").replace("GOTO/9,0,9,0,0,1", "GOTO/0,0,9,0,0,1")
    path, _ = toolpaths.read_bytes(lines.encode(), file="part.apt")
    choice, _ = orient(path, machines.load("mikron-ucp710"), SetupFile())
    assert choice is not None
    assert "axis kept: its cuts have no length" in as_text(choice, "auto", [])


def test_a_sheet_is_no_solid(tmp_path: Path) -> None:
    """Two triangles back to back enclose nothing: a diagnostic, and no warning of numpy (pytest makes errors of these)."""
    file = tmp_path / "sheet.off"
    file.write_text("OFF\n3 2 0\n0 0 0\n10 0 0\n0 10 0\n3 0 1 2\n3 0 2 1\n")
    mesh, found = load_mesh(file, "mm", "bodies.part")
    assert mesh is None and [d.code for d in found] == ["mesh.sides"]
