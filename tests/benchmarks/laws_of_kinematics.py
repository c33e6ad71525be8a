"""The laws of all machines in figures: forward of inverse, rates against differences, the condition at the worst pose.

    python tests/benchmarks/laws_of_kinematics.py [POSES [MACHINE ...]]

One line a machine: poses, mm by which forward of inverse is off at worst, condition number of the Jacobian there, what
the law allows there, mm per joint by which the rates are off central differences at worst (angles at 100 mm per rad).
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import machines
from tests.laws import machines_under_law as law
from toolpaths.arrays import Floats

STEP = 1e-3
"""mm, or rad by 100 mm: of the central differences"""


def forward_of_inverse(name: str, poses: int) -> tuple[int, float, float, float]:
    """(poses, worst mm, condition number there, mm allowed there); the law holds everywhere if the last is more."""
    m = law.machine(name)
    _, tip, axis = law.poses(m, poses, calm=False)
    worst, at = 0.0, (np.nan, np.nan)
    for q in m.kinematics.inverse(tip, axis):
        real = np.flatnonzero(np.isfinite(q).all(axis=1))
        found = m.kinematics.forward(q[real], near=np.hstack([tip, axis])[real])
        off = np.abs(np.hstack([found[0] - tip[real], law.SCALE * (found[1] - axis[real])])).max(axis=1)
        off = np.where(np.isfinite(off), off, np.inf)
        k = real[[int(off.argmax())]]
        if off.max() >= worst:
            worst = float(off.max())
            at = (float(law.condition(m, q[k], tip[k], axis[k])[0]), float(law.tolerance(m, q[k], tip[k], axis[k])[0]))
    return len(tip), worst, *at


def rates_off(name: str, poses: int) -> float:
    """mm per mm, or per rad by 100 mm, that the Jacobian is off central differences at worst, at calm poses."""
    m = law.machine(name)
    _, tip, axis = law.poses(m, poses, seed=5)
    near = np.hstack([tip, axis])
    q = m.kinematics.inverse(tip, axis)[0]
    exact, worst = m.kinematics.jacobian(q, near), 0.0
    for j in range(m.kinematics.joints):
        step = np.zeros(m.kinematics.joints)
        step[j] = STEP / (law.SCALE if m.rotary[j] else 1.0)
        ahead, behind = (np.hstack(m.kinematics.forward(q + sign * step, near)) for sign in (1.0, -1.0))
        worst = max(worst, _largest((ahead - behind) / (2.0 * step[j]) - exact[:, :, j], bool(m.rotary[j])))
    return worst


def _largest(gap: Floats, rotary: bool) -> float:
    gap = np.array(gap)
    gap[:, 3:] *= law.SCALE
    return float(np.abs(gap).max(initial=0.0)) / (law.SCALE if rotary else 1.0)


def main() -> None:
    """Print the table."""
    poses = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    print(f"{'machine':24} {'poses':>7} {'worst, mm':>10} {'condition':>10} {'allowed':>9} {'rates':>9}")
    for name in sys.argv[2:] or machines.names():
        count, worst, condition, allowed = forward_of_inverse(name, poses)
        print(f"{name:24} {count:7} {worst:10.2e} {condition:10.4g} {allowed:9.2e} {rates_off(name, min(poses, 2000)):9.1e}"
              + ("" if worst <= allowed else "  BROKEN"), flush=True)


if __name__ == "__main__":
    main()
