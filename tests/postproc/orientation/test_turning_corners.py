"""Axes of toroids and flat ends turned along cuts: the contact found by brute force, slopes, reasons, programs proved."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from postproc.controllers.model import load_controller
from postproc.orientation.turning.kept_contact import bend, bend_slopes, kept_tip
from postproc.orientation.turning.tilt_limits import SHARE
from postproc.orientation.turning.tilted_axes import turned_axes
from postproc.orientation.turning.turned_toolpath import turned_toolpath
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.pipeline.stages import staged
from postproc.reference.cutter import CutterEnd, cutter_end
from postproc.setup.model import SetupFile
from tests.postproc.kit import machine
from tests.postproc.orientation.turning_cases import BALL, CONE, OPTIONS, context, only_run, searched, swing, with_cone
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Tool
from toolpaths.units import DEG

TOROID, FLAT = ["UNITS/MM", "CUTTER/6,1", *BALL[2:]], ["UNITS/MM", "CUTTER/6,0", *BALL[2:]]
END = CutterEnd(2.0, 1.0)
PLANE = 1e9
"""mm, radius of a cylinder on which cuts of 48 mm are on a plane"""
RNG = np.random.default_rng(3)


def lowest(tip: Floats, axis: Floats, end: CutterEnd, normal: Floats) -> tuple[float, Floats]:
    """(height along the normal of the lowest point of a cutter's end, that point), of its corner cut into points."""
    side = np.linalg.svd(axis[None])[2][1:]
    round_, down = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 361), np.linspace(0.0, 0.5 * np.pi, 91))
    out = np.cos(round_)[..., None] * side[0] + np.sin(round_)[..., None] * side[1]
    points = tip + end.corner * axis + end.flat * out + end.corner * (
        np.cos(down)[..., None] * out - np.sin(down)[..., None] * axis)
    height = points.reshape(-1, 3) @ normal
    return float(height.min()), points.reshape(-1, 3)[int(height.argmin())]


@pytest.mark.parametrize("end", [CutterEnd(0.0, 3.0), END, CutterEnd(5.0, 0.0), CutterEnd(8.0, 0.5)])
def test_the_lowest_point_of_the_cutter_stays_where_it_is(end: CutterEnd) -> None:
    for _ in range(3):
        normal = RNG.normal(size=3)
        normal /= np.linalg.norm(normal)
        axis, turned = (turned_axes(normal[None], RNG.normal(size=(1, 3)) * 0.4) for _ in range(2))
        tip = RNG.normal(size=(1, 3)) * 20.0
        now = kept_tip(tip, axis, turned, end, normal[None])
        before, behind = lowest(tip[0], axis[0], end, normal), lowest(now[0], turned[0], end, normal)
        assert behind[0] == pytest.approx(before[0], abs=4e-4)
        assert np.linalg.norm(behind[1] - before[1]) < 0.1


def test_the_bend_and_its_slopes_are_those_of_the_turn_in_between() -> None:
    axis = turned_axes(np.tile([0.0, 0.0, 1.0], (2, 1)), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]))
    assert np.linalg.norm(bend(axis, CutterEnd(0.0, 1.0), np.zeros((2, 3)))) == pytest.approx(1.0 - np.cos(0.15))
    normal = turned_axes(np.tile([0.0, 0.6, 0.8], (5, 1)), RNG.normal(size=(5, 3)) * 0.05)
    axis, step = turned_axes(normal, RNG.normal(size=(5, 3)) * 0.4), 1e-6 * RNG.normal(size=(5, 3))
    before, behind = bend_slopes(axis, END, normal, 1e-6)
    found = np.einsum("nik,nk->ni", before, step[:-1]) + np.einsum("nik,nk->ni", behind, step[1:])
    assert found == pytest.approx(bend(axis + step, END, normal) - bend(axis, END, normal), abs=1e-9)
    assert np.abs(found).max() > 1e-7


@pytest.mark.parametrize(("cutter", "found"), [
    ((6.0, 1.0), END), ((6.0, 3.0), CutterEnd(0.0, 3.0)), ((6.0, 0.0), CutterEnd(3.0, 0.0)),
    ((6.0, 1.0, 2.0, 1.0, 0.0, 0.0, 20.0), END), ((8.0, 1.0, 2.0, 1.0, 0.0, 5.0, 20.0), END), ((6.0, 4.0), None),
    ((6.0, 1.0, 2.0, 1.0, 10.0, 0.0, 20.0), None), ((6.0, 1.0, 2.0, 2.0, 0.0, 0.0, 20.0), None)])
def test_the_end_of_a_cutter_is_what_its_parameters_say(cutter: tuple[float, ...], found: CutterEnd | None) -> None:
    tool = Tool(1, diameter=cutter[0], corner_radius=cutter[1], cutter=cutter)
    assert cutter_end(tool) == found
    assert cutter_end(replace(tool, shape="DRILL")) is None and cutter_end(replace(tool, corner_radius=None)) is None


