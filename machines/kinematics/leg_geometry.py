"""The legs of a platform as plain numbers, whatever kind of machine they carry: what proofs over a workspace need.

Source of the law of one leg: Company 2000, II-7, II-8 (slides); the same closure for arms and rods of changing length.
"""

from __future__ import annotations

from typing import Literal, cast

import numpy as np

from machines.kinematics.holds import Holds
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

TurnLetters = Literal["", "a", "b", "c", "abc"]
"""turns about x, y and z that legs leave a platform"""


@dataclass(frozen=True, eq=False)
@arrays(points="K 3", directions="K 3", arms="K 3", lengths="K", roots="K", slide="K", arm="K", joints="K 3", pairs="K 3",
        gauge="3", carriers="M 3", kept="K 3", rings="K")
class LegGeometry:
    """K legs under a platform, in the machine frame, mm.

    Attributes:
        names: letters of the drives
        points: (K, 3) foot at q = 0, of an arm a point of its axis
        directions: (K, 3) unit vectors of slides, axes of arms
        arms: (K, 3) from the axis to the foot at q = 0; 0 of all that are no arms
        lengths: (K,) rods, of a leg of changing length at q = 0
        roots: (K,) the sign of (A - B).A'
        slide, arm: (K,) what drives the leg; neither: its length
        joints: (K, 3) platform joints from the reference point, platform level
        pairs: (K, 3) from one rod of a leg to its other; 0 of a single rod
        freedoms: letters of what the legs leave the platform, x y z and a b c
        gauge: (3,) gauge point from the reference point, platform level
        carrier_names, carriers: slides under legs and platform, or under the part, and how they move the tool
        workspace: of the reference point and the tilt
        head: True where an axis between platform and spindle turns the tool: its tip is not at rest on the platform
        kept: (K, 3) mm from the hinge of a bar, which keeps its direction, to the joint of its leg; `joints` are then the
            hinges. None without bars
        bars: the number of the bar that each leg holds, -1 of none; () without bars
        holds: what holds the platform besides legs and pairs: all six are then its freedoms, of which some follow
        free: those that the drives set by themselves where others follow; () all
        rings: (K,) mm about z of the platform, round the joints, on whose nearest points the legs end; None without any
    """

    names: tuple[str, ...]
    points: Floats
    directions: Floats
    arms: Floats
    lengths: Floats
    roots: Floats
    slide: Bools
    arm: Bools
    joints: Floats
    pairs: Floats
    freedoms: tuple[str, ...]
    gauge: Floats
    carrier_names: tuple[str, ...]
    carriers: Floats
    workspace: Workspace
    head: bool = False
    kept: Floats | None = None
    bars: tuple[int, ...] = ()
    holds: Holds | None = None
    free: tuple[str, ...] = ()
    rings: Floats | None = None

    @property
    def turns(self) -> TurnLetters:
        """The turns among the freedoms."""
        return cast(TurnLetters, "".join(name for name in self.freedoms if name in "abc"))

    @property
    def tilts_everywhere(self) -> bool:
        """True of a platform that turns about x, y and z: its tool tilts in every direction."""
        return len(self.turns) == len("abc")

    @property
    def axis_asked(self) -> bool:
        """False of a platform whose turns all follow from its place."""
        return bool(self.turns) and (not self.free or bool(set(self.free) & set("abc")))

    @property
    def carried_twice(self) -> bool:
        """True where carriers move the tool where the platform moves it too: poses are those seen from the carriers."""
        return bool(self.carrier_names) and set("xyz") <= set(self.free or self.freedoms)

    @property
    def plain(self) -> bool:
        """True without bars, a turn about z alone, and carriers that are redundant."""
        return self.kept is None and self.turns != "c" and not self.carried_twice and self.holds is None

    @property
    def lever(self) -> float:
        """mm per rad that makes turns lengths: the longest platform joint."""
        return max(float(np.linalg.norm(self.joints, axis=1).max(initial=0.0)), 1.0)


def pairs_of(count: int, leg: Ints, shift: Floats) -> Floats:
    """(K, 3) mm from one rod to the other of each of `count` legs, of rods `leg` (R,) at `shift` (R, 3); 0 of single."""
    pairs = np.zeros((count, 3))
    for k in range(count):
        own = shift[np.asarray(leg) == k]
        if len(own) == 2:
            pairs[k] = own[0] - own[1]
    return pairs
