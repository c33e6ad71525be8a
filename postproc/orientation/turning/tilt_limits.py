"""What holds the axes of a run: cone, lead and tilt, dead centre, travel, and how far ball or corner may leave its path.

Each limit is a number that must not be above 0 at a row or a site, relaxed to what the CL file's own axis makes of it: an
axis that is outside already is turned no farther out. The search sees each as a penalty, whose slope it needs.
"""

from __future__ import annotations

import numpy as np

from machines.machine import Machine
from postproc.orientation.passes.allowed import off_centre
from postproc.orientation.passes.contact import Contact
from postproc.orientation.turning.cutting_runs import LEAN, CuttingRun
from postproc.orientation.turning.kept_contact import bend, bend_slopes
from postproc.reference.cutter import CutterEnd
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

SHARE = 0.1
"""of the tolerance by which the centre of ball or corner may leave its path between two points of the CL file"""
WEIGHT = 100.0
"""of a penalty, per rad^2 or (10 mm)^2 over a limit, next to the time over that of the own axes"""
MARGIN = 2e-3
"""rad or 10 mm inside a limit where its penalty begins"""
NEAR = 0.9
"""of the share of the tolerance, likewise"""
NUDGE = 1e-6
"""rad, by which the bend of the path is differenced"""
_SLACK = 1e-9


@dataclass(frozen=True)
@arrays(row="K", side="K 3", most="K", lower="J", upper="J", scale="J", own="m 3", normal="N 3")
class TiltLimits:
    """Limits of one run of N poses.

    Attributes:
        row (K,): pose that a half-space is for; side (K, 3), most (K,): its axis a must have a . side <= most
        lower, upper (J,): travel; scale (J,): 1 for rotary joints, 0.1 for slides
        own (N - 1, 3): `bend` of the own axes, mm
        slack: mm by which the centre of ball or corner may leave its path
        end, normal (N, 3): of the cutter, and of the surface where that matters
    """

    row: Ints
    side: Floats
    most: Floats
    lower: Floats
    upper: Floats
    scale: Floats
    own: Floats
    slack: float
    end: CutterEnd
    normal: Floats

    def broken(self, axis: Floats, q: Floats) -> bool:
        """Whether axes (N, 3) at the poses or joints (M, J) at the sites are outside."""
        over = np.einsum("ki,ki->k", axis[self.row], self.side) - self.most
        beyond = np.maximum(self.lower - q, q - self.upper)
        return bool(over.max(initial=-1.0) > _SLACK or beyond.max(initial=-1.0) > _SLACK or not np.isfinite(q).all()
                    or self.off_path(axis) > self.slack)

    def off_path(self, axis: Floats) -> float:
        """mm that the centre of ball or corner leaves its path between the poses at most, with axes (N, 3)."""
        return float(np.linalg.norm(bend(axis, self.end, self.normal) - self.own, axis=1).max(initial=0.0))

    def penalty_of_axes(self, axis: Floats) -> tuple[float, Floats]:
        """Penalty of axes (N, 3) at the poses, and its slope by them (N, 3)."""
        over = np.maximum(np.einsum("ki,ki->k", axis[self.row], self.side) - self.most + MARGIN, 0.0)
        slope = np.zeros_like(axis)
        np.add.at(slope, self.row, 2.0 * WEIGHT * over[:, None] * self.side)
        off = (bend(axis, self.end, self.normal) - self.own) / self.slack
        far = np.linalg.norm(off, axis=1, keepdims=True)
        much = np.maximum(far - NEAR, 0.0)
        if much.any():
            push = 2.0 * much * off / np.maximum(far, 1e-12) / self.slack
            before, behind = bend_slopes(axis, self.end, self.normal, NUDGE)
            slope[:-1] += np.einsum("nik,ni->nk", before, push)
            slope[1:] += np.einsum("nik,ni->nk", behind, push)
        return float(WEIGHT * (over**2).sum() + (much**2).sum()), slope

    def penalty_of_joints(self, q: Floats) -> tuple[float, Floats]:
        """Penalty of joints (M, J) at the sites, and its slope by them (M, J)."""
        high = np.maximum((q - self.upper) * self.scale + MARGIN, 0.0)
        low = np.maximum((self.lower - q) * self.scale + MARGIN, 0.0)
        return (float(WEIGHT * (high**2 + low**2).sum() / len(q)),
                np.asarray(2.0 * WEIGHT / len(q) * (high - low) * self.scale))


def limits_of(run: CuttingRun, machine: Machine, tolerance: float, most: float) -> TiltLimits:
    """The limits of a run; `most`: rad from the surface normal, `tolerance`: mm."""
    row, side, bound = _half_spaces(run, run.contact, most)
    inside = np.einsum("ki,ki->k", run.axis[row], side)
    q = np.concatenate([one.q for one in run.stretches])
    limits = machine.limits
    return TiltLimits(row, side, np.maximum(bound, inside), np.minimum(limits.lower, q.min(axis=0)),
                      np.maximum(limits.upper, q.max(axis=0)), np.where(machine.rotary, 1.0, 0.1),
                      bend(run.axis, run.end, run.normal), SHARE * tolerance, run.end, run.normal)


def _half_spaces(run: CuttingRun, at: Contact, most: float) -> tuple[Ints, Floats, Floats]:
    """(pose (K,), side (K, 3), bound (K,)) of the angles that the set-up limits, each as a . side <= bound.

    An angle atan2(a . u, a . n) is at most h where a . (u cos h - n sin h) <= 0, for limits within +-90 degrees.
    """
    limits, parts = run.limits, list[tuple[Floats, float]]()
    least = off_centre(limits, run.end.corner)
    if run.end.flat:
        least, most = max((limits.off_centre or 0.0) * DEG, LEAN[0]), min(most, LEAN[1])
    parts.append((-at.normal, -float(np.cos(most))))
    if least > 0.0:
        parts.append((at.normal, float(np.cos(least))))
    for given, side in ((limits.lead, at.travel), (limits.tilt, at.right)):
        for angle, sign in ((given[0] * DEG, -1.0), (given[1] * DEG, 1.0)) if given is not None else ():
            parts.append((sign * (np.cos(angle) * side - np.sin(angle) * at.normal), 0.0))
    row = np.tile(at.line, len(parts))
    side, bound = np.concatenate([part for part, _ in parts]), np.repeat([most for _, most in parts], len(at))
    known = np.isfinite(side).all(axis=1)
    return row[known].astype(np.int64), side[known], bound[known]
