"""Arms and rods of a rotary Delta for a cylinder, in the plane of one leg: sizing of V.6.2.1 of Company 2000.

With the motor at P = (-D/2 + r - L sin b0, H + L cos b0) the arm hangs down with the rod at b0 from square to it at the far
end of the floor (D/2, 0), and lies level with the rod at -b0 at the near end of the ceiling (-D/2, H) (V-19 and V-20):

    D = L cos b0 + r - L sin b0,   H = L sin b0 + r - L cos b0,   so r = (D + H) / 2.

b is the angle between the rod, in the plane of the arm, and the normal to the arm. What remains free is b0: the best keeps
the largest |b| over the section of the cylinder least (figures V-27, V-28).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.units import DEG

GRID, LOW, HIGH = (61, 31), 1.0 * DEG, 44.0 * DEG
"""places of the section at which b is looked at; range of b0"""
SPARE = 3.0
"""degrees of travel beyond what the box needs"""


@dataclass(frozen=True)
class CrankSizes:
    """D, H, r, L in mm, b0 and the largest |b| over the section in rad."""

    diameter: float
    height: float
    arm: float
    rod: float
    start: float
    largest: float

    @property
    def motor(self) -> tuple[float, float]:
        """P in the plane of the leg: mm outwards from the cylinder's axis (negative: behind it), mm above its floor."""
        return (-0.5 * self.diameter + self.arm - self.rod * float(np.sin(self.start)),
                self.height + self.rod * float(np.cos(self.start)))

    @property
    def figures(self) -> dict[str, Any]:
        """Units in the keys."""
        x, z = self.motor
        return {"layout": "rotary-delta", "cylinder_diameter_mm": self.diameter, "cylinder_height_mm": self.height,
                "height_per_diameter": self.height / self.diameter, "arm_mm": self.arm, "rod_mm": self.rod,
                "rod_per_arm": self.rod / self.arm, "beta0_deg": self.start / DEG, "largest_beta_deg": self.largest / DEG,
                "motor_out_mm": -x, "motor_above_floor_mm": z}


def of_bars(arm: float, rod: float, height: float) -> CrankSizes:
    """Diameter and b0 that an arm and a rod give a cylinder of a height, mm: cos b0 - sin b0 = (r - H) / L, D = 2 r - H.

    Raises:
        DiagnosticError: where there is none.
    """
    share = (arm - height) / rod
    if not (0.0 < share < 1.0 and 2.0 * arm > height):
        raise DiagnosticError([error("design.cranks", f"an arm of {arm:g} mm and a rod of {rod:g} mm have no cylinder of "
                                     f"{height:g} mm height: (arm - height) / rod is {share:.3g}, not between 0 and 1",
                                     hint="take an arm longer than the height, and a rod longer than their difference")])
    start = float(np.arccos(share / np.sqrt(2.0)) - 0.25 * np.pi)
    found = CrankSizes(2.0 * arm - height, height, arm, rod, start, 0.0)
    return CrankSizes(found.diameter, height, arm, rod, start, largest_angle(found))


def of_cylinder(diameter: float, height: float) -> CrankSizes:
    """Arm, rod and b0 for a cylinder, mm: the b0 of which the largest |b| is least.

    Raises:
        DiagnosticError: of a cylinder higher than wide, which none has.
    """
    if not height < diameter:
        raise DiagnosticError([error("design.cranks", f"a cylinder {diameter:g} mm wide and {height:g} mm high has no arm "
                                                      "and "
                                     "rod: it has to be wider than high (0.6 times as high at most, for good speeds)",
                                     hint="ask for a lower --box")])

    def sized(start: float) -> CrankSizes:
        rod = 0.5 * (diameter - height) / float(np.cos(start) - np.sin(start))
        return CrankSizes(diameter, height, 0.5 * (diameter + height), rod, start, 0.0)

    tried = np.linspace(LOW, HIGH, 200)
    k = int(np.argmin([largest_angle(sized(float(start))) for start in tried]))
    found = minimize_scalar(lambda start: largest_angle(sized(float(start))),
                            bounds=(tried[max(k - 1, 0)], tried[min(k + 1, len(tried) - 1)]), method="bounded")
    best = sized(float(found.x if found.fun < largest_angle(sized(float(tried[k]))) else tried[k]))
    return CrankSizes(diameter, height, best.arm, best.rod, best.start, largest_angle(best))


