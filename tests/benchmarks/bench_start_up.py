"""Processor time of fresh processes, in turns: a small conversion, a misspelt controller, `--help`; and the import of numpy
and pydantic alone, to which the others are ratios that a loaded machine leaves as they are. Bytecode is compiled first.

    python tests/benchmarks/bench_start_up.py [TURNS]
"""

from __future__ import annotations

import compileall
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[2]
CONVERT = ("-m", "postproc", "convert", "samples/five_faces.cls", "-q", "-m", "mikron-ucp710", "-c")
WITHOUT = {"PYTHONDONTWRITEBYTECODE", "POSTPROC_KINDS"}


def seconds(arguments: tuple[str, ...], code: int) -> float:
    """User and system time of Python with these arguments, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    given = {name: value for name, value in os.environ.items() if name not in WITHOUT}
    done = subprocess.run([sys.executable, *arguments], cwd=ROOT, env=given, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode == code, done.stderr
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    turns = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for room in ("toolpaths", "machines", "postproc"):
        compileall.compile_dir(ROOT / room, quiet=1)
    with tempfile.TemporaryDirectory() as folder:
        out = ("-o", str(Path(folder) / "x.nc"))
        cases = {"numpy, pydantic": (("-c", "import numpy, pydantic"), 0), "convert": ((*CONVERT, "fanuc-30i", *out), 0),
                 "misspelt": ((*CONVERT, "fanuc", *out), 1), "--help": (("-m", "postproc", "--help"), 0)}
        taken = {name: list[float]() for name in cases}
        for _ in range(turns):
            for name, case in cases.items():
                taken[name].append(seconds(*case))
    alone = median(taken["numpy, pydantic"])
    print(f"{'':16} best s  median s  to the import alone")
    for name, some in taken.items():
        print(f"{name:16} {min(some):6.3f}  {median(some):8.3f}  {median(some) / alone:.2f}")


if __name__ == "__main__":
    main()
