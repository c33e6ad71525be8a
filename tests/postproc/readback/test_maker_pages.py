"""What reader and writers share, against the makers' pages: programs by hand, and what the page says that they do.

Nothing here is taken from the project's own tables: numbers are worked out from the rule, codes typed from
the page that stands next to them (the letters are those of `postproc/readback/SHARED.md` and
`docs/reference/control-rules.md`).
"""

from __future__ import annotations

import numpy as np
import pytest

from postproc.control.modes import table_axes
from postproc.controllers.model import builtin_files
from postproc.readback.comparison.unstated_codes import changed_alone
from postproc.readback.dialects.readers import reader_for
from postproc.readback.text.words import plain
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from tests.postproc.kit import convert, toolpath
from tests.postproc.kit import good as converted
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, TNC, control, faults, good, look, words
from tests.postproc.reader_kit import controller as spec
from toolpaths.units import DEG, PER_MINUTE

ISO, NGC = "generic-iso", "linuxcnc"
G_CODED = [FANUC, HAAS, SIEMENS, ISO, NGC]
FLOOD, MIST, THROUGH, AIR = 1, 2, 4, 8


def program(dialect: str, body: str) -> str:
    """Body lines between the head and the end that the maker's manual asks for."""
    if dialect == TNC:
        rows = ["BEGIN PGM T1 MM", *body.splitlines(), "M30", "END PGM T1 MM"]
        return "\n".join(f"{n} {row}" for n, row in enumerate(rows)) + "\n"
    if dialect == SIEMENS:
        return f"G17 G710 G90 G94 G40 G64\nG54\n{body}M30\n"
    head = "G17 G21 G40 G49 G80 G90 G94\nG54\n" + ("G91.1\n" if dialect in (ISO, NGC) else "")
    return f"%\n{'O0001' if dialect in (FANUC, HAAS) else ''}\n{head}{body}M30\n%\n".replace("%\n\n", "%\n")


@pytest.mark.parametrize("dialect", [FANUC, HAAS])
@pytest.mark.parametrize(("ends", "code"), [("G80\n", 1), ("G0 G80\n", 0), ("G80 G0\n", 0), ("G80\nG0\n", 0)])
def test_the_code_of_motion_holds_behind_a_cycle(dialect: str, ends: str, code: int) -> None:
    """H1, B-63943EN-1: G80 to G89 are of group 09, G0 to G3 of group 01. Safe starts of Haas have both in one block."""
    drilled = "G0 X0. Y0. Z20.\nG1 Z10. F500.\nG81 X1. Y1. Z-9. R5. F500.\n"
    motion = good(dialect, program(dialect, f"G00 G17 G80\n{drilled}{ends}X30. Y1.\n"))
    assert motion.code[-1] == code and words(motion)[-1][:2] == [30.0, 1.0]


@pytest.mark.parametrize("dialect", G_CODED)
@pytest.mark.parametrize(("plane", "arc", "axes", "quarter"), [
    ("G17", "G3 X0. Y10. I-10. J0.", (0, 1), (0.0, 10.0, 0.0)), ("G18", "G3 Z0. X10. K-10. I0.", (2, 0), (10.0, 0.0, 0.0)),
    ("G19", "G3 Y0. Z10. J-10. K0.", (1, 2), (0.0, 0.0, 10.0))])
def test_planes_and_the_sense_of_arcs(dialect: str, plane: str, arc: str, axes: tuple[int, int],
                                      quarter: tuple[float, float, float]) -> None:
    """S6 p. 20: G17 is X-Y, G18 Z-X, G19 Y-Z; I, J, K from the start to the centre. S7 p. 1249: the plane of G18 is that of
    the 3rd and the 1st axis. N 3.5.3: G3 is anti-clockwise seen from the positive end of the third axis.

    A quarter from 10 on the plane's first axis to 10 on its second: its middle lies at 45 degrees on the side of both.
    """
    start = np.zeros(3)
    start[axes[0]] = 10.0
    at = "X{:.1f} Y{:.1f} Z{:.1f}".format(*start)
    motion = good(dialect, program(dialect, f"G0 {at}\nG1 {at} F100.\n{plane}\n{arc}\nG17\n"))
    row = int(np.flatnonzero(motion.code == 2)[0])
    assert words(motion)[row] == list(quarter)
    assert motion.code[:row].tolist() == [0] * (row - 1) + [1]
    held = control()
    middle, _ = look(motion, held).poses(motion, np.array([row]), 0.5)
    wanted = np.array([10.0, 20.0, 30.0])
    wanted[list(axes)] += 10.0 * np.sqrt(0.5)
    assert middle[0] == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(("dialect", "code", "flows"), [
    *((d, "M8", FLOOD) for d in (*G_CODED, TNC)), *((d, "M7", MIST) for d in (FANUC, SIEMENS, ISO, NGC, TNC)),
    (HAAS, "M88", THROUGH), (HAAS, "M83", AIR)])
