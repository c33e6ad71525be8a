"""Figures of a machine file that no machine has: units mistaken for one another, a pivot with the wrong sign."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise

import numpy as np

from machines.choices import MotionOrder
from machines.key_problem import KeyProblem
from machines.kinematics.chain import Joint
from machines.machine import Machine
from machines.toml_lines import KeyPath
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.units import DEG, MM_PER_INCH

Ranges = dict[MotionOrder, tuple[float, float]]
LINEAR: Ranges = {"velocity": (2.0, 5000.0), "acceleration": (10.0, 1e5), "jerk": (50.0, 1e7)}
"""mm/s, mm/s2, mm/s3: from the slowest bench mill to the fastest parallel machine"""
ROTARY: Ranges = {"velocity": (1.0, 7200.0), "acceleration": (10.0, 1e5), "jerk": (50.0, 1e7)}
"""deg/s, deg/s2, deg/s3"""
LONGEST_RAMP = 4.0
"""s from rest to full speed"""
TRAVEL = (50.0, 60000.0)
"""mm"""
BEYOND = 0.25
"""share of its travel by which a pivot may lie beyond the end of it"""
HEAD = 1000.0
"""mm between the gauge point and the pivots of a head"""
LOW_HEAD = 30.0
"""mm of a level axis of a head above the gauge point, from which on numbers are mm: lower ones are inches, or exchanged"""
BELOW = (300.0, 0.6)
"""mm, and share of the retract axis' travel, by which a tilting table lies below the lowest place of the spindle at most"""
TABLES_APART = 0.2
"""of the shorter travel across: between the lines of two tables of which one carries the other"""
EXCHANGED = (0.2, 0.05)
"""shares of a travel: a pivot is that far from its middle, and with two of its numbers exchanged that near"""
LOW = 0.2
"""share of the retract axis' travel up to which tables tilt: a pivot below it is where it should be"""
SLOWEST = 8.0
"""the fastest of X, Y, Z over the slowest"""
SHORTEST = 12.0
"""the longest travel of X, Y, Z over the shortest: an inch taken for a mm makes 25.4"""
TURNING = (0.05, 20.0)
"""deg/s of the fastest rotary axis per mm/s of the fastest slide: a unit mistaken in all of one kind makes 60 times"""
SLOWEST_TURN, FASTEST_MILLING = 30.0, 1200.0
"""the fastest rotary axis over the slowest, a degree per minute taken for one per second makes 60; deg/s that a table for
milling turns at most, as which one for turning counts"""
TILT = 900.0
"""deg/s of a rotary axis with ends"""
PLACES, ROUNDING = (3, 3, 3, 3), 1e-6
"""of a workspace, along x, y, z and its tilt, at which travel is looked at; mm (rad) that is no distance from it"""
END, MIDDLE = 0.12, 0.15
"""shares of a travel: next to its end, and around its middle"""
_HINTS: dict[MotionOrder, str] = {
    "velocity": "write it per second: mm/min and deg/min are divided by 60, m/min by 0.06, turns per minute times 6",
    "acceleration": "write it in mm/s2 or deg/s2: m/s2 are times 1000, g times 9807, turns/s2 times 360",
    "jerk": "write it in mm/s3 or deg/s3: m/s3 are times 1000, turns/s3 times 360",
}


def implausible(machine: Machine) -> Iterator[KeyProblem]:
    """Every figure that no machine has; paths as in the machine file. Next to one that is out of all range nothing is
    compared with it."""
    own = list(odd_limits(machine))
    yield from own
    unlike = list(_unlike(machine, {one.path for one in own}))
    yield from unlike
    yield from _pivots(machine, {one.path for one in (*own, *unlike)})
    yield from _platform(machine)


def odd_limits(machine: Machine) -> Iterator[KeyProblem]:
    """Those that each axis has by itself."""
    for j, name in enumerate(machine.axis_names):
        yield from _limits(machine, j, name)


