"""The orientations of the test part, chosen once for all files of this folder that run in one process."""

from __future__ import annotations

from functools import cache

import toolpaths
from postproc.base.options import Options
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.setup.model import SetupFile
from tests.postproc.kit import SAMPLES, machine

PART = SAMPLES / "test_part.cls"


@cache
def part() -> OrientationChoice:
    """On a Mikron, with default options and an empty set-up."""
    path, found = toolpaths.read_bytes(PART.read_bytes(), file="test_part.cls")
    assert not toolpaths.diagnostics.has_errors(found), found
    choice, found = orient(path, machine("mikron-ucp710"), SetupFile(), Options())
    assert choice is not None, found
    return choice
