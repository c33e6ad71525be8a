"""What a kind does not give itself: the defaults agree with what built-in kinds know better."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from machines.kinematics.base import Kinematics
from machines.kinematics.legs.on_legs import OnLegs
from tests.laws import machines_under_law as law
from tests.machines.own_kinds import own_machine

NAMES = ["mikron-ucp710", "nutating-head", "fork-head-ab", "mill-3axis", "uranesx", "h4a-c-table", "h4a-spindle-axis"]


@dataclass(frozen=True, eq=False)
class Bare(Kinematics):
    """A built-in machine of which only inverse and forward are known."""

    known: Kinematics

    @property
    def axis_names(self):
        return self.known.axis_names

    @property
    def rotary(self):
        return self.known.rotary

    @property
    def branches(self):
        return self.known.branches

    def inverse(self, tip, axis, spin=0.0, near=None):
        return self.known.with_tool(self.tool_length).inverse(tip, axis, spin, near)

    def forward(self, q, near=None):
        return self.known.with_tool(self.tool_length).forward(q, near)


def places(name: str, n: int) -> tuple[Kinematics, Bare, np.ndarray]:
    m = law.machine(name)
    q = law.poses(m, n, seed=3)[0]
    return m.kinematics, Bare(m.kinematics), q


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("name", NAMES)
def test_rates_by_differences(name: str) -> None:
    known, bare, q = places(name, 400)
    size = np.abs(known.jacobian(q)).max()
    np.testing.assert_allclose(bare.jacobian(q), known.jacobian(q), rtol=0, atol=1e-9 * size)
    assert (bare.singular(q) == known.singular(q)).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_tool_that_a_kind_takes_from_its_field(name: str) -> None:
    known, bare, q = places(name, 100)
    np.testing.assert_array_equal(bare.with_tool(80.0).forward(q)[0], known.with_tool(80.0).forward(q)[0])
    assert bare.tool_length == 0.0 and bare.with_tool(80.0).with_tool(0.0).tool_length == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_moves_looked_at(name: str) -> None:
    """Value and derivatives are those of the kind; the third is at least half of what is seen densely."""
    known, bare, q = places(name, 200)
    step = np.where(known.rotary, 0.02, 2.0)
    q1 = q + np.random.default_rng(1).uniform(-1.0, 1.0, q.shape) * step
    dense = np.stack([np.hstack(known.forward(q + t * (q1 - q))) for t in np.linspace(0.0, 1.0, 25)])
    good = np.isfinite(dense).all(axis=(0, 2))
    q, q1, dense = q[good], q1[good], dense[:, good]
    third = np.diff(dense, n=3, axis=0) * 24.0**3
    for k, (own, found) in enumerate(zip(known.jets(q, q1), bare.jets(q, q1), strict=True)):
        part = slice(3 * k, 3 * k + 3)
        for what, atol in (("value", 1e-9), ("first", 1e-7), ("second", 1e-5)):
            one, other = (np.stack([np.broadcast_to(c, len(q)) for c in getattr(jet, what)], axis=1) for jet in (own, found))
            np.testing.assert_allclose(other, one, rtol=0, atol=atol * max(1.0, np.abs(one).max()))
        assert (found.third >= np.linalg.norm(third[:, :, part], axis=2).max(axis=0) - 1e-4).all()


@pytest.mark.parametrize("name", ["mikron-ucp710", "mill-3axis", "uranesx"])
def test_slides_that_bring_the_tip_there(name: str) -> None:
    known, bare, q = places(name, 200)
    slides = np.flatnonzero(~np.array(known.rotary))
    tip = known.forward(q)[0] + [3.0, -2.0, 1.5]
    exact = known.at_tip(tip, q, slides)
    np.testing.assert_allclose(bare.at_tip(tip, q, slides), exact, rtol=0, atol=1e-6)
    assert np.isnan(bare.at_tip(tip + 1e6, q, slides)).all() or not isinstance(known, OnLegs)


def test_nothing_of_it_is_called_proved() -> None:
    _, bare, q = places("mikron-ucp710", 5)
    assert not bare.jets_proved and not bare.straight_slides and all(bare.turns_tool) and not bare.axes_with_errors
    assert np.isnan(bare.pose(q)[2]).all() and bare.singular_names == () and bare.workspace is None
    for refused, words in ((lambda: bare.axis_line("A"), "not known"), (lambda: bare.with_pivots({}), "no pivots"),
                           (lambda: bare.with_errors(None), "cannot be modelled")):
        with pytest.raises(ValueError, match=words):
            refused()


def test_under_tip_control_linear_joints_turn_the_tool() -> None:
    """Even where the control solves for the very joint that tilts it; with the axis held still it would be degrees off."""
    kin = own_machine("tilting").kinematics.with_tool(50.0)
    q0, q1 = np.array([[0.0, 0, 100, -60], [10, 5, 90, 20]]), np.array([[20.0, 30, 110, 100], [10, 40, 95, 20.0]])
    tip0, tip1 = kin.forward(q0)[0], kin.forward(q1)[0]
    for solved in (np.array([0, 1, 2]), np.array([0, 2, 3])):
        tip, axis = kin.tip_jets(q0, q1, tip0, tip1, solved)
        assert not kin.tip_jets_proved(solved) and not replace(kin, arm=300.0).tip_jets_proved(solved)
        for t in (0.3, 0.5, 0.7):
            q = kin.at_tip(tip0 + t * (tip1 - tip0), q0 + t * (q1 - q0), solved)
            there, along = kin.forward(q)
            h = t - 0.5
            for jet, seen in ((tip, there), (axis, along)):
                value, first, second = (np.stack([np.broadcast_to(c, 2) for c in v], axis=1) for v in (
                    jet.value, jet.first, jet.second))
                off = np.linalg.norm(value + h * first + 0.5 * h * h * second - seen, axis=1)
                assert (off <= jet.third * abs(h) ** 3 / 6.0 + 1e-7).all()
    assert np.linalg.norm(kin.forward(q0)[1] - kin.forward(q1)[1], axis=1).max() > 0.3
