"""Sheets of drawings as PNG or SVG: the same bytes from the same figures, what comes from files as it stands.

matplotlib is imported only where something is drawn, and needs no display.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.extras import need

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS: tuple[FigureEnding, ...] = get_args(FigureEnding)
"""by the ending of the file"""
DOTS = 130
"""per inch, of PNG"""
ADJACENT: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "fontsize": "small", "frameon": False}
"""where legends stand"""
LEVEL = 1e-6
"""share of a value below which its changes are rounding"""
TITLE = 90
"""characters of a title"""
_RULES: Any = {"svg.hashsalt": "postproc", "font.family": "DejaVu Sans", "axes.grid": True, "grid.alpha": 0.3,
               "axes.formatter.use_mathtext": False, "text.parse_math": False}


def image(size: tuple[float, float], title: str, fill: Callable[[Figure], None],
          ending: FigureEnding) -> bytes:
    """An image file of a sheet.

    Args:
        size: width and height, inches
        fill: draws into the empty figure
        ending: one of FORMATS

    Raises:
        ValueError: for another ending.
        DiagnosticError: where matplotlib is not installed.
    """
    if ending not in FORMATS:
        raise ValueError(f"no figure format {ending!r}; known: {', '.join(FORMATS)}")
    need("matplotlib", "drawings need")
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_RULES), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")
        sheet = Figure(figsize=size, dpi=DOTS, layout="constrained")
        sheet.suptitle(plain(title))
        fill(sheet)
        _settle(sheet)
        out = io.BytesIO()
        # As `savefig` does it, but for a drawing without output before, which only layouts that are not settled need.
        if ending == ".svg":
            FigureCanvasSVG(sheet).print_svg(out, metadata={"Date": None})
        else:
            FigureCanvasAgg(sheet).print_png(out, metadata={"Software": None})
    return out.getvalue()


def _settle(sheet: Figure) -> None:
    """Arrange the panels once, rounded: the solver's last digits change from run to run, and names in an SVG with them."""
    if engine := sheet.get_layout_engine():
        engine.execute(sheet)
    sheet.set_layout_engine("none")
    for place in sheet.axes:
        left, low, width, height = place.get_position(original=True).bounds
        place.set_position((round(left, 4), round(low, 4), round(width, 4), round(height, 4)))


def level(axes: Axes, values: Floats) -> None:
    """Room above and below a curve of values (N,) that are one number but for rounding, which else would fill the figure."""
    known = values[np.isfinite(values)]
    if known.size and float(np.ptp(known)) <= LEVEL * float(np.abs(known).max()):
        middle = float(known.mean())
        room = 0.1 * abs(middle) or 1.0
        axes.set_ylim(middle - room, middle + room)
    axes.ticklabel_format(axis="y", useOffset=False)


def plain(text: str) -> str:
    """One line of printable characters; a label that began with _ would be left out of a legend."""
    shown = printed(text)[:TITLE]
    return f" {shown}" if shown.startswith("_") else shown


def printed(text: str) -> str:
    """A mark for each character that does not print: controls, which XML does not hold, and signs that turn writing."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
