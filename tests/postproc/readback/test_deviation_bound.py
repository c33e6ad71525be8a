"""The printed deviation is a bound: no place of any block is farther off, and it is not much above the worst."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from machines.geometric_error.actual.actual_rods import ActualDelta
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.serial import Serial
from postproc.readback.comparison import compare as compare_module
from postproc.readback.comparison import deviation_bound as bound_module
from postproc.readback.execution import actual as actual_module
from postproc.verification.executed import executed_poses
from postproc.verification.proof_text import statement
from tests.postproc.kit import SAMPLES, codes, convert, good, goto, setup_of, toolpath
from toolpaths import read
from toolpaths.diagnostics import Severity

GOLDEN = Path(__file__).parents[2] / "golden"
PROGRAMS = [("short_five_axis.apt", "mikron-ucp710", "linuxcnc"), ("short_five_axis.apt", "mikron-ucp710", "fanuc-30i"),
            ("short_five_axis.apt", "head-table", "generic-iso"), ("pocket.cls", "mill-3axis", "heidenhain-tnc640"),
            ("pocket.cls", "delta-star", "generic-iso"), ("five_tilted.cls", "nutating-head", "linuxcnc"),
            ("short_five_axis.apt", "trunnion-bc", "siemens-840d"), ("three_laws.cls", "mikron-ucp710", "siemens-840d"),
            ("three_laws.cls", "trunnion-bc", "haas-ngc"), ("short_five_axis.apt", "fork-head-ab", "linuxcnc")]
DENSE = 40
"""places in every block"""


@cache
def path_of(file: str):
    path, _ = read((SAMPLES if (SAMPLES / file).exists() else GOLDEN) / file)
    return path


@cache
def program(file: str, name: str, controller: str):
    return convert(path_of(file), name, controller)


ERRORS = [("pocket.cls", "mikron-ucp710", "fanuc-30i"), ("short_five_axis.apt", "mikron-ucp710", "siemens-840d"),
          ("short_five_axis.apt", "linuxcnc-xyzac-trt", "linuxcnc")]
"""corrected: lost motion and arcs, by the tip, words that are the tip"""
NEAR = [2.0**-k for k in range(6, 20)]
"""places in a block that begins with an axis turning back"""


@cache
def corrected(file: str, name: str, controller: str):
    return convert(path_of(file), name, controller, error_model=str(SAMPLES / f"errors/{name}.toml"))


def dense(result, more: tuple[float, ...] = ()) -> tuple[float, float]:
    """The worst (tip, axis) at many places of all blocks but dog-legs from hole to hole, from the nearest points."""
    comparison, job = result.comparison, result.job
    _, motion = comparison.executed
    executed, moves = executed_poses(job, motion, job.register_lengths()), job.moves.without_pecks()
    owner = comparison.owner
    rows = np.flatnonzero((owner < len(moves)) & ~moves.link[np.minimum(owner, len(moves) - 1)])
    rows = rows[~((moves.phase[owner[rows]] == compare_module.Phase.POSITION) & executed.bent(motion, rows))]
    begin, share = compare_module.place_on_moves(motion, executed, rows, owner, moves)
    curves, worst = moves.curves(owner[rows]), np.zeros(2)
    for t in (*np.linspace(0.0, 1.0, DENSE + 1).tolist(), *more):
        tip, axis = executed.poses(motion, rows, t)
        off = curves.deviation(tip, axis, np.minimum(begin + t * share, 1.0))
        worst = np.maximum(worst, [off[0].max(), off[1].max()])
    return float(worst[0]), float(worst[1])


ARITHMETIC = 1e-12
"""mm: what two ways to one place may differ by"""


@pytest.mark.covering(count=5)
@pytest.mark.parametrize("which", PROGRAMS, ids="-".join)
def test_no_place_of_a_block_is_farther_off_than_the_bound_and_the_bound_is_near(which):
    result = good(program(*which))
    comparison = result.comparison
    tip, axis = dense(result)
    assert comparison.unbounded == 0
    assert tip - ARITHMETIC <= comparison.tip_bound <= max(1.02 * tip, 1e-6)
    assert axis <= comparison.axis_bound <= max(1.02 * axis, 1e-7)
    assert comparison.worst_tip <= comparison.tip_bound and comparison.worst_axis <= comparison.axis_bound


@pytest.mark.parametrize("which", ERRORS, ids="-".join)
def test_the_machine_with_its_errors_is_bounded(which):
    """Tables, lost motion and all; where an axis turns back the worst lies within some hundredths of a mm of its path."""
    result = good(corrected(*which))
    comparison = result.comparison
    tip, axis = dense(result, tuple(NEAR))
    assert comparison.unbounded == 0 and comparison.bounded_cuts == comparison.cuts > 0
    assert tip <= comparison.tip_bound <= max(1.12 * tip, 1e-6)
    assert axis <= comparison.axis_bound <= max(1.05 * axis, 1e-7)


def test_places_looked_at_together_are_those_looked_at_few_at_a_time(monkeypatch):
    together = good(corrected(*ERRORS[1])).comparison
    monkeypatch.setattr(actual_module, "AT_ONCE", 150)
    apart = good(corrected.__wrapped__(*ERRORS[1])).comparison
    assert (together.tip_bound, together.axis_bound) == pytest.approx((apart.tip_bound, apart.axis_bound), rel=1e-12)
    assert (together.worst_tip, together.worst_axis) == pytest.approx((apart.worst_tip, apart.worst_axis), rel=1e-12)


@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640", "fanuc-30i"])
def test_other_pivots_of_the_control_are_bounded(controller):
    """Within what is allowed of them (a tenth of the tolerance) they are part of the bound."""
    text = (SAMPLES / "tools.setup.toml").read_text()
    for letter, point in (("A", "[0.0, 0.0007, -0.0006]"), ("C", "[0.0005, 0.0, 0.0]")):
        text += f"\n[control_pivots.{letter}]\npoint = {point}\n"
    result = good(convert(path_of("short_five_axis.apt"), "mikron-ucp710", controller, setup=setup_of(text), output="tcp"))
    plain = good(convert(path_of("short_five_axis.apt"), "mikron-ucp710", controller, output="tcp"))
    tip, axis = dense(result)
    assert result.comparison.unbounded == 0 and tip <= result.comparison.tip_bound <= 1.05 * tip
    assert axis <= result.comparison.axis_bound and result.comparison.tip_bound > 1.05 * plain.comparison.tip_bound


def test_other_pivots_of_the_control_and_errors_are_bounded_together():
    text = (SAMPLES / "tools.setup.toml").read_text() + "\n[control_pivots.A]\npoint = [0.0, 0.0007, -0.0006]\n"
    given = {"setup": setup_of(text), "error_model": str(SAMPLES / "errors/mikron-ucp710.toml"), "output": "tcp"}
    result = good(convert(path_of("short_five_axis.apt"), "mikron-ucp710", "siemens-840d", **given))
    tip, axis = dense(result)
    assert result.comparison.unbounded == 0 and tip <= result.comparison.tip_bound <= 1.12 * tip
    assert axis <= result.comparison.axis_bound


def test_errors_that_no_bound_is_known_for_are_checked_not_proved(monkeypatch):
    """The machine's own poses are looked at, and the text says so."""
    monkeypatch.setattr(ActualDelta, "error_rates", lambda self, q, reach: None)
    setup = setup_of((SAMPLES / "delta.setup.toml").read_text())
    model = str(SAMPLES / "errors/uranesx.toml")
    result = good(convert(path_of("inch_plate.apt"), "uranesx", "linuxcnc", setup=setup, error_model=model))
    assert result.comparison.unbounded > 5 and result.comparison.bounded_cuts < result.comparison.cuts
    assert "(checked, not proved: " in result.text
    assert "checked, not proved" in statement(result.comparison, result.witness)


