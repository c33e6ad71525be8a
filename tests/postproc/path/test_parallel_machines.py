"""Parallel machines on the road: every block looked at densely, assembly modes, clearances, feeds, refusals."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.machine import Machine
from postproc.pipeline.result import PostResult
from postproc.readback.execution import assembly
from postproc.setup.model import PartPlacement, SetupFile
from postproc.verification.read_back import read_back
from tests.postproc.kit import SAMPLES, codes, good, goto, machine, toolpath
from tests.postproc.parallel_kit import converted, deviations, execute_dense, poses, setup

DELTAS = [n for n in machines.names() if n.startswith("delta-")] + ["uranesx"]
H4A = ["h4a-c-table", "h4a-spindle-axis"]
UP = np.array([0.0, 0.0, 1.0])
TOLERANCE = 0.01 * 0.7 + 2e-4
"""mm: what linearising and rounding may use"""


@cache
def sample(file: str, name: str, setup_name: str) -> PostResult:
    return good(converted(file, name, setup_name))


# ---- the tip stays on the path -----------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "file", "moves"), [
    *((name, "inch_plate.apt", 10) for name in DELTAS if name in ("delta-cone", "delta-hybrid", "delta-parallel-x")),
    ("uranesx", "pocket.cls", 80),
    *(pytest.param(name, "inch_plate.apt", 10, marks=pytest.mark.slow)
      for name in DELTAS if name not in ("delta-cone", "delta-hybrid", "delta-parallel-x")),
    *(pytest.param(name, "pocket.cls", 80, marks=pytest.mark.slow) for name in DELTAS[::2] if name != "uranesx")])
def test_three_axis_on_every_delta(name: str, file: str, moves: int) -> None:
    """One of each way that rails run; all with -m slow, and each in test_every_machine_and_control.py."""
    result = sample(file, name, "delta")
    tip, axis, compared = deviations(result)
    assert compared >= moves and axis == 0.0
    assert 1e-4 < tip < TOLERANCE
    assert tip <= result.comparison.worst_tip * 1.3 + 5e-4


@pytest.mark.slow
def test_bicubic_on_uranesx() -> None:
    tip, _, compared = deviations(sample("bicubic.cls", "uranesx", "delta"))
    assert compared >= 3600 and tip < TOLERANCE


@pytest.mark.parametrize(("name", "file", "moves"), [
    (H4A[0], "h4a_dome.cls", 130), (H4A[1], "h4a_indexed.cls", 20),
    pytest.param(H4A[0], "pocket.cls", 80, marks=pytest.mark.slow),
    pytest.param(H4A[1], "h4a_dome.cls", 130, marks=pytest.mark.slow),
    pytest.param(H4A[0], "h4a_indexed.cls", 20, marks=pytest.mark.slow)])
def test_five_axes_on_both_h4a(name: str, file: str, moves: int) -> None:
    result = sample(file, name, "h4a")
    tip, axis, compared = deviations(result)
    assert compared >= moves
    assert 1e-4 < tip < TOLERANCE and axis < 0.05
    assert tip <= result.comparison.worst_tip * 1.3 + 5e-4


def test_words_are_the_letters_of_the_machine() -> None:
    text = sample("h4a_dome.cls", "h4a-c-table", "h4a").text
    assert "(words: machine coordinates without RTCP)" in text
    assert "Z" in text and "U" in text and "C" in text and "G43" not in text
    assert "U" not in sample("pocket.cls", "uranesx", "delta").text.split("G54\n")[1]


# ---- what does not fit is refused --------------------------------------------------------------------------


@pytest.mark.covering(count=2)
@pytest.mark.parametrize(("file", "name", "code", "words"), [
    ("five_faces.cls", "h4a-c-table", "reach.axis", "45.0000 degrees away"),
    ("tool_axis_tour.apt", "h4a-c-table", "reach.axis", "15.0000 degrees away"),
    ("tool_axis_tour.apt", "h4a-spindle-axis", "reach.axis", "15.0000 degrees away"),
    ("indexed_4axis.cls", "h4a-spindle-axis", "reach.axis", "degrees away"),
    pytest.param("blade.cls", "h4a-spindle-axis", "reach.clearance", "workspace x: passed by", marks=pytest.mark.slow),
    ("five_tilted.cls", "h4a-c-table", "reach.clearance", "workspace y: passed by"),
])
def test_samples_that_tilt_too_far_are_refused(file: str, name: str, code: str, words: str) -> None:
    result = converted(file, name, "h4a")
    assert not result.ok and not result.text
    found = [d for d in result.diagnostics if d.code == code and words in d.message]
    assert found and found[0].lines and "set-up" in found[0].hint


TILTED = [*goto(np.array([[0, 0, 30], [0, 0, 2.0]]), np.tile([0.0, 0.6, 0.8], (2, 1))),
          *goto(np.array([[20, 0, 2.0]]), np.array([[0.0, 0.6, 0.8]]))]


def test_a_tilted_pass_on_a_delta_is_refused_and_the_message_says_what_serves() -> None:
    path = toolpath("RAPID", *TILTED)
    lengths = setup("delta")
    result = postproc.convert(path, machine("uranesx"), setup=lengths)
    (d,) = [d for d in result.diagnostics if d.code == "reach.axis"]
    assert "(0.000000, 0.600000, 0.800000)" in d.message and "36.8699 degrees away" in d.message
    assert "turn the part in the set-up (part.x_axis, part.y_axis)" in d.hint and "no rotary axis" in d.hint
    turned = PartPlacement(origin=(0.0, 0.0, -270.0), x_axis=(1.0, 0.0, 0.0), y_axis=(0.0, 0.8, 0.6))
    served = good(postproc.convert(path, machine("uranesx"), setup=lengths.model_copy(update={"part": turned})))
    assert served.comparison.worst_tip < 0.01


# ---- clearances at and between points ----------------------------------------------------------------------


def with_file(folder: Path, text: str) -> Machine:
    file = folder / "machine.toml"
    file.write_text(text)
    return machines.load(file)


ALONG = np.array([np.sqrt(0.75), 0.5, 0.0])
"""level, square to the rods of leg Y"""


@pytest.fixture
def post_in_the_path(tmp_path: Path) -> Machine:
    """UraneSX whose slide X stands where rod Y1 passes when the platform is 150 mm along, and well off at 20 and 280."""
    kinematics = machine("uranesx").kinematics
    assert isinstance(kinematics, OnLegs)
    rig = kinematics.rig(kinematics.inverse(150.0 * ALONG[None], UP[None])[0])
    shift = np.array([-86.6025403784439, -50.0, 0.0])
    top, foot = rig.carriages[0, 1] + shift, rig.ends[0, 1] + shift
    at = foot + (300.0 - foot[2]) / (top[2] - foot[2]) * (top - foot)
    return with_file(tmp_path, 'base = "uranesx"\n[kinematics.legs.X]\nrail_ends = [300, 1800]\n'
                     f"rail_offset = [{at[0] - 700.0}, {at[1]}, 0]\n")


LEVEL = SetupFile.model_validate({"tools": {"1": {"gauge_length": 100.0}}, "clearance": {"distance": 30.0}})


def passing(machine_: Machine, along: list[float], outwards: float = 0.0,
            tolerance: float = 0.01) -> PostResult:
    """A straight cut 100 mm below the platform's middle through places along ALONG, the part moved towards slide Y."""
    origin = outwards * np.array([-0.5, np.sqrt(0.75), 0.0]) - [0.0, 0.0, 100.0]
    placed = LEVEL.model_copy(update={"part": PartPlacement(origin=tuple(origin.tolist()))})
    points = np.array(along)[:, None] * ALONG
    return postproc.convert(toolpath("RAPID", *goto(points[:1]), *goto(points[1:])), machine_, setup=placed,
                            options=postproc.Options(tolerance=tolerance))


