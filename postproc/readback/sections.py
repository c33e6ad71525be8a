"""The blocks of one law: ends carried from block to block, cycles leg by leg, arcs with their centres."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.readback.arcs import centres, whole_turns
from postproc.readback.canonical import Canonical, Drill
from postproc.readback.cycles import Leg, Rise, Sticky, legs
from postproc.readback.frames import Frame
from postproc.readback.modal import CYCLES
from postproc.word_arcs import PLANE_AXIS
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error

if TYPE_CHECKING:
    from postproc.readback.execute import Offsets

INCH = 25.4
_STILL = 1e-6
"""degrees"""


@dataclass(frozen=True)
class Section:
    """Blocks `first` and on (N), as their words and modal state have them.

    `columns`, `steps` (N, J) are absolute and relative axis words, `relative`, `absolute` (N, 3) centres of arcs from the
    start and in coordinates, `extra` (N, 7) the words Z, R, Q, P, I, J, K of a cycle, `deep` (N, 3) z, r and turns,
    `repeats` and `call` (N,) as stated; NaN where a block states none.
    """

    first: int
    motion: Array
    plane: Array
    machine: Bools
    level: Array
    inch: Bools
    columns: Floats
    steps: Floats
    rest: Bools
    length: Floats
    relative: Floats
    absolute: Floats
    extra: Floats
    deep: Floats
    repeats: Floats
    call: Floats

    def cut(self, first: int, last: int) -> Section:
        """Blocks first to before last."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        parts: dict[str, Any] = {name: value[first:last] for name, value in values.items() if isinstance(value, np.ndarray)}
        return replace(self, first=first, **parts)

    @cached_property
    def has_steps(self) -> bool:
        """True where any word is relative."""
        return bool(np.isfinite(self.steps).any())

    @property
    def stated(self) -> Bools:
        """(N, J) axes that a block moves."""
        return np.isfinite(self.columns) | np.isfinite(self.steps)

    @property
    def scale(self) -> Floats:
        """(N,) mm per unit of length."""
        return np.where(self.inch, INCH, 1.0)


@dataclass(frozen=True)
class Rows:
    """R rows of motion: block, code, end (R, J) in machine coordinates, centre (R, 3) in those of the frame, number of the
    frame; hole, feed (NaN: the F word in force), rest of cycles."""

    block: Ints
    code: Array
    end: Floats
    center: Floats
    frame: Ints
    hole: Bools
    feed: Floats
    dwell: Floats

    @staticmethod
    def joined(parts: list[Rows], width: int) -> Rows:
        """Parts in order; none is no rows."""
        if len(parts) == 1:
            return parts[0]
        if not parts:
            none = np.zeros(0)
            return Rows(none.astype(np.int64), none.astype(np.int8), np.zeros((0, width)), np.zeros((0, 3)),
                        none.astype(np.int64), none.astype(bool), none, none)
        return Rows(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Rows)))


@dataclass
class _State:
    """What `run_section` works on: absolute words (N, J) in coordinates, and where the blocks begin (J,)."""

    section: Section
    columns: Floats
    steps: Floats
    start: Floats
    shift: Floats
    """(N, J) from the program's words to coordinates"""
    offsets: Offsets

    def carried(self) -> Floats:
        """(N + 1, J) where every axis stands: before the first block, and behind each."""
        ends = np.concatenate([self.start[None, :], self.columns])
        n = np.arange(len(ends))
        for j in range(ends.shape[1]):
            last = np.maximum.accumulate(np.where(np.isfinite(ends[:, j]), n, 0))
            ends[:, j] = ends[last, j]
            if self.section.has_steps:
                walked = np.cumsum(np.concatenate([[0.0], np.nan_to_num(self.steps[:, j])]))
                ends[:, j] += walked - walked[last]
        return ends


