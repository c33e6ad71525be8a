"""The CL path as a plan of orientations has it: other axes, balls where they were, tools held about themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.kinematics.frames import spin_about, tool_x
from postproc.joints.spin import spin_of
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.free_rotary import free_value
from postproc.orientation.passes.allowed import SAME
from postproc.orientation.passes.passes import PassContext
from postproc.setup.model import Placement
from toolpaths.arrays import Floats, Ints
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Arcs, Toolpath


def reoriented(work: PassContext, picked: tuple[Candidate, ...]) -> Toolpath:
    """The CL path with other axes: tips moved by R (axis - axis'), so that the ball stays where it is; arcs with them.

    Where a plan turns anything, every tool along a rotary axis is held as that axis was counted
    (`Toolpath.spin`), else its angle would follow from its neighbours.
    """
    path, back = work.toolpath, work.placement.inverse()
    turned = [made for made in picked if not made.one.fixed and angle_between(made.axis, made.one.axis) >= SAME]
    if not turned and not any(np.isfinite(made.held) for made in picked):
        return path
    tip, axis, center, spin = path.tip.copy(), path.axis.copy(), path.arcs.center.copy(), np.full(len(path), np.nan)
    for made in turned:
        rows, move = _rows(work, made), back.directions(made.one.shift(made.axis)[None])[0]
        tip[rows] += move
        axis[rows] = back.directions(made.axis[None])[0]
        arcs = np.unique(path.arc[rows])
        center[arcs[arcs >= 0]] += move
    for made in picked:
        if np.isfinite(free_value(made)):
            rows = _rows(work, made)
            spin[rows] = _spin(made, back, axis[rows[0]])
    arcs_moved = Arcs(center, path.arcs.normal, path.arcs.radius, path.arcs.sweep)
    return replace(path, tip=tip, axis=axis, arcs=arcs_moved, spin=spin if np.isfinite(spin).any() else None)


def _rows(work: PassContext, made: Candidate) -> Ints:
    """Rows of the Toolpath that belong to a pass."""
    return np.unique(work.moves.row[slice(*made.one.rows)])


def _spin(made: Candidate, back: Placement, axis: Floats) -> float:
    """The spin of a pass in the part frame, where its axis is `axis` (3,)."""
    side = tool_x(made.axis[None], np.array([spin_of(made.one.kin, made.q[0])]))
    return float(spin_about(axis[None], back.directions(side))[0])
