"""What a CL file holds, as figures for people and for `postproc inspect --json`."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Literal

import numpy as np

from toolpaths.arrays import Bools, Floats
from toolpaths.cl.read import ReadResult
from toolpaths.cl.text.dialects import DIALECTS
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Frame, Kind, Role, Tool, Toolpath
from toolpaths.units import DEG

SAME_DIRECTION = 1e-6
"""rad"""
HALF_TURN = 1e-3
"""rad beyond 180 degrees that still count as half a turn; a whole turn may miss its end by rounding"""
TURNED = 1e-4
"""degrees below which a system stands as the part frame does"""
_LACKING = ("tools without a number (the set-up gives it: [tool_numbers])",
            "tools that cut without a spindle record (the set-up gives it: [tools.N] or [output] spindle)")
_TOOL_ANGLES = ("taper", "tip_angle")


def inspect(result: ReadResult) -> dict[str, object]:
    """The JSON form: lengths mm, angles degrees.

    `points` counts each commanded position once (not FROM, GOHOME), `arcs` the CIRCLE and other arc records,
    `cycles` the CYCLE records that name a kind, `rapids` the rapid moves; `arcs_over_180_deg` says whether the sense of the
    arcs fits the dialect: few arcs of a real path sweep more than half a turn (whole turns apart); `axis_motion` is
    fixed, indexed (between cuts only) or continuous, and `five_axis` is true unless it is fixed; `extents`
    are those of the commanded positions; `normals` counts the positions that give a surface normal (GOTO with nine numbers).
    """
    p = result.toolpath
    point = is_point(p)
    lengths = cutting_lengths(p)
    motion = axis_motion(p)
    return {
        "file": p.file, "name": p.name, "dialect": result.dialect, "evidence": result.evidence,
        "points": int(point.sum()), "rapids": int((point & (p.kind == Kind.RAPID) & (p.role != Role.HOLE)).sum()),
        "arcs": result.arc_records, "arcs_over_180_deg": over_half(p), "holes": int((p.role == Role.HOLE).sum()),
        "normals": 0 if p.normal is None else int(np.isfinite(p.normal).all(axis=1).sum()),
        "cycles": result.cycle_records,
        "operations": _operations(p, point, lengths), "tools": [tool_dict(t) for t in p.tools], **tools_lacking(p),
        "frames": [asdict(f) for f in p.frames], "units": p.units, "five_axis": motion != "fixed",
        "axis_motion": motion, "length_mm": float(lengths.sum()), "extents": extents(p),
        "unknown_words": dict(result.unknown_words), "records": asdict(p.records),
        "diagnostics": [d.as_dict() for d in result.diagnostics],
    }


def is_point(p: Toolpath) -> Bools:
    """True (N,) for positions that the program commands."""
    result: Bools = (p.role == Role.POINT) | (p.role == Role.HOLE)
    return result


def over_half(p: Toolpath) -> int:
    """Number of arcs that sweep more than 180 degrees beyond their whole turns."""
    return int((np.remainder(p.arcs.sweep, 2.0 * math.pi) > math.pi + HALF_TURN).sum())


def cutting_lengths(p: Toolpath) -> Floats:
    """Length (N,) mm of the cutting motion to each row, 0 for rapids; arcs and helices by their true length."""
    if not len(p):
        return np.zeros(0)
    length = np.append(0.0, np.linalg.norm(np.diff(p.tip, axis=0), axis=1))
    rows = np.flatnonzero(p.arc >= 0)
    if len(rows):
        k = p.arc[rows]
        rise = np.einsum("ki,ki->k", p.tip[rows] - p.tip[rows - 1], p.arcs.normal[k])
        length[rows] = np.hypot(p.arcs.radius[k] * p.arcs.sweep[k], rise)
    length[p.kind == Kind.RAPID] = 0.0
    return length


def axis_motion(p: Toolpath) -> Literal["fixed", "indexed", "continuous"]:
    """"fixed" (one direction), "indexed" (it changes in rapids and at holes only) or "continuous"."""
    if len(p) < 2:
        return "fixed"
    turned = angle_between(p.axis[1:], p.axis[:-1]) > SAME_DIRECTION
    if not turned.any():
        return "fixed"
    return "continuous" if bool((turned & (p.kind[1:] != Kind.RAPID)).any()) else "indexed"


def extents(p: Toolpath) -> dict[str, list[float]]:
    """Least and greatest x, y, z of all rows, mm; empty for no rows."""
    if not len(p):
        return {}
    low, high = p.tip.min(axis=0).tolist(), p.tip.max(axis=0).tolist()
    return {name: [low[i], high[i]] for i, name in enumerate("xyz")}


def tool_dict(tool: Tool) -> dict[str, object]:
    """What the file says of a tool, angles in degrees."""
    found = {key: value for key, value in asdict(tool).items() if value not in (None, "", ())}
    return {key: value / DEG if key in _TOOL_ANGLES else value for key, value in found.items()}


def tools_lacking(p: Toolpath) -> dict[str, list[str]]:
    """Tools that move without a number, and tools that cut before any record starts the spindle or after one
    has stopped it; "unnamed" where the file does not name them, T and the number where it numbers them."""
    moving = p.role != Role.START
    cuts = moving & ((p.kind != Kind.RAPID) | (p.cycle >= 0))
    number = np.array([t.number for t in p.tools] + [0])[p.tool]
    return {"tools_without_number": _called(p, moving & (number <= 0)),
            "tools_without_spindle": _called(p, cuts & ~_turning(p))}


def _called(p: Toolpath, rows: Bools) -> list[str]:
    """Names of the tools of some rows (N,), in order of use."""
    used, first = np.unique(p.tool[rows], return_index=True)
    tools = [p.tools[k] if k >= 0 else Tool(0) for k in used[np.argsort(first)].tolist()]
    return list(dict.fromkeys(t.name or (f"T{t.number}" if t.number > 0 else "unnamed") for t in tools))


def _turning(p: Toolpath) -> Bools:
    """(N,) True while a SPINDL record has the spindle turn."""
    said = [e for e in p.events if e.word == "SPINDL"]
    turns = np.array([False, *(not {"OFF", "NEUTRL", "NEUTRAL"} & set(map(str, e.values)) for e in said)])
    at = np.searchsorted(np.array([0, *(e.index for e in said)]), np.arange(len(p)), side="right") - 1
    result: Bools = turns[at]
    return result


def _operations(p: Toolpath, point: Bools, lengths: Floats) -> list[dict[str, object]]:
    count = len(p.operations)
    rows = np.bincount(p.operation, minlength=count)
    points = np.bincount(p.operation[point], minlength=count)
    length = np.bincount(p.operation, lengths, minlength=count)
    first = np.zeros(count, np.int64)
    used, at = np.unique(p.operation, return_index=True)
    first[used] = at
    return [{"name": op.name, "tool_name": op.tool_name, "line": op.line, "frame": p.frames[op.frame].name,
             "turning": op.turning, "points": int(points[i]), "length_mm": float(length[i]),
             "tool": _tool_number(p, int(first[i])) if rows[i] else None} for i, op in enumerate(p.operations)]


def _tool_number(p: Toolpath, row: int) -> int | None:
    return p.tools[p.tool[row]].number if p.tool[row] >= 0 else None


def summary(result: ReadResult) -> str:
    """The same for people, a few lines, without the diagnostics, which go to standard error."""
    p = result.toolpath
    found = inspect(result)
    title = DIALECTS[result.dialect].title
    lines = [f"{p.file or 'CL text'}: {title} ({result.evidence}), {p.units}, {result.lines} lines",
             f"  {found['points']} points ({found['rapids']} rapid, {found['arcs']} arcs, {found['holes']} holes of "
             f"{found['cycles']} cycles), {sum(lengths_of(p)):.1f} mm of cutting, tool axis {found['axis_motion']}"]
    lines.append(f"  {p.records}")
    if found["normals"]:
        lines.append(f"  surface normals at {found['normals']} points")
    if len(p.arcs):
        lines.append(f"  arc direction: {found['arcs_over_180_deg']} of {found['arcs']} arcs sweep more than 180 degrees")
    lines += [f"  {name} {low:.3f} to {high:.3f} mm" for name, (low, high) in extents(p).items()]
    lines += [f"  system {f.name}: {stands(f)}" for f in p.frames]
    lines += [f"  operation {op.name or i + 1}{' (turning)' if op.turning else ''}: "
              f"{int((p.operation == i).sum())} rows" for i, op in enumerate(p.operations)]
    lines += [f"  tool {t.number}{' ' + t.name if t.name else ''}{_size(t)}" for t in p.tools]
    lines += [f"  {title}: {', '.join(names)}" for title, names in zip(_LACKING, tools_lacking(p).values(), strict=True)
              if names]
    if result.unknown_words:
        lines.append("  unknown words: " + ", ".join(f"{w} ({n})" for w, n in result.unknown_words.items()))
    return "\n".join(lines)


def stands(frame: Frame) -> str:
    """Where a system stands in the part frame and how far it is turned there: the angle about the one axis
    that turns it (the trace of a rotation is 1 + 2 cos), and how far its z leans."""
    turned = math.degrees(math.acos(min(max((np.trace(frame.rotation) - 1.0) / 2.0, -1.0), 1.0)))
    lean = math.degrees(math.acos(min(max(frame.rotation[2][2], -1.0), 1.0)))
    place = ", ".join(f"{round(v, 4) + 0.0:g}" for v in frame.origin)
    how = f", rotation {turned:.2f} degrees, Z tilted {lean:.2f} degrees" if turned > TURNED else ""
    return f"origin ({place}) mm{how}"


def lengths_of(p: Toolpath) -> list[float]:
    """Cutting length per operation, mm."""
    result: list[float] = np.bincount(p.operation, cutting_lengths(p), minlength=len(p.operations)).tolist()
    return result


def _size(tool: Tool) -> str:
    if tool.diameter is None or not math.isfinite(tool.diameter):
        return ""
    corner = f", corner {tool.corner_radius:g}" if tool.corner_radius else ""
    return f": {tool.shape + ' ' if tool.shape else ''}diameter {tool.diameter:g}{corner} mm"
