"""Path to canonical Program: words rounded, feeds, commands at their places, holes that may become canned cycles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.commands import commands_of
from postproc.control import Control
from postproc.controllers.model import ControllerFile
from postproc.events import spindle_states
from postproc.feed import Feeds, plan_feeds
from postproc.moves import Moves, Phase
from postproc.path import ARC, FEED, Path
from postproc.program import Command, Hole, Program
from postproc.word_arcs import PLANE_AXIS
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

SNAP = 2.5
"""X, Y, Z residues beside a rotary move, in units of the last decimal, that are not written"""
SINGLE_MOVES = frozenset({"DRILL", "THRU", "CSINK", "FACE", "DEEP", "BRKCHP", "BORE", "REAM"})
"""kinds of cycles that rapids, feeds and dwells replace"""


@dataclass(frozen=True)
class Rounding:
    """Largest deviation that the rounding of words can make: tip in mm, axis in rad."""

    tip: float
    axis: float


def decimals(control: Control, controller: ControllerFile) -> Ints:
    """(J,) decimals of the axis words."""
    f = controller.format
    return np.where(control.machine.rotary, f.rotary_decimals, f.linear_decimals).astype(np.int64)


def rounding_bound(control: Control, kin: Kinematics, moves: Moves, places: Ints) -> Rounding:
    """Worst case of half a last decimal in every word, to first order (Jacobian), at up to 500 of the poses."""
    rows = np.unique(np.linspace(0, len(moves) - 1, min(len(moves), 500)).astype(int))
    some = kin.inverse(moves.tip[rows], kin.nearest_axis(moves.axis[rows]))[0]
    some = some[np.isfinite(some).all(axis=1)]
    if not len(some):
        return Rounding(0.0, 0.0)
    step = 0.5 * 10.0 ** -places / control.unit
    jacobian = kin.jacobian(some)
    axis = np.linalg.norm(jacobian[:, 3:], axis=1) @ step
    if control.tip_law:
        return Rounding(float(np.linalg.norm(step[control.slides])), float(axis.max()))
    slides, rotary = control.slides, control.rotary
    tip = np.linalg.norm(jacobian[:, :3], axis=1)
    linear = np.linalg.norm(tip[:, slides] * step[slides], axis=1)
    return Rounding(float((linear + tip[:, rotary] @ step[rotary]).max()), float(axis.max()))


def compile_program(toolpath: Toolpath, moves: Moves, path: Path, control: Control, controller: ControllerFile,
                    kinematics: Callable[[int], Kinematics], lengths: Callable[[int], float],
                    feed_mode: str) -> tuple[Program, Feeds, list[Diagnostic]]:
    """The canonical program of a path; `lengths` gives the gauge length of the tool of an index."""
    places = decimals(control, controller)
    exact = _words(path, moves, control, kinematics, lengths)
    words = _snapped(np.round(exact / 10.0 ** -places) * 10.0 ** -places, path, control, places)
    words = np.round(words, int(places.max()))
    write = _written(words, path, control)
    native, holes = _holes(toolpath, moves, path, words, control, controller)
    feeds = plan_feeds(path, control, words, moves.feed[path.move], toolpath.pass_[moves.row[path.move]], native,
                       feed_mode if controller.feed.inverse_time else "per-minute", controller.feed.least_inverse_rate)
    commands, diagnostics = commands_of(toolpath, moves, path, controller, native)
    keep = write.any(axis=1) | (path.code == ARC)
    new = np.concatenate([[0], np.cumsum(keep)])
    moved: dict[int, tuple[Command, ...]] = {}
    for k, group in sorted(commands.items()):
        moved[int(new[k])] = moved.get(int(new[k]), ()) + group
    kept_holes = tuple(Hole(int(new[h.first]), int(new[h.last + 1]) - 1, h.cycle, h.plane_level, h.bottom, h.retract,
                            h.initial, h.key) for h in holes)
    home_words = np.where(path.home[:, None], np.round(path.q * control.unit, int(places.max())), words)
    program = Program(control.machine.axis_names, home_words[keep], write[keep], path.code[keep], feeds.feed[keep],
                      feeds.mode[keep], path.plane[keep], path.ccw[keep], path.center[keep], path.home[keep],
                      np.isnan(path.u[keep]), moves.row[path.move[keep]], moves.line[path.move[keep]], moved, kept_holes,
                      places)
    return program, feeds, diagnostics + _slowed(feeds, moves, path, toolpath.file) + _not_native(
        toolpath, moves, path, native, controller)


def _words(path: Path, moves: Moves, control: Control, kinematics: Callable[[int], Kinematics],
           lengths: Callable[[int], float]) -> Floats:
    """Unrounded words (K, J); blocks before a tool change still carry the tool that leaves, none before the first."""
    tool = moves.tool[path.move]
    leaving = np.arange(len(path)) < path.begin[path.move]
    tool = np.where(leaving, np.where(path.move > 0, moves.tool[np.maximum(path.move - 1, 0)], -1), tool)
    words = np.empty_like(path.q)
    for index in np.unique(tool):
        k = np.flatnonzero(tool == index)
        words[k] = control.words(path.q[k], kinematics(int(index)), lengths(int(index)))
    return words


def _snapped(words: Floats, path: Path, control: Control, places: Ints) -> Floats:
    """Words without tiny X, Y, Z residues beside a rotary move.

    Under inverse time LinuxCNC takes the length of X, Y, Z alone where any of them moves, so that a residue of
    rounding would set the speed of the whole block. What is left out is at most SNAP last decimals, and never adds up:
    each block is compared with the last written position.
    """
    slides, rotary = control.slides, control.rotary
    if not len(rotary) or len(words) < 2:
        return words
    snap = SNAP * 10.0 ** -places[slides]
    turning = (words[1:, rotary] != words[:-1, rotary]).any(axis=1) & (path.code[1:] == FEED)
    step = np.abs(words[1:, slides] - words[:-1, slides])
    rows = np.flatnonzero(turning & (step <= snap).all(axis=1) & (step > 0.0).any(axis=1)) + 1
    wanted = words.copy()
    todo = set(rows.tolist())
    for k in rows.tolist():
        while k in todo or (k < len(words) and (words[k - 1, slides] != wanted[k - 1, slides]).any()):
            todo.discard(k)
            if not turning[k - 1] or (np.abs(wanted[k, slides] - words[k - 1, slides]) > snap).any():
                break
            words[k, slides] = words[k - 1, slides]
            k += 1
            if k >= len(words):
                break
    return words


def _written(words: Floats, path: Path, control: Control) -> Bools:
    """Words (K, J) that a block states: those it names, else those that change; both plane words of an arc."""
    changed = np.zeros(words.shape, dtype=bool)
    changed[1:] = words[1:] != words[:-1]
    names = np.asarray(path.state.any(axis=1))[:, None]
    write: Bools = np.asarray(np.where(names, path.state, changed))
    for k in np.flatnonzero(path.code == ARC):
        third = PLANE_AXIS[int(path.plane[k])]
        write[k, [c for i, c in enumerate(control.xyz) if i != third]] = True
    return write


def _holes(toolpath: Toolpath, moves: Moves, path: Path, words: Floats, control: Control,
           controller: ControllerFile) -> tuple[Bools, list[Hole]]:
    """Blocks of holes that the controller can drill by itself, and the holes.

    Native where the tool stands along Z of the words, the kind is in the controller's table and the way out ends at
    the clearance plane or at the level that the tool came from.
    """
    native = np.zeros(len(path), dtype=bool)
    holes: list[Hole] = []
    z = int(control.xyz[2])
    if not controller.cycles.enabled or 17 not in controller.cycles.planes or z < 0 or not (moves.hole >= 0).any():
        return native, holes
    hole = np.where(np.isnan(path.u), -1, moves.hole[path.move])
    turning = spindle_states(toolpath)[0]
    change = np.flatnonzero(np.diff(hole)) + 1
    before_initial = 0.0
    previous_last = -2
    for first, last in zip([0, *change], [*(change - 1), len(path) - 1], strict=True):
        if hole[first] < 0:
            continue
        first += _rises_first(words, z, int(first), int(last))
        level = float(words[first - 1, z]) if first > 0 else np.inf
        initial = before_initial if previous_last == first - 1 else level
        before_initial, previous_last = initial, last
        key = _key(toolpath.cycles[int(moves.cycle[path.move[first]])].kind, int(turning[moves.row[path.move[first]]]))
        found = _hole(toolpath, moves, path, words, control, controller, int(first), int(last), initial, key)
        if found is not None:
            holes.append(found)
            native[first:last + 1] = True
    return native, holes


def _rises_first(words: Floats, z: int, first: int, last: int) -> bool:
    """True where block `first` only lifts the tool to the clearance plane.

    It stays a block of its own: inside a sequence of cycles LinuxCNC goes aslant to a higher plane under G99, others
    cross over before they rise.
    """
    step = words[first] - words[first - 1]
    return 0 < first < last and bool(step[z] > 0.0) and not np.delete(step, z).any()


def _hole(toolpath: Toolpath, moves: Moves, path: Path, words: Floats, control: Control, controller: ControllerFile,
          first: int, last: int, initial: float, key: str) -> Hole | None:
    cycle = toolpath.cycles[int(moves.cycle[path.move[first]])]
    spec = controller.cycles.with_dwell if cycle.dwell > 0.0 else controller.cycles.table
    phases = moves.phase[path.move[first:last + 1]]
    bottom = first + int(np.flatnonzero(phases == Phase.DRILL)[-1])
    columns = [c for c in range(words.shape[1]) if c != int(control.xyz[2])]
    z = int(control.xyz[2])
    start = first + int(np.flatnonzero(phases <= Phase.APPROACH)[-1]) if (phases <= Phase.APPROACH).any() else first - 1
    along = bool((words[start:last + 1][:, columns] == words[start, columns]).all())
    plane, out = float(words[start, z]), float(words[last, z])
    if key not in spec or not along or words[bottom, z] >= plane or len(set(cycle.steps)) > 1:
        return None
    if abs(out - plane) > 1e-9 and abs(out - initial) > 1e-9:
        return None
    return Hole(first, last, int(moves.cycle[path.move[first]]), plane, float(words[bottom, z]), out, initial, key)


def _slowed(feeds: Feeds, moves: Moves, path: Path, file: str) -> list[Diagnostic]:
    rows = np.flatnonzero(feeds.slowed)
    if not len(rows):
        return []
    share = path.seconds[rows] / feeds.seconds[rows]
    return [info("feed.reduced", f"feed reduced to {100.0 * share.min():.1f} % at the least, where an axis would be "
                 "faster than its limit", file=file, lines=np.unique(moves.line[path.move[rows]])[:6].tolist(),
                 count=len(rows))]


def _key(kind: str, turning: int) -> str:
    """The controller's table tells taps that turn anti-clockwise from the others; a tap that stands has no entry."""
    return kind if kind != "TAP" else {1: "TAP", -1: "TAP_LEFT"}.get(turning, "")


