"""Limits of tool axes: lead, tilt, dead centre, operations that keep their axes; angles found by construction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from postproc.base.options import Options
from postproc.orientation.candidates.candidate_times import turned_all
from postproc.orientation.passes.allowed import AllowedAxes, lattice, off_centre
from postproc.orientation.passes.contact import Contact, contact_of
from postproc.orientation.passes.passes import Pass, work_of
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.setup.model import SetupFile, load_setup
from postproc.setup.orientation import OrientationLimits
from tests.postproc.kit import codes, machine, toolpath
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic
from toolpaths.shape import Curves
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

BALL = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"]
X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def along_x(normals: bool = True, passes: int = 1, head: list[str] | None = None, name: str = "") -> Toolpath:
    """Level passes along +x, surface normal +z where asked for."""
    extra = ",0,0,1" if normals else ""
    lines = ["MULTAX", *([f"TOOL PATH/{name}"] if name else [])]
    for k in range(passes):
        lines += ["RAPID", f"GOTO/0,{k},30,0,0,1", "RAPID", f"GOTO/0,{k},0,0,0,1{extra}",
                  *(f"GOTO/{x},{k},0,0,0,1{extra}" for x in (20, 40, 60, 80)), "RAPID", f"GOTO/80,{k},30,0,0,1"]
    return toolpath(*lines, head=head or BALL)


def limited(**keys: object) -> SetupFile:
    return SetupFile(orientation=OrientationLimits(**keys))


def only_pass(path: Toolpath, setup: SetupFile | None = None) -> Pass:
    work, found = work_of(path, machine("mikron-ucp710"), setup or SetupFile(), Options())
    assert work is not None, found
    return work.passes[0]


def leaning(lead: float, tilt: float, feed: Floats = X, normal: Floats = Z) -> Floats:
    """The axis whose projections on the planes normal-feed and normal-right stand at lead and tilt, degrees."""
    axis = normal + np.tan(lead * DEG) * feed + np.tan(tilt * DEG) * np.cross(feed, normal)
    return np.asarray(axis / np.linalg.norm(axis))


def oriented(path: Toolpath, limits: SetupFile,
             **options: object) -> tuple[OrientationChoice | None, list[Diagnostic]]:
    return orient(path, machine("mikron-ucp710"), limits, Options(**options))


def test_lead_and_tilt_are_angles_of_projections() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        feed, normal = frame[0], frame[1]
        lead, tilt = rng.uniform(-70.0, 70.0, 2)
        at = Contact(normal[None], feed[None], np.array([1]))
        axis = leaning(lead, tilt, feed, normal)[None]
        assert at.lead(axis)[0, 0] / DEG == pytest.approx(lead)
        assert at.tilt(axis)[0, 0] / DEG == pytest.approx(tilt)
        assert np.cos(at.inclination(axis)[0, 0]) == pytest.approx(axis[0] @ normal)


def test_signs_as_the_set_up_says() -> None:
    """Feed along +x, normal +z: forward is +x, right of the feed is -y."""
    at = only_pass(along_x()).contact
    forward, right = np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, -0.6, 0.8]])
    assert (at.lead(forward) > 0.6).all() and (np.abs(at.tilt(forward)) < 1e-12).all()
    assert (at.tilt(right) > 0.6).all() and (np.abs(at.lead(right)) < 1e-12).all()


def test_feed_has_its_direction_at_both_ends_of_an_arc() -> None:
    """A quarter turn from +x to +y about +z: the feed goes from +y to -x."""
    start, end, up = 10.0 * X[None], 10.0 * np.eye(3)[1:2], Z[None]
    arc = Curves(start, end, up, up, np.array([True]), np.zeros((1, 3)), up, np.array([np.pi / 2]))
    at = contact_of(arc, np.array([[Z, Z]]), np.array([[6, 7]]))
    np.testing.assert_allclose(at.travel, [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]], atol=1e-12)
    assert at.line.tolist() == [6, 7]


def test_the_feed_of_a_slope_lies_in_its_tangent_plane() -> None:
    """The feed of a file is a chord; a plunge along the normal has none."""
    none, both = np.zeros(1), np.array([[Z, Z]])
    line = Curves(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.2]]), Z[None], Z[None], none.astype(bool), np.zeros((1, 3)),
                  np.zeros((1, 3)), none)
    np.testing.assert_allclose(contact_of(line, both, np.array([[1, 2]])).travel,
                               np.tile(X, (2, 1)), atol=1e-12)
    down = Curves(np.zeros((1, 3)), -Z[None], Z[None], Z[None], none.astype(bool), np.zeros((1, 3)),
                  np.zeros((1, 3)), none)
    at = contact_of(down, both, np.array([[1, 2]]))
    assert len(at) == 2 and np.isnan(at.travel).all()
    limits = OrientationLimits(lead=(5.0, 10.0), off_centre=10.0)
    allowed = AllowedAxes(60.0 * DEG, None, limits)
    assert allowed.mask(only_pass(along_x()), leaning(7.0, 30.0)[None])[0]


def test_points_without_normal_do_not_count() -> None:
    nan = np.full((2, 2, 3), np.nan)
    line = Curves(np.zeros((2, 3)), np.tile(X, (2, 1)), np.tile(Z, (2, 1)), np.tile(Z, (2, 1)), np.zeros(2, dtype=bool),
                  np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(2))
    assert len(contact_of(line, nan, np.array([[1, 2], [2, 3]]))) == 0


@pytest.mark.parametrize(("keys", "axis", "noted"), [
    ({"lead": (5.0, 10.0)}, leaning(20.0, 0.0), "lead 20.000 degrees at line 10, allowed 5.000 to 10.000"),
    ({"lead": (5.0, 10.0)}, leaning(-3.0, 0.0), "lead -3.000 degrees at line 10, allowed 5.000 to 10.000"),
    ({"tilt": (-15.0, 0.0)}, leaning(0.0, 4.0), "tilt sideways 4.000 degrees at line 10, allowed -15.000 to 0.000"),
    ({"off_centre": 12.0}, leaning(0.0, 4.0),
     "tilt 4.000 degrees from the surface normal at line 10, allowed 12.000 to 60.000"),
    ({"contact_radius": 4.0}, leaning(29.0, 0.0),
     "tilt 29.000 degrees from the surface normal at line 10, allowed 30.000 to 60.000"),
    ({}, leaning(0.0, 70.0), "tilt 70.000 degrees from the surface normal at line 10, allowed 60.000")])
def test_a_refusal_says_where_what_and_what_is_allowed(keys: dict[str, object], axis: Floats,
                                                       noted: str) -> None:
    setup = limited(**keys)
    one = only_pass(along_x(), setup)
    assert str(AllowedAxes(60.0 * DEG, None, setup.orientation).refused(one, axis) or "") == noted


def test_the_worst_point_decides() -> None:
    """One normal of five leans 30 degrees back: a lead of 20 is 50 there."""
    lines = ["MULTAX", "RAPID", "GOTO/0,0,30,0,0,1", "RAPID", "GOTO/0,0,0,0,0,1,0,0,1", "GOTO/10,0,0,0,0,1,0,0,1",
             "GOTO/20,0,0,0,0,1,-0.5,0,0.8660254037844386", "GOTO/30,0,0,0,0,1,0,0,1", "RAPID", "GOTO/30,0,30,0,0,1"]
    one = only_pass(toolpath(*lines, head=BALL))
    allowed = AllowedAxes(80.0 * DEG, None, OrientationLimits(lead=(-60.0, 40.0)))
    assert str(allowed.refused(one, leaning(20.0, 0.0))) == "lead 50.000 degrees at line 12, allowed -60.000 to 40.000"
    assert allowed.refused(one, leaning(9.0, 0.0)) is None


def test_own_axis_is_always_allowed() -> None:
    one = only_pass(along_x())
    allowed = AllowedAxes(60.0 * DEG, None, OrientationLimits(off_centre=10.0))
    assert allowed.refused(one, Z) is None and "allowed 10.000" in str(allowed.outside(one, Z))


def test_many_axes_at_once_as_one_by_one() -> None:
    one = only_pass(along_x())
    allowed = AllowedAxes(50.0 * DEG, None, OrientationLimits(lead=(-20.0, 30.0), tilt=(-10.0, 35.0), off_centre=5.0))
    axes = lattice(6.0 * DEG)
    found = allowed.mask(one, axes)
    assert 10 < found.sum() < len(axes)
    assert found.tolist() == [not allowed.outside(one, axis) for axis in axes]
    np.testing.assert_array_equal(allowed.among(one, 6.0 * DEG), axes[found])


def test_without_normals_the_tilt_is_from_the_own_axis() -> None:
    one = only_pass(along_x(normals=False))
    assert not len(one.contact)
    assert str(AllowedAxes(20.0 * DEG).refused(one, leaning(25.0, 0.0))) == \
        "tilt 25.000 degrees from the axis of the CL file, allowed 20.000"
    assert AllowedAxes(20.0 * DEG).refused(one, leaning(19.0, 0.0)) is None


def test_the_lattice_is_even() -> None:
    axes = lattice(8.0 * DEG)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
    dot = axes @ axes.T - 2.0 * np.eye(len(axes))
    near = np.arccos(np.clip(dot.max(axis=1), -1.0, 1.0)) / DEG
    assert near.min() > 4.0 and near.max() < 10.0
    probes = np.random.default_rng(1).normal(size=(500, 3))
    probes /= np.linalg.norm(probes, axis=1, keepdims=True)
    assert np.degrees(np.arccos((probes @ axes.T).max(axis=1))).max() < 8.0


def test_contact_radius_as_an_angle() -> None:
    assert off_centre(OrientationLimits(contact_radius=4.0), 8.0) == pytest.approx(30.0 * DEG)
    assert off_centre(OrientationLimits(off_centre=7.0), 8.0) == pytest.approx(7.0 * DEG)
    assert off_centre(OrientationLimits(), 8.0) == 0.0


def test_chosen_axes_are_inside_and_the_own_one_is_reported() -> None:
    """The own axis stands on the dead centre: it is named; what is chosen fulfils the set-up, and gains less than free."""
    setup = limited(lead=(5.0, 50.0), tilt=(-50.0, -5.0), off_centre=10.0)
    path = along_x(passes=2)
    choice, found = oriented(path, setup)
    assert choice is not None
    noted = [d for d in found if d.code == "orient.own_limits"]
    assert len(noted) == 1 and noted[0].count == 2 and "tilt 0.000 degrees from the surface normal at line 10, " \
        "allowed at least 10.000" in noted[0].message
    for made in choice.plans["per-pass"].picked:
        at = made.one.contact
        assert 5.0 <= at.lead(made.axis[None]).min() / DEG <= 50.0
        assert -50.0 <= at.tilt(made.axis[None]).max() / DEG <= -5.0
        assert made.seconds < choice.tried[0].own.seconds
    free, _ = oriented(along_x(), SetupFile())
    assert free is not None
    assert free.tried[0].best.seconds <= choice.tried[0].best.seconds * (1.0 + 1e-4)


@pytest.mark.parametrize(("lead", "tilt"), [
    ((10.0, 12.0), (3.0, 5.0)), ((20.0, 20.5), (0.0, 0.5)), ((30.0, 33.0), (-12.0, -10.0))])
def test_narrow_windows_are_found(lead: tuple[float, float], tilt: tuple[float, float]) -> None:
    """The own axis leans back, far from what is allowed: of a fine grid inside the window none is faster than the search."""
    back = ",-0.28,0,0.96"
    lines = ["MULTAX", "RAPID", f"GOTO/0,0,30{back}", "RAPID", f"GOTO/0,0,0{back},0,0,1", f"GOTO/80,0,0{back},0,0,1",
             "RAPID", f"GOTO/80,0,30{back}"]
    choice, found = oriented(toolpath(*lines, head=BALL), limited(lead=lead, tilt=tilt))
    assert choice is not None, found
    best = choice.tried[0].best
    assert lead[0] - 1e-6 <= best.one.contact.lead(best.axis[None])[0, 0] / DEG <= lead[1] + 1e-6
    assert tilt[0] - 1e-6 <= best.one.contact.tilt(best.axis[None])[0, 0] / DEG <= tilt[1] + 1e-6
    axes = np.stack([leaning(a, b) for a in np.linspace(*lead, 7) for b in np.linspace(*tilt, 7)])
    least = min(made.seconds for made in turned_all(best.one, axes, machine("mikron-ucp710")))
    assert best.seconds < 1.003 * least < best.one.radius


def test_limits_of_very_many_points() -> None:
    """Half-spaces of ten thousand normals and feeds, some without feed, judge as the angles do."""
    rng = np.random.default_rng(8)
    normal = rng.normal(size=(10_000, 3)) * 0.15 + Z
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    link = np.cross(normal, rng.normal(size=normal.shape))
    link /= np.linalg.norm(link, axis=1, keepdims=True)
    link[::50] = np.nan
    one = replace(only_pass(along_x()), contact=Contact(normal, link, np.arange(10_000)))
    allowed = AllowedAxes(50.0 * DEG, None, OrientationLimits(lead=(-48.0, 45.0), tilt=(-90.0, 46.0), off_centre=0.01))
    axes = rng.normal(size=(300, 3)) * 0.3 + Z
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    found = allowed.mask(one, axes)
    assert 3 < found.sum() < 200 and found.tolist() == [not allowed.outside(one, axis) for axis in axes]


def test_operations_that_keep_their_axes() -> None:
    path = along_x(name="FINISH")
    assert any(op.name == "FINISH" for op in path.operations)
    choice, found = oriented(path, limited(fixed_operations=("FINISH",)))
    assert choice is not None and codes(found) >= {"orient.fixed"}
    assert choice.tried[0].own.one.fixed == "the set-up keeps the axis of operation 'FINISH'"
    choice, found = oriented(path, limited(fixed_operations=("FINSH",)))
    assert choice is None
    assert [(d.code, d.hint) for d in found] == [("orient.operation", "did you mean 'FINISH'?")]


def test_a_cut_that_begins_where_a_pass_ends_keeps_it() -> None:
    """The tool turns in the cut behind: turned, the pass before would move its beginning."""
    lines = ["MULTAX", "RAPID", "GOTO/0,0,30,0,0,1", "RAPID", "GOTO/0,0,0,0,0,1", "GOTO/80,0,0,0,0,1", "RAPID",
             "GOTO/80,0,9,0,0,1", "GOTO/80,40,0,0,0.6,0.8", "GOTO/0,40,0,0,0.6,0.8", "RAPID", "GOTO/0,40,30,0,0.6,0.8"]
    work, found = work_of(toolpath(*lines, head=BALL), machine("mikron-ucp710"), SetupFile(), Options())
    assert work is not None, found
    assert [one.fixed for one in work.passes] == ["the cut after it begins where it ends, without a rapid",
                                                 "no rapid leads to it on which the tool could turn"]
    assert not any(one.spins for one in work.passes)


@pytest.mark.parametrize(("keys", "normals", "code"), [
    ({"lead": (0.0, 10.0)}, False, "orient.normals"), ({"off_centre": 5.0}, False, "orient.normals"),
    ({"contact_radius": 8.0}, True, "orient.contact_radius"), ({"lead": (0.0, 10.0)}, True, "")])
def test_limits_that_cannot_be_held(keys: dict[str, object], normals: bool, code: str) -> None:
    choice, found = oriented(along_x(normals), limited(**keys))
    assert [d.code for d in found if d.code != "orient.own_limits"] == ([code] if code else [])
    assert (choice is None) == bool(code)


@pytest.mark.parametrize(("text", "line", "noted"), [
    ("lead = [10, 5]", 2, "write [least, greatest]"), ("lead = [0, 95]", 2, "allowed: 90 or less"),
    ("off_centre = 5\ncontact_radius = 1", 1, "give one of them"), ("led = [0, 5]", 2, "unknown key"),
    ("off_centre = -1", 2, "allowed: 0 or more")])
def test_set_up_files_that_are_wrong(tmp_path: Path, text: str, line: int, noted: str) -> None:
    file = tmp_path / "s.toml"
    file.write_text(f"[orientation]\n{text}\n")
    setup, found = load_setup(file)
    assert setup is None and found[0].lines == (line,) and noted in found[0].message


def test_set_up_file_that_is_right(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text('[orientation]\nlead = [2, 30]\ntilt = [-30.0, 30.0]\ncontact_radius = 0.5\nfixed_operations = ["A"]\n')
    setup, found = load_setup(file)
    assert setup is not None and not found and setup.orientation.lead == (2.0, 30.0) and setup.orientation.need_normals
    choice, found = oriented(along_x(), setup.model_copy(), setup=str(file))
    noted = next(d for d in found if d.code == "orient.operation")
    assert choice is None and noted.lines == (5,) and noted.file == str(file)


def test_a_part_mesh_instead_of_normals(tmp_path: Path) -> None:
    """The same limits hold as with the normals in the file, and the same axes are chosen."""
    plate = trimesh.creation.box(extents=(200.0, 60.0, 10.0))
    plate.apply_translation((40.0, 0.0, -5.0))
    plate.export(tmp_path / "plate.stl")
    file = tmp_path / "s.toml"
    file.write_text('[orientation]\nlead = [5, 50]\ntilt = [-50, -5]\n[bodies]\npart = "plate.stl"\n')
    setup, found = load_setup(file)
    assert setup is not None, found
    path = toolpath("MULTAX", "RAPID", "GOTO/0,0,30,0,0,1", "RAPID", "GOTO/0,0,1,0,0,1", "GOTO/0,0,0,0,0,1",
                    "GOTO/80,0,0,0,0,1", "RAPID", "GOTO/80,0,30,0,0,1", head=BALL)
    choice, found = oriented(path, setup, setup=str(file))
    assert choice is not None and "orient.own_limits" in codes(found), found
    assert len(choice.tried[0].own.one.contact) == 21
    noted = next(d.message for d in found if d.code == "orient.no_contact")
    assert noted.startswith("at 1 of 22 places on cutting moves the ball does not touch the part mesh within 0.02 mm")
    same, _ = oriented(along_x(), limited(lead=(5.0, 50.0), tilt=(-50.0, -5.0)))
    assert same is not None
    np.testing.assert_allclose(choice.tried[0].best.axis, same.tried[0].best.axis, atol=5e-3)
    plate.apply_translation((0.0, 0.0, -1.0))
    plate.export(tmp_path / "plate.stl")
    choice, found = oriented(along_x(normals=False), setup, setup=str(file))
    assert choice is None and "orient.normals" in codes(found)
    file.write_text(file.read_text().replace("plate.stl", "plat.stl"))
    setup, found = load_setup(file)
    assert setup is not None
    choice, found = oriented(along_x(normals=False), setup, setup=str(file))
    assert choice is None and "mesh.open" in codes(found)


@pytest.mark.parametrize(("keys", "noted"), [
    ({"off_centre": 50.0}, "off_centre = 50 degrees is more than --max-tilt 45"),
    ({"contact_radius": 6.0}, "contact_radius = 6 mm is an angle of 48.590 degrees to the normal, more than --max-tilt 45")])
def test_a_least_angle_above_the_largest_is_an_error(keys: dict[str, object], noted: str) -> None:
    """No axis fulfils both: said once for both passes, and nothing of their own axes besides."""
    choice, found = oriented(along_x(passes=2), limited(**keys), max_tilt=45.0)
    assert choice is None and [(d.code, d.count) for d in found] == [("orient.max_tilt", 2)] and noted in found[0].message
    assert "orient.max_tilt" not in codes(oriented(along_x(), limited(**keys), max_tilt=60.0)[1])


def test_own_axes_beyond_the_largest_tilt_are_reported_once() -> None:
    """They lean 30 degrees: kept where nothing better is found, and reported with the least --max-tilt that allows them."""
    lines = ["MULTAX", *(line for k in range(2) for line in (
        "RAPID", f"GOTO/0,{k},30,0.5,0,0.8660254037844386", "RAPID", f"GOTO/0,{k},0,0.5,0,0.8660254037844386,0,0,1",
        f"GOTO/80,{k},0,0.5,0,0.8660254037844386,0,0,1", "RAPID", f"GOTO/80,{k},30,0.5,0,0.8660254037844386"))]
    path = toolpath(*lines, head=BALL)
    _, found = oriented(path, SetupFile(), max_tilt=20.0)
    noted = [d for d in found if d.code == "orient.own_tilt"]
    assert len(noted) == 1 and noted[0].count == 2 and "30.000 degrees from the surface normal" in noted[0].message
    assert "--max-tilt 30 allows" in noted[0].hint
    assert "orient.own_tilt" not in codes(oriented(path, SetupFile(), max_tilt=30.0)[1])


def test_a_contact_beyond_the_ball_is_reported_alone() -> None:
    choice, found = oriented(along_x(), limited(contact_radius=9.0))
    assert choice is None and codes(found) == {"orient.contact_radius"}


@pytest.mark.parametrize("value", ["5.0", "[5.0]", '["a", 2]', "[1, 2, 3]", "true"])
@pytest.mark.parametrize("key", ["orientation.lead", "placement.x"])
def test_what_is_no_range_says_what_is_expected(tmp_path: Path, key: str, value: str) -> None:
    table, name = key.split(".")
    file = tmp_path / "s.toml"
    file.write_text(f"[{table}]\n{name} = {value}\n")
    setup, found = load_setup(file)
    assert setup is None and [(d.code, d.lines) for d in found] == [("file.value", (2,))]
    assert f"{key}" in found[0].message and "expected two numbers, [least, greatest], e.g. [-30, 30]" in found[0].message
