"""What Fanuc needs beyond its data."""

from __future__ import annotations

from postproc.writing.iso import IsoWriter


class FanucWriter(IsoWriter):
    """Fanuc 30i: comments in capitals, which every model of the family shows."""

    def comment(self, text: str) -> str:
        """A comment in capitals."""
        return super().comment(text.upper())
