"""Figures of a machine file that no machine has: units mistaken for one another, a pivot with the wrong sign."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from machines.choices import MotionOrder
from machines.key_problem import KeyProblem
from machines.kinematics.chain import Joint
from machines.machine import Machine
from machines.toml_lines import KeyPath
from toolpaths.arrays import Bools
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
SLOWEST = 8.0
"""the fastest of X, Y, Z over the slowest"""
SHORTEST = 12.0
"""the longest travel of X, Y, Z over the shortest: an inch taken for a mm makes 25.4"""
TURNING = (0.05, 20.0)
"""deg/s of the fastest rotary axis per mm/s of the fastest slide: a unit mistaken in all of one kind makes 60 times"""
TILT = 900.0
"""deg/s of a rotary axis with ends"""
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
    yield from _unlike(machine, {one.path for one in own})
    points = {joint.name: joint for joint in machine.kinematics.chain}
    slides = [joint for joint in points.values() if not joint.rotary]
    for joint in points.values():
        if joint.rotary:
            carries = f"{joint.name}'" in machine.structure.split()
            yield from _table_pivot(machine, joint, slides) if carries else _head_pivot(joint)
            if carries:
                yield from _pivot_in_inches(machine, joint, slides)


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
    yield from _turning(machine, np.array([("axes", name, "velocity") not in odd for name in machine.axis_names], bool))
    for j, name in enumerate(machine.axis_names):
        speed = float(limits.velocity[j]) / DEG
        if machine.rotary[j] and not machine.endless[j] and TILT < speed <= ROTARY["velocity"][1]:
            says = f"{name} tilts at {speed:g} deg/s, {speed / 6.0:g} turns per minute: most less than {TILT / 6.0:g}"
            yield KeyProblem("machine.plausible", ("axes", name, "velocity"), says, "see to its unit: deg/s or turns/min")


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


def _pivot_in_inches(machine: Machine, joint: Joint, slides: list[Joint]) -> Iterator[KeyProblem]:
    """Tables stand about the middle of the slides across them: a pivot at the ends that 25.4 brings there is in inches."""
    across = [slide for slide in slides if abs(float(slide.direction @ joint.direction)) < 0.5]
    across = [slide for slide in across if machine.axis_names.index(slide.name) != machine.retract_axis]
    shares = []
    for slide in across:
        j = machine.axis_names.index(slide.name)
        low, long = float(machine.limits.lower[j]), float(machine.limits.upper[j] - machine.limits.lower[j])
        at = float(joint.point @ slide.direction)
        shares.append(((at - low) / long, (at * MM_PER_INCH - low) / long))
    if shares and all(min(abs(now), abs(1.0 - now)) < END and abs(then - 0.5) < MIDDLE for now, then in shares):
        where = " and ".join(slide.name for slide in across)
        says = f"{joint.name} turns about a line at the end of {where}; its numbers times 25.4 are in the middle"
        yield KeyProblem("machine.plausible", ("kinematics", "axes", joint.name, "point"), says,
                         "see to their unit: pivots are in mm, a control in inches shows inches")


def _table_pivot(machine: Machine, joint: Joint, slides: list[Joint]) -> Iterator[KeyProblem]:
    """A table stands where the spindle comes to it: over its pivot sideways, above it along the retract axis."""
    path = ("kinematics", "axes", joint.name, "point")
    for slide in slides:
        if abs(float(slide.direction @ joint.direction)) > 0.5:  # a pivot may lie anywhere along its own axis
            continue
        j = machine.axis_names.index(slide.name)
        low, high = float(machine.limits.lower[j]), float(machine.limits.upper[j])
        at, room = float(joint.point @ slide.direction), BEYOND * (high - low)
        says = f"{joint.name} turns about a line at {slide.name} = {at:g} mm, {slide.name} goes from {low:g} to {high:g} mm"
        if j == machine.retract_axis and at >= high:
            yield KeyProblem("machine.plausible", path, f"{says}: the table is above the spindle",
                             "see to the sign: pivots of tables lie below the gauge point, in machine coordinates")
        elif j != machine.retract_axis and not low - room <= at <= high + room:
            yield KeyProblem("machine.plausible", path, f"{says}: the spindle never comes over it",
                             "see to the sign: a pivot is in machine coordinates, as displayed with the spindle over it")


def _head_pivot(joint: Joint) -> Iterator[KeyProblem]:
    """A head turns about a line above the gauge point of its spindle."""
    path, height, away = ("kinematics", "axes", joint.name, "point"), float(joint.point[2]), float(np.abs(joint.point).max())
    level = abs(float(joint.direction[2])) < 0.9
    if level and height <= 0.0:
        says = f"{joint.name} turns about a line {-height:g} mm below the gauge point of its own spindle"
        yield KeyProblem("machine.plausible", path, says,
                         "see to the sign: it is the vector from the gauge point to the pivot, upwards")
    elif away > HEAD:
        says = f"{joint.name} turns about a line {away:g} mm away from the gauge point, at most {HEAD:g} mm"
        yield KeyProblem("machine.plausible", path, says,
                         "measure it from the gauge point of the spindle, not from the machine's zero")
