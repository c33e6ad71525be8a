"""Diagnostics for people: one line per cause, what to do first in front."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toolpaths.diagnostics import Diagnostic, Severity

ALIKE = 4
"""diagnostics of one code and one remedy up to which each is shown"""
PLACED = frozenset({"travel.exceeded", "reach.axis", "reach.position", "link.blocked", "link.home", "path.jump"})
"""codes whose remedy is that of `place.found`, where that is said"""
_MOVE, _SHORTER = "move the part in the set-up (part.origin)", "use a shorter tool (gauge_length)"
_LOWER = "lower clearance.distance", "put clearance.centre nearer to the part", "lower clearance.margin"
"""LOWER of postproc.setup.model, which a refusal need not load"""
WITHOUT_MOVE = {_MOVE: "", f"{_MOVE}, or {_SHORTER}": _SHORTER, **{f"{_MOVE}, or {one}": one for one in _LOWER},
                **{f"{_MOVE}, turn it, or {one}": one for one in _LOWER},
                **{f"{_MOVE}, {one}, or {_SHORTER}": f"{one}, or {_SHORTER}" for one in _LOWER}}
"""remedies of travel and reach, and what is left of each where no place of the part fits"""
FOLLOWS = {"cl.no-feed": ("feed.missing", "cl.feed", "convert.turning"), "cl.no-units": ("cl.empty", "convert.turning"),
           "cl.rapid-below": ("cl.cycle-depth",),
           "setup.tool_unused": ("tool.number",),
           "joints.chosen": ("travel.exceeded", "reach.axis", "path.odd_record"),
           **dict.fromkeys(PLACED | {"place.found"}, ("path.odd_record", "cl.units"))}
"""by code: its causes; where one of them is an error, people read that alone"""
CAUSES = {"setup.machine": PLACED, "setup.upside_down": PLACED, "cl.no-units": PLACED}
"""by code of a warning: errors that it may be the cause of; where one of them is said, it stands before them"""
UNREAD = frozenset({"cl.form", "cl.continuation"})
"""codes of records that cannot be read: what else is said of the same records follows from them"""


def lines_of(diagnostics: tuple[Diagnostic, ...], least: Severity) -> list[str]:
    """Diagnostics for people: of many with one code and one remedy the first, and where the others are; of one
    wrong number one line. Where there are errors they come first, before them alone what may be their cause, and what only
    follows from another is left out. JSON has them all, in the order of the stages."""
    from dataclasses import replace

    from toolpaths.diagnostics import Severity, has_errors

    if has_errors(diagnostics):
        codes = {d.code for d in diagnostics if d.severity is Severity.ERROR}
        unread = {(d.file, line) for d in diagnostics if d.code in UNREAD for line in d.lines}
        diagnostics = tuple(sorted((d for d in diagnostics if codes.isdisjoint(FOLLOWS.get(d.code, ()))
                                    and not _of_unread(d, unread)),
                                   key=lambda d: (codes.isdisjoint(CAUSES.get(d.code, ())) or d.severity < Severity.WARNING,
                                                  -d.severity)))
        if least <= Severity.INFO and any(d.code == "place.found" and "[part]" in d.hint for d in diagnostics):
            diagnostics = tuple(replace(d, hint="") if d.code in PLACED and "system =" not in d.hint else d
                                for d in diagnostics)
        elif any(d.code == "place.found" for d in diagnostics):
            diagnostics = tuple(replace(d, hint=WITHOUT_MOVE.get(d.hint, d.hint)) for d in diagnostics)
    groups: dict[tuple[Severity, str, str], list[Diagnostic]] = {}
    for d in diagnostics:
        if d.severity >= least:
            groups.setdefault((d.severity, d.code, d.hint), []).append(d)
    shown: list[str] = []
    said: set[tuple[Severity, str, str]] = set()
    for d in diagnostics:
        key = d.severity, d.code, d.hint
        group = groups.get(key, [])
        if len(group) <= ALIKE:
            shown += [str(d)] if d.severity >= least else []
        elif key not in said:
            said.add(key)
            lines = sorted({line for one in group[1:] for line in one.lines})
            where = f", lines {', '.join(map(str, lines[:6]))}{', ...' if len(lines) > 6 else ''}" if lines else ""
            shown += [str(d), f"  and {len(group) - 1} more [{d.code}]{where}: --json names them all"]
    return shown


def _of_unread(d: Diagnostic, unread: set[tuple[str, int]]) -> bool:
    """True where a diagnostic is of records alone that cannot be read; a warning where the record that it quotes is one."""
    from toolpaths.diagnostics import Severity

    lines = d.lines if d.severity is Severity.ERROR else d.lines[:1]
    return d.code not in UNREAD and bool(lines) and all((d.file, line) in unread for line in lines)
