"""The choice as figures and as text."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from postproc.placement.place import PlacementChoice
from postproc.placement.place_times import TimedPlace
from postproc.placement.space import ANGLES, NAMES
from toolpaths.arrays import Floats, finite
from toolpaths.table_text import table_text
from toolpaths.units import DEG

_SHOWN = 5
_APART = 5.0 * DEG


def as_dict(choice: PlacementChoice) -> dict[str, Any]:
    """JSON figures: mm, degrees, seconds; null where the machine cannot run the file or an axis has no end."""
    return {"machine": choice.work.machine.name,
            "now": _place(choice, choice.found.now), "best": _place(choice, choice.best),
            "part": {"origin": list(choice.part.origin), "x_axis": list(choice.part.x_axis),
                     "y_axis": list(choice.part.y_axis)},
            "gain": finite(_gain(choice)),
            "program_s": dict(zip(("now", "best"), map(finite, choice.program), strict=True)),
            "on_the_control": _on_the_control(choice),
            "attitudes": choice.found.attitudes, "places_screened": choice.found.screened,
            "places_looked_at": choice.looked, "places_refused": choice.refused, "places_pruned": choice.pruned,
            "cuts_planned": choice.planned,
            "turned": [_degrees(one.place[ANGLES:]) | {"time_s": finite(one.seconds)} for one in _turned(choice)],
            "without_place": [_degrees(angles) | {"lacks_mm": finite(-margin), "reason": str(why)}
                              for angles, margin, why in choice.found.lacks]}


def _on_the_control(choice: PlacementChoice) -> dict[str, Any] | None:
    """Model and bands of the programs' times; None where the best place has none."""
    now, best = choice.times
    if best is None:
        return None
    return {"model": best.model, "best_band_s": list(best.band), "now_band_s": None if now is None else list(now.band)}


def _place(choice: PlacementChoice, one: TimedPlace) -> dict[str, Any]:
    machine = choice.work.machine
    units = np.where(machine.rotary, 1.0 / DEG, 1.0)
    margins = dict(zip(machine.axis_names, map(finite, (one.margins(machine) * units).tolist()), strict=True))
    return dict(zip(NAMES[:ANGLES], one.place[:ANGLES].tolist(), strict=True)) | _degrees(one.place[ANGLES:]) | {
        "time_s": finite(one.seconds), "cutting_s": finite(one.cutting), "linking_s": finite(one.linking),
        "travel_margin": margins, "singular_distance": finite(one.singular), "limiting_s": one.limiting,
        "refused": str(one.refused or "")}


def _degrees(angles: Floats) -> dict[str, Any]:
    return {f"{name}_deg": float(value) / DEG for name, value in zip(NAMES[ANGLES:], angles, strict=True)}


def _gain(choice: PlacementChoice) -> float:
    """Share of the time that is saved."""
    return 1.0 - choice.best.seconds / choice.found.now.seconds if math.isfinite(choice.found.now.seconds) else math.nan


def as_text(choice: PlacementChoice) -> str:
    """Before and after, margins, what was tried."""
    free = [NAMES[k] for k in choice.space.free]
    rows = []
    for name, one in (("[part]", choice.found.now), ("placed", choice.best)):
        x, y, z, turn = one.place[:4]
        figures = ((f"{one.seconds:.3f}", f"{one.cutting:.3f}", f"{one.linking:.3f}", "") if math.isfinite(one.seconds)
                   else ("-", "-", "-", str(one.refused or "")))
        rows.append((name, *(f"{round(value, 3) + 0.0:.3f}" for value in (x, y, z, turn / DEG)), *figures))
    lines = table_text(rows, ("", "x mm", "y mm", "z mm", "turn deg", "seconds", "cuts", "linking", ""),
                       "lrrrrrrrl")
    gain = _gain(choice)
    if math.isfinite(gain):
        lines.append(f"planned time saved: {100.0 * gain:.2f} %")
    if all(map(math.isfinite, choice.program)):
        before, after = choice.program
        known = _on_the_control(choice)
        where = "" if known is None else f" on the control ({known['model']}, 95 % {known['best_band_s'][0]:.2f} to " \
                                         f"{known['best_band_s'][1]:.2f} s)"
        lines.append(f"the program, links included: {before:.3f} s at [part], {after:.3f} s as placed{where}")
    lines.append("margin of travel: " + ", ".join(_margins(choice)))
    if choice.best.limiting:
        worst = max(choice.best.limiting, key=lambda name: choice.best.limiting[name])
        lines.append(f"limited by {worst} over {choice.best.limiting[worst]:.3f} s of the cuts")
    turned = _turned(choice)[1:_SHOWN]
    if turned:
        others = (f"{one.place[ANGLES] / DEG:.3f} deg {one.seconds:.3f} s" for one in turned)
        lines.append("best places turned otherwise: " + ", ".join(others))
    lines.append(f"free: {', '.join(free)}; {choice.found.attitudes} part orientations; {choice.looked} places looked "
                 f"at: at {choice.refused} it cannot stand, {choice.pruned} cannot be faster than the best; "
                 f"{choice.planned} cuts planned")
    return "\n".join(lines)


def _turned(choice: PlacementChoice) -> list[TimedPlace]:
    """The best place of each orientation of the part, those within a few degrees as one; the best first."""
    good = [one for one in choice.known if math.isfinite(one.seconds) and choice.space.holds(one.place)]
    kept = [choice.best]
    for one in sorted(good, key=lambda one: one.seconds):
        if all(float(np.abs(one.place - other.place)[ANGLES:].max()) > _APART for other in kept):
            kept.append(one)
    return kept


def _margins(choice: PlacementChoice) -> list[str]:
    machine = choice.work.machine
    result = [f"{name} {value / DEG:.3f} deg" if rotary else f"{name} {value:.3f} mm"
              for name, value, rotary in zip(machine.axis_names, choice.best.margins(machine).tolist(), machine.rotary,
                                             strict=True) if math.isfinite(value)]
    if math.isfinite(choice.best.singular):
        result.append(f"singular positions {choice.best.singular:.3f}")
    return result
