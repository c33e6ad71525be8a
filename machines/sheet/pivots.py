"""From the pivot numbers of a control, by its own names, to a point of each rotary axis."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from machines.sheet.model import PivotForm
from machines.sheet.quantity import WrongFigureError
from toolpaths.arrays import Floats

CLOSES = 0.01
"""mm that a vector which closes a chain may be off by"""
VectorNames = tuple[str, ...]
"""names of vectors: each goes from the pivot before it to the next; the last one, in brackets, closes the chain"""
_PLACES = ("machine", "haas")
"""forms whose numbers are places, not vectors from one axis to the next"""
_SWIVEL = ("I1", "I2", "I3", "I4")
"""of which a swivel data set has those at 0 too that its kind of machine does not use"""
_TWO_TABLES: dict[PivotForm, VectorNames] = {
    "haas": ("MRZP", "MRZP second"), "siemens": ("I2", "I3", "(I4)"), "heidenhain": ("Trans 1", "Trans 2"),
    "fanuc": ("19700", "19703")}
_TWO_HEADS: dict[PivotForm, VectorNames] = {
    "siemens": ("I3", "I2", "(I1)"), "heidenhain": ("Trans 1", "Trans 2"), "fanuc": ("19709", "19712")}
_MIXED: dict[PivotForm, tuple[VectorNames, VectorNames]] = {
    "siemens": (("I3", "(I4)"), ("I2", "(I1)")), "heidenhain": (("Trans 2",), ("Trans 1",)),
    "fanuc": (("19700",), ("19709",))}
_FROM_TOOL = ("heidenhain",)
"""forms whose vectors are one sequence from the tool to the part: that of the table begins at the axis of the head"""


def names_of(form: PivotForm, table: tuple[str, ...], head: tuple[str, ...]) -> tuple[VectorNames, VectorNames]:
    """Names of the vectors of table and head; () where there are none.

    Raises:
        WrongFigureError: where a control has no such table for this machine.
    """
    if form == "machine":
        return table, head
    try:
        if table and head:
            return _MIXED[form]
        known = _TWO_TABLES if table else _TWO_HEADS
        count = len(table or head)
        names = tuple(name for name in known[form] if count == 2 or name != known[form][1])
        return (names, ()) if table else ((), names)
    except KeyError:
        raise WrongFigureError(f"a {form} control has no table of pivots for a machine with the tool on {', '.join(head)}",
                               'write form = "machine" and a point of each line') from None


def _spelt(name: str) -> str:
    """A name without what people leave out or add: "Trans2", "MRZP Second"."""
    return "".join(name.split()).upper()


def points_of(form: PivotForm, table: tuple[str, ...], head: tuple[str, ...],
              given: Mapping[str, tuple[float, float, float]]) -> tuple[dict[str, Floats], list[str]]:
    """A point of each axis, mm, machine coordinates, and what is wrong with the numbers.

    No points where a chain does not close: what else is odd about them would be the same fault once more.
    Vectors of the head begin at its axis next to the tool. "MRZP second" left out: both axes go through one point.
    """
    chains = names_of(form, table, head)
    wanted = [name.strip("()") for chain in chains for name in chain]
    plain = {_spelt(name): name for name in wanted}
    given = {plain.get(_spelt(name), name): vector for name, vector in given.items()}
    wrong = [f"{name} is not a name of {form}: it has {', '.join(wanted)}"
             for name, vector in given.items() if name not in wanted and (name not in _SWIVEL or any(vector))]
    missing = [name for chain in chains for name in chain if name not in given and "(" not in name and name != "MRZP second"]
    if missing:
        lacks = f"{', '.join(missing)} missing: X, Y and Z in mm"
        return {}, [f"{'; '.join(wrong)}; {lacks}" if wrong else lacks]
    points, closed = dict[str, Floats](), True
    at = np.zeros(3)
    for chain, letters in zip(chains[::-1], (head[::-1], table), strict=True):
        vectors = {name.strip("()"): np.array(given.get(name.strip("()"), (0.0, 0.0, 0.0))) for name in chain}
        at = at if form in _FROM_TOOL else np.zeros(3)
        for letter, name in zip(letters, chain, strict=False):
            at = at if name not in given else vectors[name] if form in _PLACES else at + vectors[name]
            points[letter] = at
        closing = chain[-1].strip("()") if chain and "(" in chain[-1] else ""
        if closing in given and float(np.abs(vectors[closing] + at).max()) > CLOSES:
            says = ", ".join(f"{v:g}" for v in -at)
            closed = False
            wrong.append(f"{closing} closes the chain and would be [{says}], found {list(given[closing])}: see to the signs")
    return points if closed else {}, wrong
