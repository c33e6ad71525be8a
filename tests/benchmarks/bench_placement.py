"""Figures of placing: python tests/benchmarks/bench_placement.py [gain | grid | proof | long].

gain: what the place gives samples on serial and parallel machines; grid: the search compared with a grid of places that are
all planned; proof: what place says next to the conversion of both places under the ideal control; long: a
file of many points.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

import machines
import toolpaths
from machines.machine import Machine
from postproc.base.options import Options
from postproc.cycle_time.estimate import estimate
from postproc.cycle_time.model import load_model
from postproc.cycle_time.planned import planned_times
from postproc.cycle_time.source import from_conversion
from postproc.pipeline.convert import convert
from postproc.placement.place import PlacementChoice, place
from postproc.placement.place_times import Timer
from postproc.setup.model import PartPlacement, SetupFile, load_setup
from postproc.setup.place import PlacementLimits
from toolpaths.toolpath import Toolpath

SAMPLES = Path(__file__).parents[2] / "samples"
Case = tuple[str, str, str, dict[str, object]]
LEVEL: dict[str, object] = {"x": (-100.0, 100.0), "y": (-100.0, 100.0)}
FREE = LEVEL | {"turn": (0.0, 180.0)}
CASES: tuple[Case, ...] = (
    ("test_part.cls", "mill-3axis", "tools.setup.toml", FREE), ("test_part.cls", "mikron-ucp710", "tools.setup.toml", FREE),
    ("test_part.cls", "uranesx", "delta.setup.toml", FREE), ("test_part.cls", "h4a-c-table", "h4a.setup.toml", FREE),
    ("bicubic.cls", "mikron-ucp710", "tools.setup.toml", FREE), ("blade.cls", "mikron-ucp710", "tools.setup.toml", FREE),
    ("five_tilted.cls", "mikron-ucp710", "tools.setup.toml", LEVEL | {"turns": [0.0, 90.0]}),
    ("h4a_dome.cls", "h4a-c-table", "h4a.setup.toml", LEVEL | {"z": (-950.0, -800.0)}))


def slow(m: Machine) -> Machine:
    """A machine whose axes bind before the feed: a fifth of its velocity, a tenth of acceleration and jerk."""
    limits = replace(m.limits, velocity=0.2 * m.limits.velocity, acceleration=0.1 * m.limits.acceleration,
                     jerk=0.1 * m.limits.jerk)
    return replace(m, limits=limits)


def loaded(setup: str, limits: dict[str, object]) -> SetupFile:
    """A sample's set-up with limits of the place."""
    settings, found = load_setup(SAMPLES / setup)
    assert settings is not None, found
    return settings.model_copy(update={"placement": PlacementLimits.model_validate(limits)})


def placed(path: Toolpath, m: Machine, setup: SetupFile, **options: object) -> tuple[PlacementChoice, float]:
    """The choice, and the seconds that it took."""
    begin = time.perf_counter()
    choice, found = place(path, m, setup, Options(**options))
    assert choice is not None, [str(d) for d in found]
    return choice, time.perf_counter() - begin


def shown(name: str, choice: PlacementChoice, seconds: float) -> None:
    now, best = choice.found.now, choice.best
    gain = 100.0 * (1.0 - best.seconds / now.seconds)
    cuts = 100.0 * (1.0 - best.cutting / now.cutting)
    print(f"{name}: {now.seconds:.3f} -> {best.seconds:.3f} s ({gain:.2f} %), cuts {now.cutting:.3f} -> "
          f"{best.cutting:.3f} s ({cuts:.2f} %); {choice.looked} places, {choice.pruned} lost by their bound, "
          f"{choice.refused} refused, {choice.planned} cuts planned, {seconds:.1f} s", flush=True)


def gain() -> None:
    """Samples at the limits of their machines; the Delta slowed down as well, where its dexterity matters."""
    for file, name, setup, limits in CASES:
        path, _ = toolpaths.read(SAMPLES / file)
        shown(f"{file} on {name}", *placed(path, machines.load(name), loaded(setup, limits)))
    path, _ = toolpaths.read(SAMPLES / "test_part.cls")
    wide = {"x": (-250.0, 250.0), "y": (-250.0, 250.0), "turn": (0.0, 180.0)}
    shown("test_part.cls on a slow uranesx",
          *placed(path, slow(machines.load("uranesx")), loaded("delta.setup.toml", wide)))
    mill = loaded("tools.setup.toml", LEVEL | {"turn": (0.0, 90.0)})
    shown("test_part.cls on mikron-ucp710, axes chosen (auto)", *placed(path, machines.load("mikron-ucp710"), mill,
                                                                      orient="auto"))


def grid() -> None:
    """The best place found next to the best of a grid, all planned."""
    path, _ = toolpaths.read(SAMPLES / "test_part.cls")
    mill, delta = machines.load("mill-3axis"), slow(machines.load("uranesx"))
    for m, setup in ((mill, "tools.setup.toml"), (delta, "delta.setup.toml")):
        settings = loaded(setup, {"x": (-200.0, 120.0), "y": (-200.0, 120.0), "turn": (0.0, 180.0)})
        choice, seconds = placed(path, m, settings)
        timer = Timer(choice.work, choice.space, settings.joints.singular_distance)
        axes = [np.linspace(one.low, one.high, count)
                for one, count in zip(choice.space.dims, (5, 5, 1, 25, 1, 1), strict=True)]
        begin = time.perf_counter()
        times = [timer.tried(np.array(at)).seconds for at in product(*axes)]
        print(f"{m.name}: found {choice.best.seconds:.4f} s in {seconds:.1f} s, grid of {len(times)} {min(times):.4f} s in "
              f"{time.perf_counter() - begin:.1f} s: {100.0 * (choice.best.seconds / min(times) - 1.0):+.3f} %", flush=True)


def ideal(path: Toolpath, m: Machine, setup: SetupFile, part: PartPlacement) -> tuple[float, float]:
    """Planned seconds of the passes of a conversion, and of the whole program under the ideal control."""
    result = convert(path, m, setup=setup.model_copy(update={"part": part}), options=Options(feed="planned"))
    assert result.ok and result.motion is not None, result.diagnostics
    model, _ = load_model("ideal")
    assert model is not None
    blocks = from_conversion(result)
    times, _ = planned_times(result, blocks, model)
    return result.motion.seconds, estimate(blocks, m, model, times=times).seconds


def proof() -> None:
    """Cuts and savings as place says them, and as the program has them."""
    for file, name, setup, limits in CASES[:4] + CASES[6:]:
        path, _ = toolpaths.read(SAMPLES / file)
        m, settings = machines.load(name), loaded(setup, limits)
        choice, _ = placed(path, m, settings)
        before, after = (ideal(path, m, settings, part) for part in (settings.part, choice.part))
        saved = choice.found.now.seconds - choice.best.seconds
        print(f"{file} on {name}: cuts {choice.best.cutting:.3f} s, in the program {after[0]:.3f} s; saved {saved:.3f} s, "
              f"in the program {before[1] - after[1]:.3f} s", flush=True)


def long() -> None:
    """A five-axis file of 50 000 points."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "long.cls"
        subprocess.run([sys.executable, SAMPLES / "make_big.py", "50000", file, "--five-axis"], check=True)
        path, _ = toolpaths.read(file)
    shown("50 000 points", *placed(path, machines.load("mikron-ucp710"), loaded("tools.setup.toml", FREE)))


if __name__ == "__main__":
    runs = {"gain": gain, "grid": grid, "proof": proof, "long": long}
    for word in sys.argv[1:] or runs:
        runs[word]()