def test_codes_of_coolant(dialect: str, code: str, flows: int) -> None:
    """N 3.6.4: M7 mist, M8 flood, M9 both off. H1: M88 and M89 coolant through the spindle, M83 and M84 air
    jet; T7: M08 coolant on, M09 off."""
    off = {"M88": "M89", "M83": "M84"}.get(code, "M9")
    if dialect == TNC:
        body = f"TOOL CALL 1 Z S500\nL X+1 Y+0 Z+9 R0 FMAX {code}\nL X+2 R0 F100\nL X+3 {off}\nL X+4\n"
    else:
        body = f"G0 X1. Y0. Z9.\n{code}\nG1 X2. F100.\n{off}\nX3.\n"
    motion = good(dialect, program(dialect, body))
    assert [int(c) & flows for c in motion.coolant[1:2].tolist()] == [flows] and motion.coolant[-1] == 0
    assert motion.coolant[1] == flows, "and nothing else"


@pytest.mark.parametrize(("dialect", "stop"), [(TNC, "both"), (HAAS, "both"), (FANUC, "both"), (SIEMENS, "both"),
                                               (ISO, "both"), (NGC, "neither")])
def test_a_stop_switches_off_what_the_maker_says(dialect: str, stop: str) -> None:
    """T7, table of M functions: M00 stops program run and spindle and switches coolant off; H1: M00 stops the
    spindle and turns coolant off. On the others the builder decides: the safe form. LinuxCNC's M0 only pauses."""
    if dialect == TNC:
        body = "TOOL CALL 1 Z S500\nL X+1 Y+0 Z+9 R0 FMAX M3\nL M8\nL X+2 R0 F100\nM0\nL X+3\n"
    else:
        body = "S500 M3\nM8\nG0 X1. Y0. Z9.\nG1 X2. F100.\nM0\nX3.\n"
    motion = good(dialect, program(dialect, body))
    before, after = (int(np.flatnonzero(np.isclose(motion.end[:, 0], x))[k]) for x, k in ((12.0, -1), (13.0, 0)))
    assert motion.spindle[before] == 1 and motion.coolant[before] == FLOOD
    runs = stop == "neither"
    assert (motion.spindle[after] == 1) == runs and (motion.coolant[after] == FLOOD) == runs


@pytest.mark.parametrize(("name", "carry"), [("mikron-ucp710", "AC"), ("trunnion-bc", "BC"), ("head-table", "C"),
                                             ("fork-head-ab", ""), ("mill-4axis", "A")])
def test_axes_that_carry_the_part(name: str, carry: str) -> None:
    """Primed letters of the ISO 10791-6 code that the machine file states are on the part's side."""
    held = control(name)
    found = "".join(held.machine.axis_names[j] for j in table_axes(held))
    primed = "".join(sorted(a for a in "ABC" if f"{a}'" in held.machine.structure))
    assert primed == carry and found in (carry, "")  # none where the control has no tip mode for the machine


@pytest.mark.parametrize("name", sorted(builtin_files()))
def test_the_head_is_no_code(name: str) -> None:
    """What both sides look for in the head stands in comments: without them not a word of it is left."""
    result = converted(convert(toolpath("RAPID", "GOTO/0,0,5", "GOTO/9,0,5"), "mill-3axis", name))
    head = "\n".join(result.text.splitlines()[:14])
    left = plain(head.encode()).decode().lower()
    assert "postproc" in head.lower() and "proved by" in head.lower()
    assert not any(word in left for word in ("postproc", "fingerprint", "proved", "machine", "tolerance"))