def test_a_rod_that_would_hit_a_slide_is_refused_at_a_point(post_in_the_path: Machine) -> None:
    result = passing(post_in_the_path, [20.0, 150.0, 280.0])
    (d,) = [d for d in result.diagnostics if d.code == "reach.clearance"]
    assert "rod Y1 - slide X: passed by" in d.message and "mm" in d.message and d.lines
    assert not result.text


def test_and_between_two_points_when_the_points_are_clear(post_in_the_path: Machine) -> None:
    """One block from a place on one side of the rail to one on the other; both ends keep their distance."""
    result = passing(post_in_the_path, [20.0, 280.0], tolerance=200.0)
    (block,) = np.flatnonzero(result.path.code == 1)
    margins = machines.reach.reach(post_in_the_path.kinematics, result.path.q[block - 1:block + 1])
    assert margins.values[:, margins.names.index("rod Y1 - slide X")].min() > 5.0
    (d,) = [d for d in result.diagnostics if d.code == "reach.clearance"]
    assert "rod Y1 - slide X: passed by" in d.message and not result.text
    assert "part.origin" in d.hint


def test_the_same_pass_elsewhere_is_allowed(post_in_the_path: Machine) -> None:
    result = passing(post_in_the_path, [20.0, 150.0, 280.0], outwards=100.0)
    assert all("linking move" in d.message for d in result.diagnostics if d.code == "reach.clearance")
    assert passing(machine("uranesx"), [20.0, 150.0, 280.0]).ok


