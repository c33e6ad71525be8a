"""FreeCAD's machine files: velocities per minute, roles, both forms of joints."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from machines.exchange.read import import_machine
from machines.machine import Machine

Axis = dict[str, object]


def axis(kind: str, role: str, direction: tuple[float, ...], low: float, high: float, velocity: float,
         origin: tuple[float, ...] = (0, 0, 0)) -> Axis:
    return {"type": kind, "role": role, "joint": {"origin": origin, "axis": direction}, "limits": {"min": low, "max": high},
            "max_velocity": velocity}


def mill(**more: Axis) -> dict[str, Axis]:
    return {"X": axis("linear", "table_linear", (1, 0, 0), 0, 510, 18000), "Y": axis("linear", "table_linear", (0, 1, 0), 0,
            360, 18000), "Z": axis("linear", "head_linear", (0, 0, 1), -410, 0, 15000), **more}


def imported(folder: Path, axes: dict[str, Axis], units: str = "metric",
             stated: tuple[str, ...] = ()) -> tuple[Machine | None, list[str]]:
    whole = {"machine": {"name": "shop", "units": units, "axes": axes}, "version": 1}
    (folder / "m.fcm").write_text(json.dumps(whole, indent=4))
    machine, found = import_machine(folder / "m.fcm", "auto", stated)[1:]
    return machine, [f"{d.severity.name} {d.code}" for d in found]


A = axis("rotary", "table_rotary", (1, 0, 0), -120, 30, 36000, (0, 0, 80))


def test_velocities_per_minute(tmp_path: Path) -> None:
    """18000 mm/min are 300 mm/s, 36000 degrees/min 600 degrees/s; accelerations stand nowhere."""
    machine, found = imported(tmp_path, mill(A=A))
    assert machine is not None and found == ["INFO import.sense", "INFO import.assumed"]
    assert machine.limits.velocity[:3] == pytest.approx([300.0, 300.0, 250.0])
    assert np.degrees(machine.limits.velocity[3]) == pytest.approx(600.0)
    assert machine.structure == "w A' X' Y' b Z (C1) t" and "X.acceleration" in machine.limits.assumed
    assert machine.limits.lower[2] == -410.0 and machine.figures["Z.travel"].startswith("m.fcm: line ")
    np.testing.assert_allclose(machine.kinematics.forward(np.array([[0, 0, 0, np.pi]]))[0][0], [0, 0, 160], atol=1e-9)


def test_inches(tmp_path: Path) -> None:
    """Per minute too: 600 inch/min are 254 mm/s."""
    axes = mill() | {"X": axis("linear", "table_linear", (1, 0, 0), 0, 20, 600)}
    machine = imported(tmp_path, axes, "imperial")[0]
    assert machine is not None
    assert (machine.limits.upper[0], machine.limits.velocity[0]) == pytest.approx((508.0, 254.0))


@pytest.mark.parametrize("joint", [[(0, 0, 0), (0, 0, 1)], [(0, 0, 1), (0, 0, 0)]])
def test_joints_as_lists(joint: list[tuple[float, ...]], tmp_path: Path) -> None:
    machine = imported(tmp_path, mill() | {"Z": axis("linear", "head_linear", (0, 0, 1), 0, 9, 60) | {"joint": joint}})[0]
    assert machine is not None and machine.kinematics.chain[2].direction.tolist() == [0, 0, 1]


def test_of_two_rotary_axes_the_file_does_not_say_which_carries_the_other(tmp_path: Path) -> None:
    axes = mill(A=A, C=axis("rotary", "table_rotary", (0, 0, 1), -360, 360, 36000))
    assert imported(tmp_path, axes)[1][0] == "ERROR import.geometry"
    machine = imported(tmp_path, axes, stated=("kinematics.structure=w C' A' b X Y Z (C1) t",))[0]
    assert machine is not None and machine.axis_names == ("X", "Y", "Z", "A", "C")


def test_what_is_wrong_is_said(tmp_path: Path) -> None:
    assert "ERROR import.number" in imported(tmp_path, mill() | {"X": {"limits": {"min": "far"}}})[1]
    assert "ERROR import.geometry" in imported(tmp_path, mill(S=A))[1]
    assert "ERROR import.travel" in imported(tmp_path, mill(A=A | {"limits": {"min": -90.0}}))[1]


def test_all_that_the_file_does_not_say_comes_at_once(tmp_path: Path) -> None:
    """Where an axis lies was asked for by a key of the machine file, one run after what carries what."""
    bare = {**A, "joint": None}
    machine, found = imported(tmp_path, mill(A=bare, C=bare))
    assert machine is None and found == 3 * ["ERROR import.geometry"]
    stated = ("kinematics.structure=w C' A' b X Y Z (C1) t", "kinematics.axes.A.point=[0, 0, 80]",
              "kinematics.axes.C.point=[0, 0, 0]")
    assert imported(tmp_path, mill(A=bare, C=bare), stated=stated)[0] is not None
