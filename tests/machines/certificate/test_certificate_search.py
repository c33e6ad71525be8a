"""Bounds over boxes hold at every pose in them; what is refused is refused with a place that shows it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.analysis.certify import Wanted, certify
from machines.certificate.enclosure import columns, enclosed, least_singular, set_rows
from machines.certificate.following import following
from machines.certificate.lookup import key_of
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.search import AskedProof, prove
from machines.certificate.spans import Span, spanned
from machines.loader import values_of_machine
from machines.machine import Machine
from postproc.cli.app import app
from tests.certificates import on_legs
from toolpaths.diagnostics import DiagnosticError

KINDS = ["uranesx", "rotary-delta", "hexapod", "hexaslide-cone", "h4a-c-table", "planar-delta-z", "triaglide", "h4-rotary",
         "macro-micro", "tripod-head", "tricept", "linuxcnc-pentapod"]


def boxes(m: Machine, n: int, seed: int = 0) -> tuple[PosesOfBoxes, Span, Span]:
    """(legs, n boxes of poses inside the workspace, one pose in each)."""
    legs, rng = m.kinematics.leg_geometry, np.random.default_rng(seed)
    assert legs is not None
    low = np.array([*legs.workspace.lower, legs.workspace.tilt[0], 0.0])
    high = np.array([*legs.workspace.upper, legs.workspace.tilt[1], 2.0 * np.pi])
    ends = np.sort(rng.uniform(0.0, 1.0, (2, n, 5)), axis=0)
    middle = ends.mean(axis=0)
    ends = low + (high - low) * (middle + 0.1 * (ends - middle))
    at = rng.uniform(ends[0], ends[1])
    return PosesOfBoxes(legs, np.zeros(3)), Span(ends[0], ends[1]), Span(at, at)


@pytest.mark.parametrize("name", KINDS)
def test_what_is_anywhere_in_a_box_is_in_its_bounds(name: str) -> None:
    poses, box, pose = boxes(machines.load(name), 200)
    over, at = enclosed(poses, box), enclosed(poses, pose)
    sure = (over.under.lo > 0.0).all(axis=1)
    assert sure.mean() > 0.5
    for part in ("cosine", "cosine_change", "q", "matrix", "change"):
        inside, here = getattr(over, part), getattr(at, part)
        assert (here.lo[sure] >= inside.lo[sure] - 1e-9).all() and (here.hi[sure] <= inside.hi[sure] + 1e-9).all(), part


@pytest.mark.parametrize("name", KINDS)
def test_figures_of_a_pose_are_those_of_the_machine(name: str) -> None:
    """Drives by the inverse, cosines and least singular value by `singular_distance`: other code for both."""
    m = machines.load(name)
    poses, _, pose = boxes(m, 50)
    kin, legs, at = m.kinematics, poses.legs, enclosed(poses, pose)
    free, _ = columns(legs)
    least = np.linalg.svd(at.matrix.lo[:, :set_rows(legs)][:, :, free], compute_uv=False)[:, -1]
    turn = following(poses.follows, pose).turn.lo if poses.follows else poses.turn(pose)[0].lo
    tip = pose.lo[:, :3] + (turn @ legs.gauge if legs.turns else legs.gauge)
    own = [m.axis_names.index(letter) for letter in legs.names]
    axis, spin = turn[:, :, 2] if legs.turns else np.tile([0.0, 0.0, 1.0], (50, 1)), pose.lo[:, 3] * (legs.turns == "c")
    branches = kin.joints_with(tip, axis, spin, np.zeros((50, 3))) if legs.carried_twice else kin.inverse(tip, axis, spin)
    nearest = np.abs(branches[:, :, own] - at.q.lo).max(axis=2).argmin(axis=0)  # of an H4 the one that leaves C at 0
    q = branches[nearest, np.arange(50)]
    distance = kin.singular_distance(q)
    np.testing.assert_allclose(np.angle(np.exp(1j * (q[:, own] - at.q.lo))) if legs.arm.all() else q[:, own] - at.q.lo, 0.0,
                               atol=1e-8)
    np.testing.assert_allclose(distance[:, 0], at.cosine.lo.min(axis=1), atol=1e-9)
    np.testing.assert_allclose(distance[:, 1], least, atol=1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_rates_of_the_matrices_are_their_differences(name: str) -> None:
    poses, _, pose = boxes(machines.load(name), 20)
    here, h = enclosed(poses, pose), 1e-4
    for i in range(5 if poses.legs.turns == "abc" else 3 + bool(poses.legs.turns)):
        step = h * np.eye(5)[i]
        ahead, behind = (enclosed(poses, spanned(pose.lo + s * step)) for s in (1.0, -1.0))
        for rate, a, b in ((here.change, ahead.matrix, behind.matrix), (here.cosine_change, ahead.cosine, behind.cosine)):
            np.testing.assert_allclose(rate.lo[:, i], (a.lo - b.lo) / (2.0 * h), atol=1e-7)


@pytest.mark.parametrize("name", ["uranesx", "hexapod", "h4a-c-table", "planar-delta-z", "triaglide"])
def test_no_pose_of_a_box_is_below_its_bound(name: str) -> None:
    """And a small box loses little of the value in its middle: the bound is of the second order."""
    poses, box, _ = boxes(machines.load(name), 100, seed=3)
    _, held = columns(poses.legs)
    middle = enclosed(poses, spanned(box.middle)).matrix.lo[:, :, held]
    bound, at, _ = least_singular(middle, enclosed(poses, box).change[:, :, :, held], box.radius)
    rng = np.random.default_rng(1)
    for _ in range(20):
        pose = spanned(rng.uniform(box.lo, box.hi))
        value = np.linalg.svd(enclosed(poses, pose).matrix.lo[:, :, held], compute_uv=False)[:, -1]
        assert (value >= bound - 1e-12).all()
    for k in range(32):
        signs = 2.0 * ((k >> np.arange(5)) & 1) - 1.0
        corner = enclosed(poses, spanned(box.middle + signs * box.radius)).matrix.lo[:, :, held]
        assert (np.linalg.svd(corner, compute_uv=False)[:, -1] >= bound - 1e-12).all()
    small = Span(box.middle - 1e-4 * box.radius, box.middle + 1e-4 * box.radius)
    near = least_singular(middle, enclosed(poses, small).change[:, :, :, held], small.radius)[0]
    np.testing.assert_allclose(near, at, rtol=1e-2)


def test_the_cosine_of_uranesx_is_that_of_its_triangle() -> None:
    """In the middle each rod spans 550 mm across its slide: h = sqrt(1300^2 - 550^2)."""
    found = certify(machines.load("uranesx"), Wanted((np.zeros(3), np.zeros(3)), 0.0)).figures
    assert found["boxes"] == 1
    assert found["proved_inverse"] == pytest.approx(0.95 * np.sqrt(1300.0**2 - 550.0**2) / 1300.0, abs=1e-4)


def test_boxes_cover_the_region_once() -> None:
    """Volumes add up, and every random pose is in exactly one box."""
    content = json.loads(certify(machines.load("rotary-delta"), Wanted()).text)
    from machines.analysis.certificate_figure import _ends
    lower, upper = _ends(content, [line.split()[0].strip(".") for line in content["boxes"]])
    region = np.array([content["region"][key] for key in ("x_mm", "y_mm", "z_mm")])
    assert np.prod((upper - lower)[:, :3], axis=1).sum() == pytest.approx(np.prod(np.diff(region, axis=1)))
    pose = np.random.default_rng(0).uniform(*region.T, (500, 3))
    inside = ((pose[:, None] > lower[:, :3]) & (pose[:, None] < upper[:, :3])).all(axis=2)
    assert (inside.sum(axis=1) == 1).all()


def test_a_singular_position_inside_is_refused_with_its_place() -> None:
    """A slide on z under UraneSX's platform: far below, the rods come flat; the place is found and shows it."""
    m = machines.load("delta-parallel-z")
    with pytest.raises(DiagnosticError) as refused:
        certify(m, Wanted((np.array([-250.0, -250.0, -200.0]), np.array([900.0, 250.0, 200.0])), 0.0, 0.1, False))
    (found,) = refused.value.diagnostics
    assert found.code == "certificate.short" and "does not reach" in found.message
    with pytest.raises(DiagnosticError) as refused:
        certify(m, Wanted((np.array([-250.0, -250.0, -200.0]), np.array([420.0, 250.0, 200.0])), 0.0, 0.5, False))
    words = refused.value.diagnostics[0].message
    place = np.array([[float(v) for v in re.search(r"x (\S+), y (\S+), z (\S+) mm", words).groups()]])
    assert m.kinematics.singular_distance(m.kinematics.inverse(place, np.array([[0.0, 0.0, 1.0]]))[0]).min() < 0.5


