"""Arcs, cycles, feeds and rapids under each law, by hand-made geometry."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import postproc
from postproc.control.control import Control
from postproc.path.blocks import rapid_codes
from postproc.path.links import SafeSpace, stays_clear
from postproc.path.travel import extremes
from postproc.setup.model import load_setup
from tests.postproc.control.test_output_modes import FOUR, indexed, turning
from tests.postproc.kit import angle, codes, convert, goto, machine, setup_of, tilted, tool_setup, toolpath
from tests.postproc.modes_kit import TCP, TILTED, first_mode, made, run, shop

__all__ = ["first_mode"]

NX = ["TOOL PATH/A,TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW"]
AXIS = tilted(30.0, 50.0)
FRAMES = {"mikron-ucp710": "tables", "head-table": "mixed", "fork-head-ab": "heads"}


def circle(normal: np.ndarray, first: np.ndarray, sweep: float, rise: float = 0.0, radius: float = 12.0,
           axis: np.ndarray = AXIS) -> list[str]:
    """A cut to the start of an arc about the origin, the arc, and out along the tool axis."""
    across = np.cross(normal, first)
    start = radius * first
    end = radius * (np.cos(sweep) * first + np.sin(sweep) * across) + rise * normal
    one = np.stack([start + 20 * axis, start])
    last = np.stack([end])
    record = ",".join(f"{v:.12f}" for v in (0.0, 0.0, 0.0, *-normal, radius))
    head = [*NX, "RAPID", *goto(one[:1], axis[None]), "FEDRAT/MMPM,600", *goto(one[1:], axis[None]),
            f"CIRCLE/{record},0.03,0.5,{2 * radius:.1f},0{',TIMES,1' if sweep > 6.28 else ''}", *goto(last, axis[None])]
    return [*head, "RAPID", *goto(last + 20 * axis, axis[None]), "END-OF-PATH"]


@cache
def frame_of(name: str) -> np.ndarray:
    """Columns X', Y', Z' of the plane that a machine takes for AXIS."""
    x = np.cross([0.0, 1.0, 0.0], AXIS)
    with TemporaryDirectory() as folder:
        result = convert(toolpath(*circle(AXIS, x / np.linalg.norm(x), 1.0), head=[]), name,
                         shop(Path(folder)))
    return np.asarray(next(s.plane.rotation for s in result.program.sections if s.plane is not None))


SWEEPS = 0.7, 2.5, 4.9, 2.0 * np.pi


@pytest.mark.covering
@pytest.mark.parametrize(("name", "plane", "sweep"), [
    (name, plane, SWEEPS[(k + plane + other) % 4]) for k, name in enumerate(FRAMES) for plane in (17, 18, 19)
    for other in (0, 2)])
def test_arcs_stay_arcs_in_every_plane_of_a_tilted_frame(name: str, plane: int, sweep: float,
                                                         tmp_path: Path) -> None:
    """Of the plane's own axes one is the normal; every sampled point keeps its distance from the centre, in order."""
    frame = frame_of(name)
    third = {17: 2, 18: 1, 19: 0}[plane]
    for sense in (1.0, -1.0):
        normal, first = sense * frame[:, third], frame[:, (third + 1) % 3]
        result = convert(toolpath(*circle(normal, first, sweep), head=[]), name, shop(tmp_path))
        arcs = [b for b in run(result) if b.code == 2]
        assert len(arcs) == 1 and result.program.plane[arcs[0].k] == plane and result.program.ccw[arcs[0].k] == (sense > 0)
        t = np.linspace(0.0, 1.0, 13)[1:]
        across = np.cross(normal, first)
        want = 12.0 * (np.cos(sweep * t)[:, None] * first + np.sin(sweep * t)[:, None] * across)
        assert np.abs(arcs[0].tip - want).max() < 5e-4 and angle(arcs[0].axis, AXIS[None]).max() < 5e-5


@pytest.mark.parametrize("name", FRAMES)
def test_an_arc_square_to_the_tool_stays_one_next_to_rounded_angles(name: str, tmp_path: Path) -> None:
    """The printed plane is up to half a last decimal off the tool of the CL file."""
    axis = tilted(30.123456, 50.987654)
    first = np.cross([0.0, 1.0, 0.0], axis) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], axis))
    result = convert(toolpath(*circle(axis, first, 2.0, axis=axis), head=[]), name, shop(tmp_path))
    arcs = [b for b in run(result) if b.code == 2]
    assert len(arcs) == 1 and np.abs(np.linalg.norm(arcs[0].tip, axis=1) - 12.0).max() < 5e-4
    assert np.abs(arcs[0].tip @ axis).max() < 5e-4


