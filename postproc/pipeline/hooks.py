"""What the shop's own blocks may hold: nothing that moves the machine or changes a state that the proof stands on."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

from machines.hooks import HOOK_VALUES, NAMES, filled
from machines.loader import builtin
from machines.toml_lines import KeyPath
from machines.user_file import read_toml
from postproc.controllers.model import ControllerFile, builtin_files
from postproc.job.job import Job
from postproc.readback.dialects.base import Reader
from postproc.readback.dialects.readers import reader_for
from postproc.readback.text.canonical import STATEMENT
from postproc.readback.text.clamps import clamp_numbers
from postproc.readback.text.modal import drop_passive
from postproc.setup.hooks_file import load_hooks
from postproc.writing.state import NUMBER_ROOM
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, has_errors, read_value

_CODE = re.compile(r"(?<![A-Z0-9_$.{])([GM])(\d+(?:\.\d+)?)(?![A-Z0-9_$.])")
_FIRST = re.compile(r"\s*([A-Z$][A-Z_$]+[A-Z0-9_$]*(?: (?:[A-Z]{2,}|\d+(?:\.\d+)?)(?![A-Z0-9=_{]))*)")
_HINT = ("blocks of the shop hold comments and codes that come back to where they began and change no state, named in "
         "[hooks] passive; what switches the spindle or coolant, stops or moves is a record of the CL file")


def refused_hooks(job: Job) -> list[Diagnostic]:
    """Errors of blocks that do more than pass, and of passive codes that the control carries out."""
    machine, hooks = job.machine, job.hooks
    reader = reader_for(job.controller, machine.axis_names, None, machine.stop, job.control.rolls,
                        machine.clamp_codes)
    found = _executed(reader, job)
    plain = dict.fromkeys(HOOK_VALUES, "NAME") | {"tool_number": "1"}
    each = [plain | {"work_offset": name} for name in _offsets(job)]
    for place, blocks in hooks.places.items():
        for block in blocks:
            if what := next((w for v in each if (w := _unlike(job.controller, block, v) or _does(reader, filled(block, v)))),
                            None):
                file, lines = _place(job, place, block)
                found.append(error("hooks.code", f"{place} = {block!r}: {what[0]}", file=file, lines=lines, hint=what[1]))
    return found


def _offsets(job: Job) -> list[str]:
    """The work offsets of the program as the control names them, which blocks may name too."""
    return [job.controller.program.offset_name(code) for code in (
        job.setup.work_offset_code, *(place.code for place in job.places[1:]))]


def _file(job: Job, key: str) -> str:
    """The file that states a key of [hooks]."""
    given = job.options
    if given.hooks and key in (own := read_value(load_hooks(given.hooks))).model_fields_set and getattr(own, key) == getattr(
            job.setup.hooks, key):
        return given.hooks
    return given.setup if key in job.setup.hooks.model_fields_set else job.machine.file


@dataclass(frozen=True)
class CarriedOut:
    """What a control carries out itself: stretches of G and of M numbers, and first words of statements."""

    numbers: tuple[tuple[str, float, float], ...]
    """(letter, first, last)"""
    words: tuple[str, ...]
    free: frozenset[float] = frozenset()
    """G numbers that may be passive all the same"""

    def by(self, name: str) -> str:
        """What of it a passive name would hide, "" for nothing: words of which one begins with the other."""
        if name[0] in "GM" and name[1:2].isdigit():
            value = float(name[1:])
            if name[0] == "G" and value in self.free:
                return ""
            return name if any(name[0] == a and low <= value <= high for a, low, high in self.numbers) else ""
        return next((word for word in self.words if _begins(name, word) or _begins(word, name)), "")


def _begins(name: str, word: str) -> bool:
    """True where a name begins with a whole word; one letter is whole before digits too."""
    return name.startswith(word) and not re.match(r"[A-Z_$]" if len(word) == 1 else r"[A-Z0-9_$]", name[len(word):])


def carried_out(reader: Reader, controller: ControllerFile, clamps: set[float], own: bool) -> CarriedOut:
    """What a passive code must not be: that of the controller file, of the read-back and, for codes of hooks
    (`own` False), of the program's own blocks; the shop's controller file (`own`) may name codes of its
    smoothing and blocks of its own."""
    numbers = [("G", v, v) for values in reader.groups.values() for v in values]
    numbers += [("M", v, v) for v in (*reader.m_codes, *reader.switches, *clamps)]
    words = set(reader.statements)
    for text in controller.program.carried_out:
        first, _, last = text.partition("-")
        if text[0] in "GM" and text[1:2].isdigit():
            numbers.append((text[0], float(first[1:]), float((last or first)[1:])))
        else:
            words.add(text)
    for block in () if own else written(controller):
        numbers += [(a, float(v), float(v)) for a, v in _CODE.findall(block)]
        words |= {m[1] for m in [_FIRST.match(block)] if m}
    return CarriedOut(tuple(numbers), tuple(sorted(words)),
                      frozenset(reader.groups.get("path", ()) if own else ()))


def written(controller: ControllerFile) -> Iterator[str]:
    """Blocks that programs of the controller hold, with placeholders."""
    program = controller.program.model_dump(exclude={"passive", "carried_out", "relies_on_turns", "smoothing_option",
                                                     "without_smoothing"})
    rest = controller.model_dump(include={"codes", "subprograms", "subprogram_files", "arcs", "cycles", "rollover", "units",
                                          "levels"},
                                 exclude={"rollover": {"needs", "default", "rules"}, "subprograms": {"place", "file"},
                                          "subprogram_files": {"place", "file"}, "arcs": {"helical_option"},
                                          "cycles": {"rigid_only", "rigid_option", "floating", "falling_relies_on"}})
    modes = [mode for mode in (controller.modes.tcp, controller.modes.tilted) if mode is not None]
    texts = [*_texts(program), *_texts(rest), *(t for mode in modes for t in (*mode.start, *mode.enter, *mode.leave))]
    for text in texts:
        yield from text.splitlines()


def _texts(values: object) -> Iterator[str]:
    """All texts of nested tables and lists."""
    if isinstance(values, str):
        yield values
    elif isinstance(values, dict):
        for value in values.values():
            yield from _texts(value)
    elif isinstance(values, list | tuple):
        for value in values:
            yield from _texts(value)


def _executed(reader: Reader, job: Job) -> list[Diagnostic]:
    """Passive codes that this control carries out; the shop's controller file may name those of its smoothing."""
    clamps = {float(v) for v in clamp_numbers(job.machine.clamp_codes)}
    found = []
    known = cache(lambda own: carried_out(reader, job.controller, clamps, own))
    for code in job.controller.program.passive:
        shop = code in job.hooks.passive
        what = known(not shop).by(code)
        if what:
            said = "this control carries it out" if what == code else f"this control carries out {what}"
            file, lines = (_place(job, "passive", code) if shop else
                           _in_file(job.controller.file, ("program", "passive"), code))
            found.append(error("hooks.passive", f"{code} is named as passive: {said}, and what follows depends on it",
                               file=file, lines=lines, hint=f"take {code} out of passive; modes, moves, "
                               "offsets, calls, tools, spindle and coolant are records of the CL file and the set-up"))
    return found


