"""Tools as the page draws them: cutter, shank and holder as outlines that are turned about the tool axis."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.collision.form import PARTS, tool_form
from postproc.job.job import Job
from toolpaths.arrays import Floats

ARC = 9
"""points of a rounded edge"""


def outlines(job: Job, number: int) -> list[dict[str, Any]]:
    """The pieces of a tool, from the tip to the spindle: which of `PARTS`, and [radius, height over the tip] in mm along
    its side; none where neither CL file nor set-up says the form. Of several tools under one number it is the first."""
    index = next((k for k in np.unique(job.moves.tool).tolist() if job.number_of(k) == number), -1)
    tool = job.toolpath.tools[index] if index >= 0 else None
    form, _ = tool_form(number, tool, job.setup.tools.get(str(number)), job.options.setup)
    return [{"part": PARTS[part], "radius_height_mm": np.round(outline(piece), 4).tolist()}
            for piece, part in zip(form.pieces, form.part.tolist(), strict=True)]


def outline(piece: Floats) -> Floats:
    """(N, 2) radius and height along the side of a frustum of a cone (r0, z0, r1, z1, c) grown by c, upwards.

    At the height z the widest ball of the radius c has its centre on the side at s = z + c k / sqrt(1 + k^2), k the slope of
    the radius, within the ends: d/ds (r(s) + sqrt(c^2 - (z - s)^2)) = 0.
    """
    r0, z0, r1, z1, c = piece.tolist()
    slope = (r1 - r0) / (z1 - z0) if z1 > z0 else 0.0
    arc = c * np.sin(np.linspace(0.0, 0.5 * np.pi, ARC)) if c > 0.0 else np.zeros(1)
    z = np.unique(np.concatenate([z0 - arc, z0 + arc, z1 - arc, z1 + arc]))
    z = z[(z >= z0 - c) & (z <= (z1 + c if z1 > z0 else z1))]  # over a rounded edge its side goes on
    s = np.clip(z + c * slope / np.hypot(1.0, slope), z0, z1)
    side = np.stack([r0 + slope * (s - z0) + np.sqrt(np.maximum(c**2 - (z - s) ** 2, 0.0)), z], axis=1)
    return side if z1 > z0 or c > 0.0 else np.array([[r0, z0], [r1, z1]])  # a disc, or a flat ring
