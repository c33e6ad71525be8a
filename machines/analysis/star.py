"""Star diagrams of machines on legs: what their drives and rods must do for one and the same task (IV.8 of Company 2000).

Eight figures, each the largest over the workspace (IV.8.2.2): speed of a drive while the platform translates, and while it
turns about the tip across the spindle; force of a drive and of a rod while cutting; power of the drives while cutting; force
and power of the drives while accelerating; bulk E = R + L. With rates qd = N x of the platform (v at the tip, omega) a
wrench w on it asks F = -N^-T w of the drives. A cutting force acts anywhere on the tool's circumference, its components
across the spindle and along it at their largest (IV-13). Power is the sum of |F qd|: a drive that brakes gives nothing back.
No document prints a value of any of them; gravity and inertia in rotation are left out, as there.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.analysis.measures import StudiedLegs, studied
from machines.machine import Machine
from machines.stiffness.statics import force_rows
from machines.tolerances.influence import PlatformPoses, poses_over
from machines.tolerances.sensitivity import RodsOfLegs
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.drawing import image
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AXES = ("speed_translating_m_per_s", "speed_turning_m_per_s", "drive_force_cutting_n", "rod_force_cutting_n",
        "power_cutting_w", "drive_force_accelerating_n", "power_accelerating_w", "radius_and_rod_m")
LABELS = ("v translating", "v turning", "F drive, cutting", "F rod, cutting", "P cutting", "F drive, accelerating",
          "P accelerating", "R + L")
REFERENCE = (1.0, 1.0, 1e3, 1e3, 1e3, 1e3, 1e3, 1.0)
"""IV-14: m/s, N, W, m"""
CONTACTS = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
DIRECTIONS = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
DIRECTIONS = DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)


@dataclass(frozen=True)
class MachiningTask:
    """What the machines are compared by (IV.8.1): mm/s, rad/s, mm/s2, N, mm, kg."""

    rapid: float = 1250.0
    feed: float = 50e3 / 60.0
    turn: float = 80.0 * np.pi / 60.0
    acceleration: float = 10e3
    cutting: float = 4500.0
    axial: float = 4500.0
    tool_radius: float = 10.0
    tool: float = 100.0
    platform_mass: float = 250.0
    drive_mass: float = 210.0


@dataclass(frozen=True, eq=False)
@arrays(values="A", at="A 5")
class StarOfMachine:
    """The figures of one machine, of AXES, and the pose of each (mm, rad)."""

    name: str
    values: Floats
    at: Floats

    @property
    def figures(self) -> dict[str, Any]:
        """Units in the keys; null where a place of the workspace is out of reach."""
        return {"machine": self.name} | {
            key: float(v) if np.isfinite(v) else None for key, v in zip(AXES, self.values, strict=True)} | {
            "at_mm_and_deg": {key: [*row[:3].tolist(), *np.degrees(row[3:]).tolist()]
                              for key, row in zip(AXES[:-1], self.at, strict=False)}}


def star_of(machine: Machine, task: MachiningTask, rod: float | None = None) -> StarOfMachine:
    """Of a machine, or of it with all rods of another length (mm).

    Raises:
        DiagnosticError: of a machine without legs, or with bars.
    """
    legs = studied(machine, "rod-force").resized(rod=rod)
    poses = poses_over(legs.legs)
    rates = _rates(legs, poses, task)
    good = np.isfinite(rates).all(axis=(1, 2))
    poses, rates = PlatformPoses(poses.place[good], poses.turn[good], poses.pose[good]), rates[good]
    name = machine.name if rod is None else f"{machine.name}, L {rod:g}"
    values, at = np.full(len(AXES), np.inf), np.zeros((len(AXES), 5))
    if len(rates) and good.all():
        for k, column in enumerate(_columns(legs, poses, rates, task)):
            j = int(column.argmax())
            values[k], at[k] = column[j], poses.pose[j]
    geometry = legs.legs
    values[-1] = (np.linalg.norm(geometry.points[:, :2], axis=1).max() + geometry.lengths.max()) * 1e-3
    return StarOfMachine(name, values, at)


def _rates(legs: StudiedLegs, poses: PlatformPoses, task: MachiningTask) -> Floats:
    """N (N, K, F): rates of the drives (arms: of their ends) per v at the tip and omega of the freedoms; NaN out of
    reach."""
    loops = legs.transmits.loops
    q = loops.drives.solve(loops.ends(poses.place, poses.turn), loops.drives.roots)
    _, rods = loops.matrix_at(poses.place, poses.turn, q)
    tip = poses.turn @ (legs.legs.gauge - [0.0, 0.0, task.tool])
    moments = np.cross(loops.arms(poses.turn) - tip[:, None], rods)
    with np.errstate(invalid="ignore", divide="ignore"):
        rows = np.concatenate([rods, moments], axis=2) / (loops.drives.gains(rods, q) / loops.drives.size)[:, :, None]
    return np.asarray(rows[:, :, _free(legs)])


def _free(legs: StudiedLegs) -> list[int]:
    return ["xyzabc".index(letter) for letter in legs.legs.freedoms]


def _columns(legs: StudiedLegs, poses: PlatformPoses, rates: Floats, task: MachiningTask) -> list[Floats]:
    """The figures (N,) at poses, all but the last."""
    free = np.array(_free(legs))
    moves, turns = free < 3, free >= 3
    flat = np.eye(3)[:, free[moves]]
    translating = rates[:, :, moves]
    across = np.eye(3) - poses.turn[:, :, 2, None] * poses.turn[:, None, :, 2]
    turning = rates[:, :, turns] @ across[:, free[turns] - 3] if turns.any() else np.zeros((len(rates), rates.shape[1], 1))
    back = np.linalg.inv(rates)
    whole = np.zeros((len(rates), 6, rates.shape[1]))
    whole[:, free] = back
    drives = np.swapaxes(whole, 1, 2)
    forces = _cutting(poses, drives, task)
    rods = _rod_maps(legs, poses, task)
    speeds = np.abs(translating @ (flat.T @ DIRECTIONS.T))
    felt = _at_reference(legs, poses, drives, task)[:, :, free[moves]]
    inertia = task.drive_mass * translating + task.platform_mass * felt
    pushed = np.abs(inertia @ (flat.T @ DIRECTIONS.T)) * task.acceleration
    return [np.linalg.norm(translating, axis=2).max(axis=1) * task.rapid * 1e-3,
            np.linalg.norm(turning, axis=2).max(axis=1) * task.turn * 1e-3,
            np.abs(forces).max(axis=(1, 2)), np.abs(_cutting(poses, rods, task)).max(axis=(1, 2)),
            np.einsum("nkc,nkd->ncd", np.abs(forces), speeds).max(axis=(1, 2)) * task.feed * 1e-3,
            np.linalg.norm(inertia, axis=2).max(axis=1) * task.acceleration * 1e-3,
            np.einsum("nkd,nkd->nd", pushed, speeds).max(axis=1) * task.rapid * 1e-6]


def _at_reference(legs: StudiedLegs, poses: PlatformPoses, drives: Floats, task: MachiningTask) -> Floats:
    """(N, K, 3) force of each drive per force at the platform's reference point, where the mass is thought to be."""
    x, y, z = (-(poses.turn @ (legs.legs.gauge - [0.0, 0.0, task.tool]))).T
    zero = np.zeros(len(x))
    lever = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    return np.asarray(drives[:, :, :3] + drives[:, :, 3:] @ lever)


