"""The samples: reproducible, what they claim to be, and read with the counts that the script knows."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

import machines
import toolpaths
from toolpaths.diagnostics import has_errors

FOLDER = Path(__file__).parents[1] / "samples"
EXPECTED = json.loads((FOLDER / "expected_counts.json").read_text())
NAMES = sorted(EXPECTED)
SIZE_LIMIT = 400_000


def run_script(name: str, *arguments: str | Path) -> None:
    subprocess.run([sys.executable, FOLDER / name, *map(str, arguments)], check=True, timeout=60)


def goto_rows(name: str) -> np.ndarray:
    """(N, 3) positions as written."""
    rows = re.findall(r"^GOTO\s*/\s*(.*)$", (FOLDER / name).read_text(), re.MULTILINE)
    return np.array([[float(v) for v in row.split(",")[:3]] for row in rows])


@pytest.fixture(scope="module")
def remade(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples")
    run_script("make_samples.py", folder)
    return folder


@pytest.mark.parametrize("name", [*NAMES, "expected_counts.json"])
def test_script_reproduces_the_file(name: str, remade: Path) -> None:
    assert (remade / name).read_bytes() == (FOLDER / name).read_bytes()


DIALECTS = sorted(p.name for p in (FOLDER / "dialects").iterdir())


def test_script_reproduces_the_dialects(tmp_path: Path) -> None:
    run_script("make_dialects.py", tmp_path)
    assert sorted(p.name for p in (tmp_path / "dialects").iterdir()) == DIALECTS
    for name in DIALECTS:
        assert (tmp_path / "dialects" / name).read_bytes() == (FOLDER / "dialects" / name).read_bytes()


def test_script_reproduces_the_indexed_parts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.syspath_prepend(FOLDER)
    import make_indexing

    make_indexing.main(tmp_path)
    assert {p.name for p in (FOLDER / "indexing").iterdir()} == set(make_indexing.FILES)
    for name in make_indexing.FILES:
        assert (tmp_path / "indexing" / name).read_bytes() == (FOLDER / "indexing" / name).read_bytes()


def test_script_reproduces_the_casting(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.syspath_prepend(FOLDER)
    import make_casting

    make_casting.main(tmp_path)
    assert {p.name for p in (FOLDER / "casting").iterdir()} == set(make_casting.FILES)
    for name in make_casting.FILES:
        assert (tmp_path / "casting" / name).read_bytes() == (FOLDER / "casting" / name).read_bytes()


@pytest.mark.parametrize("name", DIALECTS)
def test_dialects_are_small_explained_and_listed(name: str) -> None:
    data = (FOLDER / "dialects" / name).read_bytes()
    assert len(data) < SIZE_LIMIT
    assert data.startswith(b"$$ ")
    assert f"`{name.removeprefix('inch_')}`" in (FOLDER / "README.md").read_text()


def test_nothing_is_left_over() -> None:
    assert {p.name for p in FOLDER.iterdir() if p.suffix in (".cls", ".apt")} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_small_explained_and_listed(name: str) -> None:
    data = (FOLDER / name).read_bytes()
    assert len(data) < SIZE_LIMIT
    assert data.startswith(b"$$ ")
    assert b"-0.0000" not in re.sub(rb"-0\.0000\d*[1-9]", b"", data)
    assert f"`{name}`" in (FOLDER / "README.md").read_text()


@pytest.mark.parametrize("name", NAMES)
def test_fits_a_table_of_the_mikron(name: str) -> None:
    """Turned any path about the origin, the tip stays inside the shortest travel (Z +-250) with room for the tool."""
    corner = [max(abs(v) for v in pair) for pair in EXPECTED[name]["extents_mm"].values()]
    assert np.hypot(np.hypot(corner[0], corner[1]), corner[2]) < 150
    assert EXPECTED[name]["largest_tilt_deg"] <= (180 if "4axis" in name else 90)


def test_bicubic_ball_touches_the_surface_and_keeps_its_plane() -> None:
    """Distance from each ball centre to a dense grid of the surface, built from cubic smooth steps, is the radius."""
    tip = goto_rows("bicubic.cls").reshape(61, 64, 3)
    assert np.array_equal(tip[..., 0], np.tile(np.arange(61.0)[:, None], (1, 64)))
    centers = tip[::6, 2:63:5] + [0, 0, 8]
    assert np.array_equal(centers[0, :, 1], np.arange(0, 61, 5))
    grid = np.linspace(0, 60, 601)
    step = 3 * (grid / 60) ** 2 - 2 * (grid / 60) ** 3
    z = 10 * (np.outer(1 - step, step) + np.outer(step, 1 - step))
    surface = np.stack((*np.meshgrid(grid, grid, indexing="ij"), z), axis=-1).reshape(-1, 3)
    nearest, _ = cKDTree(surface, balanced_tree=False, compact_nodes=False).query(centers.reshape(-1, 3))
    assert nearest.min() > 8 - 1e-5 and nearest.max() < 8 + 1e-3


def test_tour_is_for_a_simulator() -> None:
    tour = EXPECTED["tool_axis_tour.apt"]
    assert 60 <= tour["points"] <= 120
    assert tour["largest_tilt_deg"] <= 60
    assert np.abs(list(tour["extents_mm"].values())).max() <= 60
    axes = re.findall(r"^GOTO.*?,.*?,.*?,(.*)$", (FOLDER / "tool_axis_tour.apt").read_text(), re.MULTILINE)
    assert [a.strip() for a in axes[:-1]].count("0.000000000, 0.000000000, 1.000000000".replace(" ", "")) == 2


@pytest.mark.parametrize("flags", [(), ("--five-axis",)])
def test_big_file_has_the_points_asked_for(flags: tuple[str, ...], tmp_path: Path) -> None:
    run_script("make_big.py", "2345", tmp_path / "big.cls", *flags)
    path, diagnostics = toolpaths.read(tmp_path / "big.cls")
    assert not has_errors(diagnostics)
    assert len(path) == 2345


@pytest.mark.parametrize("name", NAMES)
def test_reader_finds_what_the_script_wrote(name: str) -> None:
    path, diagnostics = toolpaths.read(FOLDER / name)
    want = EXPECTED[name]
    assert not has_errors(diagnostics), [str(d) for d in diagnostics]
    role = np.bincount(path.role, minlength=4)
    assert role[0] + role[1] == want["points"]
    assert (role[1], role[2], role[3]) == (want["holes"], want["starts"], want["homes"])
    assert (len(path.arcs), len(path.cycles)) == (want["arcs"], want["cycles"])
    assert len(path.operations) == want["operations"]
    assert path.units == want["units"]


@pytest.mark.parametrize("name", NAMES)
def test_reader_puts_the_points_where_the_script_had_them(name: str) -> None:
    path, _ = toolpaths.read(FOLDER / name)
    want = EXPECTED[name]
    for i, (low, high) in enumerate(want["extents_mm"].values()):
        assert np.allclose((path.tip[:, i].min(), path.tip[:, i].max()), (low, high), atol=2e-4)
    tilt = np.degrees(np.arccos(np.clip(path.axis[:, 2], -1, 1))).max()
    assert abs(tilt - want["largest_tilt_deg"]) < 2e-3
    straight = (path.kind == 1) & (path.role == 0)
    length = np.linalg.norm(np.diff(path.tip, axis=0, prepend=path.tip[:1]), axis=1)[straight].sum()
    rise = np.einsum("ni,ni->n", np.diff(path.tip, axis=0, prepend=path.tip[:1])[path.arc >= 0],
                     path.arcs.normal)
    length += np.hypot(path.arcs.radius * path.arcs.sweep, rise).sum()
    assert abs(length - want["feed_length_mm"]) < 0.02


@pytest.mark.parametrize(("name", "machine"), [
    *((name, "mikron-ucp710") for name in NAMES if "4axis" not in name),
    ("indexed_4axis.cls", "mill-4axis"),
    *((name, "mill-3axis") for name in ("pocket.cls", "bicubic.cls", "inch_plate.apt")),
])
def test_every_point_is_within_the_travel_of_a_machine(name: str, machine: str) -> None:
    """At least one branch of the inverse, tool length 0 and 100 mm, part at the table's origin."""
    path, _ = toolpaths.read(FOLDER / name)
    loaded = machines.load(machine)
    # 1e-6: the seventh decimal of the axis, in mm over 150 mm and in rad
    lower, upper = loaded.limits.lower - 1e-6, loaded.limits.upper + 1e-6
    for length in (0.0, 100.0):
        q = loaded.kinematics.with_tool(length).inverse(path.tip, path.axis)
        assert ((q >= lower) & (q <= upper)).all(axis=2).any(axis=0).all()
