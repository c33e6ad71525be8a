"""The pivots that the control's own kinematics holds, compared with those of the machine."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.base.options import Options
from postproc.setup.model import SetupFile, line_of
from toolpaths.diagnostics import Diagnostic, error

ALLOWED = 0.1
"""share of the tip tolerance that a pivot may be off by"""


def errors_of_drives(machine: Machine, corrects: bool, options: Options) -> list[Diagnostic]:
    """An error where a program is to correct errors of legs, and its words are the tip's."""
    if machine.by_drives is None or not corrects:
        return []
    return [error("error-model.machine", f"the control runs the kinematics of {machine.name}: words of the tip hold no "
                  "error of its legs", file=options.error_model, hint='convert for a machine file based on it with module = '
                  '"trivkins" under [control]: its programs hold the drives')]


def control_kinematics(machine: Machine, setup: SetupFile,
                       options: Options) -> tuple[Kinematics | None, list[Diagnostic]]:
    """(the kinematics with the set-up's [control_pivots], None where it states none; pivots that differ from
    the machine's).

    Of a pivot's point only what is square to its axis counts.
    """
    if not setup.control_pivots:
        return None, []
    kin = machine.kinematics
    letters = [j.name for j in kin.chain if j.rotary and machine.by_drives is None]
    unknown = [k for k in setup.control_pivots if k not in letters]
    if not letters or unknown:
        return None, [error("setup.pivot", f"[control_pivots.{k}]: {machine.name} has no such rotary axis",
                            file=options.setup, lines=line_of(options.setup, ("control_pivots", k)),
                            hint=f"its rotary axes are {', '.join(letters) or 'none'}")
                      for k in unknown or setup.control_pivots]
    made = kin.with_pivots({k: np.array(v.point) for k, v in setup.control_pivots.items()})
    result = []
    allowed = ALLOWED * options.tolerance
    for joint, own in zip(kin.chain, made.chain, strict=True):
        offset = own.point - joint.point
        off = float(np.linalg.norm(offset - (offset @ joint.direction) * joint.direction))
        if off > allowed:
            held, true = (", ".join(f"{v:.4f}" for v in j.point) for j in (own, joint))
            result.append(error("pivot.mismatch", f"the control holds the pivot of {joint.name} at ({held}), the machine "
                                f"file at ({true}): {off:.4f} mm apart, allowed {allowed:.4f} mm", file=options.setup,
                                lines=line_of(options.setup, ("control_pivots", joint.name)),
                                hint="correct the control's parameters, the machine file, or the set-up's [control_pivots]"))
    return made, result