@pytest.mark.parametrize(("dialect", "cut", "feed"), [
    (FANUC, "G1 X2. Y-1. F10.", 254.0), (HAAS, "G1 X2. Y-1. F10.", 254.0), (NGC, "G1 X2 Y-1 F10", 254.0),
    (ISO, "G1 X2. Y-1. F10.", 254.0), (SIEMENS, "G1 X2 Y-1 F10", 254.0), (TNC, "L X+2 Y-1 R0 F100", 254.0)])
def test_inches_of_every_control(dialect: str, cut: str, feed: float) -> None:
    """F1 8.2, H1, N 3.5.6: G20; S1: G700 for lengths and feeds; T1: F in tenths of an inch per minute. 1 inch is 25.4 mm."""
    up = "L X+0 Y+0 Z+1 R0 FMAX" if dialect == TNC else "G0 X0. Y0. Z1."
    text = program(dialect, f"{up}\n{cut}\n")
    for mm, inch in ((" MM", " INCH"), ("G710", "G700"), ("G21", "G20")):
        text = text.replace(mm, inch)
    motion = good(dialect, text)
    assert (motion.end[-1] - motion.end[-2])[:2].tolist() == pytest.approx([2.0 * 25.4, -25.4])
    assert motion.feed[-1] * motion.unit[-1] == pytest.approx(feed)


@pytest.mark.parametrize(("dialect", "on", "mm"), [
    (HAAS, "G187 P3 E0.001\n", 0.0254), (NGC, "G64 P0.001 Q0.001\n", 0.0508),
    (SIEMENS, "CYCLE832(0.001,_ORI_FINISH,0.05)\n", 0.0254)])
def test_smoothing_in_inches(dialect: str, on: str, mm: float) -> None:
    """Lengths of the control's smoothing are in the units of the program."""
    text = program(dialect, f"{on}G0 X1. Y0. Z1.\n").replace("G710", "G700").replace("G21", "G20")
    assert good(dialect, text).blend[-1] == pytest.approx(mm)


def test_units() -> None:
    assert abs(DEG * 180.0 - np.pi) < 1e-15 and abs(PER_MINUTE * 60.0 - 1.0) < 1e-15


@pytest.mark.parametrize(("dialect", "up", "above"), [
    (FANUC, "G53 G0 Z300.", "G0 X1. Y0."), (HAAS, "G53 G0 Z300.", "G0 X1. Y0."), (NGC, "G53 G0 Z300.", "G0 X1. Y0."),
    (SIEMENS, "G0 SUPA D0 Z300", "G0 X1 Y0"), (TNC, "L Z+300 R0 FMAX M91", "L X+1 Y+0 FMAX")])
def test_machine_coordinates_are_for_one_block(dialect: str, up: str, above: str) -> None:
    """S6 p. 3-42: G53 and SUPA suppress work offsets in their block alone; T7: M91, coordinates in the
    positioning block are from the machine datum; F5 14.1.2, H1: G53 for one block."""
    low = "L Z+9 FMAX\n" if dialect == TNC else "Z9.\n"
    call = "TOOL CALL 3 Z S500\n" if dialect == TNC else ""
    motion = good(dialect, program(dialect, f"{call}{up}\n{above}\n{low}"))
    assert motion.end[0, 2] == 300.0 and motion.end[-1].tolist() == [11.0, 20.0, 39.0]


@pytest.mark.parametrize(("body", "lines"), [
    ("G53 G0 Z0.\nG49\nG0 X1.\nG43 H1 Z9.\n", []), ("G0 G43 H1 Z9.\nX1.\nG49 Z9.\n", []),
    ("G0 G43 H1\nZ9.\nX1.\nG49\n", [5, 8]), ("G0 G43 H1 Z9.\nG49\nG53 G0 Z0.\n", [6]),
    ("G0 G43 H1 Z9.\nG53 G0 Z0.\nM5\nG49\n", []), ("G0 G43 H1 Z9.\nG53 G0 X0.\nG49\n", [7]),
    ("G0 G43 H1 Z9.\nG53 G0 G49 Z0.\nG43 H0\nG43 H2 X1.\n", [8]), ("G0 G43 H1 Z9.\nG43 H1\nG43 H2\n", [7]),
    ("G0 G43 H1 Z9.\nG91 G28 Z0.\nG49\nG90\n", [])])