def _not_native(toolpath: Toolpath, moves: Moves, path: Path, native: Bools, controller: ControllerFile) -> list[Diagnostic]:
    """Cycles that single moves do not replace and that could not be written as canned cycles."""
    only = np.array([c.kind not in SINGLE_MOVES or c.kind in controller.cycles.rigid_only for c in toolpath.cycles],
                    dtype=bool)
    rows = np.flatnonzero((moves.phase == Phase.DRILL) & (moves.cycle >= 0))
    rows = rows[only[moves.cycle[rows]]] if len(only) else rows[:0]
    rows = rows[~native[np.minimum(path.begin[rows], len(native) - 1)]]
    turning = spindle_states(toolpath)[0][moves.row[rows]]
    keys = np.array([_key(toolpath.cycles[int(moves.cycle[m])].kind, int(t)) or "TAP without a turning spindle"
                     for m, t in zip(rows, turning, strict=True)], dtype=str)
    result = []
    for key in np.unique(keys):
        lines = moves.line[rows[keys == key]]
        known = str(key) in controller.cycles.table or str(key) in controller.cycles.with_dwell
        hint = "the tool must stand along the machine's Z, the retract level must be the clearance plane or the level the " \
            "tool comes from, a dwell needs an entry in cycles.with_dwell" if known else \
            f"the controller's cycles.table has no {key}; take another cycle in the CAM system"
        result.append(error("cycle.not_native", f"a cycle {key} cannot be written as single moves, and this one not as a "
                            "canned cycle", file=toolpath.file, lines=lines[:6].tolist(), count=len(lines), hint=hint))
    return result


def rounding_problem(bound: Rounding, tolerance: float, axis_tolerance: float) -> list[Diagnostic]:
    """Rounding of the words may take a half of the tolerances at most: the rest is for the path."""
    if bound.tip <= tolerance / 2.0 and bound.axis <= axis_tolerance / 2.0:
        return []
    return [error("tolerance.rounding", f"rounding of the words alone may move the tip by {bound.tip:.6f} mm and the axis "
                  f"by {bound.axis / DEG:.6f} degrees, of {tolerance:g} mm and {axis_tolerance / DEG:g} degrees that are "
                  "allowed beside the control's own smoothing", hint="more decimals in the controller's [format], or a "
                  "wider --tolerance, --axis-tolerance")]