def angles_at(sizes: CrankSizes, x: Floats, z: Floats) -> Floats:
    """b (N,) rad where the joint in the plane is at (x, z) (N,) mm; NaN out of reach. The elbow is outside."""
    px, pz = sizes.motor
    across, up = x - px, z - pz
    far = np.hypot(across, up)
    with np.errstate(invalid="ignore"):
        spread = np.arccos((far**2 + sizes.arm**2 - sizes.rod**2) / (2.0 * far * sizes.arm))
        turn = np.arctan2(up, across) - spread
        foot = px + sizes.arm * np.cos(turn), pz + sizes.arm * np.sin(turn)
        out = (x - foot[0]) * np.cos(turn) + (z - foot[1]) * np.sin(turn)
        return np.asarray(np.arcsin(out / sizes.rod), dtype=np.float64)


def largest_angle(sizes: CrankSizes) -> float:
    """rad, of |b| over the section of the cylinder; a right angle where a place is out of reach."""
    sides = np.linspace(-0.5, 0.5, GRID[0]) * sizes.diameter, np.linspace(0.0, 1.0, GRID[1]) * sizes.height
    x, z = (v.ravel() for v in np.meshgrid(*sides))
    found = np.abs(angles_at(sizes, x, z))
    return float(np.nan_to_num(found, nan=0.5 * np.pi).max())


def crank_file(sizes: CrankSizes, platform: float) -> str:
    """A machine file of three such legs; its workspace is the square box in the cylinder, dynamics are assumed."""
    x, z = sizes.motor
    half = 0.5 * sizes.diameter / np.sqrt(2.0)
    radius = platform - x
    level = z - 0.5 * sizes.height
    places = [(a * half, b * half, c * 0.5 * sizes.height) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (-1, 0, 1)]
    q = np.degrees([_lowered(sizes, angle, place, radius - platform, level) for place in places
                    for angle in np.radians([-90.0, 30.0, 150.0])])
    low, high = np.floor(np.nanmin(q) - SPARE), np.ceil(np.nanmax(q) + SPARE)
    home = np.degrees(_lowered(sizes, 0.0, (0.0, 0.0, 0.0), radius - platform, level))
    lines = [
        f'description = "rotary Delta for a cylinder of {sizes.diameter:g} x {sizes.height:g} mm, dimensions by machine '
        'design"',
        "", "[kinematics]", 'kind = "legs"', 'freedoms = ["x", "y", "z"]', "", "[kinematics.layout]", 'form = "star"',
        'drive = "arm"', 'letters = ["A", "B", "C"]', "angles = [-90, 30, 150]", f"radius = {radius:.6f}",
        f"height = {level:.6f}", f"joint_radius = {platform:.6f}", f"arm = {sizes.arm:.6f}", f"rod = {sizes.rod:.6f}",
        f"pair = {2.0 * platform:.6f}", "root = -1", "", "[kinematics.workspace]", f"x = [{-half:.3f}, {half:.3f}]",
        f"y = [{-half:.3f}, {half:.3f}]", f"z = [{-0.5 * sizes.height:g}, {0.5 * sizes.height:g}]", ""]
    for letter in "ABC":
        lines += [f"[axes.{letter}]", f"travel = [{low:g}, {high:g}]", "velocity = 400", "acceleration = 8000",
                  "jerk = 200000", f"home = {home:.3f}", 'assumed = ["travel", "velocity", "acceleration", "jerk"]', ""]
    lines += ["[control]", 'rapids = "straight"', "", "[timing]", "tool_change = 5", "clamp = 0", "unclamp = 0",
              'assumed = ["tool_change", "clamp", "unclamp"]']
    return "\n".join(lines) + "\n"


def _lowered(sizes: CrankSizes, angle: float, place: tuple[float, float, float], out: float, height: float) -> float:
    """rad below level of the arm in direction `angle`, its motor `out` mm from the axis in the contracted model."""
    along = place[0] * np.cos(angle) + place[1] * np.sin(angle) - out
    aside = -place[0] * np.sin(angle) + place[1] * np.cos(angle)
    up = place[2] - height
    far = np.hypot(along, up)
    inside = (far**2 + sizes.arm**2 - (sizes.rod**2 - aside**2)) / (2.0 * far * sizes.arm)
    return float(-(np.arctan2(up, along) + np.arccos(np.clip(inside, -1.0, 1.0))))
