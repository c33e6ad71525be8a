"""Write an NX file of N points for speed measurements: python samples/make_big.py N OUT.cls [--five-axis].

A wavy field of 160 x 160 mm, cut in lines along x (zig) with a rapid link after each; the N points count every GOTO.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TextIO

import numpy as np
from cltext import Cutter, Floats, NxFile, leaning

PASS = 1000
"""GOTO per pass: one rapid above the start, the cut, one rapid above the end"""


def surface(x: Floats, y: Floats) -> Floats:
    """Height of the field, mm."""
    return 6 * np.sin(x / 13) * np.cos(y / 17)


def one_pass(index: int, passes: int, count: int, five_axis: bool) -> str:
    """Text of one pass of `count` points (at least 3)."""
    x = np.linspace(-80, 80, count - 2)
    y = np.full_like(x, -80 + 160 * index / max(passes - 1, 1))
    rows = np.column_stack((x, y, surface(x, y)))
    row = "GOTO/%.5f,%.5f,%.5f"
    if five_axis:
        rows = np.hstack((rows, leaning(np.radians(30 + 10 * np.sin(x / 20)), x / 30 + y / 40)))
        row += ",%.7f,%.7f,%.7f"
    above = rows[[0, -1]] + np.eye(1, rows.shape[1], 2) * (25 - rows[[0, -1], 2:3])
    first, last = (row % tuple(p) for p in above)
    cut = "\n".join([row] * len(rows)) % tuple(rows.ravel())
    return f"RAPID\n{first}\nFEDRAT/MMPM,2500.0000\n{cut}\nRAPID\n{last}\n"


def write(count: int, out: TextIO, five_axis: bool) -> None:
    """Header, passes one at a time, end of the operation."""
    nx = NxFile((f"Speed measurement: {count} points, {'five' if five_axis else 'three'} axes.",))
    nx.operation("FIELD", Cutter(1, "BALL6", 6, 3))
    out.write(nx.text())
    nx.lines.clear()
    sizes = [PASS] * (count // PASS)
    sizes[-1] += count % PASS
    for index, size in enumerate(sizes):
        out.write(one_pass(index, len(sizes), size, five_axis))
    nx.end()
    out.write(nx.text())


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, metavar="N", help=f"points, at least {PASS}")
    parser.add_argument("out", type=Path, metavar="OUT.cls")
    parser.add_argument("--five-axis", action="store_true", help="tool axis 20 to 40 degrees from z, turning")
    options = parser.parse_args()
    if options.count < PASS:
        parser.error(f"N is {options.count}, at least {PASS} is needed")
    with options.out.open("w", encoding="ascii", newline="\n") as out:
        write(options.count, out, options.five_axis)


if __name__ == "__main__":
    main()
