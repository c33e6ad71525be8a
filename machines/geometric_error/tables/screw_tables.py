"""LinuxCNC's screw compensation: one file per joint, nominal position and where the axis really is, both directions."""

from __future__ import annotations

import numpy as np

from machines.geometric_error.tables.curves import TableCurve
from machines.geometric_error.tables.names import ErrorName
from machines.kinematics.chain import ROTARY
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

LINUXCNC_ROWS = 256
"""entries that LinuxCNC's motion module holds per joint (EMCMOT_COMP_SIZE)"""
UNLIKELY = {False: 2.0, True: DEG}
"""mm, and rad of a rotary axis: a positioning error that is a file misread"""


def to_linuxcnc(name: ErrorName, table: TableCurve, sense: float = 1.0) -> str:
    """A screw compensation file (COMP_FILE with COMP_FILE_TYPE = 0) of a positioning error: nominal, forward, reverse.

    Type 0 holds where the axis really is when it is sent to the nominal position; LinuxCNC adds nominal less
    actual to the motor's command, linearly between the rows, by the approach direction of the last motion
    (LinuxCNC, Integrator's manual, INI configuration, [JOINT_n]). mm and degrees.

    Args:
        sense: -1 where the axis counts against the direction of ISO 841

    Raises:
        ValueError: where LinuxCNC cannot hold it.
    """
    if not name.positioning:
        raise ValueError(f"{name} is not a positioning error; LinuxCNC's screw compensation holds EXX, EYY, ... ECC")
    if table.rule != "linear" or table.period:
        raise ValueError(f"{name} is not a plain linear table; take `sampled` at the positions that you want")
    if len(table.x) > LINUXCNC_ROWS:
        raise ValueError(f"{name} has {len(table.x)} rows, LinuxCNC holds {LINUXCNC_ROWS}; take `sampled` at fewer")
    unit = DEG if name.axis in ROTARY else 1.0
    forward, backward = np.split(table.values, 2) if table.both else (table.values, table.values)
    rows = np.stack([table.x, table.x + sense * forward, table.x + sense * backward], axis=1) / unit
    return "\n".join([*(" ".join(f"{x:.9f}" for x in row) for row in rows), ""])


def from_linuxcnc(text: str, name: ErrorName, sense: float = 1.0, kind: int = 0,
                  file: str = "") -> tuple[TableCurve | None, list[Diagnostic]]:
    """The table of a screw compensation file; None and what is wrong.

    Args:
        kind: COMP_FILE_TYPE: 0 actual positions, 1 trims (nominal less actual)
    """
    if kind not in (0, 1):
        return None, [error("error-table.kind", f"COMP_FILE_TYPE = {kind}", file=file, hint="it is 0 or 1")]
    rows: list[list[float]] = []
    for n, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            row = [float(word) for word in line.split()]
        except ValueError:
            row = []
        if len(row) != 3 or not np.isfinite(row).all() or (rows and row[0] <= rows[-1][0]):
            return None, [error("error-table.row", f"{line.strip()[:60]!r} is not a row of a screw compensation file",
                                file=file, lines=[n], hint="write nominal, forward and reverse, nominal ascending; a "
                                "CSV table is imported by its name alone, or as EXX=x.csv")]
        rows.append(row)
    if len(rows) < 2:
        return None, [error("error-table.empty", f"{len(rows)} rows; at least two are needed", file=file,
                            hint="write nominal, forward and reverse position in every row")]
    nominal, forward, backward = np.array(rows).T * (DEG if name.axis in ROTARY else 1.0)
    errors = [sense * (approach - nominal if kind == 0 else -approach) for approach in (forward, backward)]
    worst = max(float(np.abs(e).max()) for e in errors)
    if worst > UNLIKELY[name.axis in ROTARY]:
        shown = f"{worst / DEG:.4g} degrees" if name.axis in ROTARY else f"{worst:.4g} mm"
        return None, [error("error-table.kind", f"read as COMP_FILE_TYPE = {kind} errors of {name.axis} are up to {shown}",
                            file=file, hint=f"it may be of type {1 - kind} (0: positions, 1: nominal less actual), or in "
                            "inches")]
    if np.array_equal(errors[0], errors[1]):
        return TableCurve(nominal, errors[0]), []
    return TableCurve(nominal, np.concatenate(errors), both=True), []
