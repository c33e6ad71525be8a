"""What tests and benchmarks of smoothing share: one chain alone."""

from __future__ import annotations

import numpy as np

from toolpaths.shape import Curves
from toolpaths.smoothing.blend import SHARPEST
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth_all


def smooth(curves: Curves, tolerance: Tolerance, sharpest: float = SHARPEST) -> Smooth | None:
    """The smoothed motion along one chain."""
    return smooth_all(curves, np.array([0, len(curves)]), tolerance, sharpest)[0]
