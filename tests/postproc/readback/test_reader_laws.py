"""Laws of words: the same part by machine coordinates, by the tip and in a tilted plane, hand-written for every dialect.

Tips and axes come from homogeneous matrices of the kit, angles of planes from formulas written here.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from machines.kinematics.base import Kinematics
from machines.kinematics.serial import Serial
from postproc.readback.comparison.checks import block_seconds
from postproc.readback.execution.execute import Motion
from tests.postproc.kit import angle, machine, pose_of
from tests.postproc.reader_kit import (
    FANUC,
    HAAS,
    LENGTHS,
    ORIGIN,
    SIEMENS,
    TNC,
    control,
    executed,
    faults,
    good,
    look,
)
from toolpaths.diagnostics import has_errors

TABLES = [("mikron-ucp710", {"A": -30.0, "C": 40.0}), ("trunnion-bc", {"B": 35.0, "C": -65.0}),
          ("trunnion-bc", {"B": -20.0, "C": 10.0})]
HEADS = [("head-table", {"B": 25.0, "C": -50.0}), ("fork-head-ab", {"A": 12.0, "B": -33.0}),
         ("fork-head-ab", {"A": -20.0, "B": 8.0})]
PLANE_POINTS = np.array([[0.0, 0, 30], [0, 0, 0], [12, -7, 0], [12, -7, -2.5], [12, -7, 30]])
"""in the plane's X', Y', Z' from the work offset's zero"""


def matrix_of(name: str, rotary: dict[str, float]) -> np.ndarray:
    """(3, 3) the tool's frame seen from the table: z by the kit, x and y by turning the chain's rotary axes by hand."""
    at = [rotary.get(a, 0.0) for a in machine(name).axis_names]
    turn = np.eye(3)
    order = {"mikron-ucp710": "CA", "trunnion-bc": "CB", "head-table": "CB", "fork-head-ab": "BA"}[name]
    for letter in order:
        d = {"A": [1, 0, 0], "B": [0, 1, 0], "C": [0, 0, 1]}[letter]
        k = np.cross(d, np.eye(3)).T
        a = math.radians(rotary[letter])
        turn = turn @ (np.eye(3) + math.sin(a) * k + (1 - math.cos(a)) * (k @ k))
    axis = pose_of(name, np.array([at]), 0.0)[1][0]
    assert np.allclose(turn[:, 2], axis, atol=1e-12)
    return turn


def angles(dialect: str, r: np.ndarray) -> list[float]:
    """Degrees by which a dialect names the frame: ZXZ, X Y' Z'', or fixed X Y Z."""
    if dialect == FANUC and abs(r[2, 2]) > 1.0 - 1e-12:
        found = [math.atan2(r[1, 0], r[0, 0]), 0.0, 0.0]
    elif dialect == FANUC:
        found = [math.atan2(r[0, 2], -r[1, 2]), math.acos(r[2, 2]), math.atan2(r[2, 0], r[2, 1])]
    elif dialect == SIEMENS:
        found = [math.atan2(-r[1, 2], r[2, 2]), math.asin(r[0, 2]), math.atan2(-r[0, 1], r[0, 0])]
    else:
        found = [math.atan2(r[2, 1], r[2, 2]), math.asin(-r[2, 0]), math.atan2(r[1, 0], r[0, 0])]
    return [math.degrees(a) for a in found]


def xyz(p: np.ndarray, plus: str = "") -> str:
    return " ".join(f"{a}{v:{plus}.6f}" for a, v in zip("XYZ", p, strict=True))


def rot(rotary: dict[str, float], plus: str = "") -> str:
    return " ".join(f"{a}{v:{plus}.6f}" for a, v in rotary.items())


