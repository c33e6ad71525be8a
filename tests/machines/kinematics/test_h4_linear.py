"""H4a with C table and with B axis at the spindle: identity, branches, assembly modes, Jacobians, condition V-4."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.kinematics.legs.rotary_axis import HeadAxis, TableAxis
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.mobility import v4
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic

TABLE, SPINDLE = "h4a-c-table", "h4a-spindle-axis"
NAMES = (TABLE, SPINDLE)


def h4(name: str, sense: float = 1.0, **changes: object) -> LegsWithAxis:
    kinematics = machines.load(name).kinematics
    assert isinstance(kinematics, LegsWithAxis)
    return replace(kinematics, axis=replace(kinematics.axis, sense=sense), **changes)


def poses(kinematics: LegsWithAxis, n: int, seed: int = 0) -> tuple[Floats, Floats, Floats]:
    """(tip, axis, platform) of random places in the workspace with a random rotary axis."""
    rng = np.random.default_rng(seed)
    place, tilt = kinematics.workspace.random(rng, n)
    p = np.column_stack([place, tilt])
    most = np.pi if isinstance(kinematics.axis, TableAxis) else 0.8
    tip, axis, _ = kinematics.place(p, rng.uniform(-most, most, n))
    return tip, axis, p


@pytest.mark.covering
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("changes", [{}, {"sense": -1.0, "tool_length": 30.0}])
def test_forward_of_inverse_is_identity_over_the_workspace(name: str, changes: dict[str, object]) -> None:
    kinematics = h4(name, **changes)
    tip, axis, _ = poses(kinematics, 100_000 if not changes else 2_000)
    q = kinematics.inverse(tip, axis)
    assert q.shape == (2 if name == TABLE else 1, len(tip), 5)
    for branch in q:
        found, direction = kinematics.forward(branch)
        assert np.abs(found - tip).max() < 1e-9
        assert np.abs(direction - axis).max() < 1e-12


def test_inverse_is_the_formula_of_the_thesis() -> None:
    """V-22 written out for the parametrisation of the machine file, C table at 0."""
    kinematics = h4(TABLE)
    rng = np.random.default_rng(1)
    x, y, z = rng.uniform([-200, -200, -800], [200, 200, -400], (500, 3)).T
    t = rng.uniform(0.0, np.pi / 4, 500)
    tip = np.stack([x, y + 200 * np.sin(t), z - 200 * np.cos(t)], axis=1)
    axis = np.stack([0 * t, -np.sin(t), np.cos(t)], axis=1)
    y3, z3 = y + 100 * np.cos(t) - 100 * np.sin(t), z + 100 * np.sin(t) + 100 * np.cos(t)
    y4, z4 = y - 100 * np.cos(t) - 100 * np.sin(t), z - 100 * np.sin(t) + 100 * np.cos(t)
    wanted = np.stack([y + np.sqrt(1e6 - (x + 300) ** 2 - z**2), -y + np.sqrt(1e6 - (x + 300) ** 2 - z**2),
                       -y3 + np.sqrt(1e6 - (x - 300) ** 2 - z3**2), y4 + np.sqrt(1e6 - (x - 300) ** 2 - z4**2)], axis=1)
    q = kinematics.inverse(tip, axis)[0]
    np.testing.assert_allclose(q[:, :4], wanted, atol=1e-9)
    np.testing.assert_allclose(q[:, 4], 0.0, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_all_roots_are_poses_of_the_machine(name: str) -> None:
    kinematics = h4(name)
    every = h4(name, all_roots=True)
    tip, axis, _ = poses(kinematics, 60)
    q = every.inverse(tip, axis)
    own = kinematics.inverse(tip, axis)
    assert q.shape == (16 * len(own), 60, 5) == (every.branches, 60, 5)
    np.testing.assert_array_equal(q[: len(own)], own)
    legs = every.legs
    for branch in q[np.isfinite(q).all(axis=(1, 2))]:
        carriages = legs.feet(branch[:, :4])
        if np.abs(carriages[:, 0] - carriages[:, 1]).max() < 1e-6:
            continue  # both pairs in one place: the platform is not held
        tips, axes = every.assembly_modes(branch)
        gap = np.linalg.norm(tips - tip, axis=2) + 100 * np.linalg.norm(axes - axis, axis=2)
        assert np.nanmin(gap, axis=0).max() < 1e-6
        near, direction = every.forward(branch, np.hstack([tip, axis]))
        assert np.abs(near - tip).max() < 1e-6 and np.abs(direction - axis).max() < 1e-8


def test_tilt_and_table_pairs() -> None:
    kinematics = h4(TABLE)
    tip, axis, _ = poses(kinematics, 500)
    q = kinematics.inverse(tip, axis)
    tilts = [kinematics.solve_platform(branch)[:, 3] for branch in q]
    assert np.all(tilts[0] >= 0.0)
    np.testing.assert_allclose(tilts[1], -tilts[0], atol=1e-12)
    np.testing.assert_allclose(np.cos(q[1, :, 4] - q[0, :, 4]), -1.0, atol=1e-12)
    assert np.all((q[..., 4] > -np.pi) & (q[..., 4] <= np.pi))


def test_the_table_is_free_where_the_tool_is_along_it() -> None:
    kinematics = h4(TABLE)
    tip, axis = np.array([[30.0, -40.0, -800.0]]), np.array([[0.0, 0.0, 1.0]])
    assert kinematics.inverse(tip, axis)[0, 0, 4] == 0.0
    near = np.array([0.0, 0.0, 0.0, 0.0, 7.5])
    for branch in kinematics.inverse(tip, axis, near=near):
        assert branch[0, 4] == 7.5 and kinematics.singular(branch).all()
        found, direction = kinematics.forward(branch)
        np.testing.assert_allclose(found, tip, atol=1e-9)
        np.testing.assert_allclose(direction, axis, atol=1e-12)
    tilted = kinematics.inverse(tip, np.array([[0.0, 1e-3, 1.0]]))[0]
    assert not kinematics.singular(tilted).any()


@pytest.mark.parametrize("name", NAMES)
def test_assembly_modes_close_the_rods_and_begin_with_the_home_mode(name: str) -> None:
    kinematics = h4(name)
    tip, axis, _ = poses(kinematics, 1500)
    q = kinematics.inverse(tip, axis)[0]
    modes = kinematics.platform.modes(q[:, :4])
    start = kinematics.solve_platform(q)
    np.testing.assert_allclose(modes[0], start, atol=1e-9)
    count = np.isfinite(modes[:, :, 0]).sum(axis=0)
    assert set(count) <= {2, 4, 6, 8} and count.max() > 2
    for mode in modes:
        rows = np.isfinite(mode[:, 0])
        rods = kinematics.platform.ends(mode[rows]) - kinematics.legs.feet(q[rows, :4])
        np.testing.assert_allclose(np.linalg.norm(rods, axis=2), 1000.0, atol=1e-8)
    tips, axes = kinematics.assembly_modes(q)
    np.testing.assert_allclose(tips[0], tip, atol=1e-9)
    np.testing.assert_allclose(axes[0], axis, atol=1e-12)


def test_all_modes_are_found_that_a_search_from_many_starts_finds() -> None:
    kinematics = h4(TABLE)
    platform = kinematics.platform
    rng = np.random.default_rng(5)
    tip, axis, _ = poses(kinematics, 25, seed=5)
    q = kinematics.inverse(tip, axis)[0, :, :4]
    modes = platform.modes(q)
    for i in range(len(q)):
        start = np.column_stack([rng.uniform(-900, 900, (300, 3)), rng.uniform(-np.pi, np.pi, 300)])
        p, closed = platform.newton(np.tile(q[i], (300, 1)), start)
        for found in p[closed]:
            turn = np.abs(np.exp(1j * found[3]) - np.exp(1j * modes[:, i, 3]))
            assert np.nanmin(np.linalg.norm(found[:3] - modes[:, i, :3], axis=1) + turn) < 1e-5


def test_forward_takes_the_mode_nearest_near() -> None:
    kinematics = h4(TABLE)
    tip, axis, _ = poses(kinematics, 200)
    q = kinematics.inverse(tip, axis)[0]
    tips, axes = kinematics.assembly_modes(q)
    for mode in range(4):
        rows = np.isfinite(tips[mode, :, 0])
        near = np.hstack([tips[mode, rows] + 0.5, axes[mode, rows]])
        found, direction = kinematics.forward(q[rows], near)
        np.testing.assert_allclose(found, tips[mode, rows], atol=1e-6)
        np.testing.assert_allclose(direction, axes[mode, rows], atol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_jacobians_are_derivatives_of_forward(name: str) -> None:
    kinematics = h4(name, tool_length=30.0, sense=-1.0)
    tip, axis, _ = poses(kinematics, 300)
    q = kinematics.inverse(tip, axis)[0]
    columns = []
    for step in np.diag([1e-3, 1e-3, 1e-3, 1e-3, 1e-5]):
        ahead, behind = (np.hstack(kinematics.forward(q + s * step)) for s in (1.0, -1.0))
        columns.append((ahead - behind) / (2 * step.max()))
    jacobian = kinematics.jacobian(q)
    np.testing.assert_allclose(jacobian, np.stack(columns, axis=2), atol=2e-6, rtol=1e-6)
    twist = kinematics.twist_jacobian(q)
    np.testing.assert_array_equal(twist[:, :3], jacobian[:, :3])
    np.testing.assert_allclose(np.cross(twist[:, 3:], axis[:, :, None], axis=1), jacobian[:, 3:], atol=1e-12)


def test_spin_turns_with_omega_along_the_tool() -> None:
    kinematics = h4(SPINDLE)
    tip, axis, _ = poses(kinematics, 200)
    q = kinematics.inverse(tip, axis)[0]
    p = kinematics.solve_platform(q)
    step = 1e-5 * np.eye(5)[4]
    sides = [kinematics.place(kinematics.solve_platform(q + s * step), q[:, 4] + s * 1e-5)[2] for s in (1.0, -1.0)]
    side = kinematics.place(p, q[:, 4])[2]
    numeric = (sides[0] - sides[1]) / 2e-5
    np.testing.assert_allclose(numeric, np.cross(kinematics.twist_jacobian(q)[:, 3:, 4], side), atol=1e-6)
    assert np.isfinite(kinematics.pose(q)[2]).all()


@pytest.mark.parametrize("name", NAMES)
def test_nearest_axis_is_in_reach_and_no_other_is_nearer(name: str) -> None:
    kinematics = h4(name)
    rng = np.random.default_rng(3)
    axis = rng.normal(size=(300, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    nearest = kinematics.nearest_axis(axis)
    place, tilt = kinematics.workspace.random(rng, 20_000)
    turn = rng.uniform(-1.0, 1.0, 20_000) * (np.pi if name == TABLE else np.pi / 2)
    _, reachable, _ = kinematics.place(np.column_stack([place, tilt]), turn)
    assert np.all(np.sum(nearest * axis, axis=1) >= np.max(axis @ reachable.T, axis=1) - 1e-9)
    np.testing.assert_array_equal(kinematics.nearest_axis(reachable), reachable)
    middle = kinematics.place(np.tile([0.0, 0.0, -600.0, 0.0], (1, 1)), np.zeros(1))[0]
    q = kinematics.inverse(np.tile(middle, (300, 1)), nearest)
    found = np.isfinite(q).all(axis=2).any(axis=0)
    assert found[np.abs(nearest[:, 0]) < 0.7].all()


def test_a_tilt_beyond_the_workspace_is_out_of_reach() -> None:
    kinematics = h4(TABLE)
    angle = np.radians([44.9, 45.1])
    axis = np.stack([0 * angle, -np.sin(angle), np.cos(angle)], axis=1)
    q = kinematics.inverse(np.tile([0.0, 150.0, -750.0], (2, 1)), axis)
    assert np.isfinite(q[:, 0]).all() and np.isnan(q[:, 1]).all()
    assert np.isnan(kinematics.forward(np.array([[3000.0, 0, 0, 0, 0]]))[0]).all()


def test_v4_times_the_platform_is_the_full_constraint_matrix() -> None:
    """det of the six rods' lines = det Jx times V-4, up to the spacing of the pairs: both are needed."""
    kinematics = h4(TABLE)
    platform = kinematics.platform
    _, _, p = poses(kinematics, 200)
    q = platform.inverse(p)
    jx, ends = platform.jx(p, q), platform.ends(p)
    shift = np.array([[180.0, 0, 0], [-180, 0, 0], [100, 0, 0], [-100, 0, 0], [0, 0, 0], [0, 0, 0]])
    rods = jx[:, [0, 0, 1, 1, 2, 3], :3]
    arms = ends[:, [0, 0, 1, 1, 2, 3]] + shift - p[:, None, :3]
    full = np.linalg.det(np.concatenate([rods, np.cross(arms, rods)], axis=2))
    product = np.linalg.det(jx) * v4(jx[:, :, :3], kinematics.legs, (0, 1)) * 1e6 * 360 * 200
    np.testing.assert_allclose(np.abs(full / product), 1.0, rtol=1e-9)


