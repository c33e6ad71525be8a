"""Calibration: rank, condition number, uncertainty against set-ups, coverage of the stated bounds, what is
left, the whole loop.

    python -m tests.benchmarks.bench_calibration [TRIALS]

n = 12 steps, readings simulated with 0.1 arcsec of noise; `left` is the largest residual without noise. The
loop is that of samples/calibration: tip deviation of the true machine at 2000 poses before and after
correction by the model found.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import machines
from machines.calibration.calibrate import calibrate
from machines.calibration.reversal import conditioning, identify
from machines.calibration.rotary_bench import Bench
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load
from samples.calibration.rotary_readings import simulate
from toolpaths.arrays import Floats
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[2] / "samples" / "calibration"
ARCSEC, STEPS, NOISE = DEG / 3600.0, 12, 0.1
TRIALS = 1000


def closed(rng: np.random.Generator) -> Floats:
    """A signature (n,) in arcsec that sums to 0."""
    values = 5.0 * rng.normal(size=STEPS)
    return np.asarray(values - values.mean())


def reversal(trials: int) -> None:
    """Print what m set-ups give."""
    rng, bench = np.random.default_rng(11), Bench(STEPS)
    axis, indexer = closed(rng), closed(rng)
    torsors = np.zeros((2, STEPS, 6))
    torsors[:, :, 5] = np.array([axis, indexer]) * ARCSEC
    print(f"n = {STEPS}, {NOISE} arcsec, {trials} trials; left in arcsec\n"
          "   m  rank  condition   sigma   error  inside 95 %      left")
    for m in range(1, STEPS + 1):
        known = conditioning(STEPS, m)
        clean = simulate(bench, torsors[0], torsors[1], np.zeros((m, 3, 6)))[:, :, 5] / ARCSEC
        left = np.nanmax(np.abs(identify(clean, NOISE).residuals))
        if known.rank < known.unknowns:
            print(f"{m:4} {known.rank:5} {known.condition_number:10.4f}   not distinguished")
            continue
        found = [identify(clean + NOISE * rng.normal(size=clean.shape), NOISE) for _ in range(trials)]
        off = np.array([np.concatenate([f.axis - axis, -f.indexer - indexer]) for f in found])
        sigma = np.concatenate([found[0].axis_sigma, found[0].indexer_sigma])
        inside = np.mean(np.abs(off) < 1.959964 * sigma)
        print(f"{m:4} {known.rank:5} {known.condition_number:10.4f} {np.sqrt(np.mean(sigma**2)):7.4f} "
              f"{np.sqrt(np.mean(off**2)):7.4f} {100.0 * inside:11.1f} {left:10.1e}")


def loop() -> None:
    """Print the deviation of the sample's machine before and after."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(shutil.copytree(SAMPLES, Path(name) / "c"))
        for source, target in (("reversal.toml", "axis"), ("probe.toml", "machine")):
            found, _ = calibrate(folder / source)
            assert found is not None and found.model is not None
            save(replace(found.model, name=target), folder)
        machine = machines.load("mikron-ucp710")
        truth, model = load(folder / "truth.toml", machine), load(folder / "machine.toml", machine)
    kin, rng, n = machine.kinematics.with_tool(90.0), np.random.default_rng(12), 2000
    q = np.column_stack([rng.uniform(-100.0, 100.0, (n, 3)), rng.uniform(-0.4, 1.5, n), rng.uniform(-3.0, 3.0, n)])
    tip, axis = kin.forward(q)
    actual, corrected = truth.on(kin), correct(model.on(kin), q, tip, axis)
    print("loop, tip in um and axis in arcsec, largest (root mean square)")
    for what, joints in (("before", q), ("after", corrected.q)):
        placed = actual.place(joints)
        off, turned = np.linalg.norm(placed[0] - tip, axis=1) * 1e3, np.linalg.norm(placed[1] - axis, axis=1) / ARCSEC
        print(f"{what:7} {off.max():7.2f} ({np.sqrt(np.mean(off**2)):.2f})  {turned.max():7.2f} "
              f"({np.sqrt(np.mean(turned**2)):.2f})")


if __name__ == "__main__":
    reversal(int(float(sys.argv[1])) if len(sys.argv) > 1 else TRIALS)
    loop()
