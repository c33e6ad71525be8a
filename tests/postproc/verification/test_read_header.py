"""The header of a program: what one place writes, the same place reads back, however a control changes its comments."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import wrap

import pytest

from postproc.base import header_words as words
from postproc.base.header_words import AxesNamed, ProgramHeader, SetupNamed, read_header, same_name, with_feeds_mark
from postproc.base.length_text import INCH
from postproc.base.options import Options
from postproc.controllers.model import load_controller
from postproc.writing.state import comment_room
from toolpaths.diagnostics import read_value

BEGIN = ["postproc 0.1.0", "part plate", "source plate.cls"]
STYLES: dict[str, Callable[[str], str]] = {
    "brackets": lambda line: f"({line})", "capitals": lambda line: f"({line.upper()})",
    "semicolons": lambda line: f"; {line}", "numbered": lambda line: f"12 ; {line}"}


def text(lines: list[str], style: str) -> bytes:
    return "\n".join([STYLES[style](line) for line in lines] + ["G0 X1.", ""]).encode()


@pytest.mark.parametrize("style", STYLES)
def test_every_line_is_read_back(style: str) -> None:
    lines = [*BEGIN, "tolerance 0.0005 mm, axis tolerance 0.05 degrees", words.feed_line("planned", 0.1),
             words.chosen_axes("per-pass", 60.0),
             words.setup_line("a b.toml", "0123abcd"), words.feeds_line(), words.corrected_here("mill.toml"),
             words.model_mark("89abcdef")]
    header = read_header(with_feeds_mark(text(lines, style).decode(), "00ff00ff").encode())
    assert header.corrected is not None and same_name(header.corrected, "mill.toml")
    assert header.setup is not None and same_name(header.setup.name, "a b.toml")
    assert header == ProgramHeader(True, header.corrected, "89abcdef", False, AxesNamed("per-pass", "60"),
                        SetupNamed(header.setup.name, "0123abcd"), 0.0005, True, "00ff00ff",
                        axis_tolerance=0.05)


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("mm", [0.01, 0.009, 0.0254, 0.00123456, 0.999999])
def test_lengths_in_inches_come_back_in_mm(style: str, mm: float) -> None:
    lines = [*Options(tolerance=mm, smoothing=0.00321, axis_tolerance=0.3).header(INCH)]
    assert lines[0].startswith(f"tolerance {mm / 25.4:.7g} inch, ")
    header = read_header(text([*BEGIN, *lines], style))
    assert header.tolerance == mm and header.smoothing == 0.00321 and header.axis_tolerance == 0.3


@pytest.mark.parametrize("style", STYLES)
def test_what_a_head_does_not_say_is_not_read(style: str) -> None:
    assert read_header(text(BEGIN, style)) == ProgramHeader(True, None, "", False, None, None, 0.0, False, "")
    assert read_header(text(["another post", "source x"], style)) == ProgramHeader(False, None, "", False, None,
                                                                        None, 0.0, False, "")
    more = [words.corrected_by_control("mill.toml"), words.setup_line("", ""), words.feeds_line()]
    header = read_header(text([*BEGIN, *more], style))
    assert header.by_control and header.corrected is None and header.feeds == "" and not header.planned
    assert header.setup is not None and (header.setup.name.lower(), header.setup.mark) == (words.NO_FILE, "")


LONG = "bracket for the rear axle of the small trailer, second clamping, revision 14.setup.toml"


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc", "heidenhain-tnc640", "siemens-840d", "linuxcnc"])
@pytest.mark.parametrize("name", [LONG, "x" * 130 + ".toml"])
def test_long_names_leave_the_marks_readable(controller: str, name: str) -> None:
    """Comments end where the block of the control does: names go on in the next one, the mark may be torn from its name."""
    spec = read_value(load_controller(controller))
    style = STYLES["brackets" if spec.comment.open == "(" else "semicolons"]
    room = comment_room(spec)
    for shift in range(12):
        lines = [*BEGIN, words.setup_line("a" * shift + name, "0123abcd"), words.corrected_here("e" * shift + name),
                 words.model_mark("89abcdef"), words.hooks_line("hooks.toml")]
        folded = [part for line in lines for part in (
            [line] if len(line) <= room else wrap(line, room, break_on_hyphens=False))]
        header = read_header("\n".join([style(line) for line in folded] + ["G0 X1.", ""]).encode())
        assert header.setup is not None and header.setup.mark == "0123abcd" and header.hooks == "hooks.toml"
        assert header.setup.name.replace(" ", "") == ("a" * shift + name).replace(" ", "")
        assert header.corrected is not None and header.model == "89abcdef" and not header.by_control
        line = words.corrected_by_control("e" * shift + name)
        folded = [style(part) for part in (*BEGIN, *wrap(line, room, break_on_hyphens=False))]
        header = read_header("\n".join([*folded, "G0 X1.", ""]).encode())
        assert header.by_control and header.corrected is None and header.setup is None


def test_only_the_place_in_the_head_is_filled() -> None:
    place = f"({words.feeds_line()})\n"
    assert with_feeds_mark(place + "G0 X1.\n" + place, "12345678").count("12345678") == 1
    assert with_feeds_mark("G0 X1.\n", "12345678") == "G0 X1.\n"
