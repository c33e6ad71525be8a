"""LinuxCNC's configuration files for a machine of this project: mm, degrees, no hardware, no network."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path

import numpy as np

from machines.machine import Machine
from tests.linuxcnc.interpreter import ToolEntry, table_text
from toolpaths.arrays import Floats

MODULES = "/usr/lib/linuxcnc/modules"
PERIOD = 0.001
"""s, the servo cycle"""
SAMPLER_DEPTH = 200_000
NML_KEYS = range(0x706F7301, 0x706F7306)
"""Shared memory of our own, apart from the keys of an ordinary LinuxCNC."""
PATIENCE = 3600.0
"""s of the fast clock that LinuxCNC's parts wait for each other: a busy host must not make them give up"""
_FAST = 1e6


def letters(machine: Machine) -> str:
    """Axis letters of programs: the joints' own, or tip coordinates where the control owns the kinematics."""
    if machine.control_kinematics is None:
        return "".join(machine.axis_names)
    return "XYZ" + "".join(name for name, turns in zip(machine.axis_names, machine.rotary, strict=True) if turns)


def write(folder: Path, machine: Machine, tools: Mapping[int, ToolEntry | tuple[float, float]], warp: int | Fraction,
          time_limit: float) -> None:
    """Everything that session.py reads, apart from the program and the clock."""
    axes = letters(machine)
    pins = [f"joint.{j}.pos-cmd" for j in range(len(machine.axis_names))]
    pins += [f"axis.{axis.lower()}.pos-cmd" for axis in axes]
    kinds = "f" * len(pins) + "sb"
    pins += ["motion.program-line", "motion.in-position"]
    (folder / "sim.ini").write_text("\n".join(_ini(folder, machine, axes)) + "\n")
    (folder / "sim.nml").write_text("\n".join(_nml()) + "\n")
    (folder / "sim.hal").write_text("\n".join(_hal(machine, pins)) + "\n")
    (folder / "sim.var").touch()
    (folder / "tool.tbl").write_text(table_text(tools))
    (folder / "job.json").write_text(json.dumps({
        "warp": str(warp), "joints": len(machine.axis_names), "pins": kinds, "modules": MODULES, "time_limit": time_limit,
        "realtime": _realtime(machine, axes, kinds)}))


def _realtime(machine: Machine, axes: str, kinds: str) -> list[list[str]]:
    control = machine.control_kinematics
    module = "trivkins" if control is None else control.module
    takes_letters = module == "trivkins" or module.endswith("-trt-kins")
    return [[module, *([f"coordinates={axes}"] if takes_letters else [])], ["tpmod"], ["homemod"],
            ["motmod", f"servo_period_nsec={round(PERIOD * 1e9)}", f"num_joints={len(machine.axis_names)}"],
            ["sampler", f"depth={SAMPLER_DEPTH}", f"cfg={kinds}"]]


def _hal(machine: Machine, pins: list[str]) -> Iterator[str]:
    for function in ("motion-command-handler", "motion-controller", "sampler.0"):
        yield f"addf {function} servo-thread"
    for j in range(len(machine.axis_names)):
        yield f"net feedback{j} joint.{j}.motor-pos-cmd => joint.{j}.motor-pos-fb"
    yield "net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in"
    yield "net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared"
    yield "net change iocontrol.0.tool-change => iocontrol.0.tool-changed"
    for k, pin in enumerate(pins):
        yield f"net sample{k} {pin} => sampler.0.pin.{k}"
    control = machine.control_kinematics
    if control is not None:
        for pin, value in control.pins.items():
            yield f"setp {pin} {value!r}"
        if control.tool_length_pin:
            yield f"net length motion.tooloffset.z => {control.tool_length_pin}"


