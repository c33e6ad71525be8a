"""One point of a CL file through every stage."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.base.options import Orientation
from postproc.control.word_arcs import PLANE_AXIS
from postproc.job.job import Job
from postproc.pipeline.result import PostResult
from postproc.pipeline.stages import STAGES
from postproc.readback.comparison.compare import Comparison
from postproc.readback.text.canonical import in_files
from postproc.reference.coolant import coolant_states, label
from postproc.reference.events import spindle_states
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints, finite
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import check_input
from toolpaths.toolpath import Kind, Role
from toolpaths.units import DEG

if TYPE_CHECKING:
    from postproc.compile.program import Program
    from postproc.orientation.plans.choice import OrientationChoice


def trace_line(result: PostResult, line: int) -> tuple[dict[str, Any], list[Diagnostic]]:
    """The stages of the points that CL line `line` commands, as far as the conversion went; mm and degrees."""
    toolpath = result.toolpath
    stages: dict[str, Any] = {"line": line, "record": _record(toolpath.file, line), "points": [], "stages": _stages(result)}
    rows = np.flatnonzero(toolpath.line == line)
    if not len(rows):
        near = toolpath.line[np.argsort(np.abs(toolpath.line - line))[:2]].tolist() if len(toolpath) else []
        hint = f"points stand at lines {', '.join(map(str, sorted(near)))}" if near else ""
        return stages, [error("trace.no_point", f"line {line} commands no position", file=toolpath.file, lines=[line],
                              hint=hint)]
    if result.job is not None and result.job.errors is not None:
        stages["geometric_errors"] = {"model": result.job.errors.name, "corrected_by": result.job.errors.corrected_by}
    stages["points"] = [_point(result, int(row)) for row in rows]
    return stages, []


def _stages(result: PostResult) -> list[dict[str, Any]]:
    """The table of stages: what each does, and whether it ran without an error."""
    names = [stage.name for stage in STAGES]
    done = 0 if result.reached not in names else names.index(result.reached) + int(result.ok)
    return [{"stage": stage.name, "does": stage.does, "done": k < done} for k, stage in enumerate(STAGES)]


def _record(file: str, line: int) -> str:
    try:
        check_input(file)
        with Path(file).open("rb") as stream:
            return next(islice(stream, line - 1, None), b"").decode("utf-8", "replace").strip()
    except OSError:
        return ""


def _point(result: PostResult, row: int) -> dict[str, Any]:
    toolpath = result.toolpath
    operation = toolpath.operations[int(toolpath.operation[row])]
    point: dict[str, Any] = {
        "toolpath": {"tip_mm": toolpath.tip[row].tolist(), "axis": toolpath.axis[row].tolist(),
                     "kind": Kind(int(toolpath.kind[row])).name, "role": Role(int(toolpath.role[row])).name,
                     "operation": operation.name, "pass": int(toolpath.pass_[row])}}
    if result.choice is not None:
        point["orientation"] = _turned(result.choice, result.options.orient, row)
    if (job := result.job) is None:
        return point
    moves = job.moves
    point |= _running(job, row)
    point["moves"] = [_move(result, job, int(m)) for m in np.flatnonzero(moves.row == row)]
    return point


def _running(job: Job, row: int) -> dict[str, Any]:
    """Tool, spindle and coolant at a point, those of the set-up where the CL file states none."""
    path = job.toolpath
    direction, rpm = spindle_states(path)
    return {"tool": job.number_of(int(path.tool[row])),
            "gauge_length_mm": job.gauge_length(int(path.tool[row])) or None,
            "spindle_rpm": finite(float(direction[row] * rpm[row])) if direction[row] else 0.0,
            "coolant": label(int(coolant_states(path, job.controller.codes)[row]))}


def _turned(choice: OrientationChoice, plan: Orientation, row: int) -> dict[str, Any]:
    """What --orient made of a point: tip and axis of the CL file, and the pass that was turned."""
    work = choice.work
    move = int(np.searchsorted(work.moves.row, row))
    k = int(np.searchsorted([one.rows[0] for one in work.passes], move, side="right")) - 1
    made, before = choice.plans[plan].picked[k], choice.tried[k].own
    return {"tip_mm": work.toolpath.tip[row].tolist(), "axis": work.toolpath.axis[row].tolist(), "pass": k,
            "fixed": made.one.fixed, "orientation_deg": made.rotary(), "time_s": finite(made.seconds),
            "reference_time_s": finite(before.seconds)}


def _branches(result: PostResult, kin: Kinematics, moves: Moves, m: int) -> Floats:
    """Joints (B, J) of every branch at the end of a move, with what a redundant machine leaves open as it was planned."""
    tip, axis, path = moves.tip[m:m + 1], moves.axis[m:m + 1], result.nominal or result.path
    if path is None or not kin.open_parameters:
        return kin.inverse(tip, axis)[:, 0]
    last = np.flatnonzero((path.move == m) & (path.u == 1.0))[-1:]
    return (kin.inverse_like(tip, axis, path.q[last]) if len(last) else kin.inverse(tip, axis))[:, 0]


def _move(result: PostResult, job: Job, m: int) -> dict[str, Any]:
    moves, unit = job.moves, job.control.unit
    kin = job.kinematics(int(moves.tool[m]))
    branches = _branches(result, kin, job.moves, m) * unit
    entry: dict[str, Any] = {
        "table_frame": {"tip_mm": moves.tip[m].tolist(), "axis": moves.axis[m].tolist()},
        "linked": bool(moves.link[m]), "feed_mm_per_min": finite(moves.feed[m] * 60.0),
        "branches": [_named(result, b) for b in branches]}
    if result.path is None or result.program is None:
        return entry
    path = result.path
    blocks = np.flatnonzero(path.move == m)
    entry["joints"] = [_named(result, path.q[b] * unit) for b in blocks]
    if result.nominal is not None:
        entry["nominal_joints"] = [_named(result, q * unit) for q in result.nominal.q[result.nominal.move == m]]
    written = np.flatnonzero(result.program.row == moves.row[m])
    entry["blocks"] = _texts(result.program, written)
    c = result.comparison
    if c is not None:
        keep = np.cumsum(moves.phase != 4) - 1
        match = int(c.match[keep[m]])
        if moves.phase[m] != 4 and match >= 0:
            tip, axis = c.tip[match], c.axis[match]
            entry["read_back"] = {"tip_mm": tip.tolist(), "axis": axis.tolist(),
                                  "tip_deviation_mm": float(np.linalg.norm(tip - moves.tip[m])),
                                  "axis_deviation_deg": float(np.linalg.norm(axis - moves.axis[m])) / DEG,
                                  **_program_line(c, match)}
    return entry


def _program_line(c: Comparison, match: int) -> dict[str, Any]:
    """Where the program comes there: line, and file where it is of a subprogram's."""
    code, motion = c.executed
    line = motion.line[match:match + 1]
    k = int(np.searchsorted([n for _, n in code.files], line[0])) - 1 if code.files else 0
    return {"program_line": int(in_files(line, code.files)[0]), **({"file": code.files[k][0]} if k > 0 else {})}


