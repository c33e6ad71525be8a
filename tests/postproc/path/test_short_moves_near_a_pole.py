"""Moves of a few hundredths past a singular direction: where one ends is known to the tolerance, its time next to it too."""

from __future__ import annotations

import numpy as np

import postproc
import toolpaths
from postproc.base.options import Options


def passing_by(first: int, last: int, points: int = 30_000) -> str:
    """A wave with a tool that leans to all sides; by moves of 0.03 mm past the pole, at a distance of 0.006 degrees."""
    t = np.arange(first, last) / (points - 1)
    lean, round_ = 0.5 * np.sin(9.0 * np.pi * t), 2.0 * np.pi * t
    rows = np.stack([40.0 * np.sin(40.0 * np.pi * t), 60.0 * t - 30.0, 5.0 * np.cos(30.0 * t) + 30.0,
                     np.sin(lean) * np.cos(round_), np.sin(lean) * np.sin(round_), np.cos(lean)], axis=1)
    lines = ("GOTO/" + ",".join(f"{v:.7f}" for v in row) for row in rows)
    return "\n".join(["UNITS/MM", "LOADTL/1", "SPINDL/8000,RPM,CLW", "FEDRAT/2000,MMPM", *lines, "FINI", ""])


def test_short_moves_past_a_pole_are_not_too_fast() -> None:
    path, found = toolpaths.read_bytes(passing_by(26_600, 26_720))
    result = postproc.convert(path, "mikron-ucp710", "fanuc-30i", options=Options(output="tcp"),
                              diagnostics=found)
    assert result.ok, [str(d) for d in result.diagnostics]
