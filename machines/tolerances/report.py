"""The influence of a machine's dimensions as plain data, tables and a figure; units in the keys."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.machine import Machine
from machines.tolerances.any_machine import MachinePositions, any_machine, positions_of
from machines.tolerances.influence import (
    LargestInfluence,
    P,
    budget,
    by_chance,
    by_point,
    influence,
    largest,
    middle_of,
    poses_over,
    prices,
    single,
)
from machines.tolerances.sensitivity import LegDimension, RodsOfLegs
from machines.value_words import nearest
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.drawing import image
from toolpaths.shapes import arrays
from toolpaths.table_text import table_text
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MICRO = 1e-3
"""mm of one micrometre, rad of a thousand microradians: guides count per microradian"""


@dataclass(frozen=True)
class ToleranceQuestion:
    """What is asked of the dimensions.

    Attributes:
        tool: mm, to the tip whose errors are meant
        adjust: with the rods' lengths set so that the middle of the workspace is exact
        spread: mm, of errors by chance; rad / 1000 of guides
        samples: of them
        allowed: mm, error of the tip that a budget has to keep; None: no budget
        cost: of a tolerance of 1 mm (rad), by part, point or dimension; 1 where not given
    """

    tool: float = 0.0
    adjust: bool = False
    spread: float = MICRO
    samples: int = 1000
    allowed: float | None = None
    cost: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
@arrays(middle="6 E")
class ToleranceReport:
    """Influence of the dimensions of a machine: the largest of each and of each point, S in the middle of the workspace."""

    machine: Machine
    asked: ToleranceQuestion
    dimensions: tuple[LegDimension, ...]
    most: LargestInfluence
    points: LargestInfluence
    middle: Floats
    poses: int

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The table by dimension."""
        rows = [_row(one, self.most, k) for k, one in enumerate(self.dimensions)]
        if self.asked.allowed is not None:
            found = budget(self.dimensions, self.most.position, self.asked.allowed, self.asked.cost)
            for row, one, value in zip(rows, self.dimensions, found.tolist(), strict=True):
                row["tolerance"] = value * (1e6 if one.angular else 1.0 / MICRO) if np.isfinite(value) else None
        return rows

    @property
    def figures(self) -> dict[str, Any]:
        """All of it."""
        asked, points = self.asked, self.points
        what = "once the rods are adjusted in the middle of the workspace" if asked.adjust else "as built"
        figures: dict[str, Any] = {
            "machine": self.machine.name, "tool_mm": asked.tool, "adjusted": asked.adjust,
            "of": f"largest error of the tip (tool {asked.tool:g} mm) at {self.poses} poses of the workspace, "
                  f"{what}: position in um, turn in urad, per um, of guides and turns per urad",
            "dimensions": self.rows,
            "points": [{"point": str(name), "position": _scaled(name, float(points.position[k])),
                        "turn": float(points.turn[k] * (1.0 if name.angular else 1000.0))}
                       for k, name in enumerate(by_point(self.dimensions))],
            "by_chance": _chance(self.middle, asked, self.dimensions)}
        return figures | (_budget(self.dimensions, self.most, asked) if asked.allowed is not None else {})

    @property
    def text(self) -> str:
        """For people."""
        rows = self.rows
        keys = [key for key in ("dimension", "position", "turn", "tolerance") if key in rows[0]]
        lines = table_text([[_cell(row[key]) for key in keys] for row in rows], keys, "lrrr")
        return "\n".join([self.figures["of"], *lines])

    @property
    def csv(self) -> str:
        """The same as comma-separated values."""
        rows = self.rows
        keys = list(rows[0])
        return "\n".join([",".join(keys), *(",".join(str(row[key]) for key in keys) for row in rows)]) + "\n"


def _cell(value: Any) -> str:
    return f"{value:.4f}" if isinstance(value, float) else str(value)


def rods_of(machine: Machine) -> RodsOfLegs:
    """The rods of a machine on legs.

    Raises:
        DiagnosticError: of a machine without legs.
    """
    legs, parts = machine.kinematics.leg_geometry, machine.kinematics.clearance_parts
    if legs is None or not legs.plain or parts is None or parts.clearance is None:
        raise DiagnosticError([error(
            "sensitivity.legs", f"{machine.name} has no platform on legs, or one with bars, with a turn about z alone, or "
            "carried twice", file=machine.file,
            hint="name a machine on legs; errors of a chain of axes are in error models (convert --error-model)")])
    return RodsOfLegs(legs, parts.clearance.leg, parts.clearance.shift)


def tolerances(machine: Machine, asked: ToleranceQuestion) -> ToleranceReport:
    """Influence of every dimension over the workspace, by dimension and by point, by chance, and a budget.

    Raises:
        DiagnosticError: of a kind without dimensions, of an adjustment without rods, of costs of what is not there.
    """
    legs, parts = machine.kinematics.leg_geometry, machine.kinematics.clearance_parts
    if legs is None or not legs.plain or parts is None or parts.clearance is None or machine.kinematics.axes_with_errors:
        return _of_any(machine, asked)
    rods = rods_of(machine)
    point = rods.legs.gauge - np.array([0.0, 0.0, asked.tool])
    return _report(machine, asked, rods.dimensions, influence(rods, point, asked.adjust), poses_over(rods.legs),
                   middle_of(rods.legs))


