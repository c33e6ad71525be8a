"""The stock that a program states for the control's graphics (BLK FORM), against that of the set-up."""

from __future__ import annotations

import re
from string import Formatter

from postproc.base.header_words import HEADER
from postproc.job.job import Job
from postproc.readback.comparison.faults import Faults
from postproc.readback.dialects.base import as_bytes
from toolpaths.diagnostics import Diagnostic

NAMES = ("x0", "y0", "z0", "x1", "y1", "z1")
NEAR = 1e-3
"""mm that a figure may be off: its last decimal"""
_NUMBER = r"([-+]?\d+\.?\d*)"


def check_stock(data: bytes | str, job: Job, faults: Faults) -> list[Diagnostic]:
    """Figures of the stock that differ; nothing where program or set-up state none."""
    if job.setup.rewind.stock is None:
        return []
    text = as_bytes(data[:HEADER]).decode("latin-1")
    wanted = dict(zip(NAMES, job.stock.ravel().tolist(), strict=True))
    for block in job.controller.program.stock:
        parts = list(Formatter().parse(block))
        found = re.search("".join(re.escape(plain) + (_NUMBER if name else "") for plain, name, _, _ in parts), text)
        for name, figure in zip((name for _, name, _, _ in parts if name), found.groups() if found else (), strict=False):
            value = float(figure) * job.controller.unit
            if found and abs(value - wanted[name]) > NEAR:
                which = "least" if name.endswith("0") else "greatest"
                return [faults.error("verify.stock", f"the stock's {which} {name[0].upper()} is stated as {value:.4f} mm, "
                                     f"the set-up has it at {wanted[name]:.4f} mm in the work offset", 0,
                                     text.count("\n", 0, found.start()) + 1,
                                     hint="convert again, or correct [rewind.stock] of the set-up")]
    return []
