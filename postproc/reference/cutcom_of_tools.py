"""What CUTCOM is for each tool: wear, the full radius, or not written, as the set-up says it."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from postproc.reference.events import TOOL_WORDS, compensation_side, numbers
from postproc.setup.model import Compensation, SetupFile, ToolSetup
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.toolpath import Event, Toolpath

_SAME = 1e-3
"""mm by which diameters of one tool may differ"""


@dataclass(frozen=True)
class CutcomOfTool:
    """A tool that cuts under CUTCOM: its number (0 without one), what its register holds, whether the set-up
    says so, the lines of CUTCOM/LEFT and RIGHT, and mm by which the control shifts the words to the path of the CL file:
    the radius where that is the path of the tool's centre and the words are the contour, else 0."""

    number: int
    kind: Compensation
    stated: bool
    lines: tuple[int, ...]
    radius: float = 0.0


def radius_of(number: int, tool: ToolSetup, toolpath: Toolpath) -> float:
    """mm, half the diameter of set-up or CL file, 0 where neither states one."""
    return 0.5 * (tool.diameter or _diameter(number, toolpath))


def _diameter(number: int, toolpath: Toolpath) -> float:
    """mm, that the CL file states; 0 without."""
    return next((one.diameter for one in toolpath.tools if one.number == number and one.diameter), 0.0)


def kind_of(tool: ToolSetup) -> Compensation:
    """What the register holds: where the set-up does not say, the radius for a contour, else what CL points of the
    tool's centre need, the wear."""
    return tool.compensation or ("radius" if tool.contour else "wear")


def tools_under_cutcom(toolpath: Toolpath, setup: SetupFile) -> tuple[CutcomOfTool, ...]:
    """The tools that a CUTCOM/LEFT or RIGHT is for, in order of use."""
    found: dict[int, list[int]] = {}
    for number, event in _with_tools(toolpath):
        if event.word == "CUTCOM" and compensation_side(event) in ("LEFT", "RIGHT"):
            found.setdefault(number, []).append(event.line)
    tools = {number: setup.tools.get(str(number), ToolSetup()) for number in found}
    return tuple(CutcomOfTool(number, kind_of(tool := tools[number]), tool.compensation is not None or tool.contour,
                              tuple(lines), radius_of(number, tool, toolpath) if _offset_back(tool) else 0.0)
                 for number, lines in found.items())


def radii_of(setup: SetupFile) -> tuple[tuple[int, float], ...]:
    """(tool, mm) of the tools whose path is offset back to the contour, where the set-up states their diameter."""
    return tuple((int(number), 0.5 * tool.diameter) for number, tool in setup.tools.items()
                 if _offset_back(tool) and tool.diameter)


def _offset_back(tool: ToolSetup) -> bool:
    return tool.compensation == "radius" and not tool.contour


def with_compensation(toolpath: Toolpath, setup: SetupFile) -> tuple[Toolpath, list[Diagnostic]]:
    """The path without the CUTCOM of tools whose path is written uncompensated; what register and path cannot both be.

    The register shifts what the program holds: the path of the tool's centre by the wear, the contour by the
    radius. Of a contour that is not compensated the tool would cut its radius too deep.
    """
    found, bare = list[Diagnostic](), set[int]()
    for one in tools_under_cutcom(toolpath, setup):
        tool = setup.tools.get(str(one.number), ToolSetup())
        if refused := _refusal(tool, one.radius, _diameter(one.number, toolpath)):
            found.append(error(f"cutcom.{refused[0]}", f"T{one.number}: {refused[1]}", file=toolpath.file,
                               lines=one.lines[:6], count=len(one.lines),
                              hint=refused[2].format(number=one.number)))
        elif one.kind == "none":
            bare.add(one.number)
            found.append(info("cutcom.none", f'T{one.number}: compensation = "none" of the set-up, CUTCOM is not written: '
                              "the words are the path of the tool's centre", file=toolpath.file, lines=one.lines[:6],
                              count=len(one.lines),
                              hint="nothing is to be done: a tool of another radius needs the CL file again"))
    if not bare:
        return toolpath, found
    events = tuple(e for number, e in _with_tools(toolpath) if e.word != "CUTCOM" or number not in bare)
    return replace(toolpath, events=events), found


def _refusal(tool: ToolSetup, radius: float, stated: float) -> tuple[Literal["radius", "contour"], str, str] | None:
    """(code, what is wrong, what to do) of a register that does not belong to what the CL file holds; `stated`: the
    diameter that this states, mm, or 0."""
    if _offset_back(tool) and stated and tool.diameter and abs(tool.diameter - stated) > _SAME:
        return ("radius", f"the path of its centre is that of a tool of {stated:g} mm, the set-up says {tool.diameter:g} "
                "mm: the register would hold another radius than the contour was made with",
                f"[tools.{{number}}] diameter = {stated:g}; the register may hold the radius that was measured")
    if _offset_back(tool) and not radius > 0.0:
        return ("radius", 'compensation = "radius" for CL points of the tool\'s centre, and neither CL file nor set-up '
                "states its diameter: how far the contour is from them is not known",
                "[tools.{number}] diameter = 10.0 (mm)")
    if tool.contour and tool.compensation in ("wear", "none"):
        return ("contour", f'compensation = "{tool.compensation}" for a CL file that holds the contour (contour = true): '
                "the tool would cut its radius too deep",
                '[tools.{number}] compensation = "radius", or take contour = true out where the CL points are those of the '
                "tool's centre")
    return None


def _with_tools(toolpath: Toolpath) -> list[tuple[int, Event]]:
    """Every record with the number of the tool that it is for; 0 before any load of a number."""
    number, result = 0, list[tuple[int, Event]]()
    for event in toolpath.events:
        if event.word in TOOL_WORDS and numbers(event):
            number = int(numbers(event)[0])
        result.append((number, event))
    return result
