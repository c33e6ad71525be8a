"""The text of a new set-up file: every line with where its value comes from."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from postproc.pipeline.result import PostResult
from postproc.report.summary import output_modes
from postproc.setup.model import SetupFile
from postproc.setup_sheet.facts import SheetFacts, ToolFacts
from postproc.setup_sheet.place import Fit
from postproc.setup_sheet.questions import Answer
from toolpaths.dataclass import dataclass
from toolpaths.toolpath import Toolpath

_ASSUMED = "ASSUMED, nobody has stated it: put in yours, and take its name out of `assumed`"
_COLUMN = 48
ORIGIN = "part.origin"
TOOL_NUMBERS = "tool_numbers"
"""key of numbers that no file states: the wrong tool is loaded where the magazine holds another under them"""


@dataclass(frozen=True)
class SheetHeader:
    """What the first lines of the file say."""

    file: str
    machine: str
    controller: str
    units: str
    units_from: str
    tolerance: float
    axis_tolerance: float


def sheet_values(facts: SheetFacts, answers: Mapping[str, Answer], description: str, code: str,
                 machine: str) -> dict[str, Any]:
    """The values of the set-up, [part] still at its defaults."""
    sides = {str(tool.number): tool.direction for tool in facts.tools}
    tools: dict[str, dict[str, Any]] = {}
    output: dict[str, Any] = {}
    for key, answer in answers.items():
        where, *rest = key.split(".")
        value = {"rpm": answer.value, "direction": sides[rest[0]]} if rest[-1] == "spindle" else answer.value
        (tools.setdefault(rest[0], {}) if where == "tools" else output)[rest[-1]] = value
    assumed = sorted(key for key, answer in answers.items() if answer.source == "assumed" and answer.value != "off")
    assumed += [TOOL_NUMBERS] * any(one.assumed for one in facts.named)
    return {"description": description, "machine": machine, "work_offset_code": code, "assumed": assumed, "tools": tools,
            "output": output, "tool_numbers": facts.numbers}


def sheet_text(header: SheetHeader, facts: SheetFacts, answers: Mapping[str, Answer], fit: Fit, toolpath: Toolpath) -> str:
    """The file."""
    setup = fit.setup
    lines = [*_top(header, setup, toolpath), "", *_part(fit), "", *_clearance(setup), ""]
    for tool in facts.tools:
        lines += [*_tool(tool, facts, answers), ""]
    if facts.named:
        lines += ["[tool_numbers]    # by name of the tool in the CL file; the magazine must hold them so",
                  *(_line(toml_text(one.name), str(one.number), one.why + f"; {_ASSUMED}" * one.assumed)
                    for one in facts.named), ""]
    lines += [*_output(header, setup, facts, answers), *_operations(fit.result)]
    return "\n".join(lines).rstrip() + "\n"


def toml_text(text: str) -> str:
    """A text in quotes: as JSON has it, and without the one control character that JSON allows and TOML does not."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def remark_text(text: str) -> str:
    """What may stand behind #: one line without control characters."""
    return "".join(c if c >= " " and c != "\x7f" else "?" for c in " ".join(text.split()))


def _line(key: str, value: str, remark: str) -> str:
    """`key = value`, with the reason in a column of its own."""
    return f"{f'{key} = {value}':<{_COLUMN}}  # {remark_text(remark)}"


def _top(header: SheetHeader, setup: SetupFile, toolpath: Toolpath) -> Iterator[str]:
    yield remark_text(f"# Set-up of {header.file} on {header.machine}, {header.controller}: written by postproc setup new.")
    yield f"# Proved with --tolerance {header.tolerance:g} (mm) and --axis-tolerance {header.axis_tolerance:g} (degrees)."
    yield f"# Units of the CL file: {header.units}, {header.units_from}"
    yield _line("description", toml_text(setup.description), "name of the part, or of the CL file")
    if setup.machine:
        yield _line("machine", toml_text(setup.machine), "as -m has it: on another machine convert warns")
    yield _line("work_offset_code", json.dumps(setup.work_offset_code), "register of the control: the first; or as the shop "
                "uses it")
    named = setup.work_offset or toolpath.frames[0].name
    yield _line("work_offset", toml_text(setup.work_offset or named),
                "system of the CL file whose origin the work offset is: its first"
                + (f" of {', '.join(f.name for f in toolpath.frames)}" if len(toolpath.frames) > 1 else ""))
    if setup.assumed:
        yield "# what nobody has stated: convert warns of each, --strict refuses, until it is stated and taken out here"
        yield f"assumed = [{', '.join(json.dumps(key) for key in setup.assumed)}]"


