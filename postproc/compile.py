"""Path to canonical Program: words rounded, feeds, commands at their places, holes that may become canned cycles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.canned import holes_of, not_native
from postproc.commands import Commands, commands_of
from postproc.control import Control
from postproc.controllers.model import ControllerFile
from postproc.feed import Feeds, Planned, plan_feeds
from postproc.moves import Moves
from postproc.path import ARC, Path
from postproc.program import Command, Hole, Program
from postproc.rounding import decimals
from postproc.sections import sections_of, with_sections
from postproc.word_rows import word_rows
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, info
from toolpaths.toolpath import Toolpath


def compile_program(toolpath: Toolpath, moves: Moves, path: Path, control: Control, controller: ControllerFile,
                    kinematics: Callable[[int], Kinematics], lengths: Callable[[int], float],
                    feed_mode: str, planned: Planned | None = None,
                    made_up: bool = False, restart: bool = False) -> tuple[Program, Feeds, list[Diagnostic]]:
    """The canonical program of a path; `lengths` gives the gauge length of the tool of an index, `planned` the feeds
    that the plan allows, `made_up` as in `Rounding`; with `restart` every operation restates its tool."""
    places = decimals(control, controller)
    words = word_rows(path, moves, control, kinematics, lengths, places, made_up)
    native, holes = holes_of(toolpath, moves, path, words, control, controller)
    feeds = plan_feeds(path, control, words.end - words.start, moves.feed[path.move],
                       toolpath.pass_[moves.row[path.move]], native, feed_mode, controller.feed, planned)
    commands, diagnostics = commands_of(toolpath, moves, path, controller, native, restart)
    keep = words.write.any(axis=1) | (path.code == ARC)
    new = np.concatenate([[0], np.cumsum(keep)])
    sections = sections_of(path, new)
    kept_holes = tuple(Hole(int(new[h.first]), int(new[h.last + 1]) - 1, h.cycle, h.plane_level, h.bottom, h.retract,
                            h.initial, h.key, int(new[h.drill])) for h in holes)
    end = np.where(path.home[:, None], np.round(path.q * control.unit, int(places.max())), words.end)
    program = Program(control.machine.axis_names, end[keep], words.write[keep], path.code[keep], feeds.feed[keep],
                      feeds.mode[keep], path.plane[keep], path.ccw[keep], path.center[keep], path.home[keep],
                      np.isnan(path.u[keep]), moves.row[path.move[keep]], moves.line[path.move[keep]],
                      with_sections(_moved(commands, new), sections), kept_holes, places, sections)
    return program, feeds, diagnostics + _slowed(feeds, moves, path, planned is not None, toolpath.file) + not_native(
        toolpath, moves, path, native, controller)


def _moved(commands: Commands, new: Ints) -> Commands:
    """The commands at the blocks that are left, `new` (K + 1,) being the new number of each."""
    moved: dict[int, tuple[Command, ...]] = {}
    for k, group in sorted(commands.items()):
        moved[int(new[k])] = moved.get(int(new[k]), ()) + group
    return moved


def _slowed(feeds: Feeds, moves: Moves, path: Path, planned: bool, file: str) -> list[Diagnostic]:
    rows = np.flatnonzero(feeds.slowed)
    if not len(rows):
        return []
    share = path.seconds[rows] / feeds.seconds[rows]
    excess = "exceed its velocity, acceleration or jerk" if planned else "be faster than its limit"
    return [info("feed.reduced", f"feed reduced to {100.0 * share.min():.1f} % at the least, where an axis would "
                 f"{excess}", file=file, lines=np.unique(moves.line[path.move[rows]])[:6].tolist(),
                 count=len(rows))]
