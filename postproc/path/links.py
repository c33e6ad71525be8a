"""Linking moves: retract along the tool axis to the safe plane, index, approach along the new tool axis.

A safe plane stands square to the tool axis at a distance from the centre of the part. A linking move is clear
while the tool is above everything that is cut, seen along its own axis, or its axis line misses the sphere round all that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import postproc.path.reach as reach
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.control.control import Control
from postproc.joints.joint_path import nearest_solution
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.path.linearise import linearise
from postproc.reference.moves import Moves
from postproc.setup.model import Placement, SetupFile
from toolpaths.arrays import Bools, Floats, Ints, box_corners
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind

RISE = 10.0
"""mm above the safe plane for index moves, so that their dips stay above it"""
MARGINS = (1.0, 0.4, 0.2, 0.1)
"""shares of the set-up's margin that are tried where travel is short"""
_STEPS = (0, 1, 3, 7, 15)
SAMPLES = 17
_TURN = 2.0 * np.pi
LEG_TOLERANCE = 0.01
"""mm off the straight line for retract and approach"""
_STANDS = 1e-12
"""rad: what the inverse rounds at the end of a leg; a turn below it moves no tip by as much as is measured here"""


@dataclass(frozen=True)
@arrays(centre="3", corners="8 3", centres="P 3")
class SafeSpace:
    """Centre (3,) of the part in the table frame, radius about it and box (8, 3) of all that is cut, distances in mm.

    `centres` (P, 3): of the part at each place, from which `distance` counts.
    """

    centre: Floats
    radius: float
    corners: Floats
    distance: float | None
    margin: float
    centres: Floats
    in_plane: bool = False
    """linking moves may go straight in the plane that the machine never leaves"""
    lower: str = ""
    """what brings linking moves down, in words"""

    def plane(self, axis: Floats, turning: bool, share: float) -> float:
        """Distance of the safe plane square to `axis` from the centre; `share` of the margin."""
        return float(self.planes(axis[None], np.array([turning]), share)[0])

    def planes(self, axis: Floats, turning: Bools, share: float = 1.0) -> Floats:
        """The same (N,) of directions (N, 3). Where a distance is given: the highest of the planes of all places."""
        corners = self.corners if self.distance is None else self.centres
        height = np.max(axis @ (corners - self.centre).T, axis=1)
        return height + self.distance if self.distance is not None else np.where(
            turning, self.radius, height) + share * self.margin

    def clear(self, tip: Floats, axis: Floats, margin: float) -> Bools:
        """(N,) True where the tool, a half line from its tip along its axis, stays `margin` mm off the path's extent."""
        return np.asarray(self.room(tip, axis) >= margin)

    def room(self, tip: Floats, axis: Floats) -> Floats:
        """(N,) mm that the tool is off the path's extent; negative inside."""
        offset = tip - self.centre
        height = np.einsum("ni,ni->n", offset, axis)
        above = height - ((self.corners - self.centre) @ axis.T).max(axis=0)
        nearest = np.sqrt(np.maximum((offset**2).sum(axis=1) - np.minimum(height, 0.0) ** 2, 0.0))
        return np.asarray(np.maximum(above, nearest - self.radius))


def safe_space(moves: Moves, setup: SetupFile, placement: Placement, place: Ints | None = None) -> SafeSpace:
    """The safe planes of a path (already in the table frame); what is only passed in rapid does not count.

    `place` (M,): number of the place of each move, where there are several.
    """
    tips = _cut(moves, slice(None))
    low, high = tips.min(axis=0), tips.max(axis=0)
    centre = 0.5 * (low + high)
    if setup.clearance.centre is not None:
        centre = placement.points(np.array([setup.clearance.centre]))[0]
    radius = float(np.sqrt(((tips - centre) ** 2).sum(axis=1).max()))
    centres = centre[None]
    if place is not None:
        centres = np.array([[0.5 * (x.min() + x.max()) for x in _cut(moves, np.flatnonzero(place == k)).T]
                            for k in np.unique(place)])
    return SafeSpace(centre, radius, box_corners(low, high), setup.clearance.distance, setup.clearance.margin, centres,
                     setup.clearance.in_plane, setup.clearance.lower)


