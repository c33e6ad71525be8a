"""Holes that the controller can drill by itself, as canned cycles."""

from __future__ import annotations

import numpy as np

from postproc.compile.program import CycleKey, Hole
from postproc.compile.word_rows import WordRows
from postproc.control.control import Control
from postproc.controllers.cycles import CannedCycle
from postproc.controllers.model import ControllerFile
from postproc.path.model import FEED, TRAVERSE, JointPath
from postproc.reference.events import spindle_states
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Ints
from toolpaths.choices import CycleKind
from toolpaths.toolpath import Cycle, Kind, Toolpath

ROUNDED = 1.5
"""last decimals by which words along a hole may differ in a plane whose printed angles are rounded"""
LEAST_SHARE = 0.001
"""of the first peck: what cycles can state (CYCLE83, DAM)"""
ROUND_OFF = 1e-9
LAST_PECK = 0.02
"""mm: a last peck of less is none of its own: to the read-back its two depths are one"""


def holes_of(toolpath: Toolpath, moves: Moves, path: JointPath, words: WordRows, control: Control,
             controller: ControllerFile, skip: Bools) -> tuple[Bools, list[Hole]]:
    """Blocks of holes that the controller can drill by itself, and the holes; not among blocks that a switch may `skip`.

    Native where the tool stands along Z of the words, the kind is in the controller's table and the retract
    ends at the clearance plane, at the level that the tool came from, or at one that the cycle states. Cycles
    that feed out and then rise higher end at the clearance plane, the rest is a rapid behind them. Controls
    that rise first (`cycles.rises_first`) go back to the first level of a sequence only from there.
    """
    native = np.zeros(len(path), dtype=bool)
    holes: list[Hole] = []
    z = int(control.xyz[2])
    if not controller.cycles.enabled or 17 not in controller.cycles.planes or not (moves.hole >= 0).any():
        return native, holes
    if (control.xyz < 0).any():  # a cycle goes from hole to hole by the words X, Y
        return native, holes
    allowed = np.array([may_cycle(f.control, controller) for f in path.frames])[path.frame] & ~skip
    hole = np.where(np.isnan(path.u), -1, moves.hole[path.move])
    turning = spindle_states(toolpath)[0]
    change = np.flatnonzero(np.diff(hole)) + 1
    switched = {e.index for e in toolpath.events}
    before_initial, previous_last, cut = 0.0, -2, False
    for first, last in zip([0, *change], [*(change - 1), len(path) - 1], strict=True):
        if hole[first] < 0:
            continue
        first += _rises_first(words, z, int(first), int(last), _slack(path, controller, first))
        first, last = _without_feeding_rapids(moves, path, int(first), int(last))
        first += _before_own_level(moves, path, words, z, first, last)
        first += _points_between(moves, path, first, last)
        placed = _placed_before(moves, path, allowed, first, last)
        first += placed
        level = float(words.start[first, z]) if first > 0 else np.inf
        initial = before_initial if previous_last == first - 1 else level
        # A command before the hole ends the sequence: what the control takes for its first level then is where the tool is.
        low = level < initial - 1e-9
        cut = previous_last == first - 1 and (cut or (low and int(moves.row[path.move[first]]) in switched))
        low = cut or (low and controller.cycles.rises_first)
        key = cycle_key(toolpath.cycles[int(moves.cycle[path.move[first]])].kind,
                        int(turning[moves.row[path.move[first]]]))
        if not _states_retract(controller, key):
            slack = _slack(path, controller, first)
            last -= _rises_beyond(moves, path, words, z, first, last, -np.inf if low else initial + slack)
        found = _hole(toolpath, moves, path, words, control, controller, int(first), int(last), initial,
                      key, placed > 0)
        if low and found is not None and found.retract > found.plane_level and not _states_retract(controller, key):
            continue
        if found is not None and allowed[first:last + 1].all():
            before_initial, previous_last = initial, last
            holes.append(found)
            native[first:last + 1] = True
    return native, holes