def _part(fit: Fit) -> Iterator[str]:
    part, place = fit.setup.part, fit.place
    yield "[part]    # where the CL file's absolute frame stands on the table: set the part up so, or see postproc place"
    why = place.why if place is not None else "as stated"
    yield _line("origin", _vector(part.origin), f"mm; {why}" + f"; {_ASSUMED}" * (ORIGIN in fit.setup.assumed))
    turned = part.x_axis != (1.0, 0.0, 0.0) or part.y_axis != (0.0, 1.0, 0.0)
    by = f"by the tool axes of the cuts: {place.attitude.why}" if place is not None else "as stated"
    yield _line("x_axis", _vector(part.x_axis), by if turned else f"{by}, which the machine reaches" if place else by)
    yield _line("y_axis", _vector(part.y_axis), "likewise")


def _clearance(setup: SetupFile) -> Iterator[str]:
    yield "[clearance]"
    yield _line("margin", f"{setup.clearance.margin:g}", "mm that linking moves keep from what is cut: the default; less "
                "where travel ends")


def _tool(tool: ToolFacts, facts: SheetFacts, answers: Mapping[str, Answer]) -> Iterator[str]:
    yield f"[tools.{tool.number}]    # {remark_text(tool.called)}, first cut in line {tool.line} of the CL file"
    length = answers.get(f"tools.{tool.number}.gauge_length")
    if length is not None:
        yield _line("gauge_length", f"{length.value:g}", f"mm; {_from(length)}; "
                    + ("the machine coordinates depend on it" if facts.lengths else "travel is checked with it"))
    else:
        yield ("# gauge_length: none needed, the length register takes it up; travel is checked as if it were 0: state it "
               "to check travel with the tool")
    speed = answers.get(f"tools.{tool.number}.spindle")
    if speed is not None:
        yield _line("spindle", f'{{ rpm = {speed.value:g}, direction = "{tool.direction}" }}',
                    f"rev/min; {_from(speed)}; the CL file states "
                    + (f"{remark_text(tool.cutting_speed.said)}: {tool.cutting_speed.rpm:g}" if tool.cutting_speed
                       else "none for some cut"))
    else:
        yield f"# spindle: {tool.speed}, of the CL file"
    yield remark_text(f"# coolant: {tool.coolant or 'none stated, see [output]'}{', of the CL file' * bool(tool.coolant)}")


def _output(header: SheetHeader, setup: SetupFile, facts: SheetFacts, answers: Mapping[str, Answer]) -> Iterator[str]:
    yield "[output]"
    yield _line("default", json.dumps(setup.output.default), "output mode: the best that control and machine can, see below")
    feed, coolant = answers.get("output.feed"), answers.get("output.coolant")
    if feed is not None:
        lines = ", ".join(map(str, facts.feed_lines))
        yield _line("feed", f"{feed.value:g}", f"mm/min; {_from(feed)}; {facts.without_feed} moves cut before any FEDRAT "
                    f"(lines {lines})")
    else:
        yield "# feed: every cut has one in the CL file"
    if setup.output.rapids_as_feed:
        yield _line("rapids_as_feed", "true", "rapids of several axes would leave their line here (dog-leg): G1 at the "
                    "speed of the slowest axis; not needed where [control] rapids = \"straight\" of the machine file holds")
    if coolant is not None:
        why = "the CL file states none: off" if coolant.value == "off" and coolant.source == "assumed" else _from(coolant)
        yield _line("coolant", json.dumps(coolant.value), why)


def _operations(result: PostResult) -> Iterable[str]:
    """What the modes of the operations come to, as a line each that may be changed."""
    if result.program is None:
        return []
    modes = output_modes(result)
    lines = ["", "[output.operations]    # by name; \"auto\", or \"axes\", \"tcp\", \"tilted\" to ask for one"]
    lines += [_line(toml_text(name), '"auto"', f"written as {' and '.join(laws)}; tolerance "
                    f"{result.options.tolerance:g} mm") for name, laws in modes.items()
              if any(op.name == name for op in result.toolpath.operations) and name]
    return lines if len(lines) > 2 else []


def _from(answer: Answer) -> str:
    return "answered" if answer.source == "answered" else _ASSUMED


def _vector(values: tuple[float, float, float]) -> str:
    return f"[{', '.join(repr(float(v) + 0.0) for v in values)}]"