def test_lengths_that_change_in_blocks_of_their_own(body: str, lines: list[int]) -> None:
    """B-63943EN-1 12.5.2: G43 and G49 without a move move nothing with 5006#6 TOS = 1, else by the length; F5 14.1.2: a move
    of Z by G53 or G28 ends the length. The head has G49 in line 3, before which nobody knows what is in force."""
    held = spec(FANUC)
    code, found = reader_for(held, ("X", "Y", "Z"), np.array([0.0, 0.0, 400.0])).read(program(FANUC, body).encode(), "MAIN")
    assert code is not None and not found and held.tools.length_alone
    assert [code.line[blocks].tolist() for blocks in changed_alone(code)] == [lines, [3]]


def test_rigid_taps_on_fanuc_need_m29() -> None:
    """F2 4.: M29 S before G84 makes it rigid, else spindle and feed are not coupled; H1: G84 is rigid without."""
    body = "G98\nG0 X0. Y0. Z20.\n{}G84 X1. Y1. Z-9. R5. F500.\nG80\n"
    for dialect, before in ((FANUC, "M29 S500\n"), (HAAS, "S500 M3\n")):
        motion = good(dialect, program(dialect, body.format(before)))
        tapped = np.isfinite(motion.pitch)
        assert tapped.any() and not motion.floating[tapped].any() and motion.pitch[tapped].tolist() == [1.0] * tapped.sum()
    assert "gcode.rigid_tap" in faults(FANUC, program(FANUC, body.format("S500 M3\n")))


def test_no_built_in_file_has_passive_codes() -> None:
    assert not any(spec(name).program.passive for name in builtin_files())


@pytest.mark.parametrize(("dialect", "named", "written"), [
    (FANUC, "G54.1 P2", "G54.1 P2"), (FANUC, "G59.1", None), (HAAS, "G154 P2", "G154 P2"), (HAAS, "G110", "G154 P1"),
    (HAAS, "G129", "G154 P20"), (HAAS, "G130", None), (HAAS, "G59.1", None), (SIEMENS, "G57", "G57"),
    (SIEMENS, "G58", "G505"), (SIEMENS, "G59", "G506"),
    (SIEMENS, "G59.2", None), (TNC, "G59.3", None), (NGC, "G59.2", "G59.2"), (ISO, "G59.1", None)])
def test_names_of_work_offsets(dialect: str, named: str, written: str | None) -> None:
    """F1: G54 to G59, then G54.1 P1; H1: G154 P1, G110 to G129 are P1 to P20; S1: G54 to G57, then G505 (G58 and G59 are
    programmable offsets); N: G59.1 to G59.3."""
    program = spec(dialect).program
    assert program.offset_block("G55") is not None and program.offset_block(named) == written


def test_names_of_work_offsets_on_a_tnc() -> None:
    """T3 cycle 247: Q339 is the number of the preset."""
    names = spec(TNC).program.work_offsets
    assert "247" in names["G54"] and "Q339=+1 " in names["G54"] and "Q339=+2 " in names["G55"]


@pytest.mark.parametrize(("dialect", "call"), [(SIEMENS, 'T="EM10"\n'), (TNC, 'TOOL CALL "EM10" Z'),
                                               (TNC, 'TOOL DEF "EM10"')])
def test_names_of_tools(dialect: str, call: str) -> None:
    """S1: T="identifier"; T1: a tool is called by its number, or by its name in quotation marks. Fanuc, Haas: numbers."""
    codes = spec(dialect).codes
    assert codes.tool_by_name.format(name="EM10") in call and '"' in codes.tool_by_name
    assert not spec(FANUC).codes.tool_by_name and not spec(HAAS).codes.tool_by_name and spec(dialect).tools.names == {}


@pytest.mark.parametrize(("dialect", "on", "blend"), [
    (HAAS, "G187 P3 E0.02\n", 0.02), (NGC, "G64 P0.02 Q0.01\n", 0.03), (SIEMENS, "CYCLE832(0.02,_ORI_FINISH,0.05)\n", 0.02),
    (FANUC, "G05.1 Q1\n", 0.002)])
def test_smoothing_is_what_the_program_says(dialect: str, on: str, blend: float) -> None:
    """H1: E of G187 is corner rounding in mm; LinuxCNC: P and Q of G64 together (measured); S4 3.25: first
    parameter of CYCLE832. Under G05.1 Q1 it is a parameter of the control, which the controller file states."""
    motion = good(dialect, program(dialect, f"{on}G0 X1. Y0. Z9.\n"))
    assert motion.blend[-1] == pytest.approx(blend)