@cache
def coarse():
    """Moves that turn the tool far, at a tolerance so wide that their blocks stray unevenly."""
    tip = np.array([[0.0, 0.0, 0.0], [60.0, 10.0, 5.0], [90.0, 60.0, 0.0], [30.0, 80.0, 10.0], [0.0, 30.0, 0.0]])
    axis = np.array([[0.1, 0.0, 1.0], [0.9, 0.3, 0.6], [-0.2, 0.8, 0.7], [0.5, -0.7, 0.5], [-0.6, -0.1, 0.8]])
    return toolpath(*goto(tip, axis / np.linalg.norm(axis, axis=1, keepdims=True)))


@pytest.mark.parametrize("tolerance", [0.3, 3.0])
def test_blocks_that_stray_unevenly_are_bounded(tolerance):
    result = good(convert(coarse(), "mikron-ucp710", tolerance=tolerance, axis_tolerance=9.0))
    tip, axis = dense(result)
    assert tip <= result.comparison.tip_bound <= 1.02 * tip and axis <= result.comparison.axis_bound <= 1.02 * axis


def test_blocks_that_may_be_off_between_the_places_looked_at_are_an_error(monkeypatch):
    """A program is refused for its bound alone, with the lines of the block that it belongs to."""
    monkeypatch.setattr(bound_module, "HALVINGS", 0)
    monkeypatch.setattr(bound_module, "_bend", lambda jet: 1.0)
    result = convert(path_of("short_five_axis.apt"), "mikron-ucp710")
    assert {d.code for d in result.diagnostics if d.severity is Severity.ERROR} == {"verify.tip", "verify.axis"}
    assert "may be off" in " ".join(d.message for d in result.diagnostics) and not result.ok


@pytest.mark.parametrize(("file", "name", "kind"), [("short_five_axis.apt", "mikron-ucp710", Serial),
                                                    ("pocket.cls", "delta-star", OnLegs)])
def test_a_kinematics_without_bounds_is_checked_not_proved(monkeypatch, file, name, kind):
    monkeypatch.setattr(kind, "jets_proved", False)
    result = good(convert(path_of(file), name, "linuxcnc" if kind is Serial else "generic-iso"))
    assert result.comparison.unbounded > 10
    refused = convert(path_of(file), name, "linuxcnc" if kind is Serial else "generic-iso", require_proof=True)
    assert "verify.no_bound" in codes(refused.diagnostics) and not refused.text


def test_another_assembly_mode_than_that_of_the_bound_is_not_called_bounded(monkeypatch):
    """The law's middle and the reader's pose must be one: else the bend is of another motion."""
    given = OnLegs.jets
    monkeypatch.setattr(OnLegs, "jets", lambda kin, q0, q1: tuple(
        replace(jet, value=[x + 1e-4 for x in jet.value]) for jet in given(kin, q0, q1)))
    assert good(convert(path_of("pocket.cls"), "delta-star", "generic-iso")).comparison.unbounded > 10


@pytest.mark.parametrize("turns", [1, 3])
def test_helices_and_full_circles_are_bounded_as_arcs(turns):
    """A circle of 40 mm of radius in one block: its bend alone would be 1,500 mm."""
    path = toolpath("RAPID", "GOTO/40,0,2", "GOTO/40,0,0", f"MOVARC/0,0,0,0,0,1,40,ANGLE,{360 * turns}",
                    f"GOTO/40,0,{-2.0 * turns}")
    result = good(convert(path, "mill-3axis"))
    assert result.comparison.unbounded == 0 and result.comparison.tip_bound < 2e-3
    tip, _ = dense(result)
    assert tip <= result.comparison.tip_bound