def in_plane(dialect: str, name: str, rotary: dict[str, float], points: np.ndarray = PLANE_POINTS,
             off: float = 0.0) -> str:
    """A tilted plane at a rotary position, entered, cut in and left; `off` degrees spoil its first angle."""
    named = angles(dialect, matrix_of(name, rotary))
    named[0] += off
    first, *rest = points
    if dialect == TNC:
        body = [f"L {rot(rotary, '+')} R0 FMAX", "PLANE SPATIAL " + " ".join(
            f"SP{a}{v:+.6f}" for a, v in zip("ABC", named, strict=True)) + " TURN FMAX TABLE ROT",
            f"L {xyz(first, '+')} FMAX", *(f"L {xyz(p, '+')} F500" for p in rest), "PLANE RESET STAY"]
        return framed(dialect, body)
    tail = [f"G1 {xyz(p)} F500." for p in rest]
    if dialect == FANUC:
        euler = " ".join(f"{a}{v:.6f}" for a, v in zip("IJK", named, strict=True))
        body = [f"G0 {rot(rotary)}", f"G68.2 X0. Y0. Z0. {euler}", "G53.1", f"G43 H1 {xyz(first)}", *tail, "G49", "G69"]
    elif dialect == HAAS:
        body = [f"G0 {rot(rotary)}", "G254", f"G43 H1 {xyz(first)}", *tail, "G49", "G255"]
    else:
        lead = next(iter(rotary.values())) if name != "head-table" else rotary["B"]
        lead = rotary["B"] if name == "fork-head-ab" else lead
        body = [f"G0 {rot(rotary)}", "D1", "CYCLE800(0,\"\",0,57,0,0,0," + ",".join(f"{v:.6f}" for v in named)
                + f",0,0,0,{1 if lead >= 0 else -1},0,1)", f"G0 {xyz(first)}", *tail, "CYCLE800()"]
    return framed(dialect, body)


def by_tip(dialect: str, tips: np.ndarray, rotary: list[dict[str, float]]) -> str:
    """The tip in the work offset, with rotary words."""
    on = {FANUC: ["G43.4 H1"], HAAS: ["G234 H1"], SIEMENS: ["D1", "TRAORI", "ORIMKS ORIAXES"],
          TNC: ["FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS"]}[dialect]
    leave = {FANUC: "G49", HAAS: "G49", SIEMENS: "TRAFOOF", TNC: "FUNCTION RESET TCPM"}[dialect]
    if dialect == TNC:
        lines = [f"L {xyz(p, '+')} {rot(r, '+')} " + ("F500" if k else "FMAX") for k, (p, r) in
                 enumerate(zip(tips, rotary, strict=True))]
    else:
        lines = [f"{'G1' if k else 'G0'} {xyz(p)} {rot(r)}" + (" F500." if k else "") for k, (p, r) in
                 enumerate(zip(tips, rotary, strict=True))]
    return framed(dialect, [*on, *lines, leave])


def by_axes(dialect: str, name: str, positions: np.ndarray, work: np.ndarray) -> str:
    """Axis positions with the length on Z."""
    names = machine(name).axis_names
    word = positions - work
    word[:, names.index("Z")] -= LENGTHS[1]
    sign = "+" if dialect == TNC else ""
    rows = [" ".join(f"{a}{v:{sign}.9f}" for a, v in zip(names, w, strict=True)) for w in word]
    if dialect == TNC:
        return framed(dialect, [f"L {row} " + ("F500" if k else "FMAX") for k, row in enumerate(rows)])
    register = "D1 " if dialect == SIEMENS else "G43 H1 "
    return framed(dialect, [f"G0 {register}{rows[0]}", *(f"G1 {row} F500." for row in rows[1:])])


def framed(dialect: str, body: list[str]) -> str:
    if dialect == TNC:
        rows = ["BEGIN PGM T MM", "TOOL CALL 1 Z S900", *body, "M30", "END PGM T MM"]
        return "\n".join(f"{k} {row}" for k, row in enumerate(rows)) + "\n"
    head = {SIEMENS: ["G17 G710 G90 G94 G40", "G54", "T1", "M6", "D0"]}.get(dialect, [
        "%", "O0001", "G17 G21 G40 G49 G80 G90 G94", "G54", "T1 M6"])
    return "\n".join([*head, *body, "M30"]) + ("\n%\n" if dialect != SIEMENS else "\n")


