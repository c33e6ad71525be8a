"""Tables of times: by tool, by operation and cause, losses by cause; as figures, for people, as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from postproc.cycle_time.blocks import Cause
from postproc.cycle_time.estimate import Estimate
from postproc.cycle_time.phases import summed
from postproc.cycle_time.report import clock
from postproc.cycle_time.shape import shape, tip_travel
from postproc.cycle_time.shares import CAUSES, TimeShares, by_group, losses, operations
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.table_text import table_text

TableRow = dict[str, object]
LEAST = 0.005
"""s below which a column of a table for people says nothing"""


@dataclass(frozen=True)
class TimeTables:
    """Rows of the tables of one estimate, s and mm in their keys: by tool, by operation, losses by cause."""

    tools: list[TableRow]
    operations: list[TableRow]
    losses: list[TableRow]


def tables(e: Estimate, s: TimeShares) -> TimeTables:
    """All tables of an estimate."""
    return TimeTables(by_tool(e, s), operations(e, s), losses(e, s))


def by_tool(e: Estimate, s: TimeShares) -> list[TableRow]:
    """Minutes in cut, distances and changes of each tool, in the order of first use; -1 where the program states none.

    Cuts by the tip's path on the part, rapids by that of the axes.

    A tool change counts with the tool that it loads, and so does the start of its spindle."""
    blocks = e.blocks
    tool = blocks.tool if blocks.tool is not None else np.full(len(blocks), -1)
    number, first, index = np.unique(tool, return_index=True, return_inverse=True)
    linear = np.linalg.norm(np.diff(blocks.xyz, axis=0), axis=1) > 0.0
    length = np.where(linear | blocks.arc, shape(blocks).length, 0.0)
    cut = tip_travel(blocks)
    cutting = ~blocks.rapid
    p, change = blocks.pauses, blocks.pauses.cause == Cause.TOOL_CHANGE
    after = index[np.minimum(p.block[change] + 1, len(blocks) - 1)]
    changes = np.bincount(after, minlength=len(number))

    def sums(values: Floats) -> Floats:
        return summed(values, index, len(number))

    columns = {
        "time_s": sum(by_group(e, s, index, len(number)).values(), np.zeros(len(number))),
        "in_cut_s": sums(np.where(cutting, e.timed.seconds, 0.0)),
        "rapids_s": sums(s.by_cause["rapids"]),
        "cut_mm": sums(np.where(cutting, cut, 0.0)),
        "rapid_mm": sums(np.where(cutting, 0.0, length)),
    }
    return [
        {"tool": int(number[k]), **{name: float(values[k]) for name, values in columns.items()}, "changes": int(changes[k])}
        for k in np.argsort(first).tolist()
    ]


def as_text(t: TimeTables) -> list[str]:
    """The tables for people."""
    lines = [
        "by tool:",
        *table_text(
            [
                (
                    f"T{row['tool']}" if int(str(row["tool"])) >= 0 else "no tool",
                    _clock(row["time_s"]),
                    _clock(row["in_cut_s"]),
                    f"{float(str(row['cut_mm'])) / 1000.0:.2f}",
                    f"{float(str(row['rapid_mm'])) / 1000.0:.2f}",
                    str(row["changes"]),
                )
                for row in t.tools
            ],
            ("tool", "time", "in cut", "cut m", "rapid m", "changes"),
            align="lrrrrr",
            indent=2,
        ),
    ]
    if len(t.operations) > 1:
        shown = [name for name in CAUSES if sum(float(str(row[f"{name}_s"])) for row in t.operations) >= LEAST]
        lines += [
            "by operation, s:",
            *table_text(
                [
                    (
                        row["operation"] or "without a name",
                        _clock(row["time_s"]),
                        *(f"{float(str(row[f'{name}_s'])):.1f}" for name in shown),
                    )
                    for row in t.operations
                ],
                ("operation", "time", *(name.replace("_", " ") for name in shown)),
                align="l" + "r" * (1 + len(shown)),
                indent=2,
            ),
        ]
    return lines


def _clock(value: object) -> str:
    return clock(float(str(value)))


def as_csv(named: Sequence[tuple[str, Estimate, TimeTables]]) -> str:
    """All tables of some estimates, one figure a line: program, table, row, quantity (unit in its name), value."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("program", "table", "row", "quantity", "value"))
    for name, e, t in named:
        whole = {"time_s": e.seconds, "lower_bound_s": e.lower_bound, "band_low_s": e.band[0], "band_high_s": e.band[1]}
        rows: list[tuple[str, str, TableRow]] = [("program", "", dict(whole))]
        rows += [("tool", f"T{row['tool']}", {k: v for k, v in row.items() if k != "tool"}) for row in t.tools]
        rows += [
            ("operation", str(row["operation"]), {k: v for k, v in row.items() if k != "operation"}) for row in t.operations
        ]
        rows += [("cause", str(row["cause"]), {k: row[k] for k in ("lost_s", "places")}) for row in t.losses]
        for table, row, values in rows:
            writer.writerows(
                (name, table, row, quantity, f"{value:.6g}" if isinstance(value, float) else value)
                for quantity, value in values.items()
            )
    return out.getvalue()
