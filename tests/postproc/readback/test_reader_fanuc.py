"""Fanuc 30i and Haas programs by hand: every expected number is worked out from the maker's rule in the test's name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.verification.neighbour_files import NeighbourFiles
from tests.postproc.reader_kit import FANUC, HAAS, executed, faults, good, words
from tests.postproc.reader_kit import controller as spec

HEAD = "%\nO0001\nG17 G21 G40 G49 G80 G90 G94 G98\nG54\n"
END = "M30\n%\n"


def program(body: str) -> str:
    return HEAD + body + END


@pytest.mark.parametrize("dialect", [FANUC, HAAS])
def test_length_with_the_first_block_that_states_z(dialect: str) -> None:
    motion = good(dialect, program("T1 M6\nG0 X1. Y2.\nG43 H1 Z3.\nG53 G0 Z400.\nG49\nZ3.\n"))
    assert motion.end.tolist() == [[11, 22, 400], [11, 22, 133], [11, 22, 400], [11, 22, 33]]
    assert motion.register.tolist() == [-1, 1, 1, -1] and motion.tool.tolist() == [1, 1, 1, 1]


@pytest.mark.parametrize("dialect", [FANUC, HAAS])
def test_g91_counts_from_where_the_block_begins(dialect: str) -> None:
    motion = good(dialect, program("G0 X1. Y2. Z3.\nG91 X1.\nG1 Y-1. Z.5 F100\nG90 X7.\n"))
    assert words(motion) == [[1, 2, 3], [2, 2, 3], [2, 1, 3.5], [7, 1, 3.5]]


def test_a_change_of_length_does_not_move_what_g91_leaves_alone() -> None:
    motion = good(FANUC, program("T1 M6\nG0 G43 H1 X0. Y0. Z10.\nG91 X1.\nG49\nZ1.\nG90 Z10.\n"))
    assert motion.end[:, 2].tolist() == [140, 140, 141, 40]


@pytest.mark.parametrize(("arc", "centre"), [
    ("G2 X10. Y0. R5.", (5, 0)), ("G2 X6. Y0. R5.", (3, -4)), ("G2 X6. Y0. R-5.", (3, 4)),
    ("G3 X6. Y0. R5.", (3, 4)), ("G3 X6. Y0. R-5.", (3, -4)), ("G2 X10. Y0. I5. J0.", (5, 0))])
def test_radius_is_the_short_way_and_minus_the_long_one(arc: str, centre: tuple[float, float]) -> None:
    """A chord of 6 with radius 5 has its middle 4 next to the centre: clockwise short arcs have it on the right."""
    motion = good(FANUC, program(f"G0 X0. Y0. Z0.\n{arc} F100\n"))
    assert (motion.center[1, :2] - [10, 20]).round(9).tolist() == list(centre)


def test_radius_in_the_zx_plane() -> None:
    """G18 G3 turns Z towards X: from Z0 X0 to Z6 X0 the centre of the short arc is on the left, at +X... X 4."""
    motion = good(FANUC, program("G0 X0. Y0. Z0.\nG18 G3 X0. Z6. R5. F100\n"))
    assert (motion.center[1] - [10, 20, 30])[[0, 2]].round(9).tolist() == [4, 3]


def test_helix_rises_and_full_circle_by_its_end() -> None:
    motion = good(FANUC, program("G0 X0. Y0. Z0.\nG3 I5. J0. Z2. F100\nG2 I5. J0.\n"))
    assert motion.code.tolist() == [0, 2, 2]
    assert words(motion) == [[0, 0, 0], [0, 0, 2], [0, 0, 2]]


def test_too_small_a_radius_is_refused() -> None:
    assert faults(FANUC, program("G0 X0. Y0. Z0.\nG2 X11. Y0. R5. F100\n")) == {"gcode.arc": [6]}


def heights(text: str, dialect: str = FANUC) -> list[tuple[float, int]]:
    motion = good(dialect, program("G0 X0. Y0. Z20.\n" + text + "G80\n"))
    return [(round(float(e[2]) - 30, 4), int(c)) for e, c in zip(motion.end, motion.code, strict=True)][1:]


def test_cycle_goes_over_the_hole_at_its_level_then_to_r() -> None:
    motion = good(FANUC, program("G0 X0. Y0. Z1.\nG99 G81 X1. Y2. Z-5. R3. F100\nG80\n"))
    assert words(motion)[1:] == [[1, 2, 1], [1, 2, 3], [1, 2, -5], [1, 2, 3]]


def test_g83_comes_back_to_r_and_g73_lifts() -> None:
    assert heights("G98 G83 X0. Y0. Z-5. R1. Q3. F100\n") == [
        (1, 0), (-2, 1), (1, 0), (-1.5, 0), (-5, 1), (20, 0)]
    assert heights("G99 G73 X0. Y0. Z-5. R1. Q3. F100\n") == [(1, 0), (-2, 1), (-1.5, 0), (-5, 1), (1, 0)]


def test_tapering_pecks_of_haas() -> None:
    """I first, J less each time, K at least: 4, 3, 2, 2 from R."""
    assert [z for z, c in heights("G99 G83 X0. Y0. Z-10. R1. I4. J1. K2. F100\n", HAAS) if c] == [-3, -6, -8, -10]


@pytest.mark.parametrize("code", ["G84", "G74", "G85", "G89 P100"])
def test_taps_and_bores_leave_at_feed(code: str) -> None:
    assert heights(f"M29 S100\nG98 {code} X0. Y0. Z-5. R1. F100\n") == [(1, 0), (-5, 1), (1, 1), (20, 0)]


def test_repeats_step_on_under_g91() -> None:
    """K (Fanuc) and L (Haas) times; R counts from the first level, Z from R."""
    for dialect, letter in ((FANUC, "K"), (HAAS, "L")):
        motion = good(dialect, program(f"G0 X0. Y0. Z20.\nG91 G99 G81 X2. Z-6. R-19. {letter}3 F100\nG80\nG90 G0 X0.\n"))
        bottoms = [e[:3] for e, c in zip(words(motion), motion.code, strict=True) if c]
        assert bottoms == [[2, 0, -5], [4, 0, -5], [6, 0, -5]], dialect


def test_g80_ends_a_sequence_and_its_first_level() -> None:
    assert heights("G98 G81 X0. Y0. Z-5. R1. F100\nG80\nG0 Z9.\nG81 X1. Z-5. R1.\n")[-1] == (9, 0)


def test_g80_alone_begins_a_new_first_level() -> None:
    """From R 1, where G99 left the tool, not from 20 where the first sequence began."""
    assert heights("G99 G81 X0. Y0. Z-5. R1. F100\nG80\nG98 G81 X1. Z-5. R0.\n")[-1] == (1, 0)


def test_dwells_in_milliseconds_seconds_and_at_the_bottom() -> None:
    text = "G0 X0. Y0. Z9.\nG4 P1500\nX1.\nG4 X2.5\nX2.\nG82 Z-1. R1. P250 F100\nG80\n"
    assert good(FANUC, program(text)).dwell.tolist()[:3] == [1.5, 2.5, 0]
    assert good(FANUC, program(text)).dwell.max() == 2.5
    assert good(FANUC, program(text)).dwell[-2] == 0.25
    haas = good(HAAS, program("G0 X0. Y0. Z9.\nG4 P1500\nX1.\nG4 P1.5\n"))
    assert haas.dwell.tolist() == [1.5, 1.5]


@pytest.mark.parametrize("dialect", [FANUC, HAAS])
def test_a_number_without_a_point_is_refused_but_not_zero_or_feed(dialect: str) -> None:
    assert faults(dialect, program("G0 X0 Y0. Z5.\nG1 X10 F100\n")) == {"gcode.decimal_point": [6]}
    assert faults(dialect, program("G0 X0 Y0 Z0\n")) == {}


def test_reference_position_by_increments_of_zero() -> None:
    """Home of the mill is the machine's; the code of motion from before holds again."""
    motion = good(FANUC, program("T1 M6\nG0 G43 H1 X1. Y2. Z3.\nG1 F100 X2.\nG91 G28 Z0.\nG90 X5.\n"))
    home = good(FANUC, program("G0 X0.\n")).start
    assert motion.end[2, 2] == home[2] and motion.code.tolist() == [0, 1, 0, 1]
    assert faults(FANUC, program("G91 G28 Z5.\nG90 G0 X1.\n")) == {"gcode.reference": [5]}
    assert faults(FANUC, program("G90 G28 Z0.\nG0 X1.\n")) == {"gcode.reference": [5]}


