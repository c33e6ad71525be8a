"""Forms of tools and meshes as a set-up gives them: sizes, what is missing, what is no good."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.collision.form import CUTTER, HOLDER, SHANK, ToolForm, tool_form
from postproc.collision.holder_hull import spun
from postproc.collision.mesh import load_mesh
from postproc.collision.revolution import signed
from postproc.setup.bodies import HolderSection
from postproc.setup.model import SetupFile, ToolSetup, load_setup
from tests.postproc.kit import SAMPLES
from toolpaths.arrays import Floats
from toolpaths.toolpath import Tool

FULL = ToolSetup(gauge_length=100.0, flute_length=20.0, shank=[HolderSection(diameter=8.0, length=30.0)],
                 holder=[HolderSection(lower=20.0, upper=30.0, length=25.0), HolderSection(diameter=40.0, length=30.0)])


def form(tool: Tool | None, setup: ToolSetup | None = FULL) -> tuple[ToolForm, list[str]]:
    made, found = tool_form(7, tool, setup, "s.toml")
    return made, [str(d) for d in found]


def distance(pieces: Floats, rho: float, z: float) -> float:
    """To the nearest of the pieces."""
    return min(float(signed(piece, np.array([rho]), np.array([z]))[0][0]) for piece in pieces)


def test_pieces_stand_on_each_other() -> None:
    made, found = form(Tool(7, diameter=10.0, corner_radius=5.0))
    assert not found
    assert made.of(CUTTER).tolist() == [[0.0, 5.0, 0.0, 5.0, 5.0], [5.0, 5.0, 5.0, 20.0, 0.0]]
    assert made.of(SHANK).tolist() == [[4.0, 20.0, 4.0, 50.0, 0.0]]
    assert made.of(HOLDER).tolist() == [[10.0, 50.0, 15.0, 75.0, 0.0], [20.0, 75.0, 20.0, 105.0, 0.0]]


@pytest.mark.parametrize("taper", [0.0, 3.0, 20.0])
@pytest.mark.parametrize("corner", [0.0, 1.5])
def test_a_tapered_side_meets_the_plane_of_the_tip_at_half_the_diameter(corner: float, taper: float) -> None:
    made, _ = form(Tool(7, diameter=10.0, corner_radius=corner, taper=np.radians(taper)))
    cutter = made.of(CUTTER)
    for z in (4.0, 11.0, 19.0):
        assert distance(cutter, 5.0 + z * np.tan(np.radians(taper)), z) == pytest.approx(0.0, abs=1e-9)
    assert distance(cutter, 0.0, 0.0) == pytest.approx(0.0, abs=1e-9)
    sharp = distance(cutter, 5.0, 0.0)
    half = np.radians(90.0 + taper) / 2.0
    assert sharp == pytest.approx(corner * (1.0 / np.sin(half) - 1.0), abs=1e-9)


def test_a_drill_ends_in_a_cone() -> None:
    made, found = form(Tool(7, shape="DRILL", diameter=10.0, corner_radius=0.0, tip_angle=np.radians(118.0)))
    high = 5.0 / np.tan(np.radians(59.0))
    assert not found and made.of(CUTTER)[0].tolist() == pytest.approx([0.0, 0.0, 5.0, high, 0.0])


def test_the_setup_goes_before_the_cl_file_and_says_so() -> None:
    made, found = form(Tool(7, diameter=10.0, corner_radius=5.0, flute_length=18.0))
    assert made.of(CUTTER)[1, 3] == 20.0
    assert len(found) == 1 and "flute_length is 20 mm in the set-up, 18 mm in the CL file" in found[0]


@pytest.mark.parametrize(("tool", "setup", "words"), [
    (None, FULL, ["the cutter is not known", "diameter = "]),
    (Tool(7, diameter=10.0), FULL, ["corner radius is not known", "sharp"]),
    (Tool(7, diameter=10.0, corner_radius=0.0), ToolSetup(gauge_length=90.0), ["above the cutter's corner", "flute_length"]),
    (Tool(7, diameter=10.0, corner_radius=0.0, flute_length=20.0), None, ["shank and holder", "[tools.7]"]),
    (Tool(7, diameter=10.0, corner_radius=0.0), FULL.model_copy(update={"holder": []}), ["the holder is not known"]),
    (Tool(7, diameter=10.0, corner_radius=0.0), FULL.model_copy(update={"gauge_length": 120.0}), ["ends 105 mm", "120 mm"]),
])
def test_what_is_not_known_is_reported(tool: Tool | None, setup: ToolSetup | None, words: list[str]) -> None:
    _, found = form(tool, setup)
    assert len(found) == 1 and all(word in found[0] for word in words), found


FLAT = ToolSetup(gauge_length=100.0, flute_length=20.0)


@pytest.mark.parametrize(("params", "rows"), [
    ((20.0, 0.0, 10.0, 6.008606, 31.0, 0.0, 215.0), [(0.0, 0.0, 10.0, 6.008606, 0.0), (10.0, 6.008606, 10.0, 20.0, 0.0)]),
    ((6.8, 0.0, 3.4, 0.0, 31.0, 0.0, 75.0), [(0.0, 0.0, 3.4, 2.042926, 0.0), (3.4, 2.042926, 3.4, 20.0, 0.0)]),
    ((10.0, 1.0, 4.0, 1.0, 0.0, 5.0, 75.0), [(4.0, 1.0, 4.0, 1.0, 1.0), (4.996195, 0.912844, 6.666104, 20.0, 0.0)]),
    ((14.6586, 8.0, 0.0, 8.0, 0.0, 5.0, 50.0), [(0.0, 8.0, 0.0, 8.0, 8.0), (7.969558, 7.302754, 9.080423, 20.0, 0.0)]),
])
def test_all_seven_parameters_of_cutter_count(params: tuple[float, ...],
                                              rows: list[tuple[float, ...]]) -> None:
    made, found = form(Tool(7, diameter=params[0], corner_radius=params[1], cutter=params))
    assert not found and made.exact and made.of(CUTTER) == pytest.approx(np.array(rows), abs=1e-5)


def test_point_and_corner_touch_each_other() -> None:
    """A mill of 20 mm with a corner of 2 mm whose lower line rises by 10 degrees, its side leaning by 5."""
    params = (20.0, 2.0, 0.0, 0.0, 10.0, 5.0, 50.0)
    made, _ = form(Tool(7, diameter=20.0, corner_radius=2.0, cutter=params))
    tip, side = np.radians(10.0), np.radians(5.0)
    for rho in (1.0, 5.0, 7.0):
        assert distance(made.of(CUTTER), rho, rho * np.tan(tip)) == pytest.approx(0.0, abs=1e-9)
    for z in (5.0, 18.0):
        at = 10.0 + (z - 10.0 * np.tan(tip)) * np.tan(side)
        assert distance(made.of(CUTTER), at, z) == pytest.approx(0.0, abs=1e-9)
    half = 0.5 * (np.pi / 2.0 + tip + side)
    corner = distance(made.of(CUTTER), 10.0, 10.0 * np.tan(tip))
    assert corner == pytest.approx(2.0 * (1.0 / np.sin(half) - 1.0), abs=1e-9)


@pytest.mark.parametrize("tool", [
    Tool(7, diameter=16.0, corner_radius=85.0, cutter=(16.0, 85.0, -77.0, 85.0, 0.0, 0.0, 50.0)),
    Tool(7, diameter=16.0, corner_radius=85.0, cutter=(16.0, 85.0, 0.0, 85.0, 0.0, 0.0, 50.0)),
    Tool(7, diameter=16.0, corner_radius=85.0),
    Tool(7, diameter=16.0, corner_radius=1.0, cutter=(16.0, 1.0, 3.0, 1.0, 0.0, 0.0, 50.0)),
    Tool(7, diameter=16.0, corner_radius=1.0, taper=np.radians(-60.0)),
])
def test_a_form_that_is_not_known_is_reported_and_nothing_in_it_is_smaller(tool: Tool) -> None:
    made, found = form(tool)
    assert not made.exact and made.of(CUTTER).tolist() == [[8.0, 0.0, 8.0, 20.0, 0.0]]
    assert len(found) == 1 and "does not fit a diameter of 16 mm" in found[0] and "not checked against the part" in found[0]


def test_the_setup_states_the_form_of_what_the_file_does_not_fit() -> None:
    barrel = Tool(7, diameter=16.0, corner_radius=85.0, cutter=(16.0, 85.0, -77.0, 85.0, 0.0, 0.0, 50.0))
    made, found = form(barrel, FULL.model_copy(update={"corner_radius": 0.0}))
    assert made.exact and len(found) == 1 and "85 mm in the CL file" in found[0]


def test_a_cutter_has_a_height_where_nobody_states_its_flutes() -> None:
    """Else a flat end is a disc, into which nothing reaches."""
    bare = ToolSetup(gauge_length=90.0)
    flat, _ = form(Tool(7, diameter=10.0, corner_radius=0.0), bare)
    assert flat.of(CUTTER).tolist() == [[5.0, 0.0, 5.0, 1.0, 0.0]]
    drawn, found = form(Tool(7, diameter=10.0, corner_radius=0.0, length=75.0), bare)
    assert drawn.of(CUTTER)[0, 3] == 75.0 and "what stands above 75 mm over the tip" in found[0]
    seven, _ = form(Tool(7, diameter=6.0, corner_radius=3.0, cutter=(6.0, 3.0, 0.0, 3.0, 0.0, 10.0, 60.0)), bare)
    assert seven.of(CUTTER)[1, 2:4] == pytest.approx([13.0972, 60.0], abs=1e-3)


def test_the_point_of_a_mill_counts_as_flat_and_is_reported() -> None:
    made, found = form(Tool(7, shape="MILL", diameter=10.0, corner_radius=0.0, tip_angle=np.radians(45.0)))
    assert made.of(CUTTER).tolist() == [[5.0, 0.0, 5.0, 20.0, 0.0]] and len(found) == 1 and "taken as flat" in found[0]


def test_a_drill_without_point_angle_is_flat() -> None:
    made, _ = form(Tool(7, shape="DRILL", diameter=10.0, corner_radius=0.0, tip_angle=0.0))
    assert made.of(CUTTER).tolist() == [[5.0, 0.0, 5.0, 20.0, 0.0]]


def test_a_gap_below_a_holders_mesh_is_reported(tmp_path: Path) -> None:
    trimesh.creation.box(bounds=[(-20, -20, 60), (20, 20, 100)]).export(tmp_path / "h.stl")
    mill = Tool(7, diameter=10.0, corner_radius=0.0)
    for shank, noted in (([], "between 20 mm over the tip and the holder, which begins at 60 mm"),
                         ([HolderSection(diameter=8.0, length=40.0)], "")):
        setup = FLAT.model_copy(update={"holder_mesh": "h.stl", "shank": shank})
        _, found = tool_form(7, mill, setup, str(tmp_path / "s.toml"))
        assert [noted in str(d) for d in found] == ([True] if noted else [])
    _, found = tool_form(7, mill, ToolSetup(gauge_length=100.0, holder_mesh="h.stl"),
                         str(tmp_path / "s.toml"))
    assert [d.code for d in found] == ["collision.unchecked"] and "below the holder at 60 mm" in found[0].message


@pytest.mark.parametrize(("change", "code", "noted"), [
    ({"gauge_length": 60.0}, "collision.stack", "begins 75 mm over the tip, above the gauge point at 60 mm"),
    ({"gauge_length": 75.0}, "", ""),
    ({"gauge_length": 45.0}, "collision.stack", "begins 75 mm"),
    ({"shank": []}, "collision.shank", "no shank is stated: the holder begins at 20 mm, where the flutes end"),
])
def test_a_stack_that_does_not_fit_its_gauge_length_is_reported(tmp_path: Path, change: dict[str, object], code: str,
                                                            noted: str) -> None:
    setup = FULL.model_copy(update={"gauge_length": 75.0} | change)
    _, found = tool_form(7, Tool(7, diameter=10.0, corner_radius=0.0), setup, "s.toml")
    assert [d.code for d in found] == ([code] if code else []) and all(noted in d.message for d in found)


def test_setup_check_reports_a_stack_longer_than_the_gauge_length(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text("[bodies.table]\n" + BOX + "[tools.1]\ngauge_length = 130.0\nflute_length = 30.0\n"
                                     "shank = [{diameter = 16.0, length = 80.0}]\n"
                                     "holder = [{diameter = 40.0, length = 100.0}, {diameter = 63.0, length = 100.0}]\n")
    done = CliRunner().invoke(app, ["setup", "check", str(tmp_path / "s.toml")])
    assert done.exit_code == 0 and "collision.stack" in done.output and "130 mm" in done.output


def sunk(mesh: trimesh.Trimesh, pieces: Floats) -> float:
    """Largest distance of points all over a mesh from the nearest of the pieces; negative inside."""
    i, j = np.meshgrid(np.arange(13), np.arange(13), indexing="ij")
    u, v = (i[i + j <= 12] / 12)[:, None, None], (j[i + j <= 12] / 12)[:, None, None]
    a, b, c = np.moveaxis(np.asarray(mesh.triangles), 1, 0)
    points = ((1.0 - u - v) * a + u * b + v * c).reshape(-1, 3)
    rho = np.hypot(points[:, 0], points[:, 1])
    return float(np.min([signed(piece, rho, points[:, 2])[0] for piece in pieces], axis=0).max())


def test_a_spun_mesh_holds_the_mesh_at_any_angle() -> None:
    mesh = trimesh.util.concatenate([trimesh.creation.box(bounds=[(-10, -6, 40), (10, 6, 60)]),
                                     trimesh.creation.cone(radius=30, height=40).apply_translation((0, 0, 60))])
    pieces = spun(np.asarray(mesh.vertices), np.asarray(mesh.edges_unique))
    assert sunk(mesh, pieces) < 1e-6
    corner = np.hypot(10.0, 6.0)
    assert distance(pieces, corner + 1.0, 50.0) == pytest.approx(1.0, abs=1e-6)
    assert distance(pieces, 30.0, 80.0) == pytest.approx(15.0 * np.cos(np.arctan(0.75)), abs=0.05)


def test_a_spun_mesh_with_many_levels_is_held_by_few_pieces() -> None:
    mesh = trimesh.creation.icosphere(3, radius=20.0).apply_translation((3.0, 1.0, 50.0))
    pieces = spun(np.asarray(mesh.vertices), np.asarray(mesh.edges_unique))
    assert len(pieces) <= 60 < len(np.unique(mesh.vertices[:, 2])) and sunk(mesh, pieces) < 1e-6


def test_what_ends_between_two_levels_is_held_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thorn to z = 20 next to a rod to z = 50, in one piece."""
    monkeypatch.setattr("postproc.collision.holder_hull._MOST", 1)
    thorn = trimesh.convex.convex_hull(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [20.0, 0.0, 20.0]]))
    mesh = trimesh.util.concatenate([thorn, trimesh.creation.box(bounds=[(-2, -2, 0), (2, 2, 50)])])
    pieces = spun(np.asarray(mesh.vertices), np.asarray(mesh.edges_unique))
    assert len(pieces) == 1 and sunk(mesh, pieces) < 1e-6


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "off"])
def test_meshes_of_all_formats_are_read_in_their_unit(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"box.{suffix}"
    trimesh.creation.box((1.0, 2.0, 4.0)).export(file)
    mesh, found = load_mesh(file, "inch")
    assert mesh is not None and not found
    assert np.allclose(mesh.extents, [25.4, 50.8, 101.6]) and mesh.is_watertight


def faulty(folder: Path, name: str) -> Path:
    """A file that is no good."""
    box, file = trimesh.creation.box((10.0, 10.0, 10.0)), folder / "x.stl"
    if name == "empty":
        file.write_bytes(b"")
    elif name == "cut":
        box.export(file)
        file.write_bytes(file.read_bytes()[:300])
    elif name == "open":
        trimesh.Trimesh(box.vertices, box.faces[:-1], process=False).export(file)
    elif name == "side":
        faces = np.array(box.faces)
        faces[0] = faces[0][::-1]
        trimesh.Trimesh(box.vertices, faces, process=False).export(file)
    elif name == "nan":
        corners = np.array(box.vertices)
        corners[0] = np.nan
        trimesh.Trimesh(corners, box.faces, process=False).export(file)
    elif name == "format":
        file = folder / "x.3mf"
        file.write_bytes(b"")
    return file


@pytest.mark.parametrize(("name", "code"), [("missing", "mesh.open"), ("empty", "mesh.empty"), ("cut", "mesh.format"),
                                            ("open", "mesh.open_surface"), ("side", "mesh.sides"), ("nan", "mesh.number"),
                                            ("format", "mesh.format")])
def test_a_bad_mesh_is_a_diagnostic(tmp_path: Path, name: str, code: str) -> None:
    file = faulty(tmp_path, name)
    mesh, found = load_mesh(file, key="bodies.part")
    assert mesh is None and [d.code for d in found] == [code]
    assert found[0].file == str(file) and found[0].hint and "bodies.part" in found[0].message


def test_bodies_that_share_an_edge_are_a_solid_each(tmp_path: Path) -> None:
    """A vise of a base and two jaws, the jaws flush with the ends of the base and with each other's edge."""
    boxes = [((0, 0, 0), (90, 60, 20)), ((0, 0, 20), (45, 60, 50)), ((45, 60, 20), (90, 90, 50))]
    mesh = trimesh.util.concatenate([trimesh.creation.box(bounds=pair) for pair in boxes])
    mesh.export(tmp_path / "vise.stl")
    made, found = load_mesh(tmp_path / "vise.stl")
    assert made is not None and not found and made.volume == pytest.approx(mesh.volume)


def test_a_mesh_inside_out_or_in_another_unit_is_reported(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.4, 0.2, 0.1))
    box.invert()
    box.export(tmp_path / "x.stl")
    mesh, found = load_mesh(tmp_path / "x.stl")
    assert mesh is not None and mesh.volume > 0.0
    assert [d.code for d in found] == ["mesh.inside_out", "mesh.size"] and "0.4 mm" in found[1].message


