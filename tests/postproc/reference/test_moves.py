"""The reference moves: feeds, cycle legs, links, against numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.reference.holes import Phase
from postproc.reference.moves import Moves, build_moves
from postproc.setup.model import SetupFile
from tests.postproc.kit import codes, goto, tilted, toolpath
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import Kind

TOLERANCE = np.radians(0.05)


def moves_of(*lines: str, head: list[str] | None = None,
             setup: SetupFile | None = None) -> tuple[Moves, list[Diagnostic]]:
    return build_moves(toolpath(*lines, head=head), setup or SetupFile(), TOLERANCE)


def legs(*cycle_and_holes: str, before: str = "GOTO/0,0,50") -> list[tuple[float, float, float, str, str]]:
    """(x, y, z, phase, kind) of every leg after the first point."""
    moves, found = moves_of("RAPID", before, *cycle_and_holes)
    assert not found, found
    return [(*map(float, np.round(moves.tip[k], 6) + 0.0), Phase(int(moves.phase[k])).name, Kind(int(moves.kind[k])).name)
            for k in range(1, len(moves))]


# ---- feeds -------------------------------------------------------------------------------------------------


def test_feed_per_minute_in_mm_per_second() -> None:
    moves, found = moves_of("RAPID", "GOTO/0,0,0", "GOTO/10,0,0", "FEDRAT/IPM,10", "GOTO/20,0,0")
    assert not found
    assert np.isnan(moves.feed[0])
    assert moves.feed[1] == pytest.approx(10.0)
    assert moves.feed[2] == pytest.approx(10 * 25.4 / 60)


def test_feed_per_revolution_follows_the_spindle() -> None:
    moves, found = moves_of("RAPID", "GOTO/0,0,0", "FEDRAT/MMPR,0.2", "GOTO/10,0,0", "SPINDL/RPM,3000,CLW",
                            "GOTO/20,0,0", "SPINDL/OFF", "SPINDL/ON", "GOTO/30,0,0")
    assert not found
    assert moves.feed[1:] == pytest.approx([0.2 * 1000 / 60, 0.2 * 3000 / 60, 0.2 * 3000 / 60])


def test_feed_per_revolution_without_a_speed_is_refused() -> None:
    _, found = moves_of("FEDRAT/MMPR,0.2", "RAPID", "GOTO/0,0,0", "GOTO/10,0,0", "SPINDL/RPM,3000,CLW", "GOTO/20,0,0",
                        head=["UNITS/MM", "LOADTL/1"])
    assert "feed.no_speed" in codes(found)
    assert next(d for d in found if d.code == "feed.no_speed").lines == (6,)


def test_inverse_time_is_the_duration_of_each_move() -> None:
    moves, found = moves_of("RAPID", "GOTO/0,0,0", "FEDRAT/INVERS,30", "GOTO/10,0,0", "GOTO/10,1,0", "FEDRAT/MMPM,60",
                            "GOTO/10,2,0")
    assert not found
    assert moves.seconds[1:3] == pytest.approx([2.0, 2.0])
    assert np.isnan(moves.feed[:3]).all() and np.isnan(moves.seconds[[0, 3]]).all()
    assert moves.feed[3] == pytest.approx(1.0)


def test_cutting_without_a_feed_is_refused_with_the_line() -> None:
    moves, found = moves_of("RAPID", "GOTO/0,0,0", "GOTO/10,0,0", "GOTO/20,0,0", head=["UNITS/MM"])
    (d,) = [d for d in found if d.code == "feed.missing"]
    assert (d.lines, d.count) == ((4, 5), 2)
    assert len(moves) == 3


# ---- links -------------------------------------------------------------------------------------------------


def test_rows_that_link() -> None:
    """First motion; tool change; GOHOME; a rapid that turns by more than 5 degrees; nothing else."""
    side, near = tilted(80, 0), tilted(4, 0)
    moves, _ = moves_of(
        "RAPID", *goto([[0, 0, 50]], [[0, 0, 1]]),          # 0 first
        *goto([[0, 0, 0]], [[0, 0, 1]]),
        "RAPID", *goto([[0, 0, 60]], [near]),               # 4 degrees: ordinary rapid
        "RAPID", *goto([[90, 0, 0]], [side]),               # 3 turned
        *goto([[80, 0, 0]], [tilted(60, 0)]),               # cutting: never a link
        "LOADTL/1", "RAPID", *goto([[90, 0, 0]], [tilted(60, 0)]),     # the tool that is there: no change
        "LOADTL/2", "RAPID", *goto([[90, 0, 10]], [tilted(60, 0)]),    # 6 another tool
        "GOHOME", "RAPID", *goto([[90, 0, 20]], [tilted(60, 0)]))      # 7 after home
    assert np.flatnonzero(moves.link).tolist() == [0, 3, 6, 7]


def test_first_motion_links_without_any_tool() -> None:
    moves, _ = moves_of("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", head=["UNITS/MM", "FEDRAT/MMPM,60"])
    assert moves.link.tolist() == [True, False]


def test_link_angle_of_the_setup_moves_the_threshold() -> None:
    lines = ["RAPID", *goto([[0, 0, 50]], [[0, 0, 1]]), "RAPID", *goto([[0, 0, 60]], [tilted(8, 0)])]
    for angle, links in ((7.9, [0, 1]), (8.1, [0])):
        moves, _ = moves_of(*lines, setup=SetupFile.model_validate({"clearance": {"link_angle": angle}}))
        assert np.flatnonzero(moves.link).tolist() == links


def test_operation_with_another_axis_links_from_the_axis_tolerance_on() -> None:
    def operation(name: str, theta: float) -> list[str]:
        return [f"TOOL PATH/{name},TOOL,T1", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "RAPID",
                *goto([[0, 0, 50]], [tilted(theta, 0)]), "FEDRAT/MMPM,100", *goto([[0, 0, 5]], [tilted(theta, 0)]),
                "END-OF-PATH"]
    for theta, links in ((0.02, [0]), (0.2, [0, 2])):
        moves, _ = moves_of(*operation("A", 0.0), *operation("B", theta), head=[])
        assert np.flatnonzero(moves.link).tolist() == links


def test_opposite_axes_are_refused_unless_linked() -> None:
    up, down = [[0, 0, 1.0]], [[0, 0, -1.0]]
    _, cut = moves_of("RAPID", *goto([[0, 0, 5]], up), *goto([[9, 0, 5]], down))
    _, rapid = moves_of("RAPID", *goto([[0, 0, 5]], up), "RAPID", *goto([[9, 0, 5]], down))
    assert codes(cut) == {"axis.opposite"} and cut[0].lines == (7,)
    assert not rapid


# ---- cycles ------------------------------------------------------------------------------------------------

DRILL = "CYCLE/DRILL,DEPTH,12,MMPM,100,CLEAR,3"


def test_drill_with_the_start_plane_as_retract() -> None:
    """Over the hole on the level the tool is at, down to the plane, drill, back to the plane; the next hole from there."""
    assert legs(DRILL, "GOTO/10,0,0", "GOTO/20,0,0") == [
        (10, 0, 50, "POSITION", "RAPID"), (10, 0, 3, "APPROACH", "RAPID"), (10, 0, -12, "DRILL", "FEED"),
        (10, 0, 3, "RETRACT", "RAPID"),
        (20, 0, 3, "POSITION", "RAPID"), (20, 0, -12, "DRILL", "FEED"), (20, 0, 3, "RETRACT", "RAPID")]


def test_auto_returns_to_the_level_before_the_first_hole() -> None:
    got = legs("CYCLE/DRILL,DEPTH,12,RAPTO,3,RTRCTO,AUTO,MMPM,100", "GOTO/10,0,0", "GOTO/20,0,-5")
    assert [p for p in got if p[3] == "RETRACT"] == [(10, 0, 50, "RETRACT", "RAPID"), (20, 0, 50, "RETRACT", "RAPID")]
    assert got[5] == (20, 0, -2, "APPROACH", "RAPID")
    assert got[6] == (20, 0, -17, "DRILL", "FEED")


def test_manual_retract_is_above_each_top_and_never_below_the_plane() -> None:
    got = legs("CYCLE/DRILL,DEPTH,12,RAPTO,3,RTRCTO,20,MANUAL,MMPM,100", "GOTO/10,0,-10", "GOTO/20,0,0")
    assert got[3] == (10, 0, 10, "RETRACT", "RAPID")
    assert got[4:6] == [(20, 0, 10, "POSITION", "RAPID"), (20, 0, 3, "APPROACH", "RAPID")]
    assert got[7] == (20, 0, 20, "RETRACT", "RAPID")
    low = legs("CYCLE/DRILL,DEPTH,12,RAPTO,3,RTRCTO,1,MANUAL,MMPM,100", "GOTO/10,0,0")
    assert low[-1] == (10, 0, 3, "RETRACT", "RAPID")


def test_tool_below_the_plane_rises_before_it_travels() -> None:
    got = legs(DRILL, "GOTO/10,0,0", before="GOTO/0,0,1")
    assert got[:2] == [(0, 0, 3, "POSITION", "RAPID"), (10, 0, 3, "POSITION", "RAPID")]
    assert got[2] == (10, 0, -12, "DRILL", "FEED")


@pytest.mark.parametrize(("kind", "out"),
                         [("BORE", "FEED"), ("REAM", "FEED"), ("TAP", "FEED"), ("DRILL", "RAPID")])
def test_boring_leaves_at_feed_up_to_the_plane(kind: str, out: str) -> None:
    got = legs(f"CYCLE/{kind},DEPTH,12,RAPTO,3,RTRCTO,AUTO,MMPM,100", "GOTO/10,0,0")
    retract = [p for p in got if p[3] == "RETRACT"]
    assert retract[0][4] == out
    assert retract[-1] == (10, 0, 50, "RETRACT", "RAPID")
    assert (len(retract) == 2) == (out == "FEED") and (len(retract) == 1 or retract[0][2] == 3)


def test_pecks_count_from_the_plane() -> None:
    """Depth 10 below the top from 2 above it, step 5: depths -3 and -8 between, bottom -10."""
    deep = legs("CYCLE/DEEP,DEPTH,10,MMPM,100,CLEAR,2,STEP,5", "GOTO/10,0,0")
    z = [(p[2], p[4]) for p in deep if p[3] == "PECK"]
    assert z == [(-3, "FEED"), (2, "RAPID"), (pytest.approx(-2.746), "RAPID"),
                 (-8, "FEED"), (2, "RAPID"), (pytest.approx(-7.746), "RAPID")]
    chip = legs("CYCLE/BRKCHP,DEPTH,10,MMPM,100,CLEAR,2,STEP,5", "GOTO/10,0,0")
    assert [p[2] for p in chip if p[3] == "PECK"] == [-3, pytest.approx(-2.746), -8, pytest.approx(-7.746)]
    assert deep[-2][2:] == chip[-2][2:] == (-10, "DRILL", "FEED")


def test_exact_multiple_of_the_step_makes_no_empty_peck() -> None:
    got = legs("CYCLE/DEEP,DEPTH,8,MMPM,100,CLEAR,2,STEP,5", "GOTO/10,0,0")
    assert [p[2] for p in got if p[3] == "PECK" and p[4] == "FEED"] == [-3]


def test_without_pecks_a_hole_is_one_way_down() -> None:
    moves, _ = moves_of("RAPID", "GOTO/0,0,50", "CYCLE/DEEP,DEPTH,10,MMPM,100,CLEAR,2,STEP,5", "GOTO/10,0,0")
    left = moves.without_pecks()
    assert not (left.phase == Phase.PECK).any()
    assert len(left.feed) == len(left.tip) == len(left.link) == len(moves) - 6
    assert left.tip[left.phase == Phase.DRILL].tolist() == [[10, 0, -10]]


def test_holes_on_a_tilted_face_run_along_its_axis() -> None:
    axis = tilted(60, 90)
    moves, _ = moves_of("RAPID", *goto([50 * axis], [axis]), DRILL, *goto([[10, 0, 0]]))
    want = {Phase.POSITION: np.array([10, 0, 0]) + 50 * axis, Phase.APPROACH: np.array([10, 0, 0]) + 3 * axis,
            Phase.DRILL: np.array([10, 0, 0]) - 12 * axis}
    for phase, tip in want.items():
        assert np.allclose(moves.tip[moves.phase == phase], tip, atol=1e-9)


def test_first_hole_after_a_tool_change_comes_straight_to_the_plane() -> None:
    """A linking move leads there, so AUTO has no level to return to but the plane."""
    moves, _ = moves_of("RAPID", "GOTO/0,0,50", "LOADTL/2", "CYCLE/DRILL,DEPTH,12,RAPTO,3,RTRCTO,AUTO,MMPM,100",
                        "GOTO/10,0,0", "GOTO/20,0,0")
    assert np.flatnonzero(moves.link).tolist() == [0, 1]
    assert moves.tip[1:, 2].tolist() == [3, -12, 3, 3, -12, 3]


def test_cycle_feed_and_rapids_of_holes() -> None:
    moves, _ = moves_of("RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,12,MMPR,0.1,CLEAR,3", "GOTO/10,0,0")
    drill = moves.phase == Phase.DRILL
    assert moves.feed[drill] == pytest.approx(0.1 * 1000 / 60)
    assert np.isnan(moves.feed[~drill]).all()


def test_rows_count_and_curves_join() -> None:
    moves, _ = moves_of("RAPID", "GOTO/0,0,50", DRILL, "GOTO/10,0,0", "CYCLE/OFF", "RAPID", "GOTO/5,5,50",
                        "GOTO/5,5,0")
    assert moves.row.tolist() == [0, 1, 1, 1, 1, 2, 3]
    curves = moves.curves()
    assert np.array_equal(curves.start[1:], moves.tip[:-1]) and np.array_equal(curves.end, moves.tip)
    assert np.array_equal(curves.start[0], moves.tip[0])
