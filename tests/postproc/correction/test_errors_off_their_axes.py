"""Geometric errors by models that no sample has: reference points off their axes, lost motion in every slide."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from machines.geometric_error.files.loader import load
from postproc.base.options import Options
from postproc.pipeline.result import PostResult

OFF_ITS_LINE = """
[components.EA{0}]
cosine = [2.0]
sine = [-1.0]
[components.EB{0}]
mean = 3.0
[components.EC{0}]
mean = -2.0
[reference.{0}]
point = [40, -30, 20]
frame = "{1}"
"""


@pytest.mark.covering
@pytest.mark.parametrize("frame", ["fixed", "moving"])
@pytest.mark.parametrize(("machine", "letter"),
                         [("nutating-head", "B"), ("fork-head-ab", "A"), ("mikron-ucp710", "C")])
def test_first_order_of_turns_about_a_point_off_the_axis(machine: str, letter: str, frame: str,
                                                         tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text(OFF_ITS_LINE.format(letter, frame))
    built = machines.load(machine)
    model, kin = load(tmp_path / "e.toml", built), built.kinematics.with_tool(80.0)
    rng = np.random.default_rng(5)
    q = np.where(kin.rotary, rng.uniform(-1.0, 1.0, (20, 5)), rng.uniform(-200.0, 200.0, (20, 5)))
    actual = model.on(kin)
    exact = actual.aim(q)[0] - kin.forward(q)[0]
    first = actual.deviation(q, model.values)[:, :3]
    assert np.abs(exact).max() > 1e-3
    assert np.abs(first - exact).max() < 1e-6


def lost_motion(folder: Path, gap: float, tilt: float = 0.0) -> str:
    """Tables with two approach directions for X, Y, Z, their turn about y too, and a wavy straightness that
    keeps every axis moving."""
    x = np.linspace(-600.0, 600.0, 41)
    text = ""
    for k, letter in enumerate("XYZ"):
        wave = 6.0 * np.sin(x / 47.0 + k)
        rows = [f"{a}, {w - gap}, {w + gap}, {-w}, {w / 3.0 - tilt}, {w / 3.0 + tilt}" for a, w in zip(x, wave, strict=True)]
        across = "YZX"[k]
        (folder / f"{letter}.csv").write_text("\n".join(
            [f"{letter} [mm], E{letter}{letter}+ [um], E{letter}{letter}- [um], E{across}{letter} [um], "
             f"EB{letter}+ [arcsec], EB{letter}- [arcsec]", *rows]))
        text += "".join(f'[components.E{d}{letter}]\ntable = "{letter}.csv"\n' for d in (letter, across, "B"))
    (folder / "e.toml").write_text(text)
    return str(folder / "e.toml")


def converted(sample: str, machine: str, controller: str, model: str) -> PostResult:
    path, found = toolpaths.read(Path("samples") / sample)
    options = Options(setup="samples/tools.setup.toml", error_model=model)
    return postproc.convert(path, machine, controller, options=options, diagnostics=found)


def test_lost_motion_taken_up_after_a_rapid_is_no_cut(tmp_path: Path) -> None:
    result = converted("inch_plate.apt", "mill-3axis", "linuxcnc", lost_motion(tmp_path, 4.0, 0.5))
    assert result.ok, [str(d) for d in result.diagnostics]


def test_holes_whose_levels_lose_too_much_are_written_out(tmp_path: Path) -> None:
    """10 um between both directions of Z: a control's cycle would leave the tool that much off where it comes back to."""
    result = converted("inch_plate.apt", "mill-3axis", "linuxcnc", lost_motion(tmp_path, 5.0))
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.program is not None and not result.program.holes
