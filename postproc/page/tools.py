"""The tools of a program for the set-up sheet: how long each runs, how far it cuts, where it begins."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.cycle_time.estimate import Estimate
from postproc.cycle_time.shares import shares
from postproc.page.tool_outlines import outlines
from postproc.pipeline.result import PostResult
from postproc.report.summary import tools_of
from postproc.time_study.tables import by_tool


def tool_rows(result: PostResult, e: Estimate) -> list[dict[str, Any]]:
    """`summary.tools_of` with its form, length register, s as `time` counts them (its change among them), mm and m that
    its tip travels at feed against the part, arcs by their length, and its first position (axes in mm and degrees, part in
    mm)."""
    c, job, b = result.comparison, result.job, e.blocks
    if c is None or job is None or b.row is None:
        return []
    motion, row = c.executed[1], np.asarray(b.row)
    number = motion.tool[row]
    timed = {line["tool"]: line for line in by_tool(e, shares(e))}
    back, unit, found = job.placement.inverse(), job.control.unit, list[dict[str, Any]]()
    for known in tools_of(result):
        tool = known | {"form": outlines(job, known["number"])}
        blocks = np.flatnonzero(number == tool["number"])
        if not len(blocks):
            found.append(tool | {"length_register": None, "time_s": 0.0, "cutting_mm": 0.0, "cutting_m": 0.0,
                                 "first_axes": None, "first_part_mm": None})
            continue
        first = row[blocks[:1]]
        q = c.poses.joints(motion, first, 1.0)[0] * unit
        cut = float(str(timed[tool["number"]]["cut_mm"]))
        registers = np.unique(motion.register[row[blocks]])
        found.append(tool | {
            "length_register": next((int(r) for r in registers.tolist() if r >= 0), None),
            "time_s": timed[tool["number"]]["time_s"], "cutting_mm": cut, "cutting_m": cut / 1e3,
            "first_axes": dict(zip(result.machine.axis_names, q.tolist(), strict=True)),
            "first_part_mm": back.points(c.tip[first])[0].tolist()})
    return found
