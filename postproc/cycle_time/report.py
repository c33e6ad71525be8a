"""The figures of an estimate, as JSON and for people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from postproc.cycle_time.estimate import Estimate, Uncertain
from postproc.cycle_time.shares import TimeShares, exact_stops, losses, most_expensive, operations, shares
from toolpaths.table_text import table_text

COVERS = ("95 % of runs on a machine as the files describe it: the model's own deviation, and parameters of the control and "
          "limits of the machine that no document states")


def as_dict(e: Estimate, first: Uncertain | None = None) -> dict[str, Any]:
    """The keys of `time --json`; s. `first` is the assumed value that widens the band most."""
    s = shares(e)
    cause = {f"{name}_s": float(values.sum()) for name, values in s.by_cause.items()}
    rests, lost = exact_stops(e)
    return {
        "cycle_time_s": e.seconds,
        "lower_bound_s": e.lower_bound,
        "band_s": list(e.band),
        "band_covers": COVERS,
        "model": e.model.kind,
        "model_description": e.model.description,
        "assumed": list(e.model.assumed),
        "doubts_s": e.uncertainties,
        "measure_first": asdict(first) if first is not None else None,
        "blocks": len(e.blocks),
        "cutting_s": _cutting(cause),
        "rapids_s": cause["rapids_s"],
        "causes": cause,
        "feed_s": s.feed,
        "exact_stops": {"blocks": rests, "lost_s": lost},
        "limiting": {letter: {"velocity_s": v, "acceleration_s": a, "jerk_s": j}
                     for letter, (v, a, j) in s.limiting.items()},
        "operations": [{**op, "cutting_s": _cutting(op)} for op in operations(e, s)],
        "most_expensive": most_expensive(e, s),
    }


def _cutting(cause: dict[str, Any]) -> float:
    """s of blocks at feed, with what corners, stops and limits cost them."""
    return float(sum(cause[f"{name}_s"] for name in ("feed", "limits", "corners", "stops")))


def as_text(e: Estimate, name: str, override: float = 1.0, first: Uncertain | None = None,
            tables: Sequence[str] = ()) -> str:
    """The same for people; `override` is the feed override that the blocks were made with, `tables` lines of those by tool
    and
    operation."""
    d, s = as_dict(e), shares(e)
    whole = clock(e.seconds) + (f" ({e.seconds:.2f} s)" if e.seconds >= 60.0 else "")
    lines = [f"{name}: {whole}, 95 % between {clock(e.band[0])} and {clock(e.band[1])}; "
             f"lower bound {clock(e.lower_bound)}",
             f"model {e.model.kind}: {e.model.description}"]
    feed = "the programmed feed"
    if override != 1.0:
        feed = f"feeds at {100.0 * override:g} %"
        lines.append(f"feed override {100.0 * override:g} %: of feeds, not of rapids, taps and dwells")
    if e.model.assumed:
        lines.append(f"assumed, not documented: {', '.join(e.model.assumed)}")
    if first is not None:
        lines.append(f"measure this first: {first.value}, assumed {first.assumed}: it widens the band most, one standard "
                     f"deviation of it is {first.seconds:.2f} s")
    lines.append("time by activity: " + ", ".join(f"{key.removesuffix('_s').replace('_', ' ')} {value:.2f} s"
                                         for key, value in d["causes"].items() if value >= 0.005))
    rests = d["exact_stops"]
    if rests["blocks"]:
        lines.append(f"exact stops (G60, G9, G61): at {rests['blocks']} blocks, {rests['lost_s']:.2f} s")
    lines += _limits(s, d["feed_s"])
    lines += tables
    lost = [row for row in losses(e, s) if float(str(row["lost_s"])) >= 0.005]
    if lost:
        rows = [(str(row["cause"]).replace("_", " "), f"{row['lost_s']:.2f} s", f"{row['places']}",
                 ", ".join(map(str, _numbers(row["nc_lines"])))) for row in lost]
        lines += [f"losses against {feed}:",
                  *table_text(rows, ("cause", "lost", "lines", "most at NC line"), align="lrr", indent=2)]
        lines += _worst(d["most_expensive"])
    return "\n".join(lines)


def _numbers(value: object) -> list[object]:
    return list(value) if isinstance(value, list) else []


def _worst(places: list[dict[str, Any]]) -> list[str]:
    """The place with the largest loss."""
    if not places:
        return []
    place = places[0]
    cl = f", CL line {place['cl_line']}" if place["cl_line"] is not None else ""
    cause = place["cause"].replace("_", " ")
    return [f"largest single loss: NC line {place['nc_line']}{cl}, {place['lost_s']:.3f} s, {cause}"]


def _limits(s: TimeShares, feed: float) -> list[str]:
    rows = [f"  {letter}: velocity {v:.2f} s, acceleration {a:.2f} s, jerk {j:.2f} s"
            for letter, (v, a, j) in s.limiting.items() if v + a + j >= 0.005]
    return [f"limited by programmed feed {feed:.2f} s, by axes:", *rows] if rows else []


def clock(seconds: float) -> str:
    """h:mm:ss, or s below a minute."""
    if seconds < 60.0:
        return f"{seconds:.2f} s"
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
