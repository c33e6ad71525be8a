"""The file of a certificate: geometry, region, margins, and every box with what is proved of it; found by a hash.

JSON. A box is a line "path direct inverse held", with "parts stops" behind it where clearances are proved: its path of
halves (`search.HALVES`, "." the whole region) and lower bounds, free of units, of parts mm, of stops rad, rounded down.
The key is the SHA-256 of what the proof rests on in the machine file: the table `[kinematics]` without its clearances.
Shipped certificates stand in `shipped`, by their key; a shop's own next to its machine file, as NAME.certificate.json.
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import numpy as np

from machines.certificate.clearances import PartsOfLegs
from machines.certificate.lookup import WHOLE, key_of
from machines.certificate.search import GAPS, NAMES, AskedProof, ProvedBoxes
from machines.kinematics.holds import Holds
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

FORM = 2
"""of the file; it rises where a key changes its meaning"""
SHARE, DIGITS = 0.95, 1e4
"""of a bound that is stated, and 1 / its last place: what is left lets another computation confirm it"""


@dataclass(frozen=True)
class RegionOfPoses:
    """Whose poses are in the boxes: of the tool's tip or of the platform's reference point."""

    of: str
    tool: float
    whole: bool
    """all of the declared workspace"""


def stated(asked: AskedProof, proved: ProvedBoxes) -> Floats:
    """(N, 3) or (N, 5) bounds as the file has them: rounded down, none below the margin, distances not below 0."""
    least = np.array([asked.margin] * len(NAMES) + [0.0] * (proved.bounds.shape[1] - len(NAMES)))
    return np.asarray(np.maximum(np.floor(SHARE * proved.bounds * DIGITS) / DIGITS, least), dtype=np.float64)


def certificate(name: str, values: Mapping[str, Any], region: RegionOfPoses, asked: AskedProof,
                proved: ProvedBoxes) -> dict[str, Any]:
    """The file's content, of a proof."""
    bounds = stated(asked, proved)
    boxes = [f"{path or '.'} {' '.join(map(repr, row))}" for path, row in zip(proved.paths, bounds.tolist(), strict=True)]
    span = {key: [float(lo), float(hi)] for key, lo, hi in zip(
        ("x_mm", "y_mm", "z_mm", "tilt_rad", "heading_rad"), asked.lower, asked.upper, strict=True)}
    return {
        "certificate": FORM, "key": key_of(values), "covers": WHOLE if region.whole else "region", "machine": name,
        "geometry": geometry_table(asked.poses.legs, asked),
        "region": {"of": region.of, "tool_mm": region.tool} | span,
        "margin": asked.margin, "travel_margin": asked.travel_margin,
        "travel_proved": bool(np.isfinite(asked.travel).any()),
        "proved": dict(zip((*NAMES, *GAPS), bounds.min(axis=0).tolist(), strict=False)),
        "digest": sha256("\n".join(boxes).encode()).hexdigest(), "boxes": boxes}


def geometry_table(legs: LegGeometry, asked: AskedProof) -> dict[str, Any]:
    """The legs as the proof takes them, mm and rad; a travel that is not kept is null."""
    def of(k: int) -> dict[str, Any]:
        drive = "slide" if legs.slide[k] else "arm" if legs.arm[k] else "length"
        return {"letter": legs.names[k], "drive": drive, "point": legs.points[k].tolist(),
                "direction": legs.directions[k].tolist(), "arm": legs.arms[k].tolist(), "joint": legs.joints[k].tolist(),
                "rod": float(legs.lengths[k]), "root": float(legs.roots[k]), "pair": legs.pairs[k].tolist(),
                "travel": _ends(asked.travel[k])} | (
                    {} if legs.kept is None else {"bar": legs.bars[k], "kept": legs.kept[k].tolist()}) | (
                    {} if legs.rings is None or not legs.rings[k] else {"ring": float(legs.rings[k])})
    besides = {} if legs.holds is None else _planes(legs.holds)
    return {"freedoms": list(legs.free or legs.freedoms), **besides, "gauge": legs.gauge.tolist(),
            "legs": [of(k) for k in range(len(legs.names))], "parts": None if asked.parts is None else _parts(asked.parts),
            "carriers": [{"letter": name, "direction": row.tolist(), "travel": _ends(travel)} for name, row, travel in zip(
                legs.carrier_names, legs.carriers, asked.carrier_travel, strict=True)]}


def _planes(holds: Holds) -> dict[str, Any]:
    """Planes of the bed and of the platform that hold it, one by one."""
    def each(**columns: Floats) -> list[dict[str, Any]]:
        rows = zip(*(value.tolist() for value in columns.values()), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in rows]
    return {"bed": each(normal=holds.normals, point=holds.points, joint=holds.joints, moves=holds.moves),
            "platform": each(across=holds.across, through=holds.through, apart=holds.apart)}


def _parts(parts: PartsOfLegs) -> dict[str, Any]:
    """What is held apart: rods by the leg and their place next to its line, radii and stops; null what is not there."""
    given = parts.sizes
    rails = given.rail_radius is not None and given.rail_offset is not None and given.rail_ends is not None
    return {"rods": [{"leg": int(k), "shift": shift.tolist()} for k, shift in zip(given.leg, given.shift, strict=True)],
            "rod_radius": given.rod_radius, "spindle_radius": given.spindle_radius, "spindle": list(given.spindle),
            "rail_radius": given.rail_radius if rails else None,
            "rail_offset": given.rail_offset.tolist() if rails and given.rail_offset is not None else None,
            "rail_ends": given.rail_ends.tolist() if rails and given.rail_ends is not None else None,
            "carriage_angle": given.carriage_angle, "platform_angle": given.platform_angle,
            "middle": parts.middle.tolist(), "middle_ends": parts.middle_ends.tolist(), "level": parts.level.tolist()}


def _ends(travel: Floats) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in travel]
