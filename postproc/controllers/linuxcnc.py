"""What LinuxCNC needs beyond its data."""

from __future__ import annotations

from postproc.controllers.iso import IsoWriter


class LinuxcncWriter(IsoWriter):
    """LinuxCNC: G64 with the share of the tolerance that blending may use."""

    def modes(self) -> list[str]:
        """G64 P (blending) and Q (merging of short lines); both add up to the share (measured: Q adds to P)."""
        block = self.controller.program.path_tolerance
        if not block or self.smoothing <= 0.0:
            return []
        return [block.format(tolerance=self.plain(self.smoothing * 2.0 / 3.0), chain=self.plain(self.smoothing / 3.0))]
