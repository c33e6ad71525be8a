"""The largest cutting feed of the machine and of each axis: in plan, text, read-back, time, second witness."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.loader import load_checked
from postproc.base.options import FeedModeChoice, Options
from postproc.cycle_time.source import from_gcode
from postproc.pipeline.result import PostResult
from postproc.verification import second_witness
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, setup_of, tilted, toolpath
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

SETUP = setup_of("[part]\norigin = [31, -12, 5]\n[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 65\n")
"""the part off the rotary axes, tools of different lengths"""
CONTROLS = ("fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640", "linuxcnc", "generic-iso")
SLOW = '[control]\nlargest_feed = 400\n[axes.Y]\ncutting_velocity = 5\n[axes.C]\ncutting_velocity = 3\n'


@cache
def machine(text: str = SLOW, base: str = "mikron-ucp710") -> machines.machine.Machine:
    from tempfile import mkdtemp

    file = Path(mkdtemp()) / "shop.toml"
    file.write_text(f'base = "{base}"\n{text}')
    return machines.load(file)


@cache
def cuts() -> Toolpath:
    """Cuts along X and Y and an arc above 400 mm/min, a hole, a tap, one below; another tool, a cut that turns C."""
    turn = [tilted(30.0, float(t)) for t in np.linspace(0.0, 60.0, 5)]
    turning = ["RAPID", point(45 * turn[0], turn[0]), *(point(30 * a, a) for a in turn), "RAPID",
               point(60 * turn[-1], turn[-1])]
    return toolpath("RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,2", "FEDRAT/MMPM,900", "GOTO/20,0,2", "GOTO/20,15,2",
                    "FEDRAT/MMPM,200", "GOTO/0,15,2", "RAPID", "GOTO/0,15,50",
                    "CYCLE/DRILL,DEPTH,5,MMPM,800,CLEAR,3", "GOTO/5,5,0", "CYCLE/OFF", "RAPID", "GOTO/5,5,50",
                    "LOADTL/2", "SPINDL/RPM,2000,CLW", "FEDRAT/MMPM,900", *turning)


def point(tip: np.ndarray, axis: np.ndarray) -> str:
    return "GOTO/" + ",".join(f"{v:.9f}" for v in (*tip, *axis))


@cache
def converted(controller: str, output: str = "auto", text: str = SLOW) -> PostResult:
    return postproc.convert(cuts(), machine(text), controller, SETUP, Options(output=output))


def verdict(result: PostResult, text: str) -> set[str]:
    """Errors of reading a text back on the job of a conversion."""
    assert result.job is not None
    _, found = read_back(text, result.job, "test.apt", gcode="edited.nc")
    return {d.code for d in found if d.severity is Severity.ERROR}


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "output"), [(c, m) for c in CONTROLS for m in ("auto", "axes")])
def test_no_feed_word_is_above_the_largest_feed(controller: str, output: str) -> None:
    """Nor does any axis move faster at feed than it may; what is limited is named with its lines."""
    result = converted(controller, output)
    assert result.ok, [str(d) for d in result.diagnostics]
    p, m = result.program, machine()
    cutting = (p.code != 0) & (p.mode == 0)
    assert cutting.any() and p.feed[cutting].max() <= 400.0 + 1e-9
    path = result.path
    step = np.abs(np.diff(path.q, axis=0, prepend=path.q[:1])) / m.cutting_limits.velocity
    seconds = result.feeds.seconds
    fed = (path.code != 0) & np.isfinite(seconds)
    assert (step.max(axis=1)[fed] <= seconds[fed] * 1.001 + 1e-9).all()
    said = next(d for d in result.diagnostics if d.code == "feed.largest")
    assert said.severity is Severity.WARNING and "900 mm/min are limited to 400 mm/min" in said.message and said.count == 8


@pytest.mark.covering
@pytest.mark.parametrize("mode", ["auto", "per-minute"])
@pytest.mark.parametrize("controller", CONTROLS)
def test_in_inches_the_same_feed_is_the_largest(controller: str, mode: FeedModeChoice) -> None:
    """The same motion, where words turn rotary axes too, whatever a degree counts in F."""
    inch = SETUP.model_copy(update={"output": SETUP.output.model_copy(update={"units": "inch"})})
    result = postproc.convert(cuts(), machine(), controller, inch, Options(output="axes", feed_mode=mode))
    assert result.ok, [str(d) for d in result.diagnostics]
    p = result.program
    cutting = (p.code != 0) & (p.mode == 0) & ~p.write[:, 3:].any(axis=1)
    assert p.feed[cutting].max() * result.controller.feed_unit == pytest.approx(400.0)
    mm = postproc.convert(cuts(), machine(), controller, SETUP, Options(output="axes", feed_mode=mode))
    assert np.nansum(result.feeds.seconds) == pytest.approx(np.nansum(mm.feeds.seconds), rel=2e-3)


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc"])
def test_rapids_that_are_fed_keep_the_largest_feed_in_inches(controller: str) -> None:
    fed = SETUP.output.model_copy(update={"rapids_as_feed": True})
    words = []
    for units, of in (("mm", 1.0), ("inch", 25.4)):
        setup = SETUP.model_copy(update={"output": fed.model_copy(update={"units": units})})
        axis = tilted(20.0, 5.0)
        path = toolpath("RAPID", point(45 * axis, axis), "FEDRAT/MMPM,300", point(30 * axis, axis), "RAPID",
                        point(60 * axis, axis))
        result = postproc.convert(path, machine("[control]\nlargest_feed = 600", "head-table"), controller, setup,
                                  Options(output="axes"))
        assert result.ok, [str(d) for d in result.diagnostics]
        words.append(max(float(f) for f in re.findall(r" F([\d.]+)", result.text)) * of)
    assert words == pytest.approx([600.0, 600.0], rel=1e-5)


def test_without_the_keys_nothing_is_limited() -> None:
    result = converted("linuxcnc", "axes", "")
    assert "feed.largest" not in codes(result.diagnostics) and "F900" in result.text


def test_the_program_is_compared_with_the_limited_feed() -> None:
    """A feed above it is found although the CL file programs more, in a cut and in a hole."""
    result = converted("linuxcnc", "axes")
    for old, new in (("X20 F400", "X20 F900"), ("R3 F400", "R3 F800")):
        assert old in result.text
        assert "verify.feed" in verdict(result, result.text.replace(old, new, 1)), new
    slow = re.sub(r"X20 F400", "X20 F300", result.text, count=1)
    assert "verify.slow" in verdict(result, slow)


def test_the_second_witness_limits_by_the_machine_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same program against a machine file without the keys is slower than programmed; above them it is too fast."""
    result = converted("linuxcnc", "axes")
    comparison, _ = read_back(result.text, result.job, "test.apt")
    said, _ = second_witness.second_witness(result.source, SETUP, result.options, result.job, comparison, result.text)
    assert not said.findings, said.findings
    tables = second_witness.machine_tables
    monkeypatch.setattr(second_witness, "machine_tables", lambda m: tables(machine("")))
    said, _ = second_witness.second_witness(result.source, SETUP, result.options, result.job, comparison, result.text)
    assert {"feed", "hole"} <= {f.code for f in said.findings}
    fast = converted("linuxcnc", "axes", "")
    comparison, _ = read_back(fast.text, fast.job, "test.apt")
    monkeypatch.setattr(second_witness, "machine_tables", lambda m: tables(machine()))
    said, _ = second_witness.second_witness(fast.source, SETUP, fast.options, fast.job, comparison, fast.text)
    assert {"feed", "velocity", "hole"} <= {f.code for f in said.findings}


