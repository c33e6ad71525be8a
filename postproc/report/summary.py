"""The figures of a conversion, as JSON and for people."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.pipeline.result import PostResult, VerifyResult
from postproc.pipeline.written_figures import WrittenFigures, modes_of, points_added, written_figures
from postproc.readback.comparison.compare import Comparison
from postproc.readback.comparison.length_margins import margin_lines
from postproc.reference.events import cutting, spindle_states
from postproc.report.loads import deflection, deflection_lines, motor_load, motor_load_lines
from postproc.report.places import place_lines, places
from postproc.report.unwinding import unwinding, unwinding_lines
from postproc.verification.proof_text import statement
from postproc.witness.evidence import Compared, Testimony
from toolpaths.arrays import distinct, finite
from toolpaths.diagnostics import Severity
from toolpaths.input_files import there_is
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

if TYPE_CHECKING:
    from postproc.cycle_time.estimate import Estimate


def as_dict(result: PostResult, output: str, estimate: Estimate | None = None) -> dict[str, Any]:
    """The keys of `convert --json`; lengths mm, angles degrees, times s; null where a stage was not reached.

    `estimate`: of its time (`cycle_time.conversion.estimate_of`).
    """
    from postproc.cycle_time import conversion

    c, written = result.comparison, figures_of(result)
    return {
        "output": output if result.ok else None,
        "files": neighbour_files(result, output),
        "machine": result.machine.name,
        "controller": result.controller_name,
        "points_in": points_in(result.toolpath),
        "records": asdict(result.toolpath.records),
        "blocks_out": written.blocks if written else 0,
        "points_added": written.added if written else points_added(result.path) if result.path is not None else 0,
        **conversion.figures(estimate),
        **deviations(c),
        "rewinds": written.rewinds if written else len(result.path.rewinds) if result.path is not None else 0,
        "singular_events": written.singular if written else _singular(result),
        "linearising_bound": _bound(result),
        "feed_reduced_blocks": written.reduced if written else 0,
        "deflection": deflection(result),
        "motor_load": motor_load(result),
        "axis_extents": {k: list(v) for k, v in (result.extents or {}).items()},
        "optimised": result.optimised.as_dict() if result.optimised else None,
        "feed_times": result.feed_times.as_dict() if result.feed_times else None,
        "tolerance_shares": result.shares or {},
        "output_modes": output_modes(result),
        "places": places(result, estimate),
        "unwinding": unwinding(result),
        "geometric_errors": _errors(result),
        "orientation": _orientation(result),
        "tool_call": result.setup.output.tool_call,
        "tools": tools_of(result),
        "witness": witness_dict(result.witness),
        "diagnostics": [d.as_dict() for d in result.diagnostics],
    }


def points_in(toolpath: Toolpath) -> int:
    """Commanded positions, without FROM and GOHOME."""
    return int(np.isin(toolpath.role, (0, 1)).sum())


def deviations(c: Comparison | None) -> dict[str, Any]:
    """Bounds of the deviation of all blocks, what was seen at places of them, and how many have no bound."""
    return {"worst_tip_deviation_mm": finite(c.tip_bound) if c else None,
            "worst_axis_deviation_deg": finite(c.axis_bound / DEG) if c else None,
            "sampled_tip_deviation_mm": finite(c.worst_tip) if c else None,
            "sampled_axis_deviation_deg": finite(c.worst_axis / DEG) if c else None,
            "blocks_without_bound": c.unbounded if c else None,
            "cuts": c.cuts if c else None, "cuts_bounded": c.bounded_cuts if c else None}


def _proof(result: PostResult) -> list[str]:
    """What is proved and by what: bounds, or where some blocks have none what was seen of them."""
    c = result.comparison
    return [] if c is None else [f"{statement(c, result.witness)} (allowed {result.options.tolerance:g} mm, "
                                 f"{result.options.axis_tolerance:g} degrees)"]


def neighbour_files(result: PostResult, output: str) -> list[str]:
    """The files of subprograms that are written next to `output`."""
    return [str(Path(output).parent / name) for name in result.files or {}] if result.ok else []


def figures_of(result: PostResult) -> WrittenFigures | None:
    """Of path and program, whether they are kept or not; None where no program was compiled."""
    job, path, program, feeds = result.job, result.path, result.program, result.feeds
    if result.figures is not None or job is None or path is None or program is None or feeds is None:
        return result.figures
    return written_figures(job, result.toolpath, path, program, feeds)


def _singular(result: PostResult) -> int:
    return len(result.path.turns) + len(result.path.events) if result.path is not None else 0


def _bound(result: PostResult) -> dict[str, float] | None:
    """Proved bound of the deviation between points, before rounding."""
    bound = result.figures or result.path
    return None if bound is None else {"tip_mm": bound.worst_tip, "axis_deg": bound.worst_axis / DEG}


def _errors(result: PostResult) -> dict[str, Any] | None:
    """What the correction of geometric errors did, or that the control does it; None without an error model."""
    found, job = result.compensation, result.job
    if job is None or job.errors is None:
        return None
    who = {"model": job.errors.name, "corrected_by": job.errors.corrected_by}
    if found is None:
        return who
    proof = result.after_formatting
    return {**who, "tip_before_mm": found.tip_before, "axis_before_deg": found.axis_before / DEG,
            "tip_residual_mm": found.tip_after, "axis_residual_deg": found.axis_after / DEG, "points_added": found.added,
            "arcs_resolved": found.resolved, "blocks_near_a_pole": found.partial,
            **({} if proof is None else proof.figures()), "tip_sigma_mm": found.uncertainty_tip,
            "axis_sigma_deg": None if found.uncertainty_axis is None else found.uncertainty_axis / DEG}


def _orientation(result: PostResult) -> dict[str, Any] | None:
    """The tool axes that were chosen; None where those of the CL file are kept."""
    if result.choice is None:
        return None
    from postproc.orientation.report.figures_of_choice import chosen
    from postproc.orientation.turning.turning_report import as_dict

    turning = None if result.turning is None else as_dict(result.turning)
    return chosen(result.choice, result.options.orient) | {"turning": turning}


def _axes_on_the_control(result: PostResult) -> list[str]:
    """What the chosen tool axes gain on the control, for people."""
    if result.choice is None or not result.choice.programs:
        return []
    from postproc.orientation.report.figures_of_choice import control_line
    from postproc.orientation.turning.turning_report import control_lines

    return [control_line(result.choice), *(control_lines(result.turning) if result.turning is not None else [])]


def witness_dict(said: Testimony | None) -> dict[str, Any] | None:
    """What the second witness compared; None where it was not asked, because the read-back had found errors."""
    return None if said is None else {"agrees": not said.findings, "compared": [str(one) for one in said.compared],
                                      "not_compared": [str(one) for one in said.not_compared], "points": said.points,
                                      "worst_tip_mm": finite(said.worst_tip),
                                      "worst_axis_deg": finite(said.worst_axis / DEG), "seconds": said.seconds}


_ONE = {"positions": "position", "arcs": "arc", "holes": "hole", "feeds": "feed", "work offsets": "work offset",
        "states of cutter compensation": "state of cutter compensation", "rests and stops": "rest or stop",
        "turns of modulo axes": "turn of modulo axes", "clamps": "clamp", "curves": "curve",
        "turns of tools about themselves": "turn of a tool about itself"}
"""what is compared, where it is one"""


def witness_lines(said: Testimony | None) -> list[str]:
    """What the second witness has compared, for people."""
    if said is None or not said.compared or said.findings:
        return []
    return [f"second witness agrees: {', '.join(map(_compared, said.compared))}"]


def _compared(one: Compared) -> str:
    what = {"work offset": "work offsets", "cutter compensation": "states of cutter compensation"}.get(one.what, one.what)
    return f"{one.count} {_ONE.get(what, what) if one.count == 1 else what}"


def _seconds(value: float | None) -> str:
    return "not to be run" if value is None else f"{value:.3f} s"


def _places(value: float) -> str:
    return f"{round(value, 3) + 0.0:.3f}"


def output_modes(result: PostResult) -> dict[str, list[str]]:
    """By operation, the laws ("axes", "tcp", "tilted") that its cutting blocks are written under."""
    if result.figures is not None:
        return result.figures.modes
    return {} if result.program is None else modes_of(result.program, result.toolpath)


def tools_of(result: PostResult) -> list[dict[str, Any]]:
    """The tools in order of use: number, name, gauge length (null: not stated), the speeds that they cut at (rev/min,
    negative: anti-clockwise), and what the set-up states of spindle and coolant where the CL file does not."""
    job = result.job
    if job is None:
        return []
    path, cuts = job.toolpath, cutting(job.toolpath)
    direction, rpm = spindle_states(path)
    index, first = np.unique(job.moves.tool, return_index=True)
    found: dict[int, dict[str, Any]] = {}
    for k in index[np.argsort(first, kind="stable")].tolist():
        number = job.number_of(k)
        speeds = distinct((direction * rpm)[cuts & (path.tool == k)])
        tool = found.setdefault(number, {
            "number": number, "name": path.tools[k].name if k >= 0 else "", "gauge_length_mm": job.gauge_length(k) or None,
            "spindle_rpm": [], "of_setup": [what for n, what in job.stated if n == number],
            "length_margin_mm": _length_margin(result, number)})
        tool["spindle_rpm"] = sorted({*tool["spindle_rpm"], *speeds[np.isfinite(speeds)].tolist()})
    return list(found.values())


def _length_margin(result: PostResult, number: int) -> dict[str, Any] | None:
    """By how much a tool may differ from its gauge length (null: more than is looked for), and what ends that."""
    one = next((one for one in (result.comparison.lengths if result.comparison else ()) if one.number == number), None)
    return None if one is None else {
        "shorter": finite(one.shorter), "ends_shorter": one.ends_shorter,
        "longer": finite(one.longer), "ends_longer": one.ends_longer}


def tool_lines(result: PostResult) -> list[str]:
    """Of the summary: what the set-up states of spindle and coolant, and that no tool is called."""
    lines = []
    if result.job is not None and not result.setup.output.tool_call:
        length = result.job.control.measured
        lines.append("no tool call: for the tool in the spindle, measured into the work offset, which "
                     + (f"holds its gauge length {length:.4f} mm" if length else "must hold its length besides"))
    lines += [f"T{number}: {what}, of the set-up" for number, what in (result.job.stated if result.job else ())]
    if result.job is None or result.comparison is None:
        return lines
    return lines + margin_lines(result.comparison.lengths, result.job)


def as_text(result: PostResult, output: str, estimate: Estimate | None = None,
            figures: dict[str, Any] | None = None) -> str:
    """The summary on standard output; arguments as of `as_dict`, whose figures are taken where they are known."""
    if not result.ok:
        return f"nothing written; {output} is left as it was" if there_is(output) else "nothing written"
    d = figures or as_dict(result, output, estimate)
    shares = d["tolerance_shares"]
    splines = f", arcs and chords for splines {shares['splines']:.4f}" if "splines" in shares else ""
    lines = [f"{output}: {d['blocks_out']} blocks from {d['points_in']} points ({d['points_added']} added) for "
             f"{d['machine']}, {d['controller']}",
             *_proof(result),
             *witness_lines(result.witness),
             f"tolerance: linearising {shares['linearising']:.4f}, control's smoothing {shares['smoothing']:.4f}, "
             f"rounding at most {shares['rounding']:.5f}{splines} mm"]
    if result.options.smooth:
        lines.append("--smooth: a control that rounds corners itself may take longer where points are moved; --optimise "
                     "moves them only where its time gets less")
    lines += _other_units(result)
    if result.toolpath.records.total:
        lines.append(f"read: {result.toolpath.records}")
    fallen_back = any(found.code == "output.next_mode" for found in result.diagnostics)
    if fallen_back or any(laws != ["axes"] for laws in d["output_modes"].values()):
        lines.append("output: " + ", ".join(f"{name} {' and '.join(laws)}" for name, laws in d["output_modes"].items()))
    if d["orientation"] is not None:
        noted = d["orientation"]
        lines.append(f"tool axes, {noted['plan']}: {noted['turned']} of {len(noted['passes'])} passes turned; planned "
                     f"{_seconds(noted['time_s'])}, with the axes of the CL file {_seconds(noted['reference_time_s'])}")
        lines += _axes_on_the_control(result)
    if d["files"]:
        lines.append(f"subprograms next to it: {', '.join(Path(file).name for file in d['files'])}")
    lines += place_lines(result, estimate)
    if result.job is not None and result.job.repeats is None:
        offset = " ".join(f"{k}{round(v, 4) + 0.0:.4f}" for k, v in zip(
            result.machine.axis_names, result.job.control.work_offset, strict=True))
        lines.append(f"work offset {result.controller.program.offset_name(result.job.places[0].code)}: {offset}")
    lines += tool_lines(result)
    if estimate is not None:
        from postproc.cycle_time.conversion import text

        lines.append(text(estimate))
    lines += result.optimised.lines() if result.optimised else []
    lines += result.feed_times.lines() if result.feed_times else []
    modulo = [] if result.job is None else [result.machine.axis_names[j] for j in result.job.control.rolls]
    lines.append("axes: " + ", ".join(f"{k} {_places(lo)} to {_places(hi)}{' all turns together (modulo)' * (k in modulo)}"
                                      for k, (lo, hi) in d["axis_extents"].items()))
    if d["geometric_errors"] is not None and d["geometric_errors"]["corrected_by"] == "control":
        lines.append(f"geometric errors {d['geometric_errors']['model']}: left to the control, not corrected here")
    if result.compensation is not None:
        proof = result.after_formatting
        lines += result.compensation.lines() + ([] if proof is None else [proof.line()])
    if d["feed_reduced_blocks"]:
        lines.append(f"feed reduced for an axis limit in {d['feed_reduced_blocks']} blocks")
    lines += deflection_lines(d["deflection"]) + motor_load_lines(d["motor_load"])
    if d["singular_events"]:
        lines.append(f"singular directions passed: {d['singular_events']}")
    if d["rewinds"]:
        lines.append(f"rewinds: {d['rewinds']}")
    lines += unwinding_lines(result)
    return "\n".join(lines)


def _other_units(result: PostResult) -> list[str]:
    """That the program is in other units than its CL file, where it is."""
    units, read = result.controller.format.units, result.toolpath.units
    said = f"units: program in {units}, CL file in {read}; [output] units of the set-up states those of the program"
    return [] if units == read else [said]


def verify_dict(result: VerifyResult) -> dict[str, Any]:
    """The figures of `verify --json`."""
    c = result.comparison
    return {
        "gcode": result.gcode,
        "proved": result.ok and c is not None and not c.unbounded,
        "blocks": len(c.owner) if c else 0,
        **deviations(c),
        "worst_tip_lines": list(c.worst_tip_line) if c else None,
        "worst_axis_lines": list(c.worst_axis_line) if c else None,
        "witness": witness_dict(result.witness),
        "tool_table": [{"number": one.number, "register": one.register, "gauge_length_mm": one.gauge,
                        "measured_mm": one.measured, "allowed_mm": None if one.allowed is None else
                        [finite(-one.allowed.shorter), finite(one.allowed.longer)], "fails": one.beyond or None}
                       for one in result.measured],
        "diagnostics": [d.as_dict() for d in result.diagnostics],
    }


def verify_text(result: VerifyResult) -> str:
    """The verdict for people."""
    c = result.comparison
    measured = "".join(f"\n{one.line()}" for one in result.measured)
    if c is None:
        return f"not proved{measured}"
    if not result.ok:
        errors = sum(d.severity is Severity.ERROR for d in result.diagnostics)
        return (f"NOT proved: {len(c.owner)} blocks, {errors} error{'s' * (errors > 1)}; the first may cause the rest"
                f"{measured}")
    said = "".join(f"\n{line}" for line in witness_lines(result.witness)) + measured
    return (f"{statement(c, result.witness)} ({len(c.owner)} blocks; worst at CL line {c.worst_tip_line[0]}, block line "
            f"{c.worst_tip_line[1]}, the axis at CL line {c.worst_axis_line[0]}, block line {c.worst_axis_line[1]}){said}")
