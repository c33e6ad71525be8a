"""The header of a program: what one place writes, the same place reads back, however a control changes its comments."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from postproc.base import header_words as words
from postproc.base.header_words import AxesNamed, ProgramHeader, SetupNamed, read_header, same_name, with_feeds_mark

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
                        SetupNamed(header.setup.name, "0123abcd"), 0.0005, True, "00ff00ff")


@pytest.mark.parametrize("style", STYLES)
def test_what_a_head_does_not_say_is_not_read(style: str) -> None:
    assert read_header(text(BEGIN, style)) == ProgramHeader(True, None, "", False, None, None, 0.0, False, "")
    assert read_header(text(["another post", "source x"], style)) == ProgramHeader(False, None, "", False, None,
                                                                        None, 0.0, False, "")
    more = [words.corrected_by_control("mill.toml"), words.setup_line("", ""), words.feeds_line()]
    header = read_header(text([*BEGIN, *more], style))
    assert header.by_control and header.corrected is None and header.feeds == "" and not header.planned
    assert header.setup is not None and (header.setup.name.lower(), header.setup.mark) == (words.NO_FILE, "")


def test_only_the_place_in_the_head_is_filled() -> None:
    place = f"({words.feeds_line()})\n"
    assert with_feeds_mark(place + "G0 X1.\n" + place, "12345678").count("12345678") == 1
    assert with_feeds_mark("G0 X1.\n", "12345678") == "G0 X1.\n"
