"""Distances of parts over boxes hold at every pose in them, and are in the middle what `reach` says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.analysis.certify import Wanted, certify
from machines.certificate.clearances import PartsOfLegs, gaps, pair_names
from machines.certificate.enclosure import enclosed
from machines.certificate.spans import spanned
from machines.loader import builtin
from machines.machine import Machine
from machines.reach import reach
from tests.machines.certificate.test_certificate_search import boxes
from toolpaths.arrays import Floats
from toolpaths.diagnostics import DiagnosticError

WITH_PARTS = ["uranesx", "h4-rotary", "hexapod", "h4a-c-table"]


def parts_of(m: Machine) -> PartsOfLegs:
    placed = m.kinematics.clearance_parts
    assert placed is not None and placed.clearance is not None
    return PartsOfLegs.of(placed.clearance, placed.middle_rig())


@pytest.mark.parametrize("name", WITH_PARTS)
def test_no_pose_of_a_box_has_less_than_its_bounds(name: str) -> None:
    m = machines.load(name)
    poses, box, pose = boxes(m, 60, seed=5)
    parts = parts_of(m)
    over = gaps(poses, parts, box, enclosed(poses, spanned(box.middle)), enclosed(poses, box))
    at = enclosed(poses, pose)
    here = gaps(poses, parts, pose, at, at)
    np.testing.assert_allclose(here.gap, here.at, atol=1e-9)
    assert np.isfinite(over.gap[:, 0]).mean() > 0.5
    assert (here.at >= over.gap - 1e-9).all()
    small = spanned(box.middle)
    inner = replace(small, lo=box.middle - 1e-5 * box.radius, hi=box.middle + 1e-5 * box.radius)
    near = gaps(poses, parts, inner, enclosed(poses, small), enclosed(poses, inner))
    np.testing.assert_allclose(near.gap[:, 0], over.at[:, 0], atol=0.05)


def joints(m: Machine, pose: Floats) -> Floats:
    """Those of poses (N, 5), by the inverse."""
    poses, _, _ = boxes(m, 1)
    turn = poses.turn(spanned(pose))[0].lo if poses.legs.turns else np.broadcast_to(np.eye(3), (len(pose), 3, 3))
    spin = pose[:, 3] if poses.legs.turns == "c" else 0.0
    tip = pose[:, :3] + np.einsum("nij,j->ni", turn, poses.legs.gauge)
    return m.kinematics.inverse(tip, turn[:, :, 2], spin)[0]


@pytest.mark.parametrize("name", ["uranesx", "h4-rotary", "hexapod"])
def test_distances_at_a_pose_are_those_of_reach(name: str) -> None:
    m = machines.load(name)
    poses, _, pose = boxes(m, 25, seed=2)
    at = enclosed(poses, pose)
    found = gaps(poses, parts_of(m), pose, at, at)
    margins = reach(m.kinematics, joints(m, pose.lo))
    bars = [j for j, n in enumerate(margins.names) if " - " in n]
    assert pair_names(poses.legs, parts_of(m)) == [margins.names[j] for j in bars]
    np.testing.assert_allclose(found.at[:, 0], margins.values[:, bars].min(axis=1), atol=1e-6)
    np.testing.assert_allclose(found.at[:, 0], margins.values[np.arange(25), np.array(bars)[found.worst]], atol=1e-6)
    if stops := [j for j, n in enumerate(margins.names) if n.startswith("joint")]:
        np.testing.assert_allclose(found.at[:, 1], margins.values[:, stops].min(axis=1), atol=1e-6)


def test_rods_of_no_built_in_machine_touch_in_its_workspace() -> None:
    """Rods of the rotary H4 crossed by 5 mm where its middle turns: the certificate left them out, and nobody read that."""
    left_out = []
    for name in builtin():
        found = machines.load(name)
        parts, file = found.kinematics.clearance_parts, found.certificate
        if parts is None or file is None or parts.clearance is None or parts.clearance.rod_radius is None:
            continue
        if json.loads(Path(file).read_text("utf-8"))["geometry"]["parts"] is None:
            left_out.append(name)
    assert left_out == ["hexapod"], "of the hexapod 33 mm apart at the places looked at, not proved"


def thick(tmp_path: Path, radius: float) -> Machine:
    file = tmp_path / "thick.toml"
    file.write_text(f'base = "uranesx"\n[kinematics.clearance]\nrod_radius = {radius}\n', encoding="utf-8")
    return machines.load(file)


def test_rods_that_touch_are_refused_with_the_pair_and_the_place(tmp_path: Path) -> None:
    """Half the distance of the nearest parts of rods of 25 mm, and a millimetre."""
    m = machines.load("uranesx")
    place, _ = m.kinematics.workspace.grid((9, 9, 3, 1))
    margins = reach(m.kinematics, m.kinematics.inverse(place, np.tile([0.0, 0.0, 1.0], (len(place), 1)))[0])
    least = {two: min(v.min() for n, v in zip(margins.names, margins.values.T, strict=True) if n.count("rod") == two)
             for two in (1, 2)}  # a rod against spindle and slides, which keep their size, and against another
    room = min(least[1], 0.5 * least[2])
    good = certify(thick(tmp_path, 25.0 + room - 4.0), Wanted(clearance=True)).figures
    assert good["clearance_proved"] and 0.0 < good["parts_apart_mm"] < 8.1
    m = thick(tmp_path, 25.0 + room + 4.0)
    with pytest.raises(DiagnosticError, match=r"rod \w+ - .* mm into each other at x"):
        certify(m, Wanted(clearance=True))
    left_out = certify(m, Wanted())
    assert left_out.figures["clearance_proved"] is False and "into each other" in left_out.figures["parts_meet"]
    assert left_out.content["geometry"]["parts"] is None


def test_a_stop_that_is_passed_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "stiff.toml"
    file.write_text('base = "uranesx"\n[kinematics.clearance]\ncarriage_angle = 12\n', encoding="utf-8")
    with pytest.raises(DiagnosticError, match="degrees beyond the stop of its joint at"):
        certify(machines.load(file), Wanted(clearance=True))
