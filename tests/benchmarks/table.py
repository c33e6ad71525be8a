"""Time and memory of every command on long five-axis files, as ratios to LinuxCNC's interpreter reading the same program.

    python tests/benchmarks/table.py [POINTS ...] [--machine NAME] [--repeats K] [--page FILE.md]

The files are those of `blade_passes.py`, another seed for each size. Every figure comes from processes of their own, the
least of K runs, the interpreter (rs274 on LinuxCNC's output) timed between them. With several sizes the exponents of time
and memory between them are printed, too.
"""

from __future__ import annotations

import argparse
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).parents[2]
ERRORS = ROOT / "samples" / "errors" / "mikron-ucp710.toml"


@dataclass(frozen=True)
class Cost:
    """Processor and wall seconds, and the peak of memory in 10^6 bytes, of a command; `ok`: it ended with 0."""

    used: float
    wall: float
    peak: float
    ok: bool


def cost(command: list[str], folder: Path) -> Cost:
    """Run a command in a process of its own."""
    begun = time.perf_counter()
    env = os.environ | {"HOME": str(folder), "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=env)
    _, status, used = os.wait4(process.pid, 0)
    return Cost(used.ru_utime + used.ru_stime, time.perf_counter() - begun, used.ru_maxrss * 1024 / 1e6, status == 0)


def commands(source: str, machine: str) -> dict[str, list[str]]:
    """What is timed, by name; programs are written next to the file."""
    setup, post = f"{source}.setup.toml", [sys.executable, "-m", "postproc"]
    job = [f"{source}.cls", "-m", machine, "-c", "linuxcnc", "--setup", setup]
    known = {
        "convert": [*post, "convert", *job, "-o", f"{source}.ngc"],
        "convert, planned feed": [*post, "convert", *job, "-o", f"{source}-planned.ngc", "--feed", "planned"],
        "convert, errors corrected": [*post, "convert", *job, "-o", f"{source}-errors.ngc", "--error-model", str(ERRORS)],
        "verify": [*post, "verify", f"{source}.ngc", *job],
        "time": [*post, "time", *job],
        "inspect": [*post, "inspect", f"{source}.cls"],
        "place": [*post, "place", f"{source}.cls", "-m", machine, "--setup", setup, "-o", f"{source}-placed.toml"],
    }
    return known if machine == "mikron-ucp710" else {k: v for k, v in known.items() if k != "convert, errors corrected"}


def interpreter(source: str, folder: Path) -> list[str]:
    """rs274 on the program; its tool table is in inches."""
    table, variables = folder / "tools.tbl", folder / "variables"
    table.write_text("T1 P1 Z4.6614 D0\n", encoding="ascii")
    variables.touch()
    return ["rs274", "-g", "-n", "2", "-t", str(table), "-v", str(variables), f"{source}.ngc", str(folder / "canonical")]


def measured(points: int, machine: str, repeats: int, only: str) -> dict[str, Cost]:
    """The least of each command, of a file of so many points."""
    found: dict[str, Cost] = {}
    with tempfile.TemporaryDirectory() as name:
        folder, source = Path(name), str(Path(name, "blade"))
        writer = [sys.executable, str(ROOT / "tests/benchmarks/blade_passes.py"), str(points), f"{source}.cls"]
        cost([*writer, "--seed", str(points % 997)], folder)
        if not cost(commands(source, machine)["convert"], folder).ok:
            raise SystemExit(f"{machine} does not convert the file")
        for _ in range(repeats):
            for what, command in commands(source, machine).items():
                if only in what:
                    _keep(found, what, cost(command, folder))
            if shutil.which("rs274"):
                _keep(found, "rs274", cost(interpreter(source, folder), folder))
    return found


def _keep(found: dict[str, Cost], what: str, new: Cost) -> None:
    old = found.get(what)
    found[what] = new if old is None else Cost(min(old.used, new.used), min(old.wall, new.wall), min(old.peak, new.peak),
                                               old.ok and new.ok)


def table(sizes: list[int], all_found: list[dict[str, Cost]], machine: str) -> list[str]:
    """Lines of a page."""
    lines = ["# Time and memory of long files", "",
             f"`python tests/benchmarks/table.py {' '.join(map(str, sizes))}`: {machine}, five axes, part off the rotary "
             f"axes, {os.cpu_count()} processors. Ratios: processor and wall time of the command over those of LinuxCNC's "
             "`rs274` reading the program, in the same run."]
    for points, found in zip(sizes, all_found, strict=True):
        base = found.get("rs274")
        lines += ["", f"## {points:,} points", "", "| command | processor, s | x rs274 | wall, s | x rs274 | peak, MB |",
                  "|---|---|---|---|---|---|"]
        for what, one in found.items():
            used, wall = (f"{one.used / base.used:.2f}", f"{one.wall / base.wall:.2f}") if base else ("", "")
            lines.append(f"| {what}{'' if one.ok else ' (refused)'} | {one.used:.2f} | {used} | {one.wall:.2f} | {wall} "
                         f"| {one.peak:.0f} |")
    for (few, first), (many, last) in pairwise(zip(sizes, all_found, strict=True)):
        lines += ["", f"## Exponents from {few:,} to {many:,} points", "", "| command | time | memory |", "|---|---|---|"]
        grown = math.log(many / few)
        lines += [f"| {what} | {math.log(last[what].used / one.used) / grown:.2f} | "
                  f"{math.log(last[what].peak / one.peak) / grown:.2f} |" for what, one in first.items() if what in last]
    return lines


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("points", type=int, nargs="*", default=[100_000])
    parser.add_argument("--machine", default="mikron-ucp710")
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--only", default="", help="commands whose name has this in it")
    parser.add_argument("--page", type=Path, help="file that the table is written to")
    options = parser.parse_args()
    found = [measured(points, options.machine, options.repeats, options.only) for points in options.points]
    lines = table(options.points, found, options.machine)
    print("\n".join(lines))
    if options.page:
        options.page.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
