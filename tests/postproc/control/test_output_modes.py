"""Axis positions, tool-centre-point mode and tilted planes: the same part by each of them, entered and left safely."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import toolpaths
from postproc.control.planes import angles_of, rotation_of, stated
from postproc.report import summary
from postproc.setup.model import SetupFile, load_setup
from tests.postproc.kit import SAMPLES, angle, codes, convert, goto, tilted, tool_setup, toolpath
from tests.postproc.modes_kit import TCP, TILTED, first_mode, made, run, shop

__all__ = ["first_mode"]

GOLDEN = Path(__file__).parents[2] / "golden"
FOUR = ["mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab"]
FIRST, THEN = tilted(25.0, 40.0), tilted(31.0, 65.0)


def rows(tips: list[list[float]], axis: np.ndarray) -> list[str]:
    return goto(np.array(tips, dtype=float), np.tile(axis, (len(tips), 1)))


def indexed() -> list[str]:
    """Two poses, each with cuts to and fro square to the tool, and a pose with the tool upright."""
    lines = []
    for axis in (FIRST, THEN, np.array([0, 0, 1.0])):
        side = np.cross(axis, [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        at = 20 * axis
        lines += ["RAPID", *rows([at + 30 * axis], axis), "FEDRAT/MMPM,600",
                  *rows([at, at + 10 * side, at + 10 * side + 5 * np.cross(axis, side)], axis), "RAPID",
                  *rows([at + 30 * axis], axis)]
    return lines


def turning() -> list[str]:
    """A cut that turns the tool all along."""
    t = np.linspace(0.0, 1.0, 9)
    axes = np.array([tilted(10 + 20 * u, 30 + 80 * u) for u in t])
    tips = np.stack([30 * t, 10 * np.sin(3 * t), 5 * t], axis=1)
    first = goto(tips[:1] + 20 * axes[:1], axes[:1])
    return ["RAPID", *first, "FEDRAT/MMPM,500", *goto(tips, axes), "RAPID", *goto(tips[-1:] + 20 * axes[-1:], axes[-1:])]


def follows(result: object, within: float = 0.0101, axis_within: float = 9e-4) -> None:
    """Every CL point is met in order, and nothing that cuts is off the lines between them."""
    path = result.toolpath
    blocks = [b for b in run(result) if b.code > 0]
    tips, axes = np.concatenate([b.tip for b in blocks]), np.concatenate([b.axis for b in blocks])
    cut = np.flatnonzero((path.kind == 1) & (path.role == 0))
    at = 0
    for row in cut.tolist():
        near = (np.linalg.norm(tips[at:] - path.tip[row], axis=1) < 2e-3) & (angle(axes[at:], path.axis[row][None]) < 5e-5)
        assert near.any(), f"CL line {path.line[row]} is not met"
        at += int(np.flatnonzero(near)[0])
    joined = cut[cut > 0]
    p, d = path.tip[joined - 1], path.tip[joined] - path.tip[joined - 1]
    u = np.clip(np.einsum("kmi,mi->km", tips[:, None] - p, d) / np.maximum((d**2).sum(axis=1), 1e-12), 0.0, 1.0)
    gap = np.linalg.norm(tips[:, None] - p - u[..., None] * d, axis=2)
    assert gap.min(axis=1).max() < within
    e0, e1 = path.axis[joined - 1], path.axis[joined]
    mixed = e0 + u[..., None] * (e1 - e0)
    mixed /= np.linalg.norm(mixed, axis=2, keepdims=True)
    off = np.where(gap < within, angle(mixed, axes[:, None]), np.inf)
    assert off.min(axis=1).max() < axis_within + 5e-4


@pytest.mark.covering
@pytest.mark.parametrize("output", ["axes", "tcp", "tilted", "auto"])
@pytest.mark.parametrize("name", FOUR)
def test_indexed_work_is_the_same_by_every_mode(name: str, output: str, tmp_path: Path) -> None:
    result = made(tmp_path, indexed(), name, output)
    follows(result)
    laws = {b.law for b in run(result) if b.code > 0}
    assert laws == {"tilted" if output == "auto" else output}


@pytest.mark.covering
@pytest.mark.parametrize("output", ["axes", "tcp", "auto"])
@pytest.mark.parametrize("name", FOUR)
def test_turning_work_is_the_same_by_every_mode(name: str, output: str, tmp_path: Path) -> None:
    result = made(tmp_path, turning(), name, output)
    follows(result)
    assert {b.law for b in run(result) if b.code > 0} == {"tcp" if output == "auto" else output}


@pytest.mark.covering
@pytest.mark.parametrize("convention", ["ZXZ", "ZYX", "XYZ", "rotary"])
@pytest.mark.parametrize("name", ["mikron-ucp710", "trunnion-bc"])
def test_every_convention_of_angles_gives_the_same_part(name: str, convention: str, tmp_path: Path) -> None:
    mode = TILTED.replace("ZXZ", convention)
    if convention == "rotary":
        mode = '[modes.tilted]\nenter = ["G254"]\nleave = ["G255"]\nangles = "rotary"\n'
    result = made(tmp_path, indexed(), name, "tilted", mode)
    follows(result)
    assert {b.law for b in run(result) if b.code > 0} == {"tilted"}


def test_coarse_angles_move_the_axis_and_not_the_tip(tmp_path: Path) -> None:
    """Angles of one decimal: the plane is what is printed, so that the tip stays where it should be."""
    result = made(tmp_path, indexed(), "fork-head-ab", "tilted", TILTED + "decimals = 1\n")
    follows(result)
    for section in result.program.sections:
        assert all(abs(10 * a - round(10 * a)) < 1e-9 for a in section.angles)


@pytest.mark.parametrize(("file", "name", "laws"), [
    ("five_faces.cls", "mikron-ucp710", {"tilted"}), ("five_tilted.cls", "head-table", {"tilted"}),
    ("indexed_4axis.cls", "mill-4axis", {"tilted", "tcp"})])
def test_samples_by_the_rule(file: str, name: str, laws: set[str], tmp_path: Path) -> None:
    """Standing tools in planes, turning ones by their tip."""
    path, _ = toolpaths.read(SAMPLES / file)
    result = convert(path, name, shop(tmp_path))
    assert {b.law for b in run(result) if b.code > 0} == laws


def test_the_golden_five_axis_piece_by_tip(tmp_path: Path) -> None:
    path, _ = toolpaths.read(GOLDEN / "short_five_axis.apt")
    result = convert(path, "head-table", shop(tmp_path))
    follows(result, axis_within=9e-4)
    assert {b.law for b in run(result) if b.code > 0} == {"tcp"}


# ---- sections ----------------------------------------------------------------------------------------------


def names(result: object, k: int) -> list[str]:
    return [c.name for c in result.program.commands.get(k, ())]


def test_every_pose_is_stated_the_upright_one_too(tmp_path: Path) -> None:
    program = made(tmp_path, indexed(), "mikron-ucp710").program
    laws = [s.law for s in program.sections]
    assert laws == ["axes", "tilted", "axes", "tilted", "axes", "tilted", "axes"]
    assert program.sections[5].angles[1] == 0.0 and np.allclose(program.sections[5].plane.rotation[:, 2], [0, 0, 1])


def test_sections_begin_where_the_commands_enter_them(tmp_path: Path) -> None:
    program = made(tmp_path, indexed(), "trunnion-bc").program
    for i, section in enumerate(program.sections):
        entered = [k for k, group in program.commands.items() for c in group
                   if c.name == "ENTER_SECTION" and c.args == (float(i),)]
        assert entered == ([section.first] if section.law != "axes" else [])


def test_two_turning_runs_stay_in_the_mode(tmp_path: Path) -> None:
    """Between them the tool is retracted and indexed in the mode itself."""
    program = made(tmp_path, [*turning(), *turning()], "mikron-ucp710").program
    assert [s.law for s in program.sections] == ["axes", "tcp", "axes"]


def test_a_tool_change_leaves_the_mode(tmp_path: Path) -> None:
    result = made(tmp_path, [*turning(), "LOADTL/2", "SPINDL/RPM,900,CLW", *turning()], "mikron-ucp710")
    assert [s.law for s in result.program.sections] == ["axes", "tcp", "axes", "tcp", "axes"]
    follows(result)


def test_compensation_ends_inside_its_plane(tmp_path: Path) -> None:
    """The retract is left out where the tool is above the safe plane already: G40 still stands before the mode ends."""
    axis = FIRST
    side = np.cross(axis, [0.0, 1.0, 0.0]) / np.linalg.norm(np.cross(axis, [0.0, 1.0, 0.0]))
    lines = ["RAPID", *rows([30 * axis], axis), "CUTCOM/LEFT,1", *rows([0 * axis, 10 * side], axis), "RAPID",
              *rows([125 * axis], axis), *indexed()[8:]]
    result = made(tmp_path, lines, "mikron-ucp710")
    assert "cutcom.tilted" not in codes(result.diagnostics)
    assert any(b.compensation == "LEFT" and b.law == "tilted" and b.code > 0 for b in run(result))
    lost = made(tmp_path, lines, "mikron-ucp710", "axes")
    assert "cutcom.tilted" in codes(lost.diagnostics)


# ---- asked for ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "output", "more", "word"), [
    ("mikron-ucp710", "tcp", TILTED, "[modes.tcp]"), ("mikron-ucp710", "tilted", TCP, "[modes.tilted]"),
    ("mill-3axis", "tilted", TCP + TILTED, "mill-3axis"), ("linuxcnc-lineardelta", "tcp", TCP, "linuxcnc-lineardelta"),
    ("head-table", "tilted", TILTED + "tables_only = true\n", "rotary head")])
def test_what_cannot_be_had_is_refused(name: str, output: str, more: str, word: str, tmp_path: Path) -> None:
    result = made(tmp_path, ["RAPID", "GOTO/0,0,50", "GOTO/0,0,5"], name, output, more)
    found = [d for d in result.diagnostics if d.code == "output.mode"]
    assert len(found) == 1 and not result.text
    assert word in found[0].message and "have: axes" in found[0].hint


def test_the_controls_own_kinematics_cannot_be_left() -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5")
    assert convert(path, "linuxcnc-xyzac-trt", output="tcp").ok
    assert "output.mode" in codes(convert(path, "linuxcnc-xyzac-trt", output="axes").diagnostics)


def test_a_plane_cannot_turn(tmp_path: Path) -> None:
    result = made(tmp_path, turning(), "mikron-ucp710", "tilted")
    assert "output.turning" in codes(result.diagnostics) and result.program is None


def test_a_controller_without_modes_writes_axis_positions() -> None:
    result = convert(toolpath(*indexed()), "mikron-ucp710", "generic-iso")
    assert result.ok and [s.law for s in result.program.sections] == ["axes"]


# ---- angles ------------------------------------------------------------------------------------------------


def test_angles_of_known_frames() -> None:
    """C 30 then A 40 on a table: the frame is Rz(30) Rx(40), Euler angles 30, 40, 0; fixed angles by hand."""
    c, s = np.cos(np.radians([30, 40])), np.sin(np.radians([30, 40]))
    frame = np.array([[c[0], -s[0], 0], [s[0], c[0], 0], [0, 0, 1.0]]) @ np.array(
        [[1.0, 0, 0], [0, c[1], -s[1]], [0, s[1], c[1]]])
    assert np.allclose(angles_of("ZXZ", frame), (30, 40, 0), atol=1e-12)
    assert np.allclose(angles_of("ZYX", frame), (30, 0, 40), atol=1e-12)
    assert stated("rotary", frame, (1.0, 2.0), 3)[0] == (1.0, 2.0)


@pytest.mark.parametrize("convention", ["ZXZ", "ZYX", "XYZ"])
def test_angles_name_the_rotation_again(convention: str) -> None:
    rng = np.random.default_rng(5)
    for k in range(300):
        angles = tuple(rng.uniform(-180, 180, 3))
        if k % 3 == 0:
            angles = (angles[0], float(rng.choice([0.0, 90.0, -90.0, 180.0])), angles[2])
        frame = rotation_of(convention, angles)
        assert np.abs(frame @ frame.T - np.eye(3)).max() < 1e-12 and np.linalg.det(frame) > 0
        assert np.abs(rotation_of(convention, angles_of(convention, frame)) - frame).max() < 1e-9


# ---- operations --------------------------------------------------------------------------------------------


def operations(*pieces: list[str]) -> toolpaths.toolpath.Toolpath:
    """NX operations A, B, ... of CL lines, one tool, spindle and coolant stated in the first only."""
    lines = []
    for name, piece in zip("ABCD", pieces, strict=False):
        lines += [f"TOOL PATH/{name},TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0"]
        lines += ["LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "COOLNT/FLOOD", "FEDRAT/MMPM,600"] if name == "A" else []
        lines += [*piece, "END-OF-PATH"]
    return toolpath(*lines, head=[])


def test_an_operation_by_the_mode_that_is_asked_for_it(tmp_path: Path) -> None:
    """B cuts on where A ended, in another mode: between them the tool goes by the safe planes."""
    path = operations(indexed()[-8:], indexed()[-8:], turning())
    own = setup_of(tmp_path, '[output.operations]\nB = "axes"\n')
    result = convert(path, "mikron-ucp710", shop(tmp_path), own)
    laws = {path.operations[int(path.operation[result.program.row[b.k]])].name: b.law for b in run(result) if b.code > 0}
    assert laws == {"A": "tilted", "B": "axes", "C": "tcp"}
    follows(result)


def setup_of(folder: Path, text: str) -> SetupFile:
    file = folder / "own.toml"
    file.write_text(text + "".join(f"[tools.{k}]\ngauge_length = {v.gauge_length}\n" for k, v in tool_setup().tools.items()))
    setup, found = load_setup(file)
    assert setup is not None and not found, found
    return setup


@pytest.mark.parametrize("law", ["tilted", "axes"])
def test_rotary_axes_are_stated_where_they_stand_already(law: str, tmp_path: Path) -> None:
    """B begins at the pose that A ended in: nothing turns on the path, A's mode is left and the tip mode entered."""
    piece = turning()
    start = tilted(10, 30)
    flat = ["RAPID", *rows([20 * start], start), "FEDRAT/MMPM,600", *rows([0 * start, [3, 0, 0]], start), "RAPID",
            *rows([20 * start], start)]
    path = operations(flat, piece)
    own = setup_of(tmp_path, f'[output.operations]\nA = "{law}"\n')
    result = convert(path, "mikron-ucp710", shop(tmp_path), own)
    first = ["axes", "tilted", "axes"] if law == "tilted" else ["axes"]
    assert [s.law for s in result.program.sections] == [*first, "tcp", "axes"]
    follows(result)


