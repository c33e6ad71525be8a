"""What the shop's own blocks may hold: nothing that moves the machine or changes a state that the proof stands on."""

from __future__ import annotations

from postproc.job.job import Job
from postproc.readback.dialects.base import Reader
from postproc.readback.dialects.readers import reader_for
from postproc.readback.text.canonical import STATEMENT
from postproc.readback.text.clamps import clamp_numbers
from postproc.readback.text.modal import drop_passive
from toolpaths.diagnostics import Diagnostic, error, has_errors

VALUES = {"tool_number": "1", "tool_name": "TOOL", "operation": "OPERATION", "work_offset": "G54"}
"""what stands in braces while a block is looked at"""


def check_hooks(job: Job) -> list[Diagnostic]:
    """Errors of blocks that do more than pass, and of passive codes that the control carries out."""
    machine, hooks = job.machine, job.hooks
    reader = reader_for(job.controller, machine.axis_names, None, machine.stop, job.control.rolls, machine.clamp_codes)
    found = _executed(reader, job)
    for place, blocks in hooks.places.items():
        file = _file(job, place)
        for block in blocks:
            if what := _does(reader, block.format(**VALUES)):
                found.append(error("hooks.code", f"{place} = {block!r}: {what}", file=file, hint="blocks of the shop hold "
                                   "comments and codes that come back to where they began and change no state, named in "
                                   "[hooks] passive; what switches the spindle or coolant, stops or moves is a record of "
                                   "the CL file"))
    return found


def _file(job: Job, key: str) -> str:
    """The file that states a key of [hooks]."""
    return job.options.setup if key in job.setup.hooks.model_fields_set else job.machine.file


def _executed(reader: Reader, job: Job) -> list[Diagnostic]:
    """Passive codes that this control carries out; the shop's controller file may name those of its smoothing."""
    modes = {k: numbers for k, numbers in reader.groups.items() if k != "path"}
    m_codes = {*reader.m_codes, *reader.switches, *clamp_numbers(job.machine.clamp_codes)}
    found = []
    for code in job.controller.program.passive:
        groups = reader.groups if code in job.hooks.passive else modes
        known = {v for numbers in groups.values() for v in numbers} if code[0] == "G" else m_codes
        if code[0] in "GM" and code[1:2].isdigit() and float(code[1:]) in known:
            file = _file(job, "passive") if code in job.hooks.passive else ""
            found.append(error("hooks.passive", f"{code} is named as passive: this control carries it out, and what follows "
                               "depends on it", file=file, hint=f"take {code} out of passive; modes, moves, spindle and "
                               "coolant are records of the CL file"))
    return found


def _does(reader: Reader, block: str) -> str:
    """What a block does besides passing; "" for nothing."""
    text, found = reader.tokens((block + "\n").encode(), "")
    if has_errors(found):
        return "the control has no such block"
    passive = reader.controller.program.passive if reader.controller is not None else ()
    words = drop_passive(text.words, passive)
    left = [s.name for s in text.statements if s.name not in passive and s.name not in reader.neutral]
    left += [f"{chr(a).upper()}{v:g}" for a, v in zip(words.letter.tolist(), words.value.tolist(), strict=True)
             if chr(a) not in (STATEMENT, "N")]
    return f"{left[0]} is no passive code" if left else ""
