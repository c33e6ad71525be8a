"""The candidates of a pass as a map: tilt of the tool from the CL's axis outwards, azimuth around."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.reaches import least_under
from postproc.orientation.candidates.rejections import KINDS
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.passes.reasons import RejectionKind
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PolarAxes = Any
MARKS: dict[RejectionKind, tuple[str, str]] = {"limits": ("x", "#7a6a00"), "reach": ("v", "#555555"),
                                               "travel": ("+", "#c2453a"),
                                               "touches": ("X", "#000000"), "bound": ("d", "#ffffff")}
"""of candidates that were not planned"""
WIDER = 1.5
"""of the tilt of the planned candidates: refused ones beyond are only counted"""
ROUND, OUT = 73, 25
"""grid of the ground"""
LEVELS = 12
FLAT = 1e-3
"""part by which times differ that are not to be distinguished"""


def axes_map(sheet: Figure, place: PolarAxes, tried: PassSearch, made: Candidate, work: PassContext) -> None:
    """Candidates by what became of them; planned ones coloured by their time, on the ground of what the reach allows."""
    frame = _frame(tried, work)
    groups: dict[RejectionKind, list[Candidate]] = {}
    for other, _, kind in tried.rejected:
        groups.setdefault(kind, []).append(other)
    timed = _once([*groups.get("slower", []), *(one for one in (tried.own, tried.best, made) if np.isfinite(one.seconds))])
    most = WIDER * float(max([_polar(timed, frame, work)[1].max() if timed else 0.0, 20.0]))
    place.set_rlim(0.0, min(most, 180.0))
    noted = _ground(place, tried, frame, work, most)
    _timed(sheet, place, timed, frame, work)
    for kind, (mark, colour) in MARKS.items():
        if kind in groups:
            azimuth, tilt = _polar(groups[kind], frame, work)
            out = int((tilt > most).sum())
            label = f"{KINDS[kind]} ({len(tilt)}" + (f", {out} farther out)" if out else ")")
            edge = {"edgecolors": "#333333"} if kind == "bound" else {}
            place.scatter(azimuth[tilt <= most], tilt[tilt <= most], marker=mark, s=26, color=colour, linewidths=1.0,
                          label=label, **edge)
    for it, mark, name, size in ((tried.aimed, "^", "vertex-aligned", 110), (tried.best, "*", "best", 190),
                                 (made, "o", "plan", 150)):
        if it is not None:
            place.scatter(*_polar([it], frame, work), marker=mark, s=size, facecolors="none", edgecolors="#c2453a",
                          linewidths=1.3, label=name, zorder=4)
    place.set_title("tool axes tried: degrees from the CL axis outwards,\n"
                    f"azimuth about it from {_named(frame[1])} to {_named(frame[2])} of the part{noted}", fontsize="small")
    place.tick_params(labelsize="x-small")
    place.legend(loc="upper center", bbox_to_anchor=(0.6, -0.08), ncols=2, fontsize="x-small", frameon=False)


def _ground(place: PolarAxes, tried: PassSearch, frame: tuple[Floats, ...], work: PassContext,
            most: float) -> str:
    """What the reach along the mean direction allows, dark where it is fast; a line for the title."""
    around, out = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, ROUND), np.linspace(0.0, most, OUT))
    least = _least(tried, frame, work, around, out)
    known = least[np.isfinite(least)]
    if not len(known) or np.ptp(known) <= FLAT * known.max():
        return ""
    low, high = float(known.min()), float(known.max())
    drawn = place.contourf(around, out, np.ma.masked_invalid(least), LEVELS, cmap="Greys_r", vmin=low - 0.6 * (high - low),
                           vmax=high)
    drawn.set_rasterized(True)
    return f"\nground: least seconds by the reach, {low:.3g} (dark) to {high:.3g}"


def _timed(sheet: Figure, place: PolarAxes, timed: list[Candidate], frame: tuple[Floats, ...],
           work: PassContext) -> None:
    """The planned candidates, coloured by their time."""
    if not timed:
        return
    times = np.array([one.seconds for one in timed])
    drawn = place.scatter(*_polar(timed, frame, work), c=times, s=34, edgecolors="black", linewidths=0.6, zorder=3,
                          cmap="viridis", vmin=times.min(), vmax=max(times.max(), (1.0 + FLAT) * times.min()),
                          label=f"planned ({len(times)})")
    sheet.colorbar(drawn, ax=place, shrink=0.75, pad=0.12).set_label("planned seconds", fontsize="small")


def _least(tried: PassSearch, frame: tuple[Floats, ...], work: PassContext, around: Floats,
           out: Floats) -> Floats:
    """Least seconds by the reach (M, K) at azimuths, rad, and tilts, degrees (M, K); NaN for a fixed pass."""
    if tried.own.one.fixed:
        return np.full(around.shape, np.nan)
    own, x, y = frame
    tilt, azimuth = (out * DEG)[..., None], around[..., None]
    axes = np.cos(tilt) * own + np.sin(tilt) * (np.cos(azimuth) * x + np.sin(azimuth) * y)
    return least_under(tried.own, work.placement.directions(axes.reshape(-1, 3))).reshape(around.shape)


def _once(made: list[Candidate]) -> list[Candidate]:
    return list({id(one): one for one in made}.values())


def _frame(tried: PassSearch, work: PassContext) -> tuple[Floats, Floats, Floats]:
    """The CL's axis, and the directions of azimuth 0 and 90 degrees square to it, frame of the part: part x,
    or y where the axis lies along x."""
    own = work.placement.inverse().directions(tried.own.axis[None])[0]
    first = np.eye(3)[0 if abs(own[0]) < 0.9 else 1]
    x = first - (first @ own) * own
    x /= np.linalg.norm(x)
    return own, x, np.cross(own, x)


def _polar(made: list[Candidate], frame: tuple[Floats, ...], work: PassContext) -> tuple[Floats, Floats]:
    """Azimuth, rad, and tilt, degrees (N,) of tool axes."""
    own, x, y = frame
    axis = work.placement.inverse().directions(np.stack([one.axis for one in made]))
    return np.arctan2(axis @ y, axis @ x), angle_between(axis, own) / DEG


def _named(travel: Floats) -> str:
    """The axis of the part that a direction is nearest to."""
    k = int(np.abs(travel).argmax())
    return ("+" if travel[k] > 0.0 else "-") + "xyz"[k] + ("" if abs(travel[k]) > 1.0 - 1e-9 else " (about)")