def test_smoothing_of_the_tool_axis_is_what_the_program_says() -> None:
    """S4 3.25: third parameter of CYCLE832, types of orientation; T3 12: TA of cycle 32. Degrees: three tenths of 0.05."""
    assert {name: spec(name).kinematics.axis_smoothing_share for name in (SIEMENS, TNC)} == {SIEMENS: 0.3, TNC: 0.3}
    turning = toolpath("RAPID", "GOTO/0,0,20,0,0,1", "FEDRAT/MMPM,500", "GOTO/0,0,5", "GOTO/5,0,5,0.1,0,0.994987437")
    for dialect, words_ in ((SIEMENS, "CYCLE832(0.003,_ORI_FINISH,0.015)"), (TNC, "HSC-MODE:0 TA0.015")):
        made = converted(convert(turning, "mikron-ucp710", dialect, output="axes"))
        assert words_ in made.text and made.job is not None
        for degrees, bad in ((0.015, False), (0.014, False), (0.016, True)):
            _, found = read_back(made.text.replace("0.015", str(degrees)), made.job, "part.apt")
            assert ("verify.smoothing" in {d.code for d in found}) == bad


def test_names_in_blocks_of_the_shop() -> None:
    """Letters, digits, blanks, - . _ alone, any other character is _; 120 characters a block, twelve for its number."""
    name = "ROUGH/TOP;1"
    path = toolpath("UNITS/MM", f"TOOL PATH/{name},TOOL,{'E' * 150}", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1",
                    "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/0,0,20", "FEDRAT/MMPM,500", "GOTO/0,0,5", "END-OF-PATH", head=[])
    hooks = {"before_operation": ["(OP {operation})"], "after_tool": ["(T {tool_name})"]}
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": 100.0}}, "hooks": hooks})
    text = converted(convert(path, "mill-3axis", FANUC, setup)).text
    assert "(OP ROUGH_TOP_1)" in text and f"\n(T {'E' * (120 - 12 - 4)})\n" in text


def test_room_below_home_for_longer_tools() -> None:
    """Z is at home at 250 mm."""
    path = toolpath("RAPID", "GOTO/0,0,20,0,0,1", "FEDRAT/MMPM,500", "GOTO/0,0,5", "GOTO/5,0,5,0.1,0,0.994987437")
    text = converted(convert(path, "mikron-ucp710", FANUC, output="tcp")).text
    assert "G53 G0 Z240.\nG43.4 H1\n" in text


def test_only_generic_iso_has_states_of_its_own() -> None:
    """States at the beginning of a program are parameters everywhere (3402 on Fanuc): no built-in file takes
    any for given but the arc centres of ISO 6983-1."""
    assert {name: spec(name).start.codes for name in builtin_files() if spec(name).start.codes} == {ISO: ("G91.1",)}


def test_an_arc_begins_compensation_on_linuxcnc_alone() -> None:
    """F (PS0034), H (alarms 340, 341), S (G0 or G1), T (no RL in a circle block); LinuxCNC begins on an arc, measured."""
    rules = {name: spec(name).cutter_compensation for name in builtin_files()}
    assert {name for name, rule in rules.items() if rule.begins_on_arc} == {NGC}
    assert not any(rule.ends_on_arc for rule in rules.values())


def test_how_outside_corners_are_gone_round() -> None:
    """F2: intersection of straight moves (19607#2 CCC = 0); S1: G450; T1: transitional arc; H1 does not say."""
    rules = {name: spec(name).cutter_compensation for name in builtin_files()}
    assert {name: (rule.start, rule.corners) for name, rule in rules.items() if rule.start} == {
        FANUC: ("next", "intersection"), HAAS: ("next", ""), SIEMENS: ("next", "arc"), TNC: ("next", "arc")}