def tips_of(motion: Motion, name: str) -> tuple[np.ndarray, np.ndarray]:
    """(tip from the work offset's zero, axis) of each end, by the kit's matrices."""
    tip, axis = pose_of(name, motion.end, LENGTHS[1])
    return tip - np.array(ORIGIN), axis


@pytest.mark.parametrize("dialect", [FANUC, SIEMENS, TNC])
@pytest.mark.parametrize(("name", "rotary"), [*TABLES, *HEADS])
def test_points_of_a_plane_are_where_its_frame_has_them(dialect: str, name: str,
                                                        rotary: dict[str, float]) -> None:
    motion = good(dialect, in_plane(dialect, name, rotary), name)
    tip, axis = tips_of(motion, name)
    r = matrix_of(name, rotary)
    n = len(PLANE_POINTS)
    assert np.abs(tip[-n:] - PLANE_POINTS @ r.T).max() < 1e-5
    assert angle(axis[-n:], np.tile(r[:, 2], (n, 1))).max() < 1e-9
    assert [motion.frames[k].law for k in motion.frame[-n:]] == ["tilted"] * n


@pytest.mark.parametrize("dialect", [FANUC, SIEMENS])
def test_zero_of_a_plane_next_to_that_of_the_work_offset(dialect: str) -> None:
    """G68.2 X Y Z, _X0 _Y0 _Z0 count in the work offset, _X1 _Y1 _Z1 in the plane."""
    name, rotary = "mikron-ucp710", {"A": -30.0, "C": 40.0}
    r, text = matrix_of(name, rotary), in_plane(dialect, name, rotary)
    if dialect == FANUC:
        text, zero = text.replace("X0. Y0. Z0.", "X3. Y4. Z-5."), np.array([3.0, 4, -5])
    else:
        text = text.replace(",57,0,0,0,", ",57,3,4,-5,").replace(",0,0,0,-1,", ",1,2,7,-1,")
        zero = np.array([3.0, 4, -5]) + r @ [1, 2, 7]
    tip, _ = tips_of(good(dialect, text, name), name)
    assert np.abs(tip[-len(PLANE_POINTS):] - zero - PLANE_POINTS @ r.T).max() < 1e-5


@pytest.mark.parametrize(("name", "rotary"), TABLES)
def test_dynamic_work_offset_follows_the_tables(name: str, rotary: dict[str, float]) -> None:
    tip, _ = tips_of(good(HAAS, in_plane(HAAS, name, rotary), name), name)
    assert np.abs(tip[-len(PLANE_POINTS):] - PLANE_POINTS @ matrix_of(name, rotary).T).max() < 1e-5


TIPS = np.array([[0.0, 0, 30], [5, 3, 1], [-20, 14, -3], [40, 4, 0]])


@pytest.mark.parametrize("dialect", [FANUC, HAAS, SIEMENS, TNC])
@pytest.mark.parametrize(("name", "rotary"), [*TABLES, *HEADS])
def test_tip_words_are_the_tip_whatever_the_rotary_axes_do(dialect: str, name: str,
                                                           rotary: dict[str, float]) -> None:
    turning = [{a: v * (1.0 - 0.2 * k) for a, v in rotary.items()} for k in range(len(TIPS))]
    motion = good(dialect, by_tip(dialect, TIPS, turning), name)
    tip, _ = tips_of(motion, name)
    assert np.abs(tip - TIPS).max() < 1e-5
    letters = machine(name).axis_names
    stated = np.array([[t[a] for a in rotary] for t in turning])
    assert np.abs(motion.end[:, [letters.index(a) for a in rotary]] - stated).max() < 1e-9


