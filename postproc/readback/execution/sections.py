"""The blocks of one law: ends carried from block to block, cycles leg by leg, arcs with their centres."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from postproc.control.word_arcs import PLANE_AXIS
from postproc.readback.execution.arcs import centres, whole_turns
from postproc.readback.execution.cubics import with_curves
from postproc.readback.execution.drilling import spell_holes
from postproc.readback.execution.frames import ExecutionFrame
from postproc.readback.execution.rows import BlockSection, MotionRows, SectionState
from postproc.readback.execution.tool_radius import with_radius
from postproc.readback.text.canonical import COOLANT, LOADED, REST, STATEMENT, Canonical
from postproc.readback.text.cycles import CycleLeg
from postproc.readback.text.modal import CYCLES
from toolpaths.arrays import Bools, Floats, Ints, among, distinct, repeated, shared
from toolpaths.diagnostics import Diagnostic, error

if TYPE_CHECKING:
    from postproc.readback.execution.offsets import Offsets

_STILL = 1e-6
"""degrees"""
_OTHERS = f"MST{COOLANT}{LOADED}{REST}{STATEMENT}"
_PART = 100_000
"""blocks that are run together, where nothing asks for what came long before"""


def run_section(section: BlockSection, frame: ExecutionFrame, number: int, position: Floats, code: Canonical,
                offsets: Offsets,
                file: str, found: list[Diagnostic]) -> MotionRows:
    """Rows of the blocks of one law, begun at machine position (J,)."""
    start, moving = frame.coordinates(position[None, :])[0], _moving(section)
    _refused(section, frame, moving, code.line, file, found)
    cycles = bool((moving & among(section.motion, CYCLES)).any() or np.isfinite(section.call).any())
    size = len(moving) if cycles or section.has_steps or section.radius.any() or len(code.splines) else _PART
    parts: list[MotionRows] = []
    for first in range(0, len(moving), size):
        part = slice(first, first + size)
        rows, start = _rows(section.cut(first, first + size), frame, number, start, moving[part], code,
                            offsets, file, found)
        parts.append(rows)
    rows = MotionRows.joined(parts, len(position))
    _still(rows, position, frame, code.line, file, found)
    return rows


def _moving(section: BlockSection) -> Bools:
    """(N,) blocks that move, or drill where the tool stands."""
    moving = section.stated.any(axis=1) & ~section.rest
    arc = among(section.motion, (2, 3)) & ~section.rest
    return np.asarray(moving | (arc & (np.isfinite(section.relative) | np.isfinite(section.absolute)).any(axis=1)))


def _rows(section: BlockSection, frame: ExecutionFrame, number: int, start: Floats, moving: Bools, code: Canonical,
          offsets: Offsets,
          file: str, found: list[Diagnostic]) -> tuple[MotionRows, Floats]:
    """(rows of blocks, begun at `start` (J,) in the coordinates of the frame, where they end in those)."""
    state = _state(section, start, frame, offsets)
    drilling = np.flatnonzero((moving & among(section.motion, CYCLES)) | np.isfinite(section.call))
    spelt = spell_holes(state, moving, drilling, code, file, found) if len(drilling) else {}
    moving[list(spelt)] = True
    lines = np.flatnonzero(moving)
    counts = np.array([len(spelt[n]) if n in spelt else 1 for n in lines.tolist()], dtype=np.int64) if spelt else None
    line = lines if counts is None else np.repeat(lines, counts)
    ends = state.carried()[1:]
    end = ends[line]
    motion = section.motion[line]
    kind = np.where(motion == 0, 0, np.where(among(motion, (2, 3)), 2, 1)).astype(np.int8)
    rows = MotionRows(line + section.first, kind, end, *[*(repeated(one, len(line)) for one in (
        np.zeros(3), number, False, np.nan, 0.0)), np.asarray(motion == 3), repeated(np.zeros(4), len(line))])
    if spelt:
        rows = _with_legs(rows, line, spelt)
    rows = _with_arcs(rows, state, line, code.line, file, found)
    if len(code.curves):
        rows = with_curves(rows, start, section.curve[rows.block - section.first], code.curves,
                           code.splines, offsets.xyz)
    if (shift := section.radius[rows.block - section.first]).any():
        rows, faults = with_radius(rows, start, shift, _held(section, rows, moving, code), offsets.xyz, offsets.corners)
        found += [error("gcode.compensation", f"cutter compensation by the radius: {said}", file=file,
                        lines=[int(code.line[rows.block[k]])], hint="write it as the post does, or state compensation = "
                        "\"wear\" in the set-up where the words are the path of the tool's centre")
                  for k, said in faults.items()]
    return replace(rows, end=frame.position(rows.end)), ends[-1]


def _held(section: BlockSection, rows: MotionRows, moving: Bools, code: Canonical) -> Bools:
    """(R,) rows before which, from the begin of the row before, something else than a move or a centre of arcs is stated:
    the control does not see the row while it runs the one before."""
    at, bad = code.words.line - section.first, np.zeros(len(moving), dtype=bool)
    here = (at >= 0) & (at < len(bad))
    bad[at[here]] = True  # comments, and CC, are blocks without words
    bad &= ~(moving | np.isfinite(section.absolute).any(axis=1))
    bad[at[here & among(code.words.letter, [ord(sign) for sign in _OTHERS])]] = True
    count = np.concatenate([[0], np.cumsum(bad)])[rows.block - section.first]
    return np.asarray(np.diff(count, prepend=count[:1]) > 0)


def _state(section: BlockSection, start: Floats, frame: ExecutionFrame, offsets: Offsets) -> SectionState:
    """Words in the coordinates of the law."""
    lengths = offsets.lengths_at
    drilling = among(section.motion, CYCLES)
    steps = np.array(section.steps) if section.has_steps or drilling.any() else section.steps
    if section.inch.any():
        columns = section.columns.copy()
        columns[:, lengths] *= section.scale[:, None]
        steps = np.array(steps)
        steps[:, lengths] *= section.scale[:, None]
    else:
        columns = section.columns
    shift = _shift(section, frame, offsets)
    columns = columns + (np.where(section.machine[:, None], 0.0, shift) if section.machine.any() else shift)
    for plane in distinct(section.plane[drilling]).tolist():
        z = int(offsets.xyz[PLANE_AXIS[plane]])
        drills = drilling & (section.plane == plane)
        columns[drills, z] = steps[drills, z] = np.nan
    return SectionState(section, columns, steps, start, shift, offsets)


def _shift(section: BlockSection, frame: ExecutionFrame, offsets: Offsets) -> Floats:
    """(N, J) from the program's words to coordinates."""
    shift = offsets.works(section.offset, frame.control is None)
    if frame.control is None and offsets.on_z and offsets.xyz[2] >= 0 and section.length.any():
        shift = np.array(shift)
        shift[:, offsets.xyz[2]] += section.length
        shift = shared(shift)
    return shift


