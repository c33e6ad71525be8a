"""From a machine file to a Machine: read, choose the family's model, check, convert to mm, rad, s."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import create_model

from machines.kinematics.base import Kinematics
from machines.machine import Limits, Machine, Timing, Turns
from machines.models import KinematicsModel, MachineModel
from machines.user_file import UserFile, nearest, read_toml, schema, validate
from toolpaths.diagnostics import Diagnostic, DiagnosticError, has_errors
from toolpaths.units import DEG

DATA = Path(__file__).parent / "data"
FAMILIES: dict[str, str] = {
    "serial": "machines.serial_models:SerialModel",
    "linear-delta": "machines.parallel_models:LinearDeltaModel",
    "h4-linear": "machines.parallel_models:H4LinearModel",
}
"""`[kinematics] family` -> module:model of that table; imported when a file asks for it"""


def builtin() -> dict[str, Path]:
    """The built-in machine files by name."""
    return {path.stem: path for path in sorted(DATA.glob("*.toml"))}


def load(source: str | Path) -> Machine:
    """The machine of a built-in name or a path.

    Raises:
        DiagnosticError: where the file has errors; carries all of them.
    """
    machine, diagnostics = load_checked(source)
    if machine is None:
        raise DiagnosticError(diagnostics)
    return machine


def load_checked(source: str | Path) -> tuple[Machine | None, list[Diagnostic]]:
    """The machine of a built-in name or a path, or None and every fault of its file."""
    file, diagnostics = read_toml(source, builtin(), "machine")
    if file is None:
        return None, diagnostics
    model, found = check(file)
    diagnostics += found
    if model is None or has_errors(diagnostics):
        return None, diagnostics
    return assemble(file, model), diagnostics


def check(file: UserFile) -> tuple[MachineModel | None, list[Diagnostic]]:
    """The model of a machine file that has been read, or None and what is wrong with it."""
    family, diagnostics = _family(file)
    if family is None:
        return None, diagnostics
    model, diagnostics = validate(file, machine_model(family))
    if model is None:
        return None, diagnostics
    return model, [file.problem(p.code, p.path, p.message, p.hint) for p in model.problems()]


def _family(file: UserFile) -> tuple[str | None, list[Diagnostic]]:
    table = file.values.get("kinematics")
    if not isinstance(table, dict) or "family" not in table:
        return None, [file.problem("file.missing-key", ("kinematics", "family"), "key 'kinematics.family' is missing",
                                   "add [kinematics] family = one of " + ", ".join(FAMILIES))]
    family = table["family"]
    if not isinstance(family, str) or family not in FAMILIES:
        return None, [file.problem("machine.family", ("kinematics", "family"),
                                   f"no kinematics family is called {family!r}", nearest(str(family), list(FAMILIES)))]
    return family, []


@cache
def machine_model(family: str) -> type[MachineModel]:
    """The model of a machine file of that family."""
    module, _, name = FAMILIES[family].partition(":")
    kinematics: type[KinematicsModel] = getattr(import_module(module), name)
    return create_model(f"Machine_{name}", __base__=MachineModel, __doc__=f"A machine file of family {family}.",
                        kinematics=(kinematics, ...))


def machine_schema() -> dict[str, Any]:
    """The JSON schema of a machine file: any of the families."""
    return schema(*(machine_model(family) for family in FAMILIES))


def assemble(file: UserFile, model: MachineModel) -> Machine:
    """The Machine of a checked model, in mm, rad, s."""
    kinematics = model.kinematics.build()
    names = kinematics.axis_names
    retract = names.index(model.retract_axis) if model.retract_axis else -1
    timing = model.timing
    limits = _limits(model, kinematics)
    return Machine(
        name=file.name, description=model.description, structure=model.kinematics.describe(), kinematics=kinematics,
        axis_names=names, rotary=kinematics.rotary, limits=limits, stated=limits,
        home=np.array([model.axes[name].home for name in names]) * _scale(kinematics), retract_axis=retract,
        timing=Timing(timing.tool_change, timing.clamp, timing.unclamp, frozenset(timing.assumed)),
        control_kinematics=model.control_kinematics(), file=file.file,
        stop=model.control.stop or "" if model.control is not None else "",
        turns=tuple(Turns(a.modulo, a.modulo_range[0], a.rollover or "", a.park) for a in map(model.axes.get, names) if a))


def _limits(model: MachineModel, kinematics: Kinematics) -> Limits:
    names, scale = kinematics.axis_names, _scale(kinematics)
    axes = [model.axes[name] for name in names]
    travel = np.array([axis.range for axis in axes]) * scale[:, None]
    velocity, acceleration, jerk = np.array([(a.velocity, a.acceleration, a.jerk) for a in axes]).T * scale
    assumed = frozenset(f"{name}.{key}" for name in names for key in model.axes[name].assumed)
    return Limits(travel[:, 0], travel[:, 1], velocity, acceleration, jerk, assumed)


def _scale(kinematics: Kinematics) -> Any:
    return np.where(kinematics.rotary, DEG, 1.0)


def names() -> list[str]:
    """The built-in machines."""
    return list(builtin())
