"""Tools that a program calls by name: their numbers in the place of the names, before it is read."""

from __future__ import annotations

import re

from toolpaths.diagnostics import Diagnostic, error

_CALL = re.compile(rb'(?im)^([^;(\n"]*?)(\bT *= *|\bTOOL (?:CALL|DEF) )"([^"\n]*)"')


def numbered_tools(data: bytes, names: dict[int, str], file: str) -> tuple[bytes, list[Diagnostic]]:
    """The program with T7 for T="EM10" and TOOL CALL 7 for TOOL CALL "EM10", as `names` by number have it; names that
    are not among them."""
    if b'"' not in data:
        return data, []
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
    return data, [error("gcode.tool_name", f'no tool is called "{name}"', file=file, lines=[line],
                        hint='[tools.N] called = "..." of the set-up: the number of the tool that the control calls so')
                  for name, line in unknown.items()]
