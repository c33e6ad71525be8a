"""One machine and one control in the report: what the page says of that conversion, as figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from postproc.cycle_time.estimate import Estimate
from postproc.cycle_time.shares import CAUSES
from postproc.page.columns import NO_VALUE, Column, packed, text_of, unpacked
from postproc.page.points import columns
from postproc.page.skeleton import chain, legs, places_in_time, travel
from postproc.page.solids import solids
from postproc.page.tools import tool_rows
from postproc.page.what_if import what_if
from postproc.pipeline.result import PostResult
from postproc.proof.hashes import Hashes, ProofInput, cl_hashes, sha256
from postproc.readback.text.canonical import in_files
from postproc.report import summary
from postproc.report.residuals import residuals, tip_uncertainty
from postproc.verification.proof_text import statement
from toolpaths.arrays import Floats, finite
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

VECTORS = 400
"""places at which error vectors are given"""
MESSAGE_LINES = 8
"""lines of a message that are given in the program too"""
DRAWN = 200
"""passes whose polytope is given"""


@dataclass(frozen=True)
class Run:
    """A conversion for the report: its result, its estimated time (None where it failed), hashes of its files."""

    result: PostResult
    estimate: Estimate | None
    hashes: Mapping[ProofInput, Hashes]
    name: str
    """of the program that it stands for"""


def run_dict(run: Run) -> dict[str, Any]:
    """The figures of a run; mm, degrees, s, mm/min; null where the conversion did not come so far."""
    result, c = run.result, run.result.comparison
    of_points = points_dict(run) if result.ok and run.estimate is not None else None
    return {
        "machine": result.machine.name, "machine_description": result.machine.description,
        "structure": result.machine.structure, "controller": result.controller_name,
        "controller_description": result.controller.description,
        "converted": result.ok, "proved": result.ok and c is not None and not c.unbounded,
        "statement": statement(c, result.witness) if c is not None and result.ok else None,
        "tolerance_mm": result.options.tolerance, "axis_tolerance_deg": result.options.axis_tolerance,
        "files": _files(run),
        "conversion": summary.as_dict(result, run.name, run.estimate),
        "axes": _axes(result), "feeds": _feeds(result), "collisions": _collisions(result),
        "tools": tool_rows(result, run.estimate) if run.estimate is not None else [],
        "work_offset": _offset(result), "header": _header(result),
        "what_if": what_if(run.estimate) if run.estimate is not None else None,
        "message_lines": _message_lines(run), "errors": _errors(result), "orientation": _orientation(result),
        "causes": list(CAUSES),
        "operations": [op.name or f"operation {k + 1}" for k, op in enumerate(result.toolpath.operations)],
        "skeleton": chain(result.machine, result.job) if result.job is not None else None,
        "solids": solids(result), "points": of_points}


def points_dict(run: Run) -> dict[str, Any]:
    """The columns of all points, deflated, with the legs of a platform; how they are read is said in `columns.packed`."""
    if run.estimate is None:
        raise ValueError("without a time there are no points")
    made = columns(run.result, run.estimate)
    data, heads = packed(made)
    found: dict[str, Any] = {"count": len(made[0].values), "columns": heads, "no_value": NO_VALUE, "data": text_of(data)}
    frame = _legs(run.result, unpacked(data, heads))
    return found | ({} if frame is None else {"legs": frame})


def _legs(result: PostResult, known: Mapping[str, Floats]) -> dict[str, Any] | None:
    """Legs at some points: which ones, and the joints of each leg and its drive there."""
    job, names = result.job, result.machine.axis_names
    if job is None or result.machine.kinematics.chain:
        return None
    at = places_in_time(len(known[names[0]])).astype(np.int64)
    q = np.stack([known[name][at] for name in names], axis=1) / np.where(result.machine.rotary, 1.0 / DEG, 1.0)
    ends = legs(job, q)
    if ends is None:
        return None
    flat = ends.reshape(len(at), -1)
    data, heads = packed([Column("point", at.astype(np.float64), 1.0),
                          *(Column(f"joint {k}", flat[:, k], 0.01, "mm") for k in range(flat.shape[1]))])
    return {"legs": ends.shape[1], "columns": heads, "data": text_of(data)}


def _files(run: Run) -> list[dict[str, str]]:
    """What the proof rests on: each file with its role and SHA-256."""
    source, result = run.result.source, run.result
    name = result.toolpath.file.replace("\\", "/")
    found = [] if source is None else [("cl_file", one.file, one.sha256) for one in cl_hashes(name, source)]
    if result.ok:
        found.append(("program", run.name, sha256(result.text.encode())))
        found += [("program", name, sha256(text.encode())) for name, text in (result.files or {}).items()]
    found += [(role, one.file, one.sha256) for role, hashes in run.hashes.items() for one in hashes]
    return [{"role": role, "file": file, "sha256": digest} for role, file, digest in found]


def _axes(result: PostResult) -> list[dict[str, Any]]:
    """Axes with their limits, and the travel that the program uses."""
    limits, rows = result.machine.limits, []
    for j, letter in enumerate(result.machine.axis_names):
        unit = DEG if result.machine.rotary[j] else 1.0
        low, high = travel(result.machine, j)
        used = (result.extents or {}).get(letter)
        share, margin = _of_travel(used, low, high)
        rows.append({"letter": letter, "rotary": bool(result.machine.rotary[j]),
                     "unit": "deg" if result.machine.rotary[j] else "mm",
                     "travel": [low, high], "used": None if used is None else [float(used[0]), float(used[1])],
                     "used_percent": share, "margin": margin,
                     "velocity": finite(limits.velocity[j] / unit), "acceleration": finite(limits.acceleration[j] / unit),
                     "jerk": finite(limits.jerk[j] / unit),
                     "assumed": sorted(name.split(".")[1] for name in limits.assumed if name.split(".")[0] == letter)})
    return rows


def _of_travel(used: tuple[float, float] | None, low: float | None, high: float | None) -> tuple[float | None, float | None]:
    """Percent of the travel that is used, and what is left to its nearer end; None of an axis without ends."""
    if used is None or low is None or high is None or high <= low:
        return None, None
    return float(100.0 * (used[1] - used[0]) / (high - low)), float(min(used[0] - low, high - used[1]))


def _feeds(result: PostResult) -> dict[str, Any] | None:
    """Least and greatest feed of the cuts as the CL file has them, and blocks whose feed an axis lowers."""
    if result.job is None:
        return None
    moves = result.job.moves
    cuts = (moves.kind != Kind.RAPID) & np.isfinite(moves.feed)
    feed = moves.feed[cuts] * 60.0
    return {"least_mm_per_min": float(feed.min()) if len(feed) else None,
            "greatest_mm_per_min": float(feed.max()) if len(feed) else None,
            "reduced_blocks": int(result.feeds.slowed.sum()) if result.feeds is not None else 0}


def _collisions(result: PostResult) -> dict[str, Any]:
    """Whether tools were compared with part, table and fixtures, how many errors that found, and how many warnings of what
    could not be compared."""
    found = [d.severity for d in result.diagnostics if d.code.startswith("collision.")]
    return {"checked": result.setup.bodies is not None and result.comparison is not None,
            "errors": found.count(Severity.ERROR), "warnings": found.count(Severity.WARNING)}


def _offset(result: PostResult) -> dict[str, Any] | None:
    """Register and values of the work offset of the first place."""
    job = result.job
    if job is None:
        return None
    values = zip(result.machine.axis_names, job.control_at(0).work_offset.tolist(), strict=True)
    return {"register": result.controller.program.offset_name(job.places[0].code), "values": dict(values)}


def _header(result: PostResult) -> list[str]:
    """The comments that the program begins with."""
    mark, found = result.controller.comment.open, list[str]()
    for line in result.text.splitlines()[:200]:
        if mark and mark in line:
            found.append(line[line.index(mark) + len(mark):].removesuffix(result.controller.comment.close).strip())
        elif len(found) > 3:
            break
    return found


def _message_lines(run: Run) -> list[list[dict[str, int]]]:
    """For each message of the conversion where its CL lines stand in the program: the first block that moves for each, by
    number and line of the program's file; lines without such a block are left out."""
    result, c, e = run.result, run.result.comparison, run.estimate
    asked = [list(dict.fromkeys(d.lines))[:MESSAGE_LINES] if d.file == result.toolpath.file else []
             for d in result.diagnostics]
    if not result.ok or c is None or e is None or e.blocks.cl_line is None:
        return [[] for _ in asked]
    cl, first = np.unique(np.asarray(e.blocks.cl_line), return_index=True)
    line, files = np.asarray(e.blocks.line)[first], c.executed[0].files
    file = np.maximum(np.searchsorted([n for _, n in files], line) - 1, 0) if files else np.zeros(len(line), dtype=np.int64)
    known = {own: {"cl_line": own, "nc_file": of, "nc_line": at} for own, of, at in zip(
        cl.tolist(), file.tolist(), in_files(line, files).tolist(), strict=True)}
    return [[known[one] for one in lines if one in known] for lines in asked]


