"""Hidden parameters found from noisy logs; bands that hold; files; logs that do not fit."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import estimate, timed, total
from postproc.cycle_time.model import CycleTimeModel, load_model
from postproc.time_fit.calibrate import CalibratedModel
from postproc.time_fit.fit_text import as_toml
from postproc.time_fit.log import RunLog, read_log
from postproc.time_fit.runs import seconds_of
from tests.postproc.time_kit import blocks, calibrated, machine, model
from toolpaths.diagnostics import DiagnosticError

CLOCK = 0.002
"""s, standard deviation of the time stamps"""


LINES = 160


@cache
def finishing(seed: int) -> MotionBlocks:
    """Waves cut in short lines, with long and short rapids between the passes."""
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(0.05, 1.2, LINES)) - 150.0
    y = 8.0 * np.sin(x / 9.0) + np.cumsum(rng.normal(0.0, 0.15, LINES))
    text = ["G21 G90 G94 G17", f"G0 X{x[0]:.3f} Y{y[0]:.3f} Z300", "F6000"]
    for i in range(LINES):
        if i % 30 == 29:
            text += ["G0 Z320", f"G0 X{x[i] - 250 * rng.random():.3f} Y{y[i] + rng.normal(0, 90):.3f}",
                     f"G0 X{x[i]:.3f} Y{y[i]:.3f}", "G0 Z300"]
        text.append(f"G1 X{x[i]:.4f} Y{y[i]:.4f} Z{300 - 2 * np.sin(x[i] / 4):.4f}")
    return blocks("\n".join(text), controller="generic-iso")


def hidden(rng: np.random.Generator) -> CycleTimeModel:
    values = {"corner_tolerance": 0.01 * np.exp(rng.normal(0, 0.7)), "block_time": 0.003 * np.exp(rng.normal(0, 0.5)),
              "rapid": np.exp(rng.normal(-0.3, 0.15)), "override": np.exp(rng.normal(0, 0.1)),
              "stop_time": 0.02 * np.exp(rng.normal(0, 0.6))}
    return model("lookahead").model_copy(update={name: float(v) for name, v in values.items()})


def log_of(b: MotionBlocks, truth: CycleTimeModel, rng: np.random.Generator) -> RunLog:
    line, first = np.unique(b.line, return_index=True)
    stamps = np.maximum.accumulate(timed(b, truth).begin[first] + rng.normal(0.0, CLOCK, len(first))) + 17.0
    return RunLog(line, stamps, np.full((len(line), 3), np.nan), np.arange(2, len(line) + 2))


def fit(truth: CycleTimeModel, rng: np.random.Generator) -> CalibratedModel:
    made, found = calibrated(finishing(0), log_of(finishing(0), truth, rng), model("lookahead"),
                            "log.csv", machine())
    assert made is not None and not found
    return made


@cache
def with_jerk(seed: int = 4) -> tuple[CycleTimeModel, CalibratedModel]:
    """A control with jerk limits, and the model that is fitted to its log."""
    rng = np.random.default_rng(seed)
    truth = hidden(rng)
    return truth, fit(truth, rng)


def test_hidden_parameters_are_found_and_bands_hold_on_other_programs() -> None:
    inside, off, narrower = [], [], []
    for k in (4, 8):
        truth, made = with_jerk(k)
        off.append([abs(np.log(made.values[name][0] / getattr(truth, name))) / made.values[name][1]
                    for name in ("corner_tolerance", "rapid", "override", "stop_time")])
        assert made.values["corner_tolerance"][0] == pytest.approx(truth.corner_tolerance, rel=0.1)
        value, sigma = made.values["override"]
        assert value == pytest.approx(truth.override, rel=max(0.04, 3.0 * sigma))
        for seed in (1, 2, 3):
            other = finishing(seed)
            e = estimate(other, machine(), made.model)
            inside.append(e.band[0] <= total(other, timed(other, truth)) <= e.band[1])
            wide = estimate(other, machine(), model("lookahead"))
            narrower.append((e.band[1] - e.band[0]) / (wide.band[1] - wide.band[0]))
    assert np.mean(inside) >= 0.95
    assert np.median(off) < 1.0
    assert max(narrower) < 0.5


def test_what_a_run_does_not_show_is_said() -> None:
    """No rapid in the run reaches its speed, no block is short: neither can be known."""
    b = blocks("G21 G90 G94 G17\nF900\n" + "\n".join(
        f"G1 X{20 * (i % 2)} Y{3 * i}\nG0 Z{300 + i % 2}" for i in range(1, 30)), controller="generic-iso")
    rng = np.random.default_rng(2)
    made, _ = calibrated(b, log_of(b, model("lookahead"), rng), model("lookahead"), "log.csv")
    assert made is not None and made.model.calibration is not None
    assert "rapid" in made.model.calibration.not_identifiable
    assert "override" not in made.model.calibration.not_identifiable


def test_a_control_without_jerk_is_recognised() -> None:
    rng = np.random.default_rng(3)
    truth = hidden(rng).model_copy(update={"jerk": False})
    assert not fit(truth, rng).model.jerk
    assert with_jerk()[1].model.jerk


def test_the_model_is_a_file(tmp_path: Path) -> None:
    made = with_jerk()[1].model
    (tmp_path / "shop.toml").write_text(as_toml(made))
    loaded, found = load_model(tmp_path / "shop.toml")
    assert not found and loaded == made


def test_logs_are_read_with_positions(tmp_path: Path) -> None:
    rows = "\n".join(f"{n},{0.1 * n},{n}.5,0" for n in range(1, 12))
    (tmp_path / "log.csv").write_text(f"nc_line,time_s,X,Z\n{rows}\n")
    log, found = read_log(tmp_path / "log.csv", ("X", "Y", "Z"))
    assert log is not None and not found
    assert log.line.tolist() == list(range(1, 12)) and log.time[3] == pytest.approx(0.4)
    assert log.position[2, 0] == 3.5 and np.isnan(log.position[2, 1])


GOOD = "".join(f"{n},{n}\n" for n in range(1, 12))


@pytest.mark.parametrize(("text", "code", "lines"), [
    ("time_s,X\n" + GOOD, "log.columns", (1,)),
    ("nc_line,time_s,X,X\n" + GOOD, "log.columns", (1,)),
    ("nc_line,time_s,Q\n" + GOOD, "log.columns", (1,)),
    ("", "log.columns", (1,)),
    ("nc_line,time_s\n" + GOOD + "12,ten\n13\n", "log.numbers", (13, 14)),
    ("nc_line,time_s\n" + GOOD + "12,inf\n", "log.numbers", (13,)),
    ("nc_line,time_s\n1,1\n2,2\n", "log.short", ()),
    ("nc_line,time_s\n" + GOOD + "12.5,12\n", "log.line", (13,)),
    ("nc_line,time_s\n" + GOOD + "12,3\n", "log.time", (13,)),
    ("nc_line,time_s\n" + GOOD + "1e30,12\n", "log.line", (13,)),
    ("nc_line,time_s\n" + GOOD + "12,1e300\n", "log.time", (2, 13)),
    ("nc_line,time_s\n" + "".join(f"{k},5\n" for k in range(1, 12)), "log.time", (2, 12)),
])
def test_bad_logs_are_reported(tmp_path: Path, text: str, code: str, lines: tuple[int, ...]) -> None:
    (tmp_path / "log.csv").write_text(text)
    log, found = read_log(tmp_path / "log.csv", ("X", "Y", "Z"))
    assert log is None and [d.code for d in found] == [code]
    assert found[0].lines == lines and found[0].hint and "Traceback" not in str(found[0])


def test_a_log_of_another_program_is_refused() -> None:
    line = np.arange(9000, 9020)
    log = RunLog(line, np.arange(20.0), np.full((20, 3), np.nan), line)
    made, found = calibrated(finishing(0), log, model("lookahead"), "log.csv")
    assert made is None and [d.code for d in found] == ["log.lines"]


def test_a_log_in_which_the_program_takes_no_time() -> None:
    b = finishing(0)
    line = np.append(np.unique(b.line)[:20], 10**6)
    log = RunLog(line, np.append(np.full(20, 3.0), 9.0), np.full((21, 3), np.nan), np.arange(2, 23))
    made, found = calibrated(b, log, model("lookahead"), "log.csv")
    assert made is None and [d.code for d in found] == ["log.time"]


def test_columns_in_any_order_and_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes(b"\xef\xbb\xbfX,time_s,nc_line\n" + b"".join(b"%d,%d.5,%d\n" % (9 * k, k, k)
                                                                                     for k in range(1, 12)))
    log, found = read_log(tmp_path / "log.csv", ("X", "Y"))
    assert log is not None and not found
    assert log.line[2] == 3 and log.time[2] == 3.5 and log.position[2, 0] == 27.0


@pytest.mark.parametrize("data", [
    ("nc_line,time_s\n" + GOOD).encode("utf-16"), ("nc_line,time_s\n" + GOOD).replace("\n", "\r").encode(),
    ("nc_line,time_s\n" + GOOD + "  \n\n").encode()])
def test_logs_of_other_editors_are_read(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "log.csv").write_bytes(data)
    log, found = read_log(tmp_path / "log.csv", ("X", "Y"))
    assert log is not None and not found and log.line.tolist() == list(range(1, 12))


def test_numbers_that_python_alone_would_read_are_none(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("nc_line,time_s\n" + GOOD + "12,1_2\n13,１３\n", encoding="utf-8")
    log, found = read_log(tmp_path / "log.csv", ("X", "Y"))
    assert log is None and found[0].code == "log.numbers" and found[0].lines == (13, 14)


@pytest.mark.parametrize(("text", "seconds"), [
    ("812.4", 812.4), ("0:13:32", 812.0), ("13:32", 812.0), (" 21 ", 21.0), ("1:00:00.5", 3600.5), ("13 min", None),
    ("21,5", None), ("0", None), ("-3", None), ("nan", None), ("00:61", None), ("1:2:3:4", None), (":21", None), ("", None),
    ("1_0", None), ("２１", None), ("1e400", None)])
def test_the_time_of_a_whole_run(text: str, seconds: float | None) -> None:
    assert seconds_of(text) == seconds


def test_a_log_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError, match=r"time\.open.*0:13:32"):
        read_log(tmp_path / "none.csv", ("X",))
