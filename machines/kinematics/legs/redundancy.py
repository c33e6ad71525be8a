"""What a pose leaves open on a machine on legs: the spin of a platform that turns in every direction, and carriers of one
that moves in every direction by itself.

Spin is the turn of the tool about its own axis, which a round tool does not notice. Carriers under (or over) a platform with
three translations of its own are a machine in series with a machine: the macro and the micro part of Company 2000, IV.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from machines.kinematics.base import SPIN, as_points
from machines.kinematics.legs.poses import PosesOfLegs
from toolpaths.arrays import Floats

SPUN = np.deg2rad(75.0)
"""rad: beyond it the platforms of six-axis machines are near singular positions (a Gough platform at a quarter turn)"""
ACROSS = 1e-9
"""part of a carrier's direction that is none"""


@dataclass(frozen=True, eq=False)
class RedundantLegs(PosesOfLegs):
    """Attributes as of `PosesOfLegs`.

    Attributes:
        spin_free: the spin is an open parameter, not held at 0
        spins: rad, that `inverse` gives branches for; () 0 alone
    """

    spin_free: bool = False
    spins: tuple[float, ...] = ()

    @cached_property
    def branches(self) -> int:  # type: ignore[override]  # nothing assigns it
        """See `PosesOfLegs`; so many for each spin"""
        own = len(self.loops.drives.root_choices()) if self.all_roots else 1
        return own * max(len(self.spins), 1)

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0, near: Floats | None = None) -> Floats:
        """See the base class."""
        if not self.spins:
            return super().inverse(tip, axis, spin, near)
        return np.concatenate([super(RedundantLegs, self).inverse(tip, axis, spin + more, near) for more in self.spins])

    @cached_property
    def open_parameters(self) -> tuple[str, ...]:
        """See the base class."""
        carriers = [self.axis_names[j] for j in self.carriers_at] if self.carried_twice else []
        return (*([SPIN] if self.spin_free else []), *carriers)

    @cached_property
    def parameters_apart(self) -> Floats:
        """See the base class: SPUN of the spin; of carriers what leaves the platform, at rest in the middle, in its
        workspace, whatever the others do."""
        spin = [SPUN] if self.spin_free else []
        if not self.carried_twice:
            return np.array(spin)
        room, along = 0.5 * (self.workspace.upper - self.workspace.lower), np.abs(self.carriers)
        each = np.where(along > ACROSS, room / np.maximum(along.sum(axis=0), ACROSS), np.inf)
        return np.array([*spin, *each.min(axis=1)])

    def parameters_at(self, q: Floats) -> Floats:
        """See the base class."""
        q = as_points(q, self.joints, "q")
        spin = self.pose(q)[2][:, None] if self.spin_free else np.empty((len(q), 0))
        return np.hstack([spin, q[:, self.carriers_at] if self.carried_twice else np.empty((len(q), 0))])

    def inverse_with(self, tip: Floats, axis: Floats, parameters: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        parameters = as_points(parameters, len(self.open_parameters), "parameters")
        return self.joints_with(tip, axis, parameters[:, 0] if self.spin_free else 0.0,
                            parameters[:, int(self.spin_free):] if self.carried_twice else None)

    def with_free_spin(self) -> Self:
        """See the base class: of a platform that turns in every direction."""
        return replace(self, spin_free=True) if self.loops.turns == "abc" and self.loops.holds is None else self

    def with_spins(self, spins: tuple[float, ...]) -> Self:
        """See the base class: of a platform that turns in every direction."""
        return replace(self, spins=spins) if self.loops.turns == "abc" and self.loops.holds is None else self
