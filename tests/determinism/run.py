"""The same bytes wherever they are made: `make same`.

    python -m tests.determinism.run [--python PATH ...] [--only NAME ...]

Runs all of `cases.py` once in this environment, then in each of `VARIANTS` (kinds of processor for the compiled loops, for
numpy and for BLAS; threads, hash seeds, time zones, languages), then under each PATH, an interpreter with the project
installed, and names every case whose bytes differ.
"""

from __future__ import annotations

import os
import subprocess
import sys
from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.processors import usable

ROOT = Path(__file__).parents[2]
WIDE = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL"
"""vectors of numpy's own loops, as it names them; those that a processor lacks are left out"""


def variants() -> dict[str, dict[str, str]]:
    """Environment by the name of a variant."""
    caches = ROOT / ".pytest_cache"
    processors = {f"processor {kind}": {"NUMBA_CPU_NAME": kind, "NUMBA_CPU_FEATURES": "",
                                        "NUMBA_CACHE_DIR": str(caches / f"numba-{kind}")} for kind in usable()}
    return processors | {
        "numpy without wide vectors": {"NPY_DISABLE_CPU_FEATURES": WIDE},
        "numpy without AVX2": {"NPY_DISABLE_CPU_FEATURES": f"{WIDE} AVX2 FMA3"},
        "BLAS of an old processor": {"OPENBLAS_CORETYPE": "Prescott"},
        "BLAS of Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
        "one thread": dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"),
        "four threads": dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "4"),
        "hash seed 1": {"PYTHONHASHSEED": "1"}, "hash seed 2": {"PYTHONHASHSEED": "2"},
        "Kathmandu, C": {"TZ": "Asia/Kathmandu", "LC_ALL": "C", "LANG": "C"},
        "decimal comma": {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "TZ": "Pacific/Chatham"},
        "not optimised": {"PYTHONOPTIMIZE": "1"}}


def hashes(python: str, environment: dict[str, str], quick: bool = False) -> dict[str, str]:
    """Hash by case; a case that failed has the message in its place."""
    with TemporaryDirectory() as folder:
        done = subprocess.run([python, "-m", "tests.determinism.cases", folder, *(["quick"] if quick else [])], cwd=ROOT,
                              env=os.environ | environment, capture_output=True, text=True, check=False)
    found = dict(line.split(" ", 1) for line in done.stdout.splitlines() if " " in line)
    return found if done.returncode == 0 else found | {"failed": done.stderr[-600:] or done.stdout[-600:]}


def different(wanted: dict[str, str], found: dict[str, str]) -> list[str]:
    """Cases whose bytes are others, or that were not made."""
    return sorted(name for name in wanted | found if wanted.get(name) != found.get(name))


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--python", action="append", default=[])
    parser.add_argument("--only", action="append", default=[])
    asked = parser.parse_args()
    wanted, bad = hashes(sys.executable, {}), 0
    print(f"{len(wanted)} cases")
    runs = [(name, sys.executable, what) for name, what in variants().items() if not asked.only or name in asked.only]
    for name, python, what in [*runs, *((path, path, dict[str, str]()) for path in asked.python)]:
        found = hashes(python, what)
        wrong = different(wanted, found)
        bad += bool(wrong)
        said = "the same bytes" if not wrong else f"DIFFER: {', '.join(wrong)} {found.get('failed', '')}"
        print(f"{name}: {said}", flush=True)
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