def may_cycle(control: Control, controller: ControllerFile) -> bool:
    """True where canned cycles may stand under the law of a control."""
    modes = controller.modes
    if control.law == "axes" or control.base == control.law:
        return True
    mode = modes.tcp if control.law == "tcp" else modes.tilted
    return mode is not None and mode.cycles


def _rises_first(words: WordRows, z: int, first: int, last: int, slack: float) -> bool:
    """True where block `first` only lifts the tool to the clearance plane.

    It stays a block of its own: inside a sequence of cycles LinuxCNC goes aslant to a higher plane under G99, others
    cross over before they rise.
    """
    step = words.end[first] - words.start[first]
    return 0 < first < last and bool(step[z] > slack) and not (np.abs(np.delete(step, z)) > slack).any()


def _before_own_level(moves: Moves, path: JointPath, words: WordRows, z: int, first: int, last: int) -> int:
    """How many blocks of a hole come down to the level that it retracts to: they stay blocks of their own."""
    placing = moves.phase[path.move[first:last + 1]] == Phase.POSITION
    level = np.abs(words.end[first:last + 1, z] - words.end[last, z]) < 1e-9
    lowered = words.end[first:last + 1, z] < words.start[first:last + 1, z]
    found = np.flatnonzero(placing & level & lowered)
    return int(found[-1]) + 1 if len(found) else 0


def _points_between(moves: Moves, path: JointPath, first: int, last: int) -> int:
    """How many blocks keep the tip straight over to a hole where the slides do not: they stay blocks of their
    own, for a cycle goes there in one block."""
    straight = np.array([f.control.tips_straight for f in path.frames])[path.frame[first:last + 1]]
    placing = moves.phase[path.move[first:last + 1]] <= Phase.APPROACH
    found = np.flatnonzero(placing & ~straight & (path.u[first:last + 1] < 1.0))
    return int(found[-1]) + 1 if len(found) else 0


def _placed_before(moves: Moves, path: JointPath, allowed: Bools, first: int, last: int) -> int:
    """How many blocks bring the tool over a hole that are not `allowed` (K,) in its cycle: they stay blocks of their own."""
    inside = np.flatnonzero(allowed[first:last + 1] | (moves.phase[path.move[first:last + 1]] > Phase.APPROACH))
    return int(inside[0]) if len(inside) else 0


def _rises_beyond(moves: Moves, path: JointPath, words: WordRows, z: int, first: int, last: int,
                  initial: float) -> bool:
    """True where block `last` goes on in rapid, from the plane that the cycle feeds out to, to above its initial level.

    No code of a cycle goes there: it stays a block of its own behind the cycle.
    """
    fed_out = last > first and path.code[last - 1] == FEED and moves.phase[path.move[last - 1]] == Phase.RETRACT
    return bool(fed_out and path.code[last] == TRAVERSE and words.end[last, z] > initial)


def _states_retract(controller: ControllerFile, key: CycleKey) -> bool:
    """True where the controller's cycle names the level that it retracts to."""
    cycles = controller.cycles
    specs = [table[key] for table in (cycles.table, cycles.with_dwell, cycles.falling) if key in table]
    return any(spec.states_retract for spec in specs)


def _slack(path: JointPath, controller: ControllerFile, block: int) -> float:
    """mm by which words of one level may differ."""
    tilted = path.frames[int(path.frame[block])].control.law == "tilted"
    return ROUNDED * controller.grain if tilted else 1e-9


def _without_feeding_rapids(moves: Moves, path: JointPath, first: int, last: int) -> tuple[int, int]:
    """The blocks of a hole without rapids at its ends that are written at feed (`rapid_codes`).

    They stay blocks of their own: the cycle begins over the hole, or at its clearance plane, and ends there.
    """
    own = feeding_rapid(moves, path, np.arange(first, last + 1))
    inner, over = np.flatnonzero(~own), np.flatnonzero(own & (moves.phase[path.move[first:last + 1]] == Phase.POSITION))
    return first + max(int(inner[0]), int(over[-1]) + 1 if len(over) else 0), first + int(inner[-1])