def _limits(machine: Machine, j: int, name: str) -> Iterator[KeyProblem]:
    rotary = machine.rotary[j]
    unit, scale, known = ("deg", DEG, ROTARY) if rotary else ("mm", 1.0, LINEAR)
    limits, path = machine.limits, ("axes", name)
    for order, (key, (least, most)) in enumerate(known.items(), 1):
        value = float(getattr(limits, key)[j]) / scale
        if not least <= value <= most:
            per = f"{unit}/s{order if order > 1 else ''}"
            says = f"{key} of {name} is {value:g} {per}: machines have {least:g} to {most:g}"
            yield KeyProblem("machine.plausible", (*path, key), says, _HINTS[key])
    ramp = float(limits.velocity[j] / limits.acceleration[j])
    if ramp > LONGEST_RAMP and known["velocity"][0] <= limits.velocity[j] / scale <= known["velocity"][1]:
        says = f"{name} takes {ramp:.3g} s from rest to full speed, most machines less than {LONGEST_RAMP:g} s"
        yield KeyProblem("machine.plausible", (*path, "acceleration"), says, _HINTS["velocity"])
    length = float(limits.upper[j] - limits.lower[j])
    if not rotary and not TRAVEL[0] <= length <= TRAVEL[1]:
        says = f"travel of {name} is {length:g} mm long: machines have {TRAVEL[0]:g} to {TRAVEL[1]:g}"
        yield KeyProblem("machine.plausible", (*path, "travel"), says, "write it in mm: inches are times 25.4")


def _unlike(machine: Machine, odd: set[KeyPath]) -> Iterator[KeyProblem]:
    """Slides of one machine are of one kind: a unit mistaken in one of them stands out; a tilting axis does not spin."""
    limits, chain = machine.limits, {joint.name for joint in machine.kinematics.chain}
    slides = [j for j, name in enumerate(machine.axis_names) if name in "XYZ" and name in chain and not machine.rotary[j]]
    for values, most, key, unit, hint in (
            (limits.velocity, SLOWEST, "velocity", "mm/s", "see to its unit: mm/min, m/min or mm/s"),
            (limits.upper - limits.lower, SHORTEST, "travel", "mm long", "see to their units: mm or inches")):
        known = [j for j in slides if ("axes", machine.axis_names[j], key) not in odd]
        if not known or np.ptp(values[known]) == 0.0:
            continue
        least, largest = min(known, key=values.__getitem__), max(known, key=values.__getitem__)
        times = float(values[largest] / values[least])
        if times > most:
            short, long = machine.axis_names[least], machine.axis_names[largest]
            says = (f"{key} of {short} is {values[least]:g} {unit}, of {long} {values[largest]:g}: {times:.3g} times as "
                    f"much, of most machines less than {most:g} times")
            yield KeyProblem("machine.plausible", ("axes", short, key), says, hint)
    yield from _slow_turn(machine, odd)
    yield from _turning(machine, np.array([("axes", name, "velocity") not in odd for name in machine.axis_names], bool))
    for j, name in enumerate(machine.axis_names):
        speed = float(limits.velocity[j]) / DEG
        if machine.rotary[j] and not machine.endless[j] and TILT < speed <= ROTARY["velocity"][1]:
            says = f"{name} tilts at {speed:g} deg/s, {speed / 6.0:g} turns per minute: most less than {TILT / 6.0:g}"
            yield KeyProblem("machine.plausible", ("axes", name, "velocity"), says, "see to its unit: deg/s or turns/min")


def _slow_turn(machine: Machine, odd: set[KeyPath]) -> Iterator[KeyProblem]:
    """Rotary axes of one machine are about as fast as one another."""
    known = [j for j, name in enumerate(machine.axis_names) if machine.rotary[j] and ("axes", name, "velocity") not in odd]
    if not known:
        return
    speed = machine.limits.velocity / DEG
    slow, fast = min(known, key=speed.__getitem__), max(known, key=speed.__getitem__)
    if min(float(speed[fast]), FASTEST_MILLING) > SLOWEST_TURN * float(speed[slow]):
        name, other = machine.axis_names[slow], machine.axis_names[fast]
        says = (f"{name} turns at {speed[slow]:.4g} deg/s, {other} at {speed[fast]:.4g}: "
                f"{speed[fast] / speed[slow]:.3g} times as much")
        yield KeyProblem("machine.plausible", ("axes", name, "velocity"), says,
                         "see to the units of both: turns per minute, deg/s or deg/min")