def run_section(section: Section, frame: Frame, number: int, position: Floats, code: Canonical, offsets: Offsets,
                file: str, found: list[Diagnostic]) -> Rows:
    """Rows of the blocks of one law, begun at machine position (J,)."""
    state = _state(section, frame, position, offsets)
    cycle = np.isin(section.motion, CYCLES)
    moving = section.stated.any(axis=1) & ~section.rest
    arc = np.isin(section.motion, (2, 3)) & ~section.rest
    moving |= arc & (np.isfinite(section.relative) | np.isfinite(section.absolute)).any(axis=1)
    drilling = np.flatnonzero((moving & cycle) | np.isfinite(section.call))
    _refused(section, frame, moving, code.line, file, found)
    spelt = _holes(state, moving, drilling, code, file, found) if len(drilling) else {}
    moving[list(spelt)] = True
    lines = np.flatnonzero(moving)
    counts = np.array([len(spelt[n]) if n in spelt else 1 for n in lines.tolist()], dtype=np.int64) if spelt else None
    line = lines if counts is None else np.repeat(lines, counts)
    end = state.carried()[1:][line]
    motion = section.motion[line]
    kind = np.where(motion == 0, 0, np.where(np.isin(motion, (2, 3)), 2, 1)).astype(np.int8)
    rows = Rows(line + section.first, kind, end, np.zeros((len(line), 3)), np.full(len(line), number),
                np.zeros(len(line), dtype=bool), np.full(len(line), np.nan), np.zeros(len(line)))
    if spelt:
        rows = _with_legs(rows, line, spelt)
    rows = _with_arcs(rows, state, line, code.line, file, found)
    _still(rows, state, frame, code.line, file, found)
    return replace(rows, end=frame.position(rows.end))


def _state(section: Section, frame: Frame, position: Floats, offsets: Offsets) -> _State:
    """Words in the coordinates of the law."""
    columns, steps = section.columns.copy(), section.steps.copy()
    xyz = offsets.xyz[offsets.xyz >= 0]
    scale = section.scale[:, None]
    columns[:, xyz] *= scale
    steps[:, xyz] *= scale
    shift = np.tile(offsets.work, (len(columns), 1))
    if frame.control is not None:
        shift[:, xyz] = 0.0
    elif offsets.on_z and offsets.xyz[2] >= 0:
        shift[:, offsets.xyz[2]] += section.length
    columns += np.where(section.machine[:, None], 0.0, shift)
    for plane in np.unique(section.plane).tolist():
        z = int(offsets.xyz[PLANE_AXIS[plane]])
        drills = np.isin(section.motion, CYCLES) & (section.plane == plane)
        columns[drills, z] = steps[drills, z] = np.nan
    start = frame.coordinates(position[None, :])[0]
    return _State(section, columns, steps, start, shift, offsets)


def _refused(section: Section, frame: Frame, moving: Bools, line: Ints, file: str, found: list[Diagnostic]) -> None:
    """Machine coordinates under a law that has none."""
    bad = np.flatnonzero(section.machine & moving)
    if frame.control is not None and len(bad):
        found.append(error("gcode.machine_position", f"a move in machine coordinates while the {frame.law} mode is on",
                           file=file, lines=line[bad + section.first][:6].tolist(), count=len(bad),
                           hint="leave the mode before it"))


def _still(rows: Rows, state: _State, frame: Frame, line: Ints, file: str, found: list[Diagnostic]) -> None:
    """Rotary axes that move while a tilted plane is in force."""
    if frame.law != "tilted" or frame.control is None:
        return
    rotary = frame.control.rotary
    bad = np.flatnonzero((np.abs(rows.end[:, rotary] - state.start[rotary]) > _STILL).any(axis=1))
    if len(bad):
        found.append(error("gcode.rotary_in_plane", "a rotary axis moves while a tilted plane is in force", file=file,
                           lines=line[rows.block[bad]][:6].tolist(), count=len(bad),
                           hint="leave the plane, index, enter the plane of the new position"))


def _with_legs(rows: Rows, line: Ints, spelt: dict[int, list[Leg]]) -> Rows:
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


