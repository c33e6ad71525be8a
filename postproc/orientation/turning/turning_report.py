"""Axes that turn along cuts, for people and as figures: how far, within which limits, and what it gains."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.base.program_time import ProgramTime
from postproc.orientation.passes.contact import Contact
from postproc.orientation.turning.reach_along import ReachAlong, reach_along
from postproc.orientation.turning.turning_choice import RunChoice, TurningChoice
from postproc.planning.planned import limits_at_feed
from postproc.setup.orientation import OrientationLimits
from toolpaths.arrays import Floats, finite
from toolpaths.diagnostics import Diagnostic, info
from toolpaths.rotations import angle_between
from toolpaths.table_text import table_text
from toolpaths.units import DEG

SHOWN = 20
"""cuts in the table; where there are more, those that gain most"""
_LINES = 6
_HEADS = ("cut", "lines", "turned by deg", "of deg", "lead deg", "tilt deg", "off path mm", "on control s",
          "own axes s", "gain %", "planned s", "own axes s")


def noted(choice: TurningChoice) -> list[Diagnostic]:
    """Cuts that keep their axes, and why; programs that were refused."""
    file, found = choice.work.toolpath.file, list[Diagnostic]()
    reasons: dict[str, list[RunChoice]] = {}
    for one in choice.runs:
        if not one.turned:
            reasons.setdefault(one.run.fixed or "no other axes are faster", []).append(one)
    for why, some in reasons.items():
        found.append(info("orient.cut_kept", f"{len(some)} of {len(choice.runs)} cuts keep their axes: {why}",
                          file=file, lines=[int(one.run.line[1]) for one in some][:_LINES], count=len(some)))
    some = [one for one in choice.runs if one.turned and one.run.limits.need_normals and one.run.contact.unknown]
    if some:
        unknown = sum(one.run.contact.unknown for one in some)
        places = unknown + sum(len(one.run.contact) for one in some)
        found.append(info("orient.no_normal", f"at {unknown} of {places} places along cuts whose axes turn no normal "
                          "is known: no lead or tilt is looked at there", file=file,
                          lines=[int(one.run.line[1]) for one in some][:_LINES], count=len(some)))
    if choice.passed:
        found.append(info("orient.turn_refused", "cuts whose program is refused with axes that turn along them keep theirs: "
                          f"{choice.passed[0]}", file=file, count=len(choice.passed)))
    return found


def unused(limits: OrientationLimits, what: str, file: str) -> list[Diagnostic]:
    """Where the set-up has a cone, that `what` leaves the axes along cuts as they are."""
    if not limits.turns:
        return []
    return [info("orient.cone_unused", f"the set-up has a cone, and {what}: no axis turns along its cut", file=file)]


def as_dict(choice: TurningChoice) -> dict[str, Any]:
    """The key `turning` of `orient --json` and `convert --json`."""
    return {"turned": sum(one.turned for one in choice.runs), "refused": list(choice.passed),
            "on_the_control": _programs(choice), "cuts": [_cut(one) for one in choice.runs]}


def as_text(choice: TurningChoice) -> str:
    """Table of the cuts whose axes turn, why others keep theirs, and the times on the control."""
    turned, best = sorted((one for one in choice.runs if one.turned), key=_saved, reverse=True), most_gaining(choice)
    lines = [f"axes turned along {len(turned)} of {len(choice.runs)} cuts, their contact kept"]
    rows = [_row(one) for one in sorted(turned[:SHOWN], key=lambda one: one.run.number)]
    lines += table_text(rows, _HEADS, "rlrrllrrrrrr") if rows else []
    if len(turned) > SHOWN:
        lines.append(f"      and {len(turned) - SHOWN} cuts that gain less; all are in --json")
    lines += _reach_lines(choice, best) if best is not None else []
    return "\n".join([*lines, *control_lines(choice)])


def control_lines(choice: TurningChoice) -> list[str]:
    """What turning axes gain on the control; none where no clock was given."""
    keep, now = choice.programs.get("keep"), choice.programs.get("turned")
    if keep is None or now is None:
        return []
    gained = f"{choice.gain:.1f} % gained" if choice.gain else "nothing gained"
    noted = ", within the model's uncertainty" if 0.0 < keep.seconds - now.seconds < now.uncertainty else ""
    return [f"on the control ({now.model}): axes turned along the cuts {_with_band(now)}, not turned {_with_band(keep)}: "
            f"{gained}{noted}"]


def header(choice: TurningChoice) -> list[str]:
    """Lines for the header of a program."""
    turned = [one for one in choice.runs if one.turned]
    if not turned:
        return []
    most, off = max(_turned(one).max() for one in turned), max(_off_path(one) for one in turned)
    return [f"tool axes turned along {len(turned)} of {len(choice.runs)} cuts, by up to {most / DEG:.2f} degrees; "
            "its contact as in the CL file at its points",
            f"and within {off:.5f} mm of its path between them; every cut in the time that the file gives it"]


def reaches(choice: TurningChoice, one: RunChoice) -> tuple[ReachAlong, ReachAlong] | None:
    """Along the longest stretch of a run with its own axes and with those taken; None where it is fixed or a joint states no
    jerk."""
    if one.run.fixed or not np.isfinite(choice.work.machine.limits.jerk).all():
        return None
    limits = limits_at_feed(choice.work.machine, one.run.whole.kin)
    stretch = max(one.run.stretches, key=lambda each: float(each.s[-1] - each.s[0]))
    own, taken = (reach_along(stretch, field, limits) for field in (one.fields[0], one.fields[one.taken]))
    return own, taken


def most_gaining(choice: TurningChoice) -> RunChoice | None:
    """The run whose axes are turned with most gain; None where none is."""
    return max((one for one in choice.runs if one.turned), key=_saved, default=None)


def _saved(one: RunChoice) -> float:
    """s, on the control where they are known."""
    own, taken = one.on_control or (one.seconds[0], one.seconds[one.taken])
    return own - taken


def _turned(one: RunChoice) -> Floats:
    """(N,) rad by which the axes at the poses are turned."""
    return angle_between(one.run.axis, one.fields[one.taken].axes)


def _off_path(one: RunChoice) -> float:
    return 0.0 if one.limits is None else one.limits.off_path(one.fields[one.taken].axes)


def _ranges(one: RunChoice) -> dict[str, tuple[float, float]]:
    """Least and greatest lead and tilt of the axes taken, degrees, where the surface is known."""
    at = one.run.contact
    if not len(at):
        return {}
    axes = one.fields[one.taken].axes[at.line]
    return {"lead": _range(_angles(axes, at.travel, at)), "tilt": _range(_angles(axes, at.right, at))}


def _angles(axes: Floats, side: Floats, at: Contact) -> Floats:
    found = np.arctan2(np.einsum("ki,ki->k", axes, side), np.einsum("ki,ki->k", axes, at.normal))
    return np.asarray(found[np.isfinite(found)])


def _range(angles: Floats) -> tuple[float, float]:
    return (float(angles.min()) / DEG, float(angles.max()) / DEG) if len(angles) else (np.nan, np.nan)


def _row(one: RunChoice) -> tuple[object, ...]:
    run, (own, taken) = one.run, (one.seconds[0], one.seconds[one.taken])
    found = _ranges(one)
    spans = (f"{found[name][0]:.1f} to {found[name][1]:.1f}" if name in found else "-" for name in ("lead", "tilt"))
    return (run.number, f"{run.line[1]} to {run.line[-1]}", f"{_turned(one).max() / DEG:.2f}", f"{run.cone / DEG:.2f}",
            *spans, f"{_off_path(one):.5f}", *_on_control(one), f"{taken:.3f}", f"{own:.3f}")


def _on_control(one: RunChoice) -> tuple[str, str, str]:
    """Seconds of the cuts on the control, turned and with the own axes, and percent saved; "-" where they are not known."""
    if one.on_control is None or one.on_control[0] <= 0.0:
        return "-", "-", "-"
    own, taken = one.on_control
    return f"{taken:.3f}", f"{own:.3f}", f"{100.0 * (1.0 - taken / own):.2f}"


def _reach_lines(choice: TurningChoice, one: RunChoice) -> list[str]:
    """The reach along the run that gains most, before and after."""
    found = reaches(choice, one)
    if found is None:
        return []
    own, now = found
    parts = [f"planned speed {_middle(own.speed):.0f}, {_middle(now.speed):.0f} mm/s",
             f"velocity {_middle(own.velocity):.0f}, {_middle(now.velocity):.0f} mm/s",
             f"acceleration {_middle(own.acceleration):.0f}, {_middle(now.acceleration):.0f} mm/s2",
             f"jerk {_middle(own.jerk):.0f}, {_middle(now.jerk):.0f} mm/s3"]
    return [f"cut {one.run.number}, along the path of the centre of ball or corner, own axes and turned, medians: "
            f"{'; '.join(parts)}"]


def _middle(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.inf


def _cut(one: RunChoice) -> dict[str, Any]:
    run = one.run
    values: dict[str, Any] = {"cut": run.number, "first_line": int(run.line[1]), "last_line": int(run.line[-1]),
                              "fixed": run.fixed, "turned": one.turned}
    if run.fixed:
        return values
    found = _ranges(one)
    return values | {"turned_deg": float(_turned(one).max()) / DEG, "cone_deg": run.cone / DEG,
                     "lead_deg": list(found["lead"]) if found else None, "tilt_deg": list(found["tilt"]) if found else None,
                     "off_path_mm": _off_path(one), "time_s": finite(one.seconds[one.taken]),
                     "reference_time_s": finite(one.seconds[0]),
                     "control_s": None if one.on_control is None else one.on_control[1],
                     "reference_control_s": None if one.on_control is None else one.on_control[0]}


def _programs(choice: TurningChoice) -> dict[str, Any] | None:
    if not choice.programs:
        return None
    return {"model": next(iter(choice.programs.values())).model, "gain_percent": choice.gain,
            **{name: {"time_s": one.seconds, "band_s": list(one.band)} for name, one in choice.programs.items()}}


def _with_band(one: ProgramTime) -> str:
    return f"{one.seconds:.2f} s (95 % {one.band[0]:.2f} to {one.band[1]:.2f} s)"
