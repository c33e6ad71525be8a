"""How often the band of a model fitted to one run holds the time of other programs on controls of other kinds.

python tests/benchmarks/bench_bands.py [CONTROLS]: for each of some controls with hidden parameters and accelerations
(LinuxCNC's planner, the formulas of look-ahead with and without jerk and slower in short lines, the executed control with
corners by their difference of feeds and with other shares of bends) the executed control, and for controls that are executed
the formulas, are fitted to one to three programs, and the band asked for programs of six kinds. Printed: coverage and width
of the bands of 95 % by kind, seen by the fit and not. Without a fit ("no fit"; "stated" where they state a tolerance) the
band of the executed control's own file (LinuxCNC's for its planner) is asked for the time of the same hidden control on
the machine as its file describes it: its accelerations and jerks; what the model assumes is hidden. Formulas of
look-ahead, which may be faster than their path's optimum, are executed there.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import estimate, timed, total
from postproc.cycle_time.model import CycleTimeModel
from postproc.time_fit.calibrate import calibrate
from postproc.time_fit.log import RunLog
from postproc.time_fit.runs import run_of_log
from tests.postproc.time_kit import blocks, machine, model

MACHINE = "mikron-ucp710"
SORTS = ("zigzag", "waves", "arcs", "rapids", "facing", "turning")
CLOCK = 0.002
STATED = 0.02
"""mm, tolerance of the programs that state one"""
CYCLE = 0.006
"""s of interpolation of the executed control: a third of the cycles of its file, and of the time that a fit takes"""


@cache
def program(sort: str, seed: int, size: int = 30) -> MotionBlocks:
    """A program of one kind, from a seed."""
    rng = np.random.default_rng(1000 * SORTS.index(sort) + seed)
    text = ["G21 G90 G94 G17", "G0 X0 Y0 Z100", f"F{rng.choice([1200, 3000, 6000])}"]
    angle = 0.0
    for k in range(size):
        if sort == "zigzag":
            text.append(f"G1 X{(k % 2) * rng.uniform(8, 40):.3f} Y{k * 0.7:.3f}")
        elif sort == "waves":
            text.append(
                f"G1 X{0.35 * k:.3f} Y{9 * np.sin(0.35 * k / 5) + rng.normal(0, 0.01):.4f} Z{100 - np.cos(k / 9):.4f}"
            )
        elif sort == "arcs":
            radius = rng.uniform(1, 12)
            text.append(
                f"G{2 + k % 2} X{(k + 1) % 2 * 2 * radius:.4f} Y0 I{(1 if k % 2 == 0 else -1) * radius:.4f} J0"
                if k % 2 == 0
                else "G1 X0 Y0"
            )
        elif sort == "rapids":
            text += [f"G0 X{rng.uniform(-150, 150):.2f} Y{rng.uniform(-150, 150):.2f}", "G0 Z60", "G1 Z52", "G0 Z100"]
        elif sort == "facing":
            text.append(f"G1 X{(k // 2 % 2) * 120 - 60:.3f} Y{(k + 1) // 2 * 2:.3f}")
        else:
            angle += rng.normal(0.2, 1.5)
            text.append(f"G1 X{0.5 * k:.3f} A{20 + 10 * np.sin(k / 7):.3f} C{angle:.3f}")
    return blocks("\n".join(text), machine(MACHINE), "generic-iso")


def control(rng: np.random.Generator, kind: int) -> tuple[CycleTimeModel, float]:
    """A control of a kind, and the power by which its corners depend on their change of direction otherwise."""
    values = {
        "corner_tolerance": 0.01 * np.exp(rng.normal(0, 0.7)),
        "block_time": 0.001 * np.exp(rng.normal(0, 0.7)),
        "rapid": np.exp(rng.normal(-0.15, 0.1)),
        "override": np.exp(rng.normal(0, 0.03)),
        "stop_time": 0.01 * np.exp(rng.normal(0, 0.7)),
        "acceleration_share": np.exp(rng.normal(0, 0.3)),
        "jerk_share": np.exp(rng.normal(0, 0.5)),
    }
    if kind == 4:
        values |= {"corner_step": 8.0 * np.exp(rng.normal(0, 0.5)), "smoothing": 0.002 * rng.integers(0, 12)}
    if kind == 5:
        values |= {"bend_acceleration": rng.uniform(0.4, 0.95), "bend_jerk": rng.uniform(0.4, 0.95)}
    if kind > 3:
        values["cycle"] = CYCLE
    name = "linuxcnc" if kind == 0 else "control" if kind > 3 else "lookahead"
    chosen = model(name).model_copy(update={k: float(v) for k, v in values.items()} | {"jerk": kind != 1})
    return chosen, 0.5 if kind == 3 else 0.0


def under(b: MotionBlocks, truth: CycleTimeModel, bend: float) -> tuple[float, np.ndarray]:
    """Total time and begin of each block under a control; `bend`: it takes off feed where lines are short."""
    if bend:
        step = np.linalg.norm(b.end - b.start, axis=1)
        speed = np.where(b.rapid, b.speed, b.speed * (step / (step + bend)) ** 0.3)
        b = replace(b, speed=speed)
    times = timed(b, truth)
    return total(b, times), times.begin


def fitted(seen: tuple[str, ...], truth: CycleTimeModel, bend: float, rng: np.random.Generator) -> CycleTimeModel | None:
    """The look-ahead model fitted to programs of those kinds."""
    runs = []
    for sort in seen:
        b = program(sort, 0)
        line, first = np.unique(b.line, return_index=True)
        stamps = np.maximum.accumulate(under(b, truth, bend)[1][first] + rng.normal(0.0, CLOCK, len(first)))
        run, found = run_of_log(b, RunLog(line, stamps, np.full((len(line), 5), np.nan), line))
        assert run is not None, found
        runs.append(run)
    begin = model("lookahead") if truth.kind == "control" else model("control").model_copy(update={"cycle": CYCLE})
    fit, _ = calibrate(runs, begin, "log.csv", machine(MACHINE))
    return fit.model if fit is not None else None


def uncalibrated(truth: CycleTimeModel, bend: float, stated: bool) -> list[tuple[str, str, bool, float, float]]:
    """Rows of the model with nothing fitted, on both seeds of each kind of program."""
    known = model("linuxcnc" if truth.kind == "linuxcnc" else "control").model_copy(update={"cycle": CYCLE})
    kind = "linuxcnc" if truth.kind == "linuxcnc" else "control"
    described = {"kind": kind, "cycle": CYCLE, "acceleration_share": 1.0, "jerk_share": 1.0, "jerk": True, "override": 1.0}
    truth = truth.model_copy(update=described | ({} if "rapid" in known.assumed else {"rapid": known.rapid}))
    rows = list[tuple[str, str, bool, float, float]]()
    for sort in SORTS:
        for seed in (0, 1):
            b = program(sort, seed)
            if stated:
                b = replace(b, tolerance=np.full(len(b), STATED))
            e, true = estimate(b, machine(MACHINE), known), under(b, truth, bend)[0]
            half = (e.band[1] - e.band[0]) / 2 / e.seconds
            rows.append((sort, "stated" if stated else "no fit", e.band[0] <= true <= e.band[1], half,
                         abs(e.seconds / true - 1.0)))
    return rows


def main(controls: int) -> None:
    """The table."""
    rng = np.random.default_rng(5)
    rows: list[tuple[str, str, bool, float, float]] = []
    refused = 0
    for number in range(controls):
        truth, bend = control(rng, number % 6)
        rows += uncalibrated(truth, bend, stated=number % 2 == 1)
        for seen in (("zigzag",), ("waves", "rapids"), ("arcs", "zigzag", "rapids"), ("turning", "waves")):
            made = fitted(seen, truth, bend, rng)
            if made is None:
                refused += 1
                continue
            for sort in SORTS:
                other = program(sort, 1)
                e, true = estimate(other, machine(MACHINE), made), under(other, truth, bend)[0]
                rows.append(
                    (
                        sort,
                        "seen" if sort in seen else "not seen",
                        e.band[0] <= true <= e.band[1],
                        (e.band[1] - e.band[0]) / 2 / e.seconds,
                        abs(e.seconds / true - 1.0),
                    )
                )
    print(f"{'programs':10}{'fit':>10}{'cases':>7}{'inside':>9}{'+- %':>8}{'off %':>8}{'worst %':>9}")
    for sort in (*SORTS, "all"):
        for known in ("seen", "not seen", "no fit", "stated"):
            of = [row for row in rows if (sort == "all" or row[0] == sort) and row[1] == known]
            if of:
                inside, half, off = (np.array([row[k] for row in of], dtype=float) for k in (2, 3, 4))
                print(
                    f"{sort:10}{known:>10}{len(of):7}{100 * inside.mean():8.1f}%"
                    f"{100 * half.mean():8.1f}{100 * off.mean():8.1f}{100 * off.max():9.1f}"
                )
    print(f"fits refused: {refused}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 6)
