"""What a block relies on must be stated before it: power-on states are parameters, the program before may have left others;
and whether a length that changes in a block of its own moves the tool.

Whatever `[start] codes` of the controller file names counts as stated.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from postproc.base.header_words import HEADER, header_of
from postproc.job.job import Job
from postproc.readback.dialects.base import Reader, as_bytes
from postproc.readback.text.canonical import INCREMENTAL, LAW, OFFSET, REGISTER, Canonical, in_files
from postproc.readback.text.modal import CYCLES, GROUPS, codes, fill
from postproc.readback.text.words import Words
from toolpaths.arrays import Bools, Ints, among, distinct
from toolpaths.diagnostics import Diagnostic, error, warning

_ARCS = (2, 3)
_HEIGHT = "Z"
"""the axis that the length is added to"""
_OTHER = re.compile(r"[^a-z0-9.]+")
Need = tuple[str, Ints, Ints]
"""what must be stated: its name, the blocks that rely on it, the blocks that state it"""


def check_stated(code: Canonical, reader: Reader, file: str) -> list[Diagnostic]:
    """Blocks that rely on a state that nothing before them, and not they themselves, has stated."""
    result = []
    for what, relying, stating in needs(code, reader):
        first = int(stating.min(initial=code.words.lines + 1))
        bad = distinct(relying[relying < first])
        if len(bad):
            words = reader.stating[what]
            result.append(error("gcode.unstated", f"nothing states {words} before this block, which depends on it: the "
                                "state is what the program before, or a parameter of the control, has left", file=file,
                                lines=code.line[bad][:6].tolist(), count=len(bad),
                                hint=f"state {words} at the start of the program; where the control itself puts it in force "
                                "before every program, name the code in [start] codes of the controller file"))
    return result + _undone(code, reader, file) + _lost(code, reader, file)


def unstated_between(needed: list[Need], first: int, last: int) -> list[str]:
    """Of what blocks need (`needs`), what those first..last rely on and none of them states before it."""
    result = []
    for what, relying, stating in needed:
        relies = relying[(relying >= first) & (relying <= last)].min(initial=last + 1)
        if relies <= last and stating[stating >= first].min(initial=last + 1) > relies:
            result.append(what)
    return result


def needs(code: Canonical, reader: Reader) -> Iterator[Need]:
    """What the dialect has no fixed state for, without what the controller file says of its start."""
    words, known = code.words, _known(reader)
    moves, machine = _moves(words, reader.axes), codes(words, "G", (53,))[0]
    work, motion = moves[~_among_blocks(words, machine)[moves]], fill(*codes(words, "G", GROUPS["motion"]),
                                                         words.lines, -1.0)
    feeds, cycles = moves[motion[moves] != 0], moves[among(motion[moves], CYCLES)]
    arcs = moves[among(motion[moves], _ARCS)]
    heights = work[_among_blocks(words, _moves(words, ("Z",)))[work]]
    relying = {"motion": moves, "distance": moves, "compensation": moves, "plane": work, "feed_mode": feeds, "level": cycles,
               "arc_distance": arcs, "offset": work, "length": heights}
    for what in reader.stating:
        if what in known or what not in relying:
            continue
        stating = words.pick(OFFSET)[0] if what == "offset" else words.pick(REGISTER)[0] if what == "length" else \
            codes(words, "G", GROUPS[what])[0]
        yield what, relying[what], stating


def _among_blocks(words: Words, some: Ints) -> Bools:
    """Which blocks, by number, are among some of them."""
    found = np.zeros(words.lines + 2, dtype=bool)
    found[some] = True
    return found


def _known(reader: Reader) -> set[str]:
    """The groups whose state the controller file says."""
    said = reader.controller.start.codes if reader.controller is not None else ()
    numbers = {float(m[1]) for text in said if (m := re.fullmatch(r"G(\d+\.?\d*)", text))}
    return {name for name, group in reader.groups.items() if numbers.intersection(group)}


def _moves(words: Words, axes: tuple[str, ...]) -> Ints:
    """Blocks with words of axes, absolute or relative."""
    letters = [ord(a) + d for a in axes for d in (0, INCREMENTAL)]
    return distinct(words.line[among(words.letter, letters)])


def _undone(code: Canonical, reader: Reader, file: str) -> list[Diagnostic]:
    """Modes that the program uses, and that may still be on from the program before where it begins to move; in machine
    coordinates it may, where the control takes those as they are in every mode."""
    blocks, index = code.words.pick(LAW)
    moves = _moves(code.words, reader.axes)
    if reader.home_in_planes:
        moves = moves[~_among_blocks(code.words, codes(code.words, "G", (53,))[0])[moves]]
    if not len(moves) or not len(blocks):
        return []
    laws, result = [code.laws[int(k)] for k in index], []
    for name, leaving in reader.leaving.items():
        entered = any(law.name == name for law in laws)
        off = [int(b) for b, law in zip(blocks, laws, strict=True) if law.name == "axes" and law.code in leaving]
        if entered and min(off, default=code.words.lines + 1) > int(moves[0]):
            mode = reader.modes_named[name]
            result.append(error("gcode.unstated", f"nothing switches {mode} off before the first motion: it may be on from "
                                "the program before", file=file, lines=[int(code.line[moves[0]])],
                                hint=f"state {leaving[0]} at the start of the program"))
    return result


def _lost(code: Canonical, reader: Reader, file: str) -> list[Diagnostic]:
    """Moves in a work offset behind a code with which the control may have lost it, before it is stated again."""
    blocks, index = code.words.pick(LAW)
    by = [code.laws[int(k)].code in reader.lost_by for k in index]
    if not any(by):
        return []
    moves, machine = _moves(code.words, reader.axes), codes(code.words, "G", (53,))[0]
    end = code.words.lines + 1
    work = np.append(moves[~_among_blocks(code.words, machine)[moves]], end)
    stated = np.append(np.sort(code.words.pick(OFFSET)[0]), end)
    lost = blocks[by]
    first = work[np.searchsorted(work, lost)]
    bad = distinct(first[first < np.minimum(stated[np.searchsorted(stated, lost)], end)])
    if not len(bad):
        return []
    return [error("gcode.unstated", "nothing states the work offset behind " + " or ".join(sorted(reader.lost_by))
                  + ", with which the control may lose it, before this block", file=file,
                  lines=code.line[bad][:6].tolist(), count=len(bad), hint="state the work offset (G54 ...) again behind it")]


def check_length_alone(data: bytes | str, code: Canonical, job: Job, gcode: str) -> list[Diagnostic]:
    """Blocks that change the length in force and state no height, where neither the machine file nor the header of the
    program says that they move nothing (Fanuc parameter 5006#6 TOS; B-63943EN-1 12.5.2).

    A move of Z in machine coordinates ends the length (F5 14.1.2), and nothing changes behind it. What is in force before
    the first such code is not known: a reset may have ended it (parameter 5003#6 LVK), so that is a warning.
    """
    setting = job.controller.tools.length_alone
    changed, unknown = changed_alone(code) if setting else ([], [])
    if not (changed or unknown) or _plain(setting) in _plain(header_of(as_bytes(data[:HEADER])).decode("utf-8", "replace")):
        return []
    hint = ("state Z in that block, G49 in the one that goes home (G53 G0 G49 Z); or, where the control has it so, "
            f'settings = ["{setting.split(":")[0]}"] under [control] of the machine file')
    result = []
    for blocks, judged, when in ((changed, error, "a length is in force"), (unknown, warning, "a length may be in force")):
        if blocks:
            line = in_files(code.line[np.array(blocks)], code.files)
            result.append(judged("verify.length_alone", f"the length register changes while {when}, in a block that states "
                                 f"no Z: the tool stays where it is only with {setting}", file=gcode or job.toolpath.file,
                                 lines=line[:6].tolist(), count=len(blocks), hint=hint))
    return result


def changed_alone(code: Canonical) -> tuple[list[int], list[int]]:
    """(blocks without Z behind which another length is in force, the same where the one before is not known)."""
    words = code.words
    blocks, registers = words.pick(REGISTER)
    heights = distinct(np.concatenate([words.pick(_HEIGHT)[0], words.pick(chr(ord(_HEIGHT) + INCREMENTAL))[0]]))
    machine = np.intersect1d(heights, codes(words, "G", (53,))[0])
    last: dict[int, float] = dict(zip(blocks.tolist(), registers.tolist(), strict=True))
    changed, unknown, before, at = list[int](), list[int](), None, 0
    for block, register in last.items():
        now = max(register, 0.0)
        before = 0.0 if _between(machine, at, block) else before
        if not _between(heights, block, block + 1) and now != before:
            (unknown if before is None else changed).append(block)
        before, at = now, block
    return changed, unknown


def _between(blocks: Ints, first: int, stop: int) -> bool:
    """True where one of the blocks, in order, is first..stop - 1."""
    return bool(np.searchsorted(blocks, first) < np.searchsorted(blocks, stop))


def _plain(text: str) -> str:
    """A text as comments may change it."""
    return _OTHER.sub(" ", text.lower()).strip()
