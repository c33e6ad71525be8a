"""Rapids of controls that run each axis at its own speed: split where that is safe, fed where asked for, else refused."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from postproc.base.options import Options
from postproc.job import rapids
from postproc.pipeline.result import PostResult
from postproc.verification import second_witness
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, setup_of, tilted, toolpath
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

TOOLS = "[part]\norigin = [31, -12, 5]\n[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 65\n"
"""the part off the rotary axes, tools of different lengths"""
SETUP, FED = setup_of(TOOLS), setup_of(TOOLS + "[output]\nrapids_as_feed = true\n")
BENT = ("fanuc-30i", "haas-ngc")


def side(axis: np.ndarray) -> list[str]:
    """A cut 20 above the part's zero; rapids that rise across, fall across, and lie across at a high and a low level."""
    u = np.cross(axis, [0.3, 0.1, 1.0])
    u /= np.linalg.norm(u)
    v = np.cross(axis, u)

    def at(x: float, y: float, z: float) -> str:
        return "GOTO/" + ",".join(f"{k:.9f}" for k in (*(x * u + y * v + z * axis), *axis))

    return ["RAPID", at(0, 0, 60), "RAPID", at(0, 0, 22), "FEDRAT/MMPM,500", at(0, 0, 20), at(12, 0, 20), "RAPID",
            at(20, 9, 60), "RAPID", at(-3, 4, 60), "RAPID", at(5, 5, 22), at(5, 5, 20), "RAPID", at(5, 5, 22), "RAPID",
            at(9, -4, 22), at(9, -4, 20), "RAPID", at(9, -4, 60)]


@cache
def path() -> Toolpath:
    return toolpath(*side(np.array([0.0, 0.0, 1.0])), "LOADTL/2", "SPINDL/RPM,1500,CLW", *side(tilted(40.0, 65.0)))


@cache
def converted(controller: str, output: str = "auto", fed: bool = False, name: str = "mikron-ucp710") -> PostResult:
    return postproc.convert(path(), machines.load(name), controller, FED if fed else SETUP, Options(output=output))


def errors(result: PostResult, text: str) -> set[str]:
    assert result.job is not None
    _, found = read_back(text, result.job, "test.apt", gcode="edited.nc")
    return {d.code for d in found if d.severity is Severity.ERROR}


@pytest.mark.covering
@pytest.mark.parametrize("controller", BENT)
@pytest.mark.parametrize("output", ["auto", "axes", "tilted"])
def test_rapids_stay_rapid_and_keep_above_what_is_cut(controller: str, output: str) -> None:
    """Executed with each axis at its own speed, whatever the speeds are: along the tool axis, or above the cuts by 5 mm."""
    result = converted(controller, output)
    assert result.ok, [str(d) for d in result.diagnostics]
    job, p = result.job, result.path
    rapid = np.flatnonzero((job.moves.kind[p.move] == 0) & np.isfinite(p.u))
    assert len(rapid) and (p.code[rapid] == 0).all() and "feed.rapid_as_feed" not in codes(result.diagnostics)
    for speeds in ((1.0, 1.0, 1.0, 1.0, 1.0), (9.0, 2.0, 0.5, 1.0, 3.0)):
        slow = replace(job.machine, limits=replace(job.machine.limits, velocity=np.array(speeds)))
        control = replace(job.control.under("axes"), machine=slow)
        for t in np.linspace(0.0, 1.0, 9):
            kin = job.kinematics(int(job.moves.tool[p.move[rapid[0]]]))
            for k in rapid.tolist():
                kin = job.kinematics(int(job.moves.tool[p.move[k]]))
                tip, axis, _ = control.between(p.q[k - 1:k], p.q[k:k + 1], np.full(1, t), kin, np.ones(1, dtype=bool))
                ends = kin.forward(p.q[[k - 1, k]])[0]
                off = tip - ends[0]
                across = np.linalg.norm(off - (off @ axis[0])[:, None] * axis)
                height = float(((tip - job.space.corners) @ axis[0]).min())
                assert across < 1e-3 or height >= 4.99 - 1e-3, (k, t, across, height)


@pytest.mark.parametrize("controller", BENT)
def test_every_position_of_the_cl_file_is_still_reached(controller: str) -> None:
    result = converted(controller, "axes")
    last = np.flatnonzero(np.append(np.diff(result.job.moves.row) != 0, True))
    straight = postproc.convert(path(), replace(machines.load("mikron-ucp710"), rapids="straight"), controller, SETUP,
                                Options(output="axes"))
    assert np.allclose(result.job.moves.tip[last], straight.job.moves.tip)


@pytest.mark.covering
@pytest.mark.parametrize("controller", BENT)
@pytest.mark.parametrize("written", ["auto", "axes", "tilted"])
def test_the_proof_knows_nothing_of_how_rapids_were_split(controller: str, written: str) -> None:
    """A program is right for jobs of every output mode, as for one whose rapids are to be fed."""
    text = converted(controller, written).text
    for output in ("auto", "axes", "tilted"):
        assert not errors(converted(controller, output), text), output
        comparison, _ = read_back(text, converted(controller, output).job, "test.apt", gcode="edited.nc", margins=True)
        assert comparison is not None and comparison.lengths == converted(controller, written).comparison.lengths