def _turning(machine: Machine, known: Bools) -> Iterator[KeyProblem]:
    """Turns and slides of one machine are about as fast as one another; (axes,) `known`: those that are looked at."""
    rotary, speed = np.array(machine.rotary, bool), machine.limits.velocity
    turns, slides = rotary & known, ~rotary & known
    if not turns.any() or not slides.any():
        return
    turn, slide = int(np.where(turns, speed, -1.0).argmax()), int(np.where(slides, speed, -1.0).argmax())
    per = float(speed[turn]) / DEG / float(speed[slide])
    if TURNING[0] <= per <= TURNING[1]:
        return
    slow, fast = (slide, turn) if per > TURNING[1] else (turn, slide)
    name, said = machine.axis_names[slow], [
        f"{speed[j] / DEG:.4g} deg/s" if machine.rotary[j] else f"{speed[j]:.4g} mm/s" for j in (slow, fast)]
    says = f"{name} goes at {said[0]} at most, {machine.axis_names[fast]} at {said[1]}: one is not of the other's machine"
    units = "turns per minute, deg/s or deg/min" if slow == turn else "mm/s, mm/min or m/min"
    yield KeyProblem("machine.plausible", ("axes", name, "velocity"), says, f"see to the units of both: {units}")


def _pivots(machine: Machine, odd: set[KeyPath]) -> Iterator[KeyProblem]:
    """Pivots that no machine has; slides of odd travel say nothing about them."""
    carried = machine.structure.split()
    turns = [joint for joint in machine.kinematics.chain if joint.rotary]
    tables = [joint for joint in turns if f"{joint.name}'" in carried]
    heads = [joint for joint in turns if f"{joint.name}'" not in carried]
    slides = [_Slide(joint, float(machine.limits.lower[j]), float(machine.limits.upper[j]), j == machine.retract_axis)
              for joint in machine.kinematics.chain if not joint.rotary
              for j in (machine.axis_names.index(joint.name),) if ("axes", joint.name, "travel") not in odd]
    exchanged = {joint.name: problem for joint in tables if (problem := _exchanged(joint, slides)) is not None}
    rest = [joint for joint in tables if joint.name not in exchanged]
    wrong = [*exchanged.values(), *(problem for slide in slides for problem in _off_the_slide(rest, slide)),
             *_in_inches(rest, slides)]
    yield from wrong or _apart(tables, slides)
    yield from _heads(heads)


@dataclass(frozen=True)
class _Slide:
    """A slide with the ends of its travel, mm; `retract`: it draws the tool back."""

    joint: Joint
    low: float
    high: float
    retract: bool

    def at(self, joint: Joint) -> float:
        """Where a pivot lies along it, mm."""
        return float(joint.point @ self.joint.direction)

    def share(self, at: float) -> float:
        """The same as a share of its travel."""
        return (at - self.low) / (self.high - self.low)

    def across(self, joint: Joint) -> bool:
        """True where it is square to the axis."""
        return abs(float(self.joint.direction @ joint.direction)) < 0.5


def _sideways(joint: Joint, slides: list[_Slide]) -> list[_Slide]:
    """Slides across an axis, but for the retract axis."""
    return [slide for slide in slides if slide.across(joint) and not slide.retract]


def _point(joint: Joint) -> KeyPath:
    return ("kinematics", "axes", joint.name, "point")


def _lines(joints: list[Joint]) -> str:
    """The subject of a sentence about where axes lie."""
    return f"{joints[0].name} turns about a line" if len(joints) == 1 else (
        f"{' and '.join(joint.name for joint in joints)} turn about lines")


