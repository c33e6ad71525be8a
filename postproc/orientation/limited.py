"""What the set-up's limits of tool axes find in the passes: names that do not exist, normals that are missing, own axes
outside."""

from __future__ import annotations

from machines.user_file import nearest, read_toml
from postproc.orientation.allowed import own_outside
from postproc.orientation.passes import Pass, Work
from postproc.setup_orientation import OrientationLimits
from toolpaths.diagnostics import Diagnostic, error, info, warning

_NORMALS = ("have the CAM system write surface normals (GOTO with nine numbers), or name the part mesh ([bodies] part), or "
            "limit the tilt from the CL's own axis alone (--max-tilt)")


def limit_faults(work: Work, file: str = "") -> list[Diagnostic]:
    """Diagnostics of the set-up's `[orientation]` for the passes of a toolpath; `file` is that of the set-up."""
    limits = work.setup.orientation
    free = [one for one in work.passes if not one.fixed]
    return [*_unknown_operations(work, limits, file), *_no_normals(work, limits, free), *_too_wide(work, limits, free, file),
            *_no_contact(work, free), *_own(work, limits, free)]


def _unknown_operations(work: Work, limits: OrientationLimits, file: str) -> list[Diagnostic]:
    known = [op.name for op in work.toolpath.operations if op.name]
    return [error("orient.operation", f"fixed_operations names {name!r}, which is no operation of the CL file",
                  file=file or work.toolpath.file, lines=_line(file, "fixed_operations"), hint=nearest(name, known))
            for name in limits.fixed_operations if name not in known]


def _no_normals(work: Work, limits: OrientationLimits, free: list[Pass]) -> list[Diagnostic]:
    bad = [one for one in free if not len(one.contact)] if limits.need_normals else []
    if not bad:
        return []
    asked = ", ".join(key for key in ("lead", "tilt", "off_centre", "contact_radius") if getattr(limits, key) is not None)
    return [error("orient.normals", f"[orientation] {asked}: no surface normal is known in pass {bad[0].number}",
                  file=work.toolpath.file, lines=[one.line for one in bad][:6], count=len(bad), hint=_NORMALS)]


def _too_wide(work: Work, limits: OrientationLimits, free: list[Pass], file: str) -> list[Diagnostic]:
    radius = limits.contact_radius
    bad = [one for one in free if radius is not None and radius >= one.radius]
    if not bad:
        return []
    return [error("orient.contact_radius", f"contact_radius = {radius:g} mm, the ball of pass {bad[0].number} has a radius "
                  f"of {bad[0].radius:g} mm", file=file or work.toolpath.file, lines=_line(file, "contact_radius"),
                  count=len(bad), hint="a distance below the ball's radius, or off_centre in degrees")]


def _no_contact(work: Work, free: list[Pass]) -> list[Diagnostic]:
    """Places where the part says nothing: the ball is not on it, or too deep in it."""
    some = [one for one in free if one.contact.unknown and work.toolpath.normal is None]
    if not some or work.setup.bodies is None:
        return []
    unknown = sum(one.contact.unknown for one in some)
    places = unknown + sum(len(one.contact) for one in some)
    return [info("orient.no_contact", f"at {unknown} of {places} places on cutting moves the ball does not touch the part "
                 f"mesh within {work.setup.bodies.gouge:g} mm and the tolerance: no lead or tilt is looked at there",
                 file=work.toolpath.file, lines=[one.line for one in some][:6], count=len(some))]


def _own(work: Work, limits: OrientationLimits, free: list[Pass]) -> list[Diagnostic]:
    found = [(one, why) for one in free if (why := own_outside(one, limits))]
    if not found:
        return []
    one, why = found[0]
    return [warning("orient.own_limits", f"the CL file's own axis of pass {one.number} is outside [orientation] of the "
                    f"set-up: {why}", file=work.toolpath.file, lines=[each.line for each, _ in found][:6], count=len(found),
                    hint="it is kept where nothing better is found; chosen axes are inside the limits")]


def _line(file: str, key: str) -> list[int]:
    """Where a set-up file states a key of [orientation]."""
    values = read_toml(file)[0] if file else None
    return [values.origin(("orientation", key)).line] if values else []
