"""What the set-up's limits of tool axes find in the passes: names that do not exist, normals that are
missing, own axes outside."""

from __future__ import annotations

import numpy as np

from machines.user_file import read_toml
from machines.value_words import nearest
from postproc.orientation.passes.allowed import AllowedAxes, off_centre, own_outside
from postproc.orientation.passes.passes import Pass, PassContext
from postproc.setup.orientation import OrientationLimits
from toolpaths.diagnostics import Diagnostic, error, info, warning
from toolpaths.plug_ins import PlugInFault
from toolpaths.units import DEG

_NORMALS = ("have the CAM system write surface normals (GOTO with nine numbers), or name the part mesh ([bodies] part), or "
            "limit the tilt from the CL's own axis alone (--max-tilt)")


def limit_faults(work: PassContext, file: str = "", tilt: float = np.pi) -> list[Diagnostic]:
    """Diagnostics of the set-up's `[orientation]` for the passes of a toolpath; `file` is that of the set-up,
    `tilt` the largest from the surface normals, rad."""
    limits = work.setup.orientation
    free = [one for one in work.passes if not one.fixed]
    if broken := _broken_criteria(work, limits, free, file):
        return broken
    impossible = _too_wide(work, limits, free, file) or _too_steep(work, limits, free, file, tilt)
    own = [] if impossible else [*_own(work, limits, free), *_own_tilt(work, free, tilt)]
    return [*_unknown_operations(work, limits, file), *_no_normals(work, limits, free), *impossible,
            *_no_contact(work, free), *own]


def _broken_criteria(work: PassContext, limits: OrientationLimits, free: list[Pass], file: str) -> list[Diagnostic]:
    """An error where the code of a package gives no angles of the axes that the passes have now."""
    try:
        for one in free if limits.criteria else ():
            AllowedAxes(np.pi, None, limits).outside(one, one.axis)
    except PlugInFault as fault:
        return [error("orient.criterion", str(fault), file=file or work.toolpath.file, lines=_line(file, "criteria"),
                      hint=fault.hint)]
    return []


def _unknown_operations(work: PassContext, limits: OrientationLimits, file: str) -> list[Diagnostic]:
    known = [op.name for op in work.toolpath.operations if op.name]
    return [error("orient.operation", f"fixed_operations names {name!r}, which is not an operation of the CL file",
                  file=file or work.toolpath.file, lines=_line(file, "fixed_operations"), hint=nearest(name, known))
            for name in limits.fixed_operations if name not in known] + [
        error("orient.operation", f"[orientation.operations] names {name!r}, which is not an operation of the CL file",
              file=file or work.toolpath.file, lines=_line(file, "operations"), hint=nearest(name, known))
        for name in limits.operations if name not in known]


def _no_normals(work: PassContext, limits: OrientationLimits, free: list[Pass]) -> list[Diagnostic]:
    bad = [one for one in free if not len(one.contact) and limits.of(one.operation).need_normals]
    if not bad:
        return []
    own = limits.of(bad[0].operation)
    asked = ", ".join(key for key in ("lead", "tilt", "off_centre", "contact_radius") if getattr(own, key) is not None)
    return [error("orient.normals", f"[orientation] {asked}: no surface normal is known in pass {bad[0].number}",
                  file=work.toolpath.file, lines=[one.line for one in bad][:6], count=len(bad), hint=_NORMALS)]


def _too_wide(work: PassContext, limits: OrientationLimits, free: list[Pass], file: str) -> list[Diagnostic]:
    bad = [one for one in free if (limits.of(one.operation).contact_radius or 0.0) >= one.radius]
    if not bad:
        return []
    radius = limits.of(bad[0].operation).contact_radius
    return [error("orient.contact_radius", f"contact_radius = {radius:g} mm, the ball of pass {bad[0].number} has a radius "
                  f"of {bad[0].radius:g} mm", file=file or work.toolpath.file, lines=_line(file, "contact_radius"),
                  count=len(bad), hint="a distance below the ball's radius, or off_centre in degrees")]