def test_a_travel_that_ends_inside_is_found(tmp_path: Path) -> None:
    file = tmp_path / "short.toml"
    file.write_text('base = "uranesx"\n[axes.X]\ntravel = [1000, 1530]\n', encoding="utf-8")
    m = machines.load(file)
    found = certify(m, Wanted()).figures
    assert not found["travel_proved"] and "outside_travel_at" in found
    with pytest.raises(DiagnosticError, match="outside its travel"):
        certify(m, Wanted(travel=True))


def test_a_margin_at_the_least_value_is_undecided_and_said_so() -> None:
    """Travel that ends exactly where the workspace does: no box there keeps clear of it."""
    poses, _, _ = boxes(machines.load("hexaslide-parallel-z"), 1)
    space = poses.legs.workspace
    lower, upper = np.array([*space.lower, 0.0, 0.0]), np.array([*space.upper, 0.0, 0.0])
    free, none = np.tile([-np.inf, np.inf], (6, 1)), np.zeros((0, 2))
    asked = AskedProof(poses, lower, upper, free, none, np.zeros(6, dtype=bool), 0.1)
    least = enclosed(poses, spanned(np.array([[*space.lower, 0.0, 0.0]]))).q.lo[0]
    ends = np.stack([least, least + 1e4], axis=1)
    found = prove(replace(asked, travel=ends))
    assert found.lack in ("undecided", "travel")


