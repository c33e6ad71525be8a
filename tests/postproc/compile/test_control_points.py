"""Splines of the CL file by control points (BSPLINE on SINUMERIK), and as fewer cubics than the file has pieces."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import BSpline, make_interp_spline

import postproc
from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.compile.test_cubic_blocks import BLOCK, CUT, FILE, HEAD, SETUP, codes, converted, shop
from tests.postproc.reader_kit import SIEMENS, TNC, faults, good, words
from toolpaths.arrays import Floats
from toolpaths.cl.read import read_bytes
from toolpaths.cl.spline_chords import knots_of, part_behind
from toolpaths.cl.uniform_splines import equal_knots, uniform_spline

POINTS = 'splines = "bspline"'
_ROW = re.compile(r"^N\d+ (?:BSPLINE )?(X\S+ Y\S+ Z\S+|X\S+ Y\S+) PL=1(?: F\S+)?$", re.M)
T = np.linspace(0.0, 1.0, 61)
WAVES = np.stack([10.0 + 60.0 * T, 15.0 * np.sin(6.0 * T), -3.0 - 2.0 * T * T], axis=1)


def curve_of(points: Floats) -> BSpline:
    """The cubic through points, as a CAM system makes it."""
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return make_interp_spline(length / length[-1], points, 3)


def record(curve: BSpline) -> str:
    return ("NURBS/\nKNOT/" + ",".join(f"{k:.9f}" for k in curve.t[4:-3]) + "\n"
            + "".join(f"CNTRL/{x:.6f},{y:.6f},{z:.6f}\n" for x, y, z in curve.c[1:]))


DENSE = HEAD + CUT.format(axis="0,0,1") + record(curve_of(WAVES)) + "RAPID\nGOTO/70,0,50\nEND-OF-PATH\n"


@cache
def made(option: str = POINTS, text: str = DENSE, tolerance: float = 0.01, controller: str = SIEMENS,
         base: str = "mill-3axis") -> PostResult:
    read = read_bytes(text, tolerance=tolerance)
    return postproc.convert(read.toolpath, shop(option, base), controller, SETUP, diagnostics=read.diagnostics)


def polygon(text: str) -> Floats:
    """(n, 3) what the blocks state."""
    rows = [{w[0]: float(w[1:]) for w in m[1].split()} for m in _ROW.finditer(text)]
    return np.array([[row["X"], row["Y"], row["Z"]] for row in rows])


def off(points: Floats, chain: Floats) -> float:
    """mm that points are off the lines between those of a chain at most."""
    along = np.diff(chain, axis=0)
    share = np.clip(((points[:, None] - chain[:-1]) * along).sum(axis=2) / (along * along).sum(axis=1), 0.0, 1.0)
    return float(np.linalg.norm(points[:, None] - chain[:-1] - share[:, :, None] * along, axis=2).min(axis=1).max())


def test_the_blocks_are_a_spline_near_that_of_the_file() -> None:
    """By scipy: a clamped cubic with equal knots through the points that the text states, both ways within the tolerance."""
    program = made()
    assert program.ok and program.witness is not None and not program.witness.not_compared
    assert {c.what: c.count for c in program.witness.compared}["curves"] == 1
    curve = curve_of(np.stack([-WAVES[:, 1], WAVES[:, 0], WAVES[:, 2]], axis=1))  # by the x axis of MSYS
    stated = np.concatenate([curve.c[:1], polygon(program.text)])
    said = BSpline(knots_of(equal_knots(len(stated) - 3)), stated, 3)
    u = np.linspace(0.0, 1.0, 500)
    assert 1e-5 < off(said(u), curve(u)) < 0.0035 and off(curve(u), said(u)) < 0.0035
    plain, poly = made(""), made("splines = true")
    assert poly.ok and len(polygon(program.text)) < 0.7 * sum(line.count("X") > 0 for line in plain.text.splitlines())
    assert "needs BSPLINE to begin" in program.text and len(program.text) < 0.6 * len(poly.text)


def test_pieces_are_fewer_where_the_tolerance_allows() -> None:
    """POLY and SPL are exact piece by piece, or of fewer pieces than the file has."""
    for controller in (SIEMENS, TNC):
        fewer = made("splines = true", controller=controller)
        assert fewer.ok and 4 < len(BLOCK[controller].findall(fewer.text)) < 0.6 * (len(T) - 3)


def test_what_is_exact_stays_so_on_five_axes() -> None:
    """Knots at tenths of its parameter: the same curve has ten pieces with equal knots."""
    program = converted(SIEMENS, POINTS, "mikron-ucp710")
    assert program.ok and len(_ROW.findall(program.text)) == 12
    assert codes(program, program.text) == set()
    assert program.job is not None
    for option in ("", "splines = false", "splines = true"):
        other = replace(program.job, machine=shop(option, "mikron-ucp710"))
        assert "verify.option" in {d.code for d in read_back(program.text, other, "part.cls")[1]}


@pytest.mark.parametrize(("old", "new"), [
    (r"(BSPLINE X\S+ Y\S+ Z\S+ PL=1.*\n(?:N.*\n){3}N\d+ X-?\d+\.)\d", r"\g<1>9"), (r"(N\d+ )BSPLINE ", r"\1"),
    ("PL=1", "PL=2"), (r"(BSPLINE .*\n(?:N.*\n){2})N.*\n", r"\1"), (r"(BSPLINE .*\nN\d+ )", r"\1G1 "), ("PL=1", "PL=1 PW=2"),
    ("PL=1", "PL=1 SD=2"), (" PL=1", ""), (r"(N\d+ )BSPLINE ", r"\1POLY "), (r"(BSPLINE .*\nN\d+ )", r"\1BSPLINE ")])
def test_what_is_changed_is_found(old: str, new: str) -> None:
    program = converted(SIEMENS, POINTS)
    head, body = program.text.split("N10 ", 1)
    changed = head + "N10 " + re.sub(old, new, body, count=1)
    assert changed != program.text and codes(program, changed)


def test_the_second_witness_reads_control_points_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that takes the polygon for one with other knots agrees with nobody."""
    from postproc.readback.execution import cubics

    program = converted(SIEMENS, POINTS)
    assert codes(program, program.text) == set()
    right = cubics._spline_points
    monkeypatch.setattr(cubics, "_spline_points", lambda *a: right(*a) + 1e-3 * (np.arange(len(right(*a)))[:, None] % 2))
    assert "witness.path" in codes(program, program.text)