def test_the_command_line_goes_before_the_set_ups_default(tmp_path: Path) -> None:
    own = setup_of(tmp_path, '[output]\ndefault = "axes"\n')
    for output, law in (("auto", "axes"), ("tilted", "tilted")):
        result = convert(toolpath(*indexed()), "mikron-ucp710", shop(tmp_path), own, output=output)
        assert {b.law for b in run(result) if b.code > 0} == {law}


def test_an_operation_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    own = setup_of(tmp_path, '[output.operations]\nX = "axes"\n')
    found = [d for d in convert(operations(indexed()), "mikron-ucp710", shop(tmp_path), own).diagnostics
             if d.code == "setup.operation"]
    assert len(found) == 1 and "it has: A" in found[0].hint


def test_every_operation_can_be_started_at(tmp_path: Path) -> None:
    """It begins with the travel home; tool, length, speed and coolant behind that; the axes all stated."""
    path = operations(indexed()[-8:], indexed()[-8:])
    result = convert(path, "mikron-ucp710", shop(tmp_path), setup_of(tmp_path, "[output]\nrestart = true\n"))
    p = result.program
    starts = {c.args[0]: k for k, group in p.commands.items() for c in group if c.name == "OPERATION_START"}
    assert list(starts) == ["A", "B"]
    assert names(result, starts["B"])[-1] == "OPERATION_START"
    assert [n for n in names(result, starts["B"] + 1) if n != "SELECT_TOOL"] == [
        "STOP_SPINDLE_TURNING", "COOLANT_OFF", "CHANGE_TOOL", "USE_TOOL_LENGTH_OFFSET",
        "START_SPINDLE_CLOCKWISE", "FLOOD_ON"]
    assert p.home[starts["B"]] and not p.home[starts["B"] + 1]
    entered = next(s.first for s in p.sections if s.first > starts["B"] and s.law == "tilted")
    assert p.write[starts["B"]:entered].any(axis=0).all()
    follows(result)


