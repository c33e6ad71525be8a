"""Lost motion: the play operator against a plain loop, and what counts as turning back."""

from __future__ import annotations

import numpy as np

from machines.geometric_error.actual.lost_motion import GRAIN, PlaySteps, turning_sign
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.tables.curves import TableCurve
from machines.geometric_error.tables.names import parse


def test_walked_steps_are_the_play_of_a_loop() -> None:
    rng = np.random.default_rng(3)
    step, gap = rng.normal(size=(777, 3)), rng.uniform(0.5, 3.0, (777, 3))
    approach, expected = np.array([1.0, -1.0, 0.3]), []
    begin = approach
    for d, g in zip(step, gap, strict=True):
        approach = np.clip(approach + 2.0 * d / g, -1.0, 1.0)
        expected.append(approach)
    found = PlaySteps.of(step, gap).walked().at(begin)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert (np.abs(found) < 1.0).any() and (np.abs(found) == 1.0).any()


def test_one_after_the_other_is_both_at_once() -> None:
    one, two = PlaySteps.of(np.array([[0.4]]), np.array([[1.0]])), PlaySteps.of(np.array([[-0.3]]), np.array([[1.0]]))
    for approach in (-1.0, -0.2, 0.9):
        start = np.array([[approach]])
        np.testing.assert_allclose(one.then(two).at(start), two.at(one.at(start)), atol=1e-15)


def test_small_steps_back_turn_when_they_add_up() -> None:
    back = 0.4 * GRAIN[0]
    step = np.array([[1.0], [-back], [0.0], [back], [-back], [-back], [-back], [0.0]])
    assert turning_sign(step, np.array([False]))[:, 0].tolist() == [1, 1, 1, 1, 1, 1, -1, -1]
    assert turning_sign(0.1 * step[1:], np.array([False]))[:3, 0].tolist() == [0, 0, 0]


def test_lost_motion_of_axes() -> None:
    x = np.array([-100.0, 100.0])
    both = TableCurve(x, np.array([0.0, 0.0, 0.004, 0.002]), both=True)
    curves = {"EYY": both, "EZX": both, "EXX": both, "EZZ": TableCurve(x, np.array([0.0, 1.0]))}
    errors = SerialErrors(tuple(Component(name, c) for text, c in curves.items() if (name := parse(text)) is not None))
    names = ("X", "Y", "Z")
    assert errors.bidirectional(names) == [0, 1]
    q = np.array([[100.0, -100.0, 0.0], [0.0, 100.0, 0.0]])
    np.testing.assert_allclose(errors.gaps(names, q, [0, 1, 2]),
                               [[0.002, 0.004, GRAIN[0]], [0.003, 0.002, GRAIN[0]]])


def test_lost_motion_of_an_axis_named_after_another() -> None:
    """EXU is the positioning error of U, which moves along X (ISO 841)."""
    both = TableCurve(np.array([-100.0, 100.0]), np.array([0.0, 0.0, 0.004, 0.002]), both=True)
    name = parse("EXU")
    assert name is not None
    found = SerialErrors((Component(name, both),)).gaps(("U",), np.array([[100.0]]), [0])
    np.testing.assert_allclose(found, [[0.002]])
