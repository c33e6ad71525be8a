"""Between the ends of blocks: errors that change their course many times in one, and places that were not measured."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import postproc
import toolpaths
from machines.geometric_error import load
from postproc.base.options import Options
from postproc.correction.error_sampling import changes, looks_between
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.checks import check_speeds
from postproc.readback.comparison.compare import _taken_up
from postproc.readback.comparison.faults import Faults
from toolpaths.diagnostics import Severity

HEAD = "UNITS/MM\nLOADTL/1\nSPINDL/3000,RPM,CLW\nFEDRAT/400,MMPM\nRAPID\nGOTO/-160,0,20\nGOTO/-160,0,0\n"
LINE = HEAD + "GOTO/160,0,0\nFINI\n"
CIRCLE = HEAD.replace("-160,0", "0,-60") + "CIRCLE/0,0,0,0,0,1,60\nGOTO/0,60,0\nFINI\n"


def converted(folder: Path, cl: str, model: str, table: str = "", beyond: bool = False) -> PostResult:
    (folder / "m.toml").write_text('machine = "mill-3axis"\n' + model)
    (folder / "t.csv").write_text(table)
    path, found = toolpaths.read_bytes(cl)
    return postproc.convert(path, "mill-3axis", "linuxcnc", options=Options(error_model=str(folder / "m.toml"),
                            error_beyond=beyond), diagnostics=found)


def periodic(period: float) -> tuple[str, str]:
    """Model and table of a screw whose lead errs by 15 um, along and across."""
    x = period * np.arange(8) / 8.0
    rows = (f"{v:.6f}, {off:.6f}, {off:.6f}" for v, off in zip(x, 15.0 * np.sin(2.0 * np.pi * x / period), strict=True))
    one = f'table = "t.csv"\nrepeats = {period}\n'
    return f"[components.EXX]\n{one}[components.EYX]\n{one}", "\n".join(["X [mm], EXX [um], EYX [um]", *rows, ""])


def worst(result: PostResult, folder: Path) -> float:
    """mm that the tip is off by on the written blocks, looked at every tenth of a millimetre."""
    actual = load(folder / "m.toml", result.machine).on(result.machine.kinematics)
    assert result.path is not None
    q = result.path.q[np.flatnonzero(np.isfinite(result.path.u))]
    off = 0.0
    for one, two in pairwise(q):
        t = np.linspace(0.0, 1.0, 2 + int(10.0 * np.abs(two - one).max()))[:, None]
        tip = actual.aim(one + t * (two - one))[0]
        nominal = result.machine.kinematics.forward(np.round(q[:1]))[0]
        off = max(off, float(np.abs(tip[:, 1] - nominal[0, 1]).max()))
    return off


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("period", [2.0, 4.0, 5.0, 7.3])
def test_errors_with_a_period_are_corrected_along_a_long_line(period: float, tmp_path: Path) -> None:
    result = converted(tmp_path, LINE, *periodic(period))
    assert result.ok and result.compensation is not None, [str(d) for d in result.diagnostics]
    assert result.compensation.added > 2.0 * 320.0 / period
    assert worst(result, tmp_path) < 2e-3
    assert 0.018 < result.compensation.tip_before < 0.0213  # nought at ends where 320 mm are whole periods


def test_the_proof_looks_between_points_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.correction.points.looks_between", lambda count: iter(()))
    monkeypatch.setattr("postproc.correction.points.LOOKS", (0.25, 0.5, 0.75))  # whole periods, as those of any program
    result = converted(tmp_path, LINE, *periodic(4.0))
    assert not result.ok and "verify.tip" in {d.code for d in result.diagnostics}


def test_arcs_with_a_period_become_lines(tmp_path: Path) -> None:
    result = converted(tmp_path, CIRCLE, *periodic(3.0))
    assert result.ok and result.compensation is not None and result.compensation.resolved >= 1
    assert result.compensation.added > 50


TABLE = "X [mm], EXX [um]\n-200, 0\n0, 5\n30, 8\n"


def test_an_arc_that_leaves_what_was_measured_is_refused(tmp_path: Path) -> None:
    model = "[components.EXX]\ntable = \"t.csv\"\n[components.EYY]\npolynomial = [0.0, 0.1]\nrange = [-70, 20]\n"
    result = converted(tmp_path, CIRCLE, model, TABLE)
    noted = [d for d in result.diagnostics if d.code == "compensation.range" and d.severity == Severity.ERROR]
    assert not result.ok and result.text == ""
    assert [d.message.split()[0] for d in noted] == ["X", "Y"] and noted[0].message == (
        "X goes from 0 to 60 where its errors were not measured: they were from -200 to 30")
    allowed = converted(tmp_path, CIRCLE, model, TABLE, beyond=True)
    assert allowed.ok and sum(d.code == "compensation.range" and d.severity == Severity.WARNING
                              for d in allowed.diagnostics) == 2


def test_home_need_not_be_measured(tmp_path: Path) -> None:
    """Linking moves get the error at the end of the range; home is in the machine's own coordinates."""
    model = "[components.EZZ]\npolynomial = [2.0, 0.1]\nrange = [-20, {}]\n"
    result = converted(tmp_path, LINE, model.format(25))
    noted = [d for d in result.diagnostics if d.code == "compensation.range"]
    assert result.ok and [d.severity for d in noted] == [Severity.INFO] and "Z goes" in noted[0].message
    assert result.path is not None and result.nominal is not None
    links = np.flatnonzero(np.isnan(result.nominal.u) & ~result.nominal.home & (result.nominal.q[:, 2] > 25.0))
    assert len(links) and "linking moves" in noted[0].message
    assert not converted(tmp_path, LINE, model.format(15)).ok  # a cut of the CL file from 20 on
    assert converted(tmp_path, LINE.replace("GOTO/-160,0,0", "RAPID\nGOTO/-160,0,0"), model.format(15)).ok