FIXTURE = "[[bodies.fixtures]]\nname = 'a'\n"
BOX = "box = {low = [0.0, 0.0, 0.0], high = [1.0, 1.0, 1.0]}\n"
FIRST = "[tools.1]\ngauge_length = 1.0\n"


@pytest.mark.parametrize(("text", "word"), [
    ("[bodies.table]\n", "file or box"),
    (FIXTURE + "file = 'x.stl'\n" + BOX, "file or box"),
    (FIXTURE + "file = 'x.stl'\n" + FIXTURE + BOX, "name of its own"),
    (FIRST + "shank = [{diameter = 3.0, lower = 2.0, upper = 4.0, length = 5.0}]\n", "diameter, or lower"),
    (FIRST + "holder = [{lower = 2.0, length = 5.0}]\n", "diameter, or lower"),
    (FIRST + "holder_mesh = 'x.stl'\nholder = [{diameter = 2.0, length = 5.0}]\n", "holder or holder_mesh"),
    ("[bodies]\nclearence = 2.0\n", "clearance"),
])
def test_faults_of_the_setup_name_what_is_asked_for(tmp_path: Path, text: str, word: str) -> None:
    file = tmp_path / "s.toml"
    file.write_text(text)
    setup, found = load_setup(file)
    assert setup is None and word in " ".join(map(str, found)), found


