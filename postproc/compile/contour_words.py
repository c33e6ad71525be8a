"""The path of the tool's centre offset back to the contour, where the control's own compensation adds the whole radius.

In the plane of X and Y, numbers x + iy: lines are shifted and arcs keep their centre, by the radius away from the tool;
corners of the contour are where these meet. An arc of the radius itself, round an outside corner, becomes that corner.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from postproc.compile.program import Command, Commands
from postproc.compile.word_rows import WordRows, block_tools
from postproc.controllers.model import OutsideCorners
from postproc.job.job import Job
from postproc.path.model import ARC, FEED, JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.shapes import arrays

CODE = "CUTTER_COMPENSATION"
STILL = 1e-7
"""mm"""
POINT = 1e-3
"""mm: an arc of the contour of no more than this radius is a corner"""
SMALL = 1e-4
"""mm by which an outside corner rounded and one not rounded may differ where both are the same"""
ROUGH = 0.7
"""of the tolerance: what the radius makes of a contour that rounded words turn a little"""
Complexes = npt.NDArray[np.complex128]

_WEAR = '[tools.N] compensation = "wear": the words are the path of the tool\'s centre'
_LEAD = ("CUTCOM behind the move down, before a straight feed that comes from the side of the tool; CUTCOM/OFF before a "
         "straight move that leads away to that side")
_STRAIGHT = ("moves in X and Y alone from CUTCOM to CUTCOM/OFF: no holes, rapids, moves along Z, turns of rotary axes, arcs "
             "in G18 or G19")
_CORNER = ("have the CAM system write outside corners as the control goes round them ([cutter_compensation] corners of the "
           'controller file: arc or intersection), or [tools.N] compensation = "wear"')
_HELD = ("move STOP, OPSTOP, COOLNT, SPINDL, DELAY and the like before CUTCOM or behind CUTCOM/OFF: behind them the "
         "control cannot see the next move, from which it reckons where this one ends")
_SHORT = "have the CAM system write longer moves there, or arcs (CIRCLE), or " + _WEAR
_HINTS = {"short": _SHORT, "lead": _LEAD, "straight": _STRAIGHT, "corner": _CORNER, "held": _HELD}
_SAID = {"lead": "its first or last move is none that every control makes alike", "straight": "a block that is no cut in "
         "the plane of X and Y", "corner": "an outside corner that this control does not go round as the CL file does",
         "inside": "an arc round a corner is smaller than the tool, or the contour would run backwards",
         "short": "a move is so short that rounded words turn it, and the radius takes the tool off by more than is allowed",
         "held": "a record that is no move stands between its moves",
         "control": "this control does not begin square to the next move, or its manual does not say so"}


class _Refused(ValueError):
    """Why a stretch has no contour, and at which of its blocks."""

    def __init__(self, why: str, at: int) -> None:
        super().__init__(why)
        self.why, self.at = why, at


@dataclass(frozen=True)
@arrays(dropped="K", center="K 3")
class ContourWords:
    """Words, blocks that are none of the contour (K,), centres (K, 3) from where a block begins."""

    words: WordRows
    dropped: Bools
    center: Floats


def contour_words(job: Job, moves: Moves, path: JointPath, words: WordRows,
                  commands: Commands) -> tuple[ContourWords, Commands, list[Diagnostic]]:
    """The words of tools whose path is offset back; commands with what the control must have in force for it."""
    radii = {tool.number: tool.radius for tool in job.cutcom if tool.radius > 0.0}
    made = ContourWords(words, np.zeros(len(path), dtype=bool), path.center)
    if not radii:
        return made, commands, []
    tools, rules, refused = block_tools(path, moves), job.controller.cutter_compensation, defaultdict[str, list[int]](list)
    for first, last, side in _stretches(commands, len(path)):
        radius = radii.get(job.number_of(int(tools[min(first, len(tools) - 1)])), 0.0)
        if not radius:
            continue
        if rules.states:
            commands = {**commands, first: _stated(commands[first], rules.states)}
        try:
            made = _stretch(job, path, made, first, last, side * radius, sorted(commands))
        except _Refused as found:
            refused[found.why].append(int(moves.line[path.move[min(first + found.at, len(path) - 1)]]))
    return made, commands, [error(
        "cutcom.offset_back", f"the path under CUTCOM cannot be offset back to the contour: {_SAID[why]}",
        file=job.toolpath.file, lines=lines[:6], count=len(lines), hint=_HINTS.get(why, _WEAR))
        for why, lines in sorted(refused.items())]


def _stretches(commands: Commands, count: int) -> list[tuple[int, int, float]]:
    """(first block, the block behind the end, 1 left or -1 right) of each stretch under compensation."""
    result, begun, side = list[tuple[int, int, float]](), -1, 0.0
    for block, group in sorted(commands.items()):
        for command in group:
            if not command.name.startswith(CODE):
                continue
            if begun >= 0:
                result.append((begun, block, side))
            begun = -1 if command.name.endswith("OFF") else block
            side = 1.0 if command.name.endswith("LEFT") else -1.0
    return result + ([(begun, count, side)] if begun >= 0 else [])


def _stated(group: tuple[Command, ...], text: str) -> tuple[Command, ...]:
    at = next(k for k, c in enumerate(group) if c.name.startswith(CODE) and not c.name.endswith("OFF"))
    return (*group[:at], Command("INSERT", (text,), group[at].line), *group[at:])


def _stretch(job: Job, path: JointPath, made: ContourWords, first: int, last: int, radius: float,
             held: Sequence[int]) -> ContourWords:
    """The words of blocks `first` to before `last`, and of the block that leads away; radius > 0: the tool is left;
    `held`: blocks before which something is written that is no move."""
    rules, words, columns = job.controller.cutter_compensation, made.words, job.control.xyz[:2]
    if rules.start != "next" or (columns < 0).any():
        raise _Refused("control", 0)
    rows = np.arange(first, min(last + 1, len(path)))
    begin, end = (one[rows][:, columns] @ np.array([1.0, 1j]) for one in (words.start, words.end))
    moved = np.abs(end - begin) > STILL
    lead = int(np.argmax(moved | (path.code[rows] == ARC)))
    rows, begin, end, moved = rows[lead:], begin[lead:], end[lead:], moved[lead:]
    arc, n = path.code[rows] == ARC, len(rows) - 1
    if last >= len(path) or n < 2 or arc[[0, n]].any() or not moved[[0, n]].all() or path.code[rows[0]] != FEED:
        raise _Refused("lead", lead)
    others = np.setdiff1d(np.arange(words.end.shape[1]), job.control.xyz)
    bad = ~(moved | arc) | (path.frame[rows] != path.frame[rows[0]]) | (arc & (path.plane[rows] != 17))
    bad |= (np.append(path.code[rows[:n]], FEED) != FEED) & ~arc
    bad |= (words.end[rows][:, others] != words.start[rows][:, others]).any(axis=1)
    if bad.any():
        raise _Refused("straight", lead + int(np.argmax(bad)))
    if (between := [k for k in held if rows[0] < k < last]):
        raise _Refused("held", between[0] - first)
    center = np.where(arc, begin + path.center[rows][:, :2] @ np.array([1.0, 1j]), np.nan)
    pieces = _Pieces(begin, end, center, np.where(path.ccw[rows], 1.0, -1.0), radius, rules.corners, lead)
    joints, gone = pieces.contour()
    result, write = words.end.copy(), words.write.copy()
    result[np.ix_(rows[:n], columns)] = np.stack([joints.real, joints.imag], axis=1)
    result = job.grid.rounded(result)
    rough = result[rows[:n]][:, columns] @ np.array([1.0, 1j])
    swing = abs(radius) * np.abs(_ahead(rough) - _ahead(joints)) * np.isnan(center[1:n])
    if (swing > ROUGH * job.options.tolerance).any():
        raise _Refused("short", lead + 1 + int(np.argmax(swing)))
    start, kept = words.start.copy(), rows[:n][~gone]
    start[rows[1:]] = np.where(np.isin(np.arange(words.end.shape[1]), columns), result[rows[:n]], start[rows[1:]])
    write[np.ix_(rows, columns)] = True
    write[rows[:n][gone]] = False
    centers, dropped = made.center.copy(), made.dropped.copy()
    dropped[rows[:n][gone]] = True
    middle = np.stack([center.real, center.imag], axis=1)[:n][~gone]
    centers[kept, :2] = np.where(arc[:n][~gone][:, None], middle - start[kept][:, columns], centers[kept, :2])
    return ContourWords(replace(words, end=result, start=start, write=write), dropped, centers)


def _ahead(at: Complexes) -> Complexes:
    """Directions (N - 1,) from point to point (N,); 0 where two are one."""
    chord = np.diff(at)
    return np.asarray(chord / np.where(np.abs(chord) > STILL, np.abs(chord), np.inf))


@dataclass(frozen=True)
@arrays(sense="N")
class _Pieces:
    """N + 1 moves of the tool's centre: the first leads to the contour, the last away; centres NaN for lines, sense 1
    counter-clockwise; radius > 0 where the tool is left of its path."""

    begin: Complexes
    end: Complexes
    center: Complexes
    sense: Floats
    radius: float
    corners: OutsideCorners
    lead: int

    def contour(self) -> tuple[Complexes, Bools]:
        """Where each move but the last ends on the contour (N,), and those that become a corner (N,)."""
        n, side, size = len(self.begin) - 1, np.sign(self.radius), abs(self.radius)
        own = np.abs(self.begin - self.center) + side * self.sense * size
        gone, out, into = np.abs(own[:n]) <= POINT, self._tangent(self.end), self._tangent(self.begin)
        self._refuse("inside", np.flatnonzero(own[:n] < -POINT))
        away, toward = -1j * side * out[:n], -1j * side * into[1:]
        cos, turn = (out[:n] * into[1:].conj()).real, (out[:n].conj() * into[1:]).imag * side
        joints = self.end[:n] + size * (away + toward) / np.maximum(1.0 + cos, 1e-12)
        joints[0], joints[-1] = self.end[0] + size * toward[0], self.end[n - 1] + size * away[-1]
        tangent = (size * turn**2 <= 8.0 * SMALL) & (cos > 0.0)
        inner, lines = np.arange(1, n - 1), np.isnan(self.center)
        round_corner = gone[inner] | gone[inner + 1]
        self._refuse("corner", inner[round_corner & ~tangent[inner]])
        self._refuse("corner", np.flatnonzero(gone & ((self.corners != "arc") | np.isin(np.arange(n), (1, n - 1)))))
        straight = lines[inner] & lines[inner + 1] & (cos[inner] >= (-1e-9 if self.corners == "intersection" else np.inf))
        outside = (turn[inner] < 0.0) & ~tangent[inner]
        self._refuse("corner", inner[outside & ~straight])
        for k in inner[~tangent[inner] & ~outside & ~(lines[inner] & lines[inner + 1])].tolist():
            joints[k] = self._meeting(k, joints[k], side)
        joints[:-1][gone[1:]] = self.center[1:n][gone[1:]]
        joints[gone] = self.center[:n][gone]
        self._leads(joints, toward[0], away[-1])
        ran = np.diff(joints) * out[1:n].conj()
        self._refuse("inside", 1 + np.flatnonzero((ran.real <= 0.0) & lines[1:n]))
        return joints, gone

    def _refuse(self, why: str, at: Ints | Sequence[int]) -> None:
        if len(at):
            raise _Refused(why, self.lead + int(at[0]))

    def _leads(self, joints: Complexes, first: complex, last: complex) -> None:
        """Refuse a contour that is not come to, and left, on the side of the tool: there all controls go straight to
        where the radius is square to the contour, and back."""
        off = np.array([(self.begin[0] - joints[0]) * np.conj(first), (self.end[-1] - joints[-1]) * np.conj(last)]).real
        self._refuse("lead", np.flatnonzero(off > POINT) * (len(self.begin) - 1))

    def _tangent(self, at: Complexes) -> Complexes:
        chord = self.end - self.begin
        ahead = np.where(np.isnan(self.center), chord, 1j * self.sense * (at - self.center))
        return np.asarray(ahead / np.maximum(np.abs(ahead), 1e-300))

    def _meeting(self, k: int, near: complex, side: float) -> complex:
        """Where the contours of moves k and k + 1, one an arc at least, meet next to `near`."""
        a, b = (k, k + 1) if not np.isnan(self.center[k]) else (k + 1, k)
        c, size = self.center[a], abs(self.begin[a] - self.center[a]) + self.sense[a] * self.radius
        if np.isnan(self.center[b]):
            along = (self.end[b] - self.begin[b]) / abs(self.end[b] - self.begin[b])
            foot = self.begin[b] - 1j * self.radius * along
            foot += ((c - foot) * np.conj(along)).real * along
            half = size**2 - abs(foot - c)**2
        else:
            d, other = self.center[b] - c, abs(self.begin[b] - self.center[b]) + self.sense[b] * self.radius
            share = (abs(d)**2 + size**2 - other**2) / (2.0 * abs(d)) if abs(d) > STILL else np.inf
            along, foot = (1j * d / abs(d), c + share * d / abs(d)) if np.isfinite(share) else (1.0, np.inf)
            half = size**2 - share**2
        self._refuse("inside", [k] if not half >= 0.0 else [])
        found = [foot + s * np.sqrt(half) * along for s in (1.0, -1.0)]
        return complex(min(found, key=lambda p: abs(p - near)))
