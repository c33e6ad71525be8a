"""A second reading of the choice of orientations: forms of cutters that a CL file can give."""

from __future__ import annotations

import pytest

import toolpaths
from postproc.orientation.cutter import ball_radius

_LINES = "UNITS/MM\n{cutter}\nLOADTL/1\nRAPID\nGOTO/0,0,9,0,0,1\nFEDRAT/900,MMPM\nGOTO/9,0,9,0,0,1\nFINI\n"


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
