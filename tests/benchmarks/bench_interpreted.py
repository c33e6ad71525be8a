"""How much longer loops take interpreted than what small inputs are done by (numpy, scipy), for those that have both forms.

    python tests/benchmarks/bench_interpreted.py

Processor seconds of each, over the same small input; the figures stand in tests/toolpaths/test_compiled.py.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
import trimesh

import machines
from machines.geometric_error.actual import actual_chain_loop, rods
from machines.geometric_error.actual.actual_chain_loop import ActualChainLoop
from machines.geometric_error.actual.actual_serial import ActualSerial
from machines.geometric_error.tables import curve_banks
from machines.geometric_error.tables.curve_banks import banks
from machines.geometric_error.tables.curves import TableCurve
from machines.kinematics import chain_loop
from postproc.collision import search
from postproc.collision.solid import solid
from postproc.feedrate import interior_packed, paths, tightening
from postproc.feedrate.interior import NumpySteps
from postproc.feedrate.windows import solve_problem
from postproc.readback.execution import frames_loop
from tests.machines.error_models import serial_errors
from tests.machines.geometric_error.test_geometric_error_rods import kinematics, platform, rod_errors, rod_frame
from tests.postproc.collision.test_collision_search import HERE, random_case
from tests.postproc.feedrate_kit import MIKRON, random_path, uniform
from toolpaths.arrays import Floats
from toolpaths.smoothing import sweep
from toolpaths.smoothing.bspline import KnotVectors
from toolpaths.smoothing.sweep import Data, Normal


def seconds(run: Callable[[], object]) -> float:
    """The least of five."""
    best = np.inf
    for _ in range(5):
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return float(best)


def compared(name: str, module: ModuleType, plain: Callable[[], object], loop: Callable[[], object]) -> None:
    """A line: both times and their ratio; `loop` runs with the module's loops as they stand."""
    given: dict[str, Any] = {key: getattr(module, key) for key in ("compiled", "wanted") if hasattr(module, key)}
    if "wanted" in given:
        module.wanted = lambda *_: False
    first = seconds(plain)
    module.compiled = lambda function: function
    if "wanted" in given:
        module.wanted = lambda *_: True
    with np.errstate(all="ignore"):
        second = seconds(loop)
    for key, value in given.items():
        setattr(module, key, value)
    print(f"{name}: {1e3 * first:.3f} ms, interpreted {1e3 * second:.1f} ms, {second / first:.0f} times")


def framed(tip: Floats) -> None:
    """A line for points (N, 3) in frames."""
    frames = np.zeros(len(tip), dtype=np.int64), np.eye(3)[None], np.zeros((1, 3)), tip
    with patch.object(chain_loop, "wanted", lambda *_: False):
        columns = seconds(lambda: frames_loop.on_table(*frames))
    interpreted = seconds(lambda: frames_loop.points_on_table(*frames))
    print(f"frames_loop.py, {len(tip)} points: {1e3 * columns:.3f} ms, interpreted {1e3 * interpreted:.1f} ms, "
          f"{interpreted / columns:.0f} times")


def main() -> None:
    """Print the table."""
    rng = np.random.default_rng(3)
    problem = uniform(random_path(4), 256).problem()
    compared("interior_packed.py, 256 knots", interior_packed, lambda: solve_problem(problem, NumpySteps),
             lambda: solve_problem(problem, interior_packed.PackedSteps))
    path, s = random_path(1), np.linspace(0.0, 100.0, 300)
    compared("paths.py, 300 places", paths, lambda: path.derivatives(s), lambda: path.derivatives(s))
    at, x = path.derivatives(s), np.abs(rng.normal(size=(3, 300))) * 1000.0
    compared("tightening.py, 300 places", tightening, lambda: tightening.worst_ratios(at, x, MIKRON, False),
             lambda: tightening.worst_ratios(at, x, MIKRON, True))
    knots = KnotVectors.clamped(np.linspace(0.0, 40.0, 40), np.array([0, 40]))
    place = np.sort(rng.uniform(0.0, 40.0, 300))
    k = knots.span(place, np.zeros(300, dtype=np.int64))
    data, c = Data(place, rng.normal(size=(300, 6)), k, knots.coefficient[k]), rng.normal(size=(knots.count, 6))

    def swept(run: Callable[..., None]) -> None:
        normal = Normal(np.zeros((6, knots.count)), np.zeros((knots.count, 6)))
        run(knots.t, data, c, np.ones(300), 1.5, np.zeros(300), normal)

    compared("sweep.py, 300 places", sweep, lambda: swept(sweep.sweep), lambda: swept(sweep.compiled_sweep))
    kin = kinematics("uranesx")
    frame, errors, (slides, where, turned) = rod_frame(kin.on_rods), rod_errors(kin), platform(kin, 300)
    compared("rods.py, 300 poses", rods, lambda: frame.solve(slides, where, turned, errors),
             lambda: frame.solve(slides, where, turned, errors))
    serial, q = machines.load("mikron-ucp710").kinematics, rng.normal(size=(300, 5))
    compared("chain_loop.py, 300 poses", chain_loop, lambda: serial.forward(q), lambda: serial.forward(q))
    tip, slides = rng.normal(size=(300, 3)), np.arange(3)
    compared("chain_loop.py, 300 tips", chain_loop, *2 * [lambda: serial.at_tip(tip, q, slides)])
    framed(tip)
    actual = ActualSerial(serial, serial_errors(serial))
    chain = ActualChainLoop.of(actual.lines)
    with patch.object(chain_loop, "wanted", lambda *_: False):
        columns = seconds(lambda: actual.place(q))
    with patch.object(actual_chain_loop, "compiled", lambda function: function), np.errstate(all="ignore"):
        interpreted = seconds(lambda: chain.poses(q, None, actual.errors, np.array(actual.tool)))
    print(f"actual_chain_loop.py, 300 poses: {1e3 * columns:.3f} ms, interpreted {1e3 * interpreted:.1f} ms, "
          f"{interpreted / columns:.0f} times")
    row = np.linspace(0.0, 400.0, 21)
    (_, bank), = banks([TableCurve(row, rng.normal(size=42), both=True) for _ in range(6)])
    at, course = rng.uniform(0.0, 400.0, 300), np.ones(300)
    compared("curve_banks.py, 300 positions", curve_banks, lambda: bank.at(at, course), lambda: bank.at(at, course))
    moving, pieces = random_case(rng)
    body = solid(trimesh.creation.icosphere(2, radius=12.0), HERE)
    compared(f"search.py, {len(moving)} moves", search, lambda: search.nearest(body, moving, pieces, 2.0),
             lambda: search.nearest(body, moving, pieces, 2.0))


if __name__ == "__main__":
    main()
