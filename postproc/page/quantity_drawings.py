"""Figures of the page besides path, time, axes and travel: the path by each quantity, feed over time, limits changed,
geometric errors, the polytope of a pass; drawn from the report alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Quantity = Literal["feed", "deviation", "correction", "tilt"]
PathReason = Literal["limit", "cause"]
QUANTITIES: dict[Quantity, tuple[str, str]] = {
    "feed": ("feed reached", "mm/min"), "deviation": ("deviation", "um"), "correction": ("correction", "um"),
    "tilt": ("tilt", "deg")}
"""by name: column of the points (that of the tilt is made here), unit"""
KINDS = (*(f"path-{name}" for name in (*QUANTITIES, "limit", "cause")), "feed", "what-if", "errors", "polytope")
MOST = 20_000
"""points of a curve"""
VIEW = np.array([[0.765, 0.644, 0.0], [-0.375, 0.445, 0.813]])
"""unit directions of the sheet in the part frame, seen from the front and above"""
COLOURS = ("#0072b2", "#d55e00", "#008060", "#8c3c82", "#785e00", "#1e8cbe", "#5a46a0", "#6e6e6e")
"""safe for colour-blind readers (after Okabe and Ito 2008), dark enough on white"""

SOLIDS = (("cl_file", "#6b7280", "--", "axis of the CL file"), ("chosen", COLOURS[0], "-", "chosen axis"))
Fill = Callable[["Figure"], None]


def fills(run: dict[str, Any], columns: dict[str, Floats]) -> dict[str, Fill]:
    """What fills each sheet of which the run has figures, by its name in `KINDS`."""
    made: dict[str, Fill] = {f"path-{name}": partial(_valued, run, columns, name) for name in QUANTITIES
                             if name != "correction" or "correction" in columns}
    made |= {"path-limit": partial(_named, run, columns, "limit"), "path-cause": partial(_named, run, columns, "cause"),
             "feed": lambda sheet: _feed(sheet, columns)}
    what_if, chosen = run["what_if"], run["orientation"]
    if what_if and what_if["counted"] and what_if["limits"]:
        made["what-if"] = lambda sheet: _what_if(sheet, what_if)
    if run["errors"]:
        made["errors"] = lambda sheet: _errors(sheet, run["errors"])
    if chosen and any(one and (one["cl_file"] or one["chosen"]) for one in chosen["polytopes"]):
        made["polytope"] = lambda sheet: _polytope(sheet, chosen)
    return made


def _pieces(columns: dict[str, Floats]) -> tuple[Floats, Ints]:
    """Both ends (N, 2, 2) mm on the sheet of every piece that cuts, and the point (N,) where each ends; at most MOST."""
    flat = np.stack([columns[f"part {name}"] for name in "xyz"], axis=1) @ VIEW.T
    ends = np.flatnonzero(columns["kind"] > 0)
    ends = ends[ends > 0]
    ends = ends[::max(1, -(-len(ends) // MOST))]
    return np.stack([flat[ends - 1], flat[ends]], axis=1), ends


def _place(sheet: Figure, pieces: Floats) -> Any:
    place = sheet.subplots()
    if len(pieces):
        low, high = pieces.min(axis=(0, 1)), pieces.max(axis=(0, 1))
        room = 0.08 * float((high - low).max()) + 1.0
        place.set_xlim(low[0] - room, high[0] + room)
        place.set_ylim(low[1] - room, high[1] + room)
    place.set_aspect("equal")
    place.set_xlabel("mm, seen from the front and above")
    place.set_ylabel("mm")
    return place


def _valued(run: dict[str, Any], columns: dict[str, Floats], name: Quantity, sheet: Figure) -> None:
    """The cuts in the colours of a scale; grey where there is no figure."""
    from matplotlib.collections import LineCollection

    (pieces, at), (column, unit) = _pieces(columns), QUANTITIES[name]
    values = tilt(run, columns)[at] if name == "tilt" else columns[column][at]
    place, known = _place(sheet, pieces), np.isfinite(values)
    place.add_collection(LineCollection(list(pieces[~known]), colors="#9a9a9a", linewidths=0.8))
    if known.any():
        drawn = LineCollection(list(pieces[known]), array=values[known], cmap="viridis", linewidths=0.9)
        place.add_collection(drawn)
        sheet.colorbar(drawn, ax=place, label=f"{column}, {unit}")


def _named(run: dict[str, Any], columns: dict[str, Floats], name: PathReason, sheet: Figure) -> None:
    """The cuts by what limits them, or by where their time goes."""
    from matplotlib.collections import LineCollection

    pieces, at = _pieces(columns)
    place, values = _place(sheet, pieces), columns[name][at].astype(np.int64)
    for k, value in enumerate(np.unique(values).tolist()):
        text = run["causes"][value].replace("_", " ") if name == "cause" else _limit(run, value)
        colour = COLOURS[k % len(COLOURS)]
        place.add_collection(LineCollection(list(pieces[values == value]), colors=colour, linewidths=0.9, label=text))
    place.legend(loc="upper right", fontsize="small")


def _limit(run: dict[str, Any], value: int) -> str:
    orders = ("velocity", "acceleration", "jerk")
    return "programmed feed" if value < 0 else f"{run['axes'][value // 3]['letter']} {orders[value % 3]}"


def tilt(run: dict[str, Any], columns: dict[str, Floats]) -> Floats:
    """(N,) degrees between the tool axis and z of the part at each point: as the axes of a chain turn it, else as it is
    given."""
    skeleton = run["skeleton"]
    if skeleton is None:
        return np.asarray(np.arccos(np.clip(columns["axis k"], -1.0, 1.0)) / DEG)
    axis = np.tile(np.array(skeleton["tool_axis"], dtype=np.float64), (len(columns["kind"]), 1))
    for joint in reversed(skeleton["axes"]):
        if joint["turns"]:
            u, angle = np.array(joint["direction"]), columns[joint["letter"]] * DEG
            c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
            axis = c * axis + s * np.cross(u, axis) + (1.0 - c) * (axis @ u)[:, None] * u
    return np.asarray(np.arccos(np.clip(axis @ np.array(skeleton["table_from_part"]["rotation"])[:, 2], -1.0, 1.0)) / DEG)


def _feed(sheet: Figure, columns: dict[str, Floats]) -> None:
    """Feed of the cuts over time as it is programmed and as it is reached in the mean from point to point."""
    place, at = sheet.subplots(), np.cumsum(columns["time step"]) / 1e3
    step, cuts = max(1, len(at) // MOST), columns["kind"] > 0
    for name, colour in (("feed programmed", COLOURS[1]), ("feed reached", COLOURS[0])):
        shown = np.where(cuts, columns[name], np.nan)[::step]
        place.step(at[::step], shown, where="pre", color=colour, linewidth=0.9, label=name)
    place.set_xlabel("time, s")
    place.set_ylabel("feed, mm/min")
    place.legend(loc="upper right", fontsize="small")


def _what_if(sheet: Figure, found: dict[str, Any]) -> None:
    place = sheet.subplots()
    for k, one in enumerate(found["limits"]):
        name = f"{one['axis']} {one['limit']}"
        place.plot(found["factors"], one["seconds"], marker="o", color=COLOURS[k % len(COLOURS)], label=name)
    place.set_xlabel("factor of one limit, the others as they are, 1 = as it is")
    place.set_ylabel("time, s")
    place.legend(fontsize="small")


def _errors(sheet: Figure, found: dict[str, Any]) -> None:
    """Vectors of the geometric errors from places of the part, before and after correction, on one scale."""
    place, tip = sheet.subplots(), np.array([one["part_mm"] for one in found["places"]]) @ VIEW.T
    size = max(float(np.ptp(tip, axis=0).max()), 1.0)
    scale = 0.12 * size / max(found["worst_before_um"], 1e-9)
    for key, colour, text in (("vector_um", COLOURS[1], "before"), ("vector_after_um", COLOURS[0], "after")):
        vector = scale * np.array([one[key] for one in found["places"]]) @ VIEW.T
        place.quiver(*tip.T, *vector.T, angles="xy", scale_units="xy", scale=1.0, color=colour, width=0.0025, label=text)
    place.plot(*tip.T, linestyle="", marker=".", markersize=2.0, color="#50575f")
    known = found["uncertainty_k2_um"]
    place.set_aspect("equal")
    place.margins(0.15)
    place.set_xlabel(f"mm, seen from the front and above; longest error {found['worst_before_um']:.2f} um before, "
                     f"{found['worst_after_um']:.3f} um after correction"
                     + ("" if known is None else f", uncertainty (k = 2) {known:.2f} um"))
    place.set_ylabel("mm")
    place.legend(fontsize="small")


def _polytope(sheet: Figure, chosen: dict[str, Any]) -> None:
    """What the axes allow the tip in each direction in the pass that gains most, under both axes."""
    drawn = [k for k, one in enumerate(chosen["polytopes"]) if one and (one["cl_file"] or one["chosen"])]
    k = chosen["most_gaining"] if chosen["most_gaining"] in drawn else drawn[0]
    one, place = chosen["polytopes"][k], sheet.subplots()
    for key, colour, style, text in SOLIDS:
        solid = one[key]
        if solid is None:
            continue
        corners, reach = np.array(solid["corners"]) @ VIEW.T, VIEW @ np.array(solid["reach"])
        for a, b in solid["edges"]:
            place.plot(*corners[[a, b]].T, color=colour, linestyle=style, linewidth=1.0)
        label = f"{text}: {solid['rate']:.3g} {one['unit']} along the cut"
        place.plot([0.0, reach[0]], [0.0, reach[1]], color=colour, linestyle=style, linewidth=2.5, marker="o",
                   markevery=[1], label=label)
    place.set_aspect("equal")
    place.set_xlabel(f"largest {one['order']} of the tip in each direction, {one['unit']}; pass "
                     f"{chosen['passes'][k]['pass']}, line {chosen['passes'][k]['line']}, seen from the front and above")
    place.set_ylabel(one["unit"])
    place.legend(fontsize="small")
