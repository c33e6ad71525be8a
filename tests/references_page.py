"""docs/references.md: what of the four documents is which command, call or test; printed values next to computed ones.

`python tests/references_page.py` writes it.
"""

from __future__ import annotations

import sys
import tomllib
from itertools import product
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from machines.analysis.transmission import condition_number
from machines.layouts.search import LayoutQuestion, figures_of
from machines.tolerances.influence import influence, largest, single
from machines.tolerances.sensitivity import sensitivity
from tests.benchmarks.layouts_again import rows, sizes
from tests.laws.test_acceptance import ROWS
from tests.laws.test_acceptance_legs import PLACES as H4_PLACES
from tests.laws.test_acceptance_legs import PRINTED, cylinder, mirrored, v4_in_the_middle, with_motors_at
from tests.machines.layouts.test_layouts import ANNEX_C, BOX
from tests.machines.tolerances.annex_f import OM, annex_f, annex_f_poses
from tests.source import ROOT

PAGE, ROWS_FILE = ROOT / "docs" / "references.md", ROOT / "tests" / "references.toml"
_HEADER = """# The documents, and what became of them

Written by `python tests/references_page.py`. T: Company, *Machines-outils rapides a structure parallele* (2000). P:
Grandguillaume, Lavernhe, Tournier, orientation by jerk polytopes (2017). C: Oueslati, calibration of a rotary axis (2004).
D: note on a 2D Delta. "Not yet" is what the project does not have; "no numbers" what a document shows only as a picture, a
photograph or a lost figure. Formulas are taken with the corrections that recomputing them asked for (misprints, scanning);
each docstring names its source.

"""


class Place(NamedTuple):
    """Part of a document, what it is, and what became of it."""

    of: str
    what: str
    here: str


PLACES = tuple(Place(**row) for row in tomllib.loads(ROWS_FILE.read_text("utf-8"))["place"])


def values() -> list[tuple[str, str, str, float]]:
    """(number, what, printed, computed)"""
    found = [(str(number), f"{row.what} ({row.recipe})", row.printed, row.compute())
             for number, rows in ROWS.items() for row in rows]
    rods, middle = annex_f(), annex_f_poses(1)
    s = sensitivity(rods, middle.place, middle.turn, OM)[0]
    names = [str(one) for one in rods.dimensions]
    for name, i, text in (("drive X x", 0, "0.3333"), ("drive X z", 1, "2.3805"), ("drive Z z", 2, "0.1667"),
                             ("rod X", 1, "2.5418")):
        found.append(("10", f"annex F, {'xyz'[i]} of Om per {name}", text, float(s[i, names.index(name)])))
    most = largest(influence(rods, OM, False), annex_f_poses(5), single(rods.dimensions[:3]))
    printed = ("2.4812", "1.7646", "5.2422", "3.9264", "2.1175", "6.3577")
    of = ("place",) * 3 + ("turn",) * 3
    for letter, text, what, value in zip("xyzxyz", printed, of, [*most.position, *(1000.0 * most.turn)], strict=True):
        found.append(("11", f"table F-2, P1 in {letter}: {what}", text, float(value)))
    return [*found, *symmetric_h4(), *annex_c()]


def annex_c() -> list[tuple[str, str, str, float]]:
    """Condition numbers and extents of all layouts of table III-5 and annex C, those that are printed and those that are
    not; where the document chose another value for one layout, both."""
    own = {"along x, compact": "-", "coplanar": "2.65", "hybrid": "-", "cone": "-"}
    found = []
    for name, printed in own.items():
        layout, numbers, rod = ANNEX_C[name]
        value = figures_of(LayoutQuestion(layout, BOX, 1.0, "condition"), numbers, rod)["condition"]
        found.append(("1", f"annex C, {name}: worst condition number", printed, value))
    widths = {"along x": ("y", "1.8"), "along x, compact": ("y", "1.35"), "along z": ("y", "1.4, 1.5"),
              "along z, compact": ("y", "1.2"), "coplanar": ("y", "1.6"), "star": ("x", "4, 2.5"), "hybrid": ("y", "1.2"),
              "cone": ("y", "2.4")}
    size = sizes()
    return found + [("2", f"table III-5 and annex C, {name}: extent along {axis} of the contracted model, m", printed,
                     1e-3 * size[name]["xyz".index(axis)]) for name, (axis, printed) in widths.items()]