def _holes(state: _State, moving: Bools, drilling: Ints, code: Canonical, file: str,
           found: list[Diagnostic]) -> dict[int, list[Leg]]:
    """Legs of each drilling block; sets where the cycle leaves the tool in `state.columns`."""
    section, offsets, spelt = state.section, state.offsets, {}
    sticky = Sticky(np.full(7, np.nan), relief=offsets.peck_relief)
    motion_lines = np.flatnonzero(moving)
    previous, plane, before = -1, 0, np.zeros((0, 0))
    known, walked, out = np.zeros(0, dtype=np.int64), np.zeros(0), 0.0
    state.steps *= np.where(np.isfinite(section.repeats), section.repeats, 1.0)[:, None]
    for n in drilling.tolist():
        z = int(offsets.xyz[PLANE_AXIS[int(section.plane[n])]])
        if section.plane[n] != plane:
            plane = section.plane[n]
            before = state.carried()
            known = np.flatnonzero(np.isfinite(state.columns[:, z]))
            walked = np.cumsum(np.concatenate([[0.0], np.nan_to_num(state.steps[:, z])]))
        at = int(np.searchsorted(known, n)) - 1
        since = previous >= 0 and (at < 0 or known[at] <= previous)
        level = float(out + walked[n] - walked[previous + 1]) if since else float(before[n, z])
        begun, target = before[n].copy(), before[n + 1].copy()
        begun[z] = level
        if np.isfinite(section.call[n]):
            spelt[n] = _called(state, n, begun, target, z, code.drills[int(section.call[n])])
        else:
            k = int(np.searchsorted(motion_lines, n)) - 1
            fresh = previous < 0 or k < 0 or motion_lines[k] != previous
            fresh = fresh or _broken(section, previous, n, offsets.rises_first)
            if fresh:
                sticky.enter(level)
            drill = _sticky(state, sticky, n, z, code, file, found)
            times = section.repeats[n]
            if drill is not None and not (np.isnan(times) or (times >= 1.0 and times == round(times))):
                found.append(error("gcode.cycle", f"a cycle that is repeated {times:g} times", file=file,
                                   lines=[int(code.line[n + section.first])], hint="1 or more, a whole number"))
            elif drill is not None:
                spelt[n] = _repeated(state, n, drill, begun, target, z, fresh)
        out = float(spelt[n][-1][1][z]) if n in spelt else level
        state.columns[n, z] = out
        previous = n
    return spelt


def _broken(section: Section, previous: int, n: int, nist: bool) -> bool:
    """True where a code of motion, or a G80 where the control counts it, stands between two blocks of cycles."""
    between = section.motion[previous + 1:n]
    return bool((between < 73).any() or (not nist and (between == 80).any()))


def _sticky(state: _State, sticky: Sticky, n: int, z: int, code: Canonical, file: str,
            found: list[Diagnostic]) -> Drill | None:
    section = state.section
    relative = bool(np.isfinite(section.deep[n, :2]).any())
    stated = section.extra[n].copy()
    if relative:
        stated[:2] = section.deep[n, :2]
    return sticky.drill(int(section.motion[n]), stated, float(section.scale[n]), float(state.shift[n, z]),
                        section.level[n] == 99, relative, file, int(code.line[n + section.first]), found)


def _repeated(state: _State, n: int, drill: Drill, begun: Floats, target: Floats, z: int, fresh: bool) -> list[Leg]:
    """The cycle of one block, as often as it is repeated, each a step further."""
    times = int(state.section.repeats[n]) if np.isfinite(state.section.repeats[n]) else 1
    step = np.nan_to_num(state.steps[n]) / max(times, 1)
    step[z] = 0.0
    result: list[Leg] = []
    for k in range(times):
        rise: Rise = "after" if not state.offsets.rises_first else "before" if fresh and k == 0 else "aslant"
        result += legs(drill, result[-1][1] if result else begun, target - (times - 1 - k) * step, z, rise)
    return result


def _called(state: _State, n: int, begun: Floats, target: Floats, z: int, drill: Drill) -> list[Leg]:
    """The move of the block itself, then the cycle where it ends."""
    own: list[Leg] = []
    absolute, step = state.columns[n, z], state.steps[n, z]
    target[z] = absolute if np.isfinite(absolute) else begun[z] + np.nan_to_num(step)
    if (target != begun).any():
        own.append((0 if state.section.motion[n] == 0 else 1, target, float("nan"), 0.0))
    shift = float(state.shift[n, z])
    there = replace(drill, plane=drill.plane + shift, bottom=drill.bottom + shift, out=drill.out + shift,
                    bottoms=tuple(b + shift for b in drill.bottoms))
    return own + legs(there, target, target, z)


def _with_arcs(rows: Rows, state: _State, line: Ints, where: Ints, file: str, found: list[Diagnostic]) -> Rows:
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
                           hint="the control stops at such an arc"))
    all_centres = rows.center.copy()
    all_centres[arcs] = center
    rows = replace(rows, center=all_centres)
    turns = np.nan_to_num(section.deep[n, 2]).astype(np.int64)
    return whole_turns(rows, arcs, turns, before, section.plane[n], ccw, xyz) if (turns > 0).any() else rows
