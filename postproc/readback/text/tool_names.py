"""Tools that a program calls by name: their numbers in the place of the names, before it is read."""

from __future__ import annotations

import re

from toolpaths.diagnostics import Diagnostic, error, warning

_CALL = re.compile(rb'(?im)^([^;(\n"]*?)(\bT *= *|\bTOOL (?:CALL|DEF) )"([^"\n]*)"')
_BY_NUMBER = re.compile(rb"(?im)^[^;(*\n\"]*?(?:\bT *=? *|\bTOOL (?:CALL|DEF) )(\d+)(?![\d.]| *=)")
_BY_VARIABLE = re.compile(rb"(?im)^[^;(*\n\"]*?(?:\bT *= *([A-Z_$][\w$]*)|\bTOOL (?:CALL|DEF) (Q[LR]?\d+)\b)")
_STRINGS = re.compile(rb"(?im)^[^;\n\"]*?\bDEF +STRING *\[[^\]\n]*\] *([^;\n]*)")


def numbered_tools(data: bytes, names: dict[int, str], file: str) -> tuple[bytes, list[Diagnostic]]:
    """The program with T7 for T="EM10" and TOOL CALL 7 for TOOL CALL "EM10", as `names` by number have it; names that
    are not among them, and tools that are called otherwise (`called_otherwise`)."""
    by_number = called_otherwise(data, names, file)
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


def called_otherwise(data: bytes, names: dict[int, str], file: str) -> list[Diagnostic]:
    """Tools that are called by number, or by a variable that holds one."""
    return [*called_by_number(data, names, file), *called_by_variable(data, names, file)]


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


def called_by_variable(data: bytes, names: dict[int, str], file: str) -> list[Diagnostic]:
    """Tools that are called by a variable which holds a number, where the set-up calls tools by name; one that holds a text
    holds the name (Siemens STRING, Heidenhain QS)."""
    texts = {name.upper() for found in _STRINGS.finditer(data) for name in re.findall(rb"[A-Za-z_]\w*", found[1])} \
        if names else set()
    lines: dict[str, list[int]] = {}
    for call in _BY_VARIABLE.finditer(data) if names else ():
        variable = (call[1] or call[2]).upper()
        if variable not in texts:
            at = call.start(1) if call[1] else call.start(2)
            lines.setdefault(variable.decode("ascii", "replace"), []).append(data.count(b"\n", 0, at) + 1)
    return [warning("gcode.tool_name", f"a tool is called by the number in {variable}, and the set-up calls tools by name",
                    file=file, lines=at, count=len(at), hint="call it by its name, or by a variable that holds the name")
            for variable, at in lines.items()]
