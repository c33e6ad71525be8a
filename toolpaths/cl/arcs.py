"""Circle records to arcs: sense, whole turns, the height of the centre, and what does not fit."""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.toolpath import Arcs

UNIT_EXACT = 1e-14
"""a vector this near to unit length is left as written"""
UNIT_ROUNDING = 2e-3
"""a direction may be this far from unit length; more is an error"""
RADIUS_WARNING = 0.01
RADIUS_ERROR = 0.1
SAME_POINT = 2e-5
"""mm: ends this near count as one point where a system means a whole turn"""
ROUNDING = 2e-3
"""mm: an end this near to its start is there by rounding: where a system writes no whole circles and it lies
behind the start; where it does and the arc is a helix"""
_STEEP = 10.0
"""a helix that ends above its start and rises more than this times the chord between them makes a whole turn"""
_SENSE_LEAST, _SENSE_ALL = 8, 3
"""so many arcs of which most, or so many that all, sweep more than half a turn are reported"""
_TURN = 2.0 * math.pi
_MOST_TURNS = 10000
"""an arc of more turns is no arc that anybody cuts"""


@dataclass
class ArcTable:
    """K circle records in file units and local frame: row of the arc's end, (center, direction) as 6 numbers,
    radius (NaN where not written), whole turns, sense (+1 right-hand), sweep (rad, NaN where not written), line."""

    row: list[int] = field(default_factory=list)
    numbers: list[tuple[float, ...]] = field(default_factory=list)
    radius: list[float] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    sense: list[int] = field(default_factory=list)
    sweep: list[float] = field(default_factory=list)
    line: list[int] = field(default_factory=list)
    toward: dict[int, tuple[float, ...]] = field(default_factory=dict)
    """by record: the direction at the start, where it decides the sense"""

    def add(self, row: int, numbers: tuple[float, ...], line: int, radius: float = math.nan, times: float = 0.0,
            sense: int = 1, sweep: float = math.nan) -> None:
        """One record."""
        self.row.append(row)
        self.numbers.append(numbers)
        self.radius.append(radius)
        self.times.append(times)
        self.sense.append(sense)
        self.sweep.append(sweep)
        self.line.append(line)


@dataclass(frozen=True)
@arrays(start="K 3", end="K 3", center="K 3", normal="K 3", radius="K", times="K", sweep="K", line="K")
class CircleRecords:
    """The same as arrays in mm and the part frame, one per arc (K rows); start and end are tips (K, 3)."""

    start: Floats
    end: Floats
    center: Floats
    normal: Floats
    radius: Floats
    times: Floats
    sweep: Floats
    line: Ints


def unit(vectors: Floats) -> Floats:
    """`vectors` (N, 3) at length 1; those within 1e-14 of it keep their bits."""
    norm = np.linalg.norm(vectors, axis=1)
    off = np.abs(norm - 1.0) > UNIT_EXACT
    if not off.any():
        return vectors
    result = vectors.copy()
    with np.errstate(invalid="ignore", divide="ignore"):
        result[off] /= norm[off, None]
    return result


def arcs_of(r: CircleRecords, full_circles: bool, log: DiagnosticLog) -> Arcs:
    """Arcs of the records; a fault is logged with its line. `full_circles`: start = end is a whole turn."""
    normal = _normals(r, log)
    height = np.einsum("ki,ki->k", r.start - r.center, normal)
    exact = ~np.isnan(r.sweep)
    center = np.where((exact | (height == 0.0))[:, None], r.center, r.center + height[:, None] * normal)
    u, v = r.start - center, r.end - center
    v = v - np.einsum("ki,ki->k", v, normal)[:, None] * normal
    radius = np.linalg.norm(u, axis=1)
    sweep, back = _sweep(u, v, normal, r, full_circles, log)
    normal = np.where(back[:, None], -normal, normal)
    _check_radius(radius, np.linalg.norm(v, axis=1), r, log)
    radius = np.where(exact & (np.abs(radius - r.radius) < RADIUS_ERROR), r.radius, radius)
    _check_sense(sweep[~exact], r.line[~exact], log)
    return Arcs(center, normal, radius, sweep)


def _normals(r: CircleRecords, log: DiagnosticLog) -> Floats:
    norm = np.linalg.norm(r.normal, axis=1)
    for k in np.flatnonzero(np.abs(norm - 1.0) > UNIT_ROUNDING):
        log.error("cl.arc-axis", f"the axis of the circle has length {norm[k]:.4g}, it must be 1", int(r.line[k]),
                  "give the axis as a unit vector (length 1)")
    return np.where((norm > 0.0)[:, None], unit(r.normal), [0.0, 0.0, 1.0])


