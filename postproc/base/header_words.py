"""Words of the program's header that the reader looks for."""

from __future__ import annotations

import re

FINGERPRINT = "fingerprint of the geometric errors"
"""before the eight hex digits of the error model that a program was written with"""
FEEDS = "fingerprint of the planned feeds"
"""before the eight hex digits of the F words"""
PENDING = "proof pending"
"""the line that says what is proved, while the program is written (`verification/proof_text.py`)"""
UNKNOWN = "--------"
"""in their place while the program is written"""
HEADER = 4000
"""characters of a program that hold its header"""
_FIRST = re.compile(rb"(?im)^[ \tN\d]*[(;][ \t]*postproc \d")
_COMMENT = re.compile(rb"(?i)[ \t]*(?:N?\d+[ \t]*)?(?:\([^()\n]*\)|;[^\n]*)?[ \t]*(?:\n|\Z)")


def head_of(data: bytes) -> bytes:
    """The comments at the head of a program, from the one that names postproc to the first block; comments of the CL file
    stand behind that. Where nothing names postproc, the first characters as they are."""
    text = data[:HEADER].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    first = _FIRST.search(text)
    if first is None:
        return text
    at = first.start()
    while at < len(text) and (line := _COMMENT.match(text, at)) is not None:
        at = line.end()
    return text[first.start():at]
