"""Programs in inches: the same motion as in mm, said in inches throughout; what a control says otherwise is found."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import postproc
import toolpaths
from postproc.pipeline.convert import verify
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.checks import block_lengths, block_seconds
from postproc.setup.model import SetupFile
from tests.postproc.kit import SAMPLES, codes, convert, good, machine, setup_of, shop_file, tool_setup, toolpath

CONTROLS = {"fanuc-30i": "mikron-ucp710", "haas-ngc": "trunnion-bc", "siemens-840d": "mikron-ucp710",
            "heidenhain-tnc640": "mikron-ucp710", "linuxcnc": "head-table", "generic-iso": "fork-head-ab"}
"""each with a machine; the set-up's part stands off its rotary axes, its tools have different lengths"""
GOLDEN = Path(__file__).parents[2] / "golden"
CYCLES = GOLDEN / "every_cycle.cls"
FILES = (SAMPLES / "pocket.cls", SAMPLES / "five_tilted.cls", SAMPLES / "inch_plate.apt", SAMPLES / "test_part.cls",
         SAMPLES / "h4a_indexed.cls", GOLDEN / "three_laws.cls", SAMPLES / "dialects" / "creo.ncl",
         SAMPLES / "joints" / "singular_pass.cls")
STATED = {"fanuc-30i": ("G20", "G21"), "haas-ngc": ("G20", "G21"), "siemens-840d": ("G700", "G710"),
          "heidenhain-tnc640": ("INCH", "MM"), "linuxcnc": ("G20", "G21"), "generic-iso": ("G20", "G21")}


@cache
def in_inches() -> SetupFile:
    """The set-up of the samples, its part off the rotary axes, its program in inches."""
    setup = tool_setup()
    part = setup.part.model_copy(update={"origin": (31.0, -17.0, -8.0)})
    return setup.model_copy(update={"part": part, "output": setup.output.model_copy(update={"units": "inch"})})


def in_mm() -> SetupFile:
    return in_inches().model_copy(update={"output": in_inches().output.model_copy(update={"units": "mm"})})


@cache
def both(file: Path, controller: str, name: str = "") -> tuple[PostResult, PostResult]:
    """A file in mm and in inches."""
    path, _ = toolpaths.read(file)
    name = name or CONTROLS[controller]
    return good(convert(path, name, controller, in_mm())), good(convert(path, name, controller, in_inches()))


@pytest.mark.covering
@pytest.mark.parametrize("controller", CONTROLS)
@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_the_same_motion_as_in_mm(file: Path, controller: str) -> None:
    """CL point by CL point the tip is where the program in mm has it, within what both round; no cut takes longer."""
    mm, inch = both(file, controller)
    ends, seconds, near = [], [], 0.0
    for r in (mm, inch):
        assert r.job is not None and r.comparison is not None and r.comparison.executed is not None
        reached, motion = r.comparison.match, r.comparison.executed[1]
        ends.append(r.comparison.tip[reached[reached >= 0]])
        times = block_seconds(motion, r.job.control, r.controller.feed.arc_inverse == "radius")
        seconds.append(times[motion.code > 0].sum())
        near += 1.01 * r.job.rounding.tip + 3.0 * r.job.controller.grain
    assert len(ends[0]) == len(ends[1]) > 3
    assert np.linalg.norm(ends[0] - ends[1], axis=1).max() < near
    assert seconds[1] == pytest.approx(seconds[0], rel=2e-3)
    assert mm.witness is not None and inch.witness is not None
    assert inch.witness.not_compared == mm.witness.not_compared and len(inch.witness.compared) == len(mm.witness.compared)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", CONTROLS)
def test_inches_are_stated_and_nothing_is_left_in_mm(controller: str) -> None:
    mm, inch = both(SAMPLES / "pocket.cls", controller)
    wanted, other = STATED[controller]
    words = [word for line in inch.text.splitlines() if not re.search(r"[(;]", line) for word in line.split()]
    assert wanted in words and other not in words
    sizes = [max(abs(float(v)) for v in re.findall(r"(?m)\bX([-+]?[\d.]+)", r.text)) for r in (mm, inch)]
    assert sizes[0] / 25.4 == pytest.approx(sizes[1], abs=1e-3)
    head = inch.text[:3000].upper()
    assert "INCH, 0.000" in head and "WITHIN" in head  # the bound
    assert re.search(r"GAUGE LENGTH 4\.\d{5} INCH", head) and "GAUGE LENGTH 120.0000 MM" not in head
    offsets = [re.search(r"MACHINE COORDINATES: .*?X([-\d.]+)", r.text[:3000].upper()) for r in (mm, inch)]
    assert offsets[0] and offsets[1]
    assert float(offsets[0][1]) / 25.4 == pytest.approx(float(offsets[1][1]), abs=1e-5)
    assert ("TENTHS OF AN INCH" in head) == (controller == "heidenhain-tnc640")


