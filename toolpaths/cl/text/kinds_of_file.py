"""Whether a file is a CL file or a program of a control, by its first lines; what stands in the place of another file."""

from __future__ import annotations

import re

from toolpaths.cl.text.other_formats import is_binary, is_document, other_format, shape_file

_RECORD = re.compile(rb"(N?\d+\s*)?[A-Z][A-Z0-9]*\s*/")
"""An APT record with a major word, with or without a sequence number"""
_BLOCK = re.compile(rb"%|O\d|/?\s*N\d+\s*\S|/?\s*(\d+\s*)?BEGIN PGM|/?\s*[GMTXYZABCSF]\s*[-+.\d]")
"""A line that only programs have: a program's name, a block number, or an address with a number"""


def looks_like_gcode(data: bytes) -> bool:
    """True for a program of a control: a name, a numbered block or words, in what comes before any APT record."""
    if shape_file(data) or is_binary(data) or is_document(data):
        return False
    for raw in data[:20_000].splitlines():
        line = raw.strip().upper()
        if line.startswith((b"(", b";", b"$$")) or not line:
            continue
        if _RECORD.match(line):
            return False
        if _BLOCK.match(line):
            return True
    return False


def looks_like_apt(data: bytes) -> bool:
    """True for a CL file of APT text: a record with a slash before anything that only programs have."""
    lines = (line for raw in data[:20_000].splitlines() if (line := raw.strip().upper()))
    first = next((line for line in lines if _RECORD.match(line) or _BLOCK.match(line) or line.startswith((b"(", b";"))), b"")
    return _RECORD.match(first) is not None


_KEY = re.compile(rb"(?m)^[ \t]*(?:\[{1,2}[\w .\"'-]+\]|[\w.\"'-]+[ \t]*=)")
"""A table or a key of TOML"""


def what_is(data: bytes) -> str:
    """What a file is that was given as a TOML file: a CL file, a program of a control, another form; "" where it has keys
    of TOML or is nothing known."""
    if _KEY.search(data[:20_000]):
        return ""
    if looks_like_apt(data):
        return "a CL file"
    if looks_like_gcode(data):
        return "G-code, a program of a control"
    other = other_format(data)
    return other[0] if other else ""
