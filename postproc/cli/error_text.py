"""Figures of error models and of their exchange, as text for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from toolpaths.table_text import table_text

if TYPE_CHECKING:
    from pathlib import Path

    from machines.geometric_error.actual.model import ErrorModel
    from machines.geometric_error.exchange.exports import MadeMap, NotOfJoint, Screws
    from toolpaths.diagnostics import Diagnostic

_NOT_OF_JOINT: dict[NotOfJoint, str] = {
    "leans": "its axis leans, and the error is not about the axis",
    "reference off the axis": "the reference point of its axis lies next to the axis: the error moves the tool sideways too"}


def check_text(file: str, found: dict[str, Any]) -> str:
    """What `machines.geometric_error.exchange.survey` gives."""
    who = {"post": "corrected by the post-processor", "control": "corrected by the control"}[found["corrected_by"]]
    lines = [f"{file}: OK: errors of {found['machine']}, {found['parameters']} parameters, {who}; fingerprint "
             f"{found['fingerprint']}", *_components(found)]
    for kind in ("line", "zero position", "spindle"):
        mine = [f"{n} {v['value']:.3g} {v['unit']}" for n, v in found["location"].items() if v["kind"] == kind]
        lines += [f"{kind}: {', '.join(mine)}"] if mine else []
    lines += [f"legs: largest {kind} {v['largest']:.3g} {v['unit']} ({v['parameter']})" for kind, v in found["legs"].items()]
    lines += _map(found["map"]) if found["map"] else []
    return "\n".join([*lines, *_covariance(found["covariance"]), *_volume(found["volume"])])


def _components(found: dict[str, Any]) -> list[str]:
    rows = []
    for name, c in found["components"].items():
        span = "everywhere" if c["range"][0] is None else f"{c['range'][0]:g} to {c['range'][1]:g}"
        lost = f"{c['lost_motion']:.2f}" if c["both_ways"] else ""
        rows.append((name, c["kind"], c["values"], span, f"{c['largest']:.2f}", c["unit"], f"{c['at']:.2f}", lost))
    heads = ("error", "kind", "values", "range", "largest", "", "at", "lost motion")
    lines = table_text(rows, heads, "llrlrlrr") if rows else []
    return lines + ([f"not given, so 0: {', '.join(found['absent'])}"] if found["absent"] else [])


def _map(found: dict[str, Any]) -> list[str]:
    point = f"tip of a tool of {found['tool_length_mm']:g} mm" if found["tool_length_mm"] else "gauge point"
    where = "; ".join(f"{letter} {c['nodes']} from {c['range'][0]:g} to {c['range'][1]:g}"
                      + (f", repeats after {c['repeats']:g}" if c["repeats"] else "")
                      for letter, c in found["coordinates"].items())
    largest = ", ".join(f"{name} {v:.3g}" for name, v in found["largest"].items())
    return [f"map of {found['nodes']} nodes ({where}), {point}, directions of the {found['directions']}",
            f"largest {largest} (um, arcsec)"]


def _covariance(found: dict[str, Any] | None) -> list[str]:
    if found is None:
        return ["no covariance: uncertainty unknown"]
    kind = "correlated parameters" if found["correlated"] else "independent parameters"
    without = f"; {len(found['without'])} parameters have none" if found["without"] else ""
    return [f"covariance: {kind}, largest standard deviation {found['largest_um']:.3g} um, {found['largest_arcsec']:.3g} "
            f"arcsec{without}"]


def _volume(found: dict[str, Any] | None) -> list[str]:
    if found is None:
        return ["the model holds nowhere within travel"]
    approaches = "; mean of both directions" if found["ways_at_mean"] else ""
    lines = [f"over the work volume, tool of {found['tool_length_mm']:g} mm, {found['places']} places{approaches}:",
             f"  tip  worst {found['tip_worst_um']:.2f} um at {_at(found['tip_worst_at'])}, rms "
             f"{found['tip_rms_um']:.2f} um",
             f"  axis worst {found['axis_worst_arcsec']:.2f} arcsec at {_at(found['axis_worst_at'])}, rms "
             f"{found['axis_rms_arcsec']:.2f} arcsec", *_residual(found)]
    if "doubt_tip_um" in found:
        lines.append(f"  uncertainty (one standard deviation): tip {found['doubt_tip_um']:.3g} um, axis "
                     f"{found['doubt_axis_arcsec']:.3g} arcsec")
    return lines


def _residual(found: dict[str, Any]) -> list[str]:
    """What correction leaves, and why."""
    by_turns = {0: " (no rotary axis turns the tool)", 1: " (only one rotary axis turns the tool)"}
    why = " (near a pole, within the axis tolerance)" if found["residual_near_pole"] else by_turns.get(found["turns"], "")
    lines = [f"  left after correction: tip {found['residual_tip_worst_um']:.3f} um; axis worst "
             f"{found['residual_axis_worst_arcsec']:.2f} arcsec at {_at(found['residual_axis_worst_at'])}, rms "
             f"{found['residual_axis_rms_arcsec']:.2f} arcsec{why}"]
    return lines + ([f"  {found['residual_lost']} places cannot be reached with the correction"] if found["residual_lost"]
                    else [])


def _at(joints: dict[str, float]) -> str:
    return " ".join(f"{letter}{value:g}" for letter, value in joints.items())


def export_text(found: dict[str, Any]) -> str:
    """What was written, what it loses and what it leaves."""
    return "\n".join([*(f"{name}: written" for name in found["files"]), *found["told"]])


def table_figures(model: ErrorModel, lost: dict[str, float]) -> tuple[dict[str, Any], list[str]]:
    """(figures, text) of tables per axis of a model that lose `lost`, um and arcsec by component."""
    noted = ["dimensions of legs stay in the model file: they have no tables per axis"] if model.rods is not None else []
    for unit, names in (("um", "XYZ"), ("arcsec", "ABC")):
        mine = {name: value for name, value in lost.items() if name[1] in names}
        worst = max(mine, key=lambda name: mine[name], default="")
        noted += [f"lost between the rows: at most {mine[worst]:.3g} {unit} ({worst})"] if worst else []
    return {"losses": lost}, noted


def screw_figures(model: ErrorModel, screws: Screws, names: dict[str, str], lost: dict[str, float],
                  worst: list[tuple[float, float]], tool_length: float) -> tuple[dict[str, Any], list[str]]:
    """(figures, text) of `Screws` of a model in files of these names; `worst` tip (um) and axis (arcsec)
    before and after, with a tool of that length (mm)."""
    before, left = worst
    both = any(table.both for table in screws.tables.values())
    noted = [f"{name}: {len(screws.tables[letter].x)} rows" + (", both directions" if screws.tables[letter].both else "")
             for letter, name in names.items()]
    noted += [f"lost between the rows: {', '.join(f'{name} {value:.3g}' for name, value in lost.items())} (um, arcsec)",
              f"worst over the work volume, tool of {tool_length:g} mm{', mean of both directions' if both else ''}: tip "
              f"{before[0]:.2f} um, {left[0]:.2f} um after; axis {before[1]:.2f} arcsec, {left[1]:.2f} arcsec after"]
    if model.covariance is not None:
        noted.append("lost: the covariance of what these files hold, as they have no place for it; a --rest keeps its own")
    noted += [f"{name} is left: {_NOT_OF_JOINT[why]}" for name, why in screws.left.items()]
    return {"losses": lost, "worst_tip_um": [before[0], left[0]], "worst_axis_arcsec": [before[1], left[1]]}, noted


def screw_notice(names: list[str], file: str, rest: Path | None) -> Diagnostic:
    """That the control now corrects these, and which model the post-processor then takes."""
    from toolpaths.diagnostics import info, warning

    corrected = f"LinuxCNC then corrects {', '.join(names)}: the post-processor must not do it again"
    if rest is None:
        return warning("error-export.control", corrected, file=file,
                       hint="write a model of the rest with --rest, and convert with that")
    return info("error-export.rest", f"{corrected}, {rest.name} holds what is left", file=file,
                hint=f"convert with --error-model {rest}")


def map_figures(model: ErrorModel, made: MadeMap) -> tuple[dict[str, Any], list[str]]:
    """(figures, text) of a `MadeMap` of a model."""
    from machines.geometric_error.tables.csv_table import UNITS

    um, arcsec = UNITS["um"], UNITS["arcsec"]
    lattice = made.lattice
    figures: dict[str, Any] = {"nodes": {x: len(n) for x, n in zip(lattice.letters, lattice.nodes, strict=True)}}
    noted = [f"{lattice.table.size // 6} nodes: " + ", ".join(f"{x} {n}" for x, n in figures["nodes"].items())]
    for key, where, loss in (("lattice", "inside the lattice", made.inside),
                             ("volume", "over the work volume", made.volume)):
        figures[key] = None if loss is None else {
            "tip_worst_um": loss.tip_worst / um, "tip_rms_um": loss.tip_rms / um,
            "axis_worst_arcsec": loss.axis_worst / arcsec, "axis_rms_arcsec": loss.axis_rms / arcsec}
        noted += [] if loss is None else [
            f"lost {where}: tip worst {loss.tip_worst / um:.3g} um, rms {loss.tip_rms / um:.3g} um; axis worst "
            f"{loss.axis_worst / arcsec:.3g} arcsec, rms {loss.axis_rms / arcsec:.3g} arcsec"]
    approaches = [str(c.name) for c in model.axes.components if getattr(c.curve, "both", False)]
    noted += [f"lost: both approach directions of {', '.join(approaches)}; a map holds their mean"] if approaches else []
    if model.covariance is not None:
        noted.append("lost: the covariance, of more values than are written" if made.uncertainty_lost else "covariance kept")
    return figures, noted
