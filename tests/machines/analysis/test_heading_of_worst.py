"""A figure that depends on the direction of a tilt says which: the measure at what is printed is the printed value."""

from __future__ import annotations

import numpy as np
import pytest

import machines
from machines.analysis.certify import pose_words
from machines.analysis.report import _transmission
from machines.analysis.transmission import Towards, condition_number, conditioning_factor, manipulability, speed_transmission
from toolpaths.units import DEG

MEASURES = {"condition_number": condition_number, "speed_transmission": speed_transmission, "manipulability": manipulability,
            "conditioning_factor": conditioning_factor}


@pytest.mark.parametrize("name", ["hexapod", "uranesx"])
def test_the_measure_there_is_the_value(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machines.analysis.report.COARSE", (2, 2, 2, 2))
    monkeypatch.setattr("machines.analysis.report.GRID", (2, 2, 2, 2))
    monkeypatch.setattr("machines.analysis.transmission.ROUNDS", 2)
    parts = machines.load(name).kinematics.transmits
    assert parts is not None
    found = _transmission(parts, None)
    for key, measure in MEASURES.items():
        row = found[key]
        towards = Towards(parts, row.get("at_heading_deg", 0.0) * DEG)
        there = measure(towards, np.array([row["at_mm"]]), np.array([row["at_tilt_deg"] * DEG]))
        np.testing.assert_allclose(there, row["worst"], rtol=1e-9)
        assert ("at_heading_deg" in row) == (name == "hexapod")
    assert found["conditioning_factor"]["worst"] <= found["conditioning_factor"]["best_on_grid"]
    assert "least_on_grid" not in found["conditioning_factor"]


def test_a_whole_turn_is_written_as_none() -> None:
    legs = machines.load("hexapod").kinematics.leg_geometry
    assert legs is not None
    assert pose_words(np.array([1.0, 2.0, 3.0, 0.2, 2.0 * np.pi - 1e-7]), legs).endswith("degrees towards 0")