def _rod_maps(legs: StudiedLegs, poses: PlatformPoses, task: MachiningTask) -> Floats:
    """(N, R, 6) force of each rod per wrench at the tip."""
    rows = force_rows(RodsOfLegs(legs.legs, legs.leg, legs.shift), poses, legs.legs.gauge - [0.0, 0.0, task.tool])
    found = np.zeros((len(rows.rods), rows.rods.shape[1], 6))
    found[:, :, rows.columns] = np.linalg.pinv(np.swapaxes(rows.rods[:, :, rows.columns], 1, 2))
    return found


def _cutting(poses: PlatformPoses, maps: Floats, task: MachiningTask) -> Floats:
    """(N, K, C) N: each of K under the cutting forces: corners of their components, at CONTACTS on the tool."""
    found = []
    for angle in CONTACTS:
        point = poses.turn @ (task.tool_radius * np.array([np.cos(angle), np.sin(angle), 0.0]))
        x, y, z = point.T
        zero = np.zeros(len(x))
        lever = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
        per_force = maps[:, :, :3] + maps[:, :, 3:] @ lever
        for signs in product((-1.0, 1.0), (-1.0, 1.0), (-1.0, 1.0)):
            force = poses.turn @ (np.array(signs) * [task.cutting, task.cutting, task.axial])
            found.append(np.einsum("nki,ni->nk", per_force, force))
    return np.stack(found, axis=2)


def star_csv(stars: Sequence[StarOfMachine]) -> str:
    """Comma-separated values with units in the heads."""
    return "\n".join([",".join(("machine", *AXES)), *(",".join([f'"{one.name}"', *(f"{v:.6g}" for v in one.values)])
                                                     for one in stars)]) + "\n"


def star_figure(stars: Sequence[StarOfMachine], ending: FigureEnding) -> bytes:
    """A polygon of each machine; every axis ends at its largest value, the dot is the reference of IV-14."""
    values = np.stack([np.where(np.isfinite(one.values), one.values, np.nan) for one in stars])
    most = np.maximum(np.nanmax(values, axis=0, initial=0.0), REFERENCE)
    angle = np.linspace(0.0, 2.0 * np.pi, len(AXES), endpoint=False)

    def fill(sheet: Figure) -> None:
        axes = sheet.add_subplot(projection="polar")
        for one, row in zip(stars, values / most, strict=True):
            axes.plot(np.append(angle, angle[0]), np.append(row, row[0]), marker=".", label=one.name)
        axes.plot(angle, np.array(REFERENCE) / most, "o", color="#222222", markersize=4, label="reference (IV-14)")
        axes.set_xticks(angle, [f"{label}\n{v:.3g}" for label, v in zip(LABELS, most, strict=True)], fontsize=8)
        axes.set_yticks([0.25, 0.5, 0.75, 1.0], [])
        sheet.legend(*axes.get_legend_handles_labels(), loc="lower right", fontsize=8)

    return image((8.5, 7.5), "largest over the workspace, tool in place", fill, ending)
