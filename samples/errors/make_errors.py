"""Write the error models and readings of this folder: `python samples/errors/make_errors.py [FOLDER]`. All invented."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import machines
from machines.geometric_error.actual.leg_frame import frame_of
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors, rod_frame, rod_names
from machines.geometric_error.actual.serial_errors import Component, ErrorFrame, SerialErrors
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.tables.csv_table import write_csv
from machines.geometric_error.tables.curves import Curve, Fourier, TableCurve
from machines.geometric_error.tables.names import DIRECTIONS, parse
from toolpaths.units import DEG

ARCSEC = DEG / 3600.0
UNCERTAINTY = {False: 0.0005, True: 0.3 * ARCSEC}
"""standard deviation of every parameter: mm, rad"""


def slide(rng: np.random.Generator, travel: tuple[float, float], part: int, both: bool) -> Curve:
    """A smooth table over the travel, worst about 15 um or 6 arcsec; positioning with 3 um of lost motion."""
    x = np.linspace(*travel, 1 + round((travel[1] - travel[0]) / 50.0))
    t = (x - travel[0]) / (travel[1] - travel[0])
    shape = rng.normal() * t + 0.6 * rng.normal() * np.sin(np.pi * t) + 0.3 * rng.normal() * np.sin(3.0 * np.pi * t)
    values = np.round(10.0 * shape, 2) * (0.4 * ARCSEC if part >= 3 else 1e-3)
    return TableCurve(x, np.concatenate([values, values + 0.003]), both=True) if both else TableCurve(x, values)


def serial(name: str, seed: int) -> ErrorModel:
    """A five-axis machine: all component errors, squareness, places of the rotary axes, spindle."""
    machine, rng = machines.load(name), np.random.default_rng(seed)
    components = []
    for j, letter in enumerate(machine.axis_names):
        for part, direction in enumerate(DIRECTIONS):
            found = parse(f"E{direction}{letter}")
            assert found is not None
            if machine.rotary[j]:
                waves = np.round(rng.normal(size=5) * [0.0, 5.0, 2.0, 5.0, 2.0], 2)
                curve: Curve = Fourier(waves * (0.4 * ARCSEC if part >= 3 else 1e-3))
            else:
                lower, upper = float(machine.limits.lower[j]), float(machine.limits.upper[j])
                curve = slide(rng, (lower, upper), part, both=part == j)
            components.append(Component(found, curve))
    constants = {"EC0Y": 6 * ARCSEC, "EB0Z": -4 * ARCSEC, "EA0Z": 5 * ARCSEC, "EY0A": 0.012, "EZ0A": -0.018,
                 "EB0A": 4 * ARCSEC, "EC0A": -5 * ARCSEC, "EX0C": 0.015, "EY0C": -0.010, "EA0C": 6 * ARCSEC,
                 "EB0C": -3 * ARCSEC, "EA0S": 5 * ARCSEC, "EB0S": -6 * ARCSEC}
    bed: dict[str, ErrorFrame] = {"A": "moving", "C": "moving"}  # both carry the part
    return with_uncertainty(ErrorModel(SerialErrors(tuple(components), constants, frame=bed), name=name, machine=name))


def parallel(name: str, seed: int) -> ErrorModel:
    """A machine on rods: every dimension off by some 10 um, guides by some 5 arcsec."""
    kinematics, rng = machines.load(name).kinematics, np.random.default_rng(seed)
    own = frame_of(kinematics)
    if own is None:
        frame = rod_frame(kinematics.on_rods)
        slides = kinematics.axis_names[: len(frame.rail)]
        zero, guides = RodErrors.none(slides, rod_names(frame, slides)), np.ones(len(slides))
    else:
        zero, guides = own.zero, 1.0 - own.machine.legs.stretch  # a leg that changes its length has no guide
    size = [5 * ARCSEC if angular(n, zero) else 0.008 for n in zero.names]
    size = [s * (guides[zero.legs.index(n[0])] if ".guide." in n else 1.0) for s, n in zip(size, zero.names, strict=True)]
    unit = [ARCSEC if angular(n, zero) else 0.001 for n in zero.names]
    values = np.round(rng.normal(size=len(size)) * np.divide(size, unit), 1) * unit
    return with_uncertainty(ErrorModel(rods=zero.with_values(values), name=name, machine=name))


def with_uncertainty(model: ErrorModel) -> ErrorModel:
    """The model with the standard deviations of UNCERTAINTY."""
    return replace(model, covariance=np.diag([UNCERTAINTY[angular(name, model.rods)] ** 2 for name in model.names]))


def runs(rng: np.random.Generator) -> str:
    """Readings of X of mill-3axis as ISO 230-2 has them: five times there and back, a column each; any order."""
    x = np.linspace(-500.0, 500.0, 11)
    there = 0.012 * x / 500.0 + 0.004 * np.sin(x / 90.0)
    truth = np.stack([there, there - 0.003], axis=1)
    rows = []
    for k in range(5):
        read = truth + rng.normal(size=truth.shape) * 5e-4
        rows.append(np.column_stack([x, read])[:: 1 if k % 2 == 0 else -1])
    found = np.concatenate(rows)
    return write_csv({"X": ("mm", found[:, 0]), "EXX+": ("um", found[:, 1].round(5)), "EXX-": ("um", found[:, 2].round(5))},
                     ["readings of a laser, five runs: postproc errors import runs-mill-3axis-X.csv --average ..."])


def measured_map(rng: np.random.Generator) -> str:
    """Displacements of a ball 120 mm below the gauge point of mikron-ucp710 over X, Y and C, as read by a laser tracker."""
    levels = np.meshgrid([-300.0, 0.0, 300.0], [-250.0, 0.0, 250.0], np.radians([0.0, 90.0, 180.0, 270.0]),
                         indexing="ij")
    x, y, c = (level.ravel() for level in levels)
    moved = [0.010 * x / 300.0 - 0.004 * y / 250.0 + 0.012 * np.cos(c), 0.008 * y / 250.0 + 0.012 * np.sin(c),
             0.006 * (x / 300.0) ** 2 - 0.005 * np.cos(2.0 * c)]
    read = [(values + rng.normal(size=len(x)) * 3e-4).round(5) for values in moved]
    columns = {"X": ("mm", x), "Y": ("mm", y), "C": ("deg", c)}
    columns |= {name: ("um", values) for name, values in zip(("dx", "dy", "dz"), read, strict=True)}
    return write_csv(columns, ["readings of a tracker, tool of 120 mm, machine axes: postproc errors import "
                               "map-mikron-ucp710.csv --tool-length 120 --directions machine --repeats C=360 ..."])


def main() -> None:
    """Write all."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for made in (serial("mikron-ucp710", 1), serial("linuxcnc-xyzac-trt", 2), parallel("uranesx", 3),
                 parallel("h4a-c-table", 4), parallel("hexapod", 7), parallel("planar-delta-z", 8)):
        save(made, folder, f"invented errors of {made.machine}, 10 to 50 um and 5 to 20 arcsec")
    (folder / "runs-mill-3axis-X.csv").write_text(runs(np.random.default_rng(5)), encoding="utf-8")
    (folder / "map-mikron-ucp710.csv").write_text(measured_map(np.random.default_rng(6)), encoding="utf-8")


if __name__ == "__main__":
    main()
