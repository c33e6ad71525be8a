"""A planned test program as figures and for people."""

from __future__ import annotations

from postproc.cycle_time.report import clock
from postproc.time_fit.fit_text import SENSE
from postproc.time_fit.plan_calibration import CalibrationPlan
from toolpaths.table_text import table_text


def as_dict(plan: CalibrationPlan) -> dict[str, object]:
    """The figures of a test program: s, mm, shares; standard deviations of the parameters as shares."""
    return {"moves": list(plan.moves), "seconds": plan.seconds,
            "box_mm": {"low": plan.low.tolist(), "high": plan.high.tolist()},
            "parameters": {name: {"relative_sigma_before": before, "relative_sigma_after": after}
                           for name, (before, after) in plan.shown.items()},
            "band_now_s": list(plan.now.band), "band_after_s": list(plan.after.band),
            "not_shown_s": {name: s for name, s in plan.after.assumed.items() if s > 0.0}}


def as_text(plan: CalibrationPlan, file: str) -> str:
    """The test for people: its moves, where it goes, what it will show, the band before and after."""
    box = ", ".join(f"{letter} {a:.1f} to {b:.1f}" for letter, a, b in zip("XYZ", plan.low, plan.high, strict=True))
    lines = [f"{file}: test program in air, {clock(plan.seconds)}; box in its work offset, mm: {box}",
             *(f"  {name.lower()}" for name in plan.moves)]
    rows = [(name, f"{100.0 * before:.3g} %", f"{100.0 * after:.2g} %" if after < 0.9 * before else "not shown", SENSE[name])
            for name, (before, after) in plan.shown.items()]
    lines += table_text(rows, ("parameter", "1 sd now", "after", ""), align="lrr", indent=2)
    now, after = plan.now.band, plan.after.band
    width = f"{after[1] - after[0]:.3g} s wide instead of {now[1] - now[0]:.3g} s"
    width = f"{after[1] - after[0]:.3g} s wide instead of {now[1] - now[0]:.3g} s"
    lines.append(f"band of 95 %: now {clock(now[0])} to {clock(now[1])}; after a run of the test {width}, which is "
                 f"{clock(after[0])} to {clock(after[1])} where the control is as the model")
    left = {name: s for name, s in plan.after.assumed.items() if s > 0.0}
    if left:
        lines.append("what the test does not show: " + ", ".join(f"{name} +- {s:.3g} s" for name, s in left.items()))
    return "\n".join(lines)
