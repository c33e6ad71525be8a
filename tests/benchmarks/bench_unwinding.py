"""What a rotary axis that winds costs, counted and as a modulo axis: largest word, seconds unwinding, before and after.

    python tests/benchmarks/bench_unwinding.py [POINTS] [CONTROLLER ...]

A ball cutter goes round a tapering column of the Mikron's table on one spiral of POINTS points (100000; at least
2 turns of 1000), the axis 30 degrees off z: C winds a turn per 1000 points. `samples/blade.cls` stands above it. Each row
is one conversion with its proof: C that counts its turns and goes back to home, the same left at the nearest
full turn (the next start unwinds it), C as a modulo axis. Seconds are those of the linking moves at the
axis' velocity; `program` is the estimate of the whole.
"""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import machines
import postproc
import toolpaths
from machines.machine import Turns
from postproc.base.options import Options
from postproc.cycle_time.conversion import estimate_of
from postproc.report.unwinding import unwinding

SAMPLES = Path(__file__).parents[2] / "samples"
PER_TURN = 1000
LEAN = np.radians(30.0)
RADIUS, RISE = 30.0, 40.0
"""mm: of the column at its foot, its height"""
KINDS = {"counts, back to home": Turns(park="home"), "counts, left at a turn": Turns(), "modulo": Turns(modulo=True)}
HEAD = ("UNITS/MM\nTOOL PATH/SPIRAL,TOOL,BALL6\nTLDATA/MILL,6.0,3.0,75.0,0.0,0.0\n"
        "MSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,4,ADJUST,4\nSPINDL/RPM,12000,CLW\n")


def spiral(points: int) -> bytes:
    """A CL file (NX) of so many points of the cut, a rapid before and behind it."""
    turn = 2.0 * np.pi * np.arange(points) / PER_TURN
    share = np.linspace(0.0, 1.0, points)
    radius = RADIUS - 10.0 * share
    out = np.stack([np.cos(turn), np.sin(turn), np.zeros(points)], axis=1)
    tip = radius[:, None] * out + (RISE * (1.0 - share))[:, None] * np.eye(3)[2]
    axis = np.sin(LEAN) * out + np.cos(LEAN) * np.eye(3)[2]
    rows = np.hstack([tip, axis])
    off = np.concatenate([rows[[0, -1], :3] + 40.0 * rows[[0, -1], 3:], rows[[0, -1], 3:]], axis=1)
    row = "GOTO/%.5f,%.5f,%.5f,%.7f,%.7f,%.7f\n"
    first, last = (row % tuple(p) for p in off)
    return (f"{HEAD}RAPID\n{first}FEDRAT/MMPM,2500\n" + row * points % tuple(rows.ravel())
            + f"RAPID\n{last}END-OF-PATH\n").encode()


def line(path: toolpaths.Toolpath, controller: str, kind: str, output: str) -> str:
    """One conversion, as a row."""
    machine = machines.load("mikron-ucp710")
    machine = replace(machine, turns=tuple(KINDS[kind] if name == "C" else own
                                           for name, own in zip(machine.axis_names, machine.turns, strict=True)))
    start = time.perf_counter()
    result = postproc.convert(path, machine, controller, SAMPLES / "tools.setup.toml", Options(output=output))
    wall = time.perf_counter() - start
    if not result.ok:
        return f"  {kind:24} refused: {[str(d) for d in result.diagnostics if d.severity == 2][:2]}"
    largest = max((abs(float(m[1])) for m in words(result.text)), default=0.0)
    cost = unwinding(result).get("C", {"in_program_s": 0.0, "turns_left": 0, "next_start_s": 0.0})
    estimate = estimate_of(result)
    seconds = estimate.seconds if estimate is not None else float("nan")
    return (f"  {kind:24} {largest:14.4f} {cost['in_program_s']:12.1f} s {cost['turns_left']:8d} "
            f"{cost['next_start_s']:12.1f} s {seconds:12.1f} s {wall:9.0f} s")


def words(text: str) -> Iterator[re.Match[str]]:
    """The words of C outside comments."""
    plain = re.sub(r"(?m)^(?:N\d+ )?\(.*\)$|;.*$", "", text)
    return re.finditer(r"(?<![A-Z])C(?:=(?:DC|ACP|ACN)\()?([-+]?\d+\.?\d*)", plain)


def main() -> None:
    """Print the tables."""
    points = next((int(a) for a in sys.argv[1:] if a.isdigit()), 100_000)
    controllers = [a for a in sys.argv[1:] if not a.isdigit()] or ["fanuc-30i"]
    blade, _ = toolpaths.read(SAMPLES / "blade.cls")
    long, _ = toolpaths.read_bytes(spiral(max(points, 2 * PER_TURN)))
    for name, path in (("samples/blade.cls", blade), (f"spiral of {points} points", long)):
        for controller in controllers:
            print(f"{name}, {controller}, axis positions\n  {'C':24} {'largest word':>14} {'in program':>14} {'turns':>8} "
                  f"{'next start':>14} {'program':>14} {'conversion':>11}", flush=True)
            for kind in KINDS:
                print(line(path, controller, kind, "axes"), flush=True)


if __name__ == "__main__":
    main()