# ---- machine files that must be refused --------------------------------------------------------------------

def changed(tmp_path: Path, text: str) -> list[Diagnostic]:
    file = tmp_path / "bad.toml"
    file.write_text(f'base = "{TABLE}"\n{text}', encoding="utf-8")
    machine, diagnostics = machines.load_checked(file)
    assert machine is None
    return diagnostics


@pytest.mark.parametrize(("text", "code", "words"), [
    ("[kinematics.legs.Y]\nroot = -1", "machine.mobility", "condition V-4"),
    ("[kinematics.legs.X]\nrods = [[0, 50, 0], [0, -50, 0]]", "machine.mobility", "lie along"),
    ("[kinematics.legs.X]\nrods = [[50, 0, 0], [50, 0, 0]]", "machine.mobility", "in one place"),
    ("[kinematics.legs.Z]\njoint = [0, 0, 0]\n[kinematics.legs.U]\njoint = [0, 0, 0]", "machine.singular", "det Jx"),
    ("[kinematics.legs.Z]\nrods = [[0, 5, 0]]", "machine.geometry", "turns a shift"),
    ("[kinematics.legs.Z]\nrods = [[0, 0, 0], [1, 0, 0]]", "machine.geometry", "two pairs and two single rods"),
    ("[kinematics.workspace]\nz = [-1200, -400]", "machine.workspace", "does not reach"),
    ("[kinematics.workspace]\ntilt = [10, 45]", "machine.geometry", "does not hold 0"),
    ("[kinematics.workspace]\nx = [200, -200]", "file.value", "is empty"),
    ("[kinematics.rotary]\npivot = [1, 0, 0]", "machine.geometry", "table turns"),
    ("[kinematics.legs.X]\ndirection = [0, 2, 0]", "machine.geometry", "has length 2"),
    ("[kinematics.legs.X]\nroute = 1", "file.unknown-key", "route"),
])
def test_a_geometry_that_does_not_work_is_refused_with_the_reason(tmp_path: Path, text: str, code: str,
                                                                  words: str) -> None:
    diagnostics = changed(tmp_path, text)
    assert diagnostics[0].code == code
    assert words in diagnostics[0].message and diagnostics[0].lines


def test_v4_breaks_while_the_condition_number_stays_finite() -> None:
    """Both pairs from one side: V-4 is 0 where they meet in one plane, which det Jx does not show there."""
    kinematics = h4(TABLE)
    legs = kinematics.legs
    loops = kinematics.platform.loops
    broken = replace(kinematics.platform, loops=replace(loops, drives=replace(legs, roots=np.array([1.0, -1.0, 1.0, 1.0]))))
    p = np.array([[0.0, 0.0, -600.0, 0.2]])
    jx = broken.jx(p, broken.inverse(p))
    assert abs(v4(jx[:, :, :3], legs, (0, 1))[0]) < 1e-12


def test_kinds() -> None:
    assert isinstance(h4(TABLE).axis, TableAxis) and isinstance(h4(SPINDLE).axis, HeadAxis)
    assert machines.load(TABLE).axis_names == ("X", "Y", "Z", "U", "C")
    assert machines.load(SPINDLE).axis_names == ("X", "Y", "Z", "U", "B")