def _off_the_slide(tables: list[Joint], slide: _Slide) -> Iterator[KeyProblem]:
    """A table stands where the spindle comes to it: over its pivot sideways, above it along the retract axis. All that lie
    off one slide are one problem: its travel, or the numbers that they share."""
    room, name = BEYOND * (slide.high - slide.low), slide.joint.name
    high = [joint for joint in tables if slide.retract and slide.across(joint) and slide.at(joint) >= slide.high]
    deep = max(BELOW[0], BELOW[1] * (slide.high - slide.low))
    low = [joint for joint in tables if slide.retract and slide.across(joint) and slide.at(joint) < slide.low - deep]
    off = [joint for joint in tables if not slide.retract and not slide.low - room <= slide.at(joint) <= slide.high + room]
    for joints, what, hint in (
            (high, "the table is above the spindle", "see to the sign: pivots of tables lie below the gauge point, in "
             "machine coordinates"),
            (low, "the spindle stays far above it", f"see to the ends of {name}, both in machine coordinates: most controls "
             "count from its upper end down"),
            (off, "the spindle never comes over it", f"see to the sign, and to the ends of {name}: both are in machine "
             "coordinates, the pivot as displayed with the spindle over it")):
        if joints:
            at = " and ".join(dict.fromkeys(f"{slide.at(joint):g}" for joint in joints))
            says = f"{_lines(joints)} at {name} = {at} mm, {name} goes from {slide.low:g} to {slide.high:g} mm: {what}"
            yield KeyProblem("machine.plausible", _point(joints[0]), says, hint)


def _exchanged(joint: Joint, slides: list[_Slide]) -> KeyProblem | None:
    """Tables stand about the middle of the slides across them: two numbers that would do so exchanged are exchanged."""
    across = _sideways(joint, slides)
    off = [abs(slide.share(slide.at(joint)) - 0.5) for slide in across]
    if max(off, default=0.0) <= EXCHANGED[0]:
        return None
    for one, other in combinations(slides, 2):
        at = {slide.joint.name: slide.at(joint) for slide in slides}
        if any(slide.retract and slide.share(slide.at(joint)) < LOW for slide in (one, other)):
            continue
        names = one.joint.name, other.joint.name
        at[names[0]], at[names[1]] = at[names[1]], at[names[0]]
        if all(abs(slide.share(at[slide.joint.name]) - 0.5) < EXCHANGED[1] for slide in across):
            where = " and ".join(f"{slide.joint.name} = {slide.at(joint):g} mm" for slide in across)
            says = (f"{joint.name} turns about a line at {where}, far from the middle; with {names[0]} and {names[1]} of it "
                    "exchanged it is there")
            return KeyProblem("machine.plausible", _point(joint), says, "see to the order of its numbers: X, Y, Z")
    return None


def _in_inches(tables: list[Joint], slides: list[_Slide]) -> Iterator[KeyProblem]:
    """Tables stand about the middle of the slides across them: a pivot at the ends that 25.4 brings there is in inches."""
    found = []
    for joint in tables:
        shares = [(slide.share(at), slide.share(at * MM_PER_INCH)) for slide in _sideways(joint, slides)
                  for at in (slide.at(joint),)]
        if shares and all(min(abs(now), abs(1.0 - now)) < END and abs(then - 0.5) < MIDDLE for now, then in shares):
            found.append(joint)
    if found:
        where = " and ".join(dict.fromkeys(slide.joint.name for joint in found for slide in _sideways(joint, slides)))
        says = f"{_lines(found)} at the end of {where}; the numbers times 25.4 are in the middle"
        yield KeyProblem("machine.plausible", _point(found[0]), says,
                         "see to their unit: pivots are in mm, a control in inches shows inches")


def _apart(tables: list[Joint], slides: list[_Slide]) -> Iterator[KeyProblem]:
    """The lines of two tables of which one carries the other pass one another closely."""
    travels = [slide.high - slide.low for slide in slides if not slide.retract]
    for one, other in pairwise(tables):
        square = np.cross(one.direction, other.direction)
        if float(np.linalg.norm(square)) < 0.1 or not travels:
            continue
        apart = abs(float((one.point - other.point) @ square)) / float(np.linalg.norm(square))
        if apart > TABLES_APART * min(travels):
            says = f"the lines about which {one.name} and {other.name} turn pass one another {apart:g} mm apart"
            yield KeyProblem("machine.plausible", _point(one), says, "see to the numbers of both, their signs and their "
                             "order: of most machines they nearly meet")


