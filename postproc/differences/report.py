"""The differences of two programs as figures, text and a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from postproc.cycle_time.report import clock
from postproc.cycle_time.source import ExecutedProgram
from postproc.differences.compare import ProgramDifferences, StretchPair
from postproc.differences.states import StateDifference
from postproc.differences.stretches import ProgramLine, stretches
from toolpaths.choices import FigureEnding
from toolpaths.drawing import image
from toolpaths.table_text import table_text
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 12
"""rows of a table"""
UNCOMPARED = ("comments, block numbers and formats", "spindle and coolant between cuts", "codes without motion that a "
              "controller file passes over", "positions of the axes")
COLOURS = ("#0072b2", "#d55e00")
"""of A and B, for all eyes (Okabe and Ito)"""


def as_dict(found: ProgramDifferences, names: tuple[str, str], seconds: tuple[float, float],
            tolerance: tuple[float, float]) -> dict[str, Any]:
    """Figures of --json; `tolerance`: mm and rad within which paths count as the same."""
    cuts, links = found.same_cuts(*tolerance), found.same_links(*tolerance)
    return {"a": names[0], "b": names[1], "same": cuts and links, "same_cuts": cuts, "same_links": links, "cuts": found.cuts,
            "cycle_time_s": list(seconds), "worst_cut": _pair(found.worst(True)), "worst_link": _pair(found.worst(False)),
            "apart": [_pair(one) for one in found.pairs if one.cut and _apart(one, tolerance)],
            "lone": [{"program": one.program, **_lines(line=one.line), "length_mm": one.length,
                      "cut": one.cut} for one in found.lone],
            "states": [_state(one) for one in found.states], "events": [_state(one) for one in found.events],
            "not_compared": list(not_compared(found))}


def _state(one: StateDifference) -> dict[str, Any]:
    return {"what": one.what, "a": one.value_a, "b": one.value_b, "cuts": one.count,
            **_lines(line_a=one.line_a, line_b=one.line_b)}


def _lines(**named: ProgramLine) -> dict[str, Any]:
    """Lines, and files of those in a subprogram's own."""
    files = {name.replace("line", "file"): one.file for name, one in named.items() if one.file}
    return {name: one.line for name, one in named.items()} | files


def not_compared(found: ProgramDifferences) -> tuple[str, ...]:
    """What "the same" says nothing of."""
    other = () if found.one_control else ("work offsets, registers, smoothing and pecks, of two controls",)
    missing = ("stops and tool changes, where cuts are missing",) if any(one.cut for one in found.lone) else ()
    return (*UNCOMPARED, *other, *missing)


def _pair(one: StretchPair | None) -> dict[str, Any] | None:
    return None if one is None else {
        "cut": one.cut, **_lines(line_a=one.worst_a, line_b=one.worst_b), "tip_mm": one.gap.tip,
        "axis_deg": one.gap.axis / DEG, "reordered": one.gap.reordered}


def _stated(one: StateDifference) -> tuple[str, str]:
    """Lines of an event; "" in the program that has none."""
    return str(one.line_a) if one.line_a.line else "", str(one.line_b) if one.line_b.line else ""


def _apart(one: StretchPair, tolerance: tuple[float, float]) -> bool:
    return one.gap.tip > tolerance[0] or one.gap.axis > tolerance[1] or one.gap.reordered


def as_text(found: ProgramDifferences, names: tuple[str, str], seconds: tuple[float, float],
            tolerance: tuple[float, float]) -> str:
    """For people: first whether they cut the same, then what differs."""
    worst, rapid = found.worst(True), found.worst(False)
    cuts, links = ("the same" if one else "different" for one in (found.same_cuts(*tolerance), found.same_links(*tolerance)))
    lines = [f"A: {names[0]}", f"B: {names[1]}", f"cuts: {cuts}, {found.cuts} in A"]
    if worst:
        turned = max(one.gap.axis for one in found.pairs if one.cut) / DEG
        lines[-1] += f"; tips at most {worst.gap.tip:.6f} mm apart, axes {turned:.6f} degrees"
    lines.append(f"between cuts: {links}")
    if rapid:
        lines[-1] += f"; paths at most {rapid.gap.tip:.3f} mm apart, lines {rapid.worst_a} and {rapid.worst_b}"
    lines.append(f"time: A {clock(seconds[0])}, B {clock(seconds[1])}")
    apart = [one for one in found.pairs if one.cut and _apart(one, tolerance)]
    lines += _table("cuts apart", [(one.worst_a, one.worst_b, f"{one.gap.tip:.4f}", f"{one.gap.axis / DEG:.4f}",
                                    "other order" if one.gap.reordered else "") for one in apart],
                    ("line A", "line B", "mm", "degrees", ""), "rrrrl")
    alone = [(one.program.upper(), one.line, f"{one.length:.1f}", "" if one.cut else "between cuts") for one in found.lone]
    lines += _table("in one program alone", alone, ("in", "line", "mm", ""), "lrrl")
    lines += _table("states of cuts", [(one.what, one.value_a, one.value_b, one.count, one.line_a, one.line_b)
                                       for one in found.states], ("", "A", "B", "cuts", "line A", "line B"), "lllrrr")
    lines += _table("stops and tool changes", [(one.what, one.value_a, one.value_b, *_stated(one))
                                               for one in found.events], ("", "A", "B", "line A", "line B"), "lllrr")
    lines.append(f"not compared: {'; '.join(not_compared(found))}")
    return "\n".join(lines)


def _table(title: str, rows: Sequence[tuple[object, ...]], heads: tuple[str, ...], align: str) -> list[str]:
    if not rows:
        return []
    more = [f"  and {len(rows) - SHOWN} more: --json has them all"] if len(rows) > SHOWN else []
    return [f"{title}:", *table_text(rows[:SHOWN], heads, align, indent=2), *more]


def overlay(programs: tuple[ExecutedProgram, ExecutedProgram], names: tuple[str, str], ending: FigureEnding) -> bytes:
    """Cuts of both programs over each other, from above and from the front; mm on the table."""
    drawn = [stretches(one) for one in programs]

    def view(columns: tuple[int, int], labels: tuple[str, str]) -> Callable[[Any], None]:
        def fill(axes: Any) -> None:
            for one, colour, name, width in zip(drawn, COLOURS, ("A", "B"), (2.4, 0.9), strict=True):
                for k in range(len(one)):
                    if one.cut[k]:
                        tip = one.tip[one.first[k]:one.last[k] + 1]
                        axes.plot(tip[:, columns[0]], tip[:, columns[1]], color=colour, linewidth=width)
                axes.plot([], [], color=colour, linewidth=width, label=name)
            axes.set_aspect("equal")
            axes.set_xlabel(f"{labels[0]}, mm")
            axes.set_ylabel(f"{labels[1]}, mm")
            axes.legend()
        return fill

    def sheet(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        view((0, 1), ("x", "y"))(left)
        view((0, 2), ("x", "z"))(right)

    return image((11.0, 5.5), f"A {names[0]}   B {names[1]}", sheet, ending)