def test_setup_check_says_where_bodies_stand(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["setup", "check", str(SAMPLES / "bodies" / "test_part.setup.toml")])
    assert done.exit_code == 0 and "the part: " in done.stdout and "z -80 to -45 mm of the table frame" in done.stdout
    (tmp_path / "s.toml").write_text('[bodies]\npart = "no.stl"\n[tools.1]\ngauge_length = 9.0\nholder_mesh = "none.stl"\n')
    done = CliRunner().invoke(app, ["setup", "check", str(tmp_path / "s.toml")])
    assert done.exit_code == 1 and "no.stl" in done.output and "none.stl" in done.output


def test_a_setup_without_bodies_has_none() -> None:
    assert SetupFile().bodies is None


@pytest.mark.parametrize("far", ["7e39", "1e300", "2e7"])
def test_vertices_beyond_counting_are_refused(tmp_path: Path, far: str) -> None:
    """A number that a damaged file may hold: merging vertices would count it in integers, and wrap round."""
    path = tmp_path / "far.off"
    path.write_text(f"OFF\n4 4 0\n0 0 0\n{far} 0 0\n0 9 0\n0 0 9\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n")
    mesh, found = load_mesh(path)
    assert mesh is None and [d.code for d in found] == ["mesh.number"] and "at most 1e+07" in found[0].message


@pytest.mark.parametrize(("ending", "text"), [
    (".obj", "v 0 0 0\nv 9 0 0\nv  9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf -1 2 3\n"),
    (".ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n9 0 0\n0 9 0\n3 0 1 5\n"),
    (".off", "OFF\n3 1 0\n0 0 0\n9 0 0\n0 9 0\n3 0 1 5\n")])
def test_triangles_of_vertices_that_are_not_there_are_refused(ending: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / f"solid{ending}"
    path.write_text(text, encoding="ascii")
    mesh, found = load_mesh(path)
    assert mesh is None and [d.code for d in found] == ["mesh.format"]
