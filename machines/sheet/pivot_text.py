"""Pivot numbers as a control puts them out: Fanuc's G10 L52 blocks or list of parameters, Siemens' $TC_CARR."""

from __future__ import annotations

import re

from machines.sheet.model import PivotForm

_FANUC = re.compile(r"N\d{5}(?P<words>(?:\s*[A-MO-Z]-?\d*\.?\d*)+)\s*;?$")
"""N19700 R-381.0, N19700 P1 R-381.0 of G10 L52; N19700Q1L1P-381.0 of a list of parameters"""
_SIEMENS = re.compile(r"(?:N\d+\s*)?\$TC_CARR\d+\[\d+\]\s*=\s*(?P<value>-?\d+(?:\.\d*)?)$")
_HEAD: dict[PivotForm, re.Pattern[str]] = {
    "fanuc": re.compile(r"N(\d{5})(?!\d)"), "siemens": re.compile(r"(?:N\d+\s*)?\$TC_CARR(\d+)")}
"""how a line begins that sets a number"""
_WORD = re.compile(r"([A-Z])(-?\d*\.?\d*)")
_FIRST: dict[PivotForm, dict[int, str]] = {
    "fanuc": {n: str(n) for n in (19700, 19703, 19709, 19712)}, "siemens": {1: "I1", 4: "I2", 15: "I3", 18: "I4"}}
"""number of X of each vector, and the vector's name; Y and Z are the next two"""


def read_pivots(form: PivotForm, text: str) -> tuple[dict[str, tuple[float, float, float]], list[str]]:
    """Vectors by the control's names, mm, and what is wrong with lines of the text; other parameters are passed over."""
    if form not in _FIRST:
        return {}, [f"the text of a {form} control is not read: write `points`"]
    names = {first + k: (name, k) for first, name in _FIRST[form].items() for k in range(3)}
    found, wrong = dict[str, list[float]](), list[str]()
    for line in filter(None, (one.strip().upper() for one in text.splitlines())):
        number, value = _assigned(form, line)
        if number not in names:
            continue
        if "." not in value:
            wrong.append(f"{line!r}: no number with a decimal point; without one its unit is a parameter")
            continue
        name, k = names[number]
        found.setdefault(name, [0.0, 0.0, 0.0])[k] = float(value)
    return {name: (v[0], v[1], v[2]) for name, v in found.items()}, wrong


def _assigned(form: PivotForm, line: str) -> tuple[int, str]:
    """(number, value as it is written) of a line; -1 where it sets none, value "" where it cannot be read."""
    head = _HEAD[form].match(line)
    if head is None:
        return -1, ""
    match = (_FANUC if form == "fanuc" else _SIEMENS).match(line)
    if match is None or form == "siemens":
        return int(head[1]), "" if match is None else str(match["value"])
    words: dict[str, str] = dict(_WORD.findall(match["words"]))
    return int(head[1]), words.get("R", words.get("P", ""))