def _of_any(machine: Machine, asked: ToleranceQuestion) -> ToleranceReport:
    """By the machine's model of geometric errors."""
    whole = any_machine(machine, asked.tool)
    if whole is None:
        raise DiagnosticError([error("sensitivity.kind", f"nothing is known of errors of the dimensions of {machine.name}",
                                     file=machine.file)])
    if asked.adjust and not any(one.part == "rod" for one in whole.dimensions):
        raise DiagnosticError([error("sensitivity.adjust", f"{machine.name} has no rods whose lengths could be adjusted",
                                     file=machine.file, hint="leave --adjust out")])
    positions = positions_of(machine, asked.tool)
    middle, parts = positions.part(slice(0, 1)), machine.kinematics.leg_geometry
    lever = 1000.0 if parts is None else parts.lever

    def of(some: MachinePositions) -> Floats:
        return whole.adjusted(some, middle, lever) if asked.adjust else whole.influence(some)
    return _report(machine, asked, whole.dimensions, of, positions, middle)


def _report(machine: Machine, asked: ToleranceQuestion, dimensions: tuple[LegDimension, ...], of: Callable[[P], Floats],
            poses: P, middle: P) -> ToleranceReport:
    known = {name for one in dimensions for name in (str(one), f"{one.part} {one.of}", one.part)}
    unknown = [name for name in asked.cost if name not in known]
    if unknown:
        raise DiagnosticError([error("sensitivity.cost", f"{machine.name} has no dimension {unknown[0]!r}",
                                     file=machine.file, hint=f"{nearest(unknown[0], sorted(known))} A part, a point or a "
                                     "dimension of its table has a cost")])
    most = largest(of, poses, single(dimensions))
    points = largest(of, poses, tuple(by_point(dimensions).values()))
    return ToleranceReport(machine, asked, dimensions, most, points, of(middle)[0], len(poses.pose))


def _scaled(one: LegDimension, value: float) -> float:
    return value * (MICRO if one.angular else 1.0)


def _row(one: LegDimension, most: LargestInfluence, k: int) -> dict[str, Any]:
    x, y, z, tilt, heading = most.position_at[k].tolist()
    return {"dimension": str(one), "unit": "urad" if one.angular else "um",
            "position": float(_scaled(one, most.position[k])),
            "turn": float(most.turn[k] * (1.0 if one.angular else 1000.0)),
            "at_x_mm": x, "at_y_mm": y, "at_z_mm": z, "at_tilt_deg": tilt / DEG, "at_heading_deg": heading / DEG}


def _spread(asked: ToleranceQuestion, dimensions: tuple[LegDimension, ...]) -> Floats:
    return np.array([asked.spread * (1e-3 if one.angular else 1.0) for one in dimensions])


def _chance(s: Floats, asked: ToleranceQuestion, dimensions: tuple[LegDimension, ...]) -> dict[str, Any]:
    """In the middle of the workspace, in um and urad."""
    spread = _spread(asked, dimensions)
    found: dict[str, Any] = {"spread_um": asked.spread / MICRO, "samples": asked.samples,
                             "worst_case_position_um": float(np.linalg.norm(s[:3], axis=0) @ spread / MICRO)}
    for name, normal in (("even", False), ("normal", True)):
        drawn = by_chance(s, spread, asked.samples, normal)
        keys = ("mean", "half", "95_percent", "99.7_percent")
        found[name] = {f"position_{key}_um": value / MICRO for key, value in zip(keys, drawn.position, strict=True)} | {
            f"turn_{key}_urad": value * 1e6 for key, value in zip(keys, drawn.turn, strict=True)}
    return found


def _budget(dimensions: tuple[LegDimension, ...], most: LargestInfluence, asked: ToleranceQuestion) -> dict[str, Any]:
    allowed = asked.allowed or 0.0
    found = budget(dimensions, most.position, allowed, asked.cost)
    price = prices(dimensions, asked.cost)
    even = allowed / float(np.linalg.norm(most.position))
    first = int(np.argmax(most.position * _spread(asked, dimensions)))
    return {"budget": {"allowed_um": allowed / MICRO, "cost": float((price / found).sum()),
                       "cost_of_equal_tolerances": float((price / even).sum()), "tighten_first": str(dimensions[first])}}


def tolerance_figure(machine: Machine, found: ToleranceReport, ending: FigureEnding) -> bytes:
    """Bars of the largest influence of each point, guide and rod on place and turn of the tool."""
    points = found.figures["points"]

    def fill(sheet: Figure) -> None:
        for axes, key, unit in zip(sheet.subplots(1, 2), ("position", "turn"), ("um", "urad"), strict=True):
            axes.barh([one["point"] for one in points], [one[key] for one in points], color="#2456a6")
            axes.invert_yaxis()
            axes.tick_params(axis="y", labelsize=6)
            axes.set_xlabel(f"{unit} per um, of guides per urad")
            axes.set_title(f"{key} of the tool")

    title = f"{machine.name}, tool {found.figures['tool_mm']:g} mm: largest influence over the workspace"
    return image((11.0, 2.0 + 0.14 * len(points)), title, fill, ending)


