"""The form that the set-up asks of a program, which no position shows: modes, restarts, subprograms, names, places."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.clamps import cutting_rows
from postproc.readback.comparison.faults import Faults
from postproc.readback.comparison.tool_changes import AWAY
from postproc.readback.comparison.unstated_codes import needs, unstated_between
from postproc.readback.dialects.base import Reader, as_bytes
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import COOLANT, INCREMENTAL, LOADED, REGISTER, SMOOTH, Canonical
from postproc.readback.text.modal import codes
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic

HEAD = 2000
"""characters in which the program is named"""
_FIELD = re.compile(r"\\\{\w+\\\}")


def check_asked(data: bytes | str, code: Canonical, motion: Motion, job: Job, reader: Reader, owner: Ints, home: Floats,
                faults: Faults) -> list[Diagnostic]:
    """What the program has otherwise than the set-up asks; `owner` (E,): the move that each row serves."""
    moves = job.moves.without_pecks()
    row = moves.row[np.clip(owner, 0, len(moves) - 1)]
    operation = np.where(owner < len(moves), job.toolpath.operation[row], -1)
    cut = cutting_rows(motion, job, owner)
    head = as_bytes(data[:HEAD]).decode("utf-8", "replace")
    return [*_modes(motion, job, operation, cut, faults), *_restarts(code, motion, job, reader, operation, cut, faults),
            *_divided(data, job, faults), *_named(head, job, faults), *_between(motion, job, owner, home, faults)]


def _modes(motion: Motion, job: Job, operation: Ints, cut: Bools, faults: Faults) -> Iterator[Diagnostic]:
    """Operations that are cut in another output mode than the set-up, or the command, asks for."""
    output, law = job.setup.output, np.array([frame.law for frame in motion.frames])[motion.frame]
    default = output.default if job.options.output == "auto" else job.options.output
    for k, one in enumerate(job.toolpath.operations if not job.control.tip_law else ()):
        asked = output.operations.get(one.name, default)
        bad = np.flatnonzero((operation == k) & cut & (law != asked))
        if asked != "auto" and len(bad):
            yield faults.warning("verify.asked", f"operation {one.name or k + 1} is cut in the mode {law[bad[0]]}, "
                                 f"the set-up or the command asks for {asked}", one.line, int(motion.line[bad[0]]), len(bad),
                                 "convert again with this set-up, or ask for the mode of the program")


def _restarts(code: Canonical, motion: Motion, job: Job, reader: Reader, operation: Ints, cut: Bools,
              faults: Faults) -> Iterator[Diagnostic]:
    """States that an operation does not state again, where the set-up asks that a program may be taken up at each: from
    behind the last block of the one before that goes nowhere but home."""
    if not job.setup.output.restart:
        return
    needed = list(needs(code, reader))
    machine = np.isin(motion.block, codes(code.words, "G", (53,))[0])
    begins = np.flatnonzero(np.diff(operation, prepend=operation[:1]) != 0)
    for a, b in pairwise([*begins.tolist(), len(operation)]):
        cuts = a + np.flatnonzero(cut[a:b])
        if operation[a] < 0 or not len(cuts):
            continue
        homes = a + np.flatnonzero(machine[a:int(cuts[0])])
        label = int(motion.block[max(int(homes[0]) if len(homes) else int(a), 1) - 1]) + 1
        unstated = unstated_between(needed, label, int(motion.block[b - 1]))
        lacks = [*(reader.stating[what] for what in unstated), *_unnamed(code, motion, int(cuts[0]), label),
                 *_unplaced(code, motion, job, int(cuts[0]), label)]
        if lacks:
            one = job.toolpath.operations[int(operation[a])]
            name = one.name or operation[a] + 1
            yield faults.error("verify.asked", f"the program cannot be taken up at operation {name}: nothing states "
                               f"{', '.join(lacks)} there again", one.line, int(motion.line[a]), 1,
                               "convert again with this set-up, or take restart out of its [output]")


def _unnamed(code: Canonical, motion: Motion, row: int, label: int) -> Iterator[str]:
    """What is in force in a row that cuts and is not stated from block `label` on: tool, spindle, coolant, smoothing."""
    words, block = code.words, int(motion.block[row])
    loaded, lengths, units = words.pick(LOADED)[0], words.pick(REGISTER)[0], codes(words, "G", (20, 21))[0]
    smoothing = words.pick(SMOOTH)[0]
    stated = {"the units": units if len(units) else None,
              "the tool": loaded if motion.register[row] < 0 else np.concatenate([loaded, lengths]),
              "the spindle": codes(words, "M", (3, 4))[0] if motion.spindle[row] else None,
              "the smoothing": smoothing if (smoothing <= block).any() else None,
              "the coolant": words.pick(COOLANT)[0] if motion.coolant[row] else None,
              "the feed": None if motion.hole[row] else words.pick("F")[0]}
    for what, blocks in stated.items():
        if blocks is not None and not ((blocks >= label) & (blocks <= block)).any():
            yield what


def _unplaced(code: Canonical, motion: Motion, job: Job, row: int, label: int) -> Iterator[str]:
    """Axes that nothing moves to their place between block `label` and a row that cuts, and clamps that nothing opens before
    they turn: nobody knows where they stand there. A plane may turn rotary axes without words of theirs."""
    words, block, machine = code.words, int(motion.block[row]), job.machine
    turned_by_plane = motion.frames[int(motion.frame[row])].law == "tilted" and job.controller.plane_turns
    for letter, turns in zip(machine.axis_names, machine.rotary, strict=True) if not job.control.tip_law else ():
        placed = np.concatenate([words.pick(letter)[0], words.pick(chr(ord(letter) + INCREMENTAL))[0]])
        placed = placed[(placed >= label) & (placed <= block)]
        if not len(placed) and not (turns and turned_by_plane):
            yield f"where {letter} stands"
        if letter in machine.clamp_codes and len(placed):
            free, _ = codes(words, "M", (float(machine.clamp_codes[letter].unclamp[1:]),))
            if not ((free >= label) & (free < placed.min())).any():
                yield f"that the clamp of {letter} is open"


def _divided(data: bytes | str, job: Job, faults: Faults) -> Iterator[Diagnostic]:
    """Fewer calls of subprograms than operations, where each is to be one."""
    call = job.controller.subprograms.call if job.setup.output.divided else ""
    count = len(job.operation_starts())
    pattern = _FIELD.sub(r"\\w+", re.escape(call))
    calls = len(re.findall(rf"(?m)^(?:N?\d+ )?{pattern}\s*$".encode(), as_bytes(data))) if call else count
    if calls < count:
        yield faults.warning("verify.asked", f"the program calls {calls} subprograms, the set-up asks for one for each of "
                             f"{count} operations", 0, 1,
                             hint="convert again with this set-up, or take subprograms and files out of its [output]")


def _named(head: str, job: Job, faults: Faults) -> Iterator[Diagnostic]:
    """Another number or name than the set-up gives the program, where the control's programs state it."""
    output, begin = job.setup.output, "\n".join(job.controller.program.begin)
    for key, value, field in (("program_number", output.program_number, "{number}"), ("program_name", output.program_name,
                                                                                   "{name}")):
        said = f"{value:04d}" if isinstance(value, int) else str(value).upper()
        for block in begin.splitlines() if value is not None else ():
            if field in block and not re.search(_FIELD.sub(r"\\S+", re.escape(block.replace(field, said))), head):
                yield faults.warning("verify.asked", f"the program does not begin with {key} {said} of the set-up", 0, 1,
                                     hint="convert again with this set-up")


def _between(motion: Motion, job: Job, owner: Ints, home: Floats, faults: Faults) -> Iterator[Diagnostic]:
    """Two places between which the tool does not go home, where the set-up has it so."""
    home_asked = job.setup.clearance.between == "home" and job.machine.retract_axis is not None and not job.corrects
    if job.repeats is None or not home_asked:
        return
    lift, moves = job.machine.retract_axis, job.moves.without_pecks()
    place = job.repeats.place[moves.row][np.clip(owner, 0, len(moves) - 1)]
    cut = np.flatnonzero(cutting_rows(motion, job, owner))
    changes = np.flatnonzero(np.diff(place[cut]) != 0)
    for a, b in zip(cut[changes].tolist(), cut[changes + 1].tolist(), strict=True):
        if np.abs(motion.end[a:b, lift] - home[lift]).min() > AWAY:
            name = job.machine.axis_names[lift]
            yield faults.error("verify.asked", f"the tool goes from one place to the next while {name} is away from home", 0,
                               int(motion.line[b]), 1, f'retract {name} to home between them, or write between = "plane" '
                               "under [clearance] of the set-up")
            return