def test_subprograms_of_the_same_file_run_as_often_as_asked() -> None:
    body = "G0 X0. Y0. Z0.\nM98 P2 L2\nX9.\nM30\nO0002\nG91 X1.\nM98 P0020003\nG90 M99\nO0003\nG91 Y1.\nM99\n%\n"
    motion = good(FANUC, HEAD + body)
    assert words(motion) == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 2, 0], [2, 2, 0], [2, 3, 0], [2, 4, 0], [9, 4, 0]]
    assert motion.line.tolist() == [5, 10, 14, 14, 10, 14, 14, 7]


def test_subprograms_of_other_files() -> None:
    motion = good(FANUC, program("G0 X0. Y0. Z0.\nM98 P77\nX9.\n"),
                  others={"O77.nc": b"%\nO0077\nX3.\nM99\n%\n"})
    assert words(motion)[1:] == [[3, 0, 0], [9, 0, 0]]


def test_a_fault_in_another_file_points_there() -> None:
    others = {"O77.nc": b"%\nO0077\nG2 X1. R.1 F9\nM99\n%\n", "O78.nc": b"%\nO78\nG999 X1.\nM99\n%\n"}
    _, found = executed(FANUC, program("G0 X0. Y0. Z0.\nM98 P77\n"), others=others)
    assert [(d.code, d.file, list(d.lines)) for d in found] == [("gcode.arc", "O77.nc", [3])], "O78 is not called"
    _, found = executed(FANUC, program("G0 X0. Y0. Z0.\nM98 P78\n"), others=others)
    assert [(d.code, d.file, list(d.lines)) for d in found] == [("gcode.unknown_code", "O78.nc", [3])]


