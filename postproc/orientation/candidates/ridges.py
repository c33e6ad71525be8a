"""Axes of greatest reach at every tilt: where a vertex itself is outside travel or limits, or touches
something, the best that is left lies on such a ridge, which steps in tilt or azimuth alone do not follow. And
axes in narrow windows of limits.
"""

from __future__ import annotations

import numpy as np

from machines.machine import Machine
from machines.polytope import held_axis_polytope
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.initial_axes import across, sharpest
from postproc.orientation.candidates.search import CandidateSearch
from postproc.orientation.passes.passes import Pass
from toolpaths.arrays import Floats, Ints
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

_RING = 5.0 * DEG
_FINER = 8
"""parts of the last step of tilt"""
_AZIMUTHS = 72
_PARTS = np.linspace(-1.0, 1.0, 11)
_LEVELS = 3
"""of refinement, each to a fifth"""
_LATTICES = (4.0 * DEG, 2.0 * DEG, 1.0 * DEG, 0.5 * DEG)
_SOME = 12
_LEAST = 1.01
"""reach that the best of a ring must have next to the CL's own axis to be worth anything"""


def best_on_ridge(search: CandidateSearch, best: Candidate) -> Candidate:
    """The best of a candidate and of axes on ridges, ever farther from the CL's own axis, then finer where
    that ended; where that finds nothing, of axes that lead and tilt allow."""
    one, allowed = search.one, search.allowed
    tilt = 0.5 * np.pi if len(one.contact) else min(allowed.tilt, 0.5 * np.pi)
    rings = tilt * np.arange(1, max(1, int(np.ceil(tilt / _RING))) + 1) / max(1, int(np.ceil(tilt / _RING)))
    before, best = best, _best_of(search, best, rings)
    if best is before:
        return _in_window(search, best) if best is search.own and allowed.limits.need_normals else best
    reached = float(angle_between(best.axis, one.axis))
    return _best_of(search, best, reached + rings[0] * np.arange(1, _FINER) / _FINER)


def _best_of(search: CandidateSearch, best: Candidate, rings: Floats) -> Candidate:
    axes = ridge_axes(search.one, search.machine, rings)
    return _better(search, best, axes[search.allowed.mask(search.one, axes)])


def _in_window(search: CandidateSearch, best: Candidate) -> Candidate:
    """The best of a candidate and of some allowed axes, from the coarsest lattice that has any."""
    for apart in _LATTICES:
        axes = search.allowed.among(search.one, apart)
        if len(axes):
            some = np.unique(np.linspace(0, len(axes) - 1, min(len(axes), _SOME)).astype(np.int64))
            return _better(search, best, search.one.kin.nearest_axis(axes[some]))
    return best


def _better(search: CandidateSearch, best: Candidate, axes: Floats) -> Candidate:
    for made in sorted(search.add(axes), key=lambda made: made.bound):
        best = search.better(best, made)
    return best


def ridge_axes(one: Pass, machine: Machine, rings: Floats) -> Floats:
    """The axes (S, 3) at tilts `rings` (R,) rad from that of the CL file whose reach along the mean direction is greatest.

    A ring has as many as its reach has peaks over the azimuth; each is found to some hundredths of a degree.
    """
    stretch = one.longest
    direction = None if stretch is None else stretch.directions().get("mean")
    if direction is None or not any(machine.rotary):
        return np.zeros((0, 3))
    azimuth = np.arange(_AZIMUTHS) * 2.0 * np.pi / _AZIMUTHS
    reach = _reach(one, machine, direction, *(g.ravel() for g in np.meshgrid(rings, azimuth, indexing="ij")))
    own = _reach(one, machine, direction, np.zeros(1), np.zeros(1))[0]
    ring, peak = _peaks(reach.reshape(len(rings), _AZIMUTHS), _LEAST * own)
    at, span = azimuth[peak], 2.0 * np.pi / _AZIMUTHS
    for _ in range(_LEVELS if len(at) else 0):
        tried = at[:, None] + span * _PARTS
        found = _reach(one, machine, direction, np.repeat(rings[ring], len(_PARTS)), tried.ravel()).reshape(tried.shape)
        at, span = tried[np.arange(len(at)), found.argmax(axis=1)], span / 5.0
    return _axes(one, rings[ring], at)


def _peaks(reach: Floats, least: float) -> tuple[Ints, Ints]:
    """(ring, azimuth) of those that no neighbour in their ring exceeds, and that reach far enough."""
    best = (reach >= np.roll(reach, 1, axis=1)) & (reach > np.roll(reach, -1, axis=1)) & (reach > max(least, 0.0))
    ring, azimuth = np.nonzero(best)
    return ring, azimuth


def _axes(one: Pass, tilt: Floats, azimuth: Floats) -> Floats:
    """Axes (N, 3) that the machine can take, at tilts and azimuths (N,) about that of the CL file."""
    x, y = across(one.axis)
    flat = np.cos(azimuth)[:, None] * x + np.sin(azimuth)[:, None] * y
    return one.kin.nearest_axis(np.cos(tilt)[:, None] * one.axis + np.sin(tilt)[:, None] * flat)


def _reach(one: Pass, machine: Machine, direction: Floats, tilt: Floats, azimuth: Floats) -> Floats:
    """Reach (N,) in the middle of the pass, the best of the branches; -1 where there is none."""
    stretch, axes = one.longest, _axes(one, tilt, azimuth)
    if stretch is None:
        return np.full(len(axes), -1.0)
    tip = stretch.tip[len(stretch.tip) // 2] + one.radius * (one.axis - axes)
    pose = np.hstack((tip, axes))
    found = [held_axis_polytope(one.kin, q, sharpest(machine), pose).reach(direction)
             for q in one.kin.inverse(tip, axes, near=machine.home)]
    return np.asarray(np.nan_to_num(np.stack(found), nan=-1.0).max(axis=0))
