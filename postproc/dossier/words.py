"""Machines as people and programs read them."""

from __future__ import annotations

from typing import Any

import numpy as np

from machines.figures import ASSUMED
from machines.machine import Machine
from toolpaths.table_text import table_text
from toolpaths.units import DEG

_COLUMNS = ("lower", "upper", "velocity", "acceleration", "jerk")


def machine_dict(machine: Machine) -> dict[str, Any]:
    """A machine with its limits; lengths mm, angles degrees; travel without end is null."""
    axes = []
    for j, name in enumerate(machine.axis_names):
        unit = 1.0 / DEG if machine.rotary[j] else 1.0
        row: dict[str, Any] = {"letter": name, "kind": "rotary" if machine.rotary[j] else "linear",
                               "unit": "deg" if machine.rotary[j] else "mm"}
        for key in _COLUMNS:
            value = float(getattr(machine.limits, key)[j]) * unit
            row[key] = round(value, 9) if np.isfinite(value) else None
        row["home"] = round(float(machine.home[j]) * unit, 9)
        row["assumed"] = sorted(key for key, origin in figures_of(machine, name).items() if origin == ASSUMED)
        row["sources"] = {key: origin for key, origin in figures_of(machine, name).items() if origin != ASSUMED}
        axes.append(row)
    control = machine.control_kinematics
    return {"name": machine.name, "description": machine.description, "structure": machine.structure,
            "file": machine.file, "axes": axes, "rotary_axes": rotary_lines(machine),
            "retract_axis": machine.axis_names[machine.retract_axis] if machine.retract_axis >= 0 else None,
            "timing_s": {"tool_change": machine.timing.tool_change, "clamp": machine.timing.clamp,
                         "unclamp": machine.timing.unclamp},
            "timing_assumed": sorted(machine.timing.assumed),
            "documents": [one.model_dump() for one in machine.documents],
            "workspace": workspace_dict(machine),
            "control": {"module": control.module, "pins": dict(control.pins)} if control else None}


def workspace_dict(machine: Machine) -> dict[str, str] | None:
    """How the workspace of a machine on legs was looked at when it was loaded, or that a box of a chain is proved; None of
    any other."""
    if machine.kinematics.leg_geometry is None and not (machine.kinematics.chain and machine.certificate):
        return None
    return {"examined": "proved" if machine.certificate else "sampled", "certificate": machine.certificate}


def workspace_words(machine: Machine) -> str:
    """The same as a line, "" of a machine without legs."""
    if (found := workspace_dict(machine)) is None:
        return ""
    if machine.kinematics.chain:
        return f"a box of tips proved to be in reach: {found['certificate']}"
    return "workspace proved to be reached and free of singular positions: " + found["certificate"] if found["certificate"] \
        else "workspace sampled, not proved: postproc machine certify proves it"


def figures_of(machine: Machine, table: str) -> dict[str, str]:
    """Where the figures of one axis or of "timing" come from, by key: document and place, or "assumed"."""
    return {key.split(".", 1)[1]: origin for key, origin in machine.figures.items() if key.split(".")[0] == table}


def rotary_lines(machine: Machine) -> list[dict[str, Any]]:
    """Where the rotary axes lie with all of them at zero (a serial machine's slides too): `point` (mm) and `direction` of
    each in the table frame, which then is the machine's; the point is that of the line nearest to the origin. Cranks of
    platforms are none: they stand at home."""
    kin = machine.kinematics
    turning = np.array(machine.rotary) & ~np.array(kin.drives_tip)
    q = np.where(turning | kin.straight_slides, 0.0, machine.home)[None]
    (tip,), rates = kin.forward(q)[0], kin.twist_jacobian(q)[0]
    lines = []
    for j in np.flatnonzero(turning & (np.linalg.norm(rates[3:], axis=0) > 0.0)).tolist():
        turn = rates[3:, j] / np.linalg.norm(rates[3:, j])
        turn = turn * np.sign(turn[np.abs(turn).argmax()])
        at = tip + np.cross(rates[3:, j], rates[:3, j]) / float(rates[3:, j] @ rates[3:, j])
        at = at - (at @ turn) * turn
        lines.append({"letter": machine.axis_names[j], "point": (at.round(6) + 0.0).tolist(),
                      "direction": (turn.round(6) + 0.0).tolist()})
    return lines


def machine_text(machine: Machine) -> str:
    """The same for people."""
    d = machine_dict(machine)
    lines = [f"{d['name']}: {d['description']}", f"structure {d['structure']}", ""]
    axes = []
    for row in d["axes"]:
        travel = "unlimited" if row["lower"] is None else f"{row['lower']:g} to {row['upper']:g} {row['unit']}"
        axes.append((row["letter"], travel, *(f"{row[key]:g}" for key in ("velocity", "acceleration", "jerk", "home")),
                     f"(assumed: {', '.join(row['assumed'])})" if row["assumed"] else ""))
    lines += table_text(axes, ("axis", "travel", "velocity", "acceleration", "jerk", "home", ""), "llrrrrl")
    lines.append("velocity per s, acceleration per s2, jerk per s3, in mm or degrees")
    zero = "all" if machine.kinematics.straight_slides else "all rotary"
    lines.append(f"table frame: carries the part; with {zero} axes at zero it is the machine's" + (
        ", and" if d["rotary_axes"] else ""))
    for row in d["rotary_axes"]:
        point, along = (", ".join(f"{v:g}" for v in row[key]) for key in ("point", "direction"))
        lines.append(f"  {row['letter']} turns about the line through ({point}) mm along ({along})")
    lines += [words] if (words := workspace_words(machine)) else []
    lines += _sources(machine)
    if d["control"]:
        pins = ", ".join(f"{k} {v:g}" for k, v in d["control"]["pins"].items())
        lines.append(f"the control runs the kinematics {d['control']['module']} ({pins})")
    return "\n".join(lines)


def _sources(machine: Machine) -> list[str]:
    """What comes from documents: a line for each place, the figures of all axes that are from it together."""
    places = dict[str, list[str]]()
    for key, origin in sorted(machine.figures.items()):
        if origin != ASSUMED:
            places.setdefault(origin, []).append(key)
    lines = [f"  {', '.join(keys)}: {origin}" for origin, keys in places.items()]
    lines += [f"  {one.document}: {one.address}" for one in machine.documents if one.address]
    return ["from documents:", *lines] if places else []