def test_files_next_to_a_program(tmp_path: Path) -> None:
    for name in ("MAIN.nc", "o0077.NC"):
        (tmp_path / name).write_bytes(b"%\nO0077\nX3.\nM99\n%\n")
    adjacent = NeighbourFiles(tmp_path / "MAIN.nc")
    assert list(adjacent) == ["o0077.NC"] and len(adjacent) == 1 and "MAIN.nc" not in adjacent
    motion = good(FANUC, program("G0 X0. Y0. Z0.\nM98 P77\n"), others=adjacent)
    assert words(motion)[-1] == [3, 0, 0]


def test_local_subprograms_of_haas() -> None:
    motion = good(HAAS, HEAD + "G0 X0. Y0. Z0.\nM97 P50 L2\nM30\nN50 G91 X1.\nG90 M99\n%\n")
    assert words(motion) == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]


@pytest.mark.parametrize(("body", "code"), [
    ("M98 P9\n", "gcode.subprogram"), ("M99\n", "gcode.subprogram"), ("M30\nO2\nX1.\nM98 P2\nM99\n", "gcode.no_end")])
def test_programs_that_cannot_be_followed(body: str, code: str) -> None:
    if code == "gcode.no_end":
        assert "gcode.subprogram" in faults(FANUC, HEAD + "M98 P2\nM30\nO2\nM98 P2\nM99\n%\n")
        return
    assert code in faults(FANUC, program("G0 X0.\n" + body))


@pytest.mark.parametrize(("block", "code"), [
    ("G10 L3 P1 R1.", "gcode.data_setting"),
    ("#1=#500", "gcode.variable"), ("#3000=1", "gcode.alarm"), ("G43.5 H1", "gcode.unknown_code"),
    ("G76 X0. Z-1. R1. Q.1", "gcode.unknown_code"), ("G87 X0.", "gcode.unknown_code"), ("#1=1/0", "gcode.expression"),
    ("G65 P9810", "gcode.subprogram"), ("#1=#3012", "gcode.variable"), ("IF[#1EQ#0]GOTO5", "gcode.jump"),
    ("M198 P1", "gcode.subprogram"), ("G1 G53 X0. F9", "gcode.machine_position"), ("G187 P3", "gcode.unknown_code"),
    ("B5.", "gcode.unknown_word"), ("G0 X1. X2.", "gcode.repeated"), ("G17 G18", "gcode.repeated")])