def _sweep(u: Floats, v: Floats, normal: Floats, r: CircleRecords, full_circles: bool,
           log: DiagnosticLog) -> tuple[Floats, Bools]:
    """Angle from u to v about the normal in (0, 2 pi], whole turns added; a written sweep is checked and kept.

    Second: arcs that end behind their start by rounding, where no whole circles are written; they go back that path.
    """
    angle = np.arctan2(np.einsum("ki,ki->k", np.cross(u, v), normal), np.einsum("ki,ki->k", u, v))
    angle = np.where(angle < 0.0, angle + _TURN, angle)
    chord = np.linalg.norm(u - v, axis=1)
    near = chord <= (SAME_POINT if full_circles else ROUNDING)
    whole = r.times > 0.0
    behind = near & (angle > math.pi)
    angle = np.where(whole & behind, angle - _TURN, angle)
    back = near & behind & ~whole & np.isnan(r.sweep) & (not full_circles)
    if full_circles:
        angle = np.where(near & ~whole, _TURN, angle)
        steep = np.abs(np.einsum("ki,ki->k", r.end - r.start, normal)) > _STEEP * chord
        turn = steep & (chord <= ROUNDING) & (angle < math.pi) & ~whole & np.isnan(r.sweep)
        angle = np.where(turn, angle + _TURN, angle)
    else:
        for k in np.flatnonzero(back):
            log.warning("cl.arc-back", f"the arc ends {chord[k]:.2g} mm behind its start; by rounding, so no whole circle "
                        "is made", int(r.line[k]), "give whole turns with TIMES,n")
        angle = np.where(back, _TURN - angle, angle)
        for k in np.flatnonzero(~whole & near & (angle == 0.0) & np.isnan(r.sweep)):
            log.error("cl.arc-ends", "the arc ends where it starts, and this system does not write whole circles",
                      int(r.line[k]), "give the whole turns with TIMES,n")
    angle = angle + _TURN * r.times
    for k in np.flatnonzero(~np.isnan(r.sweep)):
        _check_written(float(angle[k]), float(r.sweep[k]), float(np.linalg.norm(u[k])), int(r.line[k]), log)
    angle = np.where(np.isnan(r.sweep), angle, r.sweep)
    for k in np.flatnonzero(angle > _TURN * (_MOST_TURNS + 1)):
        log.error("cl.circle-times", f"an arc of {angle[k] / _TURN:.6g} turns; at most {_MOST_TURNS} are read",
                  int(r.line[k]), f"divide the arc: at most {_MOST_TURNS} turns in one record")
    return angle, back


def _check_written(angle: float, sweep: float, radius: float, line: int, log: DiagnosticLog) -> None:
    miss = abs(math.remainder(angle - sweep, _TURN)) * radius
    if not sweep > 0.0 or miss > RADIUS_ERROR:
        log.error("cl.arc-sweep", f"a sweep of {math.degrees(sweep):.6g} degrees misses the end of the arc by "
                  f"{miss:.3g} mm", line, "correct the angle, or the GOTO that ends the arc")


def _check_radius(start: Floats, end: Floats, r: CircleRecords, log: DiagnosticLog) -> None:
    for k in np.flatnonzero(start == 0.0):
        log.error("cl.arc-radius", "the arc starts at its centre", int(r.line[k]),
                  "correct the centre, or the point before the arc")
    miss = np.maximum(np.abs(start - end), np.nan_to_num(np.abs(start - r.radius)))
    for k in np.flatnonzero((miss > RADIUS_WARNING) & (start > 0.0)):
        bad = miss[k] > RADIUS_ERROR
        given = "" if math.isnan(r.radius[k]) else f", {r.radius[k]:.4f} mm as written"
        (log.error if bad else log.warning)(
            "cl.arc-radius", f"start and end of the arc are {start[k]:.4f} and {end[k]:.4f} mm from its axis{given}; "
            f"{RADIUS_ERROR if bad else RADIUS_WARNING} mm of difference is allowed", int(r.line[k]),
                "correct the centre or the end of the arc, or have the CAM system write points")


def _check_sense(sweep: Floats, line: Ints, log: DiagnosticLog) -> None:
    long = sweep % _TURN > math.pi + 1e-3
    if (len(sweep) >= _SENSE_LEAST and long.sum() > 0.5 * len(sweep)) or (len(sweep) >= _SENSE_ALL and long.all()):
        log.warning("cl.arc-sense", f"{int(long.sum())} of {len(sweep)} arcs sweep more than 180 degrees: the "
                    "direction of circles is likely that of another system", int(line[long][0]), "name it with --dialect")
