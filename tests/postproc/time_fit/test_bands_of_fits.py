"""Bands of fitted models: kinds of motion that no run holds, polled logs, totals, several runs, spindles, worse fits."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import estimate, timed, total
from postproc.cycle_time.kinds import NOT_SEEN, own_share
from postproc.cycle_time.model import CycleTimeModel
from postproc.time_fit.calibrate import CalibratedModel, _findings, calibrate
from postproc.time_fit.fit_text import as_text
from postproc.time_fit.log import RunLog, period, read_log
from postproc.time_fit.runs import run_of_log, run_of_total
from tests.postproc.time_kit import blocks, machine, model

TRUTH = {"corner_tolerance": 0.006, "stated_share": 0.6, "override": 0.96, "rapid": 0.8, "acceleration_share": 0.8}


@cache
def program(seed: int = 0, start: str = "") -> MotionBlocks:
    """A zigzag with rapids between its rows, 10 to 30 s."""
    rng = np.random.default_rng(seed)
    text = ["G21 G90 G94 G17", start, "G0 X0 Y0 Z300", "F3000"]
    for k in range(40):
        text.append(f"G1 X{(k % 2) * rng.uniform(10, 40):.3f} Y{k * 0.8:.3f}")
        if k % 6 == 5:
            text += ["G0 Z310", f"G0 X{rng.uniform(-90, 90):.2f}", "G0 Z300"]
    return blocks("\n".join(text), controller="generic-iso")


@cache
def arcs() -> MotionBlocks:
    """Half circles, which the zigzag has not."""
    text = ["G21 G90 G94 G17", "G0 X0 Y0 Z300", "F9000"]
    text += [f"G2 X{4 * (k + 1)} Y0 I2 J0\nG3 X{4 * (k + 2)} Y0 I2 J0" for k in range(0, 40, 2)]
    return blocks("\n".join(text), controller="generic-iso")


def truth(**changes: float) -> CycleTimeModel:
    return model("lookahead").model_copy(update=TRUTH | changes)


def log_of(b: MotionBlocks, control: CycleTimeModel, noise: float = 1e-3) -> RunLog:
    line, first = np.unique(b.line, return_index=True)
    stamps = timed(b, control).begin[first] + np.random.default_rng(1).normal(0.0, noise, len(first))
    return RunLog(line, np.maximum.accumulate(stamps), np.full((len(line), 3), np.nan), line)


def polled(b: MotionBlocks, control: CycleTimeModel, every: float) -> RunLog:
    """What a client sees that asks for the line at each multiple of `every`."""
    times = timed(b, control)
    at = np.arange(0.37 * every, times.end[-1], every)
    line = b.line[np.clip(np.searchsorted(times.begin, at, side="right") - 1, 0, len(b) - 1)]
    return RunLog(line, at, np.full((len(at), 3), np.nan), np.arange(2, len(at) + 2))


def fitted(*logs: tuple[MotionBlocks, RunLog]) -> CalibratedModel:
    runs = []
    for b, log in logs:
        run, found = run_of_log(b, log)
        assert run is not None and not found
        runs.append(run)
    made, found = calibrate(runs, model("lookahead"), "log.csv", machine())
    assert made is not None, found
    return made


@cache
def of_zigzag() -> CalibratedModel:
    return fitted((program(), log_of(program(), truth())))


def test_a_kind_of_motion_that_no_run_holds_widens_the_band() -> None:
    made = of_zigzag().model
    shares = [own_share(b, timed(b, made), made, total(b, timed(b, made))) for b in (program(1), arcs())]
    assert shares[1] > 0.5 * NOT_SEEN["arcs"] > 2.0 * shares[0]


def test_a_control_of_another_kind_stays_inside_the_band() -> None:
    """Without jerk, with other corners and a slower block than the control of the fit can be."""
    b = program()
    other = model("linuxcnc").model_copy(update={"rapid": 0.8, "override": 0.96, "acceleration_share": 0.8})
    made = fitted((b, log_of(b, other)))
    for one in (program(1), program(2), arcs()):
        e = estimate(one, machine(), made.model)
        assert e.band[0] <= total(one, timed(one, other)) <= e.band[1]


def test_a_polled_log_is_recognised_and_not_fitted_short() -> None:
    b, control = program(), truth()
    log = polled(b, control, 0.1)
    assert period(log, np.unique(b.line)) == pytest.approx(0.1, rel=1e-6)
    assert period(log_of(b, control), np.unique(b.line)) == 0.0
    made = fitted((b, log))
    whole = total(program(1), timed(program(1), control))
    e = estimate(program(1), machine(), made.model)
    assert e.seconds == pytest.approx(whole, rel=0.02) and e.band[0] <= whole <= e.band[1]
    assert made.calibration.period == pytest.approx(0.1, rel=1e-6)


def test_even_blocks_logged_at_each_change_are_not_taken_for_polling() -> None:
    line = np.arange(5, 40)
    assert period(RunLog(line, 0.5 * line, np.zeros((35, 3)), line), line) == 0.0


def test_a_total_alone_moves_the_model_and_keeps_the_doubt() -> None:
    b, control = program(), truth()
    whole = total(b, timed(b, control))
    made, found = calibrate([run_of_total(b, whole)], model("lookahead"), "", machine())
    assert made is not None and not found
    before = total(b, timed(b, model("lookahead")))
    assert abs(total(b, timed(b, made.model)) - whole) < 0.5 * abs(before - whole)
    assert {"corner_tolerance", "block_time", "stop_time"} <= set(made.calibration.not_identifiable)


def test_several_runs_are_fitted_together() -> None:
    control = truth()
    made = fitted((program(), log_of(program(), control)), (arcs(), log_of(arcs(), control)))
    assert made.calibration.kinds.keys() >= {"arcs", "rapids"}
    assert made.calibration.structure["arcs"] < 0.3 * NOT_SEEN["arcs"]
    assert of_zigzag().calibration.structure["arcs"] == NOT_SEEN["arcs"]


def test_twelve_lines_with_a_quick_spindle_are_the_spindle_and_no_large_corner() -> None:
    """1.5 s are assumed for the spindle, which takes 0.1 s: the fit finds that, not a tolerance of some mm."""
    b = program(3, "S3000 M3\nG4 P0")
    few = np.unique(b.line)[:14]
    log = log_of(b, truth(spindle_time=0.1, corner_tolerance=0.01, stated_share=1.0))
    keep = np.isin(log.line, few)
    run, found = run_of_log(b, RunLog(log.line[keep], log.time[keep], log.position[keep], log.row[keep]))
    assert run is not None and not found
    made, found = calibrate([run, run_of_total(b, total(b, timed(b, truth(spindle_time=0.1))))], model("lookahead"), "",
                                 machine())
    assert made is not None
    assert made.values["spindle_time"][0] < 0.5
    assert 0.002 < made.values["corner_tolerance"][0] < 0.05


@pytest.mark.parametrize(("sections", "total", "refused"), [
    (1.0, 1.0, False), (1.1, 1.0, True), (1.0, 1.1, True), (0.5, 0.9, False)])
def test_a_fit_that_is_worse_is_refused(sections: float, total: float, refused: bool) -> None:
    """The fit of the zigzag again, `sections` (rms) and `total` times as far off as the model before."""
    made = of_zigzag()
    record = made.calibration.model_copy(update={"rms_before": 0.1, "rms_after": 0.1 * sections, "relative": 0.02})
    worse = replace(made, calibration=record, modelled=made.measured * (1.0 + 0.02 * total))
    found = _findings(worse, made.measured * 1.02, 0.001, "log.csv")
    assert [d.code for d in found] == ["log.fit"] * refused and all("farther off" in d.message for d in found)


def test_a_run_that_no_values_explain_is_refused() -> None:
    made, found = calibrate([run_of_total(arcs(), 100.0 * total(arcs(), timed(arcs(), truth())))], model("lookahead"))
    assert made is None and [d.code for d in found] == ["log.fit"] and "no values of the model" in found[0].message
    assert found[0].hint and "s measured" in found[0].message


def test_assumed_accelerations_count_until_the_run_shows_them() -> None:
    """The run moves X and Y; Z's acceleration stays in the band of a program that moves Z alone."""
    made = of_zigzag().model
    assert made.calibration is not None
    blind = made.model_copy(update={"calibration": made.calibration.model_copy(update={"axes": ("X", "Y")})})
    up = "\n".join(f"G1 Z{300 + 40 * (k % 2)}" for k in range(1, 20))
    b = blocks(f"G21 G90 G94 G17\nF20000\n{up}", controller="generic-iso")
    assert "acceleration" in estimate(b, machine(), blind).assumed
    known = replace(machine(), limits=replace(machine().limits, assumed=frozenset()))
    assert "acceleration" not in estimate(b, known, blind).assumed