def test_what_is_not_modelled_is_an_error_with_its_line(block: str, code: str) -> None:
    assert faults(FANUC, program(f"G0 X0. Y0. Z0.\n{block}\n")).get(code) == [6]


def test_block_skip_is_run_with_a_warning() -> None:
    motion, found = executed(FANUC, program("G0 X0. Y0. Z0.\n/G0 X5.\nN30/X6.\n"))
    assert motion is not None and words(motion)[-2:] == [[5, 0, 0], [6, 0, 0]]
    assert [(d.severity.name, d.code, list(d.lines)) for d in found] == [("WARNING", "gcode.block_delete", [6, 7])]


def test_smoothing_of_both() -> None:
    motion = good(FANUC, program("G05.1 Q1\nG0 X0. Y0. Z0.\nG05.1 Q0\nX1.\n"))
    assert motion.blend.tolist() == [spec(FANUC).kinematics.smoothing_fixed, 0.0]
    motion = good(HAAS, program("G0 X0.\nG187 P3 E0.005\nX1.\nG187\nX2.\n"))
    assert np.isnan(motion.blend[0]) and motion.blend[1:].tolist() == [0.005, np.inf]


def test_work_offsets_are_distinguished() -> None:
    assert good(FANUC, program("G0 X0.\nG54.1 P2\nX1.\nG57\nX2.\n")).offset.tolist() == [54, 1002, 57]
    assert good(HAAS, program("G0 X0.\nG154 P2\nX1.\n")).offset.tolist() == [54, 1002]


def test_feed_per_turn_is_feed_times_speed() -> None:
    motion = good(FANUC, program("S500 M3\nG0 X0.\nG95 G1 X1. F.2\nG94 X2. F80\n"))
    assert motion.feed[1:].tolist() == [100, 80]


@pytest.mark.parametrize(("body", "line"), [
    ("G53.1\n", 5), ("G68.2 X0. Y0. Z0. I0. J0. K0.\nG0 X1.\nG53.1\nG69\n", 6),
    ("G68.2 X0. Y0. Z0. I0. J0. K0.\nG43 H1\n", 6),
    ("G43 H1 Z5.\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\n", 6), ("G43.4 H1 Z5.\nG68.2 I0. J0. K0.\n", 6),
    ("G68.2 P1 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG69\n", 5), ("G68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1 P1\nG69\n", 6)])
def test_modes_in_the_wrong_order_are_refused(body: str, line: int) -> None:
    assert faults(FANUC, program(body), "mikron-ucp710").get("gcode.mode") == [line]


def test_modes_need_a_machine_that_has_them() -> None:
    assert "gcode.mode" in faults(FANUC, program("G43.4 H1 Z5.\nG49\n"), "delta-coplanar")


@pytest.mark.parametrize(("dialect", "on", "off"),
                         [(FANUC, "G0 G43.4 H1 Z50.", "G49"), (HAAS, "G0 G234 H1 Z50.", "G49")])
def test_machine_moves_inside_a_mode_are_refused(dialect: str, on: str, off: str) -> None:
    text = program(f"T1 M6\n{on}\nG53 G0 Z400.\n{off}\n")
    assert faults(dialect, text, "mikron-ucp710") == {"gcode.machine_position": [7]}


@pytest.mark.parametrize("text", ["O24 O24 O24\n", "O24\nO25\nM99\n", "%\nO1\n%\n", ""])
@pytest.mark.parametrize("dialect", [FANUC, HAAS])
def test_a_text_of_nothing_but_program_numbers_is_refused(dialect: str, text: str) -> None:
    assert {"gcode.no_end"} <= set(faults(dialect, text))
