"""A fitted model as a file, as figures and for people."""

from __future__ import annotations

from postproc.cycle_time.model import CycleTimeModel
from postproc.time_fit.calibrate import CalibratedModel
from toolpaths.table_text import table_text

UNITS = {"corner_tolerance": "mm", "block_time": "s", "stop_time": "s", "spindle_time": "s"}
SENSE = {
    "corner_tolerance": "that corners may be rounded off",
    "block_time": "for a block at least",
    "rapid": "share of the axes' velocity in rapids",
    "override": "of feeds",
    "stop_time": "in position after a stop",
    "acceleration_share": "of the machine's accelerations",
    "jerk_share": "of the machine's jerks",
    "spindle_time": "at each start of the spindle",
}


def as_toml(model: CycleTimeModel) -> str:
    """The model as a file that `load_model` reads."""
    lines = []
    for name, value in model.model_dump(exclude={"calibration"}, exclude_none=True).items():
        lines.append(f"{name} = {_toml(value)}")
    if model.calibration is not None:
        lines += ["", "[calibration]"]
        lines += [f"{name} = {_toml(value)}" for name, value in model.calibration.model_dump().items()]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_toml(str(name))} = {_toml(v)}" for name, v in value.items()) + " }"
    return repr(value)


def as_dict(fit: CalibratedModel) -> dict[str, object]:
    """The figures of a calibration."""
    c = fit.calibration
    return {
        "parameters": {
            name: {"value": value, "relative_sigma": sigma, "before": fit.before[name]}
            for name, (value, sigma) in fit.values.items()
        },
        "sections": len(fit.measured),
        "rms_before_s": c.rms_before,
        "rms_after_s": c.rms_after,
        "measured_s": float(fit.measured.sum()),
        "modelled_before_s": fit.total_before,
        "modelled_after_s": float(fit.modelled.sum()),
        "polled_every_s": c.period,
        "relative": c.relative,
        "kinds": c.kinds,
        "structure": c.structure,
        "axes": list(c.axes),
        "jerk": fit.model.jerk,
        "not_identifiable": list(c.not_identifiable),
    }


def as_text(fit: CalibratedModel) -> str:
    """The fit for people: what was measured, how far the model is off before and after, each parameter with its
    uncertainty."""
    c, measured = fit.calibration, float(fit.measured.sum())
    off = [100.0 * (value / measured - 1.0) for value in (fit.total_before, float(fit.modelled.sum()))]
    sections = f"{len(fit.measured)} section{'' if len(fit.measured) == 1 else 's'}"
    lines = [
        f"fit to {c.log or 'the run'}: {sections}, {measured:.2f} s measured; model before {off[0]:+.2f} %, "
        f"after {off[1]:+.2f} %; rms of a section before {c.rms_before:.3g} s, after {c.rms_after:.3g} s"
    ]
    rows = []
    for name, (value, sigma) in fit.values.items():
        unit = UNITS.get(name, "")
        shown = "not shown by the run" if name in c.not_identifiable else f"+- {100.0 * sigma:.2g} %"
        rows.append((name, f"{fit.before[name]:.4g}", f"{value:.4g}", unit, shown, SENSE[name]))
    lines += table_text(rows, ("parameter", "before", "fitted", "", "1 sd", ""), align="lrr", indent=2)
    lines.append("  jerk limits hold" if fit.model.jerk else "  the control has no jerk limit")
    kinds = [(name, f"{100.0 * c.kinds.get(name, 0.0):.0f} %", f"{100.0 * sd:.1f} %") for name, sd in c.structure.items()]
    lines += [
        "what the model may be off where its parameters fit, by kind of motion:",
        *table_text(kinds, ("kind", "of the run", "1 sd"), align="lrr", indent=2),
    ]
    return "\n".join(lines)
