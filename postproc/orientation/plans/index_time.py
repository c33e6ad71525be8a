"""What lies between two cuts, in seconds: rapids, and where the axis changes retract, unclamp, index, clamp, approach.

The legs are those of `postproc.path.links`, straight in the joints; where one goes straight on from another,
as the retract axis does above an upright tool, there is no stop between, else each is from rest to rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.machine import ClampCodes, Machine
from postproc.control.rollover import parked
from postproc.feedrate.rest_to_rest import PointToPointMode, rest_seconds
from postproc.joints.joint_path import nearest_solution
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.free_rotary import free_angle
from postproc.orientation.passes.allowed import SAME
from postproc.orientation.passes.passes import Pass, PassContext
from postproc.planning.planned import joint_limits
from postproc.reference.events import tool_changes
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, whole_turns
from toolpaths.shapes import arrays
from toolpaths.units import DEG

_RISE = 10.0
"""mm above the safe plane while indexing, as the links do"""
_SHARES = (1.0, 0.4, 0.2, 0.1)
"""of the clearance margin, tried where travel is short"""
_STRAIGHT = 1e-3
"""change of direction at which a control goes on without a stop"""


@dataclass(frozen=True)
@arrays(axis="3", first="J", last="J", second="J", last_but_one="J", above_first="J", above_last="J")
class PassEnds:
    """A turned pass as its neighbours see it: joints (J,) where it begins, ends and stands above both, and
    the seconds of its own rapids, of coming down and drawing back; inf where no height above is inside
    travel. `held` is where the rotary joint `free` stands that the axis leaves free, NaN and -1 where none
    is. `second`, `last_but_one` are the joints at the other ends of rapids with which it begins and ends,
    `first` and `last` where there are none."""

    axis: Floats
    held: float
    free: int
    first: Floats
    last: Floats
    second: Floats
    last_but_one: Floats
    above_first: Floats
    above_last: Floats
    down: float
    up: float
    rapids: float


def ends(made: Candidate, work: PassContext) -> PassEnds:
    """The ends of a turned pass; its seconds are infinite where the machine cannot run it."""
    return all_ends([made], work)[0]


def all_ends(row: list[Candidate], work: PassContext) -> list[PassEnds]:
    """The ends of one pass turned to several axes."""
    one = row[0].one
    axis = np.stack([one.axes[[0, -1]] if one.fixed else np.tile(made.axis, (2, 1)) for made in row])
    tip = np.stack([(one.tip + one.shift(made.axis))[[0, -1]] for made in row])
    q = np.stack([made.q[[0, -1]] for made in row])
    above = _above(work, one, tip.reshape(-1, 3), axis.reshape(-1, 3), q.reshape(-1, q.shape[2])).reshape(q.shape)
    result, adjacent = [], (int(one.rapid[1:2].any()), -1 - int(one.rapid[-1] and len(one.rapid) > 1))
    for k, made in enumerate(row):
        if made.refused:
            none = np.full(q.shape[2], np.nan)
            result.append(PassEnds(made.axis, made.held, -1, none, none, none, none, none, none, np.inf, np.inf, np.inf))
            continue
        (free, held), (first, last), (above_first, above_last) = free_angle(made), q[k], above[k]
        second, last_but_one = made.q[list(adjacent)]
        result.append(PassEnds(made.axis, held, free, first, last, second, last_but_one, above_first, above_last, 0.0, 0.0,
                               made.rapids))
    return _with_legs(result, work.machine)


def _with_legs(row: list[PassEnds], machine: Machine) -> list[PassEnds]:
    """With the seconds of coming down and drawing back; inf where no height above is inside travel."""
    downs = _adjacent(_links(row, "above_first", "first", "second"), True, machine).tolist()
    ups = _adjacent(_links(row, "last_but_one", "last", "above_last"), False, machine).tolist()
    return [replace(each, down=down, up=up) for each, down, up in zip(row, downs, ups, strict=True)]


def _above(work: PassContext, one: Pass, tip: Floats, axis: Floats, q: Floats) -> Floats:
    """Joints (N, J) above poses on the safe plane; NaN where travel ends."""
    limits, above = work.machine.limits, np.full(q.shape, np.nan)
    for share in _SHARES if work.space.distance is None else (1.0,):
        left = np.flatnonzero(np.isnan(above).any(axis=1) & np.isfinite(q).all(axis=1))
        if not len(left):
            break
        lift = np.array([work.space.plane(a, True, share) + _RISE - float(a @ (t - work.space.centre))
                         for a, t in zip(axis[left], tip[left], strict=True)])
        at = tip[left] + np.maximum(lift, 0.0)[:, None] * axis[left]
        found = nearest_solution(one.kin, at, one.kin.nearest_axis(axis[left]), q[left])
        inside = ((found >= limits.lower - TRAVEL_SLACK) & (found <= limits.upper + TRAVEL_SLACK)).all(axis=1)
        above[left[inside]] = found[inside]
    return above


def links_between(work: PassContext, edge: list[list[PassEnds]]) -> list[Floats]:
    """Seconds between the states of neighbouring passes, from home and back; tool changes with the path to their pass."""
    pause = work.machine.timing.tool_change * _changes(work)
    links = [between(None, edge[0], work, True)]
    for n in range(1, len(edge)):
        links.append(between(edge[n - 1], edge[n], work, work.passes[n].by_home))
    return [link + p for link, p in zip([*links, between(edge[-1], None, work, True)], pause, strict=True)]


def _changes(work: PassContext) -> Floats:
    """Tool changes (N + 1,) that come with each pass, and behind the last row."""
    at = np.searchsorted(work.moves.row, [change.index for change in tool_changes(work.toolpath)])
    starts = [*(one.rows[0] for one in work.passes[1:]), work.passes[-1].rows[1]]
    return np.bincount(np.searchsorted(starts, at, side="right"), minlength=len(starts) + 1).astype(np.float64)


def between(before: list[PassEnds] | None, after: list[PassEnds] | None, work: PassContext,
            by_home: bool) -> Floats:
    """Seconds (K0, K1) from each end to each beginning; None stands for home."""
    machine = work.machine
    if after is None:
        assert before is not None
        return _leaving(before, machine) + _moved(_lifted(before, machine), machine.home[None], machine)
    if before is None or by_home:
        return _by_home(before, after, machine)
    ups, downs = np.array([e.up for e in before])[:, None], np.array([e.down for e in after])[None]
    above = np.stack([e.above_last for e in before])
    linked = ups + _indexed(above, np.stack([e.above_first for e in after]), machine) + downs
    straight = _indexed(np.stack([e.last for e in before]), np.stack([e.first for e in after]), machine)
    turn = angle_between(np.stack([e.axis for e in before])[:, None], np.stack([e.axis for e in after])[None])
    spun = _differ(np.array([e.held for e in before])[:, None], np.array([e.held for e in after])[None])
    result = np.where((turn > work.setup.clearance.link_angle * DEG) | spun, linked, straight)
    if work.setup.clearance.index == "home" and machine.retract_axis >= 0:
        result = np.where(turn > work.setup.clearance.link_angle * DEG,
                          _by_home(before, after, machine), result)
    return np.asarray(result)


def _by_home(before: list[PassEnds] | None, after: list[PassEnds], machine: Machine) -> Floats:
    """Seconds (K0, K1) with the retract axis at home between the two, from home itself where `before` is None."""
    start = machine.home[None] if before is None else _lifted(before, machine)
    left = 0.0 if before is None else _leaving(before, machine)
    above = np.stack([each.above_first for each in after])
    return np.asarray(left + _from_home(start, above, machine) + _arriving(after, machine))


def unwinding(picked: list[PassEnds], work: PassContext, spun: bool) -> float:
    """Seconds that the return home takes longer for joints of endless travel that have been wound up on the
    path, where they do not park at the nearest whole turn (`park = "home"`): from pass to pass they go the shortest path.

    Args:
        spun: False where nothing says the angle of a joint that the axis leaves free, so that it stays where it is
    """
    machine, at = work.machine, work.machine.home
    endless, joints = machine.endless, np.arange(len(machine.home))
    if not endless.any() or not all(np.isfinite(each.above_last).all() for each in picked):
        return 0.0
    for each in picked:
        goes = endless & (spun | (joints != each.free))
        at = np.where(goes, at + _shortest(each.first - at, endless) + each.last - each.first, at)
    begin = _lifted(picked[-1:], machine)
    wound = np.where(endless, at, begin)
    home = parked(machine, [j for j, turns in enumerate(machine.turns) if turns.modulo], wound)
    limits = joint_limits(machine.limits)
    return float(rest_seconds(wound, home, limits, PointToPointMode.STRAIGHT)[0] - _moved(begin, home, machine)[0, 0])


def _lifted(before: list[PassEnds], machine: Machine) -> Floats:
    """Joints (K, J) above each end with the retract axis at home; without such an axis just above."""
    k, result = machine.retract_axis, np.stack([e.above_last for e in before])
    if k >= 0:
        result[:, k] = machine.home[k]
    return result


def _leaving(before: list[PassEnds], machine: Machine) -> Floats:
    """Seconds (K, 1) from each end to above it and on with the retract axis home."""
    link = [*_links(before, "last_but_one", "last", "above_last"), _lifted(before, machine)]
    return _adjacent(link, False, machine)[:, None]


def _arriving(after: list[PassEnds], machine: Machine) -> Floats:
    """Seconds (1, K) of the retract axis from home to above each beginning and on down to it."""
    link = _links(after, "above_first", "first", "second")
    k, begin = machine.retract_axis, link[0].copy()
    if k >= 0:
        begin[:, k] = np.where(np.isfinite(begin[:, k]), machine.home[k], np.nan)
    return _adjacent([begin, *link], True, machine)[None]


def _links(row: list[PassEnds], *names: str) -> list[Floats]:
    """(K, J) joints of each name."""
    return [np.stack([getattr(each, name) for each in row]) for name in names]


def _adjacent(points: list[Floats], behind: bool, machine: Machine) -> Floats:
    """Seconds (K,) through points (K, J) next to the rapid of the pass, the last leg (`behind`) or the first,
    which is counted with the pass."""
    one, other = points[-2:] if behind else points[:2]
    own = _each(one, other, machine)
    return np.asarray(_chained(points, machine) - np.where(np.isfinite(own), own, 0.0))


def _chained(points: list[Floats], machine: Machine) -> Floats:
    """Seconds (K,) through points (K, J), with a stop where the path does not go straight on."""
    start, total = points[0], np.zeros(len(points[0]))
    for at, after in zip(points[1:], [*points[2:], None], strict=True):
        stops = np.ones(len(at), dtype=bool) if after is None else ~_straight_on(at - start, after - at)
        total += np.where(stops, _each(start, at, machine), 0.0)
        start = np.where(stops[:, None], at, start)
    return total


def _straight_on(one: Floats, other: Floats) -> Bools:
    """(K,) where path `other` (K, J) has the direction of `one`, or there is no path."""
    sizes = [np.linalg.norm(link, axis=1, keepdims=True) for link in (one, other)]
    a, b = (link / np.where(size > 0.0, size, 1.0) for link, size in zip((one, other), sizes, strict=True))
    none = (sizes[0] == 0.0) | (sizes[1] == 0.0)
    return np.asarray((none | (np.abs(a - b).max(axis=1, keepdims=True) <= _STRAIGHT))[:, 0])


def _from_home(q0: Floats, q1: Floats, machine: Machine) -> Floats:
    """Seconds (K0, K1): rotary axes, then the slides but the retract axis, as the links go; without one all at once."""
    rotary, last = np.array(machine.rotary), np.arange(q0.shape[1]) == machine.retract_axis
    groups = [rotary, ~rotary & ~last] if last.any() else [np.ones(len(rotary), dtype=bool)]
    return np.asarray(sum(_indexed(np.where(one, q0, 0.0), np.where(one, q1, 0.0), machine) for one in groups))


def _differ(a: Floats, b: Floats) -> Bools:
    """Where held angles differ; none held is another than any."""
    return np.asarray((np.isnan(a) != np.isnan(b)) | (np.abs(np.nan_to_num(a - b)) > SAME))


def _indexed(q0: Floats, q1: Floats, machine: Machine) -> Floats:
    """As `_moved`, with unclamping and clamping where rotary joints turn: at once, but code by code where codes do it."""
    link = _shortest(q1[None] - q0[:, None], machine.endless)
    turns = np.abs(link[..., np.array(machine.rotary)]) > SAME
    letters = [name for name, rotary in zip(machine.axis_names, machine.rotary, strict=True) if rotary]
    codes, seconds = machine.clamp_codes, _moved(q0, q1, machine)
    for group in (*machine.clamp_groups, tuple(name for name in letters if name not in codes)):
        own = [codes.get(name, ClampCodes()) for name in group]
        pause = (len({one.clamp for one in own}) * machine.timing.clamp
                 + len({one.unclamp for one in own}) * machine.timing.unclamp)
        seconds = seconds + np.where(turns[..., [name in group for name in letters]].any(axis=-1), pause, 0.0)
    return np.asarray(seconds)


def _moved(q0: Floats, q1: Floats, machine: Machine) -> Floats:
    """Seconds (K0, K1) from q0 (K0, J) to q1 (K1, J), straight and from rest to rest; inf where either is not finite."""
    shape = (len(q0), len(q1), q0.shape[1])
    pairs = [np.broadcast_to(q, shape).reshape(-1, shape[2]) for q in (q0[:, None], q1[None])]
    return _each(pairs[0], pairs[1], machine).reshape(shape[:2])


def _each(q0: Floats, q1: Floats, machine: Machine) -> Floats:
    """Seconds (K,) as `_moved`, from each of q0 (K, J) to that of q1 (K, J)."""
    link = _shortest(q1 - q0, machine.endless)
    good, seconds = np.isfinite(link).all(axis=1), np.full(len(link), np.inf)
    if good.any():
        seconds[good] = rest_seconds(np.zeros_like(link[good]), link[good], joint_limits(machine.limits),
                                     PointToPointMode.STRAIGHT)
    return seconds


def _shortest(link: Floats, endless: Bools) -> Floats:
    """Paths (..., J), those of endless joints less whole turns."""
    return np.asarray(np.where(endless, link - whole_turns(link), link))
