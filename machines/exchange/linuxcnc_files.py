"""INI and HAL of LinuxCNC for a machine, without hardware: each joint's command is its feedback.

What LinuxCNC has no key for (geometry under trivkins, timing, what is assumed) stands in a section
[POSTPROC], which it passes over.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from machines.kinematics.chain import ROTARY
from machines.machine import Machine
from machines.models import JOINTS_ARE_AXES
from toolpaths.units import DEG

PERIOD = 0.001
"""s, the servo cycle"""
IDLE = 0.001
"""mm of travel of a joint that a module has and the machine has not"""
EDGE = 1e-6
"""mm or degrees that travel ends later: at its very end, where many machines are at home, LinuxCNC stops by rounding"""
Sections = dict[str, dict[str, str]]
"""INI: values by section and key"""


def letters(machine: Machine) -> str:
    """Axis letters of programs: the joints' own, or tip coordinates where the control owns the kinematics."""
    control = machine.control_kinematics
    if control is None or control.axes is not None:
        return "".join(machine.on_control().axis_names)
    return "XYZ" + "".join(name for name, turns in zip(machine.axis_names, machine.rotary, strict=True) if turns)


def module_words(machine: Machine) -> list[str]:
    """The kinematics module with its parameters."""
    control = machine.control_kinematics
    module = JOINTS_ARE_AXES if control is None else control.module
    takes_letters = module == JOINTS_ARE_AXES or module.endswith("-trt-kins") or bool(control and control.idle)
    return [module, *([f"coordinates={_coordinates(machine)}"] if takes_letters else [])]


def _coordinates(machine: Machine) -> str:
    return letters(machine) + (machine.control_kinematics.idle if machine.control_kinematics else "")


def joints(machine: Machine) -> int:
    """Joints of the configuration."""
    return len(machine.axis_names) + (len(machine.control_kinematics.idle) if machine.control_kinematics else 0)


def ini_sections(machine: Machine, name: str) -> Sections:
    """The INI of a machine; other files by `name`."""
    machine = machine.by_drives or machine
    result: Sections = {
        "EMC": {"VERSION": "1.1", "MACHINE": machine.description, "DEBUG": "0"},
        "DISPLAY": {"DISPLAY": "axis", "MAX_FEED_OVERRIDE": "1.2"}, "TASK": {"TASK": "milltask", "CYCLE_TIME": "0.001"},
        "RS274NGC": {"PARAMETER_FILE": f"{name}.var"},
        "EMCMOT": {"EMCMOT": "motmod", "SERVO_PERIOD": str(round(PERIOD * 1e9)), "COMM_TIMEOUT": "1"},
        "HAL": {"HALFILE": f"{name}.hal"},
        "EMCIO": {"EMCIO": "io", "CYCLE_TIME": "0.01", "TOOL_TABLE": f"{name}.tbl"},
        "TRAJ": _traj(machine),
        "KINS": {"KINEMATICS": " ".join(module_words(machine)), "JOINTS": str(joints(machine))}}
    for number, (j, more) in enumerate(_joints(machine)):
        home = float((machine.home[j] + more) * _unit(machine, j))
        result[f"JOINT_{number}"] = {"TYPE": "ANGULAR" if machine.rotary[j] else "LINEAR",
                                     **_limits(machine, j, travel=True, more=more), **_homing(home)}
    for k, letter in enumerate(_idle(machine)):
        result[f"JOINT_{len(machine.axis_names) + k}"] = {"TYPE": "LINEAR", **_still(machine), **_homing(0.0)}
        result[f"AXIS_{letter}"] = _still(machine)
    moved = machine.on_control()
    for axis in letters(machine):
        joint = moved.axis_names.index(axis) if axis in moved.axis_names else 0
        own = {"WRAPPED_ROTARY": "1"} if axis in moved.axis_names and moved.turns[joint].modulo else {}
        result[f"AXIS_{axis}"] = _limits(moved, joint, travel=machine.control_kinematics is None) | own
    return result


def _joints(machine: Machine) -> list[tuple[int, float]]:
    """(joint of the machine, mm or rad that it counts more) of each joint of the module."""
    control = machine.control_kinematics
    if control is None or control.legs is None:
        return [(j, 0.0) for j in range(len(machine.axis_names))]
    return list(zip(control.legs.order, control.legs.zero.tolist(), strict=True))