def test_operations_that_go_on_are_no_places_to_start() -> None:
    path = operations(indexed()[-8:], indexed()[-8:])
    p = convert(path, "mikron-ucp710", "generic-iso").program
    assert [c.args[0] for group in p.commands.values() for c in group if c.name == "OPERATION_START"] == ["A"]


def test_the_next_tool_is_made_ready(tmp_path: Path) -> None:
    lines = [*indexed()[-8:], "LOADTL/2", "SPINDL/RPM,900,CLW", *indexed()[-8:], "LOADTL/1", *indexed()[-8:]]
    result = made(tmp_path, lines, "mikron-ucp710", more="[tools]\npreload = true\n")
    said = [(c.name, c.args[0]) for k in sorted(result.program.commands) for c in result.program.commands[k]
            if c.name in ("CHANGE_TOOL", "SELECT_TOOL")]
    assert said == [("CHANGE_TOOL", 1.0), ("SELECT_TOOL", 2.0), ("CHANGE_TOOL", 2.0), ("SELECT_TOOL", 1.0),
                    ("CHANGE_TOOL", 1.0)]
    own = made(tmp_path, ["SELECT/TOOL,3", *lines], "mikron-ucp710", more="[tools]\npreload = true\n")
    said = [c.args[0] for group in own.program.commands.values() for c in group if c.name == "SELECT_TOOL"]
    assert said == [3.0]