def _cut(moves: Moves, rows: Ints | slice) -> Floats:
    """(K, 3) tips of what is cut by some rows, and the places where its arcs are outermost."""
    cutting = moves.kind != Kind.RAPID
    starts = cutting & ~moves.link
    used = (cutting | np.append(starts[1:], False))[rows]
    tips = moves.tip[rows]
    tips = tips[used] if used.any() else tips
    return np.concatenate([tips, _outermost(moves.curves(rows))]) if len(moves.arcs) else tips


def _outermost(curves: Curves) -> Floats:
    """(K, 3) places of the arcs where x, y or z is greatest or least, in their first turn and in their last.

    Seen from the centre the tip is r cos t + (n x r) sin t, whose coordinate k turns back at atan2((n x r)_k,
    r_k) and half a turn on; whole circles count only as far as the arc goes.
    """
    arcs = curves.take(np.flatnonzero(curves.is_arc))
    radial = arcs.start - arcs.center
    radial = radial - np.einsum("ni,ni->n", radial, arcs.normal)[:, None] * arcs.normal
    across = np.cross(arcs.normal, radial)
    found = [np.zeros((0, 3))]
    for k, half in ((k, half) for k in range(3) for half in (0.0, np.pi)):
        first = (np.arctan2(across[:, k], radial[:, k]) + half) % _TURN
        last = first + _TURN * np.floor((arcs.sweep - first) / _TURN)
        for angle in (first, last):
            inside = np.flatnonzero((angle >= 0.0) & (angle <= arcs.sweep))
            found.append(arcs.take(inside).at(angle[inside] / arcs.sweep[inside])[0])
    return np.concatenate(found)


@dataclass(frozen=True)
@arrays(retract="R J", home="H J", index="I J", approach="A J", home_state="H J", index_state="I J")
class Link:
    """Joints (K, J) of the four parts of a linking move.

    `retract` along the tool axis, `home` in machine coordinates (tool change, end of program), `index` to
    above the new pose, `approach` along the tool axis down to it. `home_state`, `index_state` (K, J) mark
    axes that a block must state even where they stand already (after a tool change nobody knows where the axes are).
    """

    retract: Floats
    home: Floats
    index: Floats
    approach: Floats
    home_state: Bools
    index_state: Bools
    clear: bool
    """False where no path above the safe planes was found"""


@dataclass(frozen=True)
@arrays(tip="3", axis="3", q="J")
class Pose:
    """A pose with its joints; `law` is the control under which the tool leaves it or comes to it along its axis."""

    tip: Floats
    axis: Floats
    q: Floats
    law: Control | None = None


def plan_link(control: Control, kin0: Kinematics, kin1: Kinematics, space: SafeSpace, before: Pose | None,
              after: Pose | None, by_home: bool, turning: bool | None = None) -> Link:
    """The path from pose `before` (None: at home) to above pose `after` (None: home), with the tools of kin0, kin1.

    `control` is under the law of the path between the safe planes; retract and approach go by the law of
    their pose. Where travel is too short for any, the first is returned: the travel check then names the axis
    and the value. `turning` says whether the part turns under the tool on the path; by itself where the tool
    axis is another.
    """
    if turning is None:
        turning = before is None or after is None or bool(angle_between(before.axis, after.axis) > 1e-9)
    links = []
    for share in MARGINS if space.distance is None else (1.0,):
        links.append(link := _link(control, kin0, kin1, space, before, after, by_home, turning, share))
        q = np.concatenate([link.retract, link.index, link.approach])
        if link.clear and np.isfinite(q).all() and _inside(q, control.machine):
            return link
    first = links[0]
    reached = np.concatenate([first.retract, first.index, first.approach])
    if np.isfinite(reached).all() and not _inside(reached, control.machine):
        return replace(first, clear=True)
    return first


def _inside(q: Floats, machine: Machine) -> bool:
    """True where joints (N, J) are inside travel and inside the reach of a parallel machine."""
    limits = machine.limits
    if not bool(((q >= limits.lower - TRAVEL_SLACK) & (q <= limits.upper + TRAVEL_SLACK)).all()):
        return False
    return not len(q) or not reach.is_checked(machine.kinematics) or reach.inside(machine.kinematics, q)


