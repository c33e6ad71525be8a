"""Estimates next to each other: programs, set-ups, machines, and what another value would give."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from postproc.cycle_time.estimate import Estimate
from postproc.cycle_time.report import clock
from postproc.cycle_time.shares import CAUSES, shares
from postproc.time_study.tables import LEAST
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, info
from toolpaths.table_text import table_text


@dataclass(frozen=True)
class Variant:
    """One column: what it is called, what it is made of, its estimate."""

    name: str
    file: str
    machine: str
    setup: str
    what_if: str
    estimate: Estimate


def as_dict(variants: Sequence[Variant]) -> list[dict[str, object]]:
    """Each variant with its times by cause, and its difference to the first."""
    first = variants[0].estimate.seconds
    return [
        {
            "name": v.name,
            "file": v.file,
            "machine": v.machine,
            "setup": v.setup,
            "what_if": v.what_if,
            "model": v.estimate.model.description or v.estimate.model.kind,
            "cycle_time_s": v.estimate.seconds,
            "lower_bound_s": v.estimate.lower_bound,
            "band_s": list(v.estimate.band),
            "difference_s": v.estimate.seconds - first,
            "difference_percent": 100.0 * (v.estimate.seconds / first - 1.0),
            "causes": causes(v.estimate),
        }
        for v in variants
    ]


def causes(e: Estimate) -> dict[str, float]:
    """s by cause."""
    return {f"{name}_s": float(values.sum()) for name, values in shares(e).by_cause.items()}


def as_text(variants: Sequence[Variant]) -> str:
    """A line for each variant: time, difference to the first, band, bound, s by cause."""
    first, by_cause = variants[0].estimate.seconds, [causes(v.estimate) for v in variants]
    shown = [name for name in CAUSES if max(each[f"{name}_s"] for each in by_cause) >= LEAST]
    heads = ("", "time", "to the first", "95 % from", "to", "bound", *(f"{name.replace('_', ' ')} s" for name in shown))
    rows = [
        (
            v.name,
            clock(v.estimate.seconds),
            f"{100.0 * (v.estimate.seconds / first - 1.0):+.1f} %" if k else "",
            *(clock(value) for value in (*v.estimate.band, v.estimate.lower_bound)),
            *(f"{by_cause[k][f'{name}_s']:.2f}" for name in shown),
        )
        for k, v in enumerate(variants)
    ]
    return "\n".join(table_text(rows, heads, align="l" + "r" * (len(heads) - 1)))


def names(parts: Sequence[tuple[str, ...]]) -> list[str]:
    """A short name for each variant: only those of its parts that differ; a second one of the same name is numbered."""
    differ = [k for k in range(len(parts[0])) if len({part[k] for part in parts}) > 1]
    result: list[str] = []
    count = Counter[str]()
    for part in parts:
        words = [part[k] or ("as it is" if k == len(part) - 1 else "no set-up") for k in differ]
        name = ", ".join(words) or part[0]
        count[name] += 1
        result.append(name if count[name] == 1 else f"{name} ({count[name]})")
    return result


def short(files: Sequence[Path]) -> list[str]:
    """The name of each file, with its folders where another of them has the same name."""
    places = {file.name: {one for one in files if one.name == file.name} for file in files}
    return [file.name if len(places[file.name]) == 1 else str(file) for file in files]


def without_effect(variants: Sequence[Variant]) -> list[Diagnostic]:
    """What-ifs that change neither time nor band: no block or no part of the control's model depends on them."""
    as_is = {(v.file, v.machine, v.setup): v.estimate for v in variants if not v.what_if}
    found = []
    for v in variants:
        e, first = v.estimate, as_is[v.file, v.machine, v.setup]
        if v.what_if and (e.seconds, e.lower_bound, e.band) == (first.seconds, first.lower_bound, first.band):
            found.append(info("time.no_effect", f"--what-if {v.what_if} changes nothing on {v.machine} with the model "
                              f"{e.model.kind}: nothing in the program depends on it", file=v.file))
    return found
