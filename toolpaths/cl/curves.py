"""Curves that carry their own end: CATIA's arcs to a line or plane, NX splines."""

from __future__ import annotations

import math
import re

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.cl.biarcs import DENSER, FLAT, biarcs, plane_of
from toolpaths.cl.build import ToolpathBuilder, Triple
from toolpaths.cl.spline_chords import (
    DEGREE,
    chord_places,
    cubic_points,
    de_boor,
    knots_of,
    part_behind,
    places_of,
    spline_points,
    width_of,
)
from toolpaths.cl.text.statements import COMMENT, TEXT, Statement, Word, words_of
from toolpaths.cl.uniform_splines import FIT, equal_knots, uniform_spline
from toolpaths.toolpath import Role

SPLINE_CHORD = 0.001
"""mm: a spline is followed by arcs, or chords, no further from it than this where no tolerance is given"""
SPLINE_SHARE = 0.4
"""of the tolerance, else; what they may be off is no part of what the program may be off them (`Toolpath.spline_slack`)"""
_TURNS = 1.2
_LEAST_PLACES = 16
"""of a span, that arcs are compared at"""
_STANDS = 1e-6
"""of the largest speed along a spline: where it is less, its direction is not known"""
_GEOMETRY = re.compile(r"\b(CIRCLE|LINE|CYLNDR|POINT|PLANE)\s*/([^()]*)", re.IGNORECASE)
_TANGENT = re.compile(r"\)\s*,\s*TANTO\b", re.IGNORECASE)


def indirv(b: ToolpathBuilder, s: Statement) -> None:
    """INDIRV/i, j, k: the direction in which the next curve begins."""
    if len(s.numbers) != 3:
        b.log.error("cl.indirv", f"INDIRV/{s.body}: it takes three numbers", b.line,
                    "write INDIRV/i,j,k: the direction in which the arc starts")
        return
    b.toward = (s.numbers[0], s.numbers[1], s.numbers[2])


def indirp(b: ToolpathBuilder, s: Statement) -> None:
    """INDIRP/x, y, z: a point towards which the next curve begins."""
    start = b.last_point()
    if len(s.numbers) != 3 or start is None or math.isnan(start[0]):
        b.log.error("cl.indirv", f"INDIRP/{s.body}: it takes three numbers and a GOTO before it", b.line,
                    "write GOTO, then INDIRP/x,y,z: a point towards which the arc starts")
        return
    x, y, z = (v - w for v, w in zip(s.numbers, start, strict=True))
    b.toward = (x, y, z)


def tlon(b: ToolpathBuilder, s: Statement) -> None:
    """TLON,GOFWD/(CIRCLE/...),ON[,2,INTOF],(LINE/center, end) or /(CYLNDR/...),ON,(PLANE/...(POINT/end)), or
    of PostWorks (NCL) /(CIRCLE/CANON,center,axis,radius),ON|TANTO,(PLANE/a, b, c, d).

    Where the end is written out, counting crossings (2,INTOF) is not needed to find it.
    """
    b.arc_records += 1
    found = [(m[1].upper(), [w for w in words_of(m[2]) if isinstance(w, float)]) for m in _GEOMETRY.finditer(s.body)]
    arc, end = _arc_numbers(found), _end_of(found)
    if arc is not None and end is None:
        end = _end_on_plane(b, arc, found, _TANGENT.search(s.body) is not None)
    if arc is None or end is None:
        b.log.error("cl.circle", f"TLON,GOFWD/{s.body[:60]}: only arcs of CIRCLE to LINE and CYLNDR to PLANE through "
                    "POINT are understood", b.line,
                    "have the CAM system write arcs as points (GOTO) or as CIRCLE with numbers")
        return
    if b.toward is None:
        b.log.error("cl.indirv", "TLON,GOFWD without INDIRV: the direction of the arc is not known", b.line,
                    "put INDIRV/i,j,k before it")
        return
    b.arcs.toward[len(b.arcs.row)] = b.toward
    b.arcs.add(b.row, tuple(arc[:6]), b.line, arc[6])
    b.toward = None
    b.add_point(end)