@pytest.mark.covering
@pytest.mark.parametrize("dialect", [FANUC, HAAS, SIEMENS, TNC])
@pytest.mark.parametrize(("name", "rotary"), TABLES)
def test_three_laws_agree_between_the_ends_too(dialect: str, name: str, rotary: dict[str, float]) -> None:
    """At standing rotary axes the path between two points is the same by every law."""
    held = control(name)
    plane = good(dialect, in_plane(dialect, name, rotary), name)
    n = len(PLANE_POINTS)
    tips = PLANE_POINTS @ matrix_of(name, rotary).T
    by_tips = good(dialect, by_tip(dialect, tips, [rotary] * n), name)
    axes = good(dialect, by_axes(dialect, name, plane.end[-n:].copy(), held.work_offset), name)
    for t in (0.3, 0.7, 1.0):
        travels = [look(m, held).poses(m, np.arange(len(m) - n + 1, len(m)), t) for m in (plane, by_tips, axes)]
        for tip, axis in travels[1:]:
            assert np.abs(tip - travels[0][0]).max() < 2e-5 and angle(axis, travels[0][1]).max() < 1e-7


@pytest.mark.parametrize("dialect", [FANUC, HAAS, SIEMENS, TNC])
def test_between_two_turned_poses_the_tip_runs_straight_by_tip_and_not_by_axes(dialect: str) -> None:
    name, held = "mikron-ucp710", control("mikron-ucp710")
    turned = [{"A": -10.0, "C": 0.0}, {"A": -50.0, "C": 80.0}]
    tips = np.array([[80.0, 0, 0], [80, 60, 0]])
    motion = good(dialect, by_tip(dialect, tips, turned), name)
    tip, _ = look(motion, held).poses(motion, np.array([1]), 0.5)
    assert np.abs(tip[0] - np.array(ORIGIN) - [80, 30, 0]).max() < 1e-5
    rotary = look(motion, held).joints(motion, np.array([1]), 0.5)[0, 3:]
    assert np.degrees(rotary).round(6).tolist() == [-30, 40], "rotary words run linearly"
    axes = good(dialect, by_axes(dialect, name, motion.end.copy(), held.work_offset), name)
    tip, _ = look(axes, held).poses(axes, np.array([1]), 0.5)
    assert np.abs(tip[0] - np.array(ORIGIN) - [80, 30, 0]).max() > 5.0


@pytest.mark.parametrize("dialect", [FANUC, SIEMENS, TNC])
@pytest.mark.parametrize(("name", "rotary"), TABLES)
def test_a_plane_next_to_the_rotary_position_is_an_error(dialect: str, name: str,
                                                         rotary: dict[str, float]) -> None:
    assert set(faults(dialect, in_plane(dialect, name, rotary, off=0.2), name)) == {"gcode.plane_pose"}
    assert faults(dialect, in_plane(dialect, name, rotary, off=1e-3), name) == {}


@pytest.mark.parametrize("dialect", [FANUC, SIEMENS, TNC])
def test_a_plane_with_the_tool_along_z_still_says_how_its_table_stands(dialect: str) -> None:
    """With the tool along C the plane says C: a plane that is not turned as the table is another one."""
    assert faults(dialect, in_plane(dialect, "mikron-ucp710", {"A": 0.0, "C": 40.0}), "mikron-ucp710") == {}
    spoilt = in_plane(dialect, "mikron-ucp710", {"A": 0.0, "C": 40.0}).replace(" C40", " C41").replace(" C+40", " C+41")
    assert set(faults(dialect, spoilt, "mikron-ucp710")) == {"gcode.plane_pose"}


@pytest.mark.parametrize(("dialect", "block"), [(FANUC, "G0 C5."), (HAAS, "G0 C5."), (SIEMENS, "G0 C5"),
    (TNC, "L C+5 FMAX")])