@pytest.mark.parametrize(("key", "value", "words"), [
    ("carriage_angle", 6.0, "at slide: passed by"), ("platform_angle", 6.0, "at platform: passed by"),
    ("spindle_radius", 200.0, "- spindle: passed by")])
def test_joint_stops_and_spindle_count(tmp_path: Path, key: str, value: float, words: str) -> None:
    narrow = with_file(tmp_path, f'base = "uranesx"\n[kinematics.clearance]\n{key} = {value}\n')
    result = passing(narrow, [20.0, 280.0])
    assert any(words in d.message for d in result.diagnostics if d.code == "reach.clearance")
    assert not result.ok
    assert passing(machine("uranesx"), [20.0, 280.0]).ok


def test_rods_of_an_h4a_count_between_points(tmp_path: Path) -> None:
    """Rods Z1 and U1 come nearest halfway: radius chosen between what the ends and the middle leave."""
    thick = with_file(tmp_path, 'base = "h4a-c-table"\n[kinematics.clearance]\nrod_radius = 40\nspindle_radius = 5\n')
    kinematics = thick.kinematics
    assert isinstance(kinematics, LegsWithAxis)
    ends = np.array([[167.6, -122.7, -424.9, -0.7], [-129.3, 15.6, -687.2, 0.3]])
    q = np.column_stack([kinematics.platform.inverse(ends), np.zeros(2)])
    at = machines.reach.reach(kinematics, q)
    between = machines.reach.reach_between(kinematics, q)
    pair = at.names.index("rod Z1 - rod U1")
    assert at.values[:, pair].min() - between.values[0, pair] > 25.0


# ---- assembly modes ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["uranesx", "delta-hybrid", *H4A])
def test_walking_keeps_the_mode_it_starts_in(name: str) -> None:
    """From each mode at home, 100 mm and back: the pose comes back to that mode, also where it is not the home mode."""
    m = machine(name)
    kin = m.kinematics
    tips, axes = kin.assembly_modes(m.home[None])
    modes = np.hstack([tips[:, 0], axes[:, 0]])
    modes = modes[np.isfinite(modes).all(axis=1)]
    assert len(modes) >= 2
    step = np.where(m.rotary, 0.5, 60.0) * np.resize([1.0, 1.0, 0.8, 0.8], len(m.home))
    for pose in modes:
        there = assembly.walk(kin, m.home[None], (m.home + step)[None], pose[None])
        back = assembly.walk(kin, (m.home + step)[None], m.home[None], there)
        if np.isfinite(back).all():
            np.testing.assert_allclose(back[0], pose, atol=1e-6)
    there = assembly.walk(kin, m.home[None], (m.home + step)[None], modes[:1])
    np.testing.assert_allclose(there[0], np.hstack(kin.forward((m.home + step)[None]))[0], atol=1e-6)


def in_small_steps(m: Machine, q0: np.ndarray, q1: np.ndarray, near: np.ndarray,
                   count: int = 200) -> np.ndarray:
    """Pose (1, 6) at q1 (J,), followed from `near` at q0 (J,)."""
    for share in np.linspace(0.0, 1.0, count + 1)[1:]:
        near = np.hstack(m.kinematics.forward((q0 + share * (q1 - q0))[None], near))
    return near


@pytest.mark.parametrize(("name", "turn"), [("h4a-c-table", 9.0), ("h4a-spindle-axis", 1.2)])
def test_a_turning_axis_changes_no_mode(name: str, turn: float) -> None:
    """Off the middle, the rotary axis turns far with some of the slides: what is found is what small steps
    lead to, in every mode that they lead back from."""
    m, compared = machine(name), 0
    tip, axis = m.kinematics.forward(m.home[None])
    here = m.kinematics.inverse(tip + np.array([150.0, 100.0, 0.0]), axis, near=m.home)[0, 0]
    there = here + np.where(m.rotary, turn, 15.0) * np.resize([1.0, 0.9, 1.0, 0.8, 1.0], len(here))
    modes = np.hstack([part[:, 0] for part in m.kinematics.assembly_modes(here[None])])
    for pose in modes[np.isfinite(modes).all(axis=1)]:
        want = in_small_steps(m, here, there, pose[None])
        if np.isfinite(want).all() and np.abs(in_small_steps(m, there, here, want) - pose).max() < 1e-6:
            compared += 1
            np.testing.assert_allclose(assembly.walk(m.kinematics, here[None], there[None], pose[None]),
                                       want, atol=1e-6)
    assert compared >= 2


