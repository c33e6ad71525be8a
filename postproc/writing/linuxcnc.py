"""What LinuxCNC needs beyond its data."""

from __future__ import annotations

import re

from postproc.writing.iso import IsoWriter

ACTIVE = re.compile(r"\s*(ABORT|LOG|LOGOPEN|LOGAPPEND|LOGCLOSE|PY|PYRUN|PYRELOAD|PROBEOPEN|PROBECLOSE|DEBUG|PRINT)\b",
                    re.IGNORECASE)
"""comments that LinuxCNC carries out (MSG only speaks)"""


class LinuxcncWriter(IsoWriter):
    """LinuxCNC: G64 with the share of the tolerance that blending may use."""

    def comment(self, text: str) -> str:
        """A comment; one that LinuxCNC would carry out becomes plain text."""
        return super().comment(f"text: {text}" if ACTIVE.match(text) else text)

    def smoothed(self, mm: float, blocks: tuple[str, ...]) -> list[str]:
        """G64 P (blending) and Q (merging of short lines); both add up to the share (measured: Q adds to P)."""
        if mm <= 0.0:
            return []
        blend, chain = self.share(mm * 2.0 / 3.0), self.share(mm / 3.0)
        return [block.format(tolerance=blend, chain=chain, axis="0") for block in blocks]
