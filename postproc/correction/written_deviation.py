"""The deviation that is left of geometric errors once a program is written, as figures."""

from __future__ import annotations

from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG


@dataclass(frozen=True)
@arrays(tip="M", axis="M", points="M", blocks="M")
class AfterFormatting:
    """Deviation of the machine with errors at the CL points of a written program, mm and rad.

    Attributes:
        tip, axis: (M,) at each of the `points`
        points: (M,) numbers of the moves without pecks that come there
        blocks: (M,) of the program, ending there
        tip_bound, axis_bound: what correction, rounding of the words and lost motion may leave together
    """

    tip: Floats
    axis: Floats
    points: Ints
    blocks: Ints
    tip_bound: float
    axis_bound: float

    def line(self) -> str:
        """One line for the summary."""
        arcsec = DEG / 3600.0
        return (f"geometric errors after formatting, at {len(self.points)} CL points: tip {_worst(self.tip) * 1e3:.2f} um, "
                f"axis {_worst(self.axis) / arcsec:.2f} arcsec; bound {self.tip_bound * 1e3:.2f} um and "
                f"{self.axis_bound / arcsec:.2f} arcsec")

    def figures(self) -> dict[str, float]:
        """The worst, and the bounds: mm and degrees."""
        return {"tip_after_mm": _worst(self.tip), "axis_after_deg": _worst(self.axis) / DEG,
                "tip_bound_mm": self.tip_bound, "axis_bound_deg": self.axis_bound / DEG}


def _worst(values: Floats) -> float:
    return float(values.max(initial=0.0))