def test_a_rotary_axis_that_moves_in_a_plane_is_an_error(dialect: str, block: str) -> None:
    text = in_plane(dialect, "mikron-ucp710", {"A": -30.0, "C": 40.0}).splitlines()
    leave = next(k for k, row in enumerate(text) if "CYCLE800()" in row or "PLANE RESET" in row or row == "G49")
    text.insert(leave, f"99 {block}" if dialect == TNC else block)
    assert "gcode.rotary_in_plane" in faults(dialect, "\n".join(text) + "\n", "mikron-ucp710")


def test_the_other_solution_of_a_swivelled_table() -> None:
    """B 35 C -65 and B -35 C 115 hold the same axis: _DIR and SEQ pick by the sign of B, the nearest is where it stands."""
    name = "trunnion-bc"
    for rotary in ({"B": 35.0, "C": -65.0}, {"B": -35.0, "C": 115.0}):
        text = in_plane(SIEMENS, name, rotary)
        assert faults(SIEMENS, text, name) == {}
        wrong = text.replace(",1,0,1)", ",#,0,1)").replace(",-1,0,1)", ",1,0,1)").replace(",#,0,1)", ",-1,0,1)")
        assert set(faults(SIEMENS, wrong, name)) == {"gcode.plane_pose"}
        tnc = in_plane(TNC, name, rotary)
        sign = "+" if rotary["B"] > 0 else "-"
        other = "-" if sign == "+" else "+"
        assert faults(TNC, tnc.replace("TURN FMAX", f"TURN FMAX SEQ{sign}"), name) == {}
        assert set(faults(TNC, tnc.replace("TURN FMAX", f"TURN FMAX SYM{other}"), name)) == {"gcode.plane_pose"}


def test_arcs_and_cycles_run_in_the_plane() -> None:
    """G18 in the plane turns about its Y'; a hole goes along its Z'."""
    name, rotary = "mikron-ucp710", {"A": -30.0, "C": 40.0}
    text = in_plane(FANUC, name, rotary, PLANE_POINTS[:2]).replace(
        "G49\nG69", "G18 G3 X0. Z10. I0. K5. F300.\nG17 G98 G81 X3. Y4. Z-6. R2. F100.\nG80\nG49\nG69")
    motion = good(FANUC, text, name)
    r = matrix_of(name, rotary)
    held = control(name)
    middle, _ = look(motion, held).poses(motion, np.array([3]), 0.5)
    assert np.abs((middle[0] - np.array(ORIGIN)) @ r - [-5, 0, 5]).max() < 1e-5, "half path round from -Z': Z towards X"
    tip, _ = tips_of(motion, name)
    assert (tip[4:] @ r).round(4).tolist() == [[3, 4, 10], [3, 4, 2], [3, 4, -6], [3, 4, 10]]
    assert motion.hole.tolist() == [False] * 4 + [True] * 4


def test_pivots_of_the_control_that_are_not_the_machines_show() -> None:
    """A control that takes the C axis 0.2 mm aside misses the tip, by tip and in the plane; by axes nothing changes."""
    name, rotary = "trunnion-bc", {"B": 35.0, "C": -65.0}
    own = shifted(machine(name).kinematics)
    for text, least in ((by_tip(FANUC, TIPS, [rotary] * 4), 0.05), (in_plane(FANUC, name, rotary), 0.05)):
        right, wrong = (executed(FANUC, text, name, of=control(name, own=k))[0] for k in (None, own))
        assert right is not None and wrong is not None
        apart = np.linalg.norm(tips_of(right, name)[0] - tips_of(wrong, name)[0], axis=1)
        assert least < apart.max() < 0.5
    ends = good(FANUC, by_tip(FANUC, TIPS, [rotary] * 4), name).end.copy()
    axes = by_axes(FANUC, name, ends, control(name).work_offset)
    same = [executed(FANUC, axes, name, of=control(name, own=k))[0] for k in (None, own)]
    assert np.array_equal(same[0].end, same[1].end)


def shifted(kin: Kinematics) -> Kinematics:
    """The kinematics with a rotary axis 0.2 mm aside."""
    assert isinstance(kin, Serial)
    links = [replace(k, point=k.point + np.array([0.2, 0.0, 0.0])) if k.name == "B" else k for k in kin.chain]
    return replace(kin, chain=tuple(links))


