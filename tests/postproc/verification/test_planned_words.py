"""Planned feeds as they are written: words that do not carry the plan are refused, and plans beyond the limits."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import postproc.compile.compile
import postproc.planning.planned
from postproc.compile.feed import PlannedTimes, plan_feeds
from postproc.feedrate.limits import JointLimits
from postproc.pipeline.result import PostResult
from postproc.planning.planned import joint_limits
from tests.postproc.kit import SAMPLES, convert, few_sides, toolpath
from tests.postproc.planning.test_planned_feed import wave
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

SIX = ("linuxcnc", "generic-iso", "fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc")
ERRORS = str(SAMPLES / "errors" / "mikron-ucp710.toml")


@cache
def fast() -> Toolpath:
    """A wavy pass that acceleration and jerk slow down."""
    lines = wave(60)
    return toolpath("SPINDL/RPM,3000,CLW", "RAPID", lines[0], "FEDRAT/MMPM,9000", *lines[1:])


def refused(result: PostResult) -> set[str]:
    return {d.code for d in result.diagnostics if d.severity is Severity.ERROR}


def plant(monkeypatch: pytest.MonkeyPatch, change: Callable[[Floats], Floats]) -> None:
    """Feed words for other seconds than those of the plan."""
    def planted(*args: Any) -> Any:
        *others, planned, unit = args
        return plan_feeds(*others, planned and PlannedTimes(change(planned.needed), planned.merge), unit)

    monkeypatch.setattr(postproc.compile.compile, "plan_feeds", planted)


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["linuxcnc", "siemens-840d", "heidenhain-tnc640"])
@pytest.mark.parametrize("change", [lambda s: s / 1.01, lambda s: np.roll(s, 1), lambda s: 1.02 * s],
                         ids=["faster", "of the block before", "slower"])
def test_words_that_do_not_carry_the_plan_are_refused(controller: str, change: Callable[[Floats], Floats],
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    assert not refused(convert(fast(), "mikron-ucp710", controller, feed="planned"))
    plant(monkeypatch, change)
    assert refused(convert(fast(), "mikron-ucp710", controller, feed="planned")) == {"verify.planned"}


def test_the_hint_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    plant(monkeypatch, lambda s: s / 1.01)
    assert not refused(convert(fast(), "mikron-ucp710", "linuxcnc", feed="programmed"))


@pytest.mark.parametrize("order", ["velocity", "acceleration", "jerk"])
def test_plans_beyond_the_limits_of_the_machine_file_are_refused(order: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def more(limits: Any) -> JointLimits:
        own = joint_limits(limits)
        return JointLimits(**{name: getattr(own, name) * (1.3 if name == order else 1.0 if order == "jerk" else 1e6)
                              for name in ("velocity", "acceleration", "jerk")})

    monkeypatch.setattr(postproc.planning.planned, "joint_limits", more)
    result = convert(fast(), "mikron-ucp710", "linuxcnc", feed="planned")
    assert refused(result) == {"plan.limits"}
    assert refused(convert(fast(), "mikron-ucp710", "linuxcnc", feed="programmed")) == set()


@pytest.mark.covering
@pytest.mark.parametrize("options", [{}, {"smooth": True}, {"merge_feeds": 0.2}, {"feed_mode": "per-minute"}],
                         ids=["plain", "smooth", "merged", "per minute"])
@pytest.mark.parametrize("controller", SIX)
@pytest.mark.parametrize(("file", "name"), [("pocket.cls", "mikron-ucp710"), ("five_tilted.cls", "head-table"),
                                            ("blade.cls", "mikron-ucp710"), ("pocket.cls", "uranesx"),
                                            ("pocket.cls", "mill-3axis"), ("five_faces.cls", "fork-head-ab")])
def test_no_sample_is_refused_for_its_plan(file: str, name: str, controller: str, options: dict[str, Any]) -> None:
    short = few_sides(file, (1,) if file == "pocket.cls" else None, 26 if file == "pocket.cls" else 36)
    result = convert(short, name, controller, feed="planned", **options)
    assert refused(result) == set() and result.text


def test_corrected_programs_carry_their_plan() -> None:
    result = convert(few_sides("five_faces.cls", (1,)), "mikron-ucp710", "siemens-840d", feed="planned",
                     error_model=ERRORS)
    assert refused(result) == set() and result.text