def test_angles_and_feeds_of_rotary_axes_stay_degrees() -> None:
    """The tip stands on the A axis while the tool turns about it: the blocks of A alone are the same in both units."""
    lines = ["RAPID", "GOTO/0,0,60,0,0,1", "GOTO/0,0,0,0,0,1",
             *(f"GOTO/0,0,0,0,{-np.sin(a):.9f},{np.cos(a):.9f}" for a in np.radians([5, 12, 20, 30])),
             "RAPID", "GOTO/0,0,60,0,-0.5,0.8660254"]
    for mode in ("per-minute", "auto"):
        found = []
        for units in ("mm", "inch"):
            setup = SetupFile.model_validate({"output": {"units": units}, "tools": {"1": {"gauge_length": 60.0}}})
            text = good(convert(toolpath(*lines), "mill-4axis", "generic-iso", setup, feed_mode=mode, output="axes")).text
            found.append(re.findall(r"(?m)^(?:G9[34] )?(?:G1 )?(A[-\d.]+(?: F[\d.]+)?)$", text))
        assert found[0] == found[1] and len(found[0]) >= 4 and any("F" in block for block in found[0])


WRONG = {
    "fanuc-30i": [("G20", "G21"), (r"(G84.*)F19\.685", r"\1 F0.7750"), (r"F(\d+\.)", r"F1\1")],
    "siemens-840d": [("G700", "G710"), ("G700", "G70"), (r"(CYCLE84\(.*),0\.03937,", r"\1,1,"), ("F5.9055", "F150")],
    "heidenhain-tnc640": [(" INCH", " MM"), (r"Q206=\+59\.05512", "Q206=+5.905512"), (r"Q239=\+0\.03937", "Q239=+1"),
                          (r"F157\.48", "F15.748"), (r"T0\.00011\b", "T0.003")],
    "haas-ngc": [("G20", "G21"), (r"E0\.0001\b", "E0.003"), (r"Q0\.2362", "Q6.0")],
}
"""what each control must be found to say wrongly in every_cycle.cls"""


