"""The compiled loop of serial chains with errors against numpy's columns: the same bits, or the columns themselves."""

from dataclasses import replace

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.actual_chain_loop import ActualChainLoop
from machines.geometric_error.actual.actual_serial import ActualSerial
from machines.kinematics import chain_loop
from machines.kinematics.serial import Serial
from tests.machines.error_models import joints, serial_errors

pytestmark = pytest.mark.numeric
CHAINS = sorted(name for name in machines.names() if isinstance(machines.load(name).kinematics, Serial))


def placed(actual: ActualSerial, by_loop: bool, monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Tips, axes and sides, with approach directions and by the mean of both."""
    monkeypatch.setattr(chain_loop, "wanted", lambda *_: by_loop)
    q = joints(actual.kinematics, 60, 3)
    approach = np.random.default_rng(4).uniform(-1.0, 1.0, q.shape)
    return [*actual.place(q, approach), *actual.place(q), *actual.aim(q, approach)]


@pytest.mark.parametrize("name", CHAINS)
def test_the_tool_has_the_bits_of_the_columns(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kin = machines.load(name).kinematics.with_tool(123.4)
    full = serial_errors(kin, seed=2, moving=kin.axis_names[-1])
    few = replace(full, components=tuple(c for c in full.components if str(c.name)[1] in "XC"), constants={})
    for errors in (full, few, replace(full, components=())):
        actual = ActualSerial(kin, errors)
        plain, fast = (placed(actual, by_loop, monkeypatch) for by_loop in (False, True))
        for a, b in zip(plain, fast, strict=True):
            np.testing.assert_array_equal(a, b)


def test_angles_beyond_their_series_take_the_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    kin = machines.load("mikron-ucp710").kinematics
    actual = ActualSerial(kin, serial_errors(kin, angle=0.02))
    q = joints(kin, 10)
    assert ActualChainLoop.of(actual.lines).poses(q, None, actual.errors, np.eye(3)) is None
    for a, b in zip(*(placed(actual, by_loop, monkeypatch) for by_loop in (False, True)), strict=True):
        np.testing.assert_array_equal(a, b)