def test_the_time_clamps_feeds_as_the_control_does() -> None:
    """The program with its feeds set too high takes as long as the one that states the largest feed."""
    result = converted("linuxcnc", "axes")
    fast = result.text.replace("F400", "F900")
    blocks = [from_gcode(t.encode(), machine(), result.controller, SETUP)[0] for t in (result.text, fast)]
    assert fast != result.text and np.allclose(blocks[0].speed, blocks[1].speed)
    free = from_gcode(fast.encode(), machine(""), result.controller, SETUP)[0]
    assert free.speed[~free.rapid].max() == pytest.approx(15.0)


def test_planned_feeds_keep_them() -> None:
    result = postproc.convert(cuts(), machine(), "linuxcnc", SETUP, Options(feed="planned"))
    assert result.ok, [str(d) for d in result.diagnostics]
    limits = machine().cutting_limits.velocity
    assert result.motion is not None and result.motion.trajectories()
    for made in result.motion.trajectories():
        assert (np.abs(made.qd).max(axis=0) <= limits * 1.001).all()


def test_a_tap_above_it_is_refused() -> None:
    lines = ["RAPID", "GOTO/0,0,50", "CYCLE/TAP,DEPTH,5,MMPR,1,CLEAR,3", "GOTO/5,5,0", "CYCLE/OFF"]
    refused = postproc.convert(toolpath(*lines), machine(), "linuxcnc", SETUP)
    found = next(d for d in refused.diagnostics if d.code == "feed.tap")
    assert found.severity is Severity.ERROR and "1000 mm/min" in found.message and "SPINDL" in found.hint
    lower = toolpath("SPINDL/RPM,300,CLW", *lines)
    assert postproc.convert(lower, machine(), "linuxcnc", SETUP).ok


def test_a_cutting_velocity_above_that_of_rapids_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "shop.toml"
    file.write_text('base = "mill-3axis"\n[axes.X]\ncutting_velocity = 501\n')
    found, said = load_checked(file)
    assert found is None and codes(said) == {"machine.cutting-velocity"} and said[0].lines == (3,)
    file.write_text('base = "mill-3axis"\n[axes.X]\ncutting_velocity = 500\n')
    assert load_checked(file)[0] is not None


def test_the_limits_follow_when_they_are_changed_in_memory() -> None:
    faster = machine()
    slower = replace(faster, limits=replace(faster.limits, velocity=faster.limits.velocity * 0.001))
    assert (slower.cutting_limits.velocity <= slower.limits.velocity).all()