def _named(result: PostResult, values: Floats) -> dict[str, float | None]:
    return {k: finite(v) for k, v in zip(result.machine.axis_names, values.tolist(), strict=True)}


def _texts(program: Program, blocks: Ints) -> list[str]:
    """The words of blocks, each stated in full, whatever the controller makes of them."""
    texts = []
    for k in blocks.tolist():
        head = ("traverse", "feed", "arc")[int(program.code[k])]
        stated = [(letter, program.words[k, j], int(program.decimals[j])) for j, letter in enumerate(program.letters)
                  if program.write[k, j]]
        third = PLANE_AXIS[int(program.plane[k])]
        places = int(program.decimals.max())
        centre = [("IJK"[i], program.center[k, i], places) for i in range(3) if i != third and program.code[k] == 2]
        feed = [("F", program.feed[k], 4)] if np.isfinite(program.feed[k]) else []
        texts.append(" ".join([head, *(f"{letter}{_trimmed(value, n)}" for letter, value, n in (*stated, *centre, *feed))]))
    return texts


def _trimmed(value: float, places: int) -> str:
    text = f"{round(value, places) + 0.0:.{places}f}"
    return text.rstrip("0").rstrip(".") if places else text


def as_text(stages: dict[str, Any]) -> str:
    """The stages for people."""
    lines = [f"line {stages['line']}: {stages['record']}"]
    if "geometric_errors" in stages:
        model, who = stages["geometric_errors"]["model"], stages["geometric_errors"]["corrected_by"]
        lines.append(f"  geometric errors {model}: " + ("left to the control, joints are nominal" if who == "control" else
                                                         "corrected in the joints"))
    for point in stages["points"]:
        t = point["toolpath"]
        lines.append(f"  toolpath     tip {_vector(t['tip_mm'])}  axis {_vector(t['axis'])}  {t['kind']} {t['role']}  "
                     f"operation {t['operation'] or '-'}  pass {t['pass']}")
        if "tool" in point:
            lines.append(_running_text(point))
        if "orientation" in point:
            lines.append(_turned_text(point["orientation"]))
        for move in point.get("moves", []):
            lines += _move_text(move)
    left = [f"{stage['stage']} ({stage['does']})" for stage in stages["stages"] if not stage["done"]]
    if left:
        lines.append(f"  ends before  {left[0]}")
    return "\n".join(lines)