def in_part(folder: Path) -> str:
    """A set-up that names the part: the cylinder of `swing`."""
    part = trimesh.creation.cylinder(80.0, 60.0, sections=720)
    part.apply_transform(trimesh.transformations.rotation_matrix(0.5 * np.pi, [1, 0, 0]))
    part.apply_translation([0.0, 0.0, -80.0])
    part.export(folder / "part.stl")
    (folder / "s.toml").write_text('[orientation]\ncone = 8.0\n[bodies]\npart = "part.stl"\ngouge = 0.1\n')
    return str(folder / "s.toml")


@pytest.mark.parametrize(("head", "end", "more", "why"), [
    (TOROID, (2.0, 1.0), {"radius": PLANE}, "surface normals"),
    (TOROID, (2.0, 1.0), {"normals": True}, "[bodies] part"),
    (TOROID, (2.0, 1.0), {"normals": True, "radius": PLANE, "lean": 0.1}, "square to the surface"),
    (FLAT, (3.0, 0.0), {"normals": True}, "planes alone"),
    (TOROID, (2.0, 1.0), {"normals": True, "radius": PLANE}, ""),
    (FLAT, (3.0, 0.0), {"normals": True, "radius": PLANE}, ""),
    (["UNITS/MM", *BALL[2:]], (2.0, 1.0), {"normals": True, "radius": PLANE}, "not known")])
def test_where_the_contact_cannot_be_kept_the_axes_stay(head: list[str], end: tuple[float, float], more: dict[str, Any],
                                                        why: str) -> None:
    path = swing(head=head, end=end, **more)
    _, run = only_run(path, with_cone())
    assert bool(run.fixed) == bool(why) and why in run.fixed


def test_the_penalty_of_a_toroid_has_the_slope_of_differences() -> None:
    found = searched(swing(head=TOROID, end=(2.0, 1.0), radius=PLANE, normals=True), with_cone())
    limits, own = replace(found.limits, slack=1e-4), found.run.axis
    axis = turned_axes(own, 0.05 * RNG.normal(size=own.shape))
    to, step = RNG.normal(size=axis.shape), 1e-7
    over, slope = limits.penalty_of_axes(axis)
    more, less = (limits.penalty_of_axes(axis + sign * step * to)[0] for sign in (1.0, -1.0))
    assert over > 0.1 and float((slope * to).sum()) == pytest.approx((more - less) / (2.0 * step), rel=1e-3)


@pytest.mark.parametrize(("head", "end"), [(TOROID, END), (FLAT, CutterEnd(3.0, 0.0))], ids=["toroid", "flat end"])
def test_on_a_plane_the_axes_turn_the_contact_stays_and_the_program_is_proved(head: list[str], end: CutterEnd) -> None:
    """The second witness reads the normals by itself; the rapids, which have none, turn with their cut. It finds a program
    of axes that are turned about the tip."""
    path = swing(head=head, end=(end.flat, end.corner), radius=PLANE, normals=True)
    search = searched(path, with_cone())
    field = search.found("planned", 4)
    assert search.seconds("planned", field) < search.seconds("planned", search.kept())
    assert search.limits.off_path(field.axes) <= SHARE * OPTIONS.tolerance
    work = context(path, with_cone())
    right = turned_toolpath(work, [field])
    turned = angle_between(path.axis, right.axis) / DEG
    assert 0.1 < turned.max() <= CONE + 1e-9 and (turned > 0.0).all() and path.normal is not None
    for k in (5, 20):
        (high, at), (now, there) = (lowest(one.tip[k], one.axis[k], end, path.normal[k]) for one in (path, right))
        assert now == pytest.approx(high, abs=4e-4) and np.linalg.norm(there - at) < 0.1
    spec, found = load_controller("linuxcnc")
    assert spec is not None, found
    made = PostResult("", OPTIONS, work.machine, spec, "linuxcnc", SetupFile(), (), right, source=path.source)
    proved = staged(made)
    assert proved.ok and proved.witness is not None, [str(d) for d in proved.diagnostics]
    assert {one.what: one.count for one in proved.witness.compared}["positions"] == len(path)
    wrong = staged(replace(made, toolpath=replace(right, tip=path.tip)))
    assert "witness.position" in {d.code for d in wrong.diagnostics}


@pytest.mark.slow
def test_a_toroid_is_turned_on_a_part_that_the_set_up_states(tmp_path: Path) -> None:
    made = convert(swing(head=TOROID, end=(2.0, 1.0), normals=True, cuts=2), machine("mikron-ucp710"), "linuxcnc",
                   in_part(tmp_path), OPTIONS)
    assert made.ok, made.diagnostics
    assert "tool axes turned along 2 of 2 cuts" in made.text
    assert made.witness is not None and {one.what: one.count for one in made.witness.compared}["positions"] >= 70