_HELICAL = {"CENTER": 3, "INDIRV": 3, "AXIS": 3, "PITCH": 1, "RADIUS": 1, "ANGLE": 1, "HEIGHT": 1, "ROUND": 1, "END": 3}


def helical(b: ToolpathBuilder, s: Statement) -> None:
    """CATIA: HELICAL/CENTER, x, y, z, INDIRV, i, j, k, AXIS, i, j, k, PITCH, p, RADIUS, r, ANGLE, a, HEIGHT, h, ROUND, n,
    END, x, y, z: a helix that turns by h / p turns (by a degrees where it does not rise) and carries its end."""
    b.arc_records += 1
    found = _labelled(s.words)
    if {word: len(n) for word, n in found.items()} != _HELICAL:
        b.log.error("cl.circle", f"HELICAL/{s.body[:60]}: it takes " + ", ".join(_HELICAL) + " with their numbers", b.line,
                    "write all words with their numbers, or have the CAM system write points (GOTO)")
        return
    pitch, height = abs(found["PITCH"][0]), abs(found["HEIGHT"][0])
    sweep = 2.0 * math.pi * height / pitch if pitch > 0.0 and height > 0.0 else math.radians(abs(found["ANGLE"][0]))
    x, y, z = found["INDIRV"]
    b.arcs.toward[len(b.arcs.row)] = (x, y, z)
    b.arcs.add(b.row, (*found["CENTER"], *found["AXIS"]), b.line, found["RADIUS"][0], sweep=sweep)
    x, y, z = found["END"]
    b.add_point((x, y, z))


def _labelled(words: tuple[Word, ...]) -> dict[str, list[float]]:
    """The numbers behind each word."""
    found: dict[str, list[float]] = {}
    label = ""
    for word in words:
        if isinstance(word, str):
            label = word
        found.setdefault(label, []).extend([word] if isinstance(word, float) else [])
    return found


def _arc_numbers(found: list[tuple[str, list[float]]]) -> list[float] | None:
    """Center, axis, radius of the first CIRCLE (axis z) or CYLNDR."""
    for word, n in found:
        if word == "CIRCLE" and len(n) == 4:
            return [*n[:3], 0.0, 0.0, 1.0, n[3]]
        if word in ("CIRCLE", "CYLNDR") and len(n) == 7:
            return n
    return None


def _end_of(found: list[tuple[str, list[float]]]) -> Triple | None:
    """The far end of LINE, else the last POINT."""
    for word, n in found:
        if word == "LINE" and len(n) == 6:
            return n[3], n[4], n[5]
    ends = [n for word, n in found if word == "POINT" and len(n) == 3]
    return (ends[-1][0], ends[-1][1], ends[-1][2]) if ends else None


def _end_on_plane(b: ToolpathBuilder, arc: list[float], found: list[tuple[str, list[float]]],
                  tangent: bool) -> Triple | None:
    """End of an arc at the plane n . p = d: where the plane touches it, or crosses it through its centre.

    Of the two crossings it is the first one after the start in the direction of INDIRP.
    """
    planes = [n for word, n in found if word == "PLANE" and len(n) == 4]
    start = b.last_point()
    if not planes or b.toward is None or start is None or math.isnan(start[0]):
        return None
    center, axis, radius = np.array(arc[:3]), np.array(arc[3:6]), arc[6]
    normal = np.array(planes[0][:3])
    ray = normal if tangent else np.cross(axis, normal)
    size = float(np.linalg.norm(ray))
    if not size > 0.0:
        return None
    u = np.array(start) - center
    ray = ray * (radius / size)
    if tangent:
        ends = [ray]
    else:
        sense = 1.0 if float(np.cross(axis, u) @ np.array(b.toward)) >= 0.0 else -1.0
        ends = sorted((ray, -ray), key=lambda v: math.atan2(sense * float(np.cross(u, v) @ axis), float(u @ v))
                      % (2.0 * math.pi) or 2.0 * math.pi)
    height = float(u @ axis) / float(axis @ axis)
    x, y, z = (center + ends[0] + height * axis).tolist()
    return x, y, z


