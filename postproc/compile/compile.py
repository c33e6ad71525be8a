"""Path to canonical Program: words rounded, feeds, commands at their places, holes that may become canned cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.compile.block_delete import after, skipped, with_skips
from postproc.compile.canned import holes_of
from postproc.compile.clamps import with_clamps
from postproc.compile.commands import commands_of
from postproc.compile.contour_words import contour_words
from postproc.compile.cubic_blocks import cubic_blocks
from postproc.compile.cycle_refusals import as_moves, not_native
from postproc.compile.feed import Feeds, PlannedTimes, plan_feeds
from postproc.compile.hooks import with_hooks
from postproc.compile.long_turns import long_turns, standing_unsaid, without_standing
from postproc.compile.program import Command, Commands, Hole, Program
from postproc.compile.sections import sections_of, with_sections
from postproc.compile.smoothing import with_smoothing
from postproc.compile.word_rows import WordRows, block_tools, joints_of, with_turns, word_rows
from postproc.job.job import Job
from postproc.path.model import ARC, JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints, distinct, shared, taken
from toolpaths.diagnostics import Diagnostic, info

if TYPE_CHECKING:
    from postproc.correction.backlash_words import Writing


def compile_program(job: Job, moves: Moves, path: JointPath,
                    planned: PlannedTimes | None = None,
                    apart: Bools | None = None) -> tuple[Program, Feeds, list[Diagnostic]]:
    """The canonical program of a path along `moves`; `planned` are the feeds that the plan allows, blocks
    that are `apart` (K,) no part of canned cycles."""
    toolpath, control, controller = job.toolpath, job.control, job.controller
    skip = skipped(toolpath, moves, path)
    words = words_of(job, moves, path, after(skip))
    native, holes = holes_of(toolpath, moves, path, words, control, controller,
                             skip if apart is None else skip | apart)
    feeds = plan_feeds(path, control, words.end - words.start, moves.feed[path.move],
                       toolpath.pass_[moves.row[path.move]], native, job.options.feed_mode, controller.feed,
                       planned, controller.feed_unit)
    commands, diagnostics = commands_of(toolpath, moves, path, controller, native, job.setup.output.apart,
                                        job.setup.output.tool_call, job.setup.output.stop_between_tools, job.cutcom)
    contour, commands, refused = contour_words(job, moves, path, words, commands)
    cubics = cubic_blocks(job, moves, path, words, feeds, commands, skip if apart is None else skip | apart)
    end, home = np.array(cubics.ended(contour.words.end, control.xyz)), np.flatnonzero(path.home)
    end[home] = job.grid.trimmed(path.q[home] * control.unit)
    write = without_standing(contour.words.write, end, control.rolls)
    write = cubics.written(write, words, control.xyz, job.grid.grain.min()) if len(cubics.curves) else write
    keep = (write.any(axis=1) | (path.code == ARC)) & ~contour.dropped & ~cubics.dropped
    new = np.concatenate([[0], np.cumsum(keep)])
    sections = sections_of(job, moves, path, new)
    kept_holes = tuple(Hole(int(new[h.first]), int(new[h.last + 1]) - 1, h.cycle, h.plane_level, h.bottom, h.retract,
                            h.initial, h.key, int(new[h.drill])) for h in holes)
    line = moves.line[path.move[keep]]
    placed, found = with_skips(with_sections(_moved(commands, new), sections, line), skip[keep], line,
                               toolpath.file)
    program = Program(control.machine.axis_names, end[keep], write[keep], path.code[keep], feeds.feed[keep],
                      shared(feeds.mode[keep]), taken(path.plane, keep), taken(path.ccw, keep),
                      shared(taken(contour.center, keep)), path.home[keep], np.isnan(path.u[keep]),
                      moves.row[path.move[keep]], line, placed, kept_holes, job.grid.places, sections, shared(skip[keep]),
                      shared(cubics.numbers()[keep]), cubics.curves,
                      control.rolls, control.machine.home * control.unit,
                      tuple(a for a, turns in zip(control.machine.axis_names, control.machine.rotary, strict=True) if turns),
                      shared(cubics.polygon.numbers(len(path))[keep]))
    found += [*refused, *long_turns(program, toolpath.file)]
    program = with_smoothing(program, job.smoothing, toolpath)
    program = with_clamps(program, control.machine, controller.plane_turns)
    program = with_hooks(program, job.hooks, {tool.number: tool.name for tool in reversed(toolpath.tools)})
    found += standing_unsaid(control.rolls, control.machine.axis_names, job.setup.output.apart, bool(skip.any()),
                             toolpath.file)
    return program, feeds, [*diagnostics, *found, *_slowed(feeds, moves, path, planned is not None, job),
                            *_mapped(feeds, moves, path, job),
                            *not_native(toolpath, moves, path, native, controller, skip),
                            *as_moves(toolpath, moves, path, native, controller, skip)]


def words_of(job: Job, moves: Moves, path: JointPath, again: Ints | None = None) -> WordRows:
    """The words of a path's blocks; the blocks `again` state every axis."""
    return word_rows(path, moves, job.control, job.kinematics, job.offset_length, job.grid,
                     np.zeros(0, dtype=np.int64) if again is None else again, job.rounding.made_up, job.bidirectional,
                     job.corrects)


