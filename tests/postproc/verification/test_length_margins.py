"""By how much the length of a tool may differ: the program verifies just inside of what it states, and not outside."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from postproc.job.job import prepare
from postproc.report.summary import as_text, tools_of
from postproc.verification import length_limits
from postproc.verification import read_back as verification
from postproc.verification.read_back import read_back
from tests.postproc.kit import SAMPLES, convert, good, setup_of, toolpath
from toolpaths import read

GOLDEN = Path(__file__).parents[2] / "golden"
PROGRAMS = {
    "head, machine coordinates": ("short_five_axis.apt", "head-table", "generic-iso", "tools", ""),
    "fork head, two tools": ("five_tilted.cls", "nutating-head", "linuxcnc", "tools", ""),
    "six rods": ("pocket.cls", "uranesx", "linuxcnc", "delta", ""),
    "delta": ("pocket.cls", "delta-star", "generic-iso", "delta", ""),
    "corrected trunnion": ("short_five_axis.apt", "mikron-ucp710", "linuxcnc", "tools", "errors/mikron-ucp710.toml")}


@cache
def made(name: str) -> Any:
    file, machine, controller, setup, errors = PROGRAMS[name]
    path, _ = read((SAMPLES if (SAMPLES / file).exists() else GOLDEN) / file)
    given = {"error_model": str(SAMPLES / errors)} if errors else {}
    return good(convert(path, machine, controller, setup=setup_of((SAMPLES / f"{setup}.setup.toml").read_text()), **given))


def faults_with(result: Any, number: int, other: float) -> list[str]:
    """Codes of the errors that the program gives where a tool is longer by `other` mm."""
    return faults_with_all(result, {str(number): other})


def faults_with_all(result: Any, longer: dict[str, float]) -> list[str]:
    """Codes of the errors that the program gives where tools are longer by so many mm."""
    tools = {n: t.model_copy(update={"gauge_length": t.length + longer.get(n, 0.0)})
             for n, t in result.asked.tools.items()} if result.asked else {}
    job, found = prepare(result.toolpath, result.machine, result.controller,
                         result.setup.model_copy(update={"tools": tools}), result.options)
    assert job is not None, found
    _, faults = read_back(result.text, replace(job, errors=result.job.errors), "part.cls")
    return [d.code for d in faults if d.severity == 2]


def margins_hold(result: Any, limits: dict[str, str]) -> int:
    """How many ends were judged: just inside nothing fails, 5 % outside what the margin names; `limits`: words to codes."""
    judged = 0
    for one in result.comparison.lengths:
        for sign, margin, what in ((-1.0, one.shorter, one.ends_shorter), (1.0, one.longer, one.ends_longer)):
            assert faults_with(result, one.number, sign * min(margin, 20.0)) == [], (one, sign)
            if margin < 50.0:
                far = sign * (1.05 * margin + (1.1e-3 if what.startswith("travel") else 0.0))
                assert limits[what.split()[0]] in faults_with(result, one.number, far), (one, sign)
                judged += 1
    return judged


LIMITS = {"tolerance": "verify.tip", "axis": "verify.axis", "travel": "verify.travel", "clearance": "verify.link"}


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name == "six rods" else ())
                                  for name in PROGRAMS])
def test_a_program_verifies_with_lengths_inside_its_margins_and_not_outside(name: str) -> None:
    """1.1 um: what rounded words may pass travel by."""
    assert margins_hold(made(name), LIMITS)


def test_where_joints_stay_the_tip_goes_along_the_tool(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same margins as from executing the program with longer tools."""
    result, kept = made("delta"), length_limits._Look._keeps_joints
    margins = []
    for executed in (False, True):
        monkeypatch.setattr(length_limits._Look, "_keeps_joints",
                            lambda look, rows, own=not executed: kept(look, rows) & own)
        found, _ = read_back(result.text, replace(result.job, errors=result.job.errors), "part.cls", margins=True)
        assert found is not None
        margins.append([(one.shorter, one.longer) for one in found.lengths])
    np.testing.assert_allclose(margins[0], margins[1], rtol=1e-6)


