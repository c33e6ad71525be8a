"""Blocks that drill: canned cycles that hold from block to block, and cycles that a block calls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.control.word_arcs import PLANE_AXIS
from postproc.readback.execution.rows import BlockSection, SectionState
from postproc.readback.text.canonical import Canonical, Drill
from postproc.readback.text.cycles import MOST, CycleLeg, Sticky, legs, unfit
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error


def spell_holes(state: SectionState, moving: Bools, drilling: Ints, code: Canonical, file: str,
           found: list[Diagnostic]) -> dict[int, list[CycleLeg]]:
    """Legs of each drilling block; sets where the cycle leaves the tool in `state.columns`."""
    section, offsets, spelt = state.section, state.offsets, {}
    sticky = Sticky(np.full(7, np.nan), relief=offsets.peck_relief)
    motion_lines = np.flatnonzero(moving)
    previous, plane, before = -1, 0, np.zeros((0, 0))
    known, walked, out = np.zeros(0, dtype=np.int64), np.zeros(0), 0.0
    state.steps = state.steps * np.where(np.isfinite(section.repeats), section.repeats, 1.0)[:, None]
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
            called = code.drills[int(section.call[n])]
            if not _refused(called, int(code.line[n + section.first]), file, found):
                spelt[n] = _called(state, n, begun, target, z, called)
        else:
            k = int(np.searchsorted(motion_lines, n)) - 1
            fresh = previous < 0 or k < 0 or motion_lines[k] != previous
            if fresh or _broken(section, previous, n):
                sticky.enter(level)
            drill = _sticky(state, sticky, n, z, code, file, found)
            times = section.repeats[n]
            if drill is not None and not (np.isnan(times) or (1.0 <= times <= MOST and times == round(times))):
                found.append(error("gcode.cycle", f"a cycle that is repeated {times:g} times", file=file,
                                   lines=[int(code.line[n + section.first])], hint=f"a whole number, 1 to {MOST}"))
            elif drill is not None and not _refused(drill, int(code.line[n + section.first]), file, found):
                spelt[n] = _repeated(state, n, drill, begun, target, z, sticky.initial)
        out = float(spelt[n][-1][1][z]) if n in spelt else level
        state.columns[n, z] = out
        previous = n
    return spelt


def _refused(drill: Drill, line: int, file: str, found: list[Diagnostic]) -> bool:
    """True, and an error, where the cycle makes no hole."""
    wrong = unfit(drill)
    if wrong is not None:
        found.append(error("gcode.cycle", f"a cycle {wrong[0]}", file=file, lines=[line], hint=wrong[1]))
    return wrong is not None


def _broken(section: BlockSection, previous: int, n: int) -> bool:
    """True where a code of motion or a G80 stands between two blocks of cycles."""
    between = section.motion[previous + 1:n]
    return bool(((between < 73) | (between == 80)).any())


def _sticky(state: SectionState, sticky: Sticky, n: int, z: int, code: Canonical, file: str,
            found: list[Diagnostic]) -> Drill | None:
    section = state.section
    relative = bool(np.isfinite(section.deep[n, :2]).any())
    stated = section.extra[n].copy()
    if relative:
        stated[:2] = section.deep[n, :2]
    return sticky.drill(int(section.motion[n]), stated, float(section.scale[n]), float(state.shift[n, z]),
                        section.level[n] == 99, relative, file, int(code.line[n + section.first]), found)


def _repeated(state: SectionState, n: int, drill: Drill, begun: Floats, target: Floats, z: int,
              first: float) -> list[CycleLeg]:
    """The cycle of one block, as often as it is repeated, each a step further; `first`: see `legs`."""
    times = int(state.section.repeats[n]) if np.isfinite(state.section.repeats[n]) else 1
    step = np.nan_to_num(state.steps[n]) / max(times, 1)
    step[z] = 0.0
    result: list[CycleLeg] = []
    for k in range(times):
        result += legs(drill, result[-1][1] if result else begun, target - (times - 1 - k) * step, z,
                       first if state.offsets.rises_first else None)
    return result


def _called(state: SectionState, n: int, begun: Floats, target: Floats, z: int,
            drill: Drill) -> list[CycleLeg]:
    """The move of the block itself, then the cycle where it ends."""
    own: list[CycleLeg] = []
    absolute, step = state.columns[n, z], state.steps[n, z]
    target[z] = absolute if np.isfinite(absolute) else begun[z] + np.nan_to_num(step)
    if (target != begun).any():
        own.append((0 if state.section.motion[n] == 0 else 1, target, float("nan"), 0.0))
    shift = float(state.shift[n, z])
    there = replace(drill, plane=drill.plane + shift, bottom=drill.bottom + shift, out=drill.out + shift,
                    bottoms=tuple(b + shift for b in drill.bottoms))
    return own + legs(there, target, target, z)
