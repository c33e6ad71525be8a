"""The measured place of a part as figures and as text."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.alignment.align import COVERAGE, AlignedPart
from postproc.alignment.control_entry import fixed_turns
from postproc.alignment.fit import NAMES, Alignment
from postproc.control.control import MODE_NAMES
from toolpaths.arrays import finite
from toolpaths.table_text import table_text
from toolpaths.units import DEG


def as_dict(made: AlignedPart) -> dict[str, Any]:
    """The keys of `setup align --json`; mm, degrees."""
    found, nominal = made.found, made.nominal
    return {
        "readings": len(found.readings) if found else 0,
        "shift_mm": found.values[:3].tolist() if found else None,
        "turns_deg": list(fixed_turns(found.move.rotation)) if found else None,
        "sigma": {name: finite(sigma / (1.0 if name in "xyz" else DEG))
                  for name, sigma in zip(NAMES, found.sigma.tolist(), strict=True)} if found else None,
        "undetermined": found.undetermined if found else [],
        "worst_reading_mm": found.worst[0] if found else None,
        "worst_reading_line": found.worst[1] if found else None,
        "uncertainty_mm": made.uncertainty, "coverage": COVERAGE,
        "part": made.part.model_dump(mode="json") if made.part else None,
        "nominal_program": None if nominal is None else {
            "tip_mm": nominal.tip, "tip_touched_off_mm": nominal.touched_off, "axis_deg": nominal.axis},
        "modes": [{"mode": one.mode, "converted": one.converted, "refused": one.refused or None,
                   "rotary_deg": {name: list(pair) for name, pair in one.rotary.items()},
                   "corrected_by_control": one.by_control and bool(made.entry)} for one in made.modes],
        "entry": list(made.entry),
    }


def as_text(made: AlignedPart) -> str:
    """For people."""
    found, nominal = made.found, made.nominal
    if found is None or nominal is None:
        return ""
    lines = [*_place(found), f"what is cut is known to {made.uncertainty:.4f} mm (k = {COVERAGE:g})",
             f"the program for the nominal place would be off by {nominal.tip:.4f} mm, by {nominal.touched_off:.4f} mm with "
             f"the origin touched off again; its tool axis by {nominal.axis:.4f} degrees"]
    rows = [("output mode", "program for the measured place", "nominal program, corrected by the control")]
    for one in made.modes:
        rotary = ", ".join(f"{name} {low:.4f} to {high:.4f}" for name, (low, high) in one.rotary.items())
        done = "proved" + (f", {rotary}" if rotary else "") if one.converted else f"refused: {one.refused}"
        by_control = _by_control(one.by_control, bool(made.entry), bool(one.rotary), nominal.axis)
        rows.append((MODE_NAMES[one.mode], done, by_control))
    lines += table_text(rows)
    if made.entry:
        lines += ["instead of a new program, not proved here:", *(f"  {line}" for line in made.entry)]
    else:
        lines.append("the control cannot turn its work offset so: convert with the new set-up")
    return "\n".join(lines)


def _by_control(corrects: bool, entered: bool, rotary: bool, axis: float) -> str:
    """What becomes of the nominal program where the control corrects the place."""
    if not entered:
        return "no"
    if corrects:
        return "yes, rotary axes with it"
    return f"frame alone, at rotary axes 0; the tool axis stays {axis:.4f} degrees off" if rotary or axis else "yes"


def _place(found: Alignment) -> list[str]:
    """Shift, turns and their uncertainty; what is left of the readings."""
    values, sigma = found.values, found.sigma
    shift = [f"{name} {v:+.4f}{_known(s, 1.0)}" for name, v, s in zip("XYZ", values[:3], sigma[:3], strict=True)]
    turns = [f"{name} {v:+.4f}{_known(s, DEG)}" for name, v, s in zip(
        "ABC", fixed_turns(found.move.rotation), sigma[3:], strict=True)]
    off, line = found.worst
    return [f"the part stands at {', '.join(shift)} mm and is turned by {', '.join(turns)} degrees about X, Y, Z "
            "(middle of the readings; +- k = 2)",
            f"{len(found.readings)} readings, off the place by {off:.4f} mm at most (line {line})"]


def _known(sigma: float, scale: float) -> str:
    return f" +- {COVERAGE * sigma / scale:.4f}" if np.isfinite(sigma) else " (as meant)"
