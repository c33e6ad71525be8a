"""Helices by pole and angle (Klartext CP): they end where they should as nearly as last decimals let them."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.compile.program import Hole
from postproc.controllers.model import load_controller
from postproc.job.job import Job, prepare
from postproc.pipeline.result import PostResult
from postproc.setup.model import load_setup
from postproc.verification.residual_errors import after_formatting
from postproc.writing.polar_arc import REACH, polar_arc
from tests.postproc.kit import machine
from tests.postproc.program_kit import blocks, program, step
from toolpaths.arrays import Floats
from toolpaths.toolpath import Cycle
from toolpaths.units import DEG

GRAIN = 1e-4
SAMPLES = Path("samples")


def turned(point: Floats, pole: Floats, degrees: float) -> Floats:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y = point - pole
    return np.asarray(pole + np.array([c * x - s * y, s * x + c * y]))


def random_arcs(radius: float, seed: int, count: int = 150) -> list[tuple[Floats, Floats, Floats, float]]:
    """(start, end, centre, turn): a third along the axes of the grid, starts off the grid, ends on it."""
    rng, found = np.random.default_rng(seed), []
    for k in range(count):
        centre, begin = rng.uniform(-100.0, 100.0, 2), rng.uniform(0.0, 360.0)
        turn = float(rng.choice([-1.0, 1.0]) * rng.uniform(5.0, 355.0))
        if k % 3 == 0:
            begin, turn = 90.0 * rng.integers(4), float(rng.choice([-270.0, -180.0, -90.0, 90.0, 180.0, 270.0]))
        start = np.round(turned(centre + np.array([radius, 0.0]), centre, begin), 4)
        end = np.round(turned(start, centre, turn), 4)
        start = start + rng.uniform(-0.25, 0.25, 2) * GRAIN
        found.append((start, end, centre, turn))
    return found


def wrapped(angle: float) -> float:
    return (angle + 180.0) % 360.0 - 180.0


@pytest.mark.parametrize("radius", [0.5, 4.0, 57.0, 120.0])
def test_ends_are_as_near_as_stated(radius: float) -> None:
    worst, plain = [], []
    for start, end, centre, turn in random_arcs(radius, 5):
        arc = polar_arc(start, end, centre, turn, GRAIN, GRAIN)
        assert np.allclose(arc.pole / GRAIN, np.round(arc.pole / GRAIN), atol=1e-6)
        assert abs(arc.angle / GRAIN - round(arc.angle / GRAIN)) < 1e-4 and abs(arc.angle - turn) < 0.06 / radius + 0.1
        assert np.abs(arc.pole - centre).max() <= (REACH + 0.5) * GRAIN + 1e-9
        assert np.allclose(turned(start, arc.pole, arc.angle), arc.end, rtol=0.0, atol=1e-10)
        worst.append(float(np.linalg.norm(arc.end - end)))
        rounded = np.round(centre, 4)
        angles = [math.degrees(math.atan2(*(point - rounded)[::-1])) for point in (start, end)]
        straight = round(turn + wrapped(angles[1] - angles[0] - turn), 4)
        plain.append(float(np.linalg.norm(turned(start, rounded, straight) - end)))
    assert max(worst) <= np.hypot(GRAIN, 0.5 * GRAIN * DEG * radius)
    assert max(worst) < max(plain) and np.mean(worst) < 0.8 * np.mean(plain)


def test_what_is_exact_stays() -> None:
    arc = polar_arc(np.array([10.0, 0.0]), np.array([0.0, 10.0]), np.zeros(2), -270.0, GRAIN, GRAIN)
    assert arc.pole.tolist() == [0.0, 0.0] and arc.angle == pytest.approx(-270.0, abs=1e-12)
    full = polar_arc(np.array([10.0, 0.0]), np.array([10.0, 0.0]), np.zeros(2), 360.0, GRAIN, GRAIN)
    assert full.angle == pytest.approx(360.0, abs=1e-12)


def executed(text: list[str], start: tuple[float, float]) -> list[Floats]:
    """Where CC, CP and L with X alone take the tool in X, Y."""
    at, pole, places = np.array(start), np.zeros(2), []
    for line in text:
        if line.startswith("CC"):
            pole = np.array([float(v) for v in re.findall(r"[XY]([-+][\d.]+)", line)])
        elif line.startswith("CP"):
            at = turned(at, pole, float(re.findall(r"IPA([-+][\d.]+)", line)[0]))
        elif line.startswith("L X"):
            at = np.array([float(line.split()[1][1:]), at[1]])
        places.append(at)
    return places


def test_helices_one_after_the_other_do_not_add_up() -> None:
    """Each begins where the one before has ended to the last digit, lines between them that state X alone."""
    rng = np.random.default_rng(3)
    steps, wanted, at = [step("rapid", X=20.0, Y=0.0, Z=5.0)], [], np.array([20.0, 0.0])
    for k in range(60):
        centre = at + rng.uniform(-20.0, 20.0, 2)
        end = np.round(turned(at, centre, float(rng.uniform(20.0, 200.0))), 4)
        relative = (float(centre[0] - at[0]), float(centre[1] - at[1]), 0.0)
        steps.append(step("ccw", X=end[0], Y=end[1], Z=5.0 - 0.0003 * k - 0.0003, centre=relative, F=300.0))
        at = end
        wanted.append(end)
        if k % 5 == 4:
            at = np.array([round(end[0] + 1.0, 4), end[1]])
            steps.append(step("feed", X=at[0]))
            wanted.append(at)
    text = blocks("heidenhain-tnc640", program(steps))[1:]
    assert sum(line.startswith("CP") for line in text) == 60
    places = [at for line, at in zip(text, executed(text, (20.0, 0.0)), strict=True) if not line.startswith("CC")]
    off = np.linalg.norm(np.array(places) - wanted, axis=1)
    assert off.max() < 1.1 * GRAIN and off[-20:].mean() < 0.5 * GRAIN


def test_a_hole_between_helices_states_where_it_is() -> None:
    """Its line names X and Y even where its words are those before: the next helix begins there to the last digit."""
    rng = np.random.default_rng(8)
    differ = 0
    for _ in range(6):
        start, centre = np.array([20.0, 0.0]), rng.uniform(-20.0, 20.0, 2)
        at = np.round(turned(start, centre, 77.0), 4)
        away = rng.uniform(-20.0, 20.0, 2)
        end = np.round(turned(at, at + away, 111.0), 4)
        steps = [step("rapid", X=20.0, Y=0.0, Z=5.0),
                 step("ccw", X=at[0], Y=at[1], Z=4.0, centre=(*(centre - start), 0.0), F=300.0), step("rapid", Z=5.0),
                 step("feed", Z=-8.0, F=200.0), step("rapid", Z=5.0),
                 step("ccw", X=end[0], Y=end[1], Z=4.0, centre=(*away, 0.0), F=300.0)]
        hole = Hole(2, 4, 0, 5.0, -8.0, 5.0, 5.0, "DRILL", 3)
        text = blocks("heidenhain-tnc640", program(steps, holes=(hole,)),
                      (Cycle("DRILL", 11.0, 2.0, None, 200.0),))
        assert any(line.endswith("M99") and f"X{at[0]:+.4f}".rstrip("0") in line for line in text)
        wanted, unlike = (polar_arc(begin, end, at + away, 111.0, GRAIN, GRAIN) for begin in (
            at, executed(text[:3], (20.0, 0.0))[2]))
        last = [line for line in text if line.startswith(("CC", "CP"))][-2:]
        assert [float(v) for v in re.findall(r"[XY]([-+][\d.]+)", last[0])] == pytest.approx(wanted.pole.tolist(), abs=1e-9)
        assert float(re.findall(r"IPA([-+][\d.]+)", last[1])[0]) == pytest.approx(wanted.angle, abs=1e-9)
        differ += wanted.pole.tolist() != unlike.pole.tolist() or wanted.angle != unlike.angle
    assert differ


@cache
def converted(controller: str, model: str, sample: str = "pocket.cls") -> PostResult:
    path, found = toolpaths.read(SAMPLES / sample)
    options = Options(setup=str(SAMPLES / "tools.setup.toml"), error_model=model, output="tcp")
    return postproc.convert(path, "mikron-ucp710", controller, options=options, diagnostics=found)


def job_of(controller: str, model: str) -> Job:
    """The first stage of that alone."""
    path, _ = toolpaths.read(SAMPLES / "pocket.cls")
    (spec, _), (setup, _) = load_controller(controller), load_setup(SAMPLES / "tools.setup.toml")
    assert spec is not None and setup is not None
    job, found = prepare(path, machine("mikron-ucp710"), spec, setup,
                         Options(error_model=model, output="tcp"))
    assert job is not None, found
    return job


MODEL = str(SAMPLES / "errors/mikron-ucp710.toml")


def test_corrected_arcs_end_inside_the_bound() -> None:
    result = converted("heidenhain-tnc640", MODEL)
    found = after_formatting(result)
    assert result.ok and found is not None and result.text.count(" CP ") > 20
    assert found.tip.max() < found.tip_bound and found.tip.max() < 1e-4


def test_the_bound_counts_helices_where_there_are_some() -> None:
    """Half a last decimal in X, Y, Z; more where arcs climb or the correction may make them, on this control alone."""
    words = 0.5 * GRAIN * math.sqrt(3.0)
    corrected, plain, other = (job_of(*each) for each in (("heidenhain-tnc640", MODEL), ("heidenhain-tnc640", ""),
                                                          ("siemens-840d", MODEL)))
    assert other.rounding.tip == pytest.approx(words)
    moves = plain.moves
    arcs = np.flatnonzero((moves.arc >= 0) & ~moves.link)
    climbs = np.abs(moves.tip[arcs, 2] - moves.tip[arcs - 1, 2]) > 1e-9
    assert 0 < climbs.sum() < len(arcs)
    flat = replace(moves, tip=moves.tip * [1.0, 1.0, 0.0])
    for job, rows in ((plain, arcs[climbs]), (corrected, arcs), (replace(plain, moves=flat), arcs[:0]),
                      (replace(corrected, moves=flat), arcs)):
        radius = moves.arcs.radius[moves.arc[rows]].max(initial=0.0)
        more = math.hypot(GRAIN, 0.5 * GRAIN * DEG * radius) if len(rows) else 0.0
        assert job.rounding.tip == pytest.approx(words + more, rel=1e-12)


@pytest.mark.covering
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("seed", range(6))
def test_a_whole_circle_behind_a_helix_begins_where_it_ends(tmp_path: Path, sense: int, seed: int) -> None:
    """A helical bore cleaned at its bottom: CP ends where its angle lets it; C from there to the circle's own
    end would be the small rest of a turn."""
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-30.0, 30.0, 2)
    start = np.round(turned(centre + np.array([8.7, 0.0]), centre, float(rng.uniform(0.0, 360.0))), 4)
    end = np.round(turned(start, centre, sense * float(rng.uniform(30.0, 330.0))), 4)
    circle = f"CIRCLE/{centre[0]:.5f},{centre[1]:.5f},{{z}},0,0,{sense},8.7"
    lines = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID", f"GOTO/{start[0]},{start[1]},30",
             f"GOTO/{start[0]},{start[1]},0", circle.format(z="0"), f"GOTO/{end[0]},{end[1]},-2.5", circle.format(z="-2.5"),
             f"GOTO/{end[0]},{end[1]},-2.5", "GOTO/0,0,-2.5", "FINI", ""]
    (tmp_path / "bore.apt").write_text("\n".join(lines))
    path, found = toolpaths.read(tmp_path / "bore.apt")
    result = postproc.convert(path, "mill-3axis", controller="heidenhain-tnc640", diagnostics=found)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert re.search(r"CP IPA.*\n(\d+ L X\S+ Y\S+\n)?\d+ CC .*\n\d+ C X", result.text)
