"""Tools that a program calls by name: their numbers in the place of the names, before it is read."""

from __future__ import annotations

import re

from toolpaths.diagnostics import Diagnostic, error, warning

_CALL = re.compile(rb'(?im)^([^;(\n"]*?)(\bT *= *|\bTOOL (?:CALL|DEF) )"([^"\n]*)"')
_BY_NUMBER = re.compile(rb"(?im)^[^;(*\n\"]*?(?:\bT *=? *|\bTOOL (?:CALL|DEF) )(\d+)(?![\d.]| *=)")


def numbered_tools(data: bytes, names: dict[int, str], file: str) -> tuple[bytes, list[Diagnostic]]:
    """The program with T7 for T="EM10" and TOOL CALL 7 for TOOL CALL "EM10", as `names` by number have it; names that
    are not among them, and tools that are called by number (`called_by_number`)."""
    by_number = called_by_number(data, names, file)
    if b'"' not in data:
        return data, by_number
    numbers = {name.upper(): number for number, name in names.items()}
    unknown: dict[str, int] = {}

    def number(call: re.Match[bytes]) -> bytes:
        name = call[3].decode("utf-8", "replace")
        if name.upper() not in numbers:
            unknown.setdefault(name, data.count(b"\n", 0, call.start(3)) + 1)
            return call[0]
        word = b"T" if b"=" in call[2] else call[2]
        return call[1] + word + str(numbers[name.upper()]).encode("ascii")

    data = _CALL.sub(number, data)
    return data, [*by_number, *(error(
        "gcode.tool_name", f'no tool is called "{name}"', file=file, lines=[line],
        hint='[tools.N] called = "..." of the set-up: the number of the tool that the control calls so')
        for name, line in unknown.items())]


def called_by_number(data: bytes, names: dict[int, str], file: str) -> list[Diagnostic]:
    """Tools that have a name, and are called by their numbers: what the control loads then is not known. Tool management
    takes T7 for a tool of the name 7 (Siemens), and a row of a table need not be the number of the CL file (Heidenhain)."""
    lines: dict[int, list[int]] = {}
    for call in _BY_NUMBER.finditer(data) if names else ():
        if int(call[1]) in names:
            lines.setdefault(int(call[1]), []).append(data.count(b"\n", 0, call.start(1)) + 1)
    return [warning("gcode.tool_name", f'tool {number} is called by its number, and the set-up calls it "{names[number]}"',
                    file=file, lines=at, count=len(at), hint="call it by its name, or take `called` out of [tools.N] of the "
                    "set-up where the control knows it by its number") for number, at in lines.items()]
