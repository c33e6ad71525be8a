"""The index of a batch: a row for each task, as JSON, CSV and a page."""

from __future__ import annotations

import csv
import html
import io
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from postproc.batch.receipts import Outcome, Receipt
from postproc.batch.tasks import Task
from toolpaths.table_text import table_text

SHOWN = 10
"""tasks without a program that the summary names"""
LONGEST = 160
"""characters of their messages there; the index has them in full"""
COLUMNS = ("outcome", "job", "command", "file", "machine", "controller", "options", "output", "cycle_time_s",
           "worst_tip_deviation_mm", "blocks_out", "seconds", "processor_seconds", "kept", "messages")
_HEADS = {"outcome": "Outcome", "job": "Job", "file": "File", "machine": "Machine", "controller": "Controller",
          "options": "Options", "output": "Output", "cycle_time_s": "Cycle time",
          "worst_tip_deviation_mm": "Worst tip deviation, mm", "messages": "Messages"}
_STYLE = """body{font:15px/1.45 system-ui,sans-serif;margin:2rem;color:#1b1b1b;background:#fff}
table{border-collapse:collapse;width:100%}
th,td{text-align:left;vertical-align:top;padding:.3rem .6rem;border-bottom:1px solid #d0d0d0}
th{position:sticky;top:0;background:#f2f2f2}td.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
.done{color:#00591d}.refused,.use,.fault,.lost{color:#9c1c00;font-weight:600}.not{color:#5a5a5a}
td{overflow-wrap:anywhere}@media print{th{position:static}}"""
IndexRow = dict[str, Any]


def rows_of(tasks: Sequence[Task], receipts: Sequence[Receipt], kept: Sequence[bool], root: Path) -> list[IndexRow]:
    """A row for each task; files as seen from `root`, the folder of the index."""
    return [{"outcome": receipt.outcome, "job": task.job, "command": task.command, "file": str(task.file),
             "machine": task.machine, "controller": task.controller,
             "options": " ".join(f"{name}={value}" if value else name for name, value in task.options),
             "output": _output(task, receipt, root), "kept": before, "key": receipt.key, "seconds": receipt.seconds,
             "processor_seconds": receipt.processor_seconds, "worker": receipt.worker, "cycle_time_s": receipt.cycle_time,
             "worst_tip_deviation_mm": receipt.worst_tip, "blocks_out": receipt.blocks, "messages": list(receipt.messages)}
            for task, receipt, before in zip(tasks, receipts, kept, strict=True)]


def _output(task: Task, receipt: Receipt, root: Path) -> str:
    """What a task wrote, as seen from the index: its program, else its figures."""
    names = [file for file in (task.output, task.figures) if file is not None and str(file.relative_to(task.figures.parent))
             in receipt.outputs]
    return names[0].relative_to(root).as_posix() if names else ""


def as_csv(rows: Sequence[IndexRow]) -> str:
    """One line for each task; messages in one cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow([_inert(row[column])
                         for column in COLUMNS])
    return out.getvalue()


def _inert(value: Any) -> Any:
    """A cell that no spreadsheet takes for a formula; lines in one cell."""
    value = " | ".join(value) if isinstance(value, list) else value
    formula = isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t")
    return f"'{value}" if formula else "" if value is None else value


def as_page(rows: Sequence[IndexRow], title: str) -> str:
    """A page that opens offline; every text from files is escaped."""
    heads = "".join(f'<th scope="col">{html.escape(head)}</th>' for head in _HEADS.values())
    body = "\n".join(f"<tr>{''.join(_cell(column, row) for column in _HEADS)}</tr>" for row in rows)
    counts = ", ".join(f"{count} {outcome}" for outcome, count in counted(rows).items())
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>\n'
            f"<style>{_STYLE}</style></head>\n<body><h1>{html.escape(title)}</h1>\n<p>{len(rows)} runs: {counts}</p>\n"
            f"<table><thead><tr>{heads}</tr></thead><tbody>\n{body}\n</tbody></table></body></html>\n")


def _cell(column: str, row: IndexRow) -> str:
    return _CELLS.get(column, _text_cell)(row.get(column))


def _text_cell(value: Any) -> str:
    return f"<td>{html.escape(str(value or ''))}</td>"


def _outcome_cell(value: Any) -> str:
    return f'<td class="{html.escape(str(value).split()[-1])}">{html.escape(str(value))}</td>'


def _link_cell(value: Any) -> str:
    """Names of outputs hold letters that need no quoting in an address (`tasks._plain`)."""
    return f'<td><a href="{html.escape(value)}">{html.escape(value)}</a></td>' if value else "<td></td>"


def _time_cell(value: Any) -> str:
    return "<td></td>" if value is None else f'<td class="n">{clock(value)}</td>'


def _length_cell(value: Any) -> str:
    return "<td></td>" if value is None else f'<td class="n">{value:.5f}</td>'


def _lines_cell(value: Any) -> str:
    return f"<td>{'<br>'.join(map(html.escape, value))}</td>"


_CELLS: dict[str, Callable[[Any], str]] = {
    "outcome": _outcome_cell, "output": _link_cell, "cycle_time_s": _time_cell, "worst_tip_deviation_mm": _length_cell,
    "messages": _lines_cell}
"""columns that are more than their text"""


def clock(seconds: float) -> str:
    """Hours, minutes, seconds."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def counted(rows: Sequence[IndexRow]) -> dict[Outcome, int]:
    """Tasks by outcome, most first."""
    return dict(Counter(row["outcome"] for row in rows).most_common())


def as_text(rows: Sequence[IndexRow], tasks: Sequence[Task], index: Path, seconds: float) -> str:
    """The summary: how many of each outcome, and those without what was asked for."""
    kept = sum(row["kept"] for row in rows)
    counts = ", ".join(f"{count} {outcome}" for outcome, count in counted(rows).items())
    lines = [f"{len(rows)} runs: {counts}" + (f"; {kept} of them were done before" if kept else ""),
             f"time: {seconds:.1f} s, {sum(row['seconds'] for row in rows if not row['kept']):.1f} s of all workers",
             f"index: {index}"]
    bad = [(row["outcome"], task.name(), _cut((row["messages"] or [""])[0]))
           for row, task in zip(rows, tasks, strict=True) if row["outcome"] != "done"]
    lines += table_text(bad[:SHOWN], indent=2)
    return "\n".join([*lines, *([f"  and {len(bad) - SHOWN} more: see the index"] if len(bad) > SHOWN else [])])


def _cut(text: str) -> str:
    """As much of a message as stands on a line."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST].rstrip()} ..."
