"""A drawing of a program's time: speed and programmed feed along the path, what limits it, and time lost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.cycle_time.estimate import Estimate
from postproc.cycle_time.phases import summed
from postproc.cycle_time.report import clock
from postproc.cycle_time.shape import shape
from postproc.cycle_time.shares import TimeShares
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.drawing import ADJACENT, image
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIZE = (11.0, 8.0)
_BINS = 1500
"""stretches of path that are drawn; blocks of one stretch are drawn as their mean"""
_SPEED, _FEED = "#0072b2", "#e69f00"
_COLORS = {"velocity": "#0072b2", "acceleration": "#e69f00", "jerk": "#cc79a7"}
"""of the palette of M. Okabe and K. Ito (2008), that colour-blind people can distinguish"""
_LOST = {"corners": "#009e73", "stops": "#d55e00", "limits": "#56b4e9", "jerk": "#cc79a7"}


@dataclass(frozen=True)
@arrays(at="B", speed="B", feed="B", spent="3 B A", lost="4 B")
class AlongPath:
    """What is drawn, B stretches of path.

    Attributes:
        at (B,): m of path at the end of each; speed, feed (B,): mm/min, feed NaN in rapids
        spent (3, B, A): s in which the velocity, the acceleration, the jerk of each axis limits
        lost (4, B): s lost since the begin by corners, stops, limits, and to jerk
    """

    letters: tuple[str, ...]
    at: Floats
    speed: Floats
    feed: Floats
    spent: Floats
    lost: Floats


def along_path(e: Estimate, s: TimeShares) -> AlongPath:
    """The figures of the drawing."""
    blocks, times, form = e.blocks, e.timed, shape(e.blocks)
    length, feeding = form.length, ~e.blocks.rapid
    end = np.cumsum(length)
    edges = np.linspace(0.0, end[-1], min(_BINS, len(blocks)) + 1)
    index = np.clip(np.searchsorted(edges, end - length / 2.0, side="right") - 1, 0, len(edges) - 2)
    _, index = np.unique(index, return_inverse=True)
    count = int(index[-1]) + 1

    def sums(values: Floats) -> Floats:
        return summed(values, index, count)

    axes = blocks.axes
    with np.errstate(divide="ignore"):
        worst = {name: (getattr(axes, name) / np.maximum(form.share, 1e-300)).argmin(axis=1) for name in _COLORS}
        held = times.peak < np.where(feeding, blocks.speed, 0.0) * (1.0 - 1e-9)
    seconds = {"velocity": np.where(feeding & ~held, 0.0, times.steady), "acceleration": times.ramp, "jerk": times.jerk}
    spent = np.stack(
        [
            np.stack([sums(np.where(worst[name] == j, seconds[name], 0.0)) for j in range(len(axes.letters))], axis=1)
            for name in _COLORS
        ]
    )
    cut, asked = (
        sums(np.where(feeding, length, 0.0)),
        sums(np.where(feeding, length / np.maximum(blocks.speed, 1e-300), 0.0)),
    )
    moved, taken = sums(length), np.maximum(sums(times.seconds), 1e-12)
    lost = np.stack(
        [np.cumsum(sums(s.by_cause[name])) for name in ("corners", "stops", "limits")] + [np.cumsum(sums(times.jerk))]
    )
    return AlongPath(
        axes.letters,
        np.cumsum(moved) / 1000.0,
        60.0 * moved / taken,
        np.where(cut > 0.5 * moved, 60.0 * cut / np.maximum(asked, 1e-12), np.nan),
        spent,
        lost,
    )


def time_figure(e: Estimate, s: TimeShares, name: str, ending: FigureEnding) -> bytes:
    """An image file of an estimate."""
    shown = along_path(e, s)
    return image(_SIZE, f"{name}: {clock(e.seconds)}, model {e.model.kind}", lambda sheet: _fill(sheet, shown), ending)


def _fill(sheet: Figure, p: AlongPath) -> None:
    top, middle, low = sheet.subplots(3, 1, sharex=True, height_ratios=(2, 1.2, 1))
    edges = np.concatenate([[0.0], p.at])
    top.stairs(p.feed, edges, color=_FEED, linewidth=1.6, baseline=None, label="programmed feed")
    top.stairs(p.speed, edges, color=_SPEED, linewidth=0.9, baseline=None, label="speed, mean of a stretch")
    top.set_ylabel("speed, mm/min\n(turning axes alone: rad/min)")
    top.set_yscale("log")
    top.yaxis.set_major_formatter("{x:g}")
    rows = []
    for k, (name, color) in enumerate(_COLORS.items()):
        for j, letter in enumerate(p.letters):
            if p.spent[k, :, j].sum() > 0.01 * max(float(p.spent.sum()), 1e-12):
                most = p.spent[k, :, j] >= 0.999 * p.spent.max(axis=(0, 2))
                on = np.flatnonzero(most & (p.spent[k, :, j] > 0.0))
                rows.append(f"{letter} {name}")
                middle.broken_barh([(edges[b], edges[b + 1] - edges[b]) for b in on], (len(rows) - 1.4, 0.8), color=color)
    middle.set_yticks(range(len(rows)), rows)
    middle.set_ylabel("what limits most")
    for (name, color), values in zip(_LOST.items(), p.lost, strict=True):
        low.plot(
            p.at,
            values,
            color=color,
            linestyle="--" if name == "jerk" else "-",
            label="building up acceleration\n(jerk), rapids too" if name == "jerk" else name,
        )
    low.set_ylabel("time lost so far, s")
    low.set_xlabel("path, m")
    for panel in (top, low):
        panel.legend(**ADJACENT)
