"""A machine from the description table of an iTNC 530: rows of KEY, AXIS and COORD from the tool to the part.

Source: HEIDENHAIN, Technical Manual iTNC 530 HSCI. P. 722: the sequence starts at the tool reference point; from a row
MachAxis on the axis moves what stands before it relative to what follows; Trans shifts along AXIS by COORD, or turns about
it; MachBase is what stands still. P. 670: such a table with its figures, head B 250 mm above the reference point, table C.
P. 686, 726, 728: columns of KinematicsComp, TOOLFILE, ToolAxis.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from machines.exchange.draft import Draft
from machines.kinematics.chain import ROTARY
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import has_errors
from toolpaths.units import MM_PER_INCH

COLUMNS = ("KEY", "AXIS", "COORD")
"""of a description table, in this order"""
_PASSED_OVER = ("MACHBASE", "CMO", "TOOLFILE")
"""rows that say nothing of where an axis is: the bed, bodies, the place of a tool carrier"""
_COMPENSATED = ("COMPTAB", "CORROFFSET")
"""columns by which KinematicsComp changes a row"""
_BASE = "MACHBASE"
_BY_HAND = "postproc machine new asks for the line of each axis itself"


@dataclass(frozen=True)
class KinematicsRow:
    """One row of the table; "" where a column is empty."""

    key: str
    axis: str
    coord: str
    compensated: str
    line: int

    @property
    def said(self) -> str:
        """As it stands there."""
        return " ".join(word for word in (self.key, self.axis, self.coord) if word)

    @property
    def number(self) -> float | None:
        """COORD, 0 where it is empty, None where it is no number; the control's point may be a comma."""
        try:
            return float(self.coord.replace(",", ".") or 0.0)
        except ValueError:
            return None


@dataclass(frozen=True)
class _Place:
    """An axis of the sequence: where the rows before it have come to, mm."""

    letter: str
    point: tuple[float, float, float]
    line: int


def is_description_table(text: str) -> bool:
    """True where some line names the columns of a description table."""
    return any(_is_header(line) for line in text.splitlines())


def read_heidenhain(path: Path, text: str, stated: Sequence[str]) -> tuple[Draft, dict[str, bool]]:
    """The draft of a machine file, and its axes: True for rotary ones."""
    draft = Draft(str(path), stated)
    rows = list(_rows(text))
    if not any(line.strip().upper() == "[END]" for line in text.splitlines()):
        draft.error("import.kinematics", "the table has no [END]: rows may be missing", len(text.splitlines()),
                    "copy it with its last line, [END]")
    places, base = _sequence(draft, rows, MM_PER_INCH if _in_inches(text) else 1.0)
    code = "" if has_errors(draft.found) else _structure(draft, places, base)
    if not code:
        return draft, {}
    draft.made(("description",), f"from {path.name}", "")
    draft.made(("retract_axis",), "Z", "")
    draft.made(("kinematics", "kind"), "serial", "")
    draft.put(("kinematics", "structure"), code, places[0].line, "order of the rows MachAxis")
    turning = [place for place in places if place.letter in ROTARY]
    for place in turning:
        draft.put(("kinematics", "axes", place.letter, "point"), list(place.point), place.line,
                  "sum of the rows Trans before it")
    if turning:
        draft.info("import.sense", f"{' and '.join(place.letter for place in turning)}: the table does not say in which "
                   "direction an axis counts; they are taken to turn the tool relative to the part as ISO 841 has them: "
                   "turn each by hand at the machine and compare", turning[0].line)
    return draft, {letter: letter in ROTARY for letter in sorted((p.letter for p in places), key="XYZUVWABC".index)}


def _is_header(line: str) -> bool:
    words = line.split()
    return all(name in words for name in COLUMNS)


def _in_inches(text: str) -> bool:
    """By the first line of the table, `BEGIN NAME.TAB MM`."""
    first = next((line.split() for line in text.splitlines() if line.strip().upper().startswith("BEGIN")), [])
    return "INCH" in (word.upper() for word in first)


