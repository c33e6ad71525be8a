"""Points of a part that were touched at the machine: nominal place, measured place, and in which direction they count."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from machines.geometric_error.tables.csv_table import ANGLES, LENGTHS, CsvTable, read_csv
from postproc.job.job import Job
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import lengths
from toolpaths.shapes import arrays

NOMINAL, NORMAL, MEASURED = ("x", "y", "z"), ("nx", "ny", "nz"), ("X", "Y", "Z")
SIGMA = "sigma"
DEFAULT_SIGMA = 0.005
"""mm: a touch probe on a machine, where nothing else is stated (assumed)"""
_HEADER = "x [mm], y [mm], z [mm], nx, ny, nz, X [mm], Y [mm], Z [mm]"


@dataclass(frozen=True, eq=False)
@arrays(nominal="N 3", normal="N 3", measured="N 3", sigma="N", zero="3")
class Readings:
    """N points in the table frame, mm.

    Attributes:
        nominal (N, 3): where the point is on the part as it was meant to stand
        normal (N, 3): unit direction that the reading counts along; zeros for a point that is known in all three
        measured (N, 3): where it was found
        sigma (N,): standard deviation of a reading
        zero (3,): where the numbers that the control shows count from
        lines: of the file
    """

    nominal: Floats
    normal: Floats
    measured: Floats
    sigma: Floats
    zero: Floats
    lines: tuple[int, ...]
    file: str = ""

    def __len__(self) -> int:
        return len(self.nominal)

    @property
    def whole(self) -> Bools:
        """(N,) points that count in all three directions."""
        return np.asarray(~self.normal.any(axis=1))

    @property
    def owner(self) -> Ints:
        """(R,) the reading of each number that is compared: three of a whole point, one of the others."""
        return np.repeat(np.arange(len(self)), np.where(self.whole, 3, 1))

    def with_measured(self, measured: Floats) -> Readings:
        """The same with other measured places."""
        return replace(self, measured=measured)

    def without(self, k: int) -> Readings:
        """All readings but one."""
        keep = np.arange(len(self)) != k
        return Readings(self.nominal[keep], self.normal[keep], self.measured[keep], self.sigma[keep], self.zero,
                        tuple(np.array(self.lines)[keep].tolist()), self.file)


def read_readings(file: Path, job: Job, probe_length: float, machine_coordinates: bool,
                  sigma: float | None) -> tuple[Readings | None, list[Diagnostic]]:
    """The readings of a CSV file for the job's machine and set-up; None and what is wrong with it.

    Columns: `x`, `y`, `z` the nominal point in the system that is the work offset; `nx`, `ny`, `nz` the direction that the
    surface looks in (none: the point is known in all three, as the centre of a ball); `X`, `Y`, `Z` and any rotary axis as
    the control shows them with the probe there; `sigma` the standard deviation of a reading.

    Args:
        probe_length: mm from the gauge point to the probe's ball
        machine_coordinates: True where X, Y, Z are machine coordinates of the gauge point, else in the work offset of the
            set-up with the probe's length in force
        sigma: mm, of readings without a column of their own
    """
    table, found = read_csv(file, gaps=True)
    if table is None:
        return None, found
    found = _columns(table, job)
    if found:
        return None, found
    columns = {name: np.nan_to_num(table.columns[name]) for name in table.columns}
    nominal = np.stack([table.columns[name] for name in NOMINAL], axis=1)
    normal = np.stack([columns.get(name, np.zeros(len(table))) for name in NORMAL], axis=1)
    shown = np.stack([table.columns[name] for name in MEASURED], axis=1)
    blank = ~(np.isfinite(nominal).all(axis=1) & np.isfinite(shown).all(axis=1))
    if blank.any():
        return None, [_fault(table, "align.cell", "a coordinate is missing", [table.lines[k] for k in np.flatnonzero(blank)],
                             "state all three coordinates of a point on the surface; nx, ny, nz say which count")]
    size = lengths(normal)
    frame, placement = job.work_system, job.placement
    points = nominal @ np.array(frame.rotation).T + np.array(frame.origin)
    directions = (normal / np.where(size > 0.0, size, 1.0)[:, None]) @ np.array(frame.rotation).T
    noise = columns.get(SIGMA, np.zeros(len(table)))
    noise = np.where(noise > 0.0, noise, DEFAULT_SIGMA if sigma is None else sigma)
    measured = _tips(table, shown, columns, job, probe_length, machine_coordinates)
    zero = job.machine.kinematics.with_tool(probe_length).forward(np.zeros((1, len(job.machine.axis_names))))[0][0]
    return Readings(placement.points(points), placement.directions(directions), measured, noise,
                    zero if machine_coordinates else job.control.origin, table.lines, str(file)), []


def _tips(table: CsvTable, shown: Floats, columns: dict[str, Floats], job: Job, length: float, machine: bool) -> Floats:
    """(N, 3) where the probe's ball is in the table frame."""
    control, names = job.control, job.machine.axis_names
    words = np.zeros((len(table), len(names)))
    words[:, control.xyz] = shown
    for j in control.rotary.tolist():
        words[:, j] = columns.get(names[j], np.zeros(len(table))) * control.unit[j]
    kin = job.machine.kinematics.with_tool(length)
    if machine:
        return np.asarray(kin.forward(words / control.unit)[0])
    return np.asarray(kin.forward(control.joints(words, kin, length))[0])


def _columns(table: CsvTable, job: Job) -> list[Diagnostic]:
    """Columns that are missing, unknown, or in the wrong units."""
    rotary = [name for name, turns in zip(job.machine.axis_names, job.machine.rotary, strict=True) if turns]
    if (job.control.xyz < 0).any():
        return [error("align.machine", f"{job.machine.name} has no axes X, Y, Z to read a probe by", file=table.file)]
    known, found = (*NOMINAL, *NORMAL, *MEASURED, SIGMA, *rotary), []
    missing = [name for name in (*NOMINAL, *MEASURED) if name not in table.columns]
    unknown = [name for name in table.columns if name not in known]
    if missing or unknown:
        both = ("no column", missing), ("unknown column", unknown)
        what = [f"{text} {', '.join(names)}" for text, names in both if names]
        found.append(_fault(table, "align.column", "; ".join(what), [table.head],
                            f"columns are {', '.join(known)}: {_HEADER}"))
    wanted: Iterable[tuple[str, dict[str, float]]] = (
        *((name, LENGTHS) for name in (*NOMINAL, *MEASURED, SIGMA)), *((name, ANGLES) for name in rotary))
    wrong = [f"{name} [{', '.join(units)}]" for name, units in wanted
             if name in table.columns and table.unit[name] not in units]
    if wrong and not found:
        found.append(_fault(table, "align.unit", f"no unit that fits in the header of {', '.join(wrong)}", [table.head],
                            f"write the header as {_HEADER}"))
    return found


def _fault(table: CsvTable, code: str, what: str, lines: list[int], hint: str) -> Diagnostic:
    return error(code, what, file=table.file, lines=lines[:6], count=len(lines), hint=hint)
