"""How much the time of a curve changes with how far its points stand apart, by model, level of smoothing and tolerance.

    python tests/benchmarks/bench_chords.py [--blocks] [MODEL ...]

The measured plane cubic (`published.py`, sharpest bend 0.04 mm), a free plane curve (0.12 mm) and a free curve of five axes
(0.7 mm), as programs with points rounded to 0.001 mm and degrees, chords of 0.05 to 1 mm. Printed: most over least.
Blocks read ahead and block times are the control's own and cost time where points stand close: the tables are without them
(a buffer of 5000 blocks that take no time), unless `--blocks` asks for them.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.interpolate import BSpline

from postproc.cycle_time.blocks import OFF, MotionBlocks
from postproc.cycle_time.estimate import timed, total
from postproc.cycle_time.model import CycleTimeModel
from tests.benchmarks.published import KNOTS, POLES
from tests.postproc.time_kit import blocks, machine, model
from toolpaths.arrays import Floats

MODELS = ("control", "siemens", "fanuc", "haas", "heidenhain", "linuxcnc")
TOLERANCES = (0.05, 0.02, 0.01, 0.005)
CHORDS = np.linspace(0.05, 1.0, 13)
ON = machine("mikron-ucp710")
MANY = 5000
TIP = 60.0
"""mm from the axes to the tip of the curve of five axes"""
FREE = np.array([[0, 0], [8, 1], [15, 9], [16, 10.2], [16.6, 10.4], [17, 9.9], [16.8, 9], [20, 2], [28, 0], [30, 12],
                 [24, 14], [22, 13.2], [21.7, 13.8], [26, 20], [40, 16]])


def measured(u: Floats) -> Floats:
    """(N, 5) X Y Z A C."""
    return np.column_stack([BSpline(KNOTS, POLES, 3)(u), np.zeros((len(u), 3))])


def free(u: Floats) -> Floats:
    """(N, 5) X Y Z A C."""
    knots = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, len(FREE) - 2), np.ones(3)])
    return np.column_stack([BSpline(knots, FREE, 3)(u), np.zeros((len(u), 3))])


def swivelling(u: Floats) -> Floats:
    """(N, 5) X Y Z A C."""
    a, c = 0.35 + 0.2 * np.sin(3.4 * np.pi * u), 1.2 * np.sin(1.8 * np.pi * u + 0.4)
    arm = TIP * np.stack([np.sin(a) * np.sin(c), -np.sin(a) * np.cos(c), np.cos(a)], axis=1)
    tip = np.stack([40.0 * u, 6.0 * np.sin(2.6 * np.pi * u), 2.0 * np.cos(2.0 * np.pi * u)], axis=1)
    return np.column_stack([tip + arm, np.degrees(a), np.degrees(c)])


CURVES = {"measured": measured, "free": free, "swivelling": swivelling}


def program(name: str, chord: float) -> MotionBlocks:
    """Points of a curve about `chord` mm apart, at 3 m/min."""
    u = np.linspace(0.0, 1.0, 20_001)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(CURVES[name](u)[:, :3], axis=0), axis=1))])
    q = CURVES[name](np.interp(np.linspace(0.0, s[-1], round(float(s[-1]) / chord) + 1), s, u))
    rows = [f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} A{a:.3f} C{c:.3f}" for x, y, z, a, c in q]
    return blocks("\n".join(["G21 G90 G94 G17 G64", rows[0].replace("G1", "G0"), "F3000", *rows[1:]]), ON, "generic-iso")


def main(models: tuple[str, ...], own: bool) -> None:
    """The table."""
    made = {(name, chord): program(name, chord) for name in CURVES for chord in CHORDS.tolist()}
    print(f"{'model':11}{'level':>6}{'curve':>12}" + "".join(f"{one:>10}" for one in TOLERANCES))
    for word in models:
        known = model(word)
        if not own:
            known = known.model_copy(update={"lookahead": MANY, "block_time": 0.0, "off": None})
        levels = [one.level for one in known.levels] + ([OFF] if known.off is not None else [])
        for level in levels or [np.nan]:
            for name in CURVES:
                cells = []
                for tolerance in TOLERANCES:
                    t = np.array([seconds(made[name, chord], tolerance, level, known) for chord in CHORDS.tolist()])
                    cells.append(f"{100.0 * (t.max() / t.min() - 1.0):8.1f} %")
                print(f"{word:11}{level:6g}{name:>12}" + "".join(cells), flush=True)


def seconds(b: MotionBlocks, tolerance: float, level: float, known: CycleTimeModel) -> float:
    """s of a program at a tolerance and a level of smoothing."""
    at = replace(b, tolerance=np.full(len(b), tolerance), level=np.full(len(b), level))
    return total(at, timed(at, known))


if __name__ == "__main__":
    words = sys.argv[1:]
    main(tuple(one for one in words if one != "--blocks") or MODELS, "--blocks" in words)
