"""Bytes of any encoding and line ending to plain ASCII-compatible bytes with one newline per line."""

from __future__ import annotations

import codecs
import re
from itertools import pairwise

from toolpaths.cl.text.log import DiagnosticLog

_BOMS = ((codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF8, "utf-8-sig"),
         (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
_CARD = re.compile(rb"^(.{72})([A-Za-z ]{0,4}\d{4,8})$")
_LABEL = re.compile(rb"^([^\n]{72})(?=[^\n]{8} *$)PT  *\d{1,5} *$", re.MULTILINE)
_LABEL_SAMPLE = 1 << 17
_DECK_SAMPLE = 200
_DECK_LEAST = 5


def normalise(data: bytes, log: DiagnosticLog) -> bytes:
    """`data` as UTF-8 (or Latin-1 where it is not UTF-8) with LF line ends, without NULs and card numbers.

    Line numbers stay those of the file: a CR, LF or CRLF ends a line.
    """
    data = _decode_wide(data)
    if b"\x00" in data:
        log.warning("cl.nul", f"the file holds {data.count(0)} NUL bytes, read as blanks",
                    data.count(b"\n", 0, data.index(0)) + 1)
        data = data.replace(b"\x00", b" ")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\x1a" in data:
        data = data.replace(b"\x1a", b" ")
    return _without_labels(_without_card_numbers(data, log), log)


def text_of(raw: bytes) -> str:
    """One line as text: UTF-8, else Latin-1."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _decode_wide(data: bytes) -> bytes:
    for bom, encoding in _BOMS:
        if data.startswith(bom):
            return data[3:] if encoding == "utf-8-sig" else data.decode(encoding, "replace").encode("utf-8", "replace")
    head = data[:400]
    if len(head) >= 8 and head[1::2].count(0) > 0.8 * len(head[1::2]):
        return data.decode("utf-16-le", "replace").encode("utf-8", "replace")
    if len(head) >= 8 and head[::2].count(0) > 0.8 * len(head[::2]):
        return data.decode("utf-16-be", "replace").encode("utf-8", "replace")
    return data


def _without_labels(data: bytes, log: DiagnosticLog) -> bytes:
    """Columns 73 to 80 removed from lines that count their points there (CATIA: `PT     7`), where one of the first does."""
    found = _LABEL.search(data, 0, _LABEL_SAMPLE)
    if found is None:
        return data
    line = data.count(b"\n", 0, found.start()) + 1
    log.info("cl.card-numbers", "columns 73 to 80 hold the numbers of points, left out", line)
    return _LABEL.sub(rb"\1", data)


def _without_card_numbers(data: bytes, log: DiagnosticLog) -> bytes:
    """Columns 73 to 80 removed where every line of the head of the file is a card with a rising number there."""
    head = data[:81 * _DECK_SAMPLE].split(b"\n")
    cards = [line for line in (head[:-1] if len(head) > 1 else head) if line.strip()]
    found = [_CARD.match(line) for line in cards]
    if len(cards) < _DECK_LEAST or not all(found) or any(len(line) != 80 for line in cards):
        return data
    numbers = [int(re.sub(rb"\D", b"", m[2])) for m in found if m]
    if any(b <= a for a, b in pairwise(numbers)):
        return data
    log.info("cl.card-numbers", "columns 73 to 80 hold card numbers, left out", 1)
    return b"\n".join(line[:72] if _CARD.match(line) else line for line in data.split(b"\n"))
