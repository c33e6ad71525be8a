"""The lines of a program's header that `verify` decides by: one place writes them, one reads them back (`read_header`).

Controls change comments: capitals, accents, brackets. What is read is looked for without regard to case.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from postproc.base.length_text import SAID, LengthText
from toolpaths.dataclass import dataclass
from toolpaths.pattern import pattern
from toolpaths.units import MM_PER_INCH

NO_FILE = "without a file"
"""in the place of a file's name where a set-up came without one"""
SETUP_MARK = "fingerprint of the set-up"
"""before the eight hex digits of the set-up"""

HOOKS = "blocks of the shop:"
"""before the name of their file"""

FINGERPRINT = "fingerprint of the geometric errors"
"""before the eight hex digits of the error model that a program was written with"""
FEEDS = "fingerprint of the planned feeds"
"""before the eight hex digits of the F words"""
PENDING = "proof pending"
"""the line that says what is proved, while the program is written (`verification/proof_text.py`)"""
LENGTHS_PENDING = "length at the machine pending"
"""ends the line of each tool that says by how much its length may differ, while the program is written"""
UNKNOWN = "--------"
"""in their place while the program is written"""
HEADER, BEGIN = 40_000, 4000
"""characters of a program that hold its header, with a line for each of many places and tools; that hold its first line"""
_FIRST = pattern(rb"(?im)^[ \tN\d]*[(;][ \t]*postproc \d")
_COMMENT = pattern(rb"(?i)[ \t]*(?:N?\d+[ \t]*)?(?:\([^()\n]*\)|;[^\n]*)?[ \t]*(?:\n|\Z)")


def header_of(data: bytes) -> bytes:
    """The comments in the header of a program, from the one that names postproc to the first block; comments of
    the CL file stand behind that. Where nothing names postproc, the first characters as they are."""
    text = data[:HEADER].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    first = _FIRST.search(text, 0, BEGIN)
    if first is None:
        return text[:BEGIN]
    at = first.start()
    while at < len(text) and (line := _COMMENT.match(text, at)) is not None:
        at = line.end()
    return text[first.start():at]


def corrected_here(model: str) -> str:
    """That the program corrects geometric errors by itself."""
    return f"geometric errors {model}: corrected in this program; the control must not correct them again"


def corrected_by_control(model: str) -> str:
    """That the program leaves geometric errors to the control."""
    return f"geometric errors {model}: corrected by the control, not in this program"


def model_mark(mark: str) -> str:
    """The fingerprint of the errors that the program corrects."""
    return f"{FINGERPRINT} {mark}"


def chosen_axes(plan: str, max_tilt: float) -> str:
    """That tool axes are others than those of the CL file."""
    return f"tool axes chosen: orient {plan}, max tilt {max_tilt:g} degrees"


def setup_line(name: str, mark: str) -> str:
    """The set-up by its file's name and its fingerprint, either of which may be empty."""
    return f"setup {name or NO_FILE}{f', {SETUP_MARK} {mark}' if mark else ''}"


def hooks_line(name: str) -> str:
    """The file of the shop's own blocks that was given besides the set-up."""
    return f"{HOOKS} {name}"


def feed_line(source: str, merged: float) -> str:
    """Where F words come from, and the part by which they may be lowered to share one."""
    return f"feed {source}, merged within {100.0 * merged:g} %"


def smoothing_line(mm: float, said: LengthText) -> str:
    """What the control's own smoothing may take, where that is not as the controller file has it."""
    return f"control's smoothing {said.exactly(mm)}"


def feeds_line() -> str:
    """The place of the fingerprint of planned feeds (`with_feeds_mark`)."""
    return f"{FEEDS} {UNKNOWN}"


class SetupNamed(NamedTuple):
    """The set-up that a header names; "" for a mark that it does not state."""

    name: str
    mark: str


class AxesNamed(NamedTuple):
    """The plan of tool axes that a header names, in small letters."""

    plan: str
    max_tilt: str


@dataclass(frozen=True)
class ProgramHeader:
    """What the header of a program says.

    Attributes:
        ours: True where postproc wrote it
        corrected: name of the error model that the program corrects ("" without a name), None where it corrects none
        model: fingerprint of that model, "" where none is stated
        by_control: True where it leaves geometric errors to the control
        axes: None where those of the CL file are kept
        setup: None where it names none
        tolerance: mm that the program was converted with, 0 where none is stated
        axis_tolerance: degrees, the same of the tool axis
        planned: True where its feeds were planned
        feeds: fingerprint of its F words, "" where none is stated
        hooks: name of the file of the shop's own blocks, "" where none is named
        smoothing: mm that the control's own smoothing may take, 0 where it is as the controller file has it
    """

    ours: bool
    corrected: str | None
    model: str
    by_control: bool
    axes: AxesNamed | None
    setup: SetupNamed | None
    tolerance: float
    planned: bool
    feeds: str
    hooks: str = ""
    smoothing: float = 0.0
    axis_tolerance: float = 0.0


_GAP = rb"(?:[ \t]+|[ \t]*\)?[ \t]*\n[ \t]*(?:N?\d+[ \t]*)?[(;][ \t]*)"
"""between two words: the end of a comment too, where a line that is longer than a block goes on in the next"""
_FOLD = pattern(_GAP)
_BEGINS = rb"(?im)^[ \t(;\dN]*"


def _spaced(text: str) -> bytes:
    """A pattern of words, wherever the line is folded."""
    return _GAP.join(re.escape(word).encode("ascii") for word in text.split())


