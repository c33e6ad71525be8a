"""The layouts of annex C of Company 2000 found again by `machine design`, from scratch: `python
tests/benchmarks/layouts_again.py`.

Each with the rods and the extent that annex C chose as limits. Prints a table; `rows` is what docs/references.md takes.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from machines.layouts.search import LayoutQuestion, best, box_grid, contracted, extents, figures_of, slides_of
from tests.machines.layouts.test_layouts import ANNEX_C, BOX, LIMITS


def rows() -> list[tuple[str, str, float, float, str, float]]:
    """(layout, limits, condition number of annex C's choice, that found, its numbers in mm, seconds of processor)"""
    found = []
    for name, (layout, numbers, rod) in ANNEX_C.items():
        asked = LayoutQuestion(layout, BOX, 100.0, "condition", LIMITS[name])
        before = time.process_time()
        one = best(asked)
        seconds = time.process_time() - before
        assert one is not None
        own = figures_of(asked, numbers, rod)["condition"]
        words = ", ".join(f"{key} {value:.0f}" for key, value in {**one.numbers, "L": one.rod}.items())
        found.append((name, ", ".join(f"{k} {v:g}" for k, v in LIMITS[name].items()), own, one.figures["condition"], words,
                      seconds))
    return found


def sizes() -> dict[str, tuple[float, float, float]]:
    """Extents (x, y, z) mm of annex C's own choices."""
    found = {}
    for name, (layout, numbers, rod) in ANNEX_C.items():
        asked = LayoutQuestion(layout, BOX, 100.0, "condition")
        slides = slides_of(asked, numbers)
        x, y, z = np.round(extents(slides, contracted(slides, rod, box_grid(asked))[1])).tolist()
        found[name] = (x, y, z)
    return found


if __name__ == "__main__":
    for row in rows():
        print("{}: within {}: annex C {:.4f}, found {:.4f} ({}), {:.1f} s".format(*row))
