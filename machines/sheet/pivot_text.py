"""Pivot numbers as a control puts them out: Fanuc's G10 L52 blocks or list of parameters, Siemens' $TC_CARR."""

from __future__ import annotations

import re

from machines.sheet.model import PivotForm

_NUMBER = r"-?(?:\d+(?:\.\d*)?|\.\d+)"
_FANUC = re.compile(rf"N\d{{5}}(?P<words>(?:\s*[A-MO-Z]{_NUMBER})+)\s*;?$")
"""N19700 R-381.0, N19700 P1 R-381.0 of G10 L52; N19700Q1L1P-381.0 of a list of parameters"""
_SIEMENS = re.compile(rf"(?:N\d+\s*)?\$TC_CARR\d+\[(?P<carrier>\d+)\]\s*=\s*(?P<value>{_NUMBER})$")
_HEAD: dict[PivotForm, re.Pattern[str]] = {
    "fanuc": re.compile(r"N(\d{5})(?!\d)"), "siemens": re.compile(r"(?:N\d+\s*)?\$TC_CARR(\d+)")}
"""how a line begins that sets a number"""
_COMMENT, _NEXT = re.compile(r"\([^)]*\)?|;.*"), re.compile(r"(?<=\S)\s+(?=\$TC_)")
_WORD = re.compile(rf"([A-Z])({_NUMBER})")
_OWNER: dict[PivotForm, str] = {"fanuc": "paths", "siemens": "carriers"}
"""of which a control has several, each with numbers of its own: L of a list of parameters, the index of $TC_CARR"""
_FIRST: dict[PivotForm, dict[int, str]] = {
    "fanuc": {n: str(n) for n in (19700, 19703, 19709, 19712)}, "siemens": {1: "I1", 4: "I2", 15: "I3", 18: "I4"}}
"""number of X of each vector, and the vector's name; Y and Z are the next two"""


def read_pivots(form: PivotForm, text: str) -> tuple[dict[str, tuple[float, float, float]], list[str]]:
    """Vectors by the control's names, mm, and what is wrong with lines of the text; other parameters are passed over."""
    if form not in _FIRST:
        return {}, [f"the text of a {form} control is not read: write `points`"]
    known, wrong, owners = dict[int, float](), list[str](), set[str]()
    numbers = {first + k for first in _FIRST[form] for k in range(3)}
    for line in _settings(text):
        number, owner, value = _assigned(form, line)
        if number not in numbers:
            continue
        owners |= {owner} - {""}
        if not value or (form == "fanuc" and "." not in value):
            wrong.append(f"{line!r}: no number with a decimal point; without one its unit is a parameter"
                         if form == "fanuc" else f"{line!r}: no number")
        elif known.setdefault(number, float(value)) != float(value):
            wrong.append(f"{line!r}: {known[number]:g} stands in a line before it")
    if len(owners) > 1:
        return {}, [f"{_OWNER[form]} {' and '.join(sorted(owners))}: give the lines of one"]
    given = {first: name for first, name in _FIRST[form].items() if known.keys() & {first, first + 1, first + 2}}
    missing = [(first + k, f"{'XYZ'[k]} of {name}") for first, name in given.items() for k in range(3)
               if first + k not in known]
    if wrong or missing:
        return {}, wrong or ["; ".join(f"{_word(form, number)} is missing, {what}" for number, what in missing)]
    return {name: (known[first], known[first + 1], known[first + 2]) for first, name in given.items()}, []


def _settings(text: str) -> list[str]:
    """One setting each, without comments, behind ; or in brackets: Siemens has several in a line."""
    lines = (_COMMENT.sub("", line).strip().upper() for line in text.splitlines())
    return [part for line in lines for one in _NEXT.split(line) if (part := one.strip())]


def _word(form: PivotForm, number: int) -> str:
    """A number as the control names it."""
    return f"N{number}" if form == "fanuc" else f"$TC_CARR{number}"


def _assigned(form: PivotForm, line: str) -> tuple[int, str, str]:
    """(number, path or carrier, value as written) of a line; -1 where it sets none, value "" where it cannot be read."""
    head = _HEAD[form].match(line)
    if head is None:
        return -1, "", ""
    match = (_FANUC if form == "fanuc" else _SIEMENS).match(line)
    if match is None:
        return int(head[1]), "", ""
    if form == "siemens":
        return int(head[1]), str(int(match["carrier"])), str(match["value"])
    words: dict[str, str] = dict(_WORD.findall(match["words"]))
    return int(head[1]), words.get("L", ""), words.get("R", words.get("P", ""))