def test_dog_legs_bend_in_joints_but_not_under_the_tip_law() -> None:
    """Each axis runs at its own speed until it is there; half the time of the longest is half its path only."""
    name = "mikron-ucp710"
    held = control(name, rapids="dog-leg")
    speed = held.machine.limits.velocity
    text = framed(FANUC, ["G0 G43 H1 X0. Y0. Z100. A0. C0.", "X60. Y10. Z100."])
    motion, found = executed(FANUC, text, name, of=held)
    assert motion is not None and not has_errors(found)
    where = look(motion, held).joints(motion, np.array([1]), 0.5)[0, :2] - held.work_offset[:2]
    y = min(10.0, 10.0 * 0.5 * (60.0 / speed[0]) / (10.0 / speed[1]))
    assert where.round(9).tolist() == [30, y]
    times = look(motion, held).times(motion, np.array([1]))
    corner = (10.0 / speed[1]) / (60.0 / speed[0])
    assert any(np.isclose(np.asarray(t).ravel()[0], corner) for t in times), "its corner is looked at"
    straight = look(motion, control(name)).joints(motion, np.array([1]), 0.5)[0, :2] - held.work_offset[:2]
    assert straight.round(9).tolist() == [30, 5]
    text = by_tip(FANUC, np.array([[0.0, 0, 100], [60, 10, 100]]), [{"A": 0.0, "C": 0.0}] * 2).replace("G1 ", "G0 ")
    motion, _ = executed(FANUC, text, name, of=held)
    assert motion is not None and motion.code.tolist() == [0, 0]
    tip, _ = look(motion, held).poses(motion, np.array([1]), 0.5)
    assert np.abs(tip[0] - np.array(ORIGIN) - [30, 5, 100]).max() < 1e-5


def seconds(dialect: str, text: str, name: str, by_radius: bool = False) -> list[float]:
    held = replace(control(name), feed_rule="all")
    motion, found = executed(dialect, text, name, of=held)
    assert motion is not None and not has_errors(found), [str(d) for d in found]
    return block_seconds(motion, held, by_radius).round(6).tolist()


def test_feed_per_minute_is_that_of_the_tip_under_the_tip_law_and_in_a_plane() -> None:
    """30 mm and 40 degrees at 600: 3 s by the tip, 5 s where all axes count as one length; turning alone, degrees."""
    turned = [{"A": 0.0, "C": 0.0}, {"A": 0.0, "C": 40.0}, {"A": 0.0, "C": 50.0}]
    tips = np.array([[0.0, 0, 10], [30, 0, 10], [30, 0, 10]])
    assert seconds(FANUC, by_tip(FANUC, tips, turned).replace("F500", "F600"), "mikron-ucp710")[1:] == [3.0, 1.0]
    text = framed(FANUC, ["G0 G43 H1 X0. Y0. Z10. A0. C0.", "G1 X30. C40. F600"])
    assert seconds(FANUC, text, "mikron-ucp710")[1:] == [5.0]
    plane = in_plane(FANUC, "mikron-ucp710", {"A": -30.0, "C": 40.0}, np.array([[0.0, 0, 30], [30, 40, 30]]))
    assert seconds(FANUC, plane, "mikron-ucp710")[-1:] == [6.0]


def test_inverse_time_of_arcs_by_length_and_by_radius() -> None:
    """Half a turn at F2: half a minute for the block, or pi / 2 minutes where F is the speed over the radius."""
    text = framed(FANUC, ["G0 X0. Y0. Z0.", "G93 G3 X10. I5. J0. F2.", "G1 X20. F2."])
    assert seconds(FANUC, text, "mikron-ucp710")[1:] == [30.0, 30.0]
    assert seconds(FANUC, text, "mikron-ucp710", by_radius=True)[1:] == [round(30.0 * math.pi, 6), 30.0]