_NAME = rb"([\s\S]{0,500}?)"
"""a name, in one line or several"""
_CORRECTED = pattern(rb"(?im)^[^\n]*geometric errors ([^\n]*?):? corrected in this program")
_MODEL = pattern(rb"(?im)^[^\n]*" + FINGERPRINT.encode("ascii") + rb" ([0-9a-f]{8})\b")
_BY_CONTROL = pattern(rb"(?im)^[^\n]*geometric errors [^\n]*corrected by the control")
_AXES = pattern(rb"(?im)^[^\n]*tool axes chosen: orient ([a-z-]+), max tilt ([^ \n]+) degrees")
_CORRECTED_FOLDED = pattern(_BEGINS + _spaced("geometric errors") + _GAP + _NAME + rb":?" + _GAP +
                            _spaced("corrected in this program"))
_BY_CONTROL_FOLDED = pattern(_BEGINS + _spaced("geometric errors") + _GAP + _NAME + rb":?" + _GAP +
                             _spaced("corrected by the control"))
_SETUP_FOLDED = pattern(_BEGINS + b"setup" + _GAP + _NAME + b"," + _GAP + _spaced(SETUP_MARK) + _GAP +
                        rb"([0-9a-f]{8})\b")
_HOOKS = pattern(_BEGINS + _spaced(HOOKS) + _GAP + rb"([^\n]*)")
_SETUP = pattern(rb"(?im)^[ \t(;\dN]*setup ([^\n]*?)(?:, " + SETUP_MARK.encode("ascii") + rb" ([0-9a-f]{8})\b|$)")
_OURS = pattern(rb"(?im)^[^\n]*postproc \d+\.\d[^\n]*\n(?:[^\n]*part [^\n]*\n)?[^\n]*source ")
_TOLERANCE = pattern(rb"(?im)^[ \t(;\dN]*tolerance (\d[\d.e-]*) (mm|inch)\b")
_AXIS_TOLERANCE = pattern(_BEGINS + rb"tolerance [^\n]*," + _GAP + _spaced("axis tolerance") + _GAP + rb"(\d[\d.e-]*)"
                          + _GAP + rb"degrees\b")
_SMOOTHING = pattern(rb"(?im)^[ \t(;\dN]*control.{0,3}s smoothing (\d[\d.e-]*) (mm|inch)\b")
_PLANNED = pattern(rb"(?im)^[ \t(;\d]*feed planned")
_FEEDS = pattern(rb"(?im)^[^\n]*" + FEEDS.encode("ascii") + rb" ([0-9a-f]{8})\b")
_PLACE = pattern(f"(?i){FEEDS} {UNKNOWN}")


def read_header(data: bytes) -> ProgramHeader:
    """The header of a program as values; data may be the whole program."""
    header = header_of(data)
    axes, setup = _AXES.search(header), _SETUP_FOLDED.search(header) or _SETUP.search(header)
    by_control = _BY_CONTROL.search(header) or _BY_CONTROL_FOLDED.search(header)
    named = _CORRECTED.search(header) or (None if by_control else _CORRECTED_FOLDED.search(header))
    hooks = _HOOKS.search(header)
    tolerance, smoothing, axis = _TOLERANCE.search(header), _SMOOTHING.search(header), _AXIS_TOLERANCE.search(header)
    marks = [found[1].decode("ascii").lower() if (found := mark.search(header)) else "" for mark in (_MODEL, _FEEDS)]
    return ProgramHeader(
        ours=_OURS.search(header) is not None, by_control=by_control is not None,
        corrected=_unfolded(named[1]) if named else None, model=marks[0],
        axes=AxesNamed(*(text.decode("ascii", "replace").lower() for text in axes.groups())) if axes else None,
        setup=_named(setup) if setup else None, tolerance=_mm(tolerance),
        planned=_PLANNED.search(header) is not None, feeds=marks[1],
        hooks=hooks[1].decode("utf-8", "replace").strip().removesuffix(")") if hooks else "",
        smoothing=_mm(smoothing), axis_tolerance=float(axis[1]) if axis else 0.0)


def _mm(said: re.Match[bytes] | None) -> float:
    """mm of a length as `LengthText.exactly` says it, 0 where none is said."""
    if said is None:
        return 0.0
    return float(f"{float(said[1]) * (1.0 if said[2].lower() == b'mm' else MM_PER_INCH):.{SAID}g}")


def _unfolded(name: bytes) -> str:
    """A name of one line or several, in one."""
    return _FOLD.sub(b" ", name).decode("utf-8", "replace")


def _named(setup: re.Match[bytes]) -> SetupNamed:
    """The set-up of a line; the bracket that ends a comment is no part of its name."""
    name, mark = _unfolded(setup[1]).strip(), (setup[2] or b"").decode("ascii").lower()
    in_brackets = setup[0].lstrip(b" \tN0123456789").startswith(b"(")
    return SetupNamed(name if mark or not in_brackets else name.removesuffix(")"), mark)


def with_feeds_mark(text: str, mark: str) -> str:
    """The text of a program with the fingerprint of its F words in the place that the header has left for it."""
    place = _PLACE.search(text, 0, HEADER)
    return text if place is None else text[:place.end() - len(UNKNOWN)] + mark + text[place.end():]


def feeds_place(text: str) -> bool:
    """Whether the header of a program has left a place for the fingerprint of its F words."""
    return _PLACE.search(text, 0, HEADER) is not None


def same_name(one: str, other: str) -> bool:
    """Whether names are the same but for what the comments of some controls change of them."""
    return _as_in_comments(one) == _as_in_comments(other)


def _as_in_comments(name: str) -> str:
    """A name without capitals, accents, brackets."""
    return re.sub(r"[^a-z0-9]+", " ", name.lower())
