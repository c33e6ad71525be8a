"""Platforms of which something follows: the check stands where the machine does, and rejects what does not hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from hashlib import sha256
from typing import Any

import numpy as np
import pytest

import machines
from machines.analysis.certify import Wanted, _asked
from machines.certificate.certificate_file import FORM, geometry_table
from machines.certificate.following import FollowingMotion, following
from machines.certificate.lookup import key_of
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import Span
from machines.loader import values_of_machine
from postproc.certificate_check.balls import Ball
from postproc.certificate_check.boxes import Rejected
from postproc.certificate_check.check import confirmed
from postproc.certificate_check.held import StandingPlatform, pose_of
from postproc.certificate_check.machine_file import about

Content = dict[str, Any]
HELD = ["tripod-head", "tricept", "linuxcnc-pentapod"]
PLACES = {"tripod-head": [[-40.0, 20.0, -30.0], [40.0, 60.0, 30.0]],
          "tricept": [[200.0, -80.0, 200.0], [260.0, -20.0, 260.0]],
          "linuxcnc-pentapod": [[-20.0, 120.0, 500.0], [20.0, 160.0, 540.0]]}
"""mm: a small box of tips"""


@cache
def content(name: str) -> Content:
    """Two halves of a small part of the workspace, stated as far as the margin."""
    m = machines.load(name)
    legs = m.kinematics.leg_geometry
    assert legs is not None
    asked, _ = _asked(m, legs, Wanted(clearance=False))
    (x, y, z), tilt = np.transpose(PLACES[name]).tolist(), [0.1, 0.12] if name != "tricept" else [0.0, 0.0]
    return sealed({"certificate": FORM, "covers": "region", "key": key_of(values_of_machine(m)), "machine": name,
                   "geometry": geometry_table(legs, asked), "margin": 0.02, "travel_margin": 0.0, "travel_proved": True,
                   "region": {"of": "platform", "tool_mm": 0.0, "x_mm": x, "y_mm": y, "z_mm": z, "tilt_rad": tilt,
                              "heading_rad": [v * 10.0 for v in tilt]},
                   "boxes": ["z 0.02 0.9 0.02", "Z 0.02 0.9 0.02"]})


def sealed(found: Content) -> Content:
    found["digest"] = sha256("\n".join(found["boxes"]).encode()).hexdigest()
    least = np.array([[float(v) for v in line.split()[1:]] for line in found["boxes"]]).min(axis=0)
    found["proved"] = dict(zip(("direct", "inverse", "held", "parts", "stops"), least.tolist(), strict=False))
    return found


def boxes(name: str) -> tuple[FollowingMotion, Span, np.ndarray]:
    """(what follows, small boxes, a pose in each)."""
    rng, legs = np.random.default_rng(0), machines.load(name).kinematics.leg_geometry
    assert legs is not None
    poses = PosesOfBoxes(legs, np.array([0.0, 0.0, 30.0]))
    assert poses.follows is not None
    low, high = np.array([*legs.workspace.lower, legs.workspace.tilt[0], 0.0]), np.array(
        [*legs.workspace.upper, legs.workspace.tilt[1], 2.0 * np.pi])
    middle, half = rng.uniform(low, high, (20, 5)), 0.01 * (high - low) * rng.uniform(0.0, 1.0, (20, 5))
    return poses.follows, Span(middle - half, middle + half), middle + rng.uniform(-half, half)


@pytest.mark.parametrize("name", HELD)
def test_what_follows_is_in_the_bounds_of_search_and_check(name: str) -> None:
    """Newton of the machine at a pose of each box; search and check share no code, and both hold it."""
    motion, box, at = boxes(name)
    kin = machines.load(name).kinematics
    legs = getattr(kin, "on_legs", kin)
    angle, zero = at[:, 3], np.zeros(len(at))
    axis = np.stack([np.sin(angle) * np.cos(at[:, 4]), np.sin(angle) * np.sin(at[:, 4]), np.cos(angle)], axis=1)
    place, turn, carried = legs.standing(at[:, :3], axis, -motion.shift, zero)
    assert np.isfinite(place).all()
    geometry = deepcopy(content(name)["geometry"])
    balls = [Ball(m, r) for m, r in zip(box.middle.T, box.radius.T, strict=True)]
    with np.errstate(invalid="ignore"):  # as the check has it: what is not known is infinite
        found = pose_of(geometry, motion.shift, balls).standing
    searched = following(motion, box)
    assert found is not None
    assert np.isfinite(searched.turn.lo).all(axis=(1, 2)).mean() > 0.9
    good = np.isfinite([row[0].r for row in found.turn]).all(axis=0) & np.isfinite(searched.turn.lo).all(axis=(1, 2))
    assert good.mean() > 0.9
    for true, span, balls in ((place, searched.place, found.place), (carried, searched.carried, found.carried),
                              (turn.reshape(-1, 9), Span(searched.turn.lo.reshape(-1, 9), searched.turn.hi.reshape(-1, 9)),
                               [x for row in found.turn for x in row])):
        for k in range(true.shape[1]):
            assert (true[good, k] >= span.lo[good, k] - 1e-8).all() and (true[good, k] <= span.hi[good, k] + 1e-8).all()
            assert (np.abs(true[good, k] - balls[k].m[good]) <= balls[k].r[good] + 1e-8).all()


def _rates(found: StandingPlatform) -> np.ndarray:
    return np.stack([np.stack([x.m for x in v + w], axis=1) for v, w in found.twists], axis=1)


@pytest.mark.parametrize("name", HELD)
def test_rates_of_the_check_are_those_of_the_search(name: str) -> None:
    motion, box, _ = boxes(name)
    middle = Span(box.middle, box.middle)
    found = pose_of(deepcopy(content(name)["geometry"]), motion.shift, [Ball(m, 0.0 * m) for m in box.middle.T]).standing
    assert found is not None
    there, twists = following(motion, middle), _rates(found)
    np.testing.assert_allclose(twists[:, :, :3], there.place_by.lo, atol=1e-6)
    swung = np.cross(twists[:, :, 3:], there.turn.lo[:, None, :, 0])
    np.testing.assert_allclose(swung, there.turn_by.lo[:, :, :, 0], atol=1e-8)


@pytest.mark.parametrize("name", HELD)
def test_it_is_confirmed_and_not_with_a_box_less(name: str) -> None:
    assert confirmed(deepcopy(content(name)))["boxes"] == len(content(name)["boxes"])
    found = deepcopy(content(name))
    found["boxes"].pop(len(found["boxes"]) // 2)
    with pytest.raises(Rejected, match="no box covers"):
        confirmed(sealed(found))


@pytest.mark.parametrize("name", HELD)
def test_a_bound_that_says_too_much_is_rejected(name: str) -> None:
    for column in (0, 2):
        found = deepcopy(content(name))
        words = found["boxes"][0].split()
        words[1 + column] = "1.9"
        found["boxes"][0] = " ".join(words)
        with pytest.raises(Rejected, match="states more"):
            confirmed(sealed(found))


EDITS: dict[str, Callable[[Content], object]] = {
    "plane left out": lambda g: g["bed"].pop(), "plane moved": lambda g: g["bed"][0].update(normal=[0.6, 0.0, 0.8]),
    "joint moved": lambda g: g["legs"][0].update(joint=[1.0, 2.0, 3.0]), "freedom": lambda g: g["freedoms"].pop()}


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("name", HELD)
def test_another_geometry_is_rejected(name: str, edit: str) -> None:
    found = deepcopy(content(name))
    EDITS[edit](found["geometry"])
    with pytest.raises(Rejected):
        about(found, json.loads(json.dumps(values_of_machine(machines.load(name)))))


def test_what_follows_decides_whether_carriers_stay_in_their_travel() -> None:
    """The platform goes aside as it tilts: X of tripod-head goes farther than the tip."""
    found = deepcopy(content("tripod-head"))
    found["region"] |= {"x_mm": [499.0, 500.0], "tilt_rad": [0.69, 0.698], "heading_rad": [3.1, 3.14]}
    confirmed(found)
    found["geometry"]["carriers"][0]["travel"] = [-505.0, 505.0]
    with pytest.raises(Rejected, match="outside its travel"):
        confirmed(found)
