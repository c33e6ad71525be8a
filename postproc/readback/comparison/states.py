"""What is in force while a program cuts: tool, spindle, coolant, compensation, work offset."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.checks import CHUNK
from postproc.readback.comparison.faults import Faults
from postproc.readback.dialects.base import Reader
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.execute import Motion
from postproc.reference.coolant import ANY, coolant_states, label
from postproc.reference.events import (
    compensation_side,
    compensation_states,
    loaded_registers,
    loaded_tools,
    numbers,
    spindle_states,
    state_at,
    tool_loads,
)
from postproc.reference.moves import Moves
from toolpaths.arrays import Array, Bools, Floats, Ints, shared
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind

_SPINDLE = {-1: "anti-clockwise (M4)", 0: "stopped (M5)", 1: "clockwise (M3)"}


@dataclass(frozen=True)
@arrays(offset="N", tool="N", register="N", direction="N", rpm="N", coolant="N", side="N", radius="N")
class _Asked:
    """What the CL file asks for while it cuts, by row of the Toolpath, and the work offset of its place."""

    offset: Floats
    tool: Ints
    register: Ints
    direction: Ints
    rpm: Floats
    coolant: Ints
    side: Ints
    radius: Floats

    @classmethod
    def of(cls, job: Job, reader: Reader) -> _Asked:
        """That of a job."""
        direction, rpm = spindle_states(job.toolpath)
        place = np.zeros(len(job.toolpath), dtype=np.int64) if job.repeats is None else job.repeats.place
        offset = np.array(registers_of(job, reader))[place]
        coolant = coolant_states(job.toolpath, job.controller.codes)
        columns = (offset, loaded_tools(job.toolpath), loaded_registers(job.toolpath), direction, rpm, coolant,
                   compensation_states(job.toolpath), _radius_registers(job))
        return cls(*map(shared, columns))


def registers_of(job: Job, reader: Reader) -> list[float]:
    """The number of the register that holds the work offset of each place."""
    program = job.controller.program
    return [reader.offset_of(program.offset_text(place.code)) for place in job.places]


def check_states(motion: Motion, job: Job, moves: Moves, owner: Ints, down: Bools,
                 faults: Faults) -> list[Diagnostic]:
    """Tool, spindle, coolant, compensation and work offset while cutting, against the CL file and the set-up,
    in the order of the program; of linking moves only in what leads `down` (E,) to a cut at feed."""
    rows = np.flatnonzero((owner < len(moves)) & (motion.code > 0))
    rows = rows[(moves.kind[owner[rows]] != Kind.RAPID) & (~moves.link[owner[rows]] | down[rows])]
    reader = reader_for(job.controller, job.machine.axis_names)
    asked, first, count = _Asked.of(job, reader), dict[str, tuple[int, str]](), Counter[str]()
    for at in range(0, len(rows), CHUNK):
        here = rows[at:at + CHUNK]
        for what, good, found, wanted, name in _states(motion, job, asked, here,
                                                       moves.row[owner[here]], reader):
            bad = np.flatnonzero(~np.asarray(good))
            if len(bad):
                k = int(bad[0])
                first.setdefault(what, (int(here[k]), f"{what} is {name(found[k])}, it should be {name(wanted[k])}"))
                count[what] += len(bad)
    return _left_on(motion, moves, owner, asked, reader, down, faults) + [
        faults.error("verify.state", said, int(moves.line[owner[k]]), int(motion.line[k]), count[what], _HINTS.get(what, ""))
            for what, (k, said) in sorted(first.items(), key=lambda one: (one[1][0], _ORDER.index(one[0])))]


def _left_on(motion: Motion, moves: Moves, owner: Ints, asked: _Asked, reader: Reader, down: Bools,
             faults: Faults) -> list[Diagnostic]:
    """Cutter compensation on rapids and linking moves for which the CL file has none: the control shifts those too."""
    on = np.flatnonzero(motion.compensation != 40) if np.any(motion.compensation != 40) else np.zeros(0, dtype=np.int64)
    serving = np.minimum(owner[on], len(moves) - 1)
    linking = (owner[on] >= len(moves)) | moves.link[serving]
    cut = (motion.code[on] > 0) & (moves.kind[serving] != Kind.RAPID) & (owner[on] < len(moves)) & (
        ~moves.link[serving] | down[on])
    bad = on[(linking | (asked.side[moves.row[serving]] == 40)) & ~cut]
    if not len(bad):
        return []
    k = int(bad[0])
    line = int(moves.line[owner[k]]) if owner[k] < len(moves) else 0
    return [faults.error("verify.state", f"cutter compensation is {reader.sides[int(motion.compensation[k])]} on a rapid or "
                         "a positioning move without it", line, int(motion.line[k]), len(bad),
                         "cancel it before the tool leaves the cut")]


_HINTS = {
    "spindle": "state S with M3 or M4 before the cut; a tool change and, on most machines, M0 and M1 stop it",
    "coolant": "state it before the cut; a tool change and, on most machines, M0 and M1 switch it off",
    "length register": "put the length of the tool in the spindle in force before the cut",
}
_ORDER = ("tool", "spindle", "spindle speed", "coolant", "length register", "cutter compensation",
          "register of the cutter compensation", "work offset")


def _states(motion: Motion, job: Job, asked: _Asked, rows: Ints, row: Ints,
            reader: Reader) -> Iterator[tuple[str, Bools, Array, Array, Callable[[Any], str]]]:
    """(what, True where it is as asked for, what is found, what is wanted, the name of either) in the blocks
    `rows` (K,), which serve the rows `row` (K,) of the Toolpath."""
    def number(value: float) -> str:
        return f"{value:g}" if np.isfinite(value) and value >= 0 else "none"
    tool, register, direction, rpm = asked.tool[row], asked.register[row], asked.direction[row], asked.rpm[row]
    cooled, coolant, side, given = asked.coolant[row], motion.coolant[rows], asked.side[row], motion.compensation[rows]
    radius, wanted_radius, code = motion.radius[rows], asked.radius[row], asked.offset[row]
    same_speed = (np.abs(motion.rpm[rows] - rpm) <= 0.5) | np.isnan(rpm) | (direction == 0)
    yield "tool", motion.tool[rows] == tool, motion.tool[rows], tool, number
    yield "spindle", motion.spindle[rows] == direction, motion.spindle[rows], direction, _SPINDLE.__getitem__
    yield "spindle speed", same_speed, motion.rpm[rows], rpm, number
    yield ("coolant", np.where(cooled == ANY, coolant > 0, coolant == cooled), coolant, cooled,
           lambda bits: label(int(bits)))
    register = _registers_of(motion, job, rows, register)
    yield "length register", motion.register[rows] == register, motion.register[rows], register, number
    yield "cutter compensation", given == side, given, side, lambda g: reader.sides[int(g)]
    yield ("register of the cutter compensation", (radius == wanted_radius) | np.isnan(wanted_radius) | (given == 40),
           radius, wanted_radius, number)
    yield ("work offset", motion.offset[rows] == code, motion.offset[rows], code,
           lambda g: reader.offset_name(g) if np.isfinite(g) else "not stated")


def check_lengths(motion: Motion, job: Job, faults: Faults) -> list[Diagnostic]:
    """Cutting blocks under a length register that the CL file names for no use of the tool in the spindle:
    why a program comes nowhere, where its blocks cannot be matched by their places any more."""
    named: dict[int, set[int]] = {-1: {-1}}
    for load, register, _ in tool_loads(job.toolpath):
        named.setdefault(load.number, set()).add(register)
    rows = np.flatnonzero(motion.code > 0)
    pairs, first = np.unique(np.stack([motion.tool[rows], motion.register[rows]], axis=1), axis=0,
                             return_index=True)
    for (tool, held), k in sorted(zip(pairs.tolist(), first.tolist(), strict=True), key=lambda one: one[1]):
        at = rows[k:k + 1]
        wanted = {int(_registers_of(motion, job, at, np.array([one]))[0]) for one in named.get(tool, {held})}
        if held not in wanted:
            found, asked = (" or ".join(str(r) if r >= 0 else "none" for r in sorted(one)) for one in ({held}, wanted))
            return [faults.error("verify.state", f"length register is {found} with T{max(tool, 0)} in the spindle, it "
                                 f"should be {asked}", 0, int(motion.line[at[0]]), hint=_HINTS["length register"])]
    return []


def _registers_of(motion: Motion, job: Job, rows: Ints, named: Ints) -> Ints:
    """(K,) length register that should be in force in the blocks `rows`: that which the CL file names (K,);
    none where machine coordinates hold the length of the tool already, and where the program calls none. A control
    that takes the length with every tool change and cannot cancel it has it in force in any case (0 in its
    table, `tool.length_twice`)."""
    if job.control.length_on_z or job.controller.keeps_length:
        return named
    joints = np.array([frame.law == "axes" for frame in motion.frames])[motion.frame[rows]]
    return np.where(joints, -1, named)


def _radius_registers(job: Job) -> Floats:
    """(N,) register of the cutter compensation that holds at every row: that which CUTCOM names, else that of
    the tool's length where D is modal, the tool where it is not; NaN where the control's code takes none, or
    before any tool."""
    path, codes = job.toolpath, job.controller.codes
    own = loaded_registers(path) if job.controller.cutter_compensation.modal_register else loaded_tools(path)
    starts, values = [0], [np.nan]
    for event in path.events:
        if event.word == "CUTCOM" and (side := compensation_side(event)) and event.index < len(path):
            code = codes.compensation_right if side == "RIGHT" else codes.compensation_left
            named = (*numbers(event), float(own[event.index]))[0]
            starts.append(event.index)
            values.append(named if "{register}" in code and named >= 0 else np.nan)
    return np.array(values, dtype=np.float64)[state_at(starts, len(path))]