def test_the_text_shows_the_fit() -> None:
    text = as_text(of_zigzag())
    assert "corner_tolerance" in text and "model before" in text and "turning axes" in text


EXPORTS = {
    "mtconnect": ("timestamp,dataItemId,value\n" + "".join(
        f"2026-05-04T10:23:{k:02d}.500Z,ln1.LineNumber,{k + 3}\n2026-05-04T10:23:{k:02d}.600Z,Xact,{k}.5\n"
        for k in range(12))
        + "2026-05-04T10:24:00Z,ln1.LineNumber,UNAVAILABLE\n"),
    "types": "timestamp,type,value\n" + "".join(f"{k}.5,LINE_NUMBER,{k + 3}\n{k}.6,EXECUTION,ACTIVE\n" for k in range(12)),
    "opcua": "SourceTimestamp,NodeId,Value,StatusCode\n" + "".join(
        f"2026-05-04T10:23:{k:02d}.500Z,ns=2;s=Channel1.ActProgramLine,{k + 3},Good\n" for k in range(12))
        + '2026-05-04T10:24:30Z,ns=2;s=Channel1.ActProgramLine,99,BadNoCommunication\n'}


@pytest.mark.parametrize("name", EXPORTS)
def test_exports_are_read(tmp_path: Path, name: str) -> None:
    (tmp_path / "log.csv").write_text(EXPORTS[name])
    log, found = read_log(tmp_path / "log.csv", ("X", "Y"))
    assert log is not None and not found
    assert log.line.tolist() == list(range(3, 15)) and log.time.tolist() == pytest.approx([float(k) for k in range(12)])