def _idle(machine: Machine) -> str:
    return machine.control_kinematics.idle if machine.control_kinematics else ""


def _unit(machine: Machine, joint: int) -> float:
    return 1.0 / DEG if machine.rotary[joint] else 1.0


def _traj(machine: Machine) -> dict[str, str]:
    """No path is slower than its axes: a largest feed would hold back rapids too. Axes A, B, C are ANGULAR whatever moves
    them, all others LINEAR."""
    moved = machine.on_control()
    limits, linear = moved.limits, np.array([name not in ROTARY for name in moved.axis_names])
    units = np.array([_unit(moved, j) for j in range(len(linear))])
    result = {"COORDINATES": " ".join(_coordinates(machine)), "LINEAR_UNITS": "mm", "ANGULAR_UNITS": "degree"}
    for kind, some in (("LINEAR", linear), ("ANGULAR", ~linear)):
        if not some.any():
            continue
        for what, of_axes in (("VELOCITY", limits.velocity), ("ACCELERATION", limits.acceleration)):
            fast = float(np.hypot.reduce((of_axes * units)[some]))
            result |= {f"DEFAULT_{kind}_{what}": repr(fast), f"MAX_{kind}_{what}": repr(fast)}
    return result


def _homing(home: float) -> dict[str, str]:
    """At home from the start, without a search."""
    return {"HOME": repr(home), "HOME_OFFSET": repr(home), "HOME_SEARCH_VEL": "0", "HOME_LATCH_VEL": "0",
            "HOME_SEQUENCE": "0", "FERROR": "1000000", "MIN_FERROR": "1000000"}


def _still(machine: Machine) -> dict[str, str]:
    return {"MIN_LIMIT": repr(-IDLE), "MAX_LIMIT": repr(IDLE), "MAX_VELOCITY": repr(float(machine.limits.velocity[0])),
            "MAX_ACCELERATION": repr(float(machine.limits.acceleration[0]))}


def _limits(machine: Machine, joint: int, travel: bool, more: float = 0.0) -> dict[str, str]:
    """Limits of a joint, which the module counts `more`, or of an axis; tip coordinates have no travel of their own."""
    limits, scale = machine.limits, _unit(machine, joint)
    result = {}
    for key, bound, edge in (("MIN_LIMIT", limits.lower, -EDGE), ("MAX_LIMIT", limits.upper, EDGE)):
        if travel and np.isfinite(bound[joint]):
            result[key] = _number((bound[joint] + more) * scale + edge)
    for key, of_axes in (("VELOCITY", limits.velocity), ("ACCELERATION", limits.acceleration), ("JERK", limits.jerk)):
        result[f"MAX_{key}"] = _number(of_axes[joint] * scale)
    return result


def _number(value: float) -> str:
    """Without the last digit, which rad have spoilt."""
    return repr(float(f"{value:.15g}"))


def hal_lines(machine: Machine) -> Iterator[str]:
    """The HAL file: joints that follow at once, no emergency stop, tools that are there, pins of the kinematics."""
    control = machine.control_kinematics
    yield "loadrt [KINS]KINEMATICS"
    yield "loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS"
    if control and control.sum_to[0]:
        yield f"loadrt sum2 names={control.sum_to[0].partition('.')[0]}"
    for function in ("motion-command-handler", "motion-controller", *_sum_of(machine)):
        yield f"addf {function} servo-thread"
    for j in range(joints(machine)):
        yield f"net feedback{j} joint.{j}.motor-pos-cmd => joint.{j}.motor-pos-fb"
    yield "net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in"
    yield "net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared"
    yield "net change iocontrol.0.tool-change => iocontrol.0.tool-changed"
    for pin, value in (control.pins if control else {}).items():
        yield f"setp {pin} {value!r}"
    if control and control.tool_length_pin:
        yield f"net length motion.tooloffset.z => {control.tool_length_pin}"
    if control and control.sum_to[0]:
        yield f"net pivot {control.sum_to[0]} => {control.sum_to[1]}"


def _sum_of(machine: Machine) -> list[str]:
    control = machine.control_kinematics
    return [control.sum_to[0].partition(".")[0]] if control and control.sum_to[0] else []


def ini_text(sections: Mapping[str, Mapping[str, str]]) -> str:
    """The sections as a file."""
    return "\n".join(f"[{section}]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())
                     for section, keys in sections.items())