@pytest.mark.parametrize("controller", BENT)
def test_a_split_rapid_may_go_across_at_any_height_above_its_ends(controller: str) -> None:
    """The level of one split rapid edited: right above both ends, whatever was planned, wrong below them."""
    result = converted(controller, "axes")
    lines = result.text.splitlines()
    at = next(k for k in range(len(lines) - 2) if re.fullmatch(r"Z\S+", lines[k]) and re.fullmatch(
        r"X\S+ Y\S+", lines[k + 1]) and re.fullmatch(r"Z\S+", lines[k + 2]))
    level, cut = float(lines[at][1:]), 20.0
    assert level > cut + 50.0
    for change, right in ((7.0, True), (cut + 3.0 - level, True), (cut + 1.0 - level, False)):
        edited = [*lines[:at], f"Z{level + change:.3f}", *lines[at + 1:]]
        assert bool(errors(result, "\n".join(edited))) != right, change


@pytest.mark.parametrize("controller", BENT)
def test_the_machine_file_may_say_that_rapids_are_straight(controller: str, tmp_path: Path) -> None:
    """The bought option: nothing is split, the diagonal rapid is one block; the other direction on Siemens."""
    file = tmp_path / "shop.toml"
    file.write_text('base = "mikron-ucp710"\n[control]\nrapids = "straight"\n')
    free = postproc.convert(path(), machines.load(file), controller, SETUP, Options(output="axes"))
    assert free.ok and free.job.control.rapids == "straight"
    assert len(free.job.moves) < len(converted(controller, "axes").job.moves)
    file.write_text('base = "mikron-ucp710"\n[control]\nrapids = "dog-leg"\n')
    bent = postproc.convert(path(), machines.load(file), "siemens-840d", SETUP, Options(output="axes"))
    assert bent.ok and len(bent.job.moves) == len(converted(controller, "axes").job.moves)


@pytest.mark.parametrize("controller", BENT)
def test_a_diagonal_rapid_is_found_by_both_readings(controller: str) -> None:
    """The two blocks of a split rapid made one, as a control with straight rapids would have it."""
    result = converted(controller, "axes")
    lines = result.text.splitlines()
    at = next(k for k in range(len(lines) - 1) if re.fullmatch(r"G0 Z\S+", lines[k]) and re.fullmatch(r"X\S+ Y\S+",
                                                                                                    lines[k + 1]))
    joined = [*lines[:at], f"{lines[at]} {lines[at + 1]}", *lines[at + 2:]]
    assert errors(result, "\n".join(joined))
    bent = postproc.convert(path(), replace(machines.load("mikron-ucp710"), rapids="straight"), controller, SETUP,
                            Options(output="axes"))
    _, found = read_back(bent.text, result.job, "test.apt")
    assert any(d.severity is Severity.ERROR for d in found)