def _link(control: Control, kin0: Kinematics, kin1: Kinematics, space: SafeSpace, before: Pose | None,
          after: Pose | None, by_home: bool, turning: bool, share: float) -> Link:
    if kin1.plane is not None:
        return _in_plane(control, kin0, kin1, space, before, after, by_home)
    none = np.zeros((0, kin0.joints))
    up0 = _above(control.machine, kin0, space, before, turning, share) if before is not None else None
    up1 = _above(control.machine, kin1, space, after, turning, share) if after is not None else None
    retract = none if before is None or up0 is None else _leg(before.law or control, kin0, before, up0)
    approach = none if after is None or up1 is None else _leg(after.law or control, kin1, up1, after)
    slack = 0.5 * share * space.margin
    home, home_state, travel = none, none > 0.0, True
    if by_home and has_retract_axis(control):
        home, home_state = _lift_home(control, up0, after is None)
    elif by_home:
        home, travel = _all_home(control, kin0, space, up0, share, slack)
        home_state = np.ones(home.shape, dtype=bool)
    if up1 is None:
        return Link(retract, home, none, none, home_state, none > 0.0, travel)
    if by_home and has_retract_axis(control):
        index, state = _from_home(control, home[-1], up1)
        clear = stays_clear(control, kin1, space, np.concatenate([home[-1:], index]), slack)
        return Link(retract, home, index, approach, home_state, state, clear)
    begin = home[-1] if by_home else up0.q if up0 is not None else control.machine.home
    index, clear = _index(control, kin1, space, begin, up1, space.plane(up1.axis, turning, share), slack)
    return Link(retract, home, index, approach, home_state, np.full(index.shape, by_home), clear and travel)


def _in_plane(control: Control, kin0: Kinematics, kin1: Kinematics, space: SafeSpace, before: Pose | None,
              after: Pose | None, by_home: bool) -> Link:
    """The path of a machine that cannot lift the tool: the tip straight in its plane, by home where asked for."""
    none = np.zeros((0, kin0.joints))
    retract = home = index = none
    if by_home:
        home = (control.machine.home if before is None else control.parked(before.q))[None]
        retract = none if before is None else _leg(control, kin0, before, _standing(kin0, home[0]))[:-1]
    if after is not None:
        start = before if before is not None and not by_home else _standing(
            kin1, home[0] if len(home) else control.machine.home)
        index = _leg(control, kin1, start, after)
    return Link(retract, home, index, none, np.ones(home.shape, dtype=bool), np.zeros(index.shape, dtype=bool),
                space.in_plane)


def _standing(kin: Kinematics, q: Floats) -> Pose:
    tip, axis = kin.forward(q[None])
    return Pose(tip[0], axis[0], q)


def _carried_there(machine: Machine, kin: Kinematics, tip: Floats, axis: Floats, near: Floats) -> Floats:
    """Joints (N, J) of poses, the nearest to `near` (N, J); where a platform on redundant carriers would leave its
    workspace, they go to where it rests, or half as far."""
    q = nearest_solution(kin, tip, axis, near)
    open_to = [name in kin.axis_names for name in kin.open_parameters]
    if not any(open_to) or _inside(q, machine):
        return q
    stands, rests = kin.parameters_at(near), kin.parameters_at(kin.inverse(tip, axis)[0])
    for share in (0.5, 1.0):
        other = kin.inverse_with(tip, axis, np.where(open_to, stands + share * (rests - stands), stands))[0]
        if _inside(other, machine):
            return np.asarray(other)
    return q


def _above(machine: Machine, kin: Kinematics, space: SafeSpace, pose: Pose, turning: bool, share: float) -> Pose:
    """The pose lifted along its tool axis to its safe plane; left where it is already above."""
    rise = RISE if turning else 0.0
    lift = space.plane(pose.axis, turning, share) + rise - float(pose.axis @ (pose.tip - space.centre))
    tip = pose.tip + max(lift, 0.0) * pose.axis
    if pose.law is not None and pose.law.law == "tilted":
        q = kin.at_tip(tip[None, :], pose.q[None, :], pose.law.slides)[0]
    else:
        q = _carried_there(machine, kin, tip[None, :], pose.axis[None, :], pose.q[None, :])[0]
    return Pose(tip, pose.axis, q, pose.law)


def _leg(control: Control, kin: Kinematics, start: Pose, end: Pose) -> Floats:
    """Joints from one pose to another on the same tool axis, tip on the straight line between; none where equal."""
    if bool((start.q == end.q).all()):
        return np.zeros((0, len(end.q)))
    if control.tip_law or kin.straight_slides:
        turned = np.abs(end.q - start.q)[np.array(kin.rotary) | np.array(kin.turns_tool)]
        if not len(turned) or turned.max() < _STANDS:
            return end.q[None]
    line = Curves(start.tip[None], end.tip[None], start.axis[None], end.axis[None], np.zeros(1, dtype=bool),
                  np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1))
    return linearise(control, kin, line, start.q[None], end.q[None], np.zeros(1, dtype=bool), LEG_TOLERANCE, 1e-3).q


