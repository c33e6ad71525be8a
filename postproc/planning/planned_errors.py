"""Passes as the joints go when geometric errors are corrected: what is planned is what the axes do."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.model import ErrorModel
from machines.kinematics.base import Kinematics
from postproc.correction.error_sampling import changes
from postproc.path.model import JointPath
from postproc.planning.geometry import MachinePath
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from postproc.correction.compensation import ErrorCorrection
    from postproc.job.job import Job

SEEN = 3.0
"""sites while an error runs one direction, at least"""
STANDS = 1e-9
"""rad that rotary joints of one orientation may differ by"""


@dataclass(frozen=True)
@arrays(owner="K")
class PlannedCorrection:
    """How a conversion corrects its path.

    Attributes:
        errors: the machine's; axes that lose motion count by the mean of both directions: what they take up
            where they turn back is no part of the plan
        corrected: the path; owner (K,): the block of the nominal path that each of its blocks is of
        axis_tolerance: rad
    """

    errors: ErrorModel
    corrected: JointPath
    owner: Ints
    axis_tolerance: float

    def of(self, paths: list[MachinePath], kin: Kinematics, block: list[int]) -> list[MachinePath]:
        """The paths with corrected joints at their sites; `block` of the nominal path is one of each.

        Where the tool axis stands still the rotary joints are those that are written there.
        """
        if not paths:
            return []
        rotary = np.array(kin.rotary)
        s = [self._sites(one, kin.axis_names) for one in paths]
        q = [one.fitted(own) for one, own in zip(paths, s, strict=True)]
        still = [not rotary.any() or bool(np.ptp(own[:, rotary], axis=0).max() <= STANDS) for own in q]
        near = np.concatenate([np.stack([np.interp(own, one.s, column) for column in one.values[:, -6:].T], axis=1)
                               for one, own in zip(paths, s, strict=True)])
        tip, axis = kin.forward(np.concatenate(q), near=near)
        written = np.searchsorted(self.owner, block, side="right") - 1
        for k in np.flatnonzero(still).tolist():
            q[k] = np.where(rotary, self.corrected.q[written[k]], q[k])
        found, turn = np.concatenate(q), ~np.repeat(still, [len(own) for own in q])
        actual = self.errors.on(kin)
        for rows, turns in ((np.flatnonzero(turn), True), (np.flatnonzero(~turn), False)):
            if len(rows):
                found[rows] = correct(actual, found[rows], tip[rows], axis[rows], turn=turns,
                                      axis_tolerance=self.axis_tolerance, beyond=True).q
        parts: list[Floats] = np.split(np.hstack([found, tip, axis]), np.cumsum([len(own) for own in q])[:-1])
        return [one if not np.isfinite(values).all() else replace(
            MachinePath.through(at, values, one.led[np.searchsorted(one.s, at, side="right") - 1]), worst=one.worst)
                for one, at, values in zip(paths, s, parts, strict=True)]

    def _sites(self, one: MachinePath, names: tuple[str, ...]) -> Floats:
        """The sites of a path, and so many between that no error changes its course unseen."""
        step = np.diff(one.values[:, :len(names)], axis=0)
        count = changes(SEEN * step, self.errors.detail(names))
        first = np.repeat(one.s[:-1], count)
        share = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)) / np.repeat(count, count)
        return np.append(first + share * np.repeat(np.diff(one.s), count), one.s[-1])


def planned_correction(job: Job, found: ErrorCorrection | None, path: JointPath) -> PlannedCorrection | None:
    """How the joints of a conversion's passes are corrected, `path` being the corrected one; None where they are not."""
    if job.errors is None or found is None:
        return None
    return PlannedCorrection(job.errors, path, found.owner, job.axis_tolerance)


def on_written(found: ErrorCorrection | None, seconds: Floats) -> Floats:
    """Seconds of the planned blocks on the blocks that are written; those of corrected ones are parts of nominal ones."""
    return seconds if found is None else np.asarray(seconds[found.owner] * found.part)
