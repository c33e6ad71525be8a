"""Errors of a whole machine from what was measured on it: poses (probe on ball, R-test, tracker), distances
(ball-bar), displacements along a direction (laser).

The readings are predicted exactly, by the machine with errors; their rates by its first-order sensitivity. What belongs to
the instrument is identified along: where the ball stands on the table, how far the tool's ball is from where it is thought.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from machines.calibration.folded_names import near
from machines.calibration.problem import CalibrationProblem, CalibrationResult, solve
from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.model import ErrorModel
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

MeasuredQuantity = Literal["position", "distance", "along"]
BALL = ("ball.x", "ball.y", "ball.z")
SETUP = {"position": BALL, "distance": (*BALL, "bar.length"), "along": ("zero",)}


@dataclass(frozen=True, eq=False)
@arrays(q="N J", read="...", sigma="...", centre="3", toward="3", approaches="N J")
class Measurements:
    """N poses of the machine with what was read there.

    Attributes:
        kind: "position": tip less nominal tip, (N, 3) mm in the table frame; "distance": tip to `centre`,
            (N,) mm; "along": tip less nominal tip along `toward`, (N,) mm
        q: (N, J) commanded joints
        read: (N, 3) or (N,)
        sigma: mm, one or per reading
        centre: (3,) mm in the table frame, nominal centre of the ball-bar
        toward: (3,) unit direction in the table frame
        approaches: (N, J) from which direction each joint came: +1, -1, 0 for the mean of both; None: the mean for all
        zeroed: True where the place of the ball (zero of the laser) is not known and is identified along
    """

    kind: MeasuredQuantity
    q: Floats
    read: Floats
    sigma: float | Floats
    centre: Floats | None = None
    toward: Floats | None = None
    approaches: Floats | None = None
    zeroed: bool = True


def problem_of(model: ErrorModel, kinematics: Kinematics, measured: Measurements,
               parameters: Sequence[str] = ()) -> CalibrationProblem:
    """The identification of `parameters` (names of the model, or beginnings of them; all without) from measurements.

    Raises:
        ValueError: where a name is none of the model's.
    """
    chosen = [name for name in model.names if not parameters or name.startswith(tuple(parameters))]
    for prefix in parameters:
        if not any(name.startswith(prefix) for name in model.names):
            raise ValueError(f"{prefix!r} is not a parameter of the error model; {near(prefix, model.names)}")
    setup = SETUP[measured.kind]
    names = (*model.names, *setup)
    free = np.array([*(name in set(chosen) for name in model.names), *(measured.zeroed for _ in setup)])
    nominal = model.on(kinematics)
    w = nominal.coordinates(measured.q)
    count = len(model.names)
    reader = _Reader(measured, model.zero().on(kinematics).place(w)[0])

    def actual(values: Floats) -> Actual:
        return model.with_values(values[:count]).on(kinematics)

    def predict(values: Floats) -> Floats:
        return reader.read(actual(values).place(w, measured.approaches)[0], values[count:])

    def jacobian(values: Floats) -> Floats:
        machine = actual(values)
        moved = machine.sensitivity(w, measured.approaches)[:, :3]
        return reader.rates(machine.place(w, measured.approaches)[0], moved, values[count:])

    read = np.asarray(measured.read, dtype=np.float64).ravel()
    sigma = np.broadcast_to(measured.sigma, np.shape(measured.read)).ravel()
    guess = np.concatenate([model.values, np.zeros(len(setup))])
    return CalibrationProblem(names, guess, free, read, sigma, predict, jacobian)


@dataclass(frozen=True, eq=False)
@arrays(nominal="N 3")
class _Reader:
    """Readings (R,) of tips (N, 3), and their rates."""

    measured: Measurements
    nominal: Floats
    """(N, 3) tips of the machine without errors"""

    def read(self, tip: Floats, setup: Floats) -> Floats:
        kind = self.measured.kind
        if kind == "position":
            return np.asarray((tip - self.nominal - setup).ravel())
        if kind == "along":
            return np.asarray((tip - self.nominal) @ self._toward() - setup[0])
        return np.asarray(np.linalg.norm(tip - self._centre() - setup[:3], axis=1) - setup[3])

    def rates(self, tip: Floats, moved: Floats, setup: Floats) -> Floats:
        n, kind = len(tip), self.measured.kind
        if kind == "position":
            own = np.tile(-np.eye(3), (n, 1))
            return np.concatenate([moved.reshape(3 * n, -1), own], axis=1)
        if kind == "along":
            return np.column_stack([np.einsum("i,nip->np", self._toward(), moved), -np.ones(n)])
        bar = tip - self._centre() - setup[:3]
        unit = bar / np.linalg.norm(bar, axis=1, keepdims=True)
        return np.column_stack([np.einsum("ni,nip->np", unit, moved), -unit, -np.ones(n)])

    def _toward(self) -> Floats:
        assert self.measured.toward is not None
        return self.measured.toward

    def _centre(self) -> Floats:
        assert self.measured.centre is not None
        return self.measured.centre


@dataclass(frozen=True, eq=False)
class MachineFit:
    """The identified model, with its covariance, and the fit that gave it.

    Attributes:
        setup: values of the instrument, mm: how far the ball is from its place (of the readings), what the
            bar's readings are too short by, what the laser reads at 0 with the sign turned round
        cost_instrument: sum of squared weighted residuals where nothing but those is found
    """

    model: ErrorModel
    result: CalibrationResult
    setup: dict[str, float]
    cost_instrument: float


def fit(model: ErrorModel, kinematics: Kinematics, measured: Measurements, parameters: Sequence[str] = (),
        robust: bool = False) -> MachineFit:
    """Identify; see `problem_of`. Where the data do not determine all, `result.not_identifiable` names it."""
    problem = problem_of(model, kinematics, measured, parameters)
    result = solve(problem, robust)
    count = len(model.names)
    covariance = np.array(result.covariance[:count, :count])
    if model.covariance is not None:  # what is known of the parameters that stay
        stay = np.flatnonzero(~problem.free[:count])
        covariance[np.ix_(stay, stay)] = model.covariance[np.ix_(stay, stay)]
    found = replace(model.with_values(result.values[:count]), covariance=covariance)
    names = result.names[count:]
    alone = replace(problem, free=problem.free & (np.arange(len(problem.names)) >= count))
    cost = solve(alone, robust).cost_after if alone.free.any() else result.cost_before
    return MachineFit(found, result, dict(zip(names, result.values[count:].tolist(), strict=True)), cost)