@pytest.mark.parametrize(("dialect", "modal"), [(FANUC, True), (HAAS, True), (ISO, True), (NGC, False)])
def test_the_radius_register_is_modal(dialect: str, modal: bool) -> None:
    """F1, H1: D stays until another is stated, whatever tool came since; LinuxCNC takes the tool in the spindle."""
    head = "T1 M6\nG0 X0. Y0. Z9.\nG41 D1 G1 X5. F100.\nG40 X9.\nT2 M6\nG0 X0. Y0. Z9.\nG41 "
    motion = good(dialect, program(dialect, head + ("" if modal else "D2 ") + "G1 X5. F100.\nG40 X9.\n"))
    on = motion.radius[motion.compensation == 41]
    assert on.tolist() == [1.0, 1.0] if modal else on.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(("dialect", "relief"), [(FANUC, 0.5), (HAAS, 1.27), (TNC, 0.2), (SIEMENS, 0.6)])
def test_relief_of_pecks(dialect: str, relief: float) -> None:
    """Parameters 5114 and 5115 (F2), as assumed; settings 22 and 52 (H1), 0.05 in; T3 cycle 200: 0.2 mm; S3
    CYCLE83: 0.6 mm for depths of up to 30 mm."""
    assert spec(dialect).cycles.peck_relief == relief


def test_inverse_time_in_arcs_is_by_the_radius_on_fanuc_alone() -> None:
    """F4 5.: in circular interpolation F is feed over the radius of the arc; elsewhere over its length."""
    assert {name for name in builtin_files() if spec(name).feed.arc_inverse == "radius"} == {FANUC}


def test_units_of_a_feed_where_the_units_change() -> None:
    """N table 8: F is carried out before G20 and G21 of its block; measured on LinuxCNC 2.9: both leave the feed as it is.
    Elsewhere F counts in the units of the block that moves."""
    body = "F600\nG1 X10\nG20\nG1 X1\nF30\nG1 X2\nG21 F30\nG1 X60\nF900\nG1 X70\n"
    for dialect, units in ((NGC, [1.0, 1.0, 25.4, 25.4, 1.0]), (ISO, [1.0, 25.4, 25.4, 1.0, 1.0])):
        motion = good(dialect, program(dialect, f"G0 X0. Y0. Z9.\n{body}"))
        assert motion.unit[motion.code == 1].tolist() == units


@pytest.mark.parametrize(("dialect", "linear", "feed", "writer"), [
    (TNC, 4, 3, "heidenhain"), (HAAS, 3, 3, "haas"), (FANUC, 4, 4, "fanuc"), (SIEMENS, 4, 4, "siemens")])
def test_last_decimals(dialect: str, linear: int, feed: int, writer: str) -> None:
    """T6 p. 631: positions 5,4, feeds 5,3, speeds 5,3, angles 3,4; H1: 3 in mm; F1: 4 under IS-C; S: MD10200 of 10000."""
    places = spec(dialect).format
    assert (places.linear_decimals, places.feed_decimals, spec(dialect).writer) == (linear, feed, writer)
    assert dialect != TNC or (places.rotary_decimals, places.speed_decimals) == (4, 3)


def test_a_number_without_a_point_is_refused_where_its_unit_is_a_parameter() -> None:
    """F1 2., H1: a number without a point counts in the least increment, by parameter 3401#0 (DPI)."""
    for dialect in (FANUC, HAAS):
        assert faults(dialect, program(dialect, "G0 X1. Y0. Z9.\n")) == {}
        assert len(faults(dialect, program(dialect, "G0 X1 Y0. Z9.\n"))) == 1


def test_only_haas_states_planes_that_turn_nothing() -> None:
    """G254 lets the offset follow the axes as they stand; G53.1, CYCLE800 and PLANE ... TURN drive them to the plane."""
    assert {name for name in builtin_files() if spec(name).plane_turns} == {"fanuc-30i", "siemens-840d", "heidenhain-tnc640"}


def test_the_stock_is_stated_by_its_two_corners() -> None:
    """T1, BLK FORM: 0.1 with the tool axis and the MIN corner, 0.2 with the MAX corner, both absolute."""
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": 100.0}}, "rewind": {
        "stock": {"low": (0.0, 0.0, -40.0), "high": (100.0, 100.0, 0.0)}}})
    path = toolpath("RAPID", "GOTO/50,50,10", "FEDRAT/MMPM,500", "GOTO/50,50,-5")
    text = converted(convert(path, "mill-3axis", TNC, setup)).text
    assert "BLK FORM 0.1 Z X+0 Y+0 Z-40" in text and "BLK FORM 0.2 X+100 Y+100 Z+0" in text
