"""What a fitted model may be off on each kind of motion: the sections of a kind, when the fit has not seen them."""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.kinds import KINDS, NOT_SEEN
from toolpaths.arrays import Bools, Floats

LEAST_SHARE = 0.03
"""of the time of all runs that a kind needs for its sections to say something of it"""
MOSTLY = 0.5
"""share of a section's time in motion that makes it one of the kind"""
KEPT = 0.12
"""share of NOT_SEEN that stays of a kind that the runs hold: what no run shows (another feed, another turn of corners)"""
LARGE = 3.0
"""uncertainties of a section beyond which its error counts less and less, as in the fit (`soft_l1`)"""
STEP = 2.0
"""prior deviations that parameters may move when sections are left out: beyond, the model is no straight line of them"""


def structure(measured: Floats, modelled: Floats, by_kind: Floats, weighted: Floats, uncertainty: Floats,
              moved: Floats) -> dict[str, float]:
    """Standard deviation of the time over the model's by kind of motion, as a share.

    Args:
        measured, modelled (K,): s of the sections; by_kind (K, KINDS): s of them in motion by kind
        weighted (K, F): derivatives by the parameters, in prior deviations, over the sections' uncertainties (K,), s
        moved (F,): by how many prior deviations the fit has moved the parameters

    Of a kind that the runs hold: half of what its sections are off when the fit leaves them out (they are not left out of
    the model that is used), or what they are off in the fit. Of another: NOT_SEEN.
    """
    share = by_kind / np.maximum(by_kind.sum(axis=1), 1e-9)[:, None]
    of_all = by_kind.sum(axis=0) / max(float(by_kind.sum()), 1e-9)
    result: dict[str, float] = {}
    for k, name in enumerate(KINDS):
        rows = share[:, k] > MOSTLY
        if of_all[k] < LEAST_SHARE or not rows.any():
            continue
        own = abs(float((modelled - measured)[rows].sum())) / float(np.maximum(measured[rows].sum(), 1e-9))
        missed = _missed(measured, modelled, weighted, uncertainty, moved, rows) if not rows.all() else own
        result[name] = float(np.hypot(KEPT * NOT_SEEN[name], max(own, 0.5 * missed)))
    return {name: result.get(name, NOT_SEEN[name]) for name in KINDS}


def _missed(measured: Floats, modelled: Floats, weighted: Floats, uncertainty: Floats, moved: Floats,
            rows: Bools) -> float:
    """Error of the sections of a kind under the parameters that the other sections give, as a share of their time: as far
    as it is more than two standard deviations of those parameters explain.

    One step of Gauss and Newton for the others and the prior alone: (J'J + 1)^-1 (J'r + x) of what they are off. The sum of
    all sections' gradients is 0 but for the rounding of cycles; sections that hold nearly everything would turn that rest
    into steps of many deviations.
    """
    off = (modelled - measured) / uncertainty
    robust = (1.0 + (off / LARGE) ** 2) ** -0.25
    others, missed = (weighted * robust[:, None])[~rows], (off * robust)[~rows]
    one = np.eye(weighted.shape[1])
    step = np.clip(-np.linalg.solve(others.T @ others + one, others.T @ missed + moved), -STEP, STEP)
    remaining = np.linalg.inv(0.5 * others.T @ others + one)
    error = modelled[rows] - measured[rows] + (weighted[rows] @ step) * uncertainty[rows]
    of_sum = uncertainty[rows] @ weighted[rows]
    explained = float(of_sum @ remaining @ of_sum) + float((uncertainty[rows] ** 2).sum())
    return max(abs(float(error.sum())) - 2.0 * float(np.sqrt(explained)), 0.0) / max(float(measured[rows].sum()), 1e-9)
