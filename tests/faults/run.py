"""Every command that writes, under every fault (`make faults`): kills at random moments, full disks, lost folders, memory.

    python tests/faults/run.py [--count 200] [--command NAME ...] [--kind NAME ...] [--seed N]

Exit code 1 where a law of `kinds.py` is broken; each case is printed.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


def main() -> int:
    """Exit code."""
    from tests.faults.commands import commands
    from tests.faults.kinds import KINDS, bench

    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=200, help="random moments of each command and kind")
    options.add_argument("--command", action="append")
    options.add_argument("--kind", action="append", choices=list(KINDS))
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    found = 0
    with tempfile.TemporaryDirectory(prefix="postproc-faults-") as name:
        folder = Path(name)
        folder.chmod(0o755)
        for number, (title, words) in enumerate(commands(folder).items()):
            if given.command and title not in given.command:
                continue
            one = bench(words, folder / f"bench{number}")
            for kind in given.kind or KINDS:
                begun = time.perf_counter()
                faults = list(KINDS[kind](one, given.count, random.Random(f"{given.seed} {title} {kind}")))
                found += len(faults)
                print(f"{title}: {kind}: {len(faults)} faults, {time.perf_counter() - begun:.1f} s", flush=True)
                for fault in faults[:5]:
                    print(f"    {fault}", flush=True)
    print(f"{found} faults")
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
