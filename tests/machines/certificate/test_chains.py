"""What is proved of a chain of axes holds at every rotary position and tip; what is refused is refused with one that shows
it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.analysis.certify_chain import CertifiedChain, WantedOfChain, certify_chain
from machines.certificate.chains import looked, prove_chain
from machines.certificate.spans import Span, spanned
from machines.kinematics.serial import Serial
from machines.machine import Machine
from toolpaths.diagnostics import DiagnosticError
from toolpaths.units import DEG

KINDS = ["mikron-ucp710", "fork-head-ab", "nutating-head", "head-table", "mill-4axis", "mill-3axis", "pocket-nc-v2-revr"]


def proved(name: str, **wanted: object) -> tuple[Machine, CertifiedChain]:
    m = machines.load(name)
    return m, certify_chain(m, WantedOfChain(**wanted))


def slides(m: Machine, tip: np.ndarray, turned: np.ndarray, tool: float) -> np.ndarray:
    """(N, 3) slides in chain order by the machine's own kinematics: at_tip, with rotary axes (N, R) in chain order."""
    kin = m.kinematics.with_tool(tool)
    assert isinstance(kin, Serial)
    q = np.zeros((len(tip), kin.joints))
    for k, joint in enumerate(j for j in kin.chain if j.rotary):
        q[:, m.axis_names.index(joint.name)] = turned[:, k]
    at = np.array([m.axis_names.index(j.name) for j in kin.chain if not j.rotary])
    return np.asarray(kin.at_tip(tip, q, at)[:, at])


@pytest.mark.parametrize("name", KINDS)
def test_everything_in_the_box_is_in_reach_by_the_machines_own_kinematics(name: str) -> None:
    m, found = proved(name, tool=30.0)
    asked, rng = found.asked, np.random.default_rng(0)
    tip = rng.uniform(asked.lower, asked.upper, (400, 3))
    turned = rng.uniform(*asked.turns.T, (400, len(asked.turns)))
    q = slides(m, tip, turned, 30.0)
    low, high = asked.chain.travel.T
    left = np.minimum(q - low, high - q)
    assert left.min() >= found.content["proved"]["travel"] > 0.0
    if asked.chain.turns:
        _, axis = m.kinematics.forward(whole(m, turned))
        across = np.linalg.norm(np.cross(asked.chain.turns[0].direction, axis), axis=1)
        assert (across >= found.content["proved"]["pole"] - 1e-12).all()


def whole(m: Machine, turned: np.ndarray) -> np.ndarray:
    q = np.zeros((len(turned), len(m.axis_names)))
    for k, joint in enumerate(j for j in m.kinematics.chain if j.rotary):
        q[:, m.axis_names.index(joint.name)] = turned[:, k]
    return q


@pytest.mark.parametrize("name", ["mikron-ucp710", "nutating-head", "head-table"])
def test_bounds_over_a_box_of_positions_hold_in_it(name: str) -> None:
    _, found = proved(name)
    rng, asked = np.random.default_rng(1), found.asked
    ends = np.sort(rng.uniform(*asked.turns.T, (2, 50, len(asked.turns))), axis=0)
    over, _ = looked(asked, Span(ends[0], ends[0] + 0.1 * (ends[1] - ends[0])))
    at, _ = looked(asked, spanned(ends[0] + rng.uniform(0.0, 0.1, ends[0].shape) * (ends[1] - ends[0])))
    assert (at >= over - 1e-9).all() and np.isfinite(over).all()


def test_a_box_beyond_the_travel_is_refused_with_a_place_that_shows_it() -> None:
    m = machines.load("mikron-ucp710")
    wide = np.array([200.0, 150.0, 150.0])
    with pytest.raises(DiagnosticError) as refused:
        certify_chain(m, WantedOfChain((-wide, wide), None, 50.0))
    words = refused.value.diagnostics[0].message
    slide, by, *numbers = re.search(
        r"(\w) is (\S+) mm outside.* x (\S+), y (\S+), z (\S+) mm and C (\S+), A (\S+) degrees", words).groups()
    x, y, z, c, a = map(float, numbers)
    q = slides(m, np.array([[x, y, z]]), np.array([[c, a]]) * DEG, 50.0)[0]
    order = [j.name for j in m.kinematics.chain if not j.rotary]
    j = m.axis_names.index(slide)
    over = max(m.limits.lower[j] - q[order.index(slide)], q[order.index(slide)] - m.limits.upper[j])
    assert over == pytest.approx(float(by), rel=0.02)


def test_a_singular_position_inside_is_said_and_refused_on_request() -> None:
    """The tool along C where A stands at 0; from 10 to 60 degrees it is nowhere nearer than sin 10 degrees."""
    _, found = proved("mikron-ucp710")
    assert found.figures["free_of_singular_positions"] is False and "A " in found.figures["singular_at"]
    with pytest.raises(DiagnosticError, match="the tool lies along C"):
        proved("mikron-ucp710", margin=0.05)
    _, narrow = proved("mikron-ucp710", turns={"A": (10.0 * DEG, 60.0 * DEG)})
    assert narrow.asked.margin == pytest.approx(0.5 * np.sin(10.0 * DEG), abs=1e-4)
    assert narrow.asked.margin <= narrow.content["proved"]["pole"] < np.sin(10.0 * DEG)


def test_the_largest_cube_is_nearly_the_largest() -> None:
    """Hand count on three slides: the cube that fits the shortest travel, 90 percent of it, and no more than 1.12 times."""
    m, found = proved("mill-3axis")
    side = float((found.asked.upper - found.asked.lower)[0])
    shortest = float((m.limits.upper - m.limits.lower).min())
    assert 0.88 * shortest < side <= 0.9 * shortest
    asked = found.asked
    larger = 1.12 * 0.5 * (asked.upper - asked.lower)
    middle = 0.5 * (asked.upper + asked.lower)
    assert prove_chain(type(asked)(asked.chain, middle - larger, middle + larger, asked.turns, 0.0)).lack == "travel"


def test_a_chain_without_room_says_so(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text('base = "mill-3axis"\n[axes.X]\ntravel = [0, 1]\nhome = 0\n', encoding="utf-8")
    with pytest.raises(DiagnosticError, match="no cube of tips"):
        certify_chain(machines.load(file), WantedOfChain())
    with pytest.raises(DiagnosticError, match="outside its travel"):
        proved("mikron-ucp710", turns={"A": (-90.0 * DEG, 0.0)})