def test_the_key_is_of_the_geometry_alone() -> None:
    values = values_of_machine(machines.load("uranesx"))
    key = key_of(values)
    assert key == key_of(values | {"description": "another"})
    changed = json.loads(json.dumps(values, default=str))
    changed["kinematics"]["clearance"]["rod_radius"] = 30
    assert key == key_of(changed)
    changed["kinematics"]["legs"]["X"]["rod"] = 1300.001
    assert key != key_of(changed)


def test_every_machine_on_legs_is_loaded_as_proved() -> None:
    assert {name: bool(machines.load(name).certificate) for name in on_legs()} == dict.fromkeys(on_legs(), True)


def test_another_geometry_is_sampled_until_it_is_certified(tmp_path: Path) -> None:
    run, file = CliRunner(), tmp_path / "mine.toml"
    file.write_text('base = "uranesx"\n[kinematics.legs.X]\nrod = 1301\n', encoding="utf-8")
    assert machines.load(file).certificate == ""
    assert "sampled" in run.invoke(app, ["machine", "check", str(file)]).stdout
    done = run.invoke(app, ["machine", "certify", str(file), "-o", str(tmp_path / "mine.certificate.json"),
                            "--figure", str(tmp_path / "mine.png"), "--json", "-"])
    assert done.exit_code == 0, done.output
    assert machines.load(file).certificate.endswith("mine.certificate.json")
    assert "proved" in run.invoke(app, ["machine", "show", str(file)]).stdout
    file.write_text('base = "uranesx"\n[kinematics.legs.X]\nrod = 1302\n', encoding="utf-8")
    assert machines.load(file).certificate == ""


def test_a_claim_next_to_a_machine_file_does_not_stand_for_a_look_at_its_workspace(tmp_path: Path) -> None:
    """Whoever writes the new key into the old certificate gets no singular machine past the sampling."""
    file, claim = tmp_path / "mine.toml", tmp_path / "mine.certificate.json"
    file.write_text('base = "uranesx"\n[kinematics.legs.X]\nrod = 700\n', encoding="utf-8")
    good = json.loads(certify(machines.load("uranesx"), Wanted()).text)
    key = key_of({"kinematics": values_of_machine(machines.load("uranesx"))["kinematics"]})
    assert good["key"] == key
    values = json.loads(json.dumps(values_of_machine(machines.load("uranesx"))))
    values["kinematics"]["legs"]["X"]["rod"] = 700
    claim.write_text(json.dumps(good | {"key": key_of(values)}), encoding="utf-8")
    with pytest.raises(DiagnosticError, match="workspace"):
        machines.load(file)
    near = 'base = "uranesx"\n[kinematics.legs.X]\nrod = 1301\n'
    file.write_text(near, encoding="utf-8")
    values["kinematics"]["legs"]["X"]["rod"] = 1301
    for edit in ({}, {"boxes": ["x 1 1 1"]}, {"margin": -1.0}, {"margin": float("nan")}, {"digest": 3}, {"proved": {}}):
        claim.write_text(json.dumps(good | {"key": key_of(values)} | edit), encoding="utf-8")
        assert bool(machines.load(file).certificate) == (not edit)


def test_a_box_of_tips_behind_an_axis_at_the_spindle_is_refused() -> None:
    with pytest.raises(DiagnosticError, match=r"certificate\.head"):
        certify(machines.load("h4a-spindle-axis"), Wanted((np.full(3, -1.0), np.full(3, 1.0)), 100.0))


def test_halving_goes_across_what_matters() -> None:
    """A linear Delta with slides along z is the same at every height: no box is halved there."""
    content = json.loads(certify(machines.load("uranesx"), Wanted(travel=False)).text)
    paths = [line.split()[0] for line in content["boxes"]]
    assert not {"z", "Z"} & set("".join(paths))
    assert paths == sorted(paths)