def test_a_part_may_end_where_the_measurement_does(tmp_path: Path) -> None:
    path, found = toolpaths.read("samples/five_faces.cls")  # X to 10 on this machine, the last digit off
    for end, right in ((10.0, True), (9.9999, False)):
        (tmp_path / "m.toml").write_text('machine = "mikron-ucp710"\n[components.EXX]\npolynomial = [0.0, 5.0]\n'
                                         f"range = [-{end}, {end}]\n")
        result = postproc.convert(path, "mikron-ucp710", "linuxcnc", diagnostics=found,
                                  options=Options(setup="samples/tools.setup.toml", error_model=str(tmp_path / "m.toml")))
        assert result.ok == right, [str(d) for d in result.diagnostics]


def test_looks_cover_every_stretch() -> None:
    count = changes(np.array([[0.5, 100.0], [0.0, 3.0], [np.nan, 1.0]]), np.array([np.inf, 4.0]))
    np.testing.assert_array_equal(count, [25, 1, 1])
    rows, shares = (np.concatenate(x) for x in zip(*looks_between(count), strict=True))
    assert set(rows.tolist()) == {0} and set(np.floor(shares * 25.0).astype(int).tolist()) == set(range(25))


def test_a_tilted_plane_that_was_not_measured_is_refused(tmp_path: Path) -> None:
    model = 'machine = "mikron-ucp710"\n[components.EAA]\npolynomial = [0.0, 5.0]\nrange = [-1, 1]\n'
    (tmp_path / "m.toml").write_text(model)
    path, found = toolpaths.read("samples/five_faces.cls")
    result = postproc.convert(path, "mikron-ucp710", "siemens-840d", diagnostics=found,
                              options=Options(setup="samples/tools.setup.toml", error_model=str(tmp_path / "m.toml")))
    assert not result.ok and "compensation.range" in {d.code for d in result.diagnostics}


def test_a_part_out_of_travel_is_reported_before_it_is_corrected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.correction.compensation.compensate", lambda *args: pytest.fail("corrected"))
    path, found = toolpaths.read("samples/systems/upside_down.cls")
    result = postproc.convert(path, "mikron-ucp710", "fanuc-30i", diagnostics=found, options=Options(
        setup="samples/tools.setup.toml", error_model="samples/errors/mikron-ucp710.toml"))
    noted = [d for d in result.diagnostics if d.code == "travel.exceeded"]
    assert noted and len(noted) == len({d.message for d in noted}) and "system = " in noted[0].hint


def test_a_short_rapid_before_a_rapid_takes_up_lost_motion() -> None:
    """5 um each: before a long rapid, in a row of rapids, a cut; and 1 um of a cut."""
    tip = np.cumsum([[0.0], [10.0], [0.005], [20.0], [0.005], [0.005], [0.005], [10.0], [0.005], [20.0], [0.001]], axis=0)
    motion = SimpleNamespace(code=np.array([0, 1, 0, 0, 0, 0, 0, 1, 1, 0, 1]))
    job = SimpleNamespace(errors=True, options=Options(), rounding=SimpleNamespace(tip=1e-4))
    assert np.flatnonzero(_taken_up(job, motion, tip * np.ones(3) / np.sqrt(3.0))).tolist() == [2,
                                                                                                10]


@pytest.mark.parametrize(("feed_adjacent", "noted"), [(0.008, False), (0.001, True)])
def test_the_end_of_a_cut_may_pass_for_the_beginning_of_a_rapid(feed_adjacent: float, noted: bool) -> None:
    """A cut of 0.176 mm whose last 8 um stand within the tolerance of its end: the rapid that follows has them."""
    feed = 2500.0 / 60.0
    motion = SimpleNamespace(code=np.array([1, 1, 0]), line=np.arange(3))
    moves = type("Moves", (SimpleNamespace,), {"__len__": lambda self: 2})(
        kind=np.array([1, 0]), link=np.zeros(2, dtype=bool), seconds=np.full(2, np.nan), line=np.array([7, 8]),
        feed=np.array([feed, np.nan]), lengths=lambda: np.array([0.176, 25.0]), sweeps=lambda: np.zeros(2))
    found = check_speeds(motion, moves, np.array([0, 1, 1]), np.array([0, 2]),
                         np.array([0.168 / feed, feed_adjacent / feed, 0.1]), 0.01, Faults("a.apt"))
    assert [d.code for d in found] == (["verify.feed"] if noted else [])
