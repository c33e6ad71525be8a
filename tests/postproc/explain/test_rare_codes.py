"""Codes that nothing else in the suite is told: each has its example on its page from here."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from machines.analysis.certify import Wanted, certify
from machines.tolerances import report as influences
from postproc.alignment.readings import _columns
from postproc.batch.run import _same_version
from postproc.orientation.passes.parallel_map import PassFault
from postproc.orientation.plans import orient as orientation
from postproc.orientation.turning.turning_report import noted
from postproc.path.faults import moved_axes
from postproc.placement import place as placing
from postproc.planning import planned
from tests.postproc.cli.test_cli import run
from tests.postproc.kit import HEAD
from toolpaths.diagnostics import DiagnosticError

MILL = ["-m", "mikron-ucp710", "-c", "linuxcnc"]


def cut(folder: Path) -> Path:
    path = folder / "part.apt"
    path.write_text("\n".join([*HEAD, "GOTO/0,0,0", "GOTO/10,0,0", "FINI"]))
    return path


def test_a_program_without_motion(tmp_path: Path) -> None:
    (tmp_path / "empty.ngc").write_text("%\n(NOTHING YET)\nM2\n")
    got = run("verify", tmp_path / "empty.ngc", cut(tmp_path), *MILL)
    assert got.exit_code == 1 and "[verify.no_motion]" in got.stderr


def test_a_block_of_stock_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "shop.toml").write_text("[rewind]\nstock = { low = [0, 0, 0], high = [10, -1, 10] }\n")
    got = run("convert", cut(tmp_path), *MILL, "--setup", tmp_path / "shop.toml", "-o", tmp_path / "part.ngc")
    assert got.exit_code == 1 and "[setup.stock]" in got.stderr and not (tmp_path / "part.ngc").exists()


def test_a_machine_whose_workspace_is_not_proved() -> None:
    own = SimpleNamespace(name="own", file="own.toml", kinematics=SimpleNamespace(leg_geometry=None))
    with pytest.raises(DiagnosticError) as fault:
        certify(own, Wanted())
    assert [d.code for d in fault.value.diagnostics] == ["certificate.legs"]


def fails(*given: Any, **more: Any) -> Any:
    """A planner that finds nothing."""
    raise ArithmeticError("no speed keeps the limits")


def test_a_plan_that_is_not_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(planned, "plan_pass", fails)
    got = run("convert", cut(tmp_path), *MILL, "--feed", "planned", "-o", tmp_path / "part.ngc")
    assert got.exit_code == 1 and "[plan.failed]" in got.stderr and not (tmp_path / "part.ngc").exists()


def test_an_orientation_that_is_not_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def fault(*given: Any, **more: Any) -> Any:
        raise PassFault("no speed keeps the limits", 6)

    monkeypatch.setattr(orientation, "each_pass", fault)
    got = run("orient", cut(tmp_path), *MILL)
    assert got.exit_code == 1 and "[orient.plan]" in got.stderr


def test_places_that_are_not_timed_or_not_to_the_end(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "shop.toml").write_text("[placement]\nx = [0, 1]\ny = [0, 1]\nz = [0, 1]\nturns = [0]\n")
    words = ("place", cut(tmp_path), "-m", "mill-3axis", "-c", "linuxcnc", "--setup", tmp_path / "shop.toml")
    searched = placing._searched

    def open_(*given: Any, **more: Any) -> Any:
        timer, result = searched(*given, **more)
        timer.unsolved.add(6)
        return timer, result

    monkeypatch.setattr(placing, "_searched", open_)
    assert "[place.unsolved]" in run(*words, "-o", tmp_path / "o.toml").stderr
    monkeypatch.setattr(placing, "_searched", fails)
    got = run(*words, "-o", tmp_path / "o.toml")
    assert got.exit_code == 1 and "[place.plan]" in got.stderr


def test_a_machine_of_whose_errors_nothing_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(influences, "any_machine", lambda machine, tool: None)
    got = run("machine", "tolerance", "mikron-ucp710")
    assert got.exit_code == 1 and "[sensitivity.kind]" in got.stderr


def test_a_machine_that_no_probe_is_read_on() -> None:
    job = SimpleNamespace(machine=SimpleNamespace(name="rotary-delta", axis_names="ABC", rotary=(True,) * 3),
                          control=SimpleNamespace(xyz=np.full(3, -1)))
    [found] = _columns(SimpleNamespace(file="readings.csv"), job)
    assert found.code == "align.machine" and "rotary-delta" in found.message


def test_tool_axes_moved_within_their_tolerance() -> None:
    moves = SimpleNamespace(line=np.array([7, 8, 9]))
    [found] = moved_axes(moves, np.arange(3), np.array([0.0, 3e-4, 0.0]), "part.apt")
    assert (found.code, found.lines, found.count) == ("axis.moved", (8,), 1)
    assert moved_axes(moves, np.arange(3), np.zeros(3), "part.apt") == []


def test_a_worker_of_another_version() -> None:
    with pytest.raises(DiagnosticError) as fault:
        _same_version(SimpleNamespace(run=lambda asked: {"tcp://mill-2:40001": "0.0.1"}))
    assert [d.code for d in fault.value.diagnostics] == ["batch.version"]


def test_turning_cuts_where_no_normal_is_known() -> None:
    run_of = SimpleNamespace(contact=Contacts(), limits=SimpleNamespace(need_normals=True), line=np.array([11, 12]))
    choice = SimpleNamespace(work=SimpleNamespace(toolpath=SimpleNamespace(file="part.apt")), passed=[],
                             runs=[SimpleNamespace(turned=True, run=run_of)])
    [found] = noted(choice)
    assert found.code == "orient.no_normal" and "3 of 10 places" in found.message and found.lines == (12,)


class Contacts:
    """Where a ball touches: at seven places, at three more it is not known."""

    unknown = 3

    def __len__(self) -> int:
        return 7