def feeding_rapid(moves: Moves, path: JointPath, blocks: Ints) -> Bools:
    """(N,) blocks that are rapids of the CL file written at feed."""
    return np.asarray((path.code[blocks] == FEED) & (moves.kind[path.move[blocks]] == Kind.RAPID))


def _hole(toolpath: Toolpath, moves: Moves, path: JointPath, rows: WordRows, control: Control, controller: ControllerFile,
          first: int, last: int, initial: float, key: CycleKey, placed: bool) -> Hole | None:
    """The hole of blocks `first` to `last`; the tool goes to the very place at the plane where blocks of
    their own have `placed` it there."""
    cycle = toolpath.cycles[int(moves.cycle[path.move[first]])]
    phases = moves.phase[path.move[first:last + 1]]
    bottom = first + int(np.flatnonzero(phases == Phase.DRILL)[-1])
    z = int(control.xyz[2])
    words = np.concatenate([rows.start[first:first + 1], rows.end[first:last + 1]])
    start = int(np.flatnonzero(phases <= Phase.APPROACH)[-1]) + 1 if (phases <= Phase.APPROACH).any() else 0
    slack = _slack(path, controller, first)
    down = words[start + (placed and start == 0):]
    along = bool((np.abs(np.delete(down, z, axis=1) - np.delete(down[0], z)) <= slack).all())
    plane, out, deepest = float(words[start, z]), float(words[-1, z]), float(words[bottom - first + 1, z])
    if feeding_rapid(moves, path, np.arange(first, last + 1)).any() or phases[-1] == Phase.DRILL:
        return None
    if cycle_spec(controller, cycle, key) is None or not along or deepest >= plane:
        return None
    near = [level for level in (plane, initial) if abs(out - level) <= slack]
    if not near and not _states_retract(controller, key):
        return None
    out = near[0] if near else out
    return Hole(first, last, int(moves.cycle[path.move[first]]), plane, deepest, out, initial, key, bottom)


def cycle_spec(controller: ControllerFile, cycle: Cycle, key: CycleKey) -> CannedCycle | None:
    """The controller's cycle that makes a hole as the CL file has it; None where it has none that is equal.

    Pecks that are not all alike are equal only to a cycle with a first step, a decrement and a least step: first
    1STPECK, decrement 1STPECK - SUBPECK, least SUBPECK, where SUBPECK is the smaller one (DEEP2 of SolidWorks), and the last
    one is no crumb.
    """
    cycles = controller.cycles
    if len(set(cycle.steps)) <= 1:
        return (cycles.with_dwell if cycle.dwell > 0.0 else cycles.table).get(key)
    spec = cycles.falling.get(key) if falls(cycle) and not ends_short(cycle) else None
    says = spec is not None and (spec.dwell or "{dwell}" in spec.code)
    return spec if says or not cycle.dwell > 0.0 else None


def falls(cycle: Cycle) -> bool:
    """True where all pecks behind the first are one smaller one, of a thousandth of it at least."""
    return len(cycle.steps) == 2 and LEAST_SHARE * cycle.steps[0] <= cycle.steps[1] < cycle.steps[0]


def ends_short(cycle: Cycle) -> bool:
    """True where pecks of two depths, from the surface or from the start plane, leave next to nothing for the last."""
    rests = [deep - cycle.steps[0] for deep in (cycle.depth, cycle.depth + cycle.clearance)]
    return any(rest > ROUND_OFF and ROUND_OFF < rest % cycle.steps[1] < LAST_PECK for rest in rests)


def cycle_key(kind: CycleKind, turning: int) -> CycleKey:
    """The controller's table says taps that turn anti-clockwise from the others; a tap that stands has no entry."""
    if kind != "TAP":
        return kind
    return "TAP" if turning == 1 else "TAP_LEFT" if turning == -1 else ""
