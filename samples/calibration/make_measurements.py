"""Simulate the sample measurements of this folder: `python samples/calibration/make_measurements.py [FOLDER]`.

A Mikron UCP 710 with known errors (truth.toml): the C axis by reversal (12 steps, 4 set-ups, indexer and
mounting with errors of their own), then the places of its axes by a probe on a ball. start.toml is what the
second fit starts from.
Next to it, each with a start of its own: the squareness of the slides by a ball-bar, the screw of X by a laser (both
directions, screw-truth.toml), all six errors of C by reversal.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rotary_readings import simulate

import machines
from machines.calibration.rotary_bench import PARTS, Bench
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.tables.csv_table import write_csv
from machines.geometric_error.tables.curves import Fourier, TableCurve
from machines.geometric_error.tables.names import parse
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
    return ErrorModel(SerialErrors((Component(name, series),), constants), name="truth",
                      machine="mikron-ucp710")


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
    return write_csv(_joints(q) | {f"d{x}": ("um", _fine(off[:, k], 1e-3)) for k, x in enumerate("xyz")},
                     ["probe on two balls of the table: actual less nominal place"])


SQUARE = "EC0Y", "EB0Z", "EA0Z"
RADIUS, LONG, BALL = 150.0, 0.0032, (0.012, -0.02, 0.008)
"""of the ball-bar, what its readings are too long by, and where its ball stands from the centre, mm"""
SERIES, SETUPS_OF_SIX = {"dz": (2, 1.5, -0.5), "ex": (2, -1.0, 0.7), "ez": (1, 2.0, 4.0)}, 3
"""harmonic, cosine and sine of errors of C, um and arcsec"""
SCREW = np.linspace(-300.0, 300.0, 13)


def ball_bar(rng: np.random.Generator, n: int = 24) -> str:
    """Table of three circles, one in each plane of the slides."""
    kin = machines.load("mikron-ucp710").kinematics.with_tool(TOOL)
    turn = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    circle = RADIUS * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    q = np.concatenate([circle, circle[:, [0, 2, 1]], circle[:, [2, 0, 1]]])
    q = np.round(np.column_stack([q, np.zeros((3 * n, 2))]), 4)
    bar = truth().on(kin).place(q)[0] - kin.forward(np.zeros((1, 5)))[0] - BALL
    read = np.linalg.norm(bar, axis=1) + LONG + rng.normal(size=3 * n) * NOISE[1]
    return write_csv(_joints(q) | {"distance": ("mm", np.round(read, 5))},
                     ["ball-bar, three circles of 150 mm"])


def screw() -> ErrorModel:
    """Positioning error of X, 3 um of lost motion."""
    forward = np.round(8e-3 * SCREW / 300.0 + 2e-3 * np.sin(SCREW / 50.0), 4)
    name = parse("EXX")
    assert name is not None
    table = TableCurve(SCREW, np.concatenate([forward, forward - 3e-3]), both=True)
    return ErrorModel(SerialErrors((Component(name, table),)), name="screw-truth", machine="mikron-ucp710")


def laser(rng: np.random.Generator, runs: int = 2) -> str:
    """Table of X forwards and backwards."""
    kin = machines.load("mikron-ucp710").kinematics.with_tool(TOOL)
    x = np.tile(np.concatenate([SCREW, SCREW[::-1]]), runs)
    approach = np.tile(np.repeat([1.0, -1.0], len(SCREW)), runs)
    q, approaches = np.zeros((len(x), 5)), np.zeros((len(x), 5))
    q[:, 0], approaches[:, 0] = x, approach
    off = (screw().on(kin).place(q, approaches)[0] - kin.forward(q)[0])[:, 0] + rng.normal(size=len(x)) * NOISE[1]
    return write_csv(_joints(q) | {"X way": ("", approach), "reading": ("um", _fine(off, 1e-3))},
                     ["interferometer along X: actual less nominal"])


def rotary(rng: np.random.Generator) -> str:
    """Table of all six readings of C."""
    bench, unit = Bench(STEPS), {part: 1e-3 if part[0] == "d" else ARCSEC for part in PARTS}
    axis = np.zeros((STEPS, 6))
    for part, (harmonic, cosine, sine) in SERIES.items():
        phase = harmonic * bench.angles
        axis[:, PARTS.index(part)] = unit[part] * (cosine * np.cos(phase) + sine * np.sin(phase))
    sizes = np.array([unit[part] for part in PARTS])
    indexer = rng.normal(size=(STEPS, 6)) * 0.5 * sizes
    mounts = rng.normal(size=(SETUPS_OF_SIX, 3, 6)) * 5.0 * sizes
    noise = np.repeat([0.1e-3, NOISE[0]], 3)
    read = simulate(bench, axis, indexer, mounts, noise, rng).reshape(-1, 6)
    setup, step = np.repeat(np.arange(SETUPS_OF_SIX), STEPS), np.tile(np.arange(STEPS), SETUPS_OF_SIX)
    where = {"setup": ("", setup * 1.0), "step": ("", step * 1.0)}
    six = {part: ("um" if part[0] == "d" else "arcsec", _fine(read[:, k], unit[part])) for k, part in enumerate(PARTS)}
    return write_csv(where | six, ["reflector and levels on an indexer that turns back"])


def _joints(q: np.ndarray) -> dict[str, tuple[str, np.ndarray]]:
    return {name: ("deg" if k > 2 else "mm", q[:, k]) for k, name in enumerate("XYZAC")}


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
BAR_START = "[location]\n" + "".join(f"{k} = 0.0\n" for k in SQUARE)
BALL_BAR = f"""description = "squareness of the slides by a ball-bar, simulated"
machine = "mikron-ucp710"
model = "bar-start.toml"