def _place(job: Job, key: str, block: str) -> tuple[str, list[int]]:
    """(file, line) of an entry of a key of [hooks]."""
    return _in_file(_file(job, key), ("hooks", key), block)


def _in_file(file: str, key: KeyPath, entry: str) -> tuple[str, list[int]]:
    """(file, line) of an entry of a list in a file or in what is its base; the file alone where it cannot be read again."""
    values = read_toml(file, {**builtin(), **builtin_files()})[0] if file else None
    if values is None:
        return file, []
    held: object = values.values
    for part in key:
        held = held.get(part, {}) if isinstance(held, dict) else {}
    origin = values.origin((*key, held.index(entry)) if isinstance(held, list) and entry in held else key)
    return origin.file, [origin.line]


def _unlike(controller: ControllerFile, block: str, values: dict[str, str]) -> tuple[str, str] | None:
    """(why the control cannot have the block, what to do), None where it can."""
    ends = [c for c in block if c in set("%;") & set(controller.comment.forbidden)]
    if ends:
        return f"{ends[0]} ends a block or a file at this control", f"write it without {ends[0]}"
    try:
        short = filled(block, values | dict.fromkeys(NAMES, "") | {"tool_number": "9999"})
    except ValueError as fault:
        return str(fault), "write the name without digits: {work_offset}"
    most = controller.format.line_length - NUMBER_ROOM
    if len(short) > most:
        return f"{len(short)} characters, the control has room for {most}", "make it shorter, or two blocks of it"
    return None


def _does(reader: Reader, block: str) -> tuple[str, str] | None:
    """(what a block does besides passing, what to do); None for nothing."""
    text, found = reader.tokens((block + "\n").encode(), "")
    if has_errors(found):
        return "the control has no such block", _HINT
    passive = reader.controller.program.passive if reader.controller is not None else ()
    words = drop_passive(text.words, passive)
    left = [s.name for s in text.statements if s.name not in passive and s.name not in reader.neutral]
    left += [f"{chr(a).upper()}{v:g}" for a, v in zip(words.letter.tolist(), words.value.tolist(), strict=True)
             if chr(a) not in (STATEMENT, "N")]
    return (f"{left[0]} is no passive code", _HINT) if left else None