def arrangements() -> list[str]:
    """Table V-33: the 15 arrangements of the symmetric H4 whose platform turns about z, with best and worst condition
    number."""
    lines = ["", "## Arrangements of the symmetric H4", "",
             "Best and worst condition number in the cylinder of table V-33, motors at angles phi of V-21 (one of those "
             "that a mirror makes the same). The document prints 12 of 15, by letters whose figure V-32 is a drawing; rows "
             "that have a letter here are those whose numbers it prints.", "",
             "| row | phi, degrees | best | worst | ratio |", "|---|---|---|---|---|"]
    own = {min(mirrored(tuple(phi))) for phi in product(*H4_PLACES)}
    for phi in sorted(one for one in own if abs(v4_in_the_middle(with_motors_at(one))) > 1e-6):
        numbers = condition_number(with_motors_at(phi).transmits, *cylinder())
        best, worst = float(numbers.min()), float(numbers.max())
        letter = [row for row, known in PRINTED.items() if np.abs(np.subtract((best, worst), known)).max() < 0.01]
        angles = ", ".join(map(str, phi))
        lines.append(f"| {''.join(letter) or '-'} | {angles} | {best:.3f} | {worst:.3f} | {worst / best:.2f} |")
    return lines


def found_again() -> list[str]:
    """The layouts of annex C by `machine design`, from scratch."""
    lines = ["", "## Layouts of annex C found again", "", "By `python tests/benchmarks/layouts_again.py`: the search of "
             "`machine design` with the rods and the extent that annex C chose as limits (mm), from scratch.", "",
             "| layout | limits | annex C's choice | found | numbers, mm |", "|---|---|---|---|---|"]
    return lines + [f"| {name} | {limits} | {own:.4f} | {found:.4f} | {words} |"
                    for name, limits, own, found, words, _ in rows()]


def symmetric_h4() -> list[tuple[str, str, str, float]]:
    """V-19 of H 100, r 260, L 480 mm: cos b - sin b = (r - H) / L, D where that is the angle with the arm down and level;
    rows I and E of table V-33."""
    h, r, length = 100.0, 260.0, 480.0
    b = np.arccos((r - h) / length / np.sqrt(2.0)) - 0.25 * np.pi
    across = np.sqrt(length**2 - (h + length * np.cos(b) - r) ** 2) + r - length * np.sin(b)
    found = [("8", "H4s: beta0, degrees (V-19)", "31.4", float(np.degrees(b))),
             ("8", "H4s: D, m", "0.42", float(across) * 1e-3)]
    for row, phi, printed in (("I", (180, 270, 90, 180), ("1.90", "5.69")), ("E", (180, 315, 45, 180), ("1.74", "6.71"))):
        numbers = condition_number(with_motors_at(phi).transmits, *cylinder())
        found += [("9", f"table V-33, row {row}: {what} condition number", text, float(value))
                  for what, text, value in zip(("best", "worst"), printed, (numbers.min(), numbers.max()), strict=True)]
    return found


def page() -> str:
    """The text of the page."""
    lines = ["| part | what | here |", "|---|---|---|", *(f"| {p.of} | {p.what} | {p.here} |" for p in PLACES), "",
             "## Values", "",
             "Numbers as in `tests/laws/test_acceptance.py`, `tests/laws/test_acceptance_legs.py` "
             "and `tests/machines/tolerances`, which hold them within their tolerance.", "",
             "| | what | printed | computed |", "|---|---|---|---|"]
    lines += [f"| {number} | {what} | {printed} | {np.format_float_positional(value, 5, fractional=False)} |"
              for number, what, printed, value in values()]
    lines += ["| 6 | UraneSX, forward of inverse | identity | within 1e-9 mm (`tests/laws/test_acceptance.py`) |",
              "| 12 | annex E, 60 dimensions against the exact closure | - | within 1e-7 (`tests/machines/tolerances`) |"]
    return _HEADER + "\n".join([*lines, *arrangements(), *found_again()]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
