"""Measures of a platform on legs at places of its workspace: how it transmits, and what its rods carry.

Of the reference point of the platform. Transmission by `transmission.py`; the rods' forces f by T^t f = -w under a unit
force w (eta_bf), a unit moment (eta_bm), and a unit force of inertia at a centre of mass `offset` above the reference point
(eta_bfm), each in its worst direction. Source: Company 2000, II-34 to II-38, III-18 to III-22, III.6.2 to III.6.5.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from machines.analysis.choices import MapMeasure
from machines.analysis.transmission import (
    condition_number,
    conditioning_factor,
    force_transmission,
    manipulability,
    speed_transmission,
)
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops
from machines.kinematics.legs.over_workspace import OverWorkspace
from machines.machine import Machine
from machines.stiffness.statics import force_rows
from machines.tolerances.influence import poses_at
from machines.tolerances.sensitivity import RodsOfLegs
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.shapes import arrays

WORDS: Mapping[MapMeasure, str] = {
    "condition": "condition number", "conditioning": "conditioning factor", "manipulability": "manipulability |det J|",
    "speed": "drive speed per speed of the platform", "force": "drive force per force on the platform",
    "acceleration": "drive acceleration per speed squared, 1/mm", "rod-force": "rod force per force",
    "rod-moment": "rod force per moment, N per N m", "rod-inertia": "rod force per force of inertia"}
OF = {"condition": condition_number, "conditioning": conditioning_factor, "manipulability": manipulability,
      "speed": speed_transmission, "force": force_transmission}
PER_M = 1e3


@dataclass(frozen=True, eq=False)
@arrays(leg="R", shift="R 3")
class StudiedLegs:
    """The legs that are looked at, the leg of each rod and its place next to the leg's line; height of the centre of mass,
    mm."""

    legs: LegGeometry
    leg: Ints
    shift: Floats
    offset: float = 0.0

    @cached_property
    def transmits(self) -> OverWorkspace:
        """How they transmit."""
        of = self.legs
        drives = Drives(of.points, of.directions, of.lengths, of.roots, of.arms, of.slide, of.arm)
        return OverWorkspace(Loops(drives, of.joints, of.freedoms, of.kept, bars=of.bars), of.workspace)

    def resized(self, rod: float | None = None, radius: float | None = None, offset: float | None = None) -> StudiedLegs:
        """The same with all rods of one length, all drives at one distance from the z axis, another centre of mass, mm."""
        points = self.legs.points.copy()
        if radius is not None:
            far = np.linalg.norm(points[:, :2], axis=1, keepdims=True)
            points[:, :2] = np.where(far > 0.0, points[:, :2] / np.where(far > 0.0, far, 1.0), 0.0) * radius
        lengths = self.legs.lengths if rod is None else np.full(len(points), float(rod))
        return replace(self, legs=replace(self.legs, points=points, lengths=lengths),
                       offset=self.offset if offset is None else offset)

    def value(self, measure: MapMeasure, place: Floats, tilt: Floats) -> Floats:
        """(N,) at places (N, 3) and tilts (N,), in the worst direction of the tilt; NaN where a leg does not reach."""
        with np.errstate(invalid="ignore", divide="ignore"):
            if measure in OF:
                return np.asarray(OF[measure](self.transmits, place, tilt))
            if measure == "acceleration":
                return _bent(self, place, tilt)
            return np.asarray(np.max([_carried(self, measure, place, tilt, float(h)) for h in self.transmits.headings],
                                     axis=0))


def studied(machine: Machine, measure: MapMeasure) -> StudiedLegs:
    """The legs of a machine.

    Raises:
        DiagnosticError: of a machine without legs, or whose legs the measure is not for.
    """
    legs, parts = machine.kinematics.leg_geometry, machine.kinematics.clearance_parts
    if machine.kinematics.transmits is None or legs is None or parts is None:
        raise DiagnosticError([error("analysis.map", f"{machine.name} has no legs: its slides pass their speed on as it is",
                                     file=machine.file, hint="leave --map out: machine analyse has the indices of a chain")])
    if legs.holds is not None:
        raise DiagnosticError([error("analysis.map", f"some motions of {machine.name} follow from what holds its platform "
                                     "besides the legs: its measures are not mapped", file=machine.file,
                                     hint="leave --map out: machine analyse has the extremes over its workspace")])
    slides = bool(legs.slide.all()) and not legs.turns
    if (measure == "acceleration" and not slides) or (measure.startswith("rod") and not legs.plain):
        what = "slides under a platform that only translates" if measure == "acceleration" else \
            "platforms without bars, turns about z alone and redundant carriers"
        raise DiagnosticError([error("analysis.map", f"{WORDS[measure]} is for {what}, not for {machine.name}",
                                     file=machine.file, hint="name another measure with --map")])
    sizes = parts.clearance
    every = np.arange(len(legs.names))
    own = (every, np.zeros((len(every), 3))) if sizes is None else (sizes.leg, sizes.shift)
    return StudiedLegs(legs, *own)


def _bent(of: StudiedLegs, place: Floats, tilt: Floats) -> Floats:
    """eta_av (III.6.5): the largest |(I - u j) v|^2 / |r.u| of a drive at |v| = 1, j the row of J^-1."""
    jx, along = of.transmits.loops_at(place, tilt, 0.0)
    u = of.legs.directions @ of.transmits.loops.basis[:3]
    outer = u[None, :, :, None] * (jx / along[:, :, None])[:, :, None, :]
    bad = np.asarray(~np.isfinite(outer).all(axis=(1, 2, 3)), dtype=np.bool_)
    size = np.linalg.norm(np.where(bad[:, None, None, None], 0.0, np.eye(u.shape[1]) - outer), ord=2, axis=(2, 3))
    return np.asarray(np.where(bad, np.nan, (size**2 / np.abs(along)).max(axis=1)))


def _carried(of: StudiedLegs, measure: MapMeasure, place: Floats, tilt: Floats, heading: float) -> Floats:
    """Largest force of a rod (N,) per load in its worst direction."""
    legs = of.legs
    poses = poses_at(legs, np.column_stack([place, tilt, np.full(len(tilt), heading)]))
    rows = force_rows(RodsOfLegs(legs, of.leg, of.shift), poses, np.zeros(3))
    t = np.swapaxes(rows.rods[:, :, rows.columns], 1, 2)
    bad = np.asarray(~np.isfinite(t).all(axis=(1, 2)), dtype=np.bool_)
    back = np.zeros((len(t), rows.rods.shape[1], 6))
    back[:, :, rows.columns] = np.linalg.pinv(np.where(bad[:, None, None], 0.0, t))
    load = back[:, :, :3]
    if measure == "rod-moment":
        load = PER_M * back[:, :, 3:]
    elif measure == "rod-inertia":
        x, y, z = (of.offset * poses.turn[:, :, 2]).T
        zero = np.zeros(len(t))
        lever = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
        load = load + back[:, :, 3:] @ lever
    return np.asarray(np.where(bad, np.nan, np.linalg.norm(load, axis=2).max(axis=1)))