def test_a_controller_without_subprograms_refuses_them(tmp_path: Path) -> None:
    own = setup_of(tmp_path, "[output]\nsubprograms = true\n")
    found = convert(toolpath(*indexed()), "mikron-ucp710", shop(tmp_path), own).diagnostics
    assert "output.subprograms" in codes(found)


# ---- block skip --------------------------------------------------------------------------------------------


def skipping(*inside: str) -> list[str]:
    return ["RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "FEDRAT/MMPM,300", "GOTO/10,0,5", "OPSKIP/ON", *inside, "OPSKIP/OFF",
            "GOTO/20,10,5", "GOTO/20,20,5", "RAPID", "GOTO/20,20,50"]


def test_skipped_blocks_and_what_follows_them() -> None:
    result = convert(toolpath(*skipping("STOP", "GOTO/10,5,5", "GOTO/10,10,5", "COOLNT/OFF")), "mill-3axis",
                     "generic-iso")
    p = result.program
    rows = np.flatnonzero(p.skip)
    assert p.words[rows].tolist() == [[10, 5, 5], [10, 10, 5]] or len(rows) == 2
    behind = int(rows[-1]) + 1
    assert p.write[behind].all() and names(result, behind)[0] == "RESTATE"
    flags = {c.name: c.skip for group in p.commands.values() for c in group}
    starts = [c.skip for group in p.commands.values() for c in group if c.name == "START_SPINDLE_CLOCKWISE"]
    assert flags["PROGRAM_STOP"] and starts == [False, True], "what a skipped stop switches off is skipped with it"
    assert "opskip.proof" in codes(result.diagnostics) and "event.not_carried_out" not in codes(result.diagnostics)


