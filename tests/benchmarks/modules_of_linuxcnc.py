"""LinuxCNC's modules lineardeltakins, rotarydeltakins, genhexkins and pentakins, as installed, against our inverse.

    python tests/benchmarks/modules_of_linuxcnc.py [POSES]

One line a module: poses, and how far its joints are from ours at worst, mm or degrees. `tests/linuxcnc/test_modules.py`
holds 1e-6 at 200 poses.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.linuxcnc.test_modules import APART


def main() -> None:
    """Print the table."""
    poses = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000
    for module, worst in APART.items():
        print(f"{module:28} {poses:7} poses  {worst(poses):.1e} mm or degrees", flush=True)


if __name__ == "__main__":
    main()
