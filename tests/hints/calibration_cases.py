"""Hints of calibrations that ask for other readings: the same rows of a table left out, then measured."""

from __future__ import annotations

from tests.hints.case import Edit, HintCase
from tests.hints.error_cases import measured, sample

REVERSAL, BAR = sample("reversal.csv"), sample("ball_bar.csv")
CENTRE, WRONG = "centre = [0.0, 0.0, -90.0]", "centre = [0.0, 0.0, -80.0]"


def _first(text: str, rows: int) -> str:
    """A table with its first rows alone."""
    return "\n".join(text.splitlines()[:rows]) + "\n"


def _less(code: str, table: str, rows: int, says: str) -> HintCase:
    """A table that ends early; the hint asks for the rest."""
    whole = sample(table)
    short = _first(whole, rows)
    return measured(code, says, table, whole, short, Edit(table, short, whole))


def _silent(text: str) -> str:
    """Readings a thousandth as large."""
    title, head, *rows = text.splitlines()
    cells = [row.rpartition(",") for row in rows]
    return "\n".join([title, head, *(f"{rest},{float(reading) * 1e-3!r}" for rest, _, reading in cells)]) + "\n"


def _in_inches(text: str) -> str:
    """The first column divided by 25.4, and not its unit."""
    title, head, *rows = text.splitlines()
    cells = [row.partition(",") for row in rows]
    return "\n".join([title, head, *(f"{float(x) / 25.4!r},{rest}" for x, _, rest in cells)]) + "\n"


CALIBRATION = [
    _less("calibrate.few", "laser.csv", 32, "measure more than is asked for"),
    _less("calibrate.unchecked", "laser.csv", 28, "measure more than is asked for"),
    _less("calibrate.rank", "laser.csv", 16, "measure where they differ"),
    _less("calibrate.rank", "reversal.csv", 14, "measure one more set-up"),
    measured("calibrate.place", r"(centre = \[.*?\]) where that is right", "ball_bar.csv", "", "",
             Edit("ball_bar.toml", WRONG, r"\1"), harm=(Edit("ball_bar.toml", CENTRE, WRONG),)),
    measured("calibrate.place", r"look at (tool_length) = 80", "ball_bar.csv", "", "",
             Edit("ball_bar.toml", "tool_length = 80.0", r"\1 = 90.0"),
             harm=(Edit("ball_bar.toml", "tool_length = 90.0", "tool_length = 80.0"),)),
    measured("calibrate.silent", r"write (sigma_arcsec = \S+)", "reversal.csv", REVERSAL, _silent(REVERSAL),
             Edit("reversal.toml", "sigma_arcsec = 0.05", r"\1")),
    measured("calibrate.converged", "check (units) and signs of the table", "ball_bar.csv", BAR, _in_inches(BAR),
             Edit("ball_bar.csv", "X [mm]", "X [in]")),
]