def nurbs(b: ToolpathBuilder, s: Statement) -> None:
    """NURBS, KNOT/values, CNTRL/x,y,z ...: a clamped cubic that begins at the current point.

    The knots written are the inner ones and the end; with the first point there are three more control points
    than knots (inferred from files, no document states it).
    """
    knots, control = _gather(b)
    start = b.last_point()
    if start is None or math.isnan(start[0]):
        b.log.error("cl.nurbs", "a spline needs a GOTO before it", b.line, "put a GOTO before the spline")
        return
    if b.rapids and b.rapids[-1] == b.row:
        b.log.error("cl.nurbs", "RAPID does not go with a spline", b.line, "put RAPID before a GOTO")
        return
    if len(control) != len(knots) + 2 or not knots:
        b.log.error("cl.nurbs", f"the spline has {len(knots)} knots and {len(control)} control points; a cubic has two "
                    "more points than knots", b.line, "have the CAM system write the curve as points (GOTO)")
        return
    inner = np.array(knots) / knots[-1] if knots[-1] > 0.0 else np.array([-1.0])
    if (np.diff(np.append(0.0, inner)) < 0.0).any():
        b.log.error("cl.nurbs", "the knots of the spline do not rise from 0", b.line,
                    "have the CAM system write the curve as points (GOTO)")
        return
    curve = np.array([start, *control])
    chord = b.spline_slack / b.scale
    b.splines += 1
    if b.cubics == "pieces" and _add_pieces(b, curve, inner, chord):
        return
    chords = spline_points(curve, inner, chord)
    if not len(chords):
        b.log.error("cl.nurbs", f"the spline takes more chords within {b.spline_slack:.3g} mm of it than are made of one",
                    b.line, "have the CAM system write the curve as points (GOTO), or allow a wider --tolerance")
        return
    arcs = spline_arcs(curve, inner, chord, b.splines - 1)
    pieces = arcs if 0 < len(arcs) < len(chords) else [(x, y, z, ()) for x, y, z in chords.tolist()]
    if b.cubics == "uniform" and _add_uniform(b, curve, inner, chord, len(pieces)):
        return
    for n, (x, y, z, arc) in enumerate(pieces, 1):
        if arc:
            b.arcs.toward[len(b.arcs.row)] = arc[7:]
            b.arcs.add(b.row, arc[:6], b.line, arc[6])
        if n < len(pieces):
            b.add_point((x, y, z), role=Role.SPLINE)
    b.add_point(control[-1])


def _add_pieces(b: ToolpathBuilder, curve: Floats, inner: Floats, chord: float) -> bool:
    """The spline piece by piece, or within the tolerance as one of fewer pieces; False where neither goes."""
    count = len(np.unique(inner))
    fewer = uniform_spline(curve, inner, FIT * chord, count + DEGREE - 1) if count > 1 else curve[:0]
    if len(fewer) and _add_cubics(b, fewer, equal_knots(len(fewer) - DEGREE), (1.0 - FIT) * chord):
        return True
    return _add_cubics(b, curve, inner, chord)


def _add_uniform(b: ToolpathBuilder, curve: Floats, inner: Floats, chord: float, most: int) -> bool:
    """The spline as a cubic with equal knots, of fewer than `most` control points behind the first; behind another one its
    first chord stands between them, so that the control takes them for two. False where that does not go."""
    begin: Floats | None = None
    if b.uniform_end == b.row:
        at = chord_places(curve, inner, chord)
        if len(at) < 3:
            return False
        curve, inner = part_behind(curve, inner, float(at[1]))
        begin = curve[0]
    found = uniform_spline(curve, inner, FIT * chord, most - (begin is not None))
    if not len(found) or not _add_cubics(b, found, equal_knots(len(found) - DEGREE), (1.0 - FIT) * chord, begin):
        return False
    b.uniform_end = b.row
    return True