[ball_bar]
table = "ball_bar.csv"
sigma_um = 0.3
centre = [0.0, 0.0, {-TOOL}]     # table frame: where the ball stands, under the spindle at X0 Y0 Z0
tool_length = {TOOL}
"""
SCREW_START = """[components.EXX]             # both directions: + reached forwards, - backwards
table = "screw-start-X.csv"
"""
LASER = f"""description = "screw of X by a laser, both directions, simulated"
machine = "mikron-ucp710"
model = "screw-start.toml"

[laser]
table = "laser.csv"
sigma_um = 0.3
toward = [1.0, 0.0, 0.0]
tool_length = {TOOL}
"""
ROTARY = f"""description = "all six errors of C of the Mikron, simulated"
machine = "mikron-ucp710"

[rotary]
table = "rotary.csv"
axis = "C"
steps = {STEPS}
harmonics = 2
sigma_um = 0.1
sigma_arcsec = 0.05
"""


def main() -> None:
    """Write all."""
    folder, rng = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent, np.random.default_rng(11)
    save(truth(), folder, "the simulated machine")
    save(screw(), folder, "the simulated screw")
    zeros = {"X": ("mm", SCREW), "EXX+": ("um", np.zeros(len(SCREW))), "EXX-": ("um", np.zeros(len(SCREW)))}
    for name, text in (("reversal.csv", reversal(rng)), ("probe.csv", probe(rng)), ("ball_bar.csv", ball_bar(rng)),
                       ("laser.csv", laser(rng)), ("rotary.csv", rotary(rng)), ("screw-start-X.csv", write_csv(zeros)),
                       ("reversal.toml", REVERSAL), ("start.toml", START), ("probe.toml", PROBE),
                       ("ball_bar.toml", BALL_BAR), ("bar-start.toml", BAR_START), ("laser.toml", LASER),
                       ("screw-start.toml", SCREW_START), ("rotary.toml", ROTARY)):
        (folder / name).write_text(text)


if __name__ == "__main__":
    main()
