"""What the tests of cycle times share: programs as text to blocks, random programs of every kind."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np

import machines
from machines.machine import Machine, Timing
from postproc.controllers.model import load_controller
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import estimate
from postproc.cycle_time.model import CycleTimeModel, load_model
from postproc.cycle_time.planned import planned_times
from postproc.cycle_time.source import from_conversion, from_gcode
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.time_fit.calibrate import CalibratedModel, calibrate
from postproc.time_fit.log import RunLog
from postproc.time_fit.runs import run_of_log
from toolpaths.diagnostics import Diagnostic, read_value

HEAD = "G21 G90 G94 G17"


@cache
def machine(name: str = "mill-3axis", timing: bool = False) -> Machine:
    loaded = machines.load(name)
    return loaded if timing else replace(loaded, timing=Timing())


@cache
def model(name: str) -> CycleTimeModel:
    """A built-in model; "lookahead" by its formulas, which take no path to be executed."""
    loaded, found = load_model(name)
    assert loaded is not None and not found
    return loaded.model_copy(update={"kind": "lookahead"}) if name == "lookahead" else loaded


def blocks(text: str, on: Machine | None = None, controller: str = "linuxcnc") -> MotionBlocks:
    spec, _ = load_controller(controller)
    assert spec is not None
    made, found = from_gcode(f"{text}\nM2\n".encode(), on or machine(), spec, SetupFile())
    assert made is not None, [str(d) for d in found]
    return made


def calibrated(b: MotionBlocks, log: RunLog, control: CycleTimeModel, file: str = "",
               on: Machine | None = None) -> tuple[CalibratedModel | None, list[Diagnostic]]:
    """The model fitted to the log of one program."""
    run, found = run_of_log(b, log, file)
    return (None, found) if run is None else calibrate([run], control, file, on)


def random_program(seed: int, rotary: str = "", top: float = 300.0) -> str:
    """Lines, short lines, arcs, helices, rapids, rotary moves in both feed modes, under a random path mode."""
    rng = np.random.default_rng(seed)
    mode = rng.choice(["G61", "G61.1", "G64", "G64 P0.01", "G64 P0.05 Q0.02", "G64 P0.2 Q0"])
    at, turn = np.array([0.0, 0.0, top]), np.zeros(len(rotary))
    text = [f"{HEAD} {mode}", f"G0 X0 Y0 Z{top}", f"F{rng.uniform(500, 6000):.0f}"]

    def point(step: np.ndarray) -> str:
        nonlocal at
        at = np.clip(at + step, [-150, -150, top - 60], [150, 150, top])
        return "X{:.4f} Y{:.4f} Z{:.4f}".format(*at)

    for _ in range(rng.integers(3, 7)):
        kind = rng.choice(["lines", "short", "arcs", "rapids", *(["rotary", "inverse"] if rotary else [])])
        count = int(rng.integers(4, 25))
        if kind in ("lines", "rapids"):
            code = "G1" if kind == "lines" else "G0"
            text += [f"{code} {point(rng.normal(0, 1, 3) * [9, 9, 3])}" for _ in range(count)]
        elif kind == "short":
            text += [f"G1 {point(np.array([math.cos(k / 9), math.sin(k / 9), 0]) * 0.4)}" for k in range(4 * count)]
        elif kind == "arcs":
            for _ in range(count // 3 + 1):
                text.append(_arc(rng, at, top))
                if rng.random() < 0.5:
                    text.append(f"G1 {point(rng.normal(0, 1, 3) * [8, 8, 0])}")
        else:
            text += ["G93"] * (kind == "inverse")
            for k in range(count):
                turn = np.clip(turn + rng.normal(0.1, 0.6, len(turn)), -25, 80)
                words = " ".join(f"{letter}{angle:.4f}" for letter, angle in zip(rotary, turn, strict=True))
                feed = f" F{rng.uniform(500, 3000):.2f}" if kind == "inverse" else ""
                text.append(f"G1 {point(np.array([math.cos(k / 5), math.sin(k / 5), 0]))} {words}{feed}")
            text += ["G94", f"F{rng.uniform(500, 5000):.0f}"] * (kind == "inverse")
    return "\n".join(text)


def _arc(rng: np.random.Generator, at: np.ndarray, top: float) -> str:
    """One arc or helix; moves `at` to its end."""
    radius, angle, sweep = rng.uniform(2, 20), rng.uniform(0, 2 * math.pi), rng.uniform(0.5, 5.0)
    ccw = bool(rng.random() < 0.5)
    i, j = radius * math.cos(angle), radius * math.sin(angle)
    end = math.atan2(-j, -i) + (sweep if ccw else -sweep)
    at[:] = [at[0] + i + radius * math.cos(end), at[1] + j + radius * math.sin(end),
             max(at[2] + rng.choice([0.0, -2.0]), top - 60)]
    return f"G{3 if ccw else 2} X{at[0]:.7f} Y{at[1]:.7f} Z{at[2]:.7f} I{i:.7f} J{j:.7f}"


def program_seconds(result: PostResult) -> float:
    """s of a program, links and travel home included: its passes as planned, all else under the ideal control."""
    model, blocks = read_value(load_model("ideal")), from_conversion(result)
    return float(estimate(blocks, result.machine, model, times=planned_times(result, blocks, model)[0]).seconds)
