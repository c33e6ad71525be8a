"""What may have happened to a table of measurements, as values; worded by `str` for the hint of a diagnostic."""

from __future__ import annotations

from typing import Literal

from machines.calibration.noise import Noise
from toolpaths.dataclass import dataclass

TableChange = Literal["sign", "columns", "unit", "tenfold", "tenth", "toward", "frame", "order", "steps", "indexer"]
_WORDS: dict[TableChange, str] = {
    "sign": "with {what} turned round", "columns": "with {what} changed over",
    "unit": "with {what} in {to} (write [{to}] in the header)", "tenfold": "with {what} ten times as large",
    "tenth": "with {what} a tenth as large", "toward": "with toward along {to}",
    "frame": "with dx, dy, dz along the machine instead of the table", "order": "with the set-ups in the other order",
    "steps": "with the steps counted in the other direction",
    "indexer": "with the indexer turned in the other direction, shifts = {to},"}


@dataclass(frozen=True)
class Remedy:
    """One change of a table: `what` of it, and `to` which unit, axis or list of shifts."""

    change: TableChange
    what: str = ""
    to: str = ""

    def __str__(self) -> str:
        return _WORDS[self.change].format(what=self.what, to=self.to)


@dataclass(frozen=True)
class TriedRemedy:
    """A fault put right, and what is then left; `size` as in `TableFault`."""

    remedy: Remedy
    noise: Noise | None
    size: bool = False


@dataclass(frozen=True)
class TableFault:
    """What explains the readings: any of `remedies`, with `left` times the stated noise then left, instead of more of it
    (`louder`) or less; `size` True where it is their unit, for which the noise alone may speak."""

    remedies: tuple[Remedy, ...]
    left: float
    louder: bool
    size: bool

    def __str__(self) -> str:
        left = f"only {self.left:.3g} times would be left" if self.louder else f"{self.left:.3g} times is left"
        return f"{' or '.join(map(str, self.remedies))} {left}"
