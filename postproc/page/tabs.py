"""Sections of the report that installed packages add: texts and tables made of the figures of a run, never markup."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.plug_ins import PlugIn, PlugInFault, plug_in, registered, said

MOST_ROWS, MOST_BLOCKS, MOST_LETTERS = 10_000, 100, 2_000
"""of a table, of a section, of a text or a cell: more is a fault of the package"""


@dataclass(frozen=True)
class TabTable:
    """A table of a section: heads of the columns, rows of as many cells, texts or numbers."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str | float]]


BlocksOf = Callable[[dict[str, Any]], Sequence[str | TabTable]]


@dataclass(frozen=True)
class ReportTab:
    """What a package registers in the group `postproc.report_tabs`.

    `blocks` is called with the figures of a run, as `report --json` has them below `runs` (docs/reference), and gives texts,
    each a paragraph, and tables in the order in which they stand.
    """

    title: str
    blocks: BlocksOf


def with_tabs(report: dict[str, Any]) -> tuple[dict[str, Any], list[Diagnostic]]:
    """The report with the sections of installed packages, `runs[].tabs`; a warning for each package that gives none."""
    tabs, found = _registered_tabs()
    runs = list[dict[str, Any]]()
    for run in report["runs"]:
        made = list[dict[str, Any]]()
        for given, tab in tabs:
            try:
                blocks = _blocks(given, tab, run)
            except PlugInFault as fault:
                found.append(warning("report.plug-in", f"{fault}; the page is without it", file=report["cl_file"],
                                     hint=fault.hint))
                continue
            made.append({"title": tab.title, "name": given.name, "package": given.package, "version": given.version,
                         "sha256": given.sha256, "blocks": blocks})
        runs.append(run | {"tabs": made})
    return report | {"runs": runs}, list(dict.fromkeys(found))


def _registered_tabs() -> tuple[list[tuple[PlugIn, ReportTab]], list[Diagnostic]]:
    tabs, found = list[tuple[PlugIn, ReportTab]](), list[Diagnostic]()
    for name, points in registered("postproc.report_tabs").items():
        try:
            given, tab = plug_in("postproc.report_tabs", name, points)
            if not (isinstance(tab, ReportTab) and isinstance(tab.title, str) and tab.title and callable(tab.blocks)):
                raise PlugInFault(f"the report tab {given} is no ReportTab", _correct(given))
        except PlugInFault as fault:
            found.append(warning("report.plug-in", f"{fault}; the page is without it", hint=fault.hint))
            continue
        tabs.append((given, tab))
    return tabs, found


def _blocks(given: PlugIn, tab: ReportTab, run: Mapping[str, Any]) -> list[str | dict[str, Any]]:
    """What stands in a section, as plain values.

    Raises:
        PlugInFault: where the package's code fails, or gives something else.
    """
    light = copy.deepcopy({key: value for key, value in run.items() if key not in ("points", "legs", "solids")})
    try:
        blocks = [_plain(block) for block in tab.blocks(light)]
        if len(blocks) > MOST_BLOCKS:
            raise ValueError(f"{len(blocks)} texts and tables, at most {MOST_BLOCKS} are shown")
    except (Exception, SystemExit) as fault:  # code of others: whatever it raises
        raise PlugInFault(f"the report tab {given} gives nothing: {said(fault)}", _correct(given)) from fault
    return blocks


def _plain(block: str | TabTable) -> str | dict[str, Any]:
    if isinstance(block, str):
        return block[:MOST_LETTERS]
    if not isinstance(block, TabTable):
        raise TypeError(f"{type(block).__name__} is neither a text nor a TabTable")
    heads, rows = [str(head)[:MOST_LETTERS] for head in block.heads], [[_cell(cell) for cell in row] for row in block.rows]
    if len(rows) > MOST_ROWS or any(len(row) != len(heads) for row in rows):
        raise ValueError(f"a table of {len(rows)} rows: at most {MOST_ROWS}, of as many cells as heads, are shown")
    return {"heads": heads, "rows": rows}


def _cell(value: object) -> str | float | None:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value) if math.isfinite(value) else None
    return str(value)[:MOST_LETTERS]


def _correct(given: PlugIn) -> str:
    return f"correct, reinstall or uninstall the package {given.package}"