@pytest.mark.parametrize("name", ["head, machine coordinates", "fork head, two tools", "delta"])
def test_margins_are_those_of_executed_programs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same figures where every length is executed and every cut is looked at."""
    result = made(name)
    keeps = length_limits._Proof.keeps
    monkeypatch.setattr(length_limits, "lifted", lambda *given: None)
    monkeypatch.setattr(verification, "always_lifted", lambda motion: False)
    monkeypatch.setattr(length_limits._Proof, "keeps", lambda proof, *of: keeps(replace(proof, lost={}), *of))
    found, _ = read_back(result.text, replace(result.job, errors=result.job.errors), "part.cls", margins=True)
    assert found is not None and found.lengths == result.comparison.lengths


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("name", PROGRAMS)
def test_all_tools_at_their_margins_at_once(name: str) -> None:
    """What one tool may differ by does not depend on the others."""
    result = made(name)
    for sign in (-1.0, 1.0):
        other = {str(one.number): sign * min(one.shorter if sign < 0.0 else one.longer, 20.0)
                 for one in result.comparison.lengths}
        assert faults_with_all(result, other) == []


def test_a_register_takes_up_the_length_where_only_the_table_turns() -> None:
    """Travel and links alone can fail: one line at the head, the figures by tool."""
    path, _ = read(SAMPLES / "blade.cls")
    result = good(convert(path, "mikron-ucp710", "linuxcnc", setup=setup_of((SAMPLES / "tools.setup.toml").read_text())))
    (one,) = result.comparison.lengths
    assert one.ends_longer == "travel Z" and 1.0 < one.longer < 50.0 and one.shorter == np.inf
    assert margins_hold(result, LIMITS) == 1
    longer = np.floor(one.longer * 1e3) / 1e3
    line = f"lengths off are taken up by registers: -50 mm and more to +{longer:.3f} mm, then T4 travel Z"
    assert f"({line})" in result.text and line in as_text(result, "part.ngc")


def test_links_that_come_too_near_end_a_margin(tmp_path: Path) -> None:
    """Home is below the end of travel: a longer tool crosses the part from there before the slide ends."""
    file = tmp_path / "low.toml"
    file.write_text('base = "mill-3axis"\n[axes.Z]\nhome = 300\n')
    text = "[part]\norigin = [0, 0, 140]\n[clearance]\nmargin = 15\n[tools.1]\ngauge_length = 120\n"
    path = toolpath("RAPID", "GOTO/-20,0,12", "GOTO/-20,0,0", "GOTO/20,0,0", "GOTO/20,0,12")
    result = good(convert(path, str(file), "haas-ngc", setup=setup_of(text)))
    (one,) = result.comparison.lengths
    assert one.ends_longer == "clearance" and 10.0 < one.longer < 50.0, one
    assert margins_hold(result, LIMITS) == 1


def test_the_head_of_many_tools_states_each() -> None:
    """Heads longer than what `verify` reads of them keep no line that is pending."""
    records = [line for n in range(1, 61) for line in (
        f"LOADTL/{n}", "SPINDL/RPM,1000,CLW", "RAPID", f"GOTO/{n},0,60,0,0.1,0.995", f"GOTO/{n},0,5,0,0.1,0.995")]
    setup = setup_of("".join(f"[tools.{n}]\ngauge_length = {100 + n}\n" for n in range(1, 61)))
    path = toolpath(*records, head=["UNITS/MM", "FEDRAT/MMPM,600"])
    result = good(convert(path, "head-table", "generic-iso", setup=setup))
    assert "pending" not in result.text.lower() and result.text.count("length may differ") == 60


def test_head_summary_and_figures_state_the_margin(tmp_path: Path) -> None:
    result = made("head, machine coordinates")
    (one,) = result.comparison.lengths
    assert f"({one.line()})" in result.text and one.line() in as_text(result, "part.ngc")
    assert 0.0 < one.shorter < 0.1 and f"by -{np.floor(one.shorter * 1000.0) / 1000.0:.3f} mm, then tolerance" in one.line()
    (figures,) = tools_of(result)
    assert figures["length_margin_mm"]["shorter"] == pytest.approx(one.shorter)
    assert figures["length_margin_mm"]["ends_longer"] == "tolerance"
