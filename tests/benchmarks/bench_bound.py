"""The printed bound next to a denser sampling of every block: python -m tests.benchmarks.bench_bound [TIMES]

TIMES as many places in each block as the conversion looks at (1000 times unless given), on programs of every
kind: straight joints, straight tips, tilted planes, arcs, rods, machines with errors. The bound is never
    below the worst seen.
"""

from __future__ import annotations

import sys

from postproc.readback.execution.poses import SAMPLES
from tests.postproc.readback import test_deviation_bound as law

ARITHMETIC = 1e-9
"""mm or rad that double precision may leave where the program is right to the last bit"""


def main() -> None:
    """Print a row for each program."""
    law.DENSE = int(sys.argv[1] if len(sys.argv) > 1 else 1000) * len(SAMPLES)
    made = [(which, law.program) for which in law.PROGRAMS] + [(which, law.corrected) for which in law.ERRORS]
    for which, convert in made:
        result = convert(*which)
        found, (tip, axis) = result.comparison, law.dense(result)
        more = f"{100.0 * (found.tip_bound / tip - 1.0):+.2f} %" if tip > ARITHMETIC else "arithmetic"
        print(f"{' '.join(which):55s} tip: bound {found.tip_bound:.3e} mm, dense {tip:.3e} ({more}), seen by the "
              f"conversion {found.worst_tip:.3e}; axis: bound {found.axis_bound:.3e} rad, dense {axis:.3e}", flush=True)
        if tip > found.tip_bound + ARITHMETIC or axis > found.axis_bound + ARITHMETIC:
            raise SystemExit("above the bound")


if __name__ == "__main__":
    main()