def _refused(section: BlockSection, frame: ExecutionFrame, moving: Bools, line: Ints, file: str,
             found: list[Diagnostic]) -> None:
    """Machine coordinates under a law that has none."""
    bad = np.flatnonzero(section.machine & moving)
    if frame.control is not None and len(bad):
        found.append(error("gcode.machine_position", f"a move in machine coordinates while the {frame.law} mode is on",
                           file=file, lines=line[bad + section.first][:6].tolist(), count=len(bad),
                           hint="leave the mode before it"))


def _still(rows: MotionRows, position: Floats, frame: ExecutionFrame, line: Ints, file: str,
           found: list[Diagnostic]) -> None:
    """Rotary axes that move while a tilted plane is in force."""
    if frame.law != "tilted" or frame.control is None:
        return
    rotary = frame.control.rotary
    bad = np.flatnonzero((np.abs(rows.end[:, rotary] - position[rotary]) > _STILL).any(axis=1))
    if len(bad):
        found.append(error("gcode.rotary_in_plane", "a rotary axis moves while a tilted plane is in force", file=file,
                           lines=line[rows.block[bad]][:6].tolist(), count=len(bad),
                           hint="leave the plane, index, enter the plane of the new position"))


def _with_legs(rows: MotionRows, line: Ints, spelt: dict[int, list[CycleLeg]]) -> MotionRows:
    """Rows with the legs of cycles at their blocks."""
    hole = np.isin(line, list(spelt))
    flat = [leg for n in sorted(spelt) for leg in spelt[n]]
    code, end, feed, dwell = rows.code.copy(), rows.end.copy(), rows.feed.copy(), rows.dwell.copy()
    where = np.flatnonzero(hole)
    code[where] = [leg[0] for leg in flat]
    end[where] = [leg[1] for leg in flat]
    feed[where] = [leg[2] for leg in flat]
    dwell[where] = [leg[3] for leg in flat]
    return replace(rows, code=code, end=end, feed=feed, dwell=dwell, hole=hole)


def _with_arcs(rows: MotionRows, state: SectionState, line: Ints, where: Ints, file: str,
               found: list[Diagnostic]) -> MotionRows:
    """Rows with the centres of arcs, and a row for each turn of those of several."""
    arcs = np.flatnonzero((rows.code == 2) & ~rows.hole)
    if not len(arcs):
        return rows
    section, n, xyz = state.section, line[arcs], state.offsets.xyz
    before = np.concatenate([state.start[None, :], rows.end[:-1]])[arcs][:, xyz]
    scale = section.scale[n][:, None]
    absolute = section.absolute[n] * scale + state.shift[n][:, xyz]
    ccw = section.motion[n] == 3
    center, bad = centres(before, rows.end[arcs][:, xyz], section.plane[n], ccw, section.relative[n] * scale, absolute,
                          section.extra[n, 1] * scale[:, 0], state.offsets.arc_slack)
    for k, message in bad.items():
        found.append(error("gcode.arc", message, file=file, lines=[int(where[rows.block[arcs[k]]])],
                           hint="correct its centre or radius, or the point before it: the control stops there"))
    all_centres = rows.center.copy()
    all_centres[arcs] = center
    rows = replace(rows, center=all_centres)
    turns = np.nan_to_num(section.deep[n, 2]).astype(np.int64)
    return whole_turns(rows, arcs, turns, before, section.plane[n], ccw, xyz) if (turns > 0).any() else rows
