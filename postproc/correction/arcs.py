"""Arcs through their corrected ends, where they stay near enough to the nominal ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from postproc.base.group_rows import groups
from postproc.control.word_arcs import PLANE_AXIS, PLANE_COLUMNS
from postproc.correction.error_context import ErrorContext, on_arc
from postproc.correction.error_sampling import changes, looks_between
from postproc.correction.reversals import LOOSE
from postproc.path.model import ARC, FEED, JointPath
from toolpaths.arrays import Bools, Floats, Ints

LOOKS = (0.25, 0.5, 0.75)
"""where the motion between two corrected points is looked at"""


def fitted_arcs(path: JointPath, nominal: JointPath, work: ErrorContext, start: Floats, allowed: float,
                grain: float) -> tuple[JointPath, Bools]:
    """The path with arcs through their corrected ends, and which of them become lines: those that leave the
    nominal arc by more than `allowed` mm, or rise by more than half a `grain` across a plane in which the
    control has no helix."""
    resolved, center = np.zeros(len(path), dtype=bool), path.center.copy()
    arcs = np.flatnonzero(path.code == ARC)
    for rows in groups(path.frame[arcs], work.tools[arcs]):
        k = arcs[rows]
        kin = work.kinematics(int(work.tools[k[0]]))
        old, new = (p.frames[int(p.frame[k[0]])].control for p in (nominal, path))
        n0, n1, c0, c1 = (control.words(q, kin, 0.0) for control, q in ((old, nominal.q[k - 1]), (old, nominal.q[k]),
                                                                        (new, start[k]), (new, path.q[k])))
        xyz = new.xyz
        center[k] = new_centers(path, k, n0[:, xyz], n1[:, xyz], c0[:, xyz], c1[:, xyz])
        rise = np.abs((c1 - c0)[:, xyz][np.arange(len(k)), [PLANE_AXIS[int(p)] for p in path.plane[k]]])
        resolved[k] |= ~np.isin(path.plane[k], new.helix_planes) & (rise > 0.5 * grain)
        for t in LOOKS:
            share = np.full(len(k), t)
            got = new.joints(on_arc(path.plane[k], path.ccw[k], center[k], c0, c1, share, xyz), kin, 0.0)
            resolved[k] |= ~(work.off(work.nominal(k, share), got, k, work.approach_at(k, share)) <= LOOSE * allowed)
        for r, share in looks_between(_changes(work, k)):
            got = new.joints(on_arc(path.plane[k[r]], path.ccw[k[r]], center[k[r]], c0[r], c1[r], share, xyz), kin, 0.0)
            off = work.off(work.nominal(k[r], share), got, k[r], work.approach_at(k[r], share))
            resolved[k[r][~(off <= LOOSE * allowed)]] = True
    return replace(path, center=center, code=np.where(resolved, FEED, path.code).astype(path.code.dtype)), resolved


def _changes(work: ErrorContext, k: Ints) -> Ints:
    """(N,) stretches of arcs k (N,) in which errors rise or fall."""
    places = [work.nominal(k, np.full(len(k), t)) for t in (0.0, *LOOKS, 1.0)]
    return changes(sum((np.abs(two - one) for one, two in pairwise(places)), np.zeros_like(places[0])),
                   work.detail)


def new_centers(path: JointPath, k: Ints, n0: Floats, n1: Floats, c0: Floats, c1: Floats) -> Floats:
    """Centres (N, 3), relative to the start, of arcs k (N,) whose ends go from words n0, n1 to c0, c1 (N, 3).

    They go as the ends have gone, then to the same distance from both.
    """
    result = path.center[k] + 0.5 * (c1 - n1 - (c0 - n0))
    for plane, (i, j) in PLANE_COLUMNS.items():
        rows = np.flatnonzero(path.plane[k] == plane)
        chord = (c1 - c0)[rows][:, (i, j)]
        length = np.linalg.norm(chord, axis=1)
        open_ = length > 1e-6
        along = chord / np.where(open_, length, 1.0)[:, None]
        off = 0.5 * length - np.sum(result[rows][:, (i, j)] * along, axis=1)
        result[rows[:, None], [i, j]] += np.where(open_, off, 0.0)[:, None] * along
    return result
