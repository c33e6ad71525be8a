"""Faults in what executes programs in macro language: frames, circles in them, patterns of holes, calls."""

from __future__ import annotations

from tests.mutants.plant import Fault

ROOM = "executed programs"
FAULTS = (
    Fault("AROT before the frame in force", ROOM, "SiemensWords._take_frame", "self.turned.frame.before(frame)",
          "frame.before(self.turned.frame)"),
    Fault("G2 and G3 as they are under MIRROR", ROOM, "TurnedBlocks._swapped",
          "_OTHER.get(code, code) if size < 0.0 else code", "code"),
    Fault("I and J not scaled", ROOM, "TurnedBlocks._centres", "self.frame.vector((a, b, c))", "(a, b, c)"),
    Fault("I=AC() without the shift of TRANS", ROOM, "SiemensWords._how",
          "value + self.track.shift(axis) / self.track.scale(axis)", "value"),
    Fault("HOLES2 with INDA 0 at one place", ROOM, "_circle", "step = step or 360.0 / count", "pass"),
    Fault("position kept over CYCLE800", ROOM, "SiemensWords._framed", '("TRAORI", "TRAFOOF", "CYCLE800(")', '("NONE",)'),
    Fault("full circles without the code of motion", ROOM, "TurnedBlocks.row", "goes = bool(ends or centres)",
          "goes = bool(ends)"),
    Fault("patterns of G18 in X and Y", ROOM, "SiemensWords._pattern", "IN_PLANE[self.track.plane]", "IN_PLANE[17]"),
    Fault("SAVE without effect", ROOM, "SiemensMacros.back", "if level.saved is not None:", "if False:"),
)