@pytest.mark.parametrize("controller", BENT)
def test_g1_only_where_it_is_asked_for(controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    fed = converted(controller, "axes", fed=True)
    assert fed.ok and "feed.rapid_as_feed" in codes(fed.diagnostics)
    _, found = read_back(fed.text, replace(fed.job, setup=SETUP), "test.apt")
    assert "verify.kind" in {d.code for d in found if d.severity is Severity.ERROR}
    comparison, _ = read_back(fed.text, fed.job, "test.apt")
    for setup, finds in ((FED, False), (SETUP, True)):
        said, _ = second_witness.second_witness(fed.source, setup, fed.options, fed.job, comparison, fed.text)
        assert (("kind" in {f.code for f in said.findings}) is finds), said.findings


def test_what_cannot_be_split_is_refused_with_what_to_do() -> None:
    """A head draws the tool back along a tilted axis with several slides: refused in axis positions, by the tip in auto;
    each of the three remedies of the hint is followed."""
    refused = converted("fanuc-30i", "axes", name="head-table")
    found = next(d for d in refused.diagnostics if d.code == "rapid.off_line")
    assert not refused.ok and found.severity is Severity.ERROR and found.lines and not refused.text
    for part in ('rapids = "straight" under [control]', "rapids_as_feed = true under [output]", "--output-mode tcp"):
        assert part in found.hint
    assert converted("fanuc-30i", "auto", name="head-table").ok and converted("fanuc-30i", "tcp", name="head-table").ok
    assert converted("fanuc-30i", "axes", fed=True, name="head-table").ok
    straight = replace(machines.load("head-table"), rapids="straight")
    assert postproc.convert(path(), straight, "fanuc-30i", SETUP, Options(output="axes")).ok


def test_the_stock_counts_as_cut() -> None:
    """A block of stock above the rapid of the CL file: the split rapid goes above it."""
    stock = setup_of(TOOLS + "[rewind.stock]\nlow = [-30, -30, 0]\nhigh = [30, 30, 100]\n")
    flat = toolpath(*side(np.array([0.0, 0.0, 1.0])))
    low, high = (postproc.convert(flat, machines.load("mill-3axis"), "fanuc-30i", setup) for setup in (SETUP, stock))
    assert low.ok and high.ok
    tops = [made.job.moves.tip[:, 2][made.job.moves.phase == 1] for made in (low, high)]
    assert tops[0].min() == pytest.approx(65.0) and tops[1].min() >= 105.0 + 5.0


def test_clearances_given_as_a_distance_are_kept() -> None:
    near = setup_of(TOOLS + "[clearance]\ncentre = [0, 0, 20]\ndistance = 70\n")
    made = postproc.convert(toolpath(*side(np.array([0.0, 0.0, 1.0]))), machines.load("mill-3axis"), "fanuc-30i", near)
    assert made.ok
    assert np.allclose(made.job.moves.tip[:, 2][made.job.moves.phase == 1], 5.0 + 90.0)


STEP = ["RAPID", "GOTO/0,0,60", "RAPID", "GOTO/0,0,22", "FEDRAT/MMPM,500", "GOTO/0,0,20", "GOTO/12,0,20", "RAPID",
        "GOTO/12,0,60", "RAPID", "GOTO/30,0,60", "RAPID", "GOTO/30,0,5", "GOTO/30,0,2", "RAPID", "GOTO/30,0,5", "RAPID",
        "GOTO/60,17,5", "GOTO/60,17,2", "RAPID", "GOTO/60,17,60"]
"""a cut at 20, two at 2; from one of these to the other across at 5"""


@pytest.mark.parametrize("controller", BENT)
def test_a_distance_below_what_is_cut_is_no_safe_plane(controller: str) -> None:
    low = setup_of("[tools.1]\ngauge_length = 90\n[clearance]\ncentre = [0, 0, 0]\ndistance = 3\n")
    made = postproc.convert(toolpath(*STEP), machines.load("mill-3axis"), controller, low)
    assert made.ok and made.job is not None
    assert made.job.moves.tip[:, 2][made.job.moves.phase == 1].min() >= 20.0


@pytest.mark.parametrize("controller", BENT)
def test_the_read_back_knows_what_is_cut_by_itself(controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: rapids are split below what is cut; written and compared with the same moves they agree."""
    plane = rapids._plane
    monkeypatch.setattr(rapids, "_plane", lambda space, axis, share: plane(space, axis, share) - 100.0)
    tools = setup_of("[tools.1]\ngauge_length = 90\n")
    made = postproc.convert(toolpath(*STEP), machines.load("mill-3axis"), controller, tools)
    assert not made.ok and any(d.code == "verify.link" and "below what is cut" in d.message for d in made.diagnostics)


@pytest.mark.covering
@pytest.mark.parametrize("controller", BENT)
@pytest.mark.parametrize("stock", [False, True])
def test_the_second_witness_holds_dog_legs_above_what_is_cut(controller: str, stock: bool) -> None:
    """The level of a split rapid taken down to the lower of its ends: below what is cut, or above that but in the stock."""
    box = "[rewind.stock]\nlow = [-5, -5, -5]\nhigh = [70, 30, 40]\n" if stock else ""
    setup = setup_of("[tools.1]\ngauge_length = 90\n" + box)
    steps = [line.replace(",17,5", ",17,25").replace("GOTO/30,0,5", "GOTO/30,0,25") for line in STEP] if stock else STEP
    made = postproc.convert(toolpath(*steps), machines.load("mill-3axis"), controller, setup)
    assert made.ok and made.job is not None
    across = np.flatnonzero((made.job.moves.phase == 1) & (made.job.moves.tip[:, 0] == 60.0))
    level = float(made.job.moves.tip[across[0], 2])
    low = "Z25." if stock else "Z5."
    text = re.sub(rf"Z{level:g}\.?$", low, made.text, flags=re.MULTILINE)
    comparison, _ = read_back(text, made.job, "test.apt")
    for program, finds in ((made.text, False), (text, True)):
        blocks = comparison if finds else made.comparison
        said, _ = second_witness.second_witness(made.source, setup, made.options, made.job, blocks, program)
        assert (("clearance" in {f.code for f in said.findings}) is finds), (level, said.findings)


@pytest.mark.covering
@pytest.mark.parametrize("controller", BENT)
@pytest.mark.parametrize("aside", [0.011, 0.015, 0.019, 0.025, 0.2])
def test_a_rapid_that_goes_up_and_little_aside(controller: str, aside: float) -> None:
    """Split although its two lines along the tool axis are nearly one."""
    steps = [line.replace("GOTO/12,0,60", f"GOTO/{12 + 0.6 * aside:.4f},{0.8 * aside:.4f},60") for line in STEP]
    for name in ("mill-3axis", "mikron-ucp710"):
        setup = setup_of("[tools.1]\ngauge_length = 90\n")
        made = postproc.convert(toolpath(*steps), machines.load(name), controller, setup, Options(output="axes"))
        assert made.ok and made.job is not None, [str(d) for d in made.diagnostics]
        assert len(made.job.moves) > len(made.job.commanded)