def writing_of(job: Job, moves: Moves) -> Writing:
    """How paths along `moves` are written, for the correction of geometric errors."""
    from postproc.correction.backlash_words import Writing

    def joints(path: JointPath, words: Floats, rows: Ints) -> Floats:
        return joints_of(path, words, rows, block_tools(path, moves), job.kinematics, job.offset_length)

    def turned(path: JointPath, q: Floats, rows: Ints) -> Floats:
        return with_turns(q, path.q[rows], path, rows, block_tools(path, moves), job.kinematics,
                          job.rounding.made_up)

    return Writing(lambda path: words_of(job, moves, path).end, joints, turned, job.grid.grain)


def _moved(commands: Commands, new: Ints) -> Commands:
    """The commands at the blocks that are left, `new` (K + 1,) being the new number of each."""
    moved: dict[int, tuple[Command, ...]] = {}
    for k, group in sorted(commands.items()):
        moved[int(new[k])] = moved.get(int(new[k]), ()) + group
    return moved


def _mapped(feeds: Feeds, moves: Moves, path: JointPath, job: Job) -> list[Diagnostic]:
    """Cuts that turn rotary axes under machine coordinates, per minute as the controller has no inverse time."""
    if job.controller.feed.inverse_time or job.options.feed_mode != "auto" or not len(job.control.rotary):
        return []
    axes = np.array([frame.control.law == "axes" for frame in path.frames])[path.frame]
    turned = np.zeros(len(path), dtype=bool)
    turned[1:] = (path.q[1:, job.control.rotary] != path.q[:-1, job.control.rotary]).any(axis=1)
    rows = np.flatnonzero(axes & turned & np.isfinite(feeds.feed))
    if not len(rows):
        return []
    rule = {"xyz-first": "X, Y, Z before rotary axes", "geometry": "X, Y, Z before rotary axes",
            "all": "the root of the squares of mm and degrees"}[job.controller.feed.length]
    return [info("feed.no_inverse_time", "the controller has no inverse time: blocks that turn rotary axes are written per "
                 f"minute by its rule, {rule}", file=job.toolpath.file,
                 lines=np.unique(moves.line[path.move[rows]])[:6].tolist(), count=len(rows))]


def _slowed(feeds: Feeds, moves: Moves, path: JointPath, planned: bool, job: Job) -> list[Diagnostic]:
    rows = np.flatnonzero(feeds.slowed)
    if not len(rows):
        return []
    share = path.seconds[rows] / feeds.seconds[rows]
    excess = "exceed its velocity, acceleration or jerk" if planned else "be faster than its limit"
    if planned and any(tool.limited for tool in job.setup.tools.values()):
        excess += ", or the tool a limit of the set-up"
    return [info("feed.reduced", f"feed reduced, down to {100.0 * share.min():.1f} %, where an axis would "
                 f"{excess}", file=job.toolpath.file, lines=distinct(moves.line[path.move[rows]])[:6].tolist(),
                 count=len(rows))]
