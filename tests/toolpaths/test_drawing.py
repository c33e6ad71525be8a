"""Sheets of drawings: the same bytes every time, names as they stand, two formats."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from toolpaths.drawing import FORMATS, TITLE, image, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def fill(sheet: Figure) -> None:
    """Panels whose arrangement the solver of the layout has to find, its last digits other from run to run."""
    for place in sheet.subplots(4, 1):
        place.plot([0.0, 1.0, 2.0], [0.1, 0.7, 0.3], label="$a_b$")
        place.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        place.set_ylabel("<y> & co")


@pytest.mark.parametrize("ending", FORMATS)
def test_sheets_repeat(ending: str) -> None:
    assert len({image((6.0, 7.0), "a sheet", fill, ending) for _ in range(2)}) == 1


def test_panels_stand_on_rounded_places() -> None:
    """Names in an SVG follow from them, and the solver's last digits differ from run to run."""
    kept: list[Figure] = []
    image((6.0, 7.0), "a sheet", lambda sheet: (fill(sheet), kept.append(sheet))[0], ".svg")
    bounds = [value for place in kept[0].axes for value in place.get_position(original=True).bounds]
    assert bounds == pytest.approx([round(value, 4) for value in bounds], abs=1e-14) and len(bounds) == 16


def test_svg_holds_text_as_it_stands_and_no_date() -> None:
    drawn = image((6.0, 7.0), "t$1$ <b>", fill, ".svg")
    assert b"t$1$ &lt;b&gt;" in drawn and b"$a_b$" in drawn and b"dc:date" not in drawn


def test_other_formats_are_refused() -> None:
    with pytest.raises(ValueError, match=r"no figure format '\.pdf'; known: \.png, \.svg"):
        image((6.0, 7.0), "t", fill, ".pdf")


def test_plain_text_is_one_short_line() -> None:
    assert plain("a\nb\x00c") == "a\N{REPLACEMENT CHARACTER}b\N{REPLACEMENT CHARACTER}c"
    assert plain("_hidden") == " _hidden" and len(plain("x" * 200)) == TITLE


def test_importing_draws_nothing_in() -> None:
    code = "import sys, toolpaths.drawing; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