@pytest.mark.parametrize(("planes", "kept"), [("[17, 18, 19]", True), ("[17]", True), ("[18, 19]", False)])
def test_a_helix_is_an_arc_where_the_controller_has_it(planes: str, kept: bool, tmp_path: Path) -> None:
    frame = frame_of("mikron-ucp710")
    lines = circle(frame[:, 2], frame[:, 0], 3.0, rise=-4.0)
    more = f"[arcs]\nhelix_planes = {planes}\n{TILTED}"
    result = convert(toolpath(*lines, head=[]), "mikron-ucp710", shop(tmp_path, more))
    blocks = run(result)
    assert any(b.code == 2 for b in blocks) == kept
    tips = np.concatenate([b.tip for b in blocks if b.code > 0])
    height = tips @ frame[:, 2]
    flat = tips - height[:, None] * frame[:, 2]
    round_ = (height < -0.05) & (height > -3.95)
    assert round_.any() and np.abs(np.linalg.norm(flat[round_], axis=1) - 12.0).max() < 0.011


def test_arcs_become_lines_where_a_mode_has_none(tmp_path: Path) -> None:
    frame = frame_of("mikron-ucp710")
    lines = circle(frame[:, 2], frame[:, 0], 3.0)
    for more in (TILTED + "arcs = false\n", TCP + "arcs = false\n"):
        output = "tcp" if "G43.4" in more else "tilted"
        blocks = run(convert(toolpath(*lines, head=[]), "mikron-ucp710", shop(tmp_path, more), output=output))
        assert not any(b.code == 2 for b in blocks) and sum(b.code == 1 for b in blocks) > 20


# ---- cycles ------------------------------------------------------------------------------------------------


