"""Write a CL file of N five-axis points as blades are finished: python tests/benchmarks/blade_passes.py N OUT.cls [--seed K]

Passes around a twisted blade, of changing length and direction, points closer where the edges turn, the tool leaning by
a changing angle; each is led in and out along the tool, with rapids over the blade between them. Prints nothing; `SETUP` is
the text of a set-up whose part stands off the rotary axes. The same N and K give the same file.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TextIO

import numpy as np

from toolpaths.arrays import Floats

SETUP = """description = "blade, off the rotary axes"

[part]
origin = [37.3, -21.8, -118.4]
x_axis = [0.9156, 0.4021, 0.0]
y_axis = [-0.4021, 0.9156, 0.0]

[tools.1]
gauge_length = 118.4
"""
HEAD = ("$$ blade of {count} points\nTOOL PATH/{name},TOOL,BALL8\nTLDATA/MILL,8.0000,4.0000,75.0000,0.0000,0.0000\n"
        "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000\n"
        "LOAD/TOOL,1\nSPINDL/RPM,9000,CLW\nCOOLNT/ON\n")
ROW = "GOTO/{:.4f},{:.4f},{:.4f},{:.7f},{:.7f},{:.7f}"
TAIL = "END-OF-PATH\n"
CHORD, THICKNESS, TWIST, HEIGHT, CLEAR = 42.0, 9.0, np.radians(28.0), 70.0, 95.0
"""half lengths of a section, mm; twist from root to tip; height; where links go across"""


def section(at: Floats, height: float) -> tuple[Floats, Floats]:
    """Points (n, 3) and outward normals (n, 3) of the section at a height, at parameters of the ellipse."""
    turn = TWIST * height / HEIGHT
    c, s = np.cos(turn), np.sin(turn)
    shrink = 1.0 - 0.3 * height / HEIGHT
    x, y = CHORD * shrink * np.cos(at), THICKNESS * shrink * np.sin(at)
    nx, ny = np.cos(at) / CHORD, np.sin(at) / THICKNESS
    size = np.hypot(nx, ny)
    nx, ny = nx / size, ny / size
    tip = np.column_stack((c * x - s * y, s * x + c * y, np.full(len(at), height)))
    return tip, np.column_stack((c * nx - s * ny, s * nx + c * ny, np.zeros(len(at))))


def one_pass(count: int, height: float, forth: bool, rng: np.random.Generator) -> str:
    """Text of one pass of `count` points (at least 8): above, down, led in, around, led out, up."""
    around = np.linspace(0.0, 2.0 * np.pi, count - 4)
    at = around - 0.35 * np.sin(2.0 * around)
    at = rng.uniform(0.0, 0.4) + (at if forth else at[::-1])
    tip, normal = section(at, height)
    lean = np.radians(rng.uniform(38.0, 52.0)) + np.radians(4.0) * np.sin(3.0 * at)
    axis = np.column_stack((normal[:, :2] * np.sin(lean)[:, None], np.cos(lean)))
    tip = tip + 4.0 * normal
    out = tip[[0, -1]] + 6.0 * axis[[0, -1]]
    up = out + axis[[0, -1]] * ((CLEAR - out[:, 2]) / axis[[0, -1], 2])[:, None]
    rows = np.vstack((np.hstack((up[:1], axis[:1])), np.hstack((out[:1], axis[:1])), np.hstack((tip, axis)),
                      np.hstack((out[1:], axis[-1:])), np.hstack((up[1:], axis[-1:]))))
    spelt = [ROW.format(*values) for values in rows.tolist()]
    feed = rng.choice((1200.0, 1500.0, 1850.0))
    cut = "\n".join(spelt[3:-2])
    return (f"RAPID\n{spelt[0]}\nRAPID\n{spelt[1]}\nFEDRAT/MMPM,{feed / 2:.4f}\n{spelt[2]}\nFEDRAT/MMPM,{feed:.4f}\n{cut}\n"
            f"{spelt[-2]}\nRAPID\n{spelt[-1]}\n")


def sizes_of(count: int, rng: np.random.Generator) -> list[int]:
    """Points of each pass, 400 to 3000, together `count` (at least 400)."""
    sizes: list[int] = []
    left = count
    while left >= 3400:
        sizes.append(int(rng.integers(400, 3001)))
        left -= sizes[-1]
    return [*sizes, left]


def write(count: int, out: TextIO, seed: int) -> None:
    """Operations of about 20 passes each."""
    rng = np.random.default_rng(seed)
    sizes = sizes_of(count, rng)
    for index, size in enumerate(sizes):
        if index % 20 == 0:
            out.write((TAIL if index else "") + HEAD.format(count=count, name=f"BLADE_{index // 20 + 1}"))
        out.write(one_pass(size, HEIGHT * (1.0 - index / len(sizes)), index % 2 == 0, rng))
    out.write(TAIL)


def main() -> None:
    """Command line; the set-up is written next to the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, metavar="N", help="points, at least 400")
    parser.add_argument("out", type=Path, metavar="OUT.cls")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.count < 400:
        parser.error(f"N is {options.count}, at least 400 is needed")
    with options.out.open("w", encoding="ascii", newline="\n") as out:
        write(options.count, out, options.seed)
    options.out.with_suffix(".setup.toml").write_text(SETUP, encoding="ascii")


if __name__ == "__main__":
    main()
