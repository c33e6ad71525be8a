"""Where the tolerance goes: splines, the control's smoothing, rounding, geometric errors, moved points, linearising."""

from __future__ import annotations

from postproc.job.job import Job
from postproc.job.rounding import rounding_problem
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

MARGIN = 0.85
"""of what is left for linearising: the read-back bounds deviations by other parts of the blocks"""
FILLED = 0.98
"""the same where it may be used up: what the read-back then bounds beyond the tolerance is refused"""
POINTS = 0.5
"""of the share for linearising that --smooth may move points by"""


def tolerance_shares(job: Job) -> tuple[dict[str, float], list[Diagnostic]]:
    """Where the tolerance goes (mm; axis_ in degrees): what the control's smoothing and rounding leave is linearising."""
    tolerance, axis = job.options.tolerance, job.options.axis_tolerance
    bound = job.rounding
    kinematics = job.controller.kinematics
    smoothing = job.smoothing.most
    margin = FILLED if job.options.filled else MARGIN
    axis_smoothing = kinematics.axis_smoothing_share * axis
    shares = {"smoothing": smoothing, "axis_smoothing": axis_smoothing,
              "rounding": bound.tip, "axis_rounding": bound.axis / DEG,
              "linearising": margin * (tolerance - smoothing - bound.tip),
              "axis_linearising": margin * (axis - axis_smoothing - bound.axis / DEG)}
    if job.corrects:
        from postproc.correction.compensation import SHARE

        shares |= {"geometric_errors": SHARE * tolerance, "axis_geometric_errors": SHARE * axis}
        for name in ("linearising", "axis_linearising"):
            shares[name] -= shares[name.replace("linearising", "geometric_errors")]
    if job.toolpath.spline_slack:
        shares["splines"] = job.toolpath.spline_slack
    if job.options.smooth:
        for name in ("linearising", "axis_linearising"):
            shares[name.replace("linearising", "points")] = POINTS * shares[name]
            shares[name] *= 1.0 - POINTS
    taken = max(smoothing, job.smoothing.asked)
    if taken >= tolerance:
        return shares, [error("tolerance.smoothing", f"the control's own smoothing takes {taken:g} mm, the tolerance is "
                              f"{tolerance:g} mm", hint="a wider --tolerance, or a smaller kinematics.smoothing_fixed in "
                              "the controller file, or [output.smoothing] of the set-up")]
    return shares, rounding_problem(bound, tolerance - smoothing, job.axis_tolerance - axis_smoothing * DEG)