def test_splines_next_to_each_other_are_two() -> None:
    """A straight block stands between them: nobody knows whether the control would take their points for one polygon."""
    bow = curve_of(np.stack([20.0 * T, 9.0 * np.sin(4.0 * T), 3.0 * np.sin(3.0 * T)], axis=1))
    second = BSpline(bow.t, bow.c + curve_of(WAVES).c[-1], 3)
    text = DENSE.replace("RAPID\nGOTO/70,0,50", record(second) + "RAPID\nGOTO/90,0,50")
    program = made(text=text)
    assert program.ok and program.text.count(" BSPLINE X") == 2
    between = program.text.split(" BSPLINE X")[1].splitlines()[-2]
    assert re.match(r"N\d+ G1 X", between) and program.witness is not None and not program.witness.not_compared


def test_control_points_as_the_pages_have_them() -> None:
    """Tangential to the polygon at both ends, degree 3; PL the same in all blocks; words of one axis alone."""
    head = "G17 G710 G90 G94 G40 G64\nG54\nG0 X0 Y0 Z0\nG1 X0 Y0 F600\n"
    motion = good(SIEMENS, head + "BSPLINE X10 Y20 PL=7.5\nX20 Y40 PL=7.5\nM8\nX30 Y30 PL=7.5\nX40 PL=7.5\nX50 Y0 PL=7.5\n"
                  "G1 X60\nM30\n")
    rows = np.array(words(motion))
    inside = rows[(motion.line >= 5) & (motion.line <= 10)]
    stated = np.array([[0, 0], [10, 20], [20, 40], [30, 30], [40, 30], [50, 0]], dtype=float)
    u = np.arange(1, len(inside) + 1) / len(inside)
    assert np.abs(inside[:, :2] - BSpline(knots_of(equal_knots(3)), stated, 3)(u)).max() < 1e-4
    assert set(motion.line[motion.line >= 5]) == {5, 6, 8, 9, 10, 11}