def has_retract_axis(control: Control) -> bool:
    """True where one axis lifts the tool on its travel home."""
    return control.machine.retract_axis >= 0 and not control.tip_law


def _all_home(control: Control, kin: Kinematics, space: SafeSpace, up: Pose | None, share: float,
              slack: float) -> tuple[Floats, bool]:
    """All axes home at once, clear of the part, on machines without an axis that lifts the tool by itself."""
    home = control.machine.home if up is None else control.parked(up.q)
    if up is None:
        return home[None, :], True
    tip, axis = kin.forward(home[None, :])
    return _index(control, kin, space, up.q, Pose(tip[0], axis[0], home),
                  space.plane(axis[0], True, share), slack)


def _lift_home(control: Control, up: Pose | None, whole: bool) -> tuple[Floats, Bools]:
    """From above the part to home: the retract axis first, then, at the end of a program, the rest."""
    machine = control.machine
    lifted = (machine.home if up is None else up.q).copy()
    lifted[machine.retract_axis] = machine.home[machine.retract_axis]
    state = np.zeros((2, len(lifted)), dtype=bool)
    state[0, machine.retract_axis] = True
    state[1] = ~state[0]
    count = 2 if whole else 1
    return np.stack([lifted, control.parked(lifted)])[:count], state[:count]


def _from_home(control: Control, begin: Floats, up: Pose) -> tuple[Floats, Bools]:
    """Rotary axes, then the slides but the retract axis, then that one; each stated."""
    last = control.machine.retract_axis
    turned, moved = begin.copy(), up.q.copy()
    turned[control.rotary] = up.q[control.rotary]
    moved[last] = begin[last]
    rotary = np.array(control.machine.rotary)
    lifting = np.arange(len(begin)) == last
    steps = [(turned, rotary), (moved, ~rotary & ~lifting), (up.q, lifting)]
    kept = [(q, state) for q, state in steps if state.any()]
    return np.stack([q for q, _ in kept]), np.stack([state for _, state in kept])


def _index(control: Control, kin: Kinematics, space: SafeSpace, begin: Floats, up: Pose, floor: float,
           slack: float) -> tuple[Floats, bool]:
    """Joints from `begin` to the pose above, through points over the centre where the straight path comes too near."""
    lifted = _lifted(control.machine, kin, space, begin, floor, slack)
    for count in _STEPS:
        t = np.arange(1, count + 1) / (count + 1)
        near = begin + t[:, None] * (up.q - begin)
        if count:
            _, axes = kin.forward(near)
            near = _carried_there(control.machine, kin, space.centre + (floor + RISE) * axes, axes, near)
        q = np.concatenate([near, up.q[None, :]])
        start = begin[None, :] if lifted is None else lifted[None, :]
        if np.isfinite(q).all() and stays_clear(control, kin, space, np.concatenate([start, q]), slack):
            return (q if lifted is None else np.concatenate([start, q])), True
    return up.q[None, :], False


def _lifted(machine: Machine, kin: Kinematics, space: SafeSpace, q: Floats, floor: float, slack: float) -> Floats | None:
    """Joints with the tool drawn back along its axis to above the safe plane, None where it is clear already."""
    tip, axis = kin.forward(q[None, :])
    if bool(space.clear(tip, axis, slack)[0]):
        return None
    lift = floor + RISE - float(axis[0] @ (tip[0] - space.centre))
    return np.asarray(_carried_there(machine, kin, tip + lift * axis, axis, q[None, :])[0])


def stays_clear(control: Control, kin: Kinematics, space: SafeSpace, q: Floats, slack: float) -> bool:
    """True where the tool is clear at even places of all moves between the joints q (K, J), looked at together."""
    count = len(q) - 1
    t = np.repeat(np.linspace(0.0, 1.0, SAMPLES), count)
    begin, end = np.tile(q[:-1], (SAMPLES, 1)), np.tile(q[1:], (SAMPLES, 1))
    tip, axis, _ = control.between(begin, end, t, kin, np.ones(len(t), dtype=bool))
    return bool(space.clear(tip, axis, slack).all())