class Forgetful:
    """A Delta that takes the other mode for the home mode at some joints, as a machine with two such modes could."""

    def __init__(self, kin: OnLegs, at: int) -> None:
        self.kin, self.at, self.rotary, self.in_loops = kin, at, kin.rotary, kin.in_loops

    def forward(self, q: np.ndarray, near: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        tip, axis = self.kin.forward(q, near)
        if near is None:
            tip = tip.copy()
            tip[self.at:self.at + 3] = self.kin.assembly_modes(q)[0][1, self.at:self.at + 3]
        return tip, axis

    def carried(self, pose: np.ndarray, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
        return self.kin.carried(pose, q0, q1)


def test_ends_follow_the_blocks_and_not_the_home_mode() -> None:
    m = machine("uranesx")
    assert isinstance(m.kinematics, OnLegs)
    q = m.home + np.linspace(0.0, 50.0, 20)[1:, None] * np.array([1.0, -0.5, 0.2])
    right = np.hstack(m.kinematics.forward(q))
    found = assembly.ends(Forgetful(m.kinematics, 5), q, m.home)
    np.testing.assert_allclose(found, right, atol=1e-9)


def flipped(result: PostResult, flip: OnLegs | LegsWithAxis) -> set[str]:
    """Codes of the read-back of a result on a machine with other kinematics."""
    job = replace(result.job, machine=replace(result.machine, kinematics=flip))
    job = replace(job, control=replace(job.control, machine=job.machine))
    _, found = read_back(result.text.encode(), job, "test")
    return codes(found)


def test_a_wrong_assembly_mode_is_caught() -> None:
    """The same slides in the other assembly: the read-back says that the tip is not on the path."""
    result = sample("pocket.cls", "uranesx", "delta")
    kinematics = result.machine.kinematics
    assert flipped(result, kinematics) == set()
    other = replace(kinematics)
    other.__dict__["_side"] = -other._side
    assert codes_are_errors(flipped(result, other))


def codes_are_errors(found: set[str]) -> bool:
    return bool(found & {"verify.tip", "verify.not_reached"})


@pytest.mark.parametrize(("name", "setup_name", "letter"),
                         [("delta-parallel-x", "delta", "X"), ("h4a-c-table", "h4a", "Y")])
def test_a_leg_on_its_other_root_is_caught(name: str, setup_name: str, letter: str) -> None:
    """One word in the middle of the text put to the leg's other solution for the same pose."""
    result = sample("inch_plate.apt", name, setup_name)
    m = result.machine
    steps, tip, axis = poses(result)
    k = len(steps) // 2
    j = m.axis_names.index(letter)
    tools = {int(n): v.gauge_length for n, v in result.setup.tools.items()}
    every = replace(m.kinematics.with_tool(tools[steps[k].tool]), all_roots=True)
    branches = every.inverse(tip[k, -1:], axis[k, -1:])[:, 0]
    unit = np.where(m.rotary, 180.0 / np.pi, 1.0)
    apart = np.abs(branches * unit - steps[k].end)
    alone = [b for b in range(len(branches)) if apart[b, j] > 1.0 and np.delete(apart[b], j).max() < 1e-3]
    assert alone  # at a level tool both tilt pairs of an H4a are the same
    lines = result.text.splitlines()
    words = lines[steps[k].line - 1].split()
    assert any(w.startswith(letter) for w in words)
    lines[steps[k].line - 1] = " ".join(f"{letter}{branches[alone[0], j]:.4f}" if w.startswith(letter) else w for w in words)
    _, found = read_back("\n".join(lines).encode(), result.job, "test")
    assert codes_are_errors(codes(found))


# ---- feed --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("file", "name", "setup_name"), [
    ("pocket.cls", "uranesx", "delta"), ("h4a_dome.cls", "h4a-c-table", "h4a"),
    pytest.param("h4a_dome.cls", "h4a-spindle-axis", "h4a", marks=pytest.mark.slow)])
