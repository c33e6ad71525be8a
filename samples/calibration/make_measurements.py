"""Simulate the sample measurements of this folder: `python samples/calibration/make_measurements.py [FOLDER]`.

A Mikron UCP 710 with known errors (truth.toml): the C axis by reversal (12 steps, 4 set-ups, indexer and mounting with
errors of their own), then the places of its axes by a probe on a ball. start.toml is what the second fit starts from.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import machines
from machines.calibration.simulator import Bench, simulate
from machines.geometric_error.csv_table import write_csv
from machines.geometric_error.curves import Fourier
from machines.geometric_error.exchange import save
from machines.geometric_error.model import ErrorModel
from machines.geometric_error.names import parse
from machines.geometric_error.serial_errors import Component, SerialErrors
from toolpaths.units import DEG

ARCSEC = DEG / 3600.0
STEPS, SETUPS, TOOL = 12, 4, 90.0
NOISE = 0.05 * ARCSEC, 0.3e-3
"""of the interferometer (rad) and of the probe (mm)"""
PLACES = {"EC0Y": 8, "EB0Z": -6, "EA0Z": 4, "EY0A": 20, "EZ0A": -30, "EB0A": 7, "EC0A": -5, "EX0C": 25, "EY0C": -15,
          "EA0C": 9, "EB0C": -4}
"""arcsec and um"""


def truth() -> ErrorModel:
    """Places of the axes, and the positioning error of C."""
    name = parse("ECC")
    assert name is not None
    series = Fourier(np.array([0.0, 6.0, -3.0, 1.0, 4.0, 2.0, -0.5]) * ARCSEC)
    constants = {k: v * (ARCSEC if k[1] in "ABC" else 1e-3) for k, v in PLACES.items()}
    return ErrorModel(SerialErrors((Component(name, series),), constants), name="truth", machine="mikron-ucp710")


def reversal(rng: np.random.Generator) -> str:
    """Table of the angular readings."""
    bench = Bench(STEPS)
    axis, indexer = np.zeros((STEPS, 6)), np.zeros((STEPS, 6))
    axis[:, 5] = truth().axes.components[0].curve.at(bench.angles)
    indexer[:, 5] = rng.normal(size=STEPS) * 0.5 * ARCSEC
    mounts = rng.normal(size=(SETUPS, 3, 6)) * [0.01, 0.01, 0.01, *np.full(3, 5.0 * ARCSEC)]
    read = simulate(bench, axis, indexer, mounts, np.full(6, NOISE[0]), rng)[:, :, 5]
    setup, step = np.repeat(np.arange(SETUPS), STEPS), np.tile(np.arange(STEPS), SETUPS)
    reading = _fine(read.ravel(), ARCSEC)
    return write_csv({"setup": ("", setup * 1.0), "step": ("", step * 1.0), "reading": ("arcsec", reading)},
                     ["interferometer on an indexer that turns back, zeroed in each set-up"])


def probe(rng: np.random.Generator, n: int = 80) -> str:
    """Table of a ball on the table, probed at many A and C."""
    kin = machines.load("mikron-ucp710").kinematics.with_tool(TOOL)
    start = np.column_stack([np.zeros((n, 3)), rng.uniform(-0.4, 1.5, n), rng.uniform(-3.0, 3.0, n)])
    axis, balls = kin.forward(start)[1], np.array([[120.0, 40.0, 60.0], [-60.0, 110.0, 20.0]])
    tip = np.repeat(balls, n // 2, axis=0)
    branches = kin.inverse(tip, axis, near=start)
    q = branches[np.argmin(np.abs(branches[:, :, 3] - start[:, 3]), axis=0), np.arange(n)]
    q = np.round(q / [1, 1, 1, DEG, DEG], 4) * [1, 1, 1, DEG, DEG]
    off = truth().on(kin).place(q)[0] - kin.forward(q)[0] - [0.05, -0.02, 0.03] + rng.normal(size=(n, 3)) * NOISE[1]
    columns = {name: ("deg" if k > 2 else "mm", q[:, k]) for k, name in enumerate("XYZAC")}
    return write_csv(columns | {f"d{x}": ("um", _fine(off[:, k], 1e-3)) for k, x in enumerate("xyz")},
                     ["probe on two balls of the table: actual less nominal place"])


def _fine(values: np.ndarray, unit: float) -> np.ndarray:
    return np.round(values / unit, 3) * unit


REVERSAL = f"""description = "C of the Mikron by reversal, simulated"
machine = "mikron-ucp710"

[reversal]
table = "reversal.csv"
axis = "C"
steps = {STEPS}
sigma_arcsec = 0.05
"""
START = 'base = "axis.toml"          # what the reversal found\n\n[location]\n' + "".join(f"{k} = 0.0\n" for k in PLACES)
PROBE = f"""description = "places of the axes by a probe on two balls, simulated"
machine = "mikron-ucp710"
model = "start.toml"
parameters = ["E{'", "E'.join(k[1:] for k in PLACES)}"]

[poses]
table = "probe.csv"
sigma_um = 0.3
tool_length = {TOOL}
"""


def main() -> None:
    """Write all."""
    folder, rng = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent, np.random.default_rng(11)
    save(truth(), folder, "the simulated machine")
    for name, text in (("reversal.csv", reversal(rng)), ("probe.csv", probe(rng)), ("reversal.toml", REVERSAL),
                       ("start.toml", START), ("probe.toml", PROBE)):
        (folder / name).write_text(text)


if __name__ == "__main__":
    main()
