"""Numbers of a program's header that an operator types in: work offsets, gauge lengths; read back and compared."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from postproc.base.header_words import HEADER, SETUP_MARK, header_of, read_header
from postproc.job.job import Job
from postproc.readback.comparison.compare import Comparison
from postproc.readback.dialects.base import as_bytes
from toolpaths.arrays import distinct
from toolpaths.diagnostics import Diagnostic, error

_MARK = re.compile(rf"(?i){SETUP_MARK} ([0-9a-f]{{8}})\b")
_OFFSET = re.compile(r"(?i)work offset ([^:,]{1,60}?) in machine coordinates([^:,]*): ?((?:[A-Z]-?\d+(?:\.\d*)?(?: |$))*)")
_STANDING = re.compile(r"(?i) with ([a-c]) at (-?[\d.e-]+)")
_LENGTH = r"(?i)\btool T{}\b(?:(?!\btool T\d).)*?gauge length (-?[\d.]+|not stated)"
_WORD = re.compile(r"([A-Za-z])(-?\d+\.?\d*)")
_EDGES = re.compile(r"(?m)\)?[ \t]*(?:^|\n)[ \t]*(?:N?\d+[ \t]*)?[(;][ \t]*")
"""between two comments: a line of the header that is longer than a block goes on in the next"""
NOTHING = "nothing"
"""what is said where a header does not state it"""


def check_header(program: bytes | str, job: Job, gcode: str) -> list[Diagnostic]:
    """An error where the header states another number than the program is for, or does not state it; nothing without our
    header, or where that names another set-up, which is reported by itself."""
    data = as_bytes(program[:HEADER])
    text = _EDGES.sub(" ", header_of(data).decode("utf-8", "replace"))
    mark = _MARK.search(text)
    ours = read_header(data).ours and (mark[1].lower() if mark else "") == job.options.setup_mark
    wrong = [*_offsets(text, job), *_lengths(text, job)] if ours else []
    return [error("verify.header", f"the header says {what} {said}, the program is for {right}",
                  file=gcode or job.toolpath.file, hint="do not run this program") for what, said, right in wrong]


def _offsets(text: str, job: Job) -> Iterator[tuple[str, str, str]]:
    """What is stated of each work offset, by its name, and is another: what, as stated, as it is."""
    units = np.where(job.machine.rotary, 1.0, job.controller.lengths.unit)
    names = [job.controller.program.offset_name(place.code) for place in job.places]
    missing = {_plain(name): k for k, name in enumerate(names)}
    places = dict(missing)
    for found in _OFFSET.finditer(text):
        k = places.get(_plain(found[1]))
        if k is None:
            yield "work offset", found[1], " and ".join(names)
            continue
        missing.pop(_plain(found[1]), None)
        stands = " and ".join(f"{letter.upper()} at {angle}" for letter, angle in _STANDING.findall(found[2]))
        right_stands = " and ".join(f"{letter} at {angle:g}" for letter, angle in job.places[k].standing)
        if stands != right_stands:
            yield f"work offset {found[1]} with", stands or "tables at 0", right_stands or "tables at 0"
        said = {letter.upper(): number for letter, number in _WORD.findall(found[3])}
        right = dict(zip(job.machine.axis_names, (job.control_at(k).work_offset / units).tolist(), strict=True))
        for letter, value in right.items():
            if not _same(said.get(letter, NOTHING), value):
                yield f"{letter} of work offset {found[1]}", said.get(letter, NOTHING), f"{value:.4f}"
    yield from (("of work offset", f"{names[k]} {NOTHING}", "it") for k in missing.values())


def _plain(name: str) -> str:
    """A name as comments may change it."""
    return re.sub(r"[^a-z0-9.]+", " ", name.lower()).strip()


def _lengths(text: str, job: Job) -> Iterator[tuple[str, str, str]]:
    """The same of the gauge length of each tool that moves."""
    for number in sorted({job.number_of(k) for k in distinct(job.moves.tool).tolist()}):
        right, said = job.length_of(number) / job.controller.lengths.unit, re.findall(_LENGTH.format(number), text)
        off = [one for one in said or [NOTHING] if not _same(one, right)]
        if number > (-1 if job.setup.output.tool_call else 0) and off:
            yield f"gauge length of T{number}", off[0], f"{right:.4f}"


def _same(said: str, right: float) -> bool:
    """Whether a number is the right one with the decimals that it has; a length that is not stated is 0."""
    if not said[-1:].isdigit():
        return said != NOTHING and right == 0.0
    decimals = len(said) - said.index(".") - 1 if "." in said else 0
    return abs(float(said) - right) <= 0.501 * 10.0**-decimals


def stated_smoothing(c: Comparison, job: Job, gcode: str) -> list[Diagnostic]:
    """An error where the smoothing that a program's header states and the deviation that is proved leave the tolerance."""
    mm, allowed = job.options.smoothing, job.options.tolerance
    if not mm or c.tip_bound + job.smoothing.most <= allowed * (1.0 + 1e-6):
        return []
    return [error("verify.smoothing", f"the header gives the control's smoothing {mm:g} mm, with the deviation of "
                  f"{c.tip_bound:.6f} mm more than the {allowed:g} mm allowed", file=gcode)]
