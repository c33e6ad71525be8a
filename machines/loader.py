"""From a machine file to a Machine: read, choose the model of its kind, check, convert to mm, rad, s."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
from pydantic import create_model

import machines.kinds as kinds
from machines.certificate.lookup import certificate_of
from machines.choices import BoughtOption
from machines.figures import as_stated, origins_of_figures
from machines.key_problem import KeyProblem
from machines.kind_check import build_faults, contract_faults
from machines.kinematics.base import Kinematics
from machines.machine import ClampCodes, ControlOptions, Limits, Machine, Timing, Turns
from machines.models import ControlModel, KinematicsModel, MachineModel, register_beyond
from machines.plausible import implausible
from machines.toml_lines import Values
from machines.user_file import UserFile, read_toml, validate
from machines.user_model import schema
from machines.value_words import nearest_word
from toolpaths.diagnostics import Diagnostic, DiagnosticError, Severity, error, has_errors, read_value
from toolpaths.units import DEG, PER_MINUTE

DATA = Path(__file__).parent / "data"
CATALOGUE = Path(__file__).parent / "catalogue"
KIND, OLDER = ("kinematics", "kind"), ("kinematics", "family")
"""the key that names the kind of machine, and the older word for it, which files may still have"""


@cache
def builtin() -> Mapping[str, Path]:
    """The built-in machine files by name: models, then the catalogue."""
    return {path.stem: path for folder in (DATA, CATALOGUE) for path in sorted(folder.glob("*.toml"))}


def load(source: str | Path) -> Machine:
    """The machine of a built-in name or a path.

    Raises:
        DiagnosticError: where the file has errors; carries all of them.
    """
    return read_value(load_checked(source))


def load_checked(source: str | Path) -> tuple[Machine | None, list[Diagnostic]]:
    """The machine of a built-in name or a path, or None and every fault of its file."""
    file, diagnostics = read_toml(source, builtin(), "machine")
    if file is None:
        return None, diagnostics
    model, found = check(file)
    diagnostics += found
    if model is None or has_errors(diagnostics):
        return None, diagnostics
    machine = assemble(file, model)
    if not _is_built_in(model):
        diagnostics += _of_kind(file, model, contract_faults(machine.kinematics, machine.limits, machine.home))
    return (None if has_errors(diagnostics) else machine), diagnostics


def values_of_machine(machine: Machine) -> Values:
    """The merged values of the file that a machine was loaded from.

    Raises:
        DiagnosticError: where it cannot be read any more.
    """
    known = builtin()
    source = machine.name if machine.name in known else machine.file
    return _with_kind(read_value(read_toml(source, known, "machine"))).values


def check(file: UserFile) -> tuple[MachineModel | None, list[Diagnostic]]:
    """The model of a machine file that has been read, or None and what is wrong with it."""
    file = as_stated(_with_kind(file))
    try:
        kinematics, diagnostics = _kinematics_model(file)
    except kinds.KindFault as fault:
        return None, [file.problem("machine.kind", KIND, str(fault), fault.hint)]
    if kinematics is None:
        return None, diagnostics
    model, diagnostics = validate(file, machine_model(kinematics))
    if model is None:
        return None, diagnostics
    if (proof := certificate_of(file.values, file.file)) is not None:
        model.kinematics.take_certificate(str(proof))
    faults = [] if _is_built_in(model) else _of_kind(file, model, build_faults(model.kinematics))
    return model, faults or [file.problem(p.code, p.path, p.message, p.hint) for p in model.problems()]


def _is_built_in(model: MachineModel) -> bool:
    return model.kinematics.kind in kinds.BUILT_IN


def _of_kind(file: UserFile, model: MachineModel, faults: Iterable[KeyProblem]) -> list[Diagnostic]:
    """Faults of the code of a kind, at the line that names it."""
    return [file.problem(p.code, KIND, f"kind {model.kinematics.kind!r}: {p.message}", p.hint) for p in faults]


def _with_kind(file: UserFile) -> UserFile:
    """The same file with `kind` where it has the older word."""
    table = file.values.get("kinematics")
    if not isinstance(table, dict) or "family" not in table or table.get("kind", table["family"]) != table["family"]:
        return file
    table = {"kind": table["family"]} | {key: value for key, value in table.items() if key != "family"}
    origins = {path: origin for path, origin in file.origins.items() if path != OLDER}
    if OLDER in file.origins:
        origins.setdefault(KIND, file.origins[OLDER])
    return replace(file, values=file.values | {"kinematics": table}, origins=origins)


def _kinematics_model(file: UserFile) -> tuple[type[KinematicsModel] | None, list[Diagnostic]]:
    """The model of the table; None and why there is none."""
    table = file.values.get("kinematics")
    if not isinstance(table, dict) or "kind" not in table:
        return None, [file.problem("file.missing-key", KIND, "key 'kinematics.kind' is missing",
                                   "add [kinematics] kind = one of " + ", ".join(kinds.known()))]
    kind = table["kind"]
    if "family" in table:
        return None, [file.problem("machine.kind", OLDER, f"kind = {kind!r} and family = {table['family']!r}",
                                   "family is the older word for kind: keep one of them")]
    found = kinds.model_of(kind) if isinstance(kind, str) else None
    if found is None:
        return None, [file.problem("machine.kind", KIND, f"no kind of machine is called {kind!r}, registered are "
                                   f"{', '.join(kinds.known())}", _hint(str(kind)))]
    return found, []


def _hint(kind: str) -> str:
    meant = nearest_word(kind, kinds.known())
    return f"did you mean {meant!r}? {kinds.HOW}" if meant else kinds.HOW


@cache
def machine_model(kinematics: type[KinematicsModel]) -> type[MachineModel]:
    """The model of a machine file whose `[kinematics]` table is of that model."""
    name = kinematics.__name__
    return create_model(f"Machine_{name}", __base__=MachineModel, __doc__=f"A machine file with {name}.",
                        kinematics=(kinematics, ...))


def machine_schema() -> dict[str, Any]:
    """The JSON schema of a machine file: of any registered kind that can be imported.

    Raises:
        DiagnosticError: where a file that `POSTPROC_KINDS` names cannot be run.
    """
    found = list[type[MachineModel]]()
    try:
        words = kinds.known()
    except kinds.KindFault as fault:
        raise DiagnosticError([error("machine.kind", str(fault), hint=fault.hint)]) from fault
    for kind in words:
        try:
            model = kinds.model_of(kind)
        except kinds.KindFault:
            continue
        found += [] if model is None else [machine_model(model)]
    return schema("machine", *found)


def assemble(file: UserFile, model: MachineModel) -> Machine:
    """The Machine of a checked model, in mm, rad, s."""
    kinematics = model.kinematics.build()
    names = kinematics.axis_names
    retract = names.index(model.retract_axis) if model.retract_axis else -1
    timing, control = model.timing, model.control or ControlModel()
    limits = _limits(model, kinematics)
    return Machine(
        name=file.name, description=model.description, structure=model.kinematics.describe(), kinematics=kinematics,
        axis_names=names, rotary=kinematics.rotary, limits=limits, stated=limits,
        home=np.array([model.axes[name].home for name in names]) * _scale(kinematics), retract_axis=retract,
        timing=Timing(timing.tool_change, timing.clamp, timing.unclamp, frozenset(timing.assumed)),
        control_kinematics=model.control_kinematics(), file=file.file,
        stop=model.control.stop or "" if model.control is not None else "",
        rapids=control.rapids or "", largest_feed=control.largest_feed * PER_MINUTE if control.largest_feed else math.inf,
        largest_spindle_speed=control.largest_spindle_speed or math.inf,
        cutting_velocity=_cutting_velocity(model, kinematics), options=_options(file, control), hooks=model.hooks,
        look_ahead=control.look_ahead, block_time=control.block_time,
        length_register=register_beyond(control.length_register),
        radius_register=None if control.radius_register is None else register_beyond(control.radius_register),
        certificate=model.kinematics.certificate, dynamics=model.dynamics,
        stiffness=model.stiffness,
        kind_code=kinds.stamp(str(model.kinematics.kind)),
        figures=origins_of_figures(model.sources, model.figures()), documents=tuple(model.sources.values()),
        clamps=tuple(ClampCodes(a.clamp, a.unclamp) for a in map(model.axes.get, names) if a),
        turns=tuple(Turns(a.modulo, a.modulo_range[0], a.rollover or "", a.park) for a in map(model.axes.get, names) if a))


def _limits(model: MachineModel, kinematics: Kinematics) -> Limits:
    names, scale = kinematics.axis_names, _scale(kinematics)
    axes = [model.axes[name] for name in names]
    travel = np.array([axis.range for axis in axes]) * scale[:, None]
    velocity, acceleration, jerk = np.array([(a.velocity, a.acceleration, a.jerk) for a in axes]).T * scale
    assumed = frozenset(f"{name}.{key}" for name in names for key in model.axes[name].assumed if key != "home")
    return Limits(travel[:, 0], travel[:, 1], velocity, acceleration, jerk, assumed)


def _options(file: UserFile, control: ControlModel) -> ControlOptions:
    """What the file says of the options of the control, and where."""
    fitted = {name: bool(value) for name in get_args(BoughtOption) if (value := getattr(control, name)) is not None}
    origins = {name: file.origin(("control", name)) for name in fitted}
    return ControlOptions(fitted, {name: (at.file, at.line) for name, at in origins.items()}, control.tip_frame or "",
                          control.power_on, control.settings, control.splines == "bspline")


def _cutting_velocity(model: MachineModel, kinematics: Kinematics) -> tuple[float, ...]:
    """Of each axis, mm/s or rad/s; () where no axis states one."""
    axes = [model.axes[name] for name in kinematics.axis_names]
    if all(axis.cutting_velocity is None for axis in axes):
        return ()
    return tuple(float(v) for v in np.array([a.cutting_velocity or a.velocity for a in axes]) * _scale(kinematics))


def _scale(kinematics: Kinematics) -> Any:
    return np.where(kinematics.rotary, DEG, 1.0)


def names() -> list[str]:
    """The built-in machines that are models of a kind or a class, each different from the others."""
    return sorted(path.stem for path in DATA.glob("*.toml"))


def catalogued() -> list[str]:
    """The built-in machines that people own, with a source for what a document states."""
    return sorted(path.stem for path in CATALOGUE.glob("*.toml"))


def implausible_of(source: str | Path) -> list[Diagnostic]:
    """What no machine has in the file of a machine that loads: a warning each, at its line."""
    file, _ = read_toml(source, builtin(), "machine")
    model = check(file)[0] if file is not None else None
    return [] if file is None or model is None else as_warnings(file, assemble(file, model))


def as_warnings(file: UserFile, machine: Machine) -> list[Diagnostic]:
    """The same of a file that has been read."""
    found = [file.problem(p.code, p.path, p.message, p.hint) for p in implausible(machine)]
    return [replace(one, severity=Severity.WARNING) for one in found]
