"""Splines of the CL file that the control runs itself: the path with their pieces as cubics, not as arcs and chords."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from machines.machine import Machine
from postproc.base.options import Options
from postproc.controllers.model import ControllerFile
from toolpaths.choices import ShopName
from toolpaths.cl.curves import SPLINE_SHARE
from toolpaths.cl.read import read_bytes
from toolpaths.diagnostics import Diagnostic, Severity, warning
from toolpaths.toolpath import Toolpath

_SHIFTED = ("CUTCOM",)
_BEFORE = rb"^[ \t/]*(?:N?\d+)?[ \t/]*(?:G\d+[ \t]+)*"
"""what stands before the word of such a block"""


def asked_splines(path: Toolpath, machine: Machine, controller: ControllerFile, options: Options) -> bool:
    """True where splines of a path may be written as cubics: the machine file says that the option is fitted, points are
    written as they stand, and no radius compensation shifts them."""
    if not machine.options.confirmed("splines") or not controller.splines.word or not path.spline_slack:
        return False
    return not (options.smooth or options.error_model or options.feed == "planned" or options.feed_mode == "inverse-time"
                or any(event.word in _SHIFTED for event in path.events))


def held_splines(data: bytes, controller: ControllerFile) -> bool:
    """True where a program holds blocks that run a cubic: their word behind what numbers and skips a block, and G codes."""
    word = controller.splines.word.encode()
    return bool(word) and re.search(_BEFORE + re.escape(word) + rb"(?![A-Z0-9_])", data.upper(), re.MULTILINE) is not None


def held_near(data: bytes, others: Mapping[str, bytes], controller: ControllerFile) -> bool:
    """True where a program, or a subprogram in a file next to it whose name stands in its blocks, holds such blocks."""
    if not controller.splines.word or held_splines(data, controller):
        return bool(controller.splines.word)
    words = set(re.findall(rb"[A-Z0-9_]+", re.sub(rb";[^\n]*", b"", data.upper())))
    return any(Path(name).stem.upper().encode() in words and held_splines(others[name], controller) for name in others)


def with_cubics(path: Toolpath, options: Options) -> Toolpath:
    """The path as reading its file gives it with cubics; itself, with arcs and chords, where it comes from no file, was
    changed, or where the file is another one with these options."""
    source = path.source
    if source is None or not path.spline_slack:
        return path
    asked = source.dialect or None if source.plug_in is None else ShopName(source.plug_in.name)
    read = read_bytes(source.data, file=path.file, units=source.units or None, dialect=asked,
                      allow_unknown=options.allow_unknown, tolerance=path.spline_slack / SPLINE_SHARE, cubics=True)
    return read.toolpath if len(read.toolpath.faults) == len(path.faults) else path


def as_arcs(path: Toolpath, found: tuple[Diagnostic, ...]) -> Diagnostic:
    """A warning that splines are arcs and chords after all, since `found` stands against them as blocks of the control."""
    why = next((d.message for d in found if d.severity is Severity.ERROR), "")
    return warning("splines.as_arcs", "splines are written as arcs and chords; as blocks of the control they were refused: "
                   f"{why}; nothing is to be done: the program is proved", file=path.file)
