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
from postproc.verification.read_back import read_back
from tests.postproc.kit import SAMPLES, convert, good, setup_of
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
    tools = {n: t.model_copy(update={"gauge_length": t.length + (other if n == str(number) else 0.0)})
             for n, t in result.asked.tools.items()} if result.asked else {}
    job, found = prepare(result.toolpath, result.machine, result.controller,
                         result.setup.model_copy(update={"tools": tools}), result.options)
    assert job is not None, found
    _, faults = read_back(result.text, replace(job, errors=result.job.errors), "part.cls")
    return [d.code for d in faults if d.severity == 2]


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_verifies_with_lengths_inside_its_margins_and_not_outside(name: str) -> None:
    """Outside: as far as it may be where what linearising leaves points the other way."""
    result = made(name)
    comparison, tolerance = result.comparison, result.options.tolerance
    other_way = (tolerance + comparison.tip_bound) / (tolerance - comparison.tip_bound)
    codes = {"tolerance": "verify.tip", "axis tolerance": "verify.axis"}
    judged = 0
    for one in comparison.lengths:
        for sign, margin, what in ((-1.0, one.shorter, one.ends_shorter), (1.0, one.longer, one.ends_longer)):
            inside = min(0.98 * margin, 20.0)
            assert faults_with(result, one.number, sign * inside) == [], (one, sign)
            if what != "clearance" and margin < 50.0:
                far = margin * (other_way if what == "tolerance" else 1.0) * 1.05
                assert codes.get(what, "verify.travel") in faults_with(result, one.number, sign * far), (one, sign)
                judged += 1
    assert judged


def test_a_register_takes_up_the_length_where_only_the_table_turns() -> None:
    """Nothing is stated, and nothing fails."""
    path, _ = read(GOLDEN / "short_five_axis.apt")
    result = good(convert(path, "mikron-ucp710", "linuxcnc", setup=setup_of((SAMPLES / "tools.setup.toml").read_text())))
    assert result.comparison.lengths == () and "length may differ" not in result.text
    assert faults_with(result, 1, 3.0) == []


def test_head_summary_and_figures_state_the_margin(tmp_path: Path) -> None:
    result = made("head, machine coordinates")
    (one,) = result.comparison.lengths
    assert f"({one.line()})" in result.text and one.line() in as_text(result, "part.ngc")
    assert 0.0 < one.shorter < 0.1 and f"by -{np.floor(one.shorter * 1000.0) / 1000.0:.3f} mm, then tolerance" in one.line()
    (figures,) = tools_of(result)
    assert figures["length_margin_mm"]["shorter"] == pytest.approx(one.shorter)
    assert figures["length_margin_mm"]["ends_longer"] == "tolerance"
