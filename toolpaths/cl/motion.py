"""Records that move the tool: GOTO in its rarer spellings, GODLTA, FROM, GOHOME, RAPID, CIRCLE, MOVARC, TLAXIS."""

from __future__ import annotations

import math

from toolpaths.cl.build import NO_NUMBERS, ToolpathBuilder, Triple
from toolpaths.cl.frames import turn_back, use_world_axis
from toolpaths.cl.text.dialects import Planes
from toolpaths.cl.text.statements import Statement
from toolpaths.toolpath import Role

_NAN = math.nan
_CLOCKWISE = {"CLOCKWISE": -1, "CLW": -1, "COUNTERCLOCKWISE": 1, "CCLW": 1}
_NX_COUNT = 11
"""numbers of a CIRCLE of NX"""
_HALF_TURN = 1e-3
"""degrees"""


def _triple(numbers: list[float], at: int) -> Triple:
    if len(numbers) < at + 3:
        return NO_NUMBERS
    return numbers[at], numbers[at + 1], numbers[at + 2]


def goto(b: ToolpathBuilder, s: Statement) -> None:
    """A point of 3, 6 or 9 numbers; 2: z from ZSURF."""
    numbers = s.numbers
    if s.tail and s.tail != ("CONTACT",):
        b.log.error("cl.number", f"GOTO/{s.body[:60]}: {s.tail[0] or 'an empty field'} is not a number", b.line,
                    f"put commas between the numbers: GOTO/{s.body[:60].replace(';', ',')}" if ";" in s.body else
                    "GOTO takes 3, 6 or 9 numbers")
        return
    if len(numbers) == 2 and b.zsurf is not None:
        numbers = [*numbers, b.zsurf]
    if len(numbers) in (4, 7):
        b.log.error("cl.goto-feed", f"GOTO has {len(numbers)} numbers, it takes 3, 6 or 9: the last may be a feed, or a "
                    "comma or a blank splits a number", b.line, "state the feed by FEDRAT before the GOTO, "
                    "or write points for decimal commas: 10.25 for 10,25")
        return
    if len(numbers) not in (3, 6, 9):
        b.log.error("cl.goto", f"GOTO has {len(numbers)} numbers, it takes 3, 6 or 9", b.line,
                    "write GOTO/x,y,z, or with the tool axis GOTO/x,y,z,i,j,k")
        return
    if s.tail:
        b.contacts.append(b.row)
    b.add_point(_triple(numbers, 0), _triple(numbers, 3), _triple(numbers, 6))


def godlta(b: ToolpathBuilder, s: Statement) -> None:
    """A move by (dx, dy, dz), or by one number along the tool axis, away from the part where positive."""
    numbers = s.numbers
    if len(numbers) != len(s.words) or len(numbers) not in (1, 3, 6):
        b.log.error("cl.godlta", f"GODLTA/{s.body[:60]}: it takes 1, 3 or 6 numbers", b.line,
                    "write GODLTA/x,y,z, or GODLTA/d along the tool axis")
        return
    if b.row == 0:
        b.log.error("cl.godlta", "GODLTA before any point: there is nothing to move from", b.line,
                    "begin with FROM or GOTO")
        return
    b.deltas.append((b.row, (numbers[0], _NAN, _NAN) if len(numbers) == 1 else _triple(numbers, 0)))
    b.add_point(NO_NUMBERS, _triple(numbers, 3))


def from_(b: ToolpathBuilder, s: Statement) -> None:
    """Where the tool stands; a RAPID before it counts for the move after it."""
    numbers = s.numbers
    if len(numbers) not in (3, 6):
        b.log.error("cl.from", f"FROM/{s.body[:60]}: it takes 3 or 6 numbers", b.line,
                    "write FROM/x,y,z, or with the tool axis FROM/x,y,z,i,j,k")
        return
    waiting = bool(b.rapids) and b.rapids[-1] == b.row
    b.add_point(_triple(numbers, 0), _triple(numbers, 3), role=Role.START)
    if waiting:
        b.rapids.append(b.row)


def gohome(b: ToolpathBuilder, s: Statement) -> None:
    """A rapid to the point; without one, an event."""
    numbers = s.numbers
    if len(numbers) >= 3:
        b.rapids.append(b.row)
        b.add_point(_triple(numbers, 0), _triple(numbers, 3), role=Role.HOME)
    elif s.words[:1] == ("",):
        b.log.error("cl.from", f"GOHOME/{s.body[:60]}: its first number is missing", b.line,
                    "write GOHOME alone, or GOHOME/x,y,z")
    else:
        b.event("GOHOME", tuple(w for w in s.words if w != ""))


def rapid(b: ToolpathBuilder, s: Statement) -> None:
    """The next move is rapid."""
    b.rapids.append(b.row)
    if s.words:
        b.log.warning("cl.rapid-option", f"RAPID/{s.body}: the parameters are not used", b.line)


def tlaxis(b: ToolpathBuilder, s: Statement) -> None:
    """The tool axis of points of three numbers from here on. In `.clt` it is that in the part, whatever ROTABL says."""
    if len(s.numbers) != 3:
        b.log.error("cl.tlaxis", f"TLAXIS/{s.body}: only three numbers are understood", b.line,
                    "write TLAXIS/i,j,k")
    elif b.dialect.frame_turns:
        turn_back(b)
        b.world_axes.append((b.row, _triple(s.numbers, 0), b.line))
        use_world_axis(b)
    else:
        b.axis_marks.append((b.row, _triple(s.numbers, 0)))


