"""What a calibration found, in words: the figures of `account` for a reader."""

from __future__ import annotations

import math

from machines.calibration.result_figures import CalibrationFigures
from toolpaths.table_text import table_text

FIGURES = 4
"""of a number without an uncertainty of its own"""
MOST = 9
"""decimals"""
UNCERTAINTY_DIGITS = 3
"""figures that an uncertainty is written with, and its value to the same decimal"""


def text(figures: CalibrationFigures | None, head: str) -> str:
    """Lines: what was written, how well the readings determine it, where ball and bar are, then each error found."""
    if figures is None:
        return head
    return "\n".join([head, *_quality(figures), *_instrument(figures), *_errors(figures)])


def _quality(figures: CalibrationFigures) -> list[str]:
    number = figures["condition_number"]
    shown = "infinite" if number is None else f"{number:#.{FIGURES}g}"
    return [f"rank {figures['rank']} of {figures['unknowns']}, condition number {shown}, {figures['readings']} readings",
            f"weighted residual {figures['rms_before']:#.{FIGURES}g} before, {figures['rms_instrument']:#.{FIGURES}g} with "
            f"nothing found of the machine, {figures['rms_after']:#.{FIGURES}g} after", *_scaled(figures)]


def _scaled(figures: CalibrationFigures) -> list[str]:
    """What the covariance was scaled by, where more than the stated noise is left."""
    scale = figures["covariance_scale"]
    times = f"{math.sqrt(scale):.{FIGURES}g}"
    return [] if scale == 1.0 else [f"standard deviations are {times} times those of the stated noise"]


def _instrument(figures: CalibrationFigures) -> list[str]:
    """Ball, bar and zero."""
    setup: dict[str, float] = figures.get("setup_mm", {})
    lines: list[str] = []
    if "centre_mm" in figures:
        ball = ", ".join(f"{v:.4f}" for v in figures["centre_mm"])
        length = setup["bar.length"]
        lines = [f"ball found at {ball} mm, {math.hypot(*_ball(setup)):.4f} mm from the stated centre; distances are "
                 f"{1e3 * abs(length):.{FIGURES}g} um too {'short' if length > 0.0 else 'long'}"]
    elif "ball.x" in setup and any(_ball(setup)):
        x, y, z = (1e3 * v for v in _ball(setup))
        lines = [f"ball found {x:.{FIGURES}g}, {y:.{FIGURES}g}, {z:.{FIGURES}g} um from where it was thought"]
    elif setup.get("zero"):
        lines = [f"zero of the laser found {1e3 * setup['zero']:.{FIGURES}g} um off"]
    return lines


def _ball(setup: dict[str, float]) -> tuple[float, ...]:
    return tuple(setup[f"ball.{x}"] for x in "xyz")


def _errors(figures: CalibrationFigures) -> list[str]:
    """Each parameter that was found; how many others stay."""
    noted = [(name, p, sigma) for name, p in figures["parameters"].items() if (sigma := p["sigma"]) is not None]
    unknown, kept = [name for name, p in figures["parameters"].items() if p["sigma"] is None], figures["kept"]
    lines = ["found, with one standard deviation:"] if noted else []
    lines += table_text([(name, f"{_value(p['value'], sigma)} {p['unit']}", f"{p['at'] and 'at '}{p['at']}")
                         for name, p, sigma in noted], indent=2) if noted else []
    lines += [f"not known, 0 in the model: {', '.join(unknown)}"] if unknown else []
    return lines + ([f"other parameters, which stay as they were: {kept}"] if kept else [])


def _value(value: float, sigma: float) -> str:
    """Both to the decimal at which the uncertainty has UNCERTAINTY_DIGITS digits."""
    decimals = min(max(UNCERTAINTY_DIGITS - 1 - math.floor(math.log10(sigma)), 0), MOST)
    return f"{value:10.{decimals}f} +- {sigma:.{decimals}f}"