def test_a_tool_must_not_change_among_skipped_blocks() -> None:
    lines = skipping("GOTO/10,5,5", "LOADTL/2", "SPINDL/RPM,900,CLW", "RAPID", "GOTO/10,5,50", "GOTO/10,5,5")
    assert "opskip.mode" in codes(convert(toolpath(*lines), "mill-3axis", "generic-iso").diagnostics)


def test_holes_are_spelt_out_among_skipped_blocks() -> None:
    hole = ["RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/10,10,0", "GOTO/20,10,0", "CYCLE/OFF"]
    plain = convert(toolpath(*hole), "mill-3axis", "generic-iso")
    skipped = convert(toolpath(*skipping(*hole)), "mill-3axis", "generic-iso")
    assert len(plain.program.holes) == 2 and not skipped.program.holes


def test_the_summary_says_the_mode_of_every_operation(tmp_path: Path) -> None:
    path = operations(indexed()[-8:], indexed()[-8:], turning())
    own = setup_of(tmp_path, '[output.operations]\nB = "axes"\n')
    result = convert(path, "mikron-ucp710", shop(tmp_path), own)
    assert summary.as_dict(result, "x")["output_modes"] == {"A": ["tilted"], "B": ["axes"], "C": ["tcp"]}
    plain = convert(path, "mikron-ucp710", "generic-iso")
    assert summary.output_modes(plain) == {"A": ["axes"], "B": ["axes"], "C": ["axes"]}
    assert "output:" not in summary.as_text(plain, "x")