def zsurf(b: ToolpathBuilder, s: Statement) -> None:
    """The height of points of two numbers from here on."""
    if len(s.words) == 1 and s.numbers:
        b.zsurf = s.numbers[0]
    else:
        b.log.error("cl.motion-word", f"ZSURF/{s.body}: only a single height is understood", b.line,
                    "write ZSURF/z, or have the CAM system write Z in each GOTO")


def circle(b: ToolpathBuilder, s: Statement) -> None:
    """An arc that ends in the very next GOTO."""
    b.arc_records += 1
    if not b.next_is_point():
        b.log.error("cl.circle-end", "CIRCLE is not followed by a GOTO, which gives its end", b.line,
                    "put the GOTO of the end behind CIRCLE")
        return
    numbers = _circle_numbers(s.numbers)
    if numbers is None:
        b.log.error("cl.circle", f"CIRCLE has {len(s.numbers)} numbers, it takes center, axis, radius (4, 6, 7 or 11)",
                    b.line, "write CIRCLE/ centre x,y,z, axis i,j,k, radius")
        return
    sweep = s.after("SWEEP")
    vector, sense = _axis_and_sense(b, s, numbers)
    b.arcs.add(b.row, numbers[:3] + vector, b.line, numbers[6], _turns(b, s), sense, _NAN if sweep is None else sweep)


def _turns(b: ToolpathBuilder, s: Statement) -> float:
    """The whole turns of TIMES, 0 without it."""
    times = s.after("TIMES")
    if s.has("TIMES") and (times is None or times < 0.0 or times != math.floor(times)):
        b.log.error("cl.circle-times", f"{s.major}/...{s.tail}: TIMES takes a whole number", b.line,
                    "write for example TIMES,2")
        return 0.0
    return times or 0.0


def _circle_numbers(n: list[float]) -> tuple[float, ...] | None:
    """(center, axis, radius) of 4, 6, 7 or more numbers; NaN where there is no radius."""
    if len(n) == 4:
        return (*n[:3], 0.0, 0.0, 1.0, n[3])
    if len(n) == 6:
        return (*n, _NAN)
    return tuple(n[:7]) if len(n) >= 7 else None


def _axis_and_sense(b: ToolpathBuilder, s: Statement,
                    numbers: tuple[float, ...]) -> tuple[tuple[float, ...], int]:
    for word in s.tail:
        if isinstance(word, str) and word in _CLOCKWISE:
            return (0.0, 0.0, 1.0), _CLOCKWISE[word]
    if b.dialect.eleven_clockwise and len(s.numbers) >= _NX_COUNT:
        return numbers[3:6], -1
    return numbers[3:6], b.dialect.arc_sense or 1


def movarc(b: ToolpathBuilder, s: Statement) -> None:
    """MOVARC/center, axis, radius, ANGLE, degrees, or MOVARC/CENTER, x, y, z, AXIS, i, j, k, RADIUS, r[,
    TIMES, n] with or without ANGLE; the next GOTO is its end."""
    b.arc_records += 1
    angle, numbers = s.after("ANGLE"), _labelled(s) if s.has("CENTER") else s.numbers
    if len(numbers) != 7 or (angle is None and not s.has("CENTER")):
        b.log.error("cl.circle", f"MOVARC/{s.body[:60]}: it takes center, axis, radius, ANGLE, degrees", b.line,
                    "write MOVARC/ centre x,y,z, axis i,j,k, radius, ANGLE, degrees")
    elif b.dialect.planes is Planes.OVER_BOTTOM and angle is not None and abs(abs(angle) - 180.0) < _HALF_TURN:
        b.log.error("cl.circle", f"MOVARC/...ANGLE, {angle:g}: this post does not determine the sense of half a turn",
                    b.line,
                    "write the file with the post Common ISO 4343 APT")
    elif not b.next_is_point():
        b.log.error("cl.circle-end", "MOVARC is not followed by a GOTO, which gives its end", b.line,
                    "put the GOTO of the end behind MOVARC")
    else:
        sweep = _NAN if angle is None else math.radians(abs(angle))
        b.arcs.add(b.row, tuple(numbers[:6]), b.line, numbers[6], _turns(b, s) if angle is None else 0.0,
                   -1 if angle is not None and angle < 0 else 1, sweep)


def _labelled(s: Statement) -> list[float]:
    """Center, axis and radius behind their words; fewer than 7 numbers where one is missing."""
    found: list[float] = []
    for word, count in (("CENTER", 3), ("AXIS", 3), ("RADIUS", 1)):
        at = s.words.index(word) + 1 if word in s.words else len(s.words)
        found += [w for w in s.words[at:at + count] if isinstance(w, float)]
    return found


HANDLERS = {"GOTO": goto, "GODLTA": godlta, "FROM": from_, "GOHOME": gohome, "RAPID": rapid, "TLAXIS": tlaxis,
            "ZSURF": zsurf, "CIRCLE": circle, "MOVARC": movarc}
