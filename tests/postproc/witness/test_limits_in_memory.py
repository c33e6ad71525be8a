"""A machine whose limits a caller has changed is held to those, not to its file's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import postproc
from machines.machine import Limits, Machine
from tests.postproc.kit import machine, tool_setup, toolpath

FAST = ["RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,60000", "GOTO/0,0,1", "GOTO/200,0,1", "RAPID",
        "GOTO/200,0,50"]


def times(factor: float) -> Machine:
    """The mill with velocities `factor` times those of its file."""
    m = machine("mill-3axis")
    limits = m.limits
    return replace(m, limits=Limits(limits.lower, limits.upper, factor * limits.velocity, limits.acceleration, limits.jerk))


@pytest.mark.parametrize("factor", [0.2, 1.0, 4.0])
def test_feeds_are_held_to_the_limits_in_force(factor: float) -> None:
    result = postproc.convert(toolpath(*FAST), times(factor), "linuxcnc", tool_setup())
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.witness is not None and not result.witness.findings
    assert result.program is not None and np.nanmax(result.program.feed) <= 60.0 * times(factor).limits.velocity.max() + 1e-6
