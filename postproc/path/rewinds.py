"""Rewinds: how the tool is drawn back to unwind an axis, and which joints a set-up prefers.

The tool goes along its axis to where nothing is that it could cut, the axes turn there, and it comes back to
the very pose: no rotary axis turns about a tool in the material.
"""

from __future__ import annotations

from dataclasses import field, replace
from functools import partial

import numpy as np

from machines.kinematics.base import SPIN, Kinematics
from machines.machine import Machine
from postproc.control.control import Control
from postproc.joints.plan import JointPreferences
from postproc.joints.run_plan import RunOptions
from postproc.path.links import MARGINS, RISE, Link, Pose, SafeSpace, plan_link
from postproc.setup.joints import Joints
from postproc.setup.model import Placement, RewindSettings, SetupFile
from toolpaths.arrays import Floats, box_corners
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG


@dataclass(frozen=True)
class RetractPlan:
    """Drawing back on one machine: `space` is kept free of the tool while axes turn."""

    space: SafeSpace
    rewind: RewindSettings = field(default_factory=RewindSettings)
    preferences: JointPreferences = field(default_factory=JointPreferences)
    joints: Joints = field(default_factory=Joints)

    @classmethod
    def default(cls, space: SafeSpace) -> RetractPlan:
        """That of a set-up which says nothing."""
        return cls(space)

    def run_options(self, machine: Machine, axis_tolerance: float) -> RunOptions:
        """How the runs of a program are planned on a machine."""
        feed = None if self.rewind.feed is None else self.rewind.feed / 60.0
        slow = machine.limits.velocity[~np.array(machine.rotary)]
        speed = float(slow.min()) if len(slow) else np.inf
        spin = self.joints.spin
        return RunOptions(self.preferences, self.rewind.allowed, feed, partial(self._away, speed, feed or speed),
                          axis_tolerance, None if isinstance(spin, str) else spin * DEG, self.joints.singular_distance,
                          self.joints.carriers == "planned", None if self.space.in_plane else self._drawn)

    def _away(self, rapid: float, feed: float, tip: Floats, axis: Floats) -> Floats:
        """Time (N,) s to draw back from poses (N, 3) to the sphere about what is cut, and to come down again."""
        height = ((tip - self.space.centre) * axis).sum(axis=1)
        top = self.space.planes(axis, np.ones(len(axis), dtype=np.bool_))
        return np.asarray(np.maximum(top - height, 0.0) * (1.0 / rapid + 1.0 / feed))

    def _drawn(self, tip: Floats, axis: Floats) -> Floats:
        """Poses (N, 3) drawn back to the nearest planes that linking moves may use."""
        height = ((tip - self.space.centre) * axis).sum(axis=1)
        share = 1.0 if self.space.distance is not None else MARGINS[-1]
        top = self.space.planes(axis, np.ones(len(axis), dtype=np.bool_), share) + RISE
        return np.asarray(tip + np.maximum(top - height, 0.0)[:, None] * axis)

    def link(self, control: Control, kin: Kinematics, before: Pose | None, after: Pose) -> Link:
        """The path from a pose back to it with other joints."""
        return plan_link(control, kin, kin, self.space, before, after, False, True)


def drawing_of(setup: SetupFile, placement: Placement, space: SafeSpace, machine: Machine,
               file: str = "") -> tuple[RetractPlan, list[Diagnostic]]:
    """What a set-up says, for a machine; faults point into `file`, that of the set-up."""
    rewind, joints = setup.rewind, setup.joints
    diagnostics = [error("setup.joints", f"joints.{table}.{letter}: {machine.name} has no rotary axis {letter}", file=file,
                         hint="it has: " + ", ".join(_rotaries(machine)))
                   for table in ("side", "start") for letter in getattr(joints, table) if letter not in _rotaries(machine)]
    if rewind.stock is not None and not (np.array(rewind.stock.low) < np.array(rewind.stock.high)).all():
        diagnostics.append(error("setup.stock", f"rewind.stock: low {rewind.stock.low} must be below high "
                                 f"{rewind.stock.high} in x, y and z", file=file))
    if setup.clearance.in_plane and machine.kinematics.plane is None:
        diagnostics.append(error("setup.in_plane", f"clearance.in_plane = true: {machine.name} lifts the tool out of every "
                                 "plane", file=file, hint="take in_plane out of [clearance]: linking moves go by the safe "
                                 "planes"))
    if not isinstance(joints.spin, str) and joints.spin and SPIN not in machine.kinematics.open_parameters:
        diagnostics.append(error("setup.joints", f"joints.spin = {joints.spin:g}: {machine.name} cannot turn the tool about "
                                 "its own axis", file=file, hint='take spin out of [joints], or write spin = "needed"'))
    if diagnostics:
        return RetractPlan(space), diagnostics
    index = machine.axis_names.index
    preferences = JointPreferences({index(k): 1 if v == "positive" else -1 for k, v in joints.side.items()},
                                   {index(k): v * DEG for k, v in joints.start.items()})
    if rewind.stock is not None:
        space = _with_stock(space, placement.points(box_corners(np.array(rewind.stock.low), np.array(rewind.stock.high))))
    return RetractPlan(space, rewind, preferences, joints), []


def _rotaries(machine: Machine) -> list[str]:
    return [k for k, rotary in zip(machine.axis_names, machine.rotary, strict=True) if rotary]


def _with_stock(space: SafeSpace, corners: Floats) -> SafeSpace:
    """The box, along the table's axes, round the stock and what is cut, with the sphere about it."""
    every = np.concatenate([corners, space.corners])
    low, high = every.min(axis=0), every.max(axis=0)
    box, centre = box_corners(low, high), 0.5 * (low + high)
    return replace(space, centre=centre, corners=box, radius=float(np.linalg.norm(box - centre, axis=1).max()),
                   distance=None)
