"""The read-back finds the same bound with cheap bounds before the closer ones, of programs as written and spoilt."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from machines.kinematics import chain_loop
from postproc.path import coarse_bound
from postproc.path.model import ARC
from postproc.pipeline.result import PostResult
from postproc.readback.comparison import compare as compare_module
from postproc.readback.comparison import deviation_bound as bound_module
from postproc.readback.execution.execute import Motion
from tests.postproc.kit import SAMPLES, convert, good, setup_of, toolpath

Bound = tuple[float, float, int, int]
ERRORS = str(SAMPLES / "errors/mikron-ucp710.toml")
SETUP = setup_of("[tools.1]\ngauge_length = 120.0\n[tools.2]\ngauge_length = 90.0\n[output]\nrapids_as_feed = true\n")
CASES = [("mikron-ucp710", "fanuc-30i", ""), ("mikron-ucp710", "linuxcnc", ERRORS), ("fork-head-ab", "haas-ngc", "")]


@cache
def program(name: str, controller: str, errors: str) -> PostResult:
    """A small wave whose axis turns with it, with two tools; its points are dense where it begins."""
    lines = list[str]()
    for number, y in ((1, 0.0), (2, 4.0)):
        x = np.concatenate((np.linspace(0.0, 2.0, 14), np.linspace(2.5, 20.0, 8)))
        lean = np.column_stack((0.2 + 0.05 * np.sin(0.3 * x), 0.1 * np.cos(0.2 * x), np.ones(len(x))))
        at = [f"GOTO/{a:.5f},{y},{np.sin(0.2 * a):.5f}," + ",".join(f"{v:.8f}" for v in i / np.linalg.norm(i))
              for a, i in zip(x, lean, strict=True)]
        lines += [f"LOADTL/{number}", "SPINDL/RPM,2000,CLW", "RAPID", *at[:1], "FEDRAT/MMPM,800", *at[1:]]
    path = toolpath(*lines, head=["UNITS/MM", "MULTAX/ON"])
    return good(convert(path, name, controller, setup=SETUP, output="axes", error_model=errors))


def bound(result: PostResult, motion: Motion) -> Bound:
    comparison, job = result.comparison, result.job
    assert comparison is not None and job is not None
    executed = comparison.poses
    executed.forget()
    rows = np.arange(len(motion))
    ends = executed.poses(motion, rows, 1.0)
    found = compare_module.bound_of_blocks(motion, executed, job.moves.without_pecks(), comparison.owner, (0.01, 1e-3),
                                           job.corrects, ends=ends)
    return found.tip, found.axis, found.tip_row, found.axis_row


def spoilt(motion: Motion) -> dict[str, Motion]:
    """The motion, and with one block or more wrong: its end, its turn, its kind, the tool in the spindle, its register."""
    cuts = np.flatnonzero((motion.code == 1) & np.isfinite(motion.end).all(axis=1))
    k = int(cuts[5])
    here = np.arange(len(motion)) == k
    after = np.arange(len(motion)) >= k
    end = motion.end.copy()
    end[k] += 0.02
    far = motion.end.copy()
    far[k, -1] += 1e-4
    return {"as written": motion, "end": replace(motion, end=end), "turned": replace(motion, end=far),
            "kind": replace(motion, code=np.where(here, 0, motion.code)),
            "tool": replace(motion, tool=np.where(after, 3 - motion.tool, motion.tool)),
            "register": replace(motion, register=np.where(here, 3 - motion.register, motion.register))}


@pytest.mark.parametrize("which", CASES, ids="-".join)
def test_the_bound_is_the_same_with_cheap_bounds_first(which: tuple[str, str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    result = program(*which)
    assert result.comparison is not None and result.comparison.executed is not None
    for module in (chain_loop, coarse_bound):
        monkeypatch.setattr(module, "compiled", lambda function: function)
    monkeypatch.setattr(chain_loop, "pays", lambda n: True)
    monkeypatch.setattr(coarse_bound, "FIRST", 2)
    found = dict[str, list[Bound]]()
    for many in (10**9, 1):
        monkeypatch.setattr(bound_module, "MANY", many)
        for what, motion in spoilt(result.comparison.executed[1]).items():
            found.setdefault(what, []).append(bound(result, motion))
    for what, (without, with_it) in found.items():
        assert with_it[:2] == pytest.approx(without[:2], rel=1e-9), what
    outside = {what for what, (without, _) in found.items() if without[0] > 0.01 or without[1] > 1e-3}
    assert {"end", *({"kind"} if which[1] != "linuxcnc" else ())} <= outside and "as written" not in outside


def test_nothing_cheap_is_said_of_what_is_not_straight_in_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a machine with errors, of dog-legs, arcs, and blocks that begin with another tool."""
    monkeypatch.setattr(bound_module, "MANY", 1)
    monkeypatch.setattr(bound_module, "coarse_bounds", lambda kin, curves, *rest: np.zeros((2, len(curves))))
    for case in CASES[:2]:
        result = program(*case)
        assert result.comparison is not None and result.comparison.executed is not None and result.job is not None
        executed, motion, moves = result.comparison.poses, result.comparison.executed[1], result.job.moves.without_pecks()
        rows = np.flatnonzero(moves.run_by(result.comparison.owner))
        k, at = rows[5], np.arange(len(motion))
        ends = bound_module._Ends(rows, result.comparison.owner[rows], np.zeros(len(rows)), np.ones(len(rows)))
        for wrong in ({}, {"code": np.where(at == k, 0, motion.code)}, {"code": np.where(at == k, ARC, motion.code)},
                      {"tool": np.where(at == k, 3 - motion.tool, motion.tool)},
                      {"register": np.where(at == k, 3 - motion.register, motion.register)}):
            given = replace(motion, **wrong)
            executed.forget()
            found = bound_module._coarse(given, executed, moves, ends, executed.poses(given, at, 1.0))
            assert np.isfinite(found[0, 2]) == (case[2] == "") and np.isinf(found[0, 5]) == (bool(wrong) or case[2] != "")