@cache
def found(text: str, controller: str) -> set[str]:
    """Errors in a program of every_cycle.cls in inches."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "part.nc"
        file.write_text(text)
        result = verify(file, toolpaths.read(CYCLES)[0], machine(CONTROLS[controller]), controller, in_inches())
    return {d.code for d in result.diagnostics if d.severity.name == "ERROR"}


@pytest.mark.parametrize(("controller", "pattern", "instead"), [
    (controller, *edit) for controller, edits in WRONG.items() for edit in edits])
def test_words_in_the_wrong_unit_are_found(controller: str, pattern: str, instead: str) -> None:
    inch = both(CYCLES, controller)[1]
    changed = re.sub(pattern, instead, inch.text)
    assert changed != inch.text and not found(inch.text, controller)
    assert found(changed, controller), f"{pattern} as {instead} is not found"


def test_units_that_contradict_the_output_are_refused_by_name(tmp_path: Path) -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "GOTO/10,0,5")
    own = shop_file(tmp_path, 'program.preamble = ["G17 G21 G40 G49 G80 G90 G94 G98", "{work_offset}"]', "fanuc-30i")
    made = convert(path, "mill-3axis", own, in_inches())
    fault = next(d for d in made.diagnostics if d.code == "output.units")
    assert not made.ok and "G21 (mm)" in fault.message and "inch" in fault.message and fault.hint
    good(convert(path, "mill-3axis", own, in_mm()))
    follows = own.read_text().replace("G21", "{units}")
    own.write_text(follows)
    assert "G20" in good(convert(path, "mill-3axis", own, in_inches())).text
    opposite = shop_file(tmp_path, 'program.preamble = ["G17 G70 G90 G94 G40 G64", "{work_offset}"]', "siemens-840d")
    assert "output.units" in codes(convert(path, "mill-3axis", opposite, in_mm()).diagnostics)
    # G70 says inches of lengths alone: the read-back refuses the feeds
    assert "gcode.units" in codes(convert(path, "mill-3axis", opposite, in_inches()).diagnostics)


def test_the_controller_file_may_say_inches_and_the_set_up_goes_before_it(tmp_path: Path) -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "GOTO/25.4,0,5")
    own = shop_file(tmp_path, 'format.units = "inch"\ninch.linear_decimals = 6', "linuxcnc")
    made = good(convert(path, "mill-3axis", own, tool_setup()))
    assert "G20" in made.text and "X1\n" in made.text
    assert "G21" in good(convert(path, "mill-3axis", own, in_mm())).text


@pytest.mark.parametrize("controller", ["linuxcnc", "heidenhain-tnc640"])
def test_a_program_in_inches_takes_the_time_of_one_in_mm(controller: str) -> None:
    from postproc.cycle_time.conversion import estimate_of

    mm, inch = both(SAMPLES / "pocket.cls", controller)
    assert estimate_of(inch).seconds == pytest.approx(estimate_of(mm).seconds, rel=2e-3)


def test_feeds_of_all_axes_count_degrees_as_the_control_does() -> None:
    """Fanuc: degrees as inches; TNC: as mm. The same block, its F worked out by hand from its words."""
    lines = ["RAPID", "GOTO/0,0,60,0,0,1", "GOTO/0,0,10,0,0,1", "GOTO/40,0,10,0.0998334166,0,0.9950041653"]
    for controller, degree, part in (("fanuc-30i", 1.0, 1.0), ("heidenhain-tnc640", 1.0 / 25.4, 10.0)):
        made = good(convert(toolpath(*lines), "mikron-ucp710", controller, in_inches(), feed_mode="per-minute",
                            output="axes"))
        program, job = made.program, made.job
        assert job is not None and program is not None
        assert made.comparison is not None and made.comparison.executed is not None
        k = int(np.flatnonzero((program.code == 1) & program.write[:, 3:].any(axis=1))[0])
        step = program.words[k] - program.words[k - 1]
        length = np.sqrt((step[:3] ** 2).sum() / 25.4**2 + (step[3:] ** 2).sum() * degree**2)
        motion = made.comparison.executed[1]
        row = int(np.flatnonzero(np.isclose(motion.feed, program.feed[k], rtol=1e-3) & (motion.code == 1))[0])
        seconds = block_seconds(motion, job.control)[row]
        assert program.feed[k] * seconds / 60.0 / part == pytest.approx(length, rel=2e-3)


def test_blocks_that_only_turn_under_tip_control_are_degrees_per_minute_for_both_readings() -> None:
    """Near a singular direction the tip stands still in some blocks: 1e-15 of X, Y, Z that reckoning leaves is no motion."""
    path, _ = toolpaths.read(SAMPLES / "tool_axis_tour.apt")
    setup = tool_setup()
    inch = setup.model_copy(update={"output": setup.output.model_copy(update={"units": "inch"})})
    made = good(convert(path, "trunnion-bc", "haas-ngc", inch))
    assert re.search(r"(?m)^B\S+ C\S+ F2\d{4}\.", made.text) and made.comparison is not None
    motion, control = made.comparison.executed[1], made.job.control
    length, unit = block_lengths(motion, control)
    alone = (motion.code == 1) & (motion.feed > 20000.0)
    assert alone.any() and (unit[alone] == 1.0).all() and (length[alone] < 2.0).all()


def test_a_set_up_says_inches_in_its_file(tmp_path: Path) -> None:
    file = tmp_path / "inch.toml"
    file.write_text('[output]\nunits = "inch"\n[tools.1]\ngauge_length = 120.0\n')
    path = toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "GOTO/25.4,0,5")
    made = good(postproc.convert(path, machine("mill-3axis"), "fanuc-30i", setup=str(file)))
    assert "F23.622\nX1.\n" in made.text


def test_words_of_u_v_w_are_inches_too() -> None:
    """Controls scale them (LinuxCNC: G20), and so does the read-back: home is 206.654 mm of all legs."""
    setup = setup_of('[part]\norigin = [0, 0, -250]\n[tools.1]\ngauge_length = 80\n[clearance]\nmargin = 20\n'
                     '[output]\nunits = "inch"\n')
    path = toolpath("RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,3000", "GOTO/0,0,0", "GOTO/1,0,0")
    inch = good(convert(path, "hexapod", setup=setup))
    assert "U8.13598 V8.13598" in inch.text and inch.comparison is not None and inch.comparison.worst_tip < 0.01
    assert inch.witness is not None and not inch.witness.findings
