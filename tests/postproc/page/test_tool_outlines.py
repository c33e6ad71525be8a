"""Outlines of tools lie on the bodies that collisions are computed with; solids without sharp edges are drawn too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.collision.revolution import signed
from postproc.page.solids import EVEN, LEAST, _edges
from postproc.page.tool_outlines import outline
from tests.postproc.page.page_kit import reported

PIECES = [(0.0, 8.0, 0.0, 8.0, 8.0), (5.0, 2.0, 5.0, 2.0, 2.0), (4.0, 0.0, 4.0, 30.0, 0.0), (0.0, 0.0, 6.0, 2.5, 0.0),
          (3.0, 1.0, 5.0, 40.0, 1.0), (15.0, 40.0, 25.0, 80.0, 0.0), (25.0, 80.0, 12.0, 90.0, 0.5),
          (9.0, 20.0, 9.0, 20.0, 0.0)]


@pytest.mark.parametrize("piece", PIECES)
def test_an_outline_is_the_skin_of_its_piece(piece: tuple[float, ...]) -> None:
    """Each point has the signed distance zero, and a little further out it is outside."""
    body = np.array(piece)
    radius, height = outline(body).T
    assert len(radius) >= 2 and np.all(np.diff(height) >= 0.0)
    assert np.abs(signed(body, radius, height)[0]).max() < 1e-9
    assert signed(body, radius + 1e-3, height)[0].min() > 0.0
    assert np.max(radius) == pytest.approx(max(piece[0], piece[2]) + piece[4], rel=0.06)


def test_a_tool_whose_form_is_said_is_drawn_by_it() -> None:
    """A ball cutter of 16 mm of the CL file; of a tool of which nothing is said there is no form."""
    cuts = ("SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "GOTO/0,0,50", "GOTO/0,0,0", "GOTO/20,0,0")
    lines = ("PARTNO P", "UNITS/MM", "TLDATA/MILL,16.0,8.0,75.0,0.0,0.0", "LOADTL/4", *cuts, "LOADTL/5", *cuts, "FINI")
    made = reported(lines=lines)
    tools = {tool["number"]: tool for tool in made.values["runs"][0]["tools"]}
    pieces = [np.array(piece["radius_height_mm"]) for piece in tools[4]["form"] if piece["part"] == "cutter"]
    assert pieces[0][0].tolist() == [0.0, 0.0] and max(piece[:, 0].max() for piece in pieces) == pytest.approx(8.0)
    assert tools[5]["form"] == []


def test_a_round_solid_is_seen(tmp_path: Path) -> None:
    """A ball of 1280 triangles has no sharp edge: its sharpest are drawn; the diagonals of a box are not."""
    from trimesh.creation import box, icosphere

    icosphere(3, radius=20.0).export(tmp_path / "ball.stl")
    box((10.0, 20.0, 30.0)).export(tmp_path / "box.stl")
    ball = _edges(tmp_path, "ball.stl", "mm")
    assert len(ball) == LEAST and np.linalg.norm(ball.reshape(-1, 3), axis=1) == pytest.approx(20.0, abs=0.1)
    assert len(_edges(tmp_path, "box.stl", "mm")) == 12 and EVEN < 0.01
