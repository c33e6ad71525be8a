"""What `convert` prints ("about") next to what `time` says, sample by sample and control by control; fails where the
executed time is outside the printed band.

    python tests/benchmarks/bench_about.py [CONTROLLER ...]
"""

from __future__ import annotations

import resource
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import postproc
from postproc.cycle_time.conversion import estimate_of
from toolpaths import read

ROOT = Path(__file__).parents[2]
CASES = (("blade.cls", "mikron-ucp710", "tools"), ("tool_axis_tour.apt", "mikron-ucp710", "tools"),
         ("five_tilted.cls", "mikron-ucp710", "tools"), ("bicubic.cls", "mikron-ucp710", "tools"),
         ("indexed_4axis.cls", "mill-4axis", "tools"), ("pocket.cls", "mill-3axis", "tools"))
CONTROLS = ("fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "generic-iso")


def processor() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main(controls: tuple[str, ...]) -> int:
    outside = 0
    print("| file | control | blocks | about s | band s | executed s | off | processor s |\n" + 8 * "|---" + "|")
    for file, machine, setup in CASES:
        path, samples = read(ROOT / "samples" / file)[0], ROOT / "samples" / f"{setup}.setup.toml"
        for control in controls:
            result = postproc.convert(path, machine, control, setup=samples)
            begin = processor()
            about = estimate_of(result)
            took = processor() - begin
            executed = estimate_of(result, executed=True)
            if about is None or executed is None:
                print(f"| {file} | {control} | not written |")
                continue
            inside = about.band[0] <= executed.seconds <= about.band[1]
            outside += not inside
            off = f"{100 * (about.seconds / executed.seconds - 1):+.1f} %{'' if inside else ' outside'}"
            band = f"{about.band[0]:.0f} to {about.band[1]:.0f}"
            print(f"| {file} | {control} | {len(about.blocks)} | {about.seconds:.1f} | {band} | {executed.seconds:.1f} | "
                  f"{off} | {took:.2f} |", flush=True)
    return outside


if __name__ == "__main__":
    raise SystemExit(main(tuple(sys.argv[1:]) or CONTROLS))
