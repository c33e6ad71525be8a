"""Runs without any choice: machines without rotary axes, whose inverse has one branch, all poses inside travel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Limits
from postproc.joints.lattice import PoseRun
from postproc.joints.tracks import TRAVEL_SLACK
from toolpaths.arrays import Floats


def direct(runs: Sequence[PoseRun], limits: Limits) -> list[Floats] | None:
    """Joints (N, J) of every run, all runs of one tool solved together; None where there is a choice, or a pose outside."""
    if any(any(run.kin.rotary) or run.kin.branches != 1 for run in runs):
        return None
    result: list[Floats] = [np.zeros((0, 0))] * len(runs)
    tools: dict[int, list[int]] = {}
    for k, run in enumerate(runs):
        tools.setdefault(id(run.kin), []).append(k)
    for some in tools.values():
        q = _joints(runs[some[0]].kin, [runs[k] for k in some], limits)
        if q is None:
            return None
        ends = np.cumsum([len(runs[k].tip) for k in some])
        for k, part in zip(some, np.split(q, ends[:-1]), strict=True):
            result[k] = part
    return result


def _joints(kin: Kinematics, runs: Sequence[PoseRun], limits: Limits) -> Floats | None:
    """Joints (N, J) of runs one behind the other; None where one is outside, or where a direction is singular."""
    tip, axis = (np.concatenate(x) if len(x) > 1 else x[0] for x in ([run.tip for run in runs], [run.axis for run in runs]))
    given = [run.parameters for run in runs if run.parameters is not None]
    return joints_inside(kin, tip, axis, limits, np.concatenate(given) if given else None)


def joints_inside(kin: Kinematics, tip: Floats, axis: Floats, limits: Limits,
                  parameters: Floats | None = None) -> Floats | None:
    """Joints (N, J) of poses (N, 3) on a machine whose inverse has one branch; None where one is outside or singular."""
    q: Floats = (kin.inverse(tip, axis) if parameters is None else kin.inverse_with(tip, axis, parameters))[0]
    inside = (q >= limits.lower - TRAVEL_SLACK) & (q <= limits.upper + TRAVEL_SLACK)
    return q if bool(inside.all()) and not bool(kin.singular(q).any()) else None
