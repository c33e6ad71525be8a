"""The polytope of a pass as corners and edges, for who draws it elsewhere (the report's page)."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.reaches import binding, direction_of, polytopes, reaches
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.figures.polytopes import SCALE, SHOWN, hull
from postproc.orientation.passes.passes import PassContext


def polytope_edges(tried: PassSearch, chosen: Candidate, work: PassContext) -> dict[str, Any] | None:
    """What the tip may do under the CL file's axis and under the chosen one, at the order of motion that is slowest.

    Keys: `order`, `unit`; `cl_file` and `chosen`, each with `corners` (frame of the part, in `unit`), `edges` (pairs of
    corners), `reach` (where the mean direction of the longest cut leaves the solid) and `rate` (its length); None where the
    pass cannot be run so. None where nothing limits the pass, or it has no direction.
    """
    slowest = binding(reaches(tried.own)) or binding(reaches(chosen))
    if slowest is None or slowest.order not in SCALE:
        return None
    return {"order": slowest.order, "unit": SHOWN[slowest.order], "cl_file": _solid(tried.own, slowest.order, work),
            "chosen": _solid(chosen, slowest.order, work)}


def _solid(made: Candidate, order: str, work: PassContext) -> dict[str, Any] | None:
    shape = next((shape for known, shape in polytopes(made).items() if known == order), None)
    if shape is None:
        return None
    try:
        corners = work.placement.inverse().directions(shape.vertices()) * SCALE[order]
    except ValueError:  # no axis ends it on some side
        corners = np.zeros((0, 3))
    direction = direction_of(made.one.longest)[0]
    rate = float(shape.reach(direction)[0]) * SCALE[order]
    if not np.isfinite(rate):
        return None
    reach = rate * work.placement.inverse().directions(direction[None])[0]
    return {"corners": corners.tolist(), "edges": hull(corners)[1].tolist(), "reach": reach.tolist(), "rate": rate}
