"""The figures of the page as PNG and SVG, drawn without a browser from the report alone."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.page import quantity_drawings
from postproc.page.columns import unpacked
from toolpaths.arrays import Floats
from toolpaths.drawing import FORMATS, image, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = ("path", "time", "axes", "travel", *quantity_drawings.KINDS)
SIZE = (10.0, 7.0)
"""inches"""
MOST = 20_000
"""points of a curve"""
COLOURS = ("#0072b2", "#d55e00", "#008060", "#8c3c82", "#785e00", "#1e8cbe", "#5a46a0", "#6e6e6e")
"""safe for colour-blind readers (after Okabe and Ito 2008), dark enough on white"""
RIGHT, UP = np.array([0.765, 0.644, 0.0]), np.array([-0.375, 0.445, 0.813])
"""unit directions of the sheet in the part frame, seen from the front and above"""


def names(runs: int) -> list[str]:
    """Files that a report of so many runs may have."""
    return [f"{kind}-{k + 1}{ending}" for k in range(runs) for kind in KINDS for ending in FORMATS]


def drawings(report: dict[str, Any]) -> dict[str, bytes]:
    """File name to image of every figure; of runs that were not converted none."""
    made = dict[str, bytes]()
    for k, run in enumerate(report["runs"]):
        if run["points"] is None:
            continue
        columns = unpacked(base64.b64decode(run["points"]["data"]), run["points"]["columns"])
        title = f"{report['part']} on {run['machine']}, {run['controller']}"
        for kind, fill in _fills(run, columns).items():
            for ending in FORMATS:
                made[f"{kind}-{k + 1}{ending}"] = image(SIZE, f"{title}: {kind.replace('path-', 'path by ')}", fill, ending)
    return made


def _fills(run: dict[str, Any], columns: dict[str, Floats]) -> dict[str, Callable[[Figure], None]]:
    return {"path": lambda sheet: _path(sheet, run, columns), "time": lambda sheet: _time(sheet, run),
            "axes": lambda sheet: _axes(sheet, run, columns), "travel": lambda sheet: _travel(sheet, run),
            **quantity_drawings.fills(run, columns)}


def _path(sheet: Figure, run: dict[str, Any], columns: dict[str, Floats]) -> None:
    """The path from the front and above, by operation; rapids grey."""
    place = sheet.subplots()
    tip = np.stack([columns[f"part {name}"] for name in "xyz"], axis=1)
    flat = np.stack([tip @ RIGHT, tip @ UP], axis=1)
    step = max(1, len(flat) // MOST)
    operations = run["conversion"]["time"]["operations"]
    cuts = columns["kind"] > 0
    for n, one in [(-1, None), *enumerate(operations)]:
        on = ~cuts if one is None else cuts & (columns["operation"] == n)
        if on[1:].any():
            drawn = np.where((np.append(on[1:], False) | on)[:, None], flat, np.nan)  # a piece begins at the point before it
            name = "rapids and linking moves" if one is None else plain(one["operation"] or "without a name")[:40]
            place.plot(*drawn[::step].T, linewidth=0.5, color=COLOURS[n % len(COLOURS)] if one else "#9a9a9a", label=name,
                       zorder=2 if one else 1)
    if cuts.any():
        low, high = flat[cuts].min(axis=0), flat[cuts].max(axis=0)
        room = 0.15 * float((high - low).max()) + 1.0
        place.set_xlim(low[0] - room, high[0] + room)
        place.set_ylim(low[1] - room, high[1] + room)
    place.set_aspect("equal")
    place.set_xlabel("mm, seen from the front and above")
    place.set_ylabel("mm")
    place.legend(loc="upper right", fontsize="small")


def _time(sheet: Figure, run: dict[str, Any]) -> None:
    """Each cause begins where the one before ends."""
    place = sheet.subplots()
    known = run["conversion"]["time"]["causes"]
    causes = [(name.removesuffix("_s").replace("_", " "), value) for name, value in known.items() if value > 0.0]
    begin = np.concatenate([[0.0], np.cumsum([value for _, value in causes])])
    for k, (name, value) in enumerate(causes):
        place.barh(name, value, left=begin[k], color=COLOURS[k % len(COLOURS)])
        place.text(begin[k] + value, k, f" {value:.2f} s", va="center", fontsize="small")
    place.barh("all", begin[-1], color="#50575f")
    place.text(begin[-1], len(causes), f" {begin[-1]:.2f} s", va="center", fontsize="small")
    place.invert_yaxis()
    place.set_xlim(0.0, 1.15 * float(begin[-1]) or 1.0)
    place.set_xlabel("time, s")


def _axes(sheet: Figure, run: dict[str, Any], columns: dict[str, Floats]) -> None:
    """Position of every axis over time, its travel as dashed lines where the axis comes near it."""
    places = np.atleast_1d(sheet.subplots(len(run["axes"]), 1, sharex=True))
    at = np.cumsum(columns["time step"]) / 1e3
    step = max(1, len(at) // MOST)
    for place, axis in zip(places, run["axes"], strict=True):
        values = columns[axis["letter"]]
        place.plot(at[::step], values[::step], color=COLOURS[0], linewidth=0.8)
        low, high = float(values.min()), float(values.max())
        for end in axis["travel"]:
            if end is not None and low - 0.3 * (high - low) <= end <= high + 0.3 * (high - low):
                place.axhline(end, color=COLOURS[1], linestyle="--", linewidth=0.8)
        place.set_ylabel(f"{axis['letter']}, {axis['unit']}")
    places[-1].set_xlabel("time, s")


def _travel(sheet: Figure, run: dict[str, Any]) -> None:
    """Travel that the program uses, as a share of each axis's travel."""
    place = sheet.subplots()
    for k, axis in enumerate(run["axes"]):
        low, high = axis["travel"]
        if axis["used_percent"] is None:
            place.text(1.0, k, "no ends" if axis["used"] else "not used", va="center", fontsize="small")
            place.barh(axis["letter"], 0.0)
            continue
        begin, end = (100.0 * (value - low) / (high - low) for value in axis["used"])
        place.barh(axis["letter"], 100.0, color="#e3e7ec")
        place.barh(axis["letter"], max(end - begin, 0.3), left=begin, color=COLOURS[0])
        place.text(101.0, k, f"{axis['used'][0]:.2f} to {axis['used'][1]:.2f} {axis['unit']}", va="center", fontsize="small")
    place.invert_yaxis()
    place.set_xlim(0.0, 140.0)
    place.set_xlabel("share of the travel, %")