def _ini(folder: Path, machine: Machine, axes: str) -> Iterator[str]:
    yield from ("[EMC]", "VERSION = 1.1", "MACHINE = simulation", "DEBUG = 0", f"NML_FILE = {folder}/sim.nml")
    yield from ("[DISPLAY]", "DISPLAY = dummy", "[TASK]", "TASK = milltask", "CYCLE_TIME = 0.001")
    yield from ("[RS274NGC]", f"PARAMETER_FILE = {folder}/sim.var")
    yield from ("[EMCMOT]", "EMCMOT = motmod", f"SERVO_PERIOD = {round(PERIOD * 1e9)}",
                f"COMM_TIMEOUT = {PATIENCE}")
    yield from ("[EMCIO]", "EMCIO = io", "CYCLE_TIME = 0.01", f"TOOL_TABLE = {folder}/tool.tbl")
    yield from ("[TRAJ]", f"COORDINATES = {' '.join(axes)}", "LINEAR_UNITS = mm", "ANGULAR_UNITS = degree")
    for kind in ("LINEAR", "ANGULAR"):
        for what in ("DEFAULT", "MAX"):
            yield f"{what}_{kind}_VELOCITY = {_FAST}"
            yield f"{what}_{kind}_ACCELERATION = {_FAST * 100}"
    yield from ("[KINS]", "KINEMATICS = chosen by the session", f"JOINTS = {len(machine.axis_names)}")
    unit = np.where(machine.rotary, 180.0 / np.pi, 1.0)
    for j in range(len(machine.axis_names)):
        home = float(machine.home[j] * unit[j])
        yield from (f"[JOINT_{j}]", f"TYPE = {'ANGULAR' if machine.rotary[j] else 'LINEAR'}",
                    *_limits(machine, j, unit, travel=True), f"HOME = {home!r}", f"HOME_OFFSET = {home!r}",
                    "HOME_SEARCH_VEL = 0", "HOME_LATCH_VEL = 0",
                    "HOME_SEQUENCE = 0", "FERROR = 1000000", "MIN_FERROR = 1000000")
    for axis in axes:
        yield f"[AXIS_{axis}]"
        joint = machine.axis_names.index(axis) if axis in machine.axis_names else 0
        yield from _limits(machine, joint, unit, travel=machine.control_kinematics is None)


def _limits(machine: Machine, joint: int, unit: Floats, travel: bool) -> Iterator[str]:
    """Limits of a joint or of the axis of the same letter; tip coordinates have no travel of their own."""
    limits, scale = machine.limits, unit[joint]
    for key, bound in (("MIN_LIMIT", limits.lower), ("MAX_LIMIT", limits.upper)):
        if travel and np.isfinite(bound[joint]):
            yield f"{key} = {float(bound[joint] * scale)!r}"
    yield f"MAX_VELOCITY = {float(limits.velocity[joint] * scale)!r}"
    yield f"MAX_ACCELERATION = {float(limits.acceleration[joint] * scale)!r}"


def _nml() -> Iterator[str]:
    """Buffers in shared memory only; the usual file would open a TCP port."""
    buffers = (("emcCommand", 8192, " queue confirm_write serial"), ("emcStatus", 20480, ""),
               ("emcError", 8192, " queue"), ("toolCmd", 1024, ""), ("toolSts", 1024, ""))
    for number, ((name, size, extra), key) in enumerate(zip(buffers, NML_KEYS, strict=True), 1):
        yield f"B {name} SHMEM localhost {size} 0 0 {number} 16 {key} xdr{extra}"
    users = (("emc", 0, 0, 0, "RW W W W R"), ("emcsvr", 2, 1, 1, "W R R W R"),
             ("tool", 3, 0, 0, "- - W R W"), ("xemc", 10, 0, 0, "W R R - -"))
    for user, number, server, master, rights in users:
        for (buffer, _, _), right in zip(buffers, rights.split(), strict=True):
            if right != "-":
                yield f"P {user} {buffer} LOCAL localhost {right} {server} {PATIENCE} {master} {number}"
