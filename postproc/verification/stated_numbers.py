"""Numbers of a program's header that an operator types in: work offsets, gauge lengths; read back and compared."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from postproc.base.header_words import HEADER, header_of, read_header
from postproc.job.job import Job
from postproc.readback.dialects.base import as_bytes
from toolpaths.diagnostics import Diagnostic, error

_OFFSET = re.compile(r"(?i)work offset (.+?) in machine coordinates([^:\n]*): ([^\n()]*)")
_STANDING = re.compile(r"(?i) with ([a-c]) at (-?[\d.e-]+)")
_TOOL = re.compile(r"(?im)^[^\n]*?tool T(\d+)\b[^\n]*, gauge length (-?[\d.]+) ")
_WORD = re.compile(r"([A-Za-z])(-?\d+\.?\d*)")


def check_header(program: bytes | str, job: Job, gcode: str) -> list[Diagnostic]:
    """An error where the header states another number than the program is for; nothing without our header, or where that
    names another set-up, which is reported by itself."""
    data = as_bytes(program[:HEADER])
    text, header = header_of(data).decode("utf-8", "replace"), read_header(data)
    ours = header.ours and (header.setup.mark if header.setup else "") == job.options.setup_mark
    wrong = [*_offsets(text, job), *_lengths(text, job)] if ours else []
    return [error("verify.header", f"the header says {what} {said}, the program is for {right}",
                  file=gcode or job.toolpath.file, hint="do not run this program") for what, said, right in wrong]


def _offsets(text: str, job: Job) -> Iterator[tuple[str, str, str]]:
    """What is stated of each work offset, by its name, and is another: what, as stated, as it is."""
    units = np.where(job.machine.rotary, 1.0, job.controller.lengths.unit)
    names = [job.controller.program.offset_name(place.code) for place in job.places]
    places = {_plain(name): k for k, name in enumerate(names)}
    for found in _OFFSET.finditer(text):
        k = places.get(_plain(found[1]))
        if k is None:
            yield "work offset", found[1], " and ".join(names)
            continue
        stands = " and ".join(f"{letter.upper()} at {angle}" for letter, angle in _STANDING.findall(found[2]))
        right_stands = " and ".join(f"{letter} at {angle:g}" for letter, angle in job.places[k].standing)
        if stands != right_stands:
            yield f"work offset {found[1]} with", stands or "tables at 0", right_stands or "tables at 0"
        right = dict(zip(job.machine.axis_names, job.control_at(k).work_offset / units, strict=True))
        for letter, said in _WORD.findall(found[3]):
            if not _same(said, float(right.get(letter.upper(), np.nan))):
                yield f"{letter.upper()} of work offset {found[1]}", said, f"{right.get(letter.upper(), np.nan):.4f}"


def _plain(name: str) -> str:
    """A name as comments may change it."""
    return re.sub(r"[^a-z0-9.]+", " ", name.lower()).strip()


def _lengths(text: str, job: Job) -> Iterator[tuple[str, str, str]]:
    """The same of each tool's gauge length."""
    for number, said in _TOOL.findall(text):
        right = job.length_of(int(number)) / job.controller.lengths.unit
        if not _same(said, right):
            yield f"gauge length of T{number}", said, f"{right:.4f}"


def _same(said: str, right: float) -> bool:
    """Whether a number is the right one with the decimals that it has."""
    decimals = len(said) - said.index(".") - 1 if "." in said else 0
    return abs(float(said) - right) <= 0.501 * 10.0**-decimals