def _rows(text: str) -> Iterator[KinematicsRow]:
    """The rows behind the names of the columns, to [END]."""
    header = ""
    for number, line in enumerate(text.splitlines(), 1):
        if not header:
            header = line if _is_header(line) else ""
        elif line.strip().upper() == "[END]":
            return
        elif line.strip() and line.strip()[0] not in ";#":
            cells = _cells(header, line)
            compensated = next((f"{name} {cells[name]}" for name in _COMPENSATED if cells.get(name)), "")
            key = cells.get("KEY", "")
            if key or cells.get("AXIS") or cells.get("COORD"):
                yield KinematicsRow(key, cells.get("AXIS", "").upper(), cells.get("COORD", ""), compensated, number)


def _cells(header: str, line: str) -> dict[str, str]:
    """The row by names of columns: by their places, or by its words where the row does not keep to them."""
    if "\t" in header:
        return dict(zip((name.strip() for name in header.split("\t")), (cell.strip() for cell in line.split("\t")),
                        strict=False))
    names = [(found[0], found.start()) for found in re.finditer(r"\S+", header)]
    starts = [start for _, start in names]
    if all(start == 0 or start > len(line) or line[start - 1].isspace() for start in starts):
        ends = [*starts[1:], len(line)]
        cells = {name: line[start:end].strip() for (name, start), end in zip(names, ends, strict=True)}
        if " " not in cells["KEY"] and not cells["KEY"].isdigit():
            return cells
    words = line.split()
    words = words[1:] if words[0].isdigit() else words
    return dict(zip(COLUMNS, words, strict=False))


def _sequence(draft: Draft, rows: list[KinematicsRow], scale: float) -> tuple[list[_Place], int]:
    """The axes with their places from the tool on, and how many stand before MachBase; -1 where it is left out."""
    places, base, at = list[_Place](), -1, [0.0, 0.0, 0.0]
    for row in rows:
        key = row.key.upper()
        if row.compensated:
            draft.warning("import.fine", f"{row.said}: what {row.compensated} adds is not read", row.line,
                          "state the points as the compensated control has them")
        if key == _BASE:
            base = len(places)
        elif key == "MACHAXIS" and row.axis in tuple("XYZUVWABC") and row.axis not in [p.letter for p in places]:
            places.append(_Place(row.axis, (at[0], at[1], at[2]), row.line))
        elif key == "TRANS" and row.axis in ("X", "Y", "Z") and row.number is not None:
            at["XYZ".index(row.axis)] += row.number * scale
        elif wrong := _wrong(row, key):
            draft.error("import.kinematics", f"{row.said}: {wrong[0]}", row.line, wrong[1])
    return places, base


def _wrong(row: KinematicsRow, key: str) -> tuple[str, str] | None:
    """Why a row is not read, and what to do; None where it says nothing of the geometry."""
    if key in _PASSED_OVER or (key == "TOOLAXIS" and row.axis == "Z"):
        return None
    if key == "TOOLAXIS":
        return "only tools along Z are read", _BY_HAND
    if key in ("SUBFILE1", "SUBFILE2"):
        return "the rows of the other table are not read", "copy its rows to the place of this one"
    if key == "TRANS" and row.axis in ROTARY and row.number == 0.0:
        return None
    if key == "TRANS" and row.axis in ROTARY and row.number is not None:
        return "the sense of a turn of the coordinates is not documented", _BY_HAND
    if key == "TRANS" and row.number is None:
        return "COORD is not a number", "write it as the control shows it, as -298.923"
    return "not understood", "write rows of Trans and MachAxis, with the axis and the figure"


def _structure(draft: Draft, places: list[_Place], base: int) -> str:
    """What carries what, as a code; "" where the table does not say it."""
    letters = [place.letter for place in places]
    if missing := [letter for letter in "XYZ" if letter not in letters]:
        draft.error("import.geometry", f"no row MachAxis {missing[0]}: the table does not say what moves along it",
                    places[0].line if places else 0, _BY_HAND)
        return ""
    slides = [k for k, letter in enumerate(letters) if letter not in ROTARY]
    between = next((p for p in places[slides[0]:slides[-1] + 1] if p.letter in ROTARY), None)
    if base < 0 and between is not None:
        draft.error("import.geometry", f"MachAxis {between.letter} stands between linear axes, and no row MachBase says "
                    "whether it turns the tool or the part", between.line, "write the row MachBase where the bed is")
        return ""
    split = base if base >= 0 else slides[-1] + 1
    return " ".join(["w", *(f"{letter}'" for letter in letters[split:][::-1]), "b", *letters[:split][::-1], "(C1)", "t"])
