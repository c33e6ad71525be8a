"""A map of the places: seconds where the file was timed, where the part cannot stand, and the choice."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.placement.place import PlacementChoice
from postproc.placement.place_times import TimedPlace
from postproc.placement.region import region_of
from postproc.placement.space import ANGLES, NAMES
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.drawing import ADJACENT, image
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIZE = (9.0, 6.5)
_GRID = 41
_OUTSIDE = "#ead7d5"
_REFUSED, _LOST, _CHOSEN = "#c2453a", "#9aa0a6", "#c2453a"


def placement_figure(choice: PlacementChoice, ending: FigureEnding) -> bytes:
    """An image file of a choice, over the two free coordinates of widest range.

    Args:
        ending: ".png" or ".svg"
    """
    name = choice.work.toolpath.name or Path(choice.work.toolpath.file).stem or "part"
    title = f"{name} on {choice.work.machine.name}: places of the part and planned seconds"
    return image(_SIZE, title, lambda sheet: _fill(sheet, choice), ending)


def _adjacent(choice: PlacementChoice) -> str:
    """Coordinates that are free and not drawn: points that differ only in them lie on each other."""
    drawn = coordinates(choice)
    others = [f"{NAMES[k]} {_shown(choice.best.place[None], k)[0] + 0.0:.3f} {'degrees' if k >= ANGLES else 'mm'}"
              for k in choice.space.free if k not in drawn]
    return f"chosen besides, not drawn: {', '.join(others)}" if others else ""


def _fill(sheet: Figure, choice: PlacementChoice) -> None:
    place = sheet.add_subplot(1, 1, 1)
    across, up = coordinates(choice)
    _ground(place, choice, across, up)
    every = [one for one in choice.known if one is not choice.found.now]
    refused = [one for one in every if one.refused]
    lost = [one for one in every if not one.refused and not np.isfinite(one.seconds)]
    timed = sorted((one for one in every if np.isfinite(one.seconds)), key=lambda one: -one.seconds)
    _points(place, refused, across, up, marker="x", color=_REFUSED, s=28,
            label=f"cannot stand there ({len(refused)})")
    _points(place, lost, across, up, marker=".", color=_LOST, s=28,
            label=f"cannot be faster, not planned ({len(lost)})")
    if timed:
        dots = _points(place, timed, across, up, c=[one.seconds for one in timed], cmap="viridis_r", s=46,
                       edgecolors="#333333", linewidths=0.4, label=f"planned ({len(timed)})")
        sheet.colorbar(dots, ax=place, label="planned seconds of the file", location="bottom", shrink=0.7)
    _points(place, [choice.found.now], across, up, marker="s", facecolors="none", edgecolors="#333333", s=150,
            label="now: [part] of the set-up")
    _points(place, [choice.best], across, up, marker="*", color=_CHOSEN, s=230, label="chosen", zorder=4)
    place.set_title(_adjacent(choice), fontsize="medium")
    place.set_xlabel(_named(across))
    place.set_ylabel("" if up is None else _named(up))
    place.legend(**ADJACENT)


def coordinates(choice: PlacementChoice) -> tuple[int, int | None]:
    """The free coordinates that are drawn: those of which the places that were looked at spread most."""
    free = sorted(choice.space.free, key=lambda k: (-_spread(choice, k), k))
    return (free[0], None) if len(free) == 1 else (min(free[:2]), max(free[:2]))


def _ground(place: Any, choice: PlacementChoice, across: int, up: int | None) -> None:
    """What travel rules out, the other coordinates as they are chosen."""
    if up is None:
        return
    first, second = (np.linspace(choice.space.dims[k].low, choice.space.dims[k].high, _GRID) for k in (across, up))
    at = np.tile(choice.best.place, (_GRID, _GRID, 1))
    at[:, :, across], at[:, :, up] = first[None, :], second[:, None]
    margin = margins_at(choice, at.reshape(-1, len(NAMES))).reshape(_GRID, _GRID)
    units = [DEG if k >= ANGLES else 1.0 for k in (across, up)]
    if (margin < 0.0).any():
        place.contourf(first / units[0], second / units[1], margin, levels=[-np.inf, 0.0], colors=[_OUTSIDE])
        place.scatter([], [], marker="s", s=90, color=_OUTSIDE, label="outside travel, or beyond the table")


def margins_at(choice: PlacementChoice, places: Floats) -> Floats:
    """(N,) mm of travel margin at places (N, 6); negative where the part hangs over its table, or cannot be turned so."""
    result = np.full(len(places), -1.0)
    angles, group = np.unique(places[:, ANGLES:], axis=0, return_inverse=True)
    for k, one in enumerate(angles):
        rows = np.flatnonzero(group.ravel() == k)
        region, _ = region_of(choice.work, choice.space, one, choice.work.setup.joints.singular_distance)
        if region is not None:
            on = np.array([not choice.space.overhang(places[row]) for row in rows])
            result[rows[on]] = region.margins(places[rows[on]][:, :ANGLES])
    return result


def _spread(choice: PlacementChoice, k: int) -> float:
    """Range of a coordinate, a whole turn as much as 200 mm."""
    dim = choice.space.dims[k]
    return (dim.high - dim.low) * (200.0 / (2.0 * np.pi) if k >= ANGLES else 1.0)


def _points(place: Any, tried: list[TimedPlace], across: int, up: int | None, **how: Any) -> Any:
    at = np.array([one.place for one in tried]).reshape(-1, len(NAMES))
    if not len(at):
        return None
    return place.scatter(_shown(at, across), np.zeros(len(at)) if up is None else _shown(at, up), **how)


def _shown(at: Floats, k: int) -> Floats:
    return np.asarray(at[:, k] / DEG if k >= ANGLES else at[:, k])


def _named(k: int) -> str:
    return f"{NAMES[k]}, degrees" if k >= ANGLES else f"{NAMES[k]} of the placed point in the table frame, mm"
