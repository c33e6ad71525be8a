"""What `--optimise` gains, by sample, control and choice, at equal tolerance.

    python tests/benchmarks/bench_optimise.py [SAMPLE[,SAMPLE...]] [CONTROL[,CONTROL...]] [MACHINE]

Each program is proved and executed on the control's own model, as `convert --optimise` does it; modulo axes throughout.
Per line: s of the program as it is, the bound below which no choice comes (its lower bound, or on LinuxCNC the time with the
whole tolerance for points and control each), s of the optimised one, the part of what lay between that is closed, and what
was gained by what. A line below 0 would be a fault: nothing is ever slower.
"""

from __future__ import annotations

import logging
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import machines
from machines.machine import Machine
from postproc.base.options import Options
from postproc.cycle_time.conversion import program_clock
from postproc.pipeline.convert import convert
from toolpaths.cl.read import read_file

SAMPLES = ("blade", "bicubic", "five_faces", "five_tilted", "pocket", "test_part")
CONTROLS = ("linuxcnc", "siemens-840d", "heidenhain-tnc640", "fanuc-30i", "haas-ngc", "generic-iso")


def rolled_over(name: str) -> Machine:
    """With rotary axes of unlimited travel that roll over as the control has it."""
    machine = machines.load(name)
    free = np.array(machine.kinematics.rotary) & ~np.isfinite(machine.limits.lower) & ~np.isfinite(machine.limits.upper)
    turns = tuple(replace(one, modulo=True) if own else one
                  for one, own in zip(machine.turns, free.tolist(), strict=True))
    return replace(machine, turns=turns)


def gained(sample: str, control: str, machine: Machine) -> str:
    """One line of the table."""
    read = read_file(Path("samples") / f"{sample}.cls")
    made = convert(read.toolpath, machine, control, options=Options(optimise=True), clock=program_clock())
    if made.optimised is None:
        why = "; ".join(one.message for one in made.diagnostics if one.severity == "error")
        return f"{sample:12} {control:18} not made: {why[:120]}"
    found = made.optimised
    before, after, bound, closed = found.before.seconds, found.after.seconds, found.bound, (found.closed or 0.0) / 100.0
    steps = "; ".join(f"{step.what} {step.before - step.after:.2f}" for step in found.steps)
    return f"{sample:12} {control:18} {before:8.2f} {bound:8.2f} {after:8.2f} {closed:6.1%}  {steps or '-'}"


def main() -> None:
    """The table of what is named, or of all."""
    logging.disable(logging.CRITICAL)
    given = [word.split(",") for word in sys.argv[1:3]]
    samples, controls = [*given, SAMPLES, CONTROLS][0], [*given[1:], CONTROLS][0]
    machine = rolled_over(sys.argv[3] if len(sys.argv) > 3 else "mikron-ucp710")
    print(f"{'sample':12} {'control':18} {'before':>8} {'bound':>8} {'after':>8} closed  gained by, s")
    for sample in samples:
        for control in controls:
            print(gained(sample, control, machine), flush=True)


if __name__ == "__main__":
    main()
