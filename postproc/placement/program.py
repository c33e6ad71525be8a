"""Seconds of the program that is written for a place: its passes as planned, all else under the ideal control."""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.estimate import estimate
from postproc.cycle_time.model import load_model
from postproc.cycle_time.planned import planned_times
from postproc.cycle_time.source import from_conversion
from postproc.pipeline.result import PostResult
from toolpaths.diagnostics import read_value


def program_seconds(result: PostResult) -> float:
    """s, links and travel home as the program has them; NaN where nothing is written."""
    if not result.ok:
        return np.nan
    model, blocks = read_value(load_model("ideal")), from_conversion(result)
    return float(estimate(blocks, result.machine, model, times=planned_times(result, blocks, model)[0]).seconds)