def _too_steep(work: PassContext, limits: OrientationLimits, free: list[Pass], file: str,
               tilt: float) -> list[Diagnostic]:
    """Passes whose least angle to the normal is above the largest."""
    bad = [one for one in free if len(one.contact) and off_centre(limits.of(one.operation), one.radius) > tilt]
    if not bad:
        return []
    own = limits.of(bad[0].operation)
    least = off_centre(own, bad[0].radius) / DEG
    key, given = ("off_centre", f"{least:g} degrees is") if own.contact_radius is None else (
        "contact_radius", f"{own.contact_radius:g} mm is an angle of {least:.3f} degrees to the normal,")
    return [error("orient.max_tilt", f"{key} = {given} more than --max-tilt {tilt / DEG:g}: pass {bad[0].number} can take "
                  "no axis", file=file or work.toolpath.file, lines=_line(file, key), count=len(bad),
                  hint=f"--max-tilt {_above(least)} or more, or a smaller {key}")]


def _own_tilt(work: PassContext, free: list[Pass], tilt: float) -> list[Diagnostic]:
    """Passes whose own axis leans farther than the largest tilt."""
    leans = {one.number: _lean(one) for one in free if len(one.contact)}
    bad = [one for one in free if leans.get(one.number, 0.0) > tilt + 1e-9]
    if not bad:
        return []
    worst = max(bad, key=lambda one: leans[one.number])
    lean = leans[worst.number] / DEG
    return [warning("orient.own_tilt", f"the CL file's own axis of pass {worst.number} stands {lean:.3f} degrees from the "
                    f"surface normal, more than --max-tilt {tilt / DEG:g}", file=work.toolpath.file,
                    lines=[one.line for one in bad][:6], count=len(bad),
                    hint="nothing is to be done: it is kept where nothing better is found; "
                    f"--max-tilt {_above(lean)} allows axes round it")]


def _lean(one: Pass) -> float:
    """Largest angle of the own axis to the surface normals, rad."""
    return float(one.contact.inclination(one.axis[None]).max())


def _above(angle: float) -> str:
    """A tenth of a degree that is not below an angle, degrees."""
    return f"{np.floor(10.0 * angle + 1.0 - 1e-6) / 10.0:g}"


def _no_contact(work: PassContext, free: list[Pass]) -> list[Diagnostic]:
    """Places where the part says nothing: the ball is not on it, or too deep in it."""
    some = [one for one in free if one.contact.unknown and work.toolpath.normal is None]
    if not some or work.setup.bodies is None:
        return []
    unknown = sum(one.contact.unknown for one in some)
    places = unknown + sum(len(one.contact) for one in some)
    return [info("orient.no_contact", f"at {unknown} of {places} places on cutting moves the ball does not touch the part "
                 f"mesh within {work.setup.bodies.gouge:g} mm and the tolerance: no lead or tilt is looked at there",
                 file=work.toolpath.file, lines=[one.line for one in some][:6], count=len(some))]


def _own(work: PassContext, limits: OrientationLimits, free: list[Pass]) -> list[Diagnostic]:
    found = [(one, why) for one in free if (why := own_outside(one, limits))]
    if not found:
        return []
    one, why = found[0]
    return [warning("orient.own_limits", f"the CL file's own axis of pass {one.number} is outside [orientation] of the "
                    f"set-up: {why}", file=work.toolpath.file, lines=[each.line for each, _ in found][:6], count=len(found),
                    hint="nothing is to be done: it is kept where nothing better is found; "
                    "chosen axes are inside the limits")]


def _line(file: str, key: str) -> list[int]:
    """Where a set-up file states a key of [orientation]."""
    values = read_toml(file)[0] if file else None
    return [values.origin(("orientation", key)).line] if values else []
