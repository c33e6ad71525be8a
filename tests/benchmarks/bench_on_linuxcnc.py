"""Choices of the post on LinuxCNC's simulator: limits kept, time foretold, nothing slower than what it replaces.

    python tests/benchmarks/bench_on_linuxcnc.py feeds [PATH ...]      ten paths, programmed and planned words
    python tests/benchmarks/bench_on_linuxcnc.py axes [PART ...]       five parts, tool axes of the file and `--orient auto`

Of each program: s on the simulator, the same as `time` says, largest shares of velocity and acceleration that an axis uses
in any servo cycle, and where.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import toolpaths
from machines.machine import Timing
from postproc.base.options import FeedSource, Options
from postproc.cycle_time.conversion import program_clock
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from tests.linuxcnc.simulator import Run, recorded
from tests.postproc.kit import SAMPLES, good, machine, tool_setup, toolpath
from tests.postproc.planning.test_planned_feed import wave
from tests.postproc.planning.test_word_feeds import PATHS
from toolpaths.diagnostics import has_errors
from toolpaths.units import DEG

sys.path.insert(0, str(SAMPLES))
import orientation as samples  # found on the path set above

CYCLE = 1e-3
TOOLS = {int(number): (tool.gauge_length or 0.0, 6.0) for number, tool in tool_setup().tools.items()}
SAMPLED = {"bicubic": "mikron-ucp710", "five_tilted": "mikron-ucp710", "pocket": "mill-3axis"}
Make = Callable[[FeedSource], PostResult]


def converted(path: toolpaths.Toolpath, name: str, feed: FeedSource) -> PostResult:
    still = replace(machine(name), timing=Timing())  # the simulator changes tools and clamps axes in no time
    return good(convert(path, still, "linuxcnc", tool_setup(), Options(feed=feed), clock=program_clock("linuxcnc")))


def paths() -> dict[str, Make]:
    found: dict[str, Make] = {}
    for name, (of, count, rate) in PATHS.items():
        lines = wave(count)
        cl = toolpath("RAPID", lines[0], f"FEDRAT/MMPM,{rate}", *lines[1:])
        found[name] = lambda feed, cl=cl, of=of: converted(cl, of, feed)
    corner = toolpath("RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,6000", "GOTO/80,0,50", "GOTO/80,60,50", "GOTO/20,60,40")
    found["lines and corner"] = lambda feed: converted(corner, "mill-3axis", feed)
    for name, of in SAMPLED.items():
        found[name] = lambda feed, name=name, of=of: converted(toolpaths.read(SAMPLES / f"{name}.cls")[0], of, feed)
    return found


def shares(of: Run, made: PostResult) -> str:
    """Largest shares of velocity and acceleration, with axis and second."""
    limits, words = made.machine.limits, list[str]()
    rates = np.diff(of.joints * np.where(np.array(made.machine.rotary), DEG, 1.0), axis=0) / CYCLE
    for used in (np.abs(rates / limits.velocity), np.abs(np.diff(rates, axis=0) / CYCLE / limits.acceleration)):
        at = np.unravel_index(int(used.argmax()), used.shape)
        words.append(f"{used[at]:.3f} ({made.machine.axis_names[int(at[1])]} at {at[0] * CYCLE:.2f} s)")
    return "  ".join(words)


def run(name: str, what: str, made: PostResult) -> float:
    """s of the program on the simulator; prints its line."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "p.ngc"
        file.write_text(made.text)
        found = recorded(made.machine, file, TOOLS)
    foretold = program_clock("linuxcnc")(made).seconds
    print(f"{name:18}{what:12}{found.seconds:9.3f} s, foretold {foretold:9.3f} ({foretold / found.seconds - 1.0:+.2%})  "
          f"{shares(found, made)}  {'uncertain' if found.uncertain else ''} {' '.join(found.errors)}", flush=True)
    return found.seconds


def feeds(*chosen: str) -> None:
    for name, make in paths().items():
        if not chosen or name in chosen:
            before = run(name, "programmed", make("programmed"))
            print(f"{name:18}planned / programmed {run(name, 'planned', make('planned')) / before:.4f}", flush=True)


def axes(*chosen: str) -> None:
    still = replace(machine("mikron-ucp710"), timing=Timing())
    for name, part in samples.PARTS.items():
        if chosen and name not in chosen:
            continue
        path, found = toolpaths.read_bytes(part()[0].encode(), file=f"{name}.cls")
        assert not has_errors(found), found
        seconds = [run(name, plan, good(convert(path, still, "linuxcnc", tool_setup(), Options(orient=plan, feed="planned"),
                                                clock=program_clock("linuxcnc")))) for plan in ("keep", "auto")]
        print(f"{name:18}auto / keep {seconds[1] / seconds[0]:.4f}", flush=True)


if __name__ == "__main__":
    {"feeds": feeds, "axes": axes}[sys.argv[1]](*sys.argv[2:])
