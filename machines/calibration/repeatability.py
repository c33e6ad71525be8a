"""Repeatability of an axis from readings at one or several positions, approached again and again.

Of each position and direction: mean, standard deviation s with n - 1 and the maximum interval, as chapter 3.2 of Oueslati
2004 states 42 readings (largest less least); unidirectional repeatability 4 s, reversal value and bi-directional
repeatability of ISO 230-2 (2014), 3.8 to 3.15. The root mean square is with n, about the mean of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.geometric_error.tables.csv_table import ANGLES, CsvTable, read_csv
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.drawing import image
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST = 2
"""readings of a position from one side that have a standard deviation"""
MICRO, ARCSEC = 1e-3, ANGLES["arcsec"]


@dataclass(frozen=True, eq=False)
@arrays(reading="N", position="N", approach="N")
class RepeatedReadings:
    """Readings, where they were taken (one number where no column says) and from which side (1, -1, 0 not known); mm,
    rad."""

    reading: Floats
    position: Floats
    approach: Floats
    angle: bool

    @property
    def unit(self) -> tuple[float, str]:
        """What figures are in: um or arcsec."""
        return (ARCSEC, "arcsec") if self.angle else (MICRO, "um")

    @property
    def figures(self) -> dict[str, Any]:
        """All of it; units in the keys."""
        size, unit = self.unit
        rows = [self._row(place, approach) for place in np.unique(self.position) for approach in np.unique(self.approach)
                if ((self.position == place) & (self.approach == approach)).any()]
        whole = self.reading / size
        found: dict[str, Any] = {
            "readings": len(self.reading), f"interval_{unit}": float(np.ptp(whole)), f"mean_{unit}": float(whole.mean()),
            f"standard_deviation_{unit}": float(whole.std(ddof=1)), f"rms_{unit}": float(whole.std()), "positions": rows,
            f"unidirectional_repeatability_{unit}": max(row[f"repeatability_{unit}"] for row in rows)}
        return found | self._both(rows, unit)

    def _row(self, place: float, approach: float) -> dict[str, Any]:
        size, unit = self.unit
        own = self.reading[(self.position == place) & (self.approach == approach)] / size
        s = float(own.std(ddof=1)) if len(own) >= LEAST else float("nan")
        return {"position": float(place / (ANGLES["deg"] if self.angle else 1.0)), "approach": int(approach),
                "readings": len(own),
                f"mean_{unit}": float(own.mean()), f"standard_deviation_{unit}": s, f"interval_{unit}": float(np.ptp(own)),
                f"repeatability_{unit}": 4.0 * s}

    def _both(self, rows: Sequence[dict[str, Any]], unit: str) -> dict[str, Any]:
        """Reversal and bi-directional repeatability where positions were approached from both sides."""
        sides = {approach: {row["position"]: row for row in rows if row["approach"] == approach} for approach in (1, -1)}
        places = sorted(set(sides[1]) & set(sides[-1]))
        if not places:
            return {}
        pairs = [(sides[1][place], sides[-1][place]) for place in places]
        back = [up[f"mean_{unit}"] - down[f"mean_{unit}"] for up, down in pairs]
        both = [max(2.0 * up[f"standard_deviation_{unit}"] + 2.0 * down[f"standard_deviation_{unit}"] + abs(gap),
                    up[f"repeatability_{unit}"], down[f"repeatability_{unit}"])
                for (up, down), gap in zip(pairs, back, strict=True)]
        return {f"reversal_{unit}": max(back, key=abs), f"mean_reversal_{unit}": float(np.mean(back)),
                f"bidirectional_repeatability_{unit}": max(both)}


def read_repeated(file: Path) -> tuple[RepeatedReadings | None, list[Diagnostic]]:
    """The readings of a table with a column `reading` [um, arcsec, ...], and where there are, `position` and `approach`."""
    table, found = read_csv(file)
    return (None, found) if table is None else _checked(table, found)


def _checked(table: CsvTable, found: list[Diagnostic]) -> tuple[RepeatedReadings | None, list[Diagnostic]]:
    reading = table.columns.get("reading")
    if reading is None or not table.unit["reading"]:
        return None, [*found, error(
            "repeatability.column", f"{Path(table.file).name} has no column `reading` with a unit", file=table.file,
            lines=[table.head], hint="write reading [arcsec] or reading [um]; next to it position [deg], approach (1, -1)")]
    angle = table.unit["reading"] in ANGLES
    approach = table.columns.get("approach", np.zeros(len(reading)))
    position = table.columns.get("position", np.zeros(len(reading)))
    bad = ~np.isin(approach, (-1.0, 0.0, 1.0))
    if bad.any():
        row = int(np.argmax(bad))
        return None, [*found, error(
            "repeatability.approach", f"approach is {approach[row]:g}", file=table.file, lines=[table.lines[row]],
            hint="write 1 where the axis came from lesser values, -1 from greater ones")]
    made = RepeatedReadings(reading, position, approach, angle)
    groups = [(place, side) for place in np.unique(position) for side in np.unique(approach[position == place])]
    few = [place for place, side in groups if ((position == place) & (approach == side)).sum() < LEAST]
    if few:
        rows = [table.lines[k] for k in np.flatnonzero(np.isin(position, few))]
        return None, [*found, error("repeatability.few", f"{len(few)} positions have one reading from a side: they say "
                                                         "nothing "
                                    "of repeatability", file=table.file, lines=rows[:6], count=len(few),
                                    hint="read each position at least twice from each side, or leave it out")]
    return made, found


def repeated_figure(of: RepeatedReadings, title: str, ending: FigureEnding) -> bytes:
    """The readings one after the other, their mean and two standard deviations to both sides (figure 3.4)."""
    size, unit = of.unit
    whole = of.reading / size
    mean, s = float(whole.mean()), float(whole.std(ddof=1))

    def fill(sheet: Figure) -> None:
        axes = sheet.subplots()
        axes.plot(np.arange(1, len(whole) + 1), whole, "o-", color="#2456a6", markersize=3, linewidth=0.8)
        for value, style in ((mean, "-"), (mean - 2.0 * s, "--"), (mean + 2.0 * s, "--")):
            axes.axhline(value, color="#c0392b", linestyle=style, linewidth=0.8)
        axes.set_xlabel("reading")
        axes.set_ylabel(unit)

    return image((8.0, 4.5), f"{title}: interval {np.ptp(whole):.3g} {unit}, s {s:.3g} {unit}", fill, ending)
