"""`machine export`: files with which LinuxCNC's simulator runs a machine."""

from __future__ import annotations

import math

from machines.exchange.linuxcnc_files import hal_lines, ini_sections, ini_text
from machines.exchange.linuxcnc_ini import OWN
from machines.loader import builtin, check
from machines.machine import Machine
from machines.models import MachineModel
from machines.user_file import read_toml
from toolpaths.diagnostics import Diagnostic, error, info

LETTERS = "XYZABCUVW"
"""of LinuxCNC"""
_KEPT = {"travel", "velocity", "acceleration", "jerk", "home", "modulo", "assumed", "source"}
"""keys of [axes.LETTER] that LinuxCNC's files hold"""


def export_linuxcnc(machine: Machine, name: str) -> tuple[dict[str, str], list[Diagnostic]]:
    """Texts by file name, and what LinuxCNC cannot hold; no texts where its kinematics cannot express the machine.

    Args:
        machine: as loaded from its file
        name: stem of the files
    """
    source = builtin().get(machine.file, machine.file) if machine.file else machine.name
    file, found = read_toml(source, builtin(), "machine")
    model = check(file)[0] if file else None
    if model is None:
        return {}, found
    own = model.kinematics.linuxcnc_keys()
    if why := _inexpressible(machine, model, own):
        return {}, [error("export.kinematics", f"LinuxCNC cannot run {machine.name}: {why}", file=machine.file)]
    sections = ini_sections(machine, name)
    sections[OWN] = (own or {}) | _timing(machine, model)
    texts = {f"{name}.var": "", f"{name}.tbl": "", f"{name}.hal": "\n".join(hal_lines(machine)) + "\n",
             f"{name}.ini": ini_text(sections)}
    lost = ", ".join(sorted(_lost(model)))
    return texts, [info("export.left-out", f"LinuxCNC's files have no place for {lost}: they are left out",
                        file=machine.file)] if lost else []


def _inexpressible(machine: Machine, model: MachineModel, own: dict[str, str] | None) -> str:
    strange = [name for name in machine.axis_names if name not in LETTERS]
    if strange:
        return f"it has no axes {', '.join(strange)}"
    if own is None and (machine.control_kinematics is None or machine.control_kinematics.axes is None):
        return f"no module of it has the kinematics of kind {model.kinematics.kind!r}"
    if "STRUCTURE" not in (own or {}) and machine.control_kinematics is None:
        return "[control] names no module of LinuxCNC that has the kinematics of its joints"
    return ""


def _timing(machine: Machine, model: MachineModel) -> dict[str, str]:
    timing = machine.timing
    found = {"TOOL_CHANGE": repr(timing.tool_change), "CLAMP": repr(timing.clamp), "UNCLAMP": repr(timing.unclamp)}
    found |= {"LARGEST_FEED": repr(machine.largest_feed * 60.0)} if math.isfinite(machine.largest_feed) else {}
    found |= {"RETRACT_AXIS": model.retract_axis} if model.retract_axis else {}
    assumed = [f"{table.name}.{key}" for table in model.figures() for key in table.assumed]
    return found | ({"ASSUMED": " ".join(assumed)} if assumed else {})


def _lost(model: MachineModel) -> set[str]:
    """Keys of the machine file that nothing of the exported files says."""
    control = model.control.model_fields_set if model.control else set()
    lost = {f"control.{key}" for key in control - {"module", "largest_feed"}}
    lost |= {f"axes.{name}.{key}" for name, axis in model.axes.items() for key in axis.model_fields_set - _KEPT}
    return lost | ({"hooks"} & model.model_fields_set) | {
        f"kinematics.{key}" for key in {"clearance"} & model.kinematics.model_fields_set}
