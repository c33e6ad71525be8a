"""What rooms of tests leave out of conversions is looked at by no test there."""

from __future__ import annotations

import re

from tests.margins import BOUNDED, UNBOUNDED

LOOKS = re.compile(r"comparison(?:\.|, \")(?:tip_bound|axis_bound|unbounded|bounded_cuts)|blocks_without_bound|"
                   r"worst_tip_deviation_mm|(?<!certificate\"\])(?<!found)\[\"proved\"\]|\"proved: tip|startswith\(\"proved")
"""at the bound between the places where blocks are held to the file, or at what is said of it"""


def test_files_that_look_at_the_bound_have_it() -> None:
    """Without, most of what they say holds of anything."""
    looking = {file.name for room in UNBOUNDED for file in room.glob("test_*.py") if LOOKS.search(file.read_text("utf-8"))}
    assert len(looking) > 10 and looking - BOUNDED == set()