@pytest.fixture
def berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Where the clock is put forward in the night to 2026-03-29."""
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("berlin")
def test_dates_without_a_zone_are_utc_and_nothing_is_spelled_in_any_case(tmp_path: Path) -> None:
    rows = "".join(f"2026-03-29T0{1 + k // 4}:{15 * (k % 4):02d}:00{'Z' if k % 2 else ''},line,{k + 3}\n" for k in range(12))
    (tmp_path / "log.csv").write_text("timestamp,dataItemId,value\n" + rows + "2026-03-29T05:00:00Z,line, unavailable\n")
    log, found = read_log(tmp_path / "log.csv", ("X", "Y"))
    assert log is not None and not found and np.diff(log.time).tolist() == [900.0] * 11


@pytest.mark.parametrize(("change", "code"), [
    (("ln1.LineNumber", "ln1.Block"), "log.columns"), (("Xact", "other.Line"), "log.columns"),
    (("2026-05-04T10:23:05.500Z", "yesterday"), "log.numbers"),
    (("05.500Z,ln1.LineNumber,8", "05.500Z,ln1.LineNumber,N8"), "log.numbers"),
    (("07.500Z,ln1.LineNumber,10", "07.500Z,ln1.LineNumber"), "log.numbers"),
    (("10:23:07.500Z", "10:22:07.500Z"), "log.time")])
def test_bad_exports_are_reported(tmp_path: Path, change: tuple[str, str], code: str) -> None:
    assert change[0] in EXPORTS["mtconnect"]
    (tmp_path / "log.csv").write_text(EXPORTS["mtconnect"].replace(*change))
    log, found = read_log(tmp_path / "log.csv", ("X", "Y"))
    assert log is None and [d.code for d in found] == [code] and found[0].hint and found[0].lines