def _errors(result: PostResult) -> dict[str, Any] | None:
    """Geometric errors before and after correction, and vectors at places of the part with the uncertainty of each; um."""
    field = residuals(result) if result.compensation is not None and result.ok else None
    if field is None or not len(field.line):
        return None
    rows = np.unique(np.linspace(0, len(field.line) - 1, min(len(field.line), VECTORS)).astype(np.int64))
    before, after = (np.linalg.norm(x[:, :3], axis=1) * 1e3 for x in (field.before, field.after))
    worst = np.argsort(-before, kind="stable")[:10]
    shown, found = np.union1d(rows, worst), result.compensation.uncertainty_tip if result.compensation is not None else None
    sigma = tip_uncertainty(result, shown)
    known = {} if sigma is None else dict(zip(shown.tolist(), (2e3 * sigma).tolist(), strict=True))
    largest = None if found is None else max(2e3 * found, *known.values())

    def place(k: int) -> dict[str, Any]:
        return {"cl_line": int(field.line[k]), "part_mm": field.tip[k].tolist(), "before_um": float(before[k]),
                "after_um": float(after[k]), "vector_um": (field.before[k, :3] * 1e3).tolist(),
                "vector_after_um": (field.after[k, :3] * 1e3).tolist(), "uncertainty_k2_um": known.get(k)}
    return {"title": field.title, "worst_before_um": float(before.max()), "worst_after_um": float(after.max()),
            "bound_um": float(field.tip_bound * 1e3), "uncertainty_k2_um": largest,
            "worst": [place(k) for k in worst.tolist()], "places": [place(k) for k in rows.tolist()]}


def _orientation(result: PostResult) -> dict[str, Any] | None:
    """The choice of tool axes with its candidates and polytopes; None where those of the CL file are kept."""
    choice, plan = result.choice, result.options.orient
    if choice is None:
        return None
    from postproc.orientation.figures.polytope_edges import polytope_edges
    from postproc.orientation.figures.sheet import most_gaining
    from postproc.orientation.report.figures_of_choice import as_dict

    found, made = as_dict(choice, plan), choice.plans[plan].picked
    solids = [polytope_edges(tried, one, choice.work) for tried, one in zip(choice.tried[:DRAWN], made, strict=False)]
    return found | {"polytopes": solids, "most_gaining": next(iter(most_gaining(choice)), None)}
