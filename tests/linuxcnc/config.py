"""LinuxCNC's configuration files for a machine of this project as `machine export` writes them, without a network."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path

from machines.exchange.linuxcnc_files import PERIOD as PERIOD
from machines.exchange.linuxcnc_files import hal_lines, ini_sections, ini_text, joints, module_words
from machines.exchange.linuxcnc_files import letters as letters
from machines.machine import Machine
from tests.linuxcnc.interpreter import ToolEntry, table_text

MODULES = "/usr/lib/linuxcnc/modules"
SAMPLER_DEPTH = 200_000
NML_KEYS = range(0x706F7301, 0x706F7306)
"""Shared memory of our own, apart from the keys of an ordinary LinuxCNC."""
PATIENCE = 3600.0
"""s of the fast clock that LinuxCNC's parts wait for each other: a busy host must not make them give up"""


def write(folder: Path, machine: Machine, tools: Mapping[int, ToolEntry | tuple[float, float]], warp: int | Fraction,
          time_limit: float) -> None:
    """Everything that session.py reads, apart from the program and the clock."""
    pins = [f"joint.{j}.pos-cmd" for j in range(len(machine.axis_names))]
    pins += [f"axis.{axis.lower()}.pos-cmd" for axis in letters(machine)]
    kinds = "f" * len(pins) + "sb"
    pins += ["motion.program-line", "motion.in-position"]
    (folder / "sim.ini").write_text(_ini(folder, machine))
    (folder / "sim.nml").write_text("\n".join(_nml()) + "\n")
    (folder / "sim.hal").write_text("\n".join(_hal(machine, pins)) + "\n")
    (folder / "sim.var").touch()
    (folder / "sim.tbl").write_text(table_text(tools))
    (folder / "job.json").write_text(json.dumps({
        "warp": str(warp), "joints": joints(machine), "pins": kinds, "modules": MODULES, "time_limit": time_limit,
        "realtime": _realtime(machine, kinds)}))


def _realtime(machine: Machine, kinds: str) -> list[list[str]]:
    """Modules that the exported HAL file loads, and those of LinuxCNC's own start script."""
    loaded = [line.split()[1:] for line in hal_lines(machine) if line.startswith("loadrt ") and "[" not in line]
    return [module_words(machine), ["tpmod"], ["homemod"],
            ["motmod", f"servo_period_nsec={round(PERIOD * 1e9)}", f"num_joints={joints(machine)}"],
            ["sampler", f"depth={SAMPLER_DEPTH}", f"cfg={kinds}"], *loaded]


def _hal(machine: Machine, pins: list[str]) -> Iterator[str]:
    yield from (line for line in hal_lines(machine) if not line.startswith("loadrt "))
    yield "addf sampler.0 servo-thread"
    for k, pin in enumerate(pins):
        yield f"net sample{k} {pin} => sampler.0.pin.{k}"


def _ini(folder: Path, machine: Machine) -> str:
    sections = ini_sections(machine, str(folder / "sim"))
    sections["EMC"] |= {"NML_FILE": f"{folder}/sim.nml", "MACHINE": "simulation"}
    sections["DISPLAY"] = {"DISPLAY": "dummy"}
    sections["EMCMOT"] |= {"COMM_TIMEOUT": str(PATIENCE)}
    return ini_text(sections)


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
