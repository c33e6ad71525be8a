"""docs/machines.md from the machine files: travel, rapid, range of every machine of the catalogue, and who states it.

`python tests/machine_page.py` writes it.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

import machines
from machines.figures import ASSUMED
from machines.machine import Machine
from tests.source import ROOT

PAGE = ROOT / "docs" / "machines.md"
_HEADER = """# Machines of the catalogue

Written by `python tests/machine_page.py` from `machines/catalogue`; `postproc machine show NAME` has every figure
with its document and place. Travel in mm and degrees, rapids in m/min, rotary axes in turns per minute.

A figure is **the maker's** (m: his document or the settings of his control), that of **others** (o: settings that a
control's distribution ships, a post processor, a public list), or **assumed** (a: no document states it; plausible for the
size).
Accelerations and jerks are named where they are stated. Put in your own: `base = "haas-umc-750"`, then the figures of your
machine, which are assumed no more; pivots are always yours, they are measured on each machine.

"""
_MARK = {"maker": "m", "paper": "p", "others": "o"}


def page() -> str:
    """The text of the page."""
    lines = ["| machine | axes | travel | rapid | acceleration |", "|---|---|---|---|---|"]
    for name in machines.catalogued():
        m = machines.load(name)
        by = {one.document: _MARK[one.by] for one in m.documents}
        columns = ("; ".join(f"{axis} {text(m, j)} ({mark(m, f'{axis}.{key}', by)})" for j, axis in enumerate(m.axis_names))
                   for key, text in (("travel", _travel), ("velocity", _velocity), ("acceleration", _acceleration)))
        lines.append(f"| `{name}`: {m.description} | {m.structure} | {' | '.join(columns)} |")
    return _HEADER + "\n".join(lines) + "\n\n" + _documents()


def mark(m: Machine, figure: str, by: dict[str, str]) -> str:
    """m, o, p or a: who states a figure."""
    origin = m.figures[figure]
    if origin == ASSUMED:
        return "a"
    return next(letter for document, letter in by.items() if origin.startswith(f"{document}: "))


def _travel(m: Machine, j: int) -> str:
    unit = 180.0 / np.pi if m.rotary[j] else 1.0
    low, high = m.limits.lower[j] * unit, m.limits.upper[j] * unit
    if not np.isfinite(low):
        return "endless"
    return f"{low:.4g} to {high:.4g}" if m.rotary[j] else f"{high - low:.4g}"


def _velocity(m: Machine, j: int) -> str:
    return f"{m.limits.velocity[j] * (60 / (2 * np.pi) if m.rotary[j] else 0.06):.3g}"


def _acceleration(m: Machine, j: int) -> str:
    return f"{m.limits.acceleration[j] * (180.0 / np.pi if m.rotary[j] else 1.0):.4g}"


def _documents() -> str:
    found = dict[str, str]()
    for name in machines.catalogued():
        found |= {one.document: one.address for one in machines.load(name).documents}
    return "## Documents\n\n" + "\n".join(f"- {document}: <{address}>" for document, address in sorted(found.items())) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
