"""Splines of the CL file that the control runs itself: the path with their pieces as cubics, not as arcs and chords."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from machines.machine import Machine
from postproc.base.options import Options
from postproc.controllers.model import ControllerFile
from toolpaths.choices import CubicPieces, ShopName
from toolpaths.cl.curves import SPLINE_SHARE
from toolpaths.cl.read import read_bytes
from toolpaths.diagnostics import Diagnostic, Severity, info, warning
from toolpaths.toolpath import Toolpath

_SHIFTED = ("CUTCOM",)
_BEFORE = rb"^[ \t/]*(?:N?\d+)?[ \t/]*(?:G\d+[ \t]+)*"
"""what stands before the word of such a block"""


def asked_splines(path: Toolpath, machine: Machine) -> bool:
    """True where a path has splines and the machine file says that the option to run them is fitted."""
    return machine.options.confirmed("splines") and path.spline_slack > 0.0


def never_cubics(path: Toolpath, machine: Machine, controller: ControllerFile, options: Options) -> Diagnostic | None:
    """Why no block runs a spline though it is asked for: the control has no word for it, points are not written as they
    stand, or radius compensation shifts them; None where blocks may."""
    rules, points = controller.splines, machine.options.control_points
    if points and rules.word and not rules.control_points:
        return warning("splines.no_word", "splines are written as arcs and chords: this controller file has no block for "
                       f"their control points, it has {rules.word}", file=path.file,
                       hint='state splines = "poly" under [control] of the machine file')
    if not rules.word:
        return warning("splines.no_word", "splines are written as arcs and chords: this controller file has no block for "
                       "them ([splines])", file=path.file,
                       hint="nothing is to be done: splines = false under [control] of the machine file leaves this out")
    reasons = {"with --smooth": options.smooth, "with an error model": bool(options.error_model),
               "with --feed planned": options.feed == "planned", "with inverse time": options.feed_mode == "inverse-time",
               "under CUTCOM": any(event.word in _SHIFTED for event in path.events)}
    why = next((name for name, holds in reasons.items() if holds), "")
    return info("splines.kept", f"splines are written as arcs and chords: {why} no block of the control runs them",
                file=path.file) if why else None


def held_splines(data: bytes, controller: ControllerFile) -> CubicPieces:
    """Which blocks that run cubics a program holds: their word behind what numbers and skips a block, and G codes; "" for
    none."""
    kinds: tuple[tuple[str, CubicPieces], ...] = ((controller.splines.control_points, "uniform"),
                                                  (controller.splines.word, "pieces"))
    return next((kind for word, kind in kinds if word and re.search(
        _BEFORE + re.escape(word.encode()) + rb"(?![A-Z0-9_])", data.upper(), re.MULTILINE)), "")


def held_near(data: bytes, others: Mapping[str, bytes], controller: ControllerFile) -> CubicPieces:
    """The same of a program, or of a subprogram in a file next to it whose name stands in its blocks."""
    if not controller.splines.word or (kind := held_splines(data, controller)):
        return kind if controller.splines.word else ""
    words = set(re.findall(rb"[A-Z0-9_]+", re.sub(rb";[^\n]*", b"", data.upper())))
    found = (held_splines(others[name], controller) for name in others if Path(name).stem.upper().encode() in words)
    return next((kind for kind in found if kind), "")


def with_cubics(path: Toolpath, options: Options, kind: CubicPieces) -> Toolpath:
    """The path as reading its file gives it with cubics of a kind; itself, with arcs and chords, where it comes from no
    file, was changed, or where the file is another one with these options."""
    source = path.source
    if source is None or not path.spline_slack or not kind:
        return path
    asked = source.dialect or None if source.plug_in is None else ShopName(source.plug_in.name)
    read = read_bytes(source.data, file=path.file, units=source.units or None, dialect=asked,
                      allow_unknown=options.allow_unknown, tolerance=path.spline_slack / SPLINE_SHARE, cubics=kind)
    return read.toolpath if len(read.toolpath.faults) == len(path.faults) else path


def as_arcs(path: Toolpath, found: tuple[Diagnostic, ...]) -> Diagnostic:
    """A warning that splines are arcs and chords after all, since `found` stands against them as blocks of the control."""
    why = next((d.message for d in found if d.severity is Severity.ERROR), "")
    return warning("splines.as_arcs", "splines are written as arcs and chords; as blocks of the control they were refused: "
                   f"{why}; nothing is to be done: the program is proved", file=path.file)
