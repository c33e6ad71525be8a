"""Realistic error models of any machine for the tests: 10 to 50 um and 5 to 20 arcsec, fixed seeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.geometric_error.actual.axis_motion import effect
from machines.geometric_error.actual.leg_frame import frame_of
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors, rod_frame, rod_names
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.tables.curves import Fourier, Polynomial, TableCurve
from machines.geometric_error.tables.names import DIRECTIONS, parse
from machines.kinematics.base import Kinematics
from machines.kinematics.legs.in_series import LegsInSeries
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.serial import Serial
from tests.machines.random_slides import random_slides
from toolpaths.arrays import Floats
from toolpaths.units import DEG

ARCSEC = DEG / 3600.0
REACH = 900.0
"""mm, positions that the slides' errors are known for"""


def serial_errors(kinematics: Kinematics, seed: int = 0, length: float = 0.01, angle: float = 3.0 * ARCSEC,
                  moving: str = "C") -> SerialErrors:
    """Every component of every axis, location and spindle; tables, splines, polynomials and series by turns."""
    rng = np.random.default_rng(seed)
    components, constants = [], {}
    for letter, rotary in zip(kinematics.axis_names, kinematics.rotary, strict=True):
        for k, direction in enumerate(DIRECTIONS):
            size = angle if k >= 3 else length
            components.append(Component(parse(f"E{direction}{letter}"), curve(rng, rotary, k, size)))
            if effect(parse(f"E{direction}0{letter}"), kinematics):
                constants[f"E{direction}0{letter}"] = float(rng.normal() * size)
    for k, direction in enumerate(DIRECTIONS[:5]):
        constants[f"E{direction}0S"] = float(rng.normal() * (angle if k >= 3 else length))
    reference = {kinematics.axis_names[0]: np.array([30.0, -20.0, 100.0])}
    return SerialErrors(tuple(components), constants, reference, {moving: "moving"})


def curve(rng: np.random.Generator, rotary: bool, k: int, size: float) -> TableCurve | Fourier | Polynomial:
    if rotary:
        return Fourier(rng.normal(size=7) * size / 2.0)
    if k == 1:
        return Polynomial(rng.normal(size=4) * size / 2.0, (-REACH, REACH), 20.0, REACH)
    x = np.linspace(-REACH, REACH, 13)
    return TableCurve(x, rng.normal(size=13) * size, "spline" if k == 2 else "linear")


def rod_errors(kinematics: Kinematics, seed: int = 0, length: float = 0.01,
               angle: float = 3.0 * ARCSEC) -> RodErrors:
    """All dimensions of a machine on rods."""
    rng, own = np.random.default_rng(seed), frame_of(kinematics)
    if own is not None:
        return own.zero.with_values(rng.normal(size=len(own.zero.names)) * [angle if angular(n, own.zero) else length
                                                                           for n in own.zero.names])
    frame = rod_frame(kinematics.on_rods)
    slides = kinematics.axis_names[: len(frame.rail)]
    zero = RodErrors.none(slides, rod_names(frame, slides))
    return zero.with_values(rng.normal(size=len(zero.names)) * [angle if ".guide." in n else length for n in zero.names])


def model(kinematics: Kinematics, seed: int = 0) -> ErrorModel:
    """For any machine; parallel ones with a rotary axis get errors of that axis too."""
    if isinstance(kinematics, Serial):
        return ErrorModel(serial_errors(kinematics, seed))
    rng, chain = np.random.default_rng(seed), SerialErrors(constants={"EA0S": 4.0 * ARCSEC, "EX0S": 0.02})
    if any(kinematics.rotary) and not isinstance(kinematics, OnLegs):
        letter = kinematics.axis_names[-1]
        parts = tuple(Component(parse(f"E{d}{letter}"), curve(rng, True, k, 3.0 * ARCSEC if k >= 3 else 0.01))
                      for k, d in enumerate(DIRECTIONS))
        chain = SerialErrors(parts, {**chain.constants, f"EX0{letter}": 0.02, f"EA0{letter}": 5.0 * ARCSEC})
    return ErrorModel(chain, rod_errors(kinematics, seed))


def joints(kinematics: Kinematics, n: int, seed: int = 0) -> Floats:
    """Joints (n, J) in the middle of the travel, rotary axes up to 2 rad; places of the workspace of parallel machines."""
    rng = np.random.default_rng(seed)
    if isinstance(kinematics, Serial):
        q = rng.uniform(-150.0, 150.0, (n, kinematics.joints))
        turning = np.array(kinematics.rotary)
        q[:, turning] = rng.uniform(-2.0, 2.0, (n, int(turning.sum())))
        return q
    if isinstance(kinematics, OnLegs):
        box = kinematics.workspace
        places = rng.uniform([*box.lower, box.tilt[0]], [*box.upper, box.tilt[1]], (n, 4))
        return kinematics.joints_at(places, np.zeros((n, 0)))
    if isinstance(kinematics, LegsInSeries):
        places = rng.uniform([*kinematics.workspace.lower, 0.0], [*kinematics.workspace.upper, 0.0], (n, 4))
        return kinematics.joints_at(places, rng.uniform(-1.0, 1.0, (n, len(kinematics.turning))))
    slides = random_slides(kinematics, rng, n)
    return slides if not any(kinematics.rotary) else np.column_stack([slides, rng.uniform(-1.0, 1.0, n)])


def correlated(full: ErrorModel, seed: int = 0) -> ErrorModel:
    """The model with a covariance of all its parameters."""
    root = np.random.default_rng(seed).normal(size=(len(full.names), 6)) * 1e-6
    return replace(full, covariance=root @ root.T + np.diag(np.full(len(full.names), 1e-14)))


def component(text: str, curve: TableCurve | Fourier | Polynomial) -> Component:
    """A component error by its name."""
    name = parse(text)
    assert name is not None
    return Component(name, curve)
