"""The second witness's machine with geometric errors: where the project has the tool, faults that it sees."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.files.loader import load
from machines.machine import Machine
from postproc.pipeline.result import PostResult
from postproc.readback.execution.actual import ActualBlockPoses
from postproc.verification.second_witness import error_tables, machine_tables
from postproc.witness.errors import ErrorChain, columns_of, error_chain
from postproc.witness.machine import merged
from tests.machines.geometric_error.test_geometric_error_maps_independent import CASES, Map
from tests.machines.independent_machine import Machine as SecondMachine
from tests.machines.random_error_files import Draw
from tests.postproc.kit import SAMPLES, convert, good, toolpath
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Severity

SERIAL = [name for name in machines.names() if machines.load(name).kinematics.chain]
TOOL = 63.0
SHORT = ("SPINDL/RPM,3000,CLW", "RAPID", "GOTO/20,10,60,0,0,1", "FEDRAT/MMPM,600", "GOTO/20,10,5,0,0,1",
         "GOTO/45,-18,5,0,0.1961161,0.9805807", "GOTO/-30,12,4,0.0995037,0,0.9950372", "RAPID", "GOTO/-30,12,60,0,0,1")


def chain_of(machine: Machine, file: Path) -> ErrorChain:
    made = error_chain(merged(machine_tables(machine)), *error_tables(file))
    assert made is not None
    return made


def places(machine: Machine, seed: int) -> tuple[Floats, Floats]:
    """Joints (9, J) in travel, and approach directions."""
    rng = np.random.default_rng(seed)
    low, high = np.nan_to_num(machine.limits.lower, neginf=-7.0), np.nan_to_num(machine.limits.upper, posinf=7.0)
    return rng.uniform(low, high, (9, len(low))), rng.choice([-1.0, -0.3, 0.0, 1.0], size=(9, len(low)))


def assert_alike(machine: Machine, file: Path, seed: int) -> None:
    q, approach = places(machine, seed)
    kin = machine.kinematics.with_tool(TOOL)
    actual = load(file, machine).on(kin)
    tip, axis = actual.aim(actual.coordinates(q, np.concatenate(kin.forward(q), axis=1)), approach)
    own = chain_of(machine, file).pose(q, machine.axis_names, np.full(len(q), TOOL), approach)
    assert np.abs(tip - kin.forward(q)[0]).max() > 5e-3
    np.testing.assert_allclose(own[0], tip, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(own[1], axis, rtol=0.0, atol=1e-12)


@pytest.mark.covering
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", SERIAL)
def test_component_location_and_spindle_errors_of_every_kind(name: str, seed: int, tmp_path: Path) -> None:
    assert_alike(machines.load(name), Draw(tmp_path, SecondMachine(name), seed, both=seed == 1).write(), seed)


@pytest.mark.covering
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("name", "letters"), [case for case in CASES if case[0] in SERIAL])
def test_maps_of_every_order_unit_and_direction(name: str, letters: str, seed: int, tmp_path: Path) -> None:
    assert_alike(machines.load(name), Map(SecondMachine(name), letters, seed).write(tmp_path), seed)


def test_a_file_over_a_base_in_another_folder(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    base = Draw(tmp_path / "below", SecondMachine("mikron-ucp710"), 0).write()
    top = tmp_path / "top.toml"
    top.write_text(f'base = "below/{base.name}"\n[location]\nEC0Y = 90.0\n')
    machine = machines.load("mikron-ucp710")
    assert_alike(machine, top, 0)
    q, approach = places(machine, 0)
    length = np.full(len(q), TOOL)
    poses = [chain_of(machine, file).pose(q, machine.axis_names, length, approach)[0] for file in (base, top)]
    assert np.abs(poses[0] - poses[1]).max() > 1e-3


@pytest.mark.parametrize("text", [
    "X [mm],EXX [um]\n0,1\n10,2\n", "# laser\nX (mm);EXX (\u00b5m);\n0;1;\n10;2\n",
    "run of May\nX\tEXX\n[mm]\t[um]\n0\t1\n\n10\t2\n",
    "sep=;\n\"X [mm]\";EXX [um]\n0;1,0\n10,0;2,0\n"])
def test_tables_as_spreadsheets_save_them(text: str) -> None:
    for code in ("utf-8", "utf-8-sig", "utf-16"):
        found = columns_of(text.encode(code))
        assert {k: v.tolist() for k, v in found.items()} == {"X": [0.0, 10.0], "EXX": [0.001, 0.002]}


def converted(controller: str) -> PostResult:
    return convert(toolpath(*SHORT), "mikron-ucp710", controller, error_model=str(SAMPLES / "errors" / "mikron-ucp710.toml"))


def refused(result: PostResult) -> set[str]:
    return {d.code for d in result.diagnostics if d.severity is Severity.ERROR}


def test_lost_motion_taken_up_in_the_other_direction_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    approach = ActualBlockPoses._approach
    monkeypatch.setattr(ActualBlockPoses, "_approach", lambda self, *rest: -approach(self, *rest))
    assert "witness.errors" in refused(converted("linuxcnc"))


@pytest.mark.parametrize("controller", ["linuxcnc", "siemens-840d"])
def test_errors_that_are_taken_too_large_are_seen(controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both take them from one model: without eyes of its own for errors the proof would not notice."""
    right = good(converted(controller))
    assert right.witness is not None and right.witness.own_kinematics
    torsors = SerialErrors.torsors
    monkeypatch.setattr(SerialErrors, "torsors", lambda self, *rest: [1.02 * x for x in torsors(self, *rest)])
    assert refused(converted(controller)) == {"witness.errors"}