def _add_cubics(b: ToolpathBuilder, curve: Floats, inner: Floats, chord: float, begin: Floats | None = None) -> bool:
    """The spline piece by piece, each by chords at equal steps of its parameter, as many as a power of two; False, and
    nothing is added, where it turns back between two knots: there steps of its parameter stand nearly still. `begin`
    (3,): a point before it."""
    points, last = cubic_points(curve, inner, chord, b.cubics == "uniform")
    if not len(points):
        return False
    along = np.diff(points, axis=0, prepend=curve[:1])
    turn = np.arctan2(np.linalg.norm(np.cross(along[:-1], along[1:]), axis=1), (along[:-1] * along[1:]).sum(axis=1))
    if (turn[~last[:-1]] > _TURNS).any():
        return False
    if begin is not None:
        b.add_point((float(begin[0]), float(begin[1]), float(begin[2])), role=Role.SPLINE)
    for point, ends in zip(points[:-1].tolist(), last[:-1].tolist(), strict=True):
        b.add_point((point[0], point[1], point[2]), role=Role.SPLINE if ends else Role.CUBIC)
    x, y, z = curve[-1].tolist()
    b.add_point((x, y, z))
    return True


def _gather(b: ToolpathBuilder) -> tuple[list[float], list[Triple]]:
    """Knots and control points of the KNOT and CNTRL records that follow, knots also on lines of their own; passes them."""
    knots: list[float] = []
    control: list[Triple] = []
    statements, last = b.program.statements, ""
    while b.index + 1 < b.stop and b.program.before[b.index + 1] == b.fast:
        s = statements[b.index + 1]
        n = s.numbers
        major = "KNOT" if s.major == TEXT and last == "KNOT" and n and len(n) == len(s.words) else s.major
        if major not in ("KNOT", "CNTRL", COMMENT):
            break
        b.index += 1
        b.taken.add(b.index)
        last = last if major == COMMENT else major
        if major == COMMENT:
            continue
        if major == "KNOT":
            knots += n
        elif len(n) == 3:
            control.append((n[0], n[1], n[2]))
        else:
            b.log.error("cl.nurbs", f"CNTRL has {len(n)} numbers, it takes 3", b.program.lines[b.index],
                        "write CNTRL/x,y,z")
    return knots, control


def spline_arcs(control: Floats, inner: Floats, chord: float,
                before: int = 0) -> list[tuple[float, float, float, tuple[float, ...]]]:
    """Ends of arcs and lines within `chord` of a clamped cubic in a plane (`spline_points`), each with its arc: centre,
    axis, radius, direction in which it begins, or () for a line; [] where it lies in no plane, has a corner or turns
    back. `before`: splines of the file so far."""
    plane = plane_of(control, FLAT * chord)
    knots = knots_of(inner)
    if plane is None or (np.unique(inner[:-1], return_counts=True)[1] >= DEGREE).any():
        return []
    u, v, normal = plane
    flat = (control - control[0]) @ np.stack([u, v], axis=1)
    at = places_of(control, knots, chord / DENSER**2, _LEAST_PLACES)
    if not len(at):
        return []
    points = np.concatenate([flat[:1], de_boor(flat, knots, at, DEGREE)])
    slope = DEGREE * np.diff(flat, axis=0) / width_of(knots, len(flat), DEGREE)[:, None]
    tangent = de_boor(slope, knots[1:-1], np.append(0.0, at), DEGREE - 1)
    size = np.linalg.norm(tangent, axis=1)
    if not size.min() > _STANDS * size.max():
        return []
    result: list[tuple[float, float, float, tuple[float, ...]]] = []
    begin = np.zeros(2)
    for x, y, cx, cy, turn in biarcs(points, tangent / size[:, None], chord, before).tolist():
        end, out = control[0] + x * u + y * v, begin - (cx, cy)
        arc: tuple[float, ...] = ()
        if turn:
            arc = (*(control[0] + cx * u + cy * v).tolist(), *normal.tolist(), float(np.linalg.norm(out)),
                   *(math.copysign(1.0, turn) * (out[0] * v - out[1] * u)).tolist())
        result.append((*end.tolist(), arc))
        begin = np.array([x, y])
    return result


HANDLERS = {"INDIRV": indirv, "INDIRP": indirp, "TLON,GOFWD": tlon, "HELICAL": helical, "NURBS": nurbs}
