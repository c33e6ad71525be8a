"""Rotary axes between cuts: free where they turn, clamped in cuts through which they stand, the tool at home meanwhile."""

from __future__ import annotations

import numpy as np

from machines.machine import ClampCodes
from postproc.job.index_moves import indexed
from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.comparison.tool_changes import correction
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import LAW, Canonical, in_files
from postproc.readback.text.modal import codes, fill
from toolpaths.arrays import Bools, Floats, Ints, runs
from toolpaths.diagnostics import Diagnostic

AWAY = 0.01
"""mm next to home that rounding explains"""
TURNS = 1e-6
"""degrees of a word that turns an axis"""


def check_clamps(code: Canonical, motion: Motion, job: Job, owner: Ints, faults: Faults) -> list[Diagnostic]:
    """Axes that the program clamps by codes turn only behind the release, and are clamped in cuts through
    which they stand, before the first row and up to the last; an axis may be free where another turns that
    shares a code with it.

    `owner` (E,): the move that each row serves. What a block states of clamps acts behind its motion: nobody knows better.
    """
    machine, found = job.machine, list[Diagnostic]()
    if not machine.clamp_codes:
        return found
    moves, cut = job.moves.without_pecks(), cutting_rows(motion, job, owner)
    columns = np.array([machine.axis_names.index(letter) for letter in machine.clamp_codes])
    turning = {letter: turns | (motion.block == _first(code, letter))
               for letter, turns in zip(machine.clamp_codes, (turned(motion, columns) > TURNS).T, strict=True)}
    standing = {group: _standing(cut, np.any([turning[letter] for letter in group], axis=0))
                for group in machine.clamp_groups}
    for letter, one in machine.clamp_codes.items():
        state, turns = _states(code, one), turning[letter]
        before, line = state[motion.block - 1], motion.line
        bad = np.flatnonzero(turns & (before != 1.0))
        if len(bad):
            how = "clamped" if before[bad[0]] == 0.0 else "not released since the program began"
            found.append(faults.error("verify.clamp", f"axis {letter} turns while it is {how}", 0, int(line[bad[0]]),
                                      len(bad), f"{one.unclamp} in a block before it"))
        found += _planes(code, state, letter, one, job, faults)
        still = next(rows for group, rows in standing.items() if letter in group)
        loose = np.flatnonzero(still & (before != 0.0))
        if len(loose):
            found.append(faults.error("verify.clamp", f"axis {letter} stands through a cut and is not clamped",
                                      int(moves.line[owner[loose[0]]]), int(line[loose[0]]), len(loose),
                                      f"{one.clamp} before the cut"))
        if state[-1] == 1.0:
            found.append(faults.warning("verify.clamp", f"axis {letter} is free when the program ends", 0, int(line[-1]), 1,
                                        f"{one.clamp} before the end"))
    return found


def _first(code: Canonical, letter: str) -> int:
    """The first block with a word of an axis, 0 without."""
    return int(code.words.pick(letter)[0].min(initial=code.words.lines + 1)) % (code.words.lines + 1)


def cutting_rows(motion: Motion, job: Job, owner: Ints) -> Bools:
    """(E,) rows that cut: at feed, and serving a move that no link leads to."""
    return np.asarray((motion.code > 0) & job.moves.without_pecks().run_by(owner))


def turned(motion: Motion, joints: Ints) -> Floats:
    """(E, K) degrees by which rows turn joints (K,)."""
    degrees = np.concatenate([motion.start[None], motion.end])[:, joints]
    return np.asarray(np.abs(np.diff(degrees, axis=0)))


def _states(code: Canonical, one: ClampCodes) -> Floats:
    """(B + 1,) behind each block: 0 clamped, 1 free, -1 not known."""
    free = float(one.unclamp[1:])
    blocks, number = codes(code.words, "M", (float(one.clamp[1:]), free))
    return fill(blocks, (number == free).astype(np.float64), code.words.lines, -1.0)


def _planes(code: Canonical, state: Floats, letter: str, one: ClampCodes, job: Job,
            faults: Faults) -> list[Diagnostic]:
    """Planes that the control may turn the axis for while it is clamped."""
    if not job.controller.plane_turns:
        return []
    blocks, law = code.words.pick(LAW)
    tilted = np.array([one.name == "tilted" for one in code.laws] + [False])[law.astype(np.int64)]
    bad = blocks[tilted & (state[blocks - 1] != 1.0)]
    if not len(bad):
        return []
    line = int(in_files(code.line[bad[:1]], code.files)[0])
    return [faults.error("verify.clamp", f"a plane is stated while axis {letter} is not free: the control may turn it there",
                         0, line, len(bad), f"{one.unclamp} in a block before it")]


def _standing(cut: Bools, turns: Bools) -> Bools:
    """(E,) rows of the stretches of cuts in which nothing turns."""
    edges, result = runs(cut), cut.copy()
    total = np.concatenate([[0], np.cumsum(turns)])
    result[cut] = np.repeat(total[edges[:, 1]] == total[edges[:, 0]], edges[:, 1] - edges[:, 0])
    return result


def check_index(motion: Motion, job: Job, home: Floats, owner: Ints, faults: Faults) -> list[Diagnostic]:
    """Linking moves that turn rotary axes before a move with another tool axis, where the retract axis is to be at home
    (J,) meanwhile: an error where the set-up says so, a warning where the controller file does.
    In the mode by the tip, entered with the tables at zero, it stands lower by what straight paths of the tip need.

    Where errors are corrected, what the correction moves and turns is neither away from home nor a turn."""
    if not job.index_at_home or job.control.tip_law:
        return []
    moves = job.moves.without_pecks()
    first = np.zeros(len(moves) + 1, dtype=bool)
    first[np.searchsorted(moves.row, job.moves.row[indexed(job.moves, job.axis_tolerance)])] = True
    linking = first[np.clip(owner, 0, len(moves))] & ~cutting_rows(motion, job, owner)
    rotary = np.flatnonzero(np.array(job.machine.rotary))
    before = np.concatenate([motion.start[None], motion.end[:-1]])
    turns, lift = turned(motion, rotary), job.machine.retract_axis
    near_home = np.where(np.array([frame.law == "tcp" for frame in motion.frames])[motion.frame], AWAY_BY_THE_TIP, AWAY)
    away = np.abs(before[:, lift] - home[lift])
    bad = np.flatnonzero(linking & (turns > TURNS).any(axis=1) & (away > near_home))
    if job.corrects and len(bad):
        near = [correction(job, place[bad], motion.tool[bad]) for place in (before, motion.end)]
        explained = (near[0] + near[1])[:, rotary]
        bad = bad[(turns[bad] > TURNS + explained).any(axis=1) & (away[bad] > near_home[bad] + near[0][:, lift])]
    if not len(bad):
        return []
    name, k = job.machine.axis_names[lift], int(bad[0])
    judge = faults.error if job.setup.clearance.index == "home" else faults.warning
    off = abs(float(before[k, lift] - home[lift]))
    return [judge("verify.index", f"rotary axes turn while {name} is {off:.3f} mm from home", 0, int(motion.line[k]),
                  len(bad), f'retract {name} to home before it, or write index = "plane" under [clearance] of the set-up')]
AWAY_BY_THE_TIP = 14.0
"""mm likewise in the mode by the tip, which stands up to 10 mm below home so that tools may be longer: a chord of 10 degrees
round an axis 1000 mm away lies 3.8 mm inside its arc"""
