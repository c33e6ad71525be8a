"""Programs for platforms on legs with their geometric errors: corrected, proved by the read-back and the second witness."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from postproc.pipeline.result import PostResult
from postproc.verification.residual_errors import after_formatting
from postproc.witness.errors import error_chain
from postproc.witness.machine import Rods, merged
from tests.machines.error_models import joints, rod_errors
from tests.postproc.kit import convert, good, setup_of, toolpath

ERRORS = Path("samples/errors")
TILTED = [",0.099504,0,0.995037", ",0.099504,0.099015,0.990099", ",-0.099504,0.196116,0.975519"]
CUTS = {"hexapod": TILTED, "hexaslide-cone": ["", "", ""], "uranesx": ["", "", ""], "planar-delta-z": ["", "", ""],
        "h4a-c-table": TILTED, "h4a-spindle-axis": TILTED, "h4-rotary": ["", "", ""], "rotary-delta": ["", "", ""]}
"""tool axes of the cuts"""
LONG = ("h4a-c-table", "h4a-spindle-axis", "h4-rotary", "rotary-delta")
OWN = {"h4-rotary": """[legs.A]
rail = [-45, -1, 33]
length = [26, 25]
drive = 8
[legs.U]
platform = [[-25, -34, -66], [-24, -34, -65]]
carriage = [[33, 4, 5], [33, 4, 6]]
guide = [4, 5, 6]
[bars.front]
hinge = [5, -4, 8]
hinge_turn = [3, -4, 0]
""", "rotary-delta": """[legs.A]
rail = [-45, -1, 33]
length = [26, 14]
[legs.C]
platform = [[5, -4, -6], [12, 3, 4]]
carriage = [[33, 4, 5], [0, 0, 9]]
drive = 6
"""}
"""models of machines that the samples have none for"""


def model_of(name: str, folder: Path) -> Path:
    """That of the samples; the hexaslides take the numbers of the hexapod."""
    if (ERRORS / f"{name}.toml").exists():
        return ERRORS / f"{name}.toml"
    source = "h4a-c-table" if name.startswith("h4a") else "hexapod"
    (folder / "own.toml").write_text(OWN.get(name) or (ERRORS / f"{source}.toml").read_text().replace(
        f'machine = "{source}"', ""))
    return folder / "own.toml"


@cache
def converted(name: str, model: Path) -> PostResult:
    """Two cuts and their approach; the part stands in the middle of the workspace."""
    kin, (one, two, three) = machines.load(name).kinematics, CUTS[name]
    gauge = kin.axis.gauge if isinstance(kin, LegsWithAxis) else kin.gauge if isinstance(kin, OnLegs) else 0.0
    x, y, z = kin.workspace.middle + gauge - [0.0, 0.0, 80.0]
    setup = setup_of(f"[part]\norigin = [{x}, {y}, {z}]\n[tools.1]\ngauge_length = 80\n[clearance]\nmargin = 20\n")
    path = toolpath("MULTAX/ON" if one else "MULTAX/OFF", "LOADTL/1", "SPINDL/RPM,8000,CLW", "RAPID", f"GOTO/-20,10,5{one}",
                    "FEDRAT/MMPM,1500", f"GOTO/-20,10,-2{one}", f"GOTO/15,10,-1{two}", f"GOTO/15,-10,-4{three}", "RAPID",
                    f"GOTO/15,-10,20{three}")
    return good(convert(path, name, setup=setup, error_model=str(model)))


@pytest.mark.parametrize("name", [name if name not in LONG else pytest.param(name, marks=pytest.mark.slow) for name in CUTS])
def test_the_words_bring_the_tool_where_it_should_be(name: str, tmp_path: Path) -> None:
    """Errors of some 0.01 to 0.1 mm; the written words leave what rounding leaves, by both witnesses."""
    result = converted(name, model_of(name, tmp_path))
    found = after_formatting(result)
    assert result.compensation is not None and result.compensation.tip_before > 0.005
    assert found is not None and found.tip.max() < found.tip_bound < 1.5e-3
    assert result.witness is not None and not result.witness.findings and not result.witness.not_compared


@pytest.mark.parametrize("name", CUTS)
def test_the_rods_of_the_second_witness_are_those_of_the_model(name: str, tmp_path: Path) -> None:
    """It finds 1e-6 mm where the machine with errors has its tool, and as much as is put in where it has not."""
    path, machine = model_of(name, tmp_path), machines.load(name)
    found = load(path, machine)
    kin = machine.kinematics.with_tool(60.0)
    actual, q = found.on(kin), joints(machine.kinematics, 8, 3)
    tip, axis = actual.aim(actual.coordinates(q))
    base = [tomllib.loads((Path("machines/data") / f"{name}.toml").read_text())]
    rods = error_chain(merged(base), tomllib.loads(path.read_text()), {})
    assert isinstance(rods, Rods) and rods.wrong
    length = np.full(len(q), 60.0)
    assert rods.misfit(q, machine.axis_names, tip, axis, length).max() < 2e-6
    for way in (0.005 * np.eye(3)):
        assert rods.misfit(q, machine.axis_names, tip + way, axis, length).min() > 1e-4


@pytest.mark.parametrize("name", ["h4-rotary", "tripod-head", "tricept", "linuxcnc-pentapod", "wrist"])
def test_bars_hinges_rings_and_passive_legs_of_the_second_witness_are_those_of_the_model(name: str, tmp_path: Path) -> None:
    """Every dimension off, written to a file and read by both; each solves the closed loops by code of its own. A wrist:
    axes behind a Delta, which turns as its errors have it."""
    file = Path("machines/data") / f"{name}.toml"
    if name == "wrist":
        file = tmp_path / "wrist.toml"
        text = (Path("machines/data") / "linear-delta-ac.toml").read_text()
        file.write_text(text.replace("[kinematics.table_axes.", "[kinematics.spindle_axes."))
    machine = machines.load(file)
    legs = getattr(machine.kinematics, "on_legs", machine.kinematics)
    errors = rod_errors(legs, 3)
    errors = replace(errors, guide=errors.guide * (legs.legs.stretch == 0.0)[:, None])
    save(ErrorModel(rods=errors, name="all", machine=name), tmp_path, "")
    actual, q = load(tmp_path / "all.toml", machine).on(machine.kinematics.with_tool(60.0)), joints(machine.kinematics, 6, 3)
    tip, axis = actual.aim(actual.coordinates(q))
    table = merged([tomllib.loads(file.read_text())])
    rods, length = error_chain(table, tomllib.loads((tmp_path / "all.toml").read_text()), {}), np.full(len(q), 60.0)
    nominal = machine.kinematics.with_tool(60.0).forward(q)[0]
    assert isinstance(rods, Rods) and rods.wrong and np.abs(tip - nominal).max() > 0.01
    assert rods.misfit(q, machine.axis_names, tip, axis, length).max() < 1e-6
    for by in 0.005 * np.eye(3):
        assert rods.misfit(q, machine.axis_names, tip + by, axis, length).min() > 5e-4


def test_a_redundant_machine_is_corrected_where_it_stands(tmp_path: Path) -> None:
    """Legs and gantry with errors, the tool turned about itself: carriers and spin stay as the plan has them."""
    text = (ERRORS / "hexapod.toml").read_text().replace('machine = "hexapod"', "").partition("[sigma")[0]
    for old, new in zip("XYZ", "ABC", strict=True):
        text = text.replace(f"[legs.{old}]", f"[legs.{new}]")
    (tmp_path / "own.toml").write_text(text + '[location]\nEA0S = 12.0\nEC0Y = 9.0\n')
    path = toolpath("MULTAX/ON", "RAPID", f"GOTO/-20,10,5{TILTED[0]}", "FEDRAT/MMPM,1500", f"GOTO/-20,10,-2{TILTED[0]}",
                    f"GOTO/15,10,-1{TILTED[1]}", "RAPID", f"GOTO/15,10,20{TILTED[1]}")
    setup = setup_of("[part]\norigin = [700, 100, -250]\n[joints]\nspin = 20\n[tools.1]\ngauge_length = 80\n")
    result = good(convert(path, "macro-micro", "siemens-840d", setup=setup, error_model=str(tmp_path / "own.toml")))
    found = after_formatting(result)
    assert result.compensation is not None and result.compensation.tip_before > 0.005
    assert found is not None and found.tip.max() < found.tip_bound < 1e-3
    assert result.witness is not None and not result.witness.findings and result.path is not None
    assert {name: round(low, 3) for name, low, _ in result.path.opened}["spin"] == 0.349