def _heads(heads: list[Joint]) -> Iterator[KeyProblem]:
    """A head turns about lines above the gauge point of its spindle; what is wrong with the axis next to the tool is not
    said again of those that carry it."""
    for joint in reversed(heads):
        own = list(_head_pivot(joint))
        yield from own
        if own:
            return
    level = [joint for joint in heads if abs(float(joint.direction[2])) < 0.1]
    for outer, inner in pairwise(level):
        lower = float(inner.point[2] - outer.point[2])
        if lower > LOW_HEAD:
            says = f"{outer.name}, which carries {inner.name}, turns about a line {lower:g} mm below that of {inner.name}"
            yield KeyProblem("machine.plausible", _point(outer), says,
                             "see to the sign: it is the vector from one pivot to the next, upwards")


def _head_pivot(joint: Joint) -> Iterator[KeyProblem]:
    """A head turns about a line above the gauge point of its spindle."""
    path, height, away = _point(joint), float(joint.point[2]), float(np.abs(joint.point).max())
    level = abs(float(joint.direction[2])) < 0.9
    if level and height <= 0.0:
        says = f"{joint.name} turns about a line {-height:g} mm below the gauge point of its own spindle"
        yield KeyProblem("machine.plausible", path, says,
                         "see to the sign: it is the vector from the gauge point to the pivot, upwards")
    elif level and height < LOW_HEAD:
        says = f"{joint.name} turns about a line only {height:g} mm above the gauge point of its own spindle"
        yield KeyProblem("machine.plausible", path, says, "see to the order of its numbers, X, Y, Z, and to their unit: mm")
    elif away > HEAD:
        says = f"{joint.name} turns about a line {away:g} mm away from the gauge point, at most {HEAD:g} mm"
        yield KeyProblem("machine.plausible", path, says,
                         "measure it from the gauge point of the spindle, not from the machine's zero")


def _platform(machine: Machine) -> Iterator[KeyProblem]:
    """Of a machine on legs: home lies in the workspace, and travel holds it."""
    from machines.reach import reach

    over = machine.kinematics.over_workspace
    if over is None:
        return
    place, tilt = over.workspace.grid(PLACES)
    places = np.vstack([[*over.workspace.middle, np.clip(0.0, *over.workspace.tilt)], np.column_stack([place, tilt])])
    q = machine.joints_over_workspace(places)
    margins, names = reach(machine.kinematics, machine.home[None]), machine.axis_names
    faces = [(name, value) for name, value, own in zip(margins.names, margins.values[0], margins.of_box, strict=True)
             if own and not value >= 0.0]
    if faces:
        at = ", ".join(f"{name} {_shown(machine, j, q[0, j])}" for j, name in enumerate(names) if np.isfinite(q[0, j]))
        by = ", ".join(f"{name} by {-value:g}" for name, value in faces if np.isfinite(value))
        says = f"home is outside the workspace: {by}" if by else "at home the legs do not reach the platform"
        yield KeyProblem("machine.plausible", ("axes", names[0], "home"), says, f"the middle of the workspace is at {at}")
    low, high = machine.limits.lower, machine.limits.upper
    beyond = np.nan_to_num(np.maximum(low - q, q - high), nan=0.0)
    if beyond.max() > ROUNDING:
        worst, j = (int(k) for k in np.unravel_index(int(beyond.argmax()), beyond.shape))
        ends = f"{_shown(machine, j, low[j])} to {_shown(machine, j, high[j])}"
        at = "x {:g}, y {:g}, z {:g} mm".format(*places[worst, :3])
        says = (f"at {at} of the workspace {names[j]} stands at {_shown(machine, j, q[worst, j])}, its travel is {ends}: "
                f"{int((beyond.max(axis=1) > ROUNDING).sum())} of {len(q)} places looked at are outside of travel")
        spans = ", ".join(_span(machine, k, q[:, k]) for k in range(len(names)) if beyond[:, k].max() > ROUNDING)
        yield KeyProblem("machine.plausible", ("axes", names[j], "travel"), says, f"the workspace takes {spans}")


def _span(machine: Machine, j: int, q: Floats) -> str:
    scale, unit = (DEG, "deg") if machine.rotary[j] else (1.0, "mm")
    return f"{machine.axis_names[j]} {np.floor(np.nanmin(q) / scale):g} {unit} to {np.ceil(np.nanmax(q) / scale):g} {unit}"


def _shown(machine: Machine, j: int, value: float) -> str:
    return f"{value / DEG:.4g} deg" if machine.rotary[j] else f"{value:.6g} mm"
