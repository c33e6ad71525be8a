"""Bounds of the errors of platforms between axes: on carriers, over tables, before a wrist."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.tables.curves import Fourier
from machines.geometric_error.tables.names import DIRECTIONS, parse
from machines.kinematics.base import Kinematics
from machines.kinematics.legs.in_series import LegsInSeries
from machines.kinematics.legs.on_legs import OnLegs
from tests.machines.error_models import ARCSEC, curve, rod_errors
from tests.machines.geometric_error.test_geometric_error_rates import BOUND, with_two_directions, worst_share

NAMES = ("macro-micro", "tripod-head", "linear-delta-ac", "tricept", "planar-delta-z")
TOOL = 70.0


def kinematics(name: str) -> LegsInSeries | OnLegs:
    found = machines.load(name).kinematics
    assert isinstance(found, LegsInSeries | OnLegs)
    return found.with_tool(TOOL)


def model(kin: Kinematics, size: float = 1.0) -> ErrorModel:
    """Every dimension, every component and place of every axis that may have errors, the spindle."""
    rng, parts, constants = np.random.default_rng(3), [], {"EA0S": 4.0 * ARCSEC, "EX0S": 0.02}
    for letter in kin.axes_with_errors:
        rotary = kin.rotary[kin.axis_names.index(letter)]
        for k, d in enumerate(DIRECTIONS):
            most = size * (3.0 * ARCSEC if k >= 3 else 0.01)
            parts.append(Component(parse(f"E{d}{letter}"), Fourier(rng.normal(size=5) * most) if rotary else
                                   curve(rng, False, k, most)))
        constants |= {f"E{part}0{letter}": 5.0 * ARCSEC for part in "ABC" if part != letter}
        constants |= {f"EY0{letter}": 0.02, f"EX0{letter}": 0.01} if rotary else {}
    return ErrorModel(SerialErrors(tuple(parts), constants), rod_errors(kin, 4))


@pytest.mark.parametrize("name", NAMES)
def test_no_error_changes_faster_than_its_bound(name: str) -> None:
    """All together, rods alone, axes alone; tables of two approach directions. Rods that share are soft: shorter steps."""
    kin, most = kinematics(name), 0.02 if name == "planar-delta-z" else 0.3
    both = model(kin)
    assert 0.02 < worst_share(kin, both, (1e-3, most)) <= BOUND
    assert worst_share(kin, replace(both, axes=SerialErrors()), (most,)) <= BOUND
    alone = replace(both, rods=None, axes=model(kin, 30.0).axes)
    assert 0.02 < worst_share(kin, alone, (1e-2, most)) <= BOUND
    assert worst_share(kin, replace(both, axes=with_two_directions(kin, kin.axes_with_errors)), (most,)) <= BOUND