def holes(axis: np.ndarray) -> list[str]:
    side = np.cross(axis, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    return ["RAPID", *goto((30 * axis)[None], axis[None]), "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3",
            *goto(np.stack([10 * side, -10 * side]), axis[None].repeat(2, axis=0)), "CYCLE/OFF"]


@pytest.mark.covering
@pytest.mark.parametrize(("output", "count"), [("tilted", 2), ("tcp", 0)])
@pytest.mark.parametrize("name", ["mikron-ucp710", "fork-head-ab"])
def test_cycles_are_native_in_planes_only(name: str, output: str, count: int, tmp_path: Path) -> None:
    result = made(tmp_path, holes(AXIS), name, output)
    assert len(result.program.holes) == count
    for hole in result.program.holes:
        assert abs(hole.bottom + 5.0) < 2e-4 and abs(hole.plane_level - 3.0) < 2e-4
        assert result.program.feed[hole.drill] == 100.0


@pytest.mark.parametrize(("cycles", "count"), [("true", 2), ("false", 0)])
def test_an_upright_tool_drills_natively_in_tip_mode_where_that_may_be(cycles: str, count: int,
                                                                       tmp_path: Path) -> None:
    result = made(tmp_path, holes(np.array([0, 0, 1.0])), "mikron-ucp710", "tcp",
                  TCP + f"cycles = {cycles}\n")
    assert len(result.program.holes) == count


def test_axis_positions_of_a_table_machine_drill_along_z(tmp_path: Path) -> None:
    """The tool stands along the machine's Z at every pose of a table; on a head it does not."""
    assert len(made(tmp_path, holes(AXIS), "mikron-ucp710", "axes").program.holes) == 2
    assert len(made(tmp_path, holes(AXIS), "fork-head-ab", "axes").program.holes) == 0


def test_a_tap_in_tip_mode_is_refused(tmp_path: Path) -> None:
    lines = [n.replace("CYCLE/DRILL", "CYCLE/TAP") for n in holes(AXIS)]
    assert "cycle.not_native" in codes(made(tmp_path, lines, "mikron-ucp710", "tcp").diagnostics)
    assert "cycle.not_native" not in codes(made(tmp_path, lines, "mikron-ucp710", "tilted").diagnostics)


# ---- rapids ------------------------------------------------------------------------------------------------

DOG = '[kinematics]\nrapids = "dog-leg"\n'


def test_a_dog_leg_is_each_axis_at_its_own_speed() -> None:
    """mill-3axis made slow in Y: X 30 at 500 mm/s, Y 30 at 100 mm/s; after 0.03 s X is half path, after 0.06 s there."""
    m = machine("mill-3axis")
    m = replace(m, limits=replace(m.limits, velocity=np.array([500.0, 100.0, 300.0])))
    control = Control(m, "axes", np.zeros(3), rapids="dog-leg")
    q0, q1 = np.zeros((3, 3)), np.tile([30.0, 30.0, 0.0], (3, 1))
    t = np.array([0.1, 0.2, 0.6])
    _, _, q = control.between(q0, q1, t, m.kinematics, np.ones(3, dtype=bool))
    assert np.allclose(q, [[15, 3, 0], [30, 6, 0], [30, 18, 0]])
    assert np.allclose(control.between(q0, q1, t, m.kinematics)[2][:, :2], 30 * t[:, None])
    assert rapid_codes(control, m.kinematics, q0[:1], q1[:1], 0.01, 1e-3).tolist() == [1]
    assert rapid_codes(control, m.kinematics, q0[:1], np.array([[30.0, 0, 0]]), 0.01, 1e-3).tolist() == [0]
    even = Control(m, "axes", np.zeros(3))
    assert rapid_codes(even, m.kinematics, q0[:1], q1[:1], 0.01, 1e-3).tolist() == [0]


def test_rapids_that_would_leave_their_line_are_fed(tmp_path: Path) -> None:
    lines = ["RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "FEDRAT/MMPM,300", "GOTO/10,0,5", "RAPID", "GOTO/10,0,20", "RAPID",
             "GOTO/40,7,30"]
    fed = setup_of("[tools.1]\ngauge_length = 120\n[output]\nrapids_as_feed = true\n")
    result = convert(toolpath(*lines), "mill-3axis", shop(tmp_path, DOG), fed)
    p = result.program
    rows = np.flatnonzero((p.words[:, 1] == 7) & ~p.link)
    assert p.code[rows].tolist() == [1]
    m = machine("mill-3axis").limits.velocity
    seconds = max(30 / m[0], 7 / m[1], 10 / m[2])
    assert abs(p.feed[rows[0]] - 60 * np.sqrt(30**2 + 7**2 + 10**2) / seconds) < 0.01
    assert "feed.rapid_as_feed" in codes(result.diagnostics)
    straight = made(tmp_path, lines, "mill-3axis", more="")
    assert "feed.rapid_as_feed" not in codes(straight.diagnostics)


def test_holes_at_one_level_are_reached_in_rapid(tmp_path: Path) -> None:
    lines = ["RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/0,0,0", "GOTO/20,7,0", "CYCLE/OFF"]
    result = made(tmp_path, lines, "mill-3axis", more=DOG)
    assert len(result.program.holes) == 2 and "feed.rapid_as_feed" not in codes(result.diagnostics)


def test_a_way_is_looked_at_along_its_dog_leg() -> None:
    """The straight path passes the sphere at 17.9 mm; with equal speeds X and Y go through its centre."""
    m = machine("mill-3axis")
    m = replace(m, limits=replace(m.limits, velocity=np.full(3, 300.0)))
    corners = 10.0 * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    space = SafeSpace(np.zeros(3), 10.0, corners, None, 5.0, np.zeros((1, 3)))
    travel = np.array([[-40.0, -40.0, 0.0], [40.0, 0.0, 0.0]])
    for rapids, clear in (("straight", True), ("dog-leg", False)):
        assert stays_clear(Control(m, "axes", np.zeros(3), rapids=rapids), m.kinematics, space, travel, 1.0) == clear


def test_linking_moves_are_clear_along_their_dog_legs(tmp_path: Path) -> None:
    """The blocks of every linking move, each axis at its own speed, stay off the box of what is cut."""
    result = made(tmp_path, indexed(), "mikron-ucp710", "axes", DOG)
    job, path = result.job, result.path
    rows = np.flatnonzero(np.isnan(path.u[1:]) & (path.code[1:] == 0)) + 1
    kin = job.kinematics(0)
    for t in np.linspace(0.0, 1.0, 41):
        tip, axis, _ = job.control.between(path.q[rows - 1], path.q[rows], np.full(len(rows), t), kin,
                                           np.ones(len(rows), dtype=bool))
        clear = job.space.clear(tip, axis, -0.01)
        on_axis = np.abs(np.einsum("ni,ni->n", tip - kin.forward(path.q[rows])[0], axis)) - np.linalg.norm(
            tip - kin.forward(path.q[rows])[0], axis=1)
        assert (clear | (np.abs(on_axis) < 0.02)).all()


# ---- feeds -------------------------------------------------------------------------------------------------


@pytest.mark.covering
@pytest.mark.parametrize("output", ["tcp", "axes"])
@pytest.mark.parametrize("name", FOUR)
def test_a_turning_cut_takes_its_time_by_every_rule(name: str, output: str, tmp_path: Path) -> None:
    """mm/min of the tip, the root of mm and degrees, X Y Z alone: every rule gives the time that the tip needs."""
    want = None
    for rule in ("all", "geometry", "xyz-first"):
        more = f'{TCP}[feed]\ninverse_time = false\nlength = "{rule}"\n'
        result = made(tmp_path, turning(), name, output, more)
        p, own = result.program, result.job.control
        cut = np.flatnonzero((p.code == 1) & ~p.link)
        cut = cut[1:]
        step = p.words[cut] - p.words[cut - 1]
        xyz, all_ = np.linalg.norm(step[:, :3], axis=1), np.linalg.norm(step, axis=1)
        length = all_ if rule == "all" and output == "axes" else np.where(xyz > 0, xyz, all_)
        total = (60.0 * length / p.feed[cut]).sum()
        want = total if want is None else want
        assert abs(total / want - 1.0) < 2e-3 and own.feed_rule == rule
        assert ("feed.no_inverse_time" in codes(result.diagnostics)) == (output == "axes")
    tips = np.array([result.toolpath.tip[k] for k in np.flatnonzero(result.toolpath.kind == 1)])
    assert want > np.linalg.norm(np.diff(tips[1:], axis=0), axis=1).sum() / (500 / 60) * 0.99


@pytest.mark.parametrize(("rule", "value"),
                         [("length", 600 / (12 * 2.5)), ("radius", 600 / 12), ("refuse", 600.0)])
def test_inverse_time_in_arcs(rule: str, value: float, tmp_path: Path) -> None:
    """600 mm/min on 12 mm radius through 2.5 rad: 1/min of the block, per radian, or per minute."""
    lines = circle(np.array([0, 0, 1.0]), np.array([1.0, 0, 0]), 2.5, axis=np.array([0, 0, 1.0]))
    result = convert(toolpath(*lines, head=[]), "mill-3axis", shop(tmp_path, f'[feed]\narc_inverse = "{rule}"\n'),
                     feed_mode="inverse-time")
    k = int(np.flatnonzero(result.program.code == 2)[0])
    assert abs(result.program.feed[k] / value - 1.0) < 1e-4 and result.program.mode[k] == (rule != "refuse")


def test_fast_arcs_in_planes_are_held_by_the_slides(tmp_path: Path) -> None:
    frame = frame_of("head-table")
    lines = [n.replace("MMPM,600", "MMPM,90000") for n in circle(frame[:, 2], frame[:, 0], 3.0)]
    result = convert(toolpath(*lines, head=[]), "head-table", shop(tmp_path))
    k = int(np.flatnonzero(result.program.code == 2)[0])
    slowest = machine("head-table").limits.velocity[:3].min() * 60.0
    assert result.program.feed[k] <= slowest * (1 + 1e-9) and "feed.reduced" in codes(result.diagnostics)


# ---- travel ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", FRAMES)
def test_extents_know_the_quadrants_of_tilted_arcs(name: str, tmp_path: Path) -> None:
    """Slides of a full circle in a plane, against dense sampling by the machine's own joints."""
    frame = frame_of(name)
    for third in (0, 1, 2):
        lines = circle(frame[:, third], frame[:, (third + 1) % 3], 4.2, rise=0.0, radius=40.0)
        result = convert(toolpath(*lines, head=[]), name, shop(tmp_path))
        kin, path = result.job.kinematics(0), result.path
        k = int(np.flatnonzero(path.code == 2)[0])
        low, high = extremes(path, result.job.moves, result.job.control, result.job.kinematics)
        t = np.linspace(0.0, 4.2, 4001)
        tips = 40.0 * (np.cos(t)[:, None] * frame[:, (third + 1) % 3] + np.sin(t)[:, None] * frame[:, (third + 2) % 3])
        q = kin.at_tip(tips, np.tile(path.q[k], (len(t), 1)), np.arange(3))
        assert np.abs(low[k, :3] - q[:, :3].min(axis=0)).max() < 1e-3
        assert np.abs(high[k, :3] - q[:, :3].max(axis=0)).max() < 1e-3


# ---- tolerance and pivots ----------------------------------------------------------------------------------


def test_a_fixed_amount_of_smoothing_is_taken_from_the_tolerance(tmp_path: Path) -> None:
    more = '[kinematics]\nsmoothing_fixed = 0.004\naxis_smoothing_share = 0.2\n'
    shares = made(tmp_path, turning(), "mikron-ucp710", more=more).shares
    assert shares["smoothing"] == 0.004 and abs(shares["axis_smoothing"] - 0.01) < 1e-12
    assert shares["linearising"] + shares["smoothing"] + shares["rounding"] < 0.01
    tight = made(tmp_path, turning(), "mikron-ucp710", more=more, tolerance=0.003)
    assert "tolerance.smoothing" in codes(tight.diagnostics)


def test_slides_make_up_for_coarse_rotary_words(tmp_path: Path) -> None:
    """Two decimals of degrees: 0.005 degrees at 250 mm would be 0.02 mm; the tip is still at its points."""
    coarse = "[format]\nrotary_decimals = 3\n"
    result = made(tmp_path, turning(), "fork-head-ab", "axes", coarse)
    assert result.job.rounding.made_up
    tips = np.concatenate([b.tip for b in run(result) if b.code > 0])
    for row in np.flatnonzero(result.toolpath.kind == 1):
        assert np.linalg.norm(tips - result.toolpath.tip[row], axis=1).min() < 2e-4
    assert not made(tmp_path, turning(), "mikron-ucp710", "axes", "").job.rounding.made_up


@pytest.mark.parametrize(("point", "code"), [("[-25, 3, -50]", ""), ("[-25, 0, -49.9]", "pivot.mismatch")])
def test_pivots_of_the_control(point: str, code: str, tmp_path: Path) -> None:
    """Along the axis itself (Y) a pivot's point is free; 0.1 mm next to it is an error with both places."""
    file = tmp_path / "own.toml"
    file.write_text(f"[control_pivots.B]\npoint = {point}\n[tools.1]\ngauge_length = 120\n")
    own, found = load_setup(file)
    assert own is not None and not found
    result = convert(toolpath(*indexed()), "trunnion-bc", shop(tmp_path), own)
    wrong = [d for d in result.diagnostics if d.code.startswith("pivot")]
    assert [d.code for d in wrong] == ([code] if code else [])
    if code:
        assert "0.1000 mm" in wrong[0].message and "-49.9" in wrong[0].message and "0.0010 mm" in wrong[0].message


def test_a_pivot_of_no_axis_is_an_error(tmp_path: Path) -> None:
    own = tool_setup().model_copy(update={"control_pivots": {"A": postproc.setup.model.Pivot(point=(0, 0, 0))}})
    result = convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5"), "mill-3axis", shop(tmp_path), own)
    assert "setup.pivot" in codes(result.diagnostics) and result.program is None


@pytest.mark.parametrize("output", ["tilted", "auto"])
def test_deep_holes_are_native_next_to_rounded_angles(output: str, tmp_path: Path) -> None:
    """20 mm of depth in planes whose printed angles are rounded: the last decimal across the tool may flip on the path."""
    for angle_of in (23.4567, 41.2345, 57.6543, 12.3456):
        axis = tilted(angle_of, 3 * angle_of)
        lines = [n.replace("DEPTH,5", "DEPTH,60").replace("DRILL", "TAP") for n in holes(axis)]
        for name in (*FRAMES, "nutating-head"):
            result = made(tmp_path, lines, name, output)
            assert len(result.program.holes) == 2 and "cycle.not_native" not in codes(result.diagnostics), (angle_of, name)