@pytest.mark.parametrize("body", [
    "BSPLINE X1 PL=1\nX2 Y1 PL=1\n", "BSPLINE X1\nX2 Y1\nX3\nX4\n", "BSPLINE X1 PL=1\nX2 Y1 PL=1\nX3 PL=2\nX4 PL=1\n",
    "BSPLINE X1 PL=1 PW=2\nX2 Y1 PL=1\nX3 PL=1\n", "BSPLINE SD=2\nX1 PL=1\nX2 Y1 PL=1\nX3 PL=1\n",
    "BSPLINE X1 PL=0\nX2 Y1 PL=0\nX3 PL=0\n", "G0 BSPLINE X1 PL=1\nX2 Y1 PL=1\nX3 PL=1\n",
    "G93\nBSPLINE X1 PL=1 F1\nX2 Y1 PL=1 F1\nX3 PL=1 F1\n",
    "BSPLINE X1 PL=1\nX2 Y1 PL=1\nX3 PL=1\nBSPLINE X5 PL=1\nX6 PL=1\nX7 PL=1\n",
    "BSPLINE X1 PL=1\nX2 Y1 PL=1\nCYCLE800()\nX3 PL=1\nX4 PL=1\n", "BSPLINE X1 PL=1\nX2 Y1 PL=1\nG4 F1\nX3 PL=1\n",
    "BSPLINE X1 PL=1\nX2 Y1 PL=1\nX3 SUPA PL=1\n", "BSPLINE X1 PL=1 PL=1\nX2 Y1 PL=1\nX3 PL=1\n", "BSPLINE\nG1 X5\n",
    "SD=2\nBSPLINE X1 PL=1\nX2 Y1 PL=1\nX3 PL=1\n", "PW=3\nBSPLINE X1 PL=1\nX2 Y1 PL=1\nX3 PL=1\n",
    *(f"BSPLINE X1 PL=1\n{amid}X2 Y1 PL=1\nX3 PL=1\n" for amid in (
        "G55 ", "G55\n", "D0\n", "T2\n", "M0\n", "M1\n", "G9 ", "G60\n", "G700\n", "TRANS X5\n", "AROT Z30\n", "R1=2\n"))])
def test_other_control_points_are_refused(body: str) -> None:
    head = "G17 G710 G90 G94 G40 G64\nG54\nG0 X0 Y0 Z0\nG1 X0 F600\n"
    assert "gcode.curve" in faults(SIEMENS, head + body + "M30\n")


def test_the_bound_holds() -> None:
    """Splines of few points, of which none has more than the fewest that are proved; a corner is followed by none."""
    some = np.random.default_rng(5)
    u = np.linspace(0.0, 1.0, 500)
    for _ in range(2):
        inner = np.sort(np.append(some.uniform(0.1, 0.9, 2), 1.0))
        control = np.cumsum(some.normal(size=(6, 3)) * 6.0, axis=0)
        found = uniform_spline(control, inner, 0.01, 200)
        assert len(found) > 3
        a, b = BSpline(knots_of(inner), control, 3)(u), BSpline(knots_of(equal_knots(len(found) - 3)), found, 3)(u)
        assert off(b, a) < 0.0125 and off(a, b) < 0.0125  # chords of 700 points are off the curves too
    corner = np.array([[0, 0, 0], [5, 0, 0], [9, 0, 0], [10, 0, 0], [10, 1, 0], [10, 5, 0], [10, 9, 0]], dtype=float)
    assert not len(uniform_spline(corner, np.array([0.5, 0.5, 0.5, 1.0]), 0.01, 200))


@pytest.mark.parametrize("inner", [[0.1, 0.4, 0.5, 1.0], [1.0], [0.3, 0.3, 0.6, 1.0], [0.2, 0.2, 0.2, 1.0]])
def test_the_part_behind_is_the_same_curve(inner: list[float]) -> None:
    knots, control = np.array(inner), np.random.default_rng(1).normal(size=(len(inner) + 3, 3))
    u = np.linspace(0.0, 1.0, 31)
    for at in (0.05, 0.3, 0.55):
        rest, left = part_behind(control, knots, at)
        whole = BSpline(knots_of(knots), control, 3)(at + u * (1.0 - at))
        assert np.abs(BSpline(knots_of(left), rest, 3)(u) - whole).max() < 1e-12


def test_a_part_of_a_spline_is_no_polygon() -> None:
    """A record amid its pieces: what is left of them is no clamped cubic, and stays chords."""
    text = FILE.replace("NURBS/", "COOLNT/ON\nNURBS/")
    assert converted(SIEMENS, POINTS, text=text).ok