def _running_text(point: dict[str, Any]) -> str:
    rpm = point["spindle_rpm"]
    turns = "off" if rpm == 0.0 else "at an unknown speed" if rpm is None else \
        f"{abs(rpm):g} rev/min {'clockwise' if rpm > 0.0 else 'anti-clockwise'}"
    length = point["gauge_length_mm"]
    return f"  tool         T{point['tool']}  gauge length {'not stated' if length is None else f'{length:.4f} mm'}  " \
        f"spindle {turns}  coolant {point['coolant']}"


def _turned_text(o: dict[str, Any]) -> str:
    angles = " ".join(f"{name}{round(value, 3) + 0.0:.3f}" for name, value in o["orientation_deg"].items())
    kept = f"  (axis kept: {o['fixed']})" if o["fixed"] else ""
    return f"  CL file      tip {_vector(o['tip_mm'])}  axis {_vector(o['axis'])}  pass {o['pass']} at {angles}{kept}"


def _move_text(move: dict[str, Any]) -> list[str]:
    lines = [f"  table frame  tip {_vector(move['table_frame']['tip_mm'])}  axis {_vector(move['table_frame']['axis'])}"
             + ("  (reached by a linking move)" if move["linked"] else "")]
    lines += [f"  branch {k}     {_joints(b)}" for k, b in enumerate(move["branches"])]
    lines += [f"  nominal      {_joints(q)}" for q in move.get("nominal_joints", [])]
    lines += [f"  joints       {_joints(q)}" for q in move.get("joints", [])]
    lines += [f"  block        {text}" for text in move.get("blocks", [])]
    if "read_back" in move:
        r = move["read_back"]
        lines.append(f"  read back    tip {_vector(r['tip_mm'])}  axis {_vector(r['axis'])}  off by "
                     f"{r['tip_deviation_mm']:.6f} mm, {r['axis_deviation_deg']:.6f} degrees"
                     + (f", line {r['program_line']} of {r.get('file', 'the program')}" if "program_line" in r else ""))
    return lines


def _vector(values: list[float]) -> str:
    return "(" + ", ".join(f"{v:.6f}" for v in values) + ")"


def _joints(values: dict[str, float | None]) -> str:
    return "  ".join(f"{k} {v:.6f}" if v is not None else f"{k} -" for k, v in values.items())