def test_every_cutting_block_states_its_time(file: str, name: str, setup_name: str) -> None:
    """60 / F seconds: no axis beyond its velocity, and over each block the tip's length at the programmed feed."""
    result = sample(file, name, setup_name)
    m = result.machine
    steps, tip, _ = poses(result)
    cut = np.array([s.kind == "feed" for s in steps])
    assert all(s.inverse for s in steps if s.kind == "feed")
    seconds = np.array([60.0 / s.feed if s.kind == "feed" else np.nan for s in steps])
    unit = np.where(m.rotary, 180.0 / np.pi, 1.0)
    ends = np.stack([m.home * unit, *(s.end for s in steps)])
    speed = np.abs(np.diff(ends, axis=0)) / seconds[:, None] / (m.limits.velocity * unit)
    assert speed[cut].max() < 1.0 + 1e-4
    length = np.linalg.norm(np.diff(tip, axis=1), axis=2).sum(axis=1) * 100 / 99
    rate = length / seconds * 60.0
    programmed = {round(float(f)) for f in result.toolpath.feed[np.isfinite(result.toolpath.feed)] * 60.0}
    assert rate[cut].max() < 1.02 * max(programmed)
    near = np.array([min(abs(r / f - 1.0) for f in programmed) for r in rate[cut & (length > 0.5)]])
    assert np.median(near) < 0.01


def test_fast_feeds_are_held_by_the_slides() -> None:
    """30 m/min in x and the table of 60 rev/min: reduced where an axis would be too fast, and said."""
    x = np.linspace(-20.0, 20.0, 9)
    tip = np.column_stack([x, 0 * x + 3.0, 0 * x])
    axis = np.column_stack([x / 20.0 * 0.3, 0.02 + 0 * x, 1.0 + 0 * x])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    path = toolpath("RAPID", *goto(tip[:1], axis[:1]), "FEDRAT/MMPM,30000", *goto(tip[1:], axis[1:]))
    result = good(postproc.convert(path, machine("h4a-c-table"), setup=setup("h4a")))
    assert "feed.reduced" in codes(result.diagnostics)
    m, steps = result.machine, execute_dense(result)
    unit = np.where(m.rotary, 180.0 / np.pi, 1.0)
    ends = np.stack([m.home * unit, *(s.end for s in steps)])
    top = [np.abs(ends[k + 1] - ends[k]) * s.feed / 60.0 / (m.limits.velocity * unit)
           for k, s in enumerate(steps) if s.kind == "feed"]
    assert 0.99 < np.max(top) < 1.0 + 1e-4


def test_a_block_that_moves_u_alone_is_measured_by_u() -> None:
    """LinuxCNC: X, Y, Z where any moves, else U, V, W, else A, B, C."""
    control = sample("h4a_dome.cls", "h4a-c-table", "h4a").job.control
    steps = np.array([[3.0, 4.0, 0.0, 9.0, 50.0], [0.0, 0.0, 0.0, 9.0, 50.0], [0.0, 0.0, 0.0, 0.0, 50.0], np.zeros(5)])
    np.testing.assert_array_equal(control.feed_length(steps), [5.0, 9.0, 50.0, 0.0])


# ---- where the control owns the kinematics -----------------------------------------------------------------


def test_joint_program_of_the_same_machine_without_the_controls_kinematics(tmp_path: Path) -> None:
    """`module = "trivkins"` takes the kinematics from the control: words are joints, and the tip goes the same path."""
    path, _ = toolpaths.read(SAMPLES / "pocket.cls")
    own = with_file(tmp_path, 'base = "linuxcnc-lineardelta"\n[control]\nmodule = "trivkins"\n')
    assert own.control_kinematics is None
    tip_words = good(postproc.convert(path, machine("linuxcnc-lineardelta"), setup=setup("tools")))
    joint_words = good(postproc.convert(path, own, setup=setup("tools")))
    assert "tool-centre-point control" in tip_words.text and "machine coordinates without RTCP" in joint_words.text
    tip, _, compared = deviations(joint_words)
    assert compared >= 80 and tip < TOLERANCE
    commanded = np.flatnonzero(joint_words.path.u == 1.0)
    for move in np.unique(joint_words.path.move[commanded])[::7]:
        a = joint_words.path.q[(joint_words.path.move == move) & (joint_words.path.u == 1.0)]
        b = tip_words.path.q[(tip_words.path.move == move) & (tip_words.path.u == 1.0)]
        np.testing.assert_allclose(a[-1], b[-1], rtol=0, atol=1e-9)
